// The map encoder, read back by the flight code and by the ground tool.
#include "cmap/cmap_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "core/random.hpp"
#include "ground_tools/scratch.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

const MapExtent kExtent{-35.87, -2251400.4, 64.13, -2251340.4};  // 100 m x 60 m
const CmapSource kSource{cmap::Method::kOtsu, 0.25, "method=otsu", "EPSG:32633", 4, 839000000, 12};
std::vector<TableBoulder> boulders;
std::vector<std::uint8_t> bytes;
CmapContent content;
MapBoulders window;

void make_boulders(int count) {
  Random random(3);
  boulders.clear();
  for (int i = 0; i < count; ++i) {
    TableBoulder b;
    b.p_map_m = Vec2(kExtent.min_x_m + 1e-7 * random.below(1000000001),
                     kExtent.min_y_m + 6e-8 * random.below(1000000001));
    b.diameter_m = 0.05 + 1e-6 * random.below(5000000);
    b.height_m = random.below(3) == 0 ? 0.0 : (0.3 + 1e-3 * random.below(400)) * b.diameter_m;
    b.confidence = 0.001 * random.below(1001);
    boulders.push_back(b);
  }
}

void test_round_trip(void**) {
  for (const double quantum_m : {0.001, 0.01, 0.05}) {
    make_boulders(3000);
    bytes = encode_cmap(boulders, kExtent, quantum_m, kSource);
    CmapReport report;
    bytes = encode_cmap(boulders, kExtent, quantum_m, kSource, {}, &report);
    content = decode_cmap(bytes, "test");
    assert_int_equal(content.boulders.size() + report.merged, boulders.size());
    assert_int_equal(content.boulders.size(), report.boulders);
    assert_near(content.extent.min_x_m, kExtent.min_x_m, 0.0);
    assert_at_least(content.extent.max_y_m, kExtent.max_y_m - 1e-6);
    assert_at_most(content.extent.max_y_m, kExtent.max_y_m + quantum_m);
    assert_near(content.quantum_m, quantum_m, 0.0);
    assert_near(content.pixel_m, 0.25, 0.0);
    assert_true(content.method == cmap::Method::kOtsu);
    assert_string_equal(content.reference_system.c_str(), "EPSG:32633");
    assert_int_equal(content.site, 4);
    assert_int_equal(content.epoch_s, 839000000);
    assert_int_equal(content.revision, 12);
    std::size_t lost = 0;
    for (const TableBoulder& b : boulders) {  // each is there, to half a cell and half a class
      bool there = false;
      for (const TableBoulder& c : content.boulders) {
        const bool height =
            b.height_m > 0.0 ? std::fabs(std::log(c.height_m / b.height_m)) < 0.25 : c.height_m == 0.0;
        there = there || ((c.p_map_m - b.p_map_m).cwiseAbs().maxCoeff() <= 0.5 * quantum_m + 1e-9 && height &&
                          std::fabs(std::log(c.diameter_m / b.diameter_m)) < 0.09 &&
                          std::fabs(c.confidence - b.confidence) < 1.0 / 14.0 + 0.006);
      }
      lost += there ? 0 : 1;
    }
    assert_int_equal(lost, report.merged);
  }
}

void test_order_of_boulders_does_not_matter(void**) {
  make_boulders(500);
  bytes = encode_cmap(boulders, kExtent, 0.001, kSource);
  std::reverse(boulders.begin(), boulders.end());
  assert_true(bytes == encode_cmap(boulders, kExtent, 0.001, kSource));
}

