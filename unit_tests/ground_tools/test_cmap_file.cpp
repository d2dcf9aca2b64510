// The map encoder, read back by the flight code and by the ground tool.
#include "map/cmap_file.hpp"

#include <algorithm>

#include "core/random.hpp"
#include "ground_tools/scratch.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

const MapExtent kExtent{-35.87, -2251400.4, 64.13, -2251340.4};  // 100 m x 60 m
const CmapSource kSource{cmap::Method::kOtsu, 0.25, "method=otsu", "EPSG:32633"};
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
    boulders.push_back(b);
  }
}

void test_round_trip(void**) {
  for (const double quantum_m : {0.001, 0.01, 0.05}) {
    make_boulders(3000);
    bytes = encode_cmap(boulders, kExtent, quantum_m, kSource);
    content = decode_cmap(bytes, "test");
    assert_int_equal(content.boulders.size(), boulders.size());
    assert_near(content.extent.min_x_m, kExtent.min_x_m, 0.0);
    assert_near(content.extent.max_y_m, kExtent.max_y_m, 1e-8);
    assert_near(content.quantum_m, quantum_m, 0.0);
    assert_near(content.pixel_m, 0.25, 0.0);
    assert_true(content.method == cmap::Method::kOtsu);
    assert_string_equal(content.reference_system.c_str(), "EPSG:32633");
    for (const TableBoulder& b : boulders) {  // each is there, to half a quantum and half a millimetre
      bool there = false;
      for (const TableBoulder& c : content.boulders) {
        there = there || ((c.p_map_m - b.p_map_m).cwiseAbs().maxCoeff() <= 0.5 * quantum_m + 1e-9 &&
                          std::fabs(c.diameter_m - b.diameter_m) <= 0.0005 + 1e-9);
      }
      assert_true(there);
    }
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

void test_empty_map(void**) {
  boulders.clear();
  bytes = encode_cmap(boulders, kExtent, 0.001, kSource);
  assert_status(validate_cmap(bytes), MapStatus::kNoBoulders);
  content = decode_cmap(bytes, "empty");
  assert_true(content.boulders.empty());
}

void test_suitable_quantum(void**) {
  const double pairs[][2] = {{0.0, 0.001}, {0.005, 0.001}, {0.01, 0.002}, {0.02, 0.005},
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
  bad[5] = 9;
  assert_refused(decode_cmap(bad, "m.cmap"), "version");
  bad = bytes;
  bad[20] ^= 4U;
  assert_refused(decode_cmap(bad, "m.cmap"), "damaged header");
  bad = bytes;
  bad.back() ^= 4U;
  assert_refused(decode_cmap(bad, "m.cmap"), "damaged contents");
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_round_trip),
      cmocka_unit_test(test_order_of_boulders_does_not_matter),
      cmocka_unit_test(test_flight_window_equals_the_table),
      cmocka_unit_test(test_boulders_on_the_rim),
      cmocka_unit_test(test_empty_map),
      cmocka_unit_test(test_suitable_quantum),
      cmocka_unit_test(test_encoder_refusals),
      cmocka_unit_test(test_decoder_refusals),
  };
  return cmocka_run_group_tests_name("ground_tools/cmap_file", tests, nullptr, nullptr);
}
