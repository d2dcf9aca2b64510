// Heights of a map: fitted to samples, coded, read back by the flight code, cut, damaged.
#include "cmap/height_grid.hpp"

#include <algorithm>
#include <cmath>

#include "cmap/cmap_file.hpp"
#include "cmap/delta_encoder.hpp"
#include "core/big_endian.hpp"
#include "core/crc32.hpp"
#include "core/random.hpp"
#include "ground_tools/scratch.hpp"
#include "orbital_map/map_delta.hpp"
#include "orbital_map/map_reader.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

const MapExtent kExtent{100.0, 200.0, 130.0, 220.0};
constexpr double kQuantum_m = 0.01;
constexpr std::uint32_t kSpacing = 50;
std::vector<TableBoulder> boulders;
std::vector<std::uint8_t> bytes;
std::vector<std::uint8_t> next;
CmapContent content;
CmapContent rest;
HeightGrid grid;
HeightSamples samples;

double ground_m(double x, double y) {
  return 3.0 + 0.4 * std::sin(0.3 * x) + 0.2 * std::cos(0.5 * y + 0.2 * x);
}

void make_boulders(int count) {
  Random random(3);
  boulders.clear();
  for (int i = 0; i < count; ++i) {
    TableBoulder b;
    b.p_map_m = Vec2(100.0 + 3e-8 * random.below(1000000000), 200.0 + 2e-8 * random.below(1000000000));
    b.diameter_m = 0.1 + 1e-6 * random.below(1000000);
    boulders.push_back(b);
  }
}

void take_samples(std::uint32_t fine, const CmapLayout& cells) {
  samples.fine = fine;
  samples.columns = (posts_along(cells.extent_x, kSpacing) - 1U) * fine + 1U;
  samples.rows = (posts_along(cells.extent_y, kSpacing) - 1U) * fine + 1U;
  samples.z_m.clear();
  const double step_m = kSpacing * kQuantum_m / fine;
  for (std::uint32_t v = 0; v < samples.rows; ++v)
    for (std::uint32_t u = 0; u < samples.columns; ++u)
      samples.z_m.push_back(ground_m(u * step_m, v * step_m));
}

void make_map(int count, double boulders_per_tile = 100) {
  make_boulders(count);
  take_samples(4, cells_of(kExtent, kQuantum_m));
  grid = fit_heights(samples, kSpacing, 0.01);
  CmapOptions options;
  options.boulders_per_tile = boulders_per_tile;
  options.heights = &grid;
  bytes = encode_cmap(boulders, kExtent, kQuantum_m, {}, options);
}

void test_the_surface_is_the_ground(void**) {
  make_map(400);
  assert_int_equal(bytes[cmap::kVersionAt], cmap::kHeightsVersion);
  content = decode_cmap(bytes, "heights");
  assert_true(content.heights.present());
  assert_int_equal(content.heights.known(), content.heights.posts.size());
  assert_near(content.heights.sigma_m, grid.sigma_m, 1e-7);
  assert_near(content.heights.common_m, 0.01, 1e-7);
  double sum = 0.0;
  double mean = 0.0;
  Random random(9);
  for (int i = 0; i < 20000; ++i) {
    const double x = 30.0e-6 * random.below(1000000);
    const double y = 20.0e-6 * random.below(1000000);
    const double off = content.heights.at(x / kQuantum_m, y / kQuantum_m) - ground_m(x, y);
    sum += off * off / 20000.0;
    mean += off / 20000.0;
  }
  assert_near(std::sqrt(sum), grid.sigma_m, 0.1 * grid.sigma_m);  // what the head says is so
  assert_at_most(std::sqrt(sum), 0.006);
  assert_at_most(std::fabs(mean), 0.0005);
  std::size_t height_bytes = 0;
  for (const CmapTile& tile : content.tiles) height_bytes += tile.heights_bytes;
  assert_at_most(8.0 * static_cast<double>(height_bytes) / static_cast<double>(grid.posts.size()), 4.0);
}

void test_the_posts_come_back_to_the_bit(void**) {
  make_map(400);
  Random random(4);
  for (std::size_t i = 0; i < grid.posts.size(); ++i) {
    const auto big = static_cast<std::int32_t>(random.below(2 * cmap::kMaxPostValue)) - cmap::kMaxPostValue;
    const std::int32_t value = i % 7 == 0 ? big : static_cast<std::int32_t>(random.below(20));
    grid.posts[i] = cmap::Post(value, i % grid.columns < 30 || random.below(3) > 0);
  }
  CmapOptions options;
  options.heights = &grid;
  for (const double per_tile : {20.0, 100.0, 500.0}) {
    options.boulders_per_tile = per_tile;
    content = decode_cmap(encode_cmap(boulders, kExtent, kQuantum_m, {}, options), "posts");
    assert_int_equal(content.heights.posts.size(), grid.posts.size());
    for (std::size_t i = 0; i < grid.posts.size(); ++i) {
      assert_int_equal(content.heights.posts[i].known(), grid.posts[i].known());
      if (grid.posts[i].known()) assert_int_equal(content.heights.posts[i].value(), grid.posts[i].value());
    }
  }
}