void test_flight_window_equals_the_table(void**) {
  make_boulders(3000);
  bytes = encode_cmap(boulders, kExtent, 0.001, kSource);
  MapValidation validation;
  assert_status(validation.start(bytes.data(), bytes.size()), MapStatus::kChecking);
  WorkBudget budget = WorkBudget::unlimited();
  assert_status(validation.step(budget), Progress::kDone);
  assert_status(validation.status(), MapStatus::kUsable);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec2 p(kExtent.min_x_m + trial, kExtent.min_y_m + 0.6 * trial);
    std::size_t expected = 0;
    std::size_t doubtful = 0;  // the rounding decides
    for (const TableBoulder& b : boulders) {
      const double distance_m = (b.p_map_m - p).norm();
      if (std::fabs(distance_m - 7.0) < 0.001)
        ++doubtful;
      else if (distance_m < 7.0)
        ++expected;
    }
    window.clear();
    assert_true(validation.result().window(p, 7.0, window) != WindowStatus::kWindowFull);
    assert_true(window.size() >= expected && window.size() <= expected + doubtful);
  }
}

void test_boulders_on_the_rim(void**) {
  boulders.clear();
  for (int i = 0; i < 4; ++i) {
    TableBoulder b;
    b.p_map_m =
        Vec2(i % 2 == 0 ? kExtent.min_x_m : kExtent.max_x_m, i / 2 == 0 ? kExtent.min_y_m : kExtent.max_y_m);
    b.diameter_m = 0.0001;  // less than the unit: the least size
    boulders.push_back(b);
  }
  content = decode_cmap(encode_cmap(boulders, kExtent, 0.001, kSource), "rim");
  assert_int_equal(content.boulders.size(), 4);
  assert_near(content.boulders[3].p_map_m.x(), kExtent.max_x_m, 0.0005 + 1e-9);
  assert_near(content.boulders[3].diameter_m, 0.001, 1e-12);
}

void test_boulders_of_one_cell_are_merged(void**) {
  make_boulders(1);
  boulders[0].diameter_m = 0.3;
  for (const double diameter_m : {0.2, 0.5, 0.4}) {
    boulders.push_back(boulders[0]);
    boulders.back().diameter_m = diameter_m;
  }
  CmapReport report;
  content = decode_cmap(encode_cmap(boulders, kExtent, 0.01, kSource, {}, &report), "merged");
  assert_int_equal(report.merged, 3);
  assert_int_equal(content.boulders.size(), 1);
  assert_near(content.boulders[0].diameter_m, 0.5, 1e-9);
}

void test_positions_only(void**) {
  make_boulders(2000);
  CmapOptions options;
  options.positions_only = true;
  bytes = encode_cmap(boulders, kExtent, 0.01, kSource, options);
  content = decode_cmap(bytes, "positions");
  assert_at_least(content.boulders.size(), 1990);
  for (const TableBoulder& b : content.boulders)
    assert_true(b.diameter_m == 0.0 && b.height_m == 0.0 && b.confidence == 1.0);
  const double n = static_cast<double>(content.boulders.size());
  const double cells = 10001.0 * 6001.0;
  const double limit =
      (std::lgamma(cells + 1) - std::lgamma(n + 1) - std::lgamma(cells - n + 1)) / std::log(2.0);
  assert_at_most(8.0 * static_cast<double>(bytes.size()), 1.06 * limit);
}

/// Block `n` of hexadecimal digits in doc/ICD.md.
std::string said_by_the_document(int n) {
  std::ifstream file(std::string(CAIRN_SOURCE_DIR) + "/doc/ICD.md");
  std::string line;
  std::string said;
  bool inside = false;
  while (std::getline(file, line)) {
    if (line == "```hex")
      inside = n-- == 0;
    else if (line == "```")
      inside = false;
    else if (inside)
      said += line;
  }
  said.erase(std::remove(said.begin(), said.end(), ' '), said.end());
  return said;
}

std::string hex_of_bytes() {
  std::string hex;
  for (const std::uint8_t byte : bytes) hex += fmt::format("{:02x}", byte);
  return hex;
}

