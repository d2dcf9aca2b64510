// From radiance to DN: each effect on its own, and the statistics of the noise.
#include "sim/sensor.hpp"

#include <limits>
#include <set>

#include "sim/hash_random.hpp"
#include "support/cmocka.hpp"

using namespace cairn::ground;
using namespace cairn::ground::sim;

namespace {

Camera plain() {
  Camera camera;
  camera.noise_dn = 0.0;
  camera.blur_px = 0.0;
  camera.vignetting = 0.0;
  return camera;
}

FloatImage uniform_image(int width, int height, float radiance) {
  return {width, height, std::vector<float>(static_cast<std::size_t>(width * height), radiance)};
}

int at(const Image& image, int x, int y) {
  return image.pixels[static_cast<std::size_t>(y * image.width + x)];
}

struct Statistics {
  double mean = 0.0;
  double deviation = 0.0;
  double kurtosis = 0.0;
};

Statistics statistics(const std::vector<double>& values) {
  Statistics s;
  for (const double v : values) s.mean += v / static_cast<double>(values.size());
  double fourth = 0.0;
  for (const double v : values) {
    const double d2 = (v - s.mean) * (v - s.mean);
    s.deviation += d2 / static_cast<double>(values.size());
    fourth += d2 * d2 / static_cast<double>(values.size());
  }
  s.kurtosis = fourth / (s.deviation * s.deviation);
  s.deviation = std::sqrt(s.deviation);
  return s;
}

/// The noise of one exposure of a uniform image: DN less the mean.
std::vector<double> noise_of(const Camera& camera, std::uint64_t seed, int frame, Side side) {
  static Image image;
  expose(uniform_image(512, 384, 0.1175F), camera, seed, frame, side, image);
  return {image.pixels.begin(), image.pixels.end()};
}

double correlation(const std::vector<double>& a, const std::vector<double>& b, std::size_t shift = 0) {
  const Statistics sa = statistics(a);
  const Statistics sb = statistics(b);
  double sum = 0.0;
  for (std::size_t i = 0; i + shift < a.size(); ++i) sum += (a[i] - sa.mean) * (b[i + shift] - sb.mean);
  return sum / (static_cast<double>(a.size() - shift) * sa.deviation * sb.deviation);
}

void test_hash_is_uniform_and_orderless(void**) {
  std::vector<double> values;
  std::set<std::uint64_t> seen;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    for (std::uint64_t a = 0; a < 100; ++a) {
      for (std::uint64_t b = 0; b < 100; ++b) {
        values.push_back(uniform(seed, Stream::kRocks, a, b));
        seen.insert(hash(seed, Stream::kRocks, a, b));
      }
    }
  }
  assert_int_equal(seen.size(), values.size());
  const Statistics s = statistics(values);
  assert_near(s.mean, 0.5, 0.004);  // 4 standard errors
  assert_near(s.deviation, 1.0 / std::sqrt(12.0), 0.003);
  int bins[20] = {};
  for (const double v : values) ++bins[static_cast<int>(v * 20.0)];
  double chi2 = 0.0;
  for (const int n : bins) chi2 += (n - 5000.0) * (n - 5000.0) / 5000.0;
  assert_at_most(chi2, 43.8);  // 19 degrees of freedom, 0.1 %
  // Arguments are not interchangeable, streams and seeds are independent.
  assert_true(hash(1, Stream::kRocks, 2, 3) != hash(1, Stream::kRocks, 3, 2));
  assert_true(hash(1, Stream::kRocks, 2, 3) != hash(2, Stream::kRocks, 1, 3));
  assert_true(hash(1, Stream::kRocks, 2, 3) != hash(1, Stream::kPebbles, 2, 3));
}

void test_normal_deviates(void**) {
  static std::vector<double> values;
  static std::vector<double> drawn;
  Draw draw(5, Stream::kRocks);
  for (std::uint64_t i = 0; i < 100000; ++i) {
    values.push_back(normal(3, Stream::kSlip, i));
    drawn.push_back(draw.normal());
  }
  for (const auto* v : {&values, &drawn}) {
    const Statistics s = statistics(*v);
    assert_near(s.mean, 0.0, 0.013);
    assert_near(s.deviation, 1.0, 0.01);
    assert_near(s.kurtosis, 3.0, 0.07);
  }
  assert_near(correlation(values, drawn), 0.0, 0.013);
}

void test_transfer(void**) {
  static Image image;
  const Camera camera = plain();
  const struct {
    float radiance;
    int dn;
  } cases[] = {{0.0F, 0},
               {0.47F, 255},
               {0.1175F, 128},  // a quarter: 127.5
               {0.047F, 81},
               {1.0F, 255},
               {-1.0F, 0},
               {std::numeric_limits<float>::quiet_NaN(), 0},
               {std::numeric_limits<float>::infinity(), 255}};
  for (const auto& c : cases) {
    expose(uniform_image(8, 4, c.radiance), camera, 1, 0, Side::kLeft, image);
    assert_int_equal(image.width, 8);
    assert_int_equal(image.height, 4);
    assert_int_equal(image.pixels.size(), 32);
    for (const int dn : image.pixels) assert_in_range(dn, c.dn == 128 ? 127 : c.dn, c.dn);
  }
}