/// To the boulders' side heights are not there.
void test_boulders_are_those_of_a_map_without(void**) {
  make_map(400);
  static OrbitalMap with;
  static OrbitalMap without;
  assert_status(validate_cmap(bytes, &with), MapStatus::kUsable);
  content = decode_cmap(bytes, "with");
  CmapOptions options;
  options.like = &content.layout;
  next = encode_cmap(boulders, kExtent, kQuantum_m, {}, options);
  assert_int_equal(next[cmap::kVersionAt], cmap::kVersion);
  assert_status(validate_cmap(next, &without), MapStatus::kUsable);
  assert_int_equal(without.heights().spacing, 0);
  static MapBoulders a;
  static MapBoulders b;
  for (int i = 0; i < 30; ++i) {
    a.clear();
    b.clear();
    const Vec2 p(100.0 + i, 200.0 + 0.6 * i);
    assert_true(with.window(p, 6.0, a) == without.window(p, 6.0, b));
    assert_int_equal(a.size(), b.size());
    MapReader reader;
    assert_true(reader.start(with, p, 6.0) == WindowStatus::kUsable);
    MapReader::Chunk chunk;
    std::size_t read = 0;
    WorkBudget budget = WorkBudget::unlimited();
    while (reader.step(budget, chunk) == Progress::kMore) {
      for (const MapBoulder& m : chunk) assert_true(m.p_map_m == a[read++].p_map_m);
    }
    assert_int_equal(read, a.size());
    for (std::size_t k = 0; k < a.size(); ++k)
      assert_true(a[k].p_map_m == b[k].p_map_m && a[k].diameter_m == b[k].diameter_m);
  }
}

/// Tiles that hold heights alone, and a map that does.
void test_tiles_without_boulders(void**) {
  make_map(400);
  boulders.resize(2);
  CmapOptions options;
  options.heights = &grid;
  options.boulders_per_tile = 0.001;
  content = decode_cmap(encode_cmap(boulders, kExtent, kQuantum_m, {}, options), "two");
  options.boulders_per_tile = 500;
  content = decode_cmap(bytes, "many");
  options.like = &content.layout;
  content = decode_cmap(encode_cmap(boulders, kExtent, kQuantum_m, {}, options), "two");
  assert_int_equal(content.boulders.size(), 2);
  assert_int_equal(content.heights.known(), grid.posts.size());
  assert_status(validate_cmap(encode_cmap({}, kExtent, kQuantum_m, {}, options)), MapStatus::kNoBoulders);
}

/// Unknown ground: no height within reach of it, all others as they are.
void test_unknown_ground(void**) {
  take_samples(4, cells_of(kExtent, kQuantum_m));
  samples.z_m[std::size_t{42} * samples.columns + 41] = NAN;
  grid = fit_heights(samples, kSpacing, 0.01);
  assert_int_equal(grid.known(), grid.posts.size() - 4);
  assert_true(std::isnan(grid.at(10.3 * kSpacing, 10.3 * kSpacing)));
  assert_near(grid.at(20.5 * kSpacing, 10.3 * kSpacing), ground_m(10.25, 5.15), 0.02);
  std::fill(samples.z_m.begin(), samples.z_m.end(), NAN);
  assert_refused(fit_heights(samples, kSpacing, 0.01), "no height");
}

void test_all_single_flips(void**) {
  make_map(60, 10);
  content = decode_cmap(bytes, "whole");
  assert_at_least(content.tiles.size(), 4);
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ 1U << bit % 8);
    const MapStatus status = validate_cmap(bytes);
    assert_true(status != MapStatus::kUsable && status != MapStatus::kNoBoulders);
    if (status == MapStatus::kDamaged && bit % 32 == 0) {  // the heights of that tile alone are missing
      rest = decode_cmap(bytes, "damaged", true);
      assert_int_equal(rest.damaged_tiles, 1);
      std::size_t missing = 0;
      for (std::size_t i = 0; i < rest.heights.posts.size(); ++i) {
        if (!rest.heights.posts[i].known()) ++missing;
        if (rest.heights.posts[i].known())
          assert_int_equal(rest.heights.posts[i].value(), content.heights.posts[i].value());
      }
      const std::uint32_t steps = content.layout.tile_side / kSpacing;
      assert_in_range(missing, 1, (steps + 1) * (steps + 1));
    }
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ 1U << bit % 8);
  }
}