/// The worked examples of doc/ICD.md, without heights and with them.
void test_the_examples_of_the_document(void**) {
  boulders.clear();
  const double places[][2] = {{0.03, 0.0}, {0.09, 0.05}, {0.02, 0.05}};
  for (const auto& p : places) {
    TableBoulder b;
    b.p_map_m = Vec2(100.0 + p[0], 200.0 + p[1]);
    b.diameter_m = boulders.size() == 1 ? 0.2 : 0.1;
    boulders.push_back(b);
  }
  CmapSource source;
  source.parameters = "example";
  const MapExtent extent{100.0, 200.0, 100.09, 200.07};
  bytes = encode_cmap(boulders, extent, 0.01, source);
  assert_string_equal(said_by_the_document(0).c_str(), hex_of_bytes().c_str());

  const HeightGrid heights{
      5,
      10000,
      2.0,
      0.0078125,
      0.0625,
      3,
      3,
      {{0, true}, {1, true}, {3, true}, {1, true}, {1, false}, {4, true}, {1, true}, {1, true}, {3, true}}};
  CmapOptions options;
  options.heights = &heights;
  bytes = encode_cmap(boulders, extent, 0.01, source, options);
  assert_string_equal(said_by_the_document(1).c_str(), hex_of_bytes().c_str());
}

void test_like_a_base(void**) {
  make_boulders(3000);
  bytes = encode_cmap(boulders, kExtent, 0.01, kSource);
  const CmapLayout layout = layout_of(bytes, "base");
  CmapOptions options;
  options.like = &layout;
  CmapReport report;
  assert_true(encode_cmap(boulders, kExtent, 0.01, kSource, options, &report) == bytes);
  assert_true(report.like_base);
  static CmapContent base;
  base = decode_cmap(bytes, "base");
  boulders[7].p_map_m = Vec2(kExtent.min_x_m + 50.0, kExtent.min_y_m + 30.0);  // one moves
  boulders[7].diameter_m = 1.0;
  static std::vector<std::uint8_t> next;
  next = encode_cmap(boulders, {0.0, 0.0, 1.0, 1.0}, 0.5, kSource, options,
                     &report);  // extent, quantum: the base's
  assert_true(report.like_base);
  content = decode_cmap(next, "next");
  assert_int_equal(content.tiles.size(), base.tiles.size());
  std::size_t changed = 0;
  for (std::size_t t = 0; t < base.tiles.size(); ++t) {
    const CmapTile& a = base.tiles[t];
    const CmapTile& b = content.tiles[t];
    const bool same =
        a.bytes == b.bytes && std::equal(bytes.begin() + static_cast<std::ptrdiff_t>(a.offset),
                                         bytes.begin() + static_cast<std::ptrdiff_t>(a.offset + a.bytes),
                                         next.begin() + static_cast<std::ptrdiff_t>(b.offset));
    changed += same ? 0 : 1;
  }
  assert_true(changed >= 1 && changed <= 2);
  boulders[9].diameter_m = 20.0;  // beyond the classes of the base
  next = encode_cmap(boulders, kExtent, 0.01, kSource, options, &report);
  assert_false(report.like_base);
  content = decode_cmap(next, "new classes");
  boulders[9].p_map_m.x() = kExtent.max_x_m + 1.0;
  assert_refused(encode_cmap(boulders, kExtent, 0.01, kSource, options), "outside the map");
}

void test_tiles(void**) {
  make_boulders(3000);
  bytes = encode_cmap(boulders, kExtent, 0.01, kSource);
  content = decode_cmap(bytes, "tiles");
  OrbitalMap map;
  assert_status(validate_cmap(bytes, &map), MapStatus::kUsable);
  assert_int_equal(content.tiles.size(), map.tiles());
  std::size_t next = 0;
  for (const CmapTile& tile : content.tiles) {
    for (std::uint32_t i = 0; i < tile.count; ++i)
      assert_true(tile.extent.contains(content.boulders.at(next++).p_map_m, -1e-9));
  }
  assert_int_equal(next, content.boulders.size());
}

