// Rectification: what it must do to points, what its tables make of that, and when it refuses.
#include "dataset/rectify.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "core/random.hpp"
#include "core/trig.hpp"
#include "dataset/rig_file.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

const std::unique_ptr<Rectification> result = std::make_unique<Rectification>();

CameraModel camera(Lens lens, std::array<double, 8> k, double fx_px = 394.0) {
  CameraModel out;
  out.width_px = 512;
  out.height_px = 384;
  out.fx_px = fx_px;
  out.fy_px = fx_px + 1.0;
  out.cx_px = 255.5;
  out.cy_px = 191.5;
  out.lens = lens;
  out.k = k;
  if (lens == Lens::kCahvor) out.axis = Vec3(0.01, -0.01, 1.0).normalized();
  return out;
}

Pose3 turned(const Vec3& turn_rad, const Vec3& t_m = Vec3(-0.12, 0.0, 0.0)) {
  return Pose3{quat_exp(turn_rad), t_m};
}

/// Raw rigs as they come: lenses of a kind, cameras that differ, the right one turned and not quite beside.
std::vector<CameraPair> rigs() {
  const std::array<double, 8> brown = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  const std::array<double, 8> rational = {0.4, -0.1, 1e-3, 2e-3, 0.01, 0.7, 0.02, 0.03};
  const std::array<double, 8> fisheye = {-0.013, 0.021, -0.013, 0.002};
  const std::array<double, 8> cahvor = {0.001, -0.05, 0.02};
  std::vector<CameraPair> out;
  const auto add = [&](Lens lens, const std::array<double, 8>& k, const Pose3& T_right_left) {
    CameraPair pair;
    pair.left = camera(lens, k);
    pair.right = camera(lens, k, 398.0);
    pair.right.cx_px += 6.0;
    pair.right.cy_px -= 3.0;
    pair.T_right_left = T_right_left;
    out.push_back(pair);
  };
  add(Lens::kNone, {}, turned({0.0, 0.0, 0.0}));
  add(Lens::kRadialTangential, brown, turned({0.01, -0.02, 0.015}, {-0.11, 0.004, -0.003}));
  add(Lens::kRational, rational, turned({-0.005, 0.01, 0.0}));
  add(Lens::kEquidistant, fisheye, turned({0.0, 0.01, -0.02}, {-0.12, -0.01, 0.01}));
  add(Lens::kCahvor, cahvor, turned({0.003, 0.0, 0.002}));
  return out;
}

void rectified(const CameraPair& raw) {
  const std::string fault = rectify(raw, *result);
  if (!fault.empty()) fail_msg("%s: %s", lens_name(raw.left.lens), fault.c_str());
}

// Points in space: where the rectified rig sees them is, by raw_pixel, where the raw cameras see them.
void test_points_lie_on_equal_rows(void**) {
  Random random(5);
  for (const CameraPair& raw : rigs()) {
    rectified(raw);
    assert_true(why_not_rectified(result->pair).empty());
    const StereoRig rig = rectified_rig(result->pair);
    assert_near(rig.baseline_m, baseline_m(raw), 1e-12);
    const RectifyingTurns turns = rectifying_turns(raw);
    int seen = 0;
    for (int i = 0; i < 300; ++i) {
      const auto unit = [&] { return static_cast<double>(random.below(2001)) / 1000.0 - 1.0; };
      const double z_m = 3.0 + 2.0 * unit();
      const Vec3 p_rect_m(0.5 * z_m * unit(), 0.4 * z_m * unit(), z_m);
      const Vec3 p_left_m = result->T_left_rect * p_rect_m;
      const std::optional<Vec2> in_left = project(raw.left, p_left_m);
      const std::optional<Vec2> in_right = project(raw.right, raw.T_right_left * p_left_m);
      const StereoPixel at = cairn::project(rig, p_rect_m);
      assert_near(at.v_left, at.v_right, 1e-12);
      const auto left = raw_pixel(raw.left, result->pair.left, turns.left, Vec2(at.u_left, at.v_left));
      const auto right = raw_pixel(raw.right, result->pair.right, turns.right, Vec2(at.u_right, at.v_right));
      if (!in_left || !in_right || !left || !right) continue;
      ++seen;
      assert_near((*left - *in_left).norm(), 0.0, 1e-6);
      assert_near((*right - *in_right).norm(), 0.0, 1e-6);
    }
    assert_true(seen > 200);
  }
}

