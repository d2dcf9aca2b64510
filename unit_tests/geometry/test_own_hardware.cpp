// The rover's own hardware in view: cells against the pixels of the boxes that they were made of.
#include "geometry/own_hardware.hpp"

#include <cstdint>
#include <limits>

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

constexpr int kCell = OwnHardware::kCell_px;

void test_nothing_at_first(void**) {
  const OwnHardware own;
  for (int v = 0; v < cfg::kImageHeight; ++v) {
    for (int u = 0; u < cfg::kImageWidth; ++u) assert_false(own.covers(u, v));
  }
}

/// Every pixel of a box is covered, and no pixel whose cell holds none of any box.
void test_boxes(void**) {
  static std::uint8_t in_cell[OwnHardware::kRows][OwnHardware::kColumns];
  Random random(3);
  const auto between = [&](int low, int high) {
    return low + static_cast<int>(random.below(static_cast<std::uint32_t>(high - low)));
  };
  for (int trial = 0; trial < 20; ++trial) {
    OwnHardware own;
    for (auto& row : in_cell) {
      for (std::uint8_t& cell : row) cell = 0;
    }
    for (int n = between(1, 4); n > 0; --n) {
      PixelBox box;  // some without pixels, some beyond the picture
      box.u0 = between(-20, cfg::kImageWidth + 10);
      box.v0 = between(-20, cfg::kImageHeight + 10);
      box.u1 = box.u0 + between(-3, 200);
      box.v1 = box.v0 + between(-3, 200);
      own.cover(box);
      for (int v = box.v0 > 0 ? box.v0 : 0; v < box.v1 && v < cfg::kImageHeight; ++v) {
        for (int u = box.u0 > 0 ? box.u0 : 0; u < box.u1 && u < cfg::kImageWidth; ++u)
          in_cell[v / kCell][u / kCell] = 1;
      }
    }
    for (int v = 0; v < cfg::kImageHeight; ++v) {
      for (int u = 0; u < cfg::kImageWidth; ++u) {
        const bool expected = in_cell[v / kCell][u / kCell] != 0;
        assert_true(own.covers(u, v) == expected);
        assert_true(own.covers(u + 0.49, v - 0.49) == expected);  // the same pixel
      }
    }
  }
}

/// No point beside the picture is covered, though all of the picture is.
void test_beside_the_picture(void**) {
  OwnHardware own;
  own.cover({-1000, -1000, 100000, 100000});
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  assert_true(own.covers(0.0, 0.0));
  assert_true(own.covers(cfg::kImageWidth - 1.0, cfg::kImageHeight - 1.0));
  const double beside_u = OwnHardware::kColumns * kCell;
  const double beside_v = OwnHardware::kRows * kCell;
  for (const double bad : {-0.6, -1e9, -kInfinity, kInfinity, kNan, 1e300}) {
    assert_false(own.covers(bad, 10.0));
    assert_false(own.covers(10.0, bad));
  }
  assert_false(own.covers(beside_u, 10.0));
  assert_false(own.covers(10.0, beside_v));
}

/// As the mission's table says, at compile time.
void test_of_a_mission(void**) {
  static constexpr PixelBox kBoxes[] = {{0, 40, 64, 64}, {16, 24, 32, 40}};
  constexpr OwnHardware own = [] {
    cfg::Mission m{};
    m.own_hardware = kBoxes;
    m.own_hardware_boxes = 2;
    return OwnHardware::of(m);
  }();
  static_assert(own.covers_cell(0, 5) && own.covers_cell(3, 4));
  static_assert(!own.covers_cell(0, 4) && !own.covers_cell(8, 5) && !own.covers_cell(3, 8));
  assert_true(own.covers(20.0, 30.0));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_nothing_at_first),
      cmocka_unit_test(test_boxes),
      cmocka_unit_test(test_beside_the_picture),
      cmocka_unit_test(test_of_a_mission),
  };
  return cmocka_run_group_tests_name("geometry/own_hardware", tests, nullptr, nullptr);
}