void test_clusters_are_cheaper(void**) {
  Random random(4);
  boulders.clear();
  for (int cluster = 0; cluster < 40; ++cluster) {
    const Vec2 p(kExtent.min_x_m + 2.0 + 96.0 * 1e-6 * random.below(1000000),
                 kExtent.min_y_m + 2.0 + 56.0 * 1e-6 * random.below(1000000));
    for (int i = 0; i < 50; ++i) {
      TableBoulder b;
      b.p_map_m = p + 1e-6 * Vec2(random.below(2000000), random.below(2000000)) - Vec2(1.0, 1.0);
      b.diameter_m = 0.2;
      boulders.push_back(b);
    }
  }
  CmapOptions options;
  options.positions_only = true;
  bytes = encode_cmap(boulders, kExtent, 0.01, kSource, options);
  content = decode_cmap(bytes, "clusters");
  const double n = static_cast<double>(content.boulders.size());
  const double cells = 10001.0 * 6001.0;
  const double limit =
      (std::lgamma(cells + 1) - std::lgamma(n + 1) - std::lgamma(cells - n + 1)) / std::log(2.0);
  assert_at_most(8.0 * static_cast<double>(bytes.size()), 0.9 * limit);
}

/// More than one tile may hold: it is cut smaller.
void test_a_crowd(void**) {
  boulders.clear();
  for (int i = 0; i < 9000; ++i) {
    TableBoulder b;
    b.p_map_m = Vec2(kExtent.min_x_m + 0.01 * (i % 100), kExtent.min_y_m + 0.01 * (i / 100));
    b.diameter_m = 0.2;
    boulders.push_back(b);
  }
  CmapOptions options;
  options.boulders_per_tile = 4000;
  content = decode_cmap(encode_cmap(boulders, kExtent, 0.01, kSource, options), "crowd");
  assert_int_equal(content.boulders.size(), 9000);
  for (const CmapTile& tile : content.tiles) assert_at_most(tile.count, cmap::kMaxTileBoulders);
}

/// The boulders of all tiles that are not damaged, and no others.
void check_salvage() {
  static CmapContent rest;
  rest = decode_cmap(bytes, "damaged", true);
  assert_int_equal(rest.damaged_tiles, 1);
  std::size_t next = 0;
  std::size_t at = 0;
  for (std::size_t t = 0; t < content.tiles.size(); ++t) {
    for (std::uint32_t i = 0; i < content.tiles[t].count; ++i, ++at) {
      if (!rest.tiles[t].good) continue;
      assert_true(next < rest.boulders.size() && rest.boulders[next].p_map_m == content.boulders[at].p_map_m);
      ++next;
    }
  }
  assert_int_equal(next, rest.boulders.size());
}

void test_all_single_flips(void**) {
  make_boulders(300);
  CmapOptions options;
  options.boulders_per_tile = 80;
  bytes = encode_cmap(boulders, kExtent, 0.01, kSource, options);
  content = decode_cmap(bytes, "whole");
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ 1U << bit % 8);
    const MapStatus status = validate_cmap(bytes);
    assert_true(status != MapStatus::kUsable && status != MapStatus::kNoBoulders);
    if (status == MapStatus::kDamaged && bit % 16 == 0) check_salvage();
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ 1U << bit % 8);
  }
}

void test_double_flips(void**) {
  make_boulders(100);
  CmapOptions options;
  options.boulders_per_tile = 40;
  bytes = encode_cmap(boulders, kExtent, 0.01, kSource, options);
  Random random(77);
  const auto bits = static_cast<std::uint32_t>(8 * bytes.size());
  for (int trial = 0; trial < 100000; ++trial) {
    const std::uint32_t first = random.below(bits);
    const std::uint32_t second = (first + 1 + random.below(bits - 1)) % bits;
    for (const std::uint32_t bit : {first, second})
      bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ 1U << bit % 8);
    const MapStatus status = validate_cmap(bytes);
    assert_true(status != MapStatus::kUsable && status != MapStatus::kNoBoulders);
    for (const std::uint32_t bit : {first, second})
      bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ 1U << bit % 8);
  }
}