/// As flight code interpolates them, in doubles.
Vec2 by_table(const RemapTable& table, int x, int y) {
  constexpr int kSpacing = remap::kSpacing;
  const int columns = remap::nodes_along(table.width_px, kSpacing);
  const double a = static_cast<double>(x % kSpacing) / kSpacing;
  const double b = static_cast<double>(y % kSpacing) / kSpacing;
  const auto node = [&](int c, int r) {
    const RemapNode& n =
        table.nodes[static_cast<std::size_t>((y / kSpacing + r) * columns + x / kSpacing + c)];
    return Vec2(Vec2(n.u, n.v) / (1 << remap::kFractionBits));
  };
  return (1.0 - b) * ((1.0 - a) * node(0, 0) + a * node(1, 0)) +
         b * ((1.0 - a) * node(0, 1) + a * node(1, 1));
}

/// The header holds the table's numbers, row by row, and the CRC that flight code will find.
void test_header(void**) {
  const CameraPair raw = rigs()[1];
  rectified(raw);
  const std::string text = rectification_header(raw, *result, "chain.yaml");
  char crc[64];
  std::snprintf(crc, sizeof crc, "kRightTableCrc = 0x%08XU;", static_cast<unsigned>(crc_of(result->right)));
  assert_true(text.find(crc) != std::string::npos);
  assert_true(text.find("kRawWidth_px = 512;") != std::string::npos);
  const std::size_t at = text.find("kRightTable = {512, 384, {{\n");
  assert_true(at != std::string::npos);
  const char* read = text.c_str() + text.find('\n', at) + 1;
  const int nodes = remap::nodes_along(512, remap::kSpacing) * remap::nodes_along(384, remap::kSpacing);
  for (int i = 0; i < nodes; ++i) {
    int u = 0, v = 0, used = 0;
    assert_int_equal(std::sscanf(read, " {%d,%d},%n", &u, &v, &used), 2);
    assert_true(u == result->right.nodes[static_cast<std::size_t>(i)].u);
    assert_true(v == result->right.nodes[static_cast<std::size_t>(i)].v);
    read += used;
  }
  assert_true(std::string(read).rfind("\n}}};", 0) == 0);
}

/// Shares of pixels with a source, against the tables' own nodes.
void test_source_area(void**) {
  for (const CameraPair& raw : rigs()) {
    rectified(raw);
    const SourceArea area = source_area(raw, *result);
    const auto share = [&](const RemapTable& table) {
      int inside = 0, all = 0;
      for (int y = 0; y < 384; y += 4) {
        for (int x = 0; x < 512; x += 4) {
          const Vec2 at = by_table(table, x, y);
          ++all;
          inside += at.x() >= 0.0 && at.y() >= 0.0 && at.x() <= 511.0 && at.y() <= 383.0 ? 1 : 0;
        }
      }
      return static_cast<double>(inside) / all;
    };
    assert_near(area.left, share(result->left), 0.005);
    assert_near(area.right, share(result->right), 0.005);
    assert_true(area.both <= area.left && area.both <= area.right && area.both > 0.85);
    assert_at_least(area.both, area.left + area.right - 1.0 - 1e-12);
  }
}

