// Components of a mask in tiles: the same as of the whole mask, however it is cut.
#include "detect/components.hpp"

#include <algorithm>

#include "core/random.hpp"
#include "detect/tile_grid.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

constexpr int kWidth = 61;
constexpr int kHeight = 47;
std::vector<std::uint8_t> mask(kWidth* kHeight);
std::vector<std::uint8_t> values(kWidth* kHeight);
std::vector<Component> whole;
std::vector<Component> joined;

std::size_t at(int x, int y) { return static_cast<std::size_t>(y * kWidth + x); }

TileComponents label(const PixelBox& tile, const PixelBox& image) {
  TileLabeller labeller(tile, image);
  for (int y = tile.y0; y < tile.y1; ++y) labeller.push(&mask[at(tile.x0, y)], &values[at(tile.x0, y)]);
  return labeller.finish();
}

/// All components by way of tiles.
void join_tiles(int tile_width, int tile_height) {
  const TileGrid grid{{0, 0, kWidth, kHeight}, tile_width, tile_height};
  TileJoiner joiner;
  joined.clear();
  for (std::uint32_t i = 0; i < grid.size(); ++i) {
    const TileComponents tile = label(grid.box(i), grid.image);
    joined.insert(joined.end(), tile.closed.begin(), tile.closed.end());
    joiner.add(tile, grid.starts_row(i));
  }
  const std::vector<Component> shared = joiner.finish();
  joined.insert(joined.end(), shared.begin(), shared.end());
  std::sort(joined.begin(), joined.end(), comes_first);
}

bool same(const Component& a, const Component& b) {
  return a.area_px == b.area_px && a.sum_x == b.sum_x && a.sum_y == b.sum_y && a.sum_value == b.sum_value &&
         a.sum_xx == b.sum_xx && a.sum_xy == b.sum_xy && a.sum_yy == b.sum_yy && a.min_x == b.min_x &&
         a.min_y == b.min_y && a.max_x == b.max_x && a.max_y == b.max_y && a.first_x == b.first_x;
}

void check_all_cuts() {
  whole = label({0, 0, kWidth, kHeight}, {0, 0, kWidth, kHeight}).closed;
  for (const int width : {1, 2, 7, 16, 60, 61, 100}) {
    for (const int height : {1, 3, 8, 46, 47}) {
      join_tiles(width, height);
      assert_int_equal(joined.size(), whole.size());
      for (std::size_t i = 0; i < whole.size(); ++i) assert_true(same(joined[i], whole[i]));
    }
  }
}

void test_random_masks_in_any_tiles(void**) {
  Random random(3);
  for (const unsigned share : {5U, 30U, 42U, 60U, 95U}) {  // around 42 % they wind through the whole image
    for (std::size_t i = 0; i < mask.size(); ++i) {
      mask[i] = random.below(100) < share ? 1 : 0;
      values[i] = static_cast<std::uint8_t>(random.below(256));
    }
    check_all_cuts();
  }
}

void test_a_spiral_and_a_comb(void**) {
  std::fill(mask.begin(), mask.end(), std::uint8_t{0});
  for (int ring = 0; ring < 10; ++ring) {  // rings that are open in one place and joined to the next
    for (int x = 2 * ring; x < kWidth - 2 * ring; ++x)
      mask[at(x, 2 * ring)] = mask[at(x, kHeight - 1 - 2 * ring)] = 1;
    for (int y = 2 * ring; y < kHeight - 2 * ring; ++y)
      mask[at(2 * ring, y)] = mask[at(kWidth - 1 - 2 * ring, y)] = 1;
    mask[at(2 * ring, 2 * ring + 1)] = 0;
    mask[at(2 * ring + 1, 2 * ring + 2)] = 1;
  }
  check_all_cuts();
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) mask[at(x, y)] = x % 2 == 0 || y == kHeight - 1 ? 1 : 0;
  check_all_cuts();
  assert_int_equal(whole.size(), 1);
}

void test_diagonals_touch_across_corners(void**) {
  for (const bool falling : {true, false}) {
    std::fill(mask.begin(), mask.end(), std::uint8_t{0});
    for (int i = 0; i < kHeight; ++i) mask[at(falling ? i : kHeight - 1 - i, i)] = 1;
    check_all_cuts();
    assert_int_equal(whole.size(), 1);
  }
}

/// One run at the far corner of an image of 2^20 pixels a side: what 64 bits do not hold.
void test_sums_of_huge_images(void**) {
  constexpr int kFar = 1 << 20;
  static std::vector<std::uint8_t> row;
  row.assign(1 << 16, 1);
  const PixelBox tile{kFar - (1 << 16), kFar - 64, kFar, kFar};
  TileLabeller labeller(tile, tile);
  for (int y = tile.y0; y < tile.y1; ++y) labeller.push(row.data(), row.data());
  const std::vector<Component> found = labeller.finish().closed;
  assert_int_equal(found.size(), 1);
  WideSum xx = 0;
  for (int x = tile.x0; x < tile.x1; ++x) xx += static_cast<WideSum>(x) * static_cast<WideSum>(x);
  assert_true(found[0].sum_xx == xx * 64);
  WideSum total = 0;  // as if a component filled 2^20 x 2^20 pixels
  for (int i = 0; i < 2048; ++i) total += found[0].sum_xx * 131072;
  assert_true(total / 131072 / 2048 == found[0].sum_xx);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_random_masks_in_any_tiles),
      cmocka_unit_test(test_a_spiral_and_a_comb),
      cmocka_unit_test(test_diagonals_touch_across_corners),
      cmocka_unit_test(test_sums_of_huge_images),
  };
  return cmocka_run_group_tests_name("ground_tools/detect/components", tests, nullptr, nullptr);
}