void test_empty_map(void**) {
  boulders.clear();
  bytes = encode_cmap(boulders, kExtent, 0.001, kSource);
  assert_status(validate_cmap(bytes), MapStatus::kNoBoulders);
  content = decode_cmap(bytes, "empty");
  assert_true(content.boulders.empty());
}

void test_suitable_quantum(void**) {
  const double pairs[][2] = {{0.0, 0.002}, {0.005, 0.002}, {0.01, 0.002}, {0.02, 0.005},
                             {0.05, 0.01}, {0.25, 0.05},   {0.5, 0.1},    {100.0, 1.0}};
  for (const auto& pair : pairs) assert_near(suitable_quantum_m(pair[0]), pair[1], 1e-12);
}

void test_encoder_refusals(void**) {
  make_boulders(1);
  assert_refused(encode_cmap(boulders, kExtent, 0.0, kSource), "--quantum");
  assert_refused(encode_cmap(boulders, kExtent, NAN, kSource), "--quantum");
  static MapExtent extent;
  extent = {0.0, 0.0, 1e7, 1.0};
  assert_refused(encode_cmap({}, extent, 0.0001, kSource), "--quantum");
  extent = {0.0, 0.0, 2e8, 1.0};
  assert_refused(encode_cmap({}, extent, 1.0, kSource), "beyond");
  extent = {0.0, 0.0, 1.0, 1.0};
  assert_refused(encode_cmap(boulders, extent, 0.001, kSource), "outside the map");
  boulders[0].diameter_m = 66.0;
  assert_refused(encode_cmap(boulders, kExtent, 0.001, kSource), "larger than 65.5 m");
}

void test_decoder_refusals(void**) {
  make_boulders(100);
  bytes = encode_cmap(boulders, kExtent, 0.001, kSource);
  static std::vector<std::uint8_t> bad;
  assert_refused(decode_cmap({}, "m.cmap"), "m.cmap: is empty");
  bad.assign(bytes.begin(), bytes.end() - 1);
  assert_refused(decode_cmap(bad, "m.cmap"), "truncated");
  bad = bytes;
  bad[0] ^= 1U;
  assert_refused(decode_cmap(bad, "m.cmap"), "is not a .cmap map");
  bad = bytes;
  bad[4] = 9;
  assert_refused(decode_cmap(bad, "m.cmap"), "version");
  bad = bytes;
  bad[20] ^= 4U;
  assert_refused(decode_cmap(bad, "m.cmap"), "damaged head");
  bad = bytes;
  bad.back() ^= 4U;
  assert_refused(decode_cmap(bad, "m.cmap"), "no intact tile");
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_round_trip),
      cmocka_unit_test(test_order_of_boulders_does_not_matter),
      cmocka_unit_test(test_flight_window_equals_the_table),
      cmocka_unit_test(test_boulders_on_the_rim),
      cmocka_unit_test(test_boulders_of_one_cell_are_merged),
      cmocka_unit_test(test_positions_only),
      cmocka_unit_test(test_the_examples_of_the_document),
      cmocka_unit_test(test_like_a_base),
      cmocka_unit_test(test_tiles),
      cmocka_unit_test(test_clusters_are_cheaper),
      cmocka_unit_test(test_a_crowd),
      cmocka_unit_test(test_all_single_flips),
      cmocka_unit_test(test_double_flips),
      cmocka_unit_test(test_empty_map),
      cmocka_unit_test(test_suitable_quantum),
      cmocka_unit_test(test_encoder_refusals),
      cmocka_unit_test(test_decoder_refusals),
  };
  return cmocka_run_group_tests_name("ground_tools/cmap/cmap_file", tests, nullptr, nullptr);
}