void test_tables_follow_the_models(void**) {
  for (const CameraPair& raw : rigs()) {
    rectified(raw);
    const RectifyingTurns turns = rectifying_turns(raw);
    double most = 0.0, sum = 0.0;
    int count = 0;
    for (int y = 0; y < 384; y += 3) {
      for (int x = 0; x < 512; x += 3) {
        const auto left = raw_pixel(raw.left, result->pair.left, turns.left, Vec2(x, y));
        const auto right = raw_pixel(raw.right, result->pair.right, turns.right, Vec2(x, y));
        assert_true(left && right);
        for (const double off : {(by_table(result->left, x, y) - *left).norm(),
                                 (by_table(result->right, x, y) - *right).norm()}) {
          most = std::max(most, off);
          sum += off;
          ++count;
        }
      }
    }
    print_message("%s: table off by %.4f px at most, %.4f in the mean\n", lens_name(raw.left.lens), most,
                  sum / count);
    assert_at_most(most, 0.05);
    assert_at_most(sum / count, 0.015);
  }
}

// A barrel keeps its scale; of a pincushion the rims would be empty.
void test_zoom(void**) {
  CameraPair pair;
  pair.T_right_left = turned({0.0, 0.0, 0.0});
  pair.left = pair.right = camera(Lens::kRadialTangential, {-0.28, 0.07});
  rectified(pair);
  assert_near(result->zoom, 1.0, 0.0);
  assert_near(result->pair.left.fx_px, 394.0, 0.0);
  pair.left = pair.right = camera(Lens::kRadialTangential, {0.2, 0.0});
  rectified(pair);
  assert_true(result->zoom > 1.05 && result->zoom < 1.3);
  assert_near(result->pair.right.fx_px, 394.0 * result->zoom, 1e-9);
  for (int y = 0; y < 384; ++y) {
    for (const int x : {0, 511}) {
      const double u = by_table(result->left, x, y).x();
      assert_true(u > -kMostBeyond * 512 - 0.1 && u < 511.0 + kMostBeyond * 512 + 0.1);
    }
  }
}

// More than the mission has: the middle.
void test_larger_than_the_mission(void**) {
  CameraPair pair;
  pair.T_right_left = turned({0.0, 0.0, 0.0});
  pair.left = camera(Lens::kRadialTangential, {-0.1, 0.0});
  pair.left.width_px = 640;
  pair.left.height_px = 480;
  pair.left.cx_px = 319.5;
  pair.left.cy_px = 239.5;
  pair.right = pair.left;
  rectified(pair);
  assert_int_equal(result->pair.left.width_px, cfg::kImageWidth);
  assert_int_equal(result->pair.left.height_px, cfg::kImageHeight);
  assert_near(result->pair.left.cx_px, 319.5 - (640 - cfg::kImageWidth) / 2, 0.0);
  const Vec2 at = by_table(result->left, 255, 191);
  assert_near(at.x(), 255 + (640 - cfg::kImageWidth) / 2, 0.05);
}

void test_refusals(void**) {
  CameraPair pair;
  pair.left = pair.right = camera(Lens::kNone, {});
  const auto refused = [&](const char* why) {
    const std::string fault = rectify(pair, *result);
    if (fault.find(why) == std::string::npos) fail_msg("'%s' says nothing of '%s'", fault.c_str(), why);
  };
  pair.T_right_left = turned({0.0, 0.0, 0.0});
  pair.right.width_px = 500;
  refused("two sizes");
  pair.left.width_px = pair.right.width_px = 2049;
  refused("scale them and their calibration down");
  pair.left.width_px = pair.right.width_px = 512;
  pair.T_right_left = turned({0.0, 1.7, 0.0});
  refused("a right angle");
  pair.T_right_left = turned({0.0, 1.5, 0.0}, {-0.1, 0.0, -0.1});
  refused("too little in common");
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_points_lie_on_equal_rows),
      cmocka_unit_test(test_source_area),
      cmocka_unit_test(test_header),
      cmocka_unit_test(test_tables_follow_the_models),
      cmocka_unit_test(test_zoom),
      cmocka_unit_test(test_larger_than_the_mission),
      cmocka_unit_test(test_refusals),
  };
  return cmocka_run_group_tests_name("ground_tools/dataset/rectify", tests, nullptr, nullptr);
}