/// Heads that nothing but their CRC speaks for.
void test_heads_out_of_range(void**) {
  make_map(60);
  const std::size_t head = be::get_u16(bytes.data() + cmap::kHeadBytesAt);
  const std::size_t fields = head - cmap::kCrcBytes - cmap::kHeightBytes;
  const auto check = [&](std::size_t at, const std::vector<std::uint8_t>& value) {
    next = bytes;
    std::copy(value.begin(), value.end(), next.begin() + static_cast<std::ptrdiff_t>(fields + at));
    be::put_u32(next.data() + head - cmap::kCrcBytes, crc32(next.data(), head - cmap::kCrcBytes));
    assert_status(validate_cmap(next), MapStatus::kBadHeader);
  };
  check(cmap::kHeightSpacingAt, {0, 0, 0, 0});
  check(cmap::kHeightSpacingAt, {0, 0, 0, 49});
  check(cmap::kHeightSpacingAt, {0, 0, 0, 1});
  check(cmap::kHeightQuantumAt, {0, 0, 0, 99});
  check(cmap::kHeightQuantumAt, {1, 0, 0, 0});
  check(cmap::kHeightBaseAt, {0x7F, 0xF8, 0, 0, 0, 0, 0, 0});
  check(cmap::kHeightBaseAt, {0x41, 0x08, 0, 0, 0, 0, 0, 0});
  check(cmap::kHeightBaseAt, {0, 0, 0, 0, 0, 0, 0, 1});
  for (const std::size_t at : {cmap::kHeightSigmaAt, cmap::kHeightCommonAt}) {
    check(at, {0, 0, 0, 0});
    check(at, {0x7F, 0xC0, 0, 0});
    check(at, {0xC0, 0, 0, 0});
    check(at, {0x7F, 0x80, 0, 0});
  }
  next = bytes;
  next[cmap::kVersionAt] = cmap::kVersion;  // the heights' fields are no model of an attribute
  be::put_u32(next.data() + head - cmap::kCrcBytes, crc32(next.data(), head - cmap::kCrcBytes));
  assert_status(validate_cmap(next), MapStatus::kBadHeader);
}

/// New heights in one place: that tile is sent, and what flight code makes of it is the new map.
void test_a_delta(void**) {
  make_map(400);
  content = decode_cmap(bytes, "base");
  CmapOptions options;
  options.like = &content.layout;
  options.heights = &grid;
  const std::size_t at = std::size_t{5} * grid.columns + 5;
  grid.posts[at] = cmap::Post(grid.posts[at].value() + 3, true);
  next = encode_cmap(boulders, kExtent, kQuantum_m, {}, options);
  static MapDelta delta;
  delta = encode_delta(bytes, next, {});
  assert_int_equal(delta.pieces.size(), 1);
  static std::vector<std::uint8_t> made;
  made.assign(next.size(), 0);
  DeltaJob job;
  assert_status(
      job.start(delta.bytes.data(), delta.bytes.size(), bytes.data(), bytes.size(), made.data(), made.size()),
      DeltaStatus::kApplying);
  WorkBudget budget = WorkBudget::unlimited();
  assert_status(job.step(budget), Progress::kDone);
  assert_status(job.status(), DeltaStatus::kApplied);
  assert_true(made == next);
}

void test_moved_posts(void**) {
  make_map(60);
  const HeightGrid cut = moved(grid, 3 * kSpacing, -2 * std::int64_t{kSpacing}, 500, 400);
  assert_int_equal(cut.columns, 11);
  assert_false(cut.posts[cut.columns].known());
  assert_near(cut.at(120, 333), grid.at(120 + 3 * kSpacing, 333 - 2 * kSpacing), 1e-12);
}

void test_slices_do_not_matter(void**) {
  make_map(400);
  for (const std::uint32_t ops : {1U, 700U}) {
    static MapValidation validation;
    assert_status(validation.start(bytes.data(), bytes.size()), MapStatus::kChecking);
    for (;;) {
      WorkBudget budget(ops);
      if (validation.step(budget) == Progress::kDone) break;
      assert_at_most(budget.spent(), ops + 1600);
    }
    assert_status(validation.status(), MapStatus::kUsable);
    assert_int_equal(validation.result().count(), decode_cmap(bytes, "whole").boulders.size());
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_the_surface_is_the_ground),
      cmocka_unit_test(test_the_posts_come_back_to_the_bit),
      cmocka_unit_test(test_boulders_are_those_of_a_map_without),
      cmocka_unit_test(test_tiles_without_boulders),
      cmocka_unit_test(test_unknown_ground),
      cmocka_unit_test(test_all_single_flips),
      cmocka_unit_test(test_heads_out_of_range),
      cmocka_unit_test(test_a_delta),
      cmocka_unit_test(test_moved_posts),
      cmocka_unit_test(test_slices_do_not_matter),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