void test_one_pixel_image(void**) {
  static Image image;
  Camera camera;
  camera.blur_px = 2.0;
  camera.dust_spots = 3;
  expose(uniform_image(1, 1, 0.2F), camera, 1, 0, Side::kLeft, image);
  assert_int_equal(image.pixels.size(), 1);
}

void test_noise_statistics(void**) {
  for (const double sigma : {1.0, 2.0, 5.0}) {
    Camera camera = plain();
    camera.noise_dn = sigma;
    const Statistics s = statistics(noise_of(camera, 7, 3, Side::kLeft));
    assert_near(s.mean, 127.5, 0.05);
    assert_near(s.deviation, std::sqrt(sigma * sigma + 1.0 / 12.0), 0.01 * sigma);
    if (sigma > 1.5) assert_near(s.kurtosis, 3.0, 0.06);
  }
}

void test_noise_reaches_both_ends(void**) {
  static Image image;
  Camera camera = plain();
  camera.noise_dn = 4.0;
  expose(uniform_image(256, 256, 0.0F), camera, 1, 0, Side::kLeft, image);
  int dark = 0;
  for (const int dn : image.pixels) {
    dark += dn == 0 ? 1 : 0;
    assert_in_range(dn, 0, 25);
  }
  assert_near(dark / 65536.0, 0.55, 0.01);  // half, and what is rounded down
  expose(uniform_image(256, 256, 0.47F), camera, 1, 0, Side::kLeft, image);
  for (const int dn : image.pixels) assert_in_range(dn, 230, 255);
}

void test_noise_is_never_shared(void**) {
  Camera camera = plain();
  camera.noise_dn = 4.0;
  const std::vector<double> left = noise_of(camera, 1, 10, Side::kLeft);
  const double bound = 4.5 / std::sqrt(512.0 * 384.0);
  assert_near(correlation(left, noise_of(camera, 1, 10, Side::kRight)), 0.0, bound);
  assert_near(correlation(left, noise_of(camera, 1, 11, Side::kLeft)), 0.0, bound);
  assert_near(correlation(left, noise_of(camera, 1, 9, Side::kRight)), 0.0, bound);
  assert_near(correlation(left, noise_of(camera, 2, 10, Side::kLeft)), 0.0, bound);
  // Nor along a row, from row to row, or aside by a disparity.
  for (const std::size_t shift : {1, 2, 8, 64, 511, 512, 513, 5120}) {
    assert_near(correlation(left, left, shift), 0.0, bound);
    assert_near(correlation(left, noise_of(camera, 1, 10, Side::kRight), shift), 0.0, bound);
  }
}

void test_same_bytes_in_any_order(void**) {
  Camera camera;
  camera.dust_spots = 10;
  camera.exposure_step_probability = 0.2;
  FloatImage radiance = uniform_image(64, 48, 0.0F);
  for (std::size_t i = 0; i < radiance.pixels.size(); ++i) {
    radiance.pixels[i] = static_cast<float>(0.4 * uniform(1, Stream::kTexture, i));
  }
  static std::vector<Image> forth(8);
  static Image again;
  for (int n = 0; n < 8; ++n) {
    expose(radiance, camera, 9, n / 2, n % 2 == 0 ? Side::kLeft : Side::kRight,
           forth[static_cast<std::size_t>(n)]);
  }
  for (int n = 7; n >= 0; --n) {
    expose(radiance, camera, 9, n / 2, n % 2 == 0 ? Side::kLeft : Side::kRight, again);
    assert_true(again.pixels == forth[static_cast<std::size_t>(n)].pixels);
  }
}

void test_blur_is_a_gaussian(void**) {
  static Image image;
  for (const double sigma : {0.4, 1.0, 3.0}) {
    Camera camera = plain();
    camera.blur_px = sigma;
    camera.white_radiance = 1.0;
    FloatImage radiance = uniform_image(65, 65, 0.0F);
    radiance.pixels[32 * 65 + 32] = static_cast<float>(2.0 * 3.14159265 * sigma * sigma);
    expose(radiance, camera, 1, 0, Side::kLeft, image);
    double norm = 0.0;
    for (int i = -10; i <= 10; ++i) norm += std::exp(-0.5 * i * i / (sigma * sigma));
    norm *= norm / (2.0 * 3.14159265 * sigma * sigma);
    for (int y = -2; y <= 2; ++y) {
      for (int x = -2; x <= 2; ++x) {
        const double expected = 255.0 * std::sqrt(std::exp(-0.5 * (x * x + y * y) / (sigma * sigma)) / norm);
        if (std::abs(x) > 3.0 * sigma + 0.8 || std::abs(y) > 3.0 * sigma + 0.8) continue;
        if (expected > 3.0) assert_near(at(image, 32 + x, 32 + y), std::min(255.0, expected), 1.1);
      }
    }
    // Level ground stays level, right to the edge.
    expose(uniform_image(20, 10, 0.25F), camera, 1, 0, Side::kLeft, image);
    for (const int dn : image.pixels) assert_in_range(dn, 127, 128);
  }
}

