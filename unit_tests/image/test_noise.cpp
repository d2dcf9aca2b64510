// Noise of a pair of images: white noise of a known size over textured ground is told, texture is not taken
// for it, nor are black and white pixels; small images; slices.
#include "image/noise.hpp"

#include <cmath>
#include <cstring>

#include "geometry/stereo_rig.hpp"
#include "support/cmocka.hpp"
#include "support/plane_scene.hpp"
#include "support/slices.hpp"

using namespace cairn;

namespace {

constexpr int kWidth = test::kSmallWidth;
constexpr int kHeight = test::kSmallHeight;
constexpr std::size_t kPixels = static_cast<std::size_t>(kWidth) * kHeight;
test::PlaneScene scene;
std::uint8_t left_pixels[kPixels];
std::uint8_t right_pixels[kPixels];
NoiseJob job;

ImageU8 view(const std::uint8_t* pixels) { return packed_view(pixels, kWidth, kHeight); }

void render(double left_noise, double right_noise) {
  const StereoRig rig = test::small_rig();
  Random random(3);
  scene.render(rig, rig.T_rover_cam, false, left_noise, random, left_pixels);
  scene.render(rig, rig.T_rover_cam, true, right_noise, random, right_pixels);
}

double measure(const ImageU8& left, const ImageU8& right) {
  job.start(left, right);
  assert_true(test::run_whole(job));
  return job.noise();
}

void test_noise_is_told_beside_texture(void**) {
  scene.make(5);
  render(0.0, 0.0);
  assert_at_most(measure(view(left_pixels), view(right_pixels)), 1.0);
  for (const double noise : {6.0, 10.0, 20.0, 30.0}) {
    render(noise, noise);
    const double told = measure(view(left_pixels), view(right_pixels));
    print_message("noise of %.0f: %.2f\n", noise, told);
    assert_at_most(told, 1.15 * noise);
    if (noise >= 10.0) assert_at_least(told, 0.8 * noise);  // less is lost in this ground's texture
  }
}

void test_of_two_images_the_mean_square(void**) {
  scene.make(5);
  render(20.0, 0.0);
  assert_near(measure(view(left_pixels), view(right_pixels)), 20.0 / std::sqrt(2.0), 3.0);
  render(0.0, 20.0);
  assert_near(measure(view(left_pixels), view(right_pixels)), 20.0 / std::sqrt(2.0), 3.0);
}

/// A black half, as of a shadow's, does not hide what the other one shows; nothing but black and
/// white shows none.
void test_black_and_white_tell_nothing(void**) {
  scene.make(5);
  render(20.0, 20.0);
  std::memset(left_pixels, 0, kPixels / 2);
  std::memset(right_pixels, 255, kPixels / 2);
  assert_near(measure(view(left_pixels), view(right_pixels)), 20.0, 4.0);
  for (std::size_t i = 0; i < kPixels; ++i) left_pixels[i] = right_pixels[i] = (i * i) % 7 < 3 ? 0 : 255;
  assert_near(measure(view(left_pixels), view(right_pixels)), 0.0, 0.0);
}

/// An edge along a row or a column, a ramp and a blurred image have no noise.
void test_edges_and_ramps_are_none(void**) {
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      left_pixels[y * kWidth + x] = static_cast<std::uint8_t>(x % 3 == 0 ? 200 : 50);
      right_pixels[y * kWidth + x] = static_cast<std::uint8_t>((x + y) / 3);
    }
  }
  assert_at_most(measure(view(left_pixels), view(right_pixels)), 1.0);
}

void test_small_images_tell_nothing(void**) {
  scene.make(5);
  render(20.0, 20.0);
  for (const int side : {8, 64}) {
    const ImageU8 corner = {left_pixels, side, side, kWidth};
    assert_near(measure(corner, corner), 0.0, 0.0);
  }
}

void test_slices_give_the_same_bits(void**) {
  scene.make(5);
  render(10.0, 10.0);
  const double whole = measure(view(left_pixels), view(right_pixels));
  job.start(view(left_pixels), view(right_pixels));
  assert_true(test::run_in_slices(job) > 3);
  assert_true(job.noise() == whole);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_noise_is_told_beside_texture),
      cmocka_unit_test(test_of_two_images_the_mean_square),
      cmocka_unit_test(test_black_and_white_tell_nothing),
      cmocka_unit_test(test_edges_and_ramps_are_none),
      cmocka_unit_test(test_small_images_tell_nothing),
      cmocka_unit_test(test_slices_give_the_same_bits),
  };
  return cmocka_run_group_tests_name("noise", tests, nullptr, nullptr);
}
