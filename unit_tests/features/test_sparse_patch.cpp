// Is it the same patch? Of textures whose place is known: gain, offset, places beside, strangers, flat ones.
#include "features/sparse_patch.hpp"

#include "image/gaussian.hpp"
#include "support/cmocka.hpp"
#include "support/waves.hpp"

using namespace cairn;

namespace {

constexpr int kSide = 48;
constexpr int kAt = 24;
std::uint16_t from_pixels[kSide * kSide];
std::uint16_t to_pixels[kSide * kSide];
const SmoothImage kFrom = packed_view<const std::uint16_t>(from_pixels, kSide, kSide);
const SmoothImage kTo = packed_view<const std::uint16_t>(to_pixels, kSide, kSide);

template <typename Grey>
void picture(const Grey& grey, std::uint16_t* out) {
  static std::uint8_t bytes[kSide * kSide];
  static ScaleRows rows;
  static std::int16_t unused[kSide];
  for (int i = 0; i < kSide * kSide; ++i)
    bytes[i] = static_cast<std::uint8_t>(grey(i % kSide, i / kSide) + 0.5);
  rows.start(packed_view<const std::uint8_t>(bytes, kSide, kSide));
  for (int y = 0; y < kSide; ++y) rows.next(out + y * kSide, unused);
}

void waves_in(const test::Waves& waves, std::uint16_t* out, double gain = 1.0, double offset = 0.0,
              double du = 0.0) {
  picture([&](int x, int y) { return 120.0 + offset + gain * waves.at(x - du, y); }, out);
}

std::uint32_t difference(int iu = kAt, int iv = kAt) {
  SparsePatch patch;
  patch.cut(kFrom, kAt, kAt);
  SparsePatch other;
  other.cut(kTo, iu, iv);
  return patch.difference(other);
}

void test_a_patch_is_like_itself(void**) {
  const test::Waves waves(1, 6.0, 20.0, 20.0);
  waves_in(waves, from_pixels);
  waves_in(waves, to_pixels);
  assert_true(difference() <= 1);
}

void test_light_changes_nothing(void**) {
  for (const double gain : {0.4, 0.7, 1.5}) {
    const test::Waves waves(2, 6.0, 20.0, 20.0);
    waves_in(waves, from_pixels);
    waves_in(waves, to_pixels, gain, -15.0);
    assert_in_range(difference(), 0, 65536 / 100);
  }
}

void test_negative_is_least_like(void**) {
  const test::Waves waves(3, 6.0, 20.0, 20.0);
  waves_in(waves, from_pixels);
  waves_in(waves, to_pixels, -1.0);
  assert_in_range(difference(), 2 * SparsePatch::kUnlike - 1000, 2 * SparsePatch::kUnlike);
}

/// Half a pixel beside, and the right one of the places about it, is nearer than any stranger.
void test_places_beside_are_nearer_than_strangers(void**) {
  for (std::uint64_t seed = 10; seed < 40; ++seed) {
    const test::Waves waves(seed, 8.0, 20.0, 20.0);
    waves_in(waves, from_pixels);
    waves_in(waves, to_pixels, 1.0, 0.0, 0.5);
    const std::uint32_t here = difference();
    assert_true(here < SparsePatch::kUnlike / 4);
    assert_true(difference(kAt + 1) < SparsePatch::kUnlike / 4);
    waves_in(test::Waves(seed + 100, 8.0, 20.0, 20.0), to_pixels);
    assert_true(difference() > 2 * here);
  }
}

void test_strangers_are_unlike(void**) {
  double sum = 0.0;
  for (std::uint64_t seed = 10; seed < 60; ++seed) {
    waves_in(test::Waves(seed, 6.0, 12.0, 20.0), from_pixels);
    waves_in(test::Waves(seed + 100, 6.0, 12.0, 20.0), to_pixels);
    sum += difference();
  }
  assert_in_range(static_cast<std::uint32_t>(sum / 50.0), SparsePatch::kUnlike * 9 / 10,
                  SparsePatch::kUnlike * 11 / 10);
}

void test_flat_is_unlike_everything(void**) {
  waves_in(test::Waves(5, 6.0, 20.0, 20.0), from_pixels);
  picture([](int, int) { return 77.0; }, to_pixels);
  assert_int_equal(difference(), SparsePatch::kUnlike);
  picture([](int, int) { return 77.0; }, from_pixels);
  assert_int_equal(difference(), SparsePatch::kUnlike);
}

/// Squares of samples as far from the middle's as they come: sums don't overflow.
void test_largest_contrast(void**) {
  for (int i = 0; i < kSide * kSide; ++i) {
    const bool middle = std::abs(i % kSide - kAt) < 2 && std::abs(i / kSide - kAt) < 2;
    from_pixels[i] = middle ? 0 : 65280;
    to_pixels[i] = middle ? 65280 : 0;
  }
  assert_true(difference() >= 2 * SparsePatch::kUnlike - 10);
  SparsePatch patch;
  patch.cut(kFrom, kAt, kAt);
  assert_true(patch.difference(patch) <= 10);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_a_patch_is_like_itself),
      cmocka_unit_test(test_light_changes_nothing),
      cmocka_unit_test(test_negative_is_least_like),
      cmocka_unit_test(test_places_beside_are_nearer_than_strangers),
      cmocka_unit_test(test_strangers_are_unlike),
      cmocka_unit_test(test_flat_is_unlike_everything),
      cmocka_unit_test(test_largest_contrast),
  };
  return cmocka_run_group_tests_name("sparse_patch", tests, nullptr, nullptr);
}