void test_blur_is_symmetric(void**) {
  static Image image;
  Camera camera = plain();
  camera.blur_px = 1.5;
  FloatImage radiance = uniform_image(31, 21, 0.05F);
  radiance.pixels[0] = 3.0F;
  radiance.pixels[20 * 31 + 30] = 3.0F;
  expose(radiance, camera, 1, 0, Side::kLeft, image);
  for (int y = 0; y < 21; ++y) {
    for (int x = 0; x < 31; ++x) assert_int_equal(at(image, x, y), at(image, 30 - x, 20 - y));
  }
}

void test_vignetting(void**) {
  static Image image;
  Camera camera = plain();
  camera.vignetting = 0.36;
  camera.white_radiance = 1.0;
  expose(uniform_image(101, 51, 1.0F), camera, 1, 0, Side::kLeft, image);
  assert_int_equal(at(image, 50, 25), 255);
  for (const int x : {0, 100}) {
    for (const int y : {0, 50}) assert_int_equal(at(image, x, y), 204);  // sqrt(0.64) = 0.8
  }
  const double share = 50.0 * 50.0 / (50.0 * 50.0 + 25.0 * 25.0);
  assert_near(at(image, 0, 25), 255.0 * std::sqrt(1.0 - 0.36 * share), 0.51);
}

void test_exposure_steps(void**) {
  Camera camera = plain();
  for (int frame = 0; frame < 100; ++frame) assert_true(exposure_gain(camera, 1, frame) == 1.0);
  camera.exposure_step_probability = 0.1;
  camera.exposure_step_size = 0.3;
  int changes = 0;
  double least = 1.0;
  double most = 1.0;
  for (int frame = 1; frame < 2000; ++frame) {
    const double gain = exposure_gain(camera, 1, frame);
    changes += gain != exposure_gain(camera, 1, frame - 1) ? 1 : 0;
    least = std::min(least, gain);
    most = std::max(most, gain);
  }
  assert_in_range(changes, 150, 250);  // 200, 13 standard deviation
  assert_at_least(least, 0.7);
  assert_at_most(least, 0.72);
  assert_at_most(most, 1.3);
  assert_at_least(most, 1.28);
  assert_true(exposure_gain(camera, 2, 1000) != exposure_gain(camera, 1, 1000));

  // Both cameras see the same gain, and it acts on radiance.
  camera.exposure_step_probability = 1.0;
  static Image left;
  static Image right;
  expose(uniform_image(8, 8, 0.2F), camera, 1, 5, Side::kLeft, left);
  expose(uniform_image(8, 8, 0.2F), camera, 1, 5, Side::kRight, right);
  assert_true(left.pixels == right.pixels);
  assert_near(left.pixels[0], 255.0 * std::sqrt(0.2 / 0.47 * exposure_gain(camera, 1, 5)), 0.51);
}

void test_dust_stays_on_its_camera(void**) {
  Camera camera = plain();
  camera.dust_spots = 20;
  static Image first;
  static Image later;
  static Image right;
  static Image fewer;
  const FloatImage radiance = uniform_image(512, 384, 0.3F);
  expose(radiance, camera, 1, 0, Side::kLeft, first);
  expose(radiance, camera, 1, 500, Side::kLeft, later);
  expose(radiance, camera, 1, 0, Side::kRight, right);
  assert_true(first.pixels == later.pixels);
  assert_true(first.pixels != right.pixels);
  const int clean = static_cast<int>(255.0 * std::sqrt(0.3 / 0.47) + 0.5);
  int dusty = 0;
  for (const int dn : first.pixels) {
    assert_in_range(dn, clean / 2, clean);
    dusty += dn < clean ? 1 : 0;
  }
  assert_in_range(dusty, 300, 8000);
  // One spot fewer takes one away, and moves none.
  camera.dust_spots = 19;
  expose(radiance, camera, 1, 0, Side::kLeft, fewer);
  for (std::size_t i = 0; i < first.pixels.size(); ++i) assert_true(fewer.pixels[i] >= first.pixels[i]);
  assert_true(fewer.pixels != first.pixels);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_hash_is_uniform_and_orderless),
      cmocka_unit_test(test_normal_deviates),
      cmocka_unit_test(test_transfer),
      cmocka_unit_test(test_one_pixel_image),
      cmocka_unit_test(test_noise_statistics),
      cmocka_unit_test(test_noise_reaches_both_ends),
      cmocka_unit_test(test_noise_is_never_shared),
      cmocka_unit_test(test_same_bytes_in_any_order),
      cmocka_unit_test(test_blur_is_a_gaussian),
      cmocka_unit_test(test_blur_is_symmetric),
      cmocka_unit_test(test_vignetting),
      cmocka_unit_test(test_exposure_steps),
      cmocka_unit_test(test_dust_stays_on_its_camera),
  };
  return cmocka_run_group_tests_name("ground_tools/sim/sensor", tests, nullptr, nullptr);
}
