// Projection, triangulation and its covariance, Sampson correction, the mast, and what is no rig.
#include "geometry/stereo_rig.hpp"

#include <cstdio>
#include <limits>

#include "support/cmocka.hpp"
#include "support/death.hpp"
#include "support/noise.hpp"

using namespace cairn;

namespace {

StereoRig rig_of_the_paper() {
  StereoRig rig;
  rig.width_px = 512;
  rig.height_px = 384;
  rig.fx_px = 394.2;
  rig.fy_px = 401.7;  // unlike fx, so that a mix-up shows
  rig.cx_px = 255.5;
  rig.cy_px = 180.25;
  rig.baseline_m = 0.12;
  return rig;
}

void test_projection_by_hand(void**) {
  const StereoPixel px = project(rig_of_the_paper(), Vec3(0.5, -0.25, 2.0));
  assert_near(px.u_left, 255.5 + 394.2 * 0.25, 1e-12);
  assert_near(px.v_left, 180.25 - 401.7 * 0.125, 1e-12);
  assert_near(px.u_right, 255.5 + 394.2 * (0.5 - 0.12) / 2.0, 1e-12);
  assert_near(px.v_right, px.v_left, 0.0);
  assert_near(px.disparity_px(), 394.2 * 0.12 / 2.0, 1e-12);
}

void test_round_trip(void**) {
  const StereoRig rig = rig_of_the_paper();
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const double z = test::uniform(random, 0.06, 100.0);
    const Vec3 p(test::uniform(random, -2.0, 2.0) * z, test::uniform(random, -2.0, 2.0) * z, z);
    assert_at_most((triangulate(rig, project(rig, p)) - p).norm(), 1e-10 * z);
  }
}

void test_sampson(void**) {
  const StereoPixel match = {100.25, 50.0, 80.5, 51.5};
  const StereoPixel px = sampson_correct(match);
  assert_near(px.v_left, 50.75, 0.0);
  assert_near(px.v_right, 50.75, 0.0);
  assert_near(px.u_left, 100.25, 0.0);
  assert_near(px.u_right, 80.5, 0.0);
  // The smallest move onto v_left = v_right: any other row moves the match farther.
  const auto moved = [&](double v) {
    return (v - match.v_left) * (v - match.v_left) + (v - match.v_right) * (v - match.v_right);
  };
  for (const double off : {-0.5, -0.01, 0.01, 0.5}) assert_true(moved(px.v_left + off) > moved(px.v_left));
}

void test_mast_by_hand(void**) {
  const Pose3 T = mast_pose(0.7, 0.0, 0.12);
  assert_near((T * Vec3(0.0, 0.0, 1.0) - Vec3(1.0, 0.06, 0.7)).norm(), 0.0, 1e-12);   // looks ahead
  assert_near((T * Vec3(1.0, 0.0, 0.0) - Vec3(0.0, -0.94, 0.7)).norm(), 0.0, 1e-12);  // right is right
  assert_near((T * Vec3(0.0, 1.0, 0.0) - Vec3(0.0, 0.06, -0.3)).norm(), 0.0, 1e-12);  // down is down
  const Pose3 down = mast_pose(0.7, 39.0 * kRadPerDeg, 0.12);
  const Vec3 axis = down.q * Vec3(0.0, 0.0, 1.0);
  assert_near(axis.z(), -std::sin(39.0 * kRadPerDeg), 1e-12);
  assert_near(axis.x(), std::cos(39.0 * kRadPerDeg), 1e-12);
  assert_true(is_valid(down));
}

/// Next line of numbers of a table; comment lines are passed over.
bool read_row(std::FILE* file, double* numbers, int count) {
  char line[512];
  while (std::fgets(line, sizeof line, file) != nullptr) {
    if (line[0] == '#') continue;
    int used = 0;
    int at = 0;
    for (int i = 0; i < count; ++i, at += used) {
      if (std::sscanf(line + at, "%lf%n", &numbers[i], &used) != 1) return false;
    }
    return true;
  }
  return false;
}

void test_mast_agrees_with_the_sample(void**) {
#ifdef CAIRN_NO_FILES
  print_message("skipped: the sample's files, where there is no file system\n");
  skip();
#endif
  // Poses of rover and left camera as the sample's renderer wrote them.
  std::FILE* rover = std::fopen(CAIRN_SOURCE_DIR "/unit_tests/integration/sample/truth_rover.txt", "r");
  std::FILE* camera =
      std::fopen(CAIRN_SOURCE_DIR "/unit_tests/integration/sample/truth_left_camera.tum", "r");
  assert_non_null(rover);
  assert_non_null(camera);
  const Pose3 T_rover_cam = mast_pose(0.7, 39.0 * kRadPerDeg, 0.12);
  double r[8];
  double c[8];
  int rows = 0;
  while (read_row(rover, r, 8) && read_row(camera, c, 8)) {
    ++rows;
    assert_near(r[0], c[0], 0.0);
    const Pose3 T_map_rover = {quat_from_attitude({r[5] * kRadPerDeg, r[6] * kRadPerDeg, r[7] * kRadPerDeg}),
                               Vec3(r[2], r[3], r[4])};
    const Pose3 T_map_cam = {Quat(c[7], c[4], c[5], c[6]).normalized(), Vec3(c[1], c[2], c[3])};
    const Pose3 off = (T_map_rover * T_rover_cam).inverse() * T_map_cam;
    assert_at_most(off.t.norm(), 3e-6);
    assert_at_most(quat_log(off.q).norm(), 1e-7);
  }
  std::fclose(rover);
  std::fclose(camera);
  assert_int_equal(rows, 91);
}

void test_validity_corners(void**) {
  assert_true(is_valid(rig_of_the_paper()));
  assert_false(is_valid(StereoRig()));
  const double inf = std::numeric_limits<double>::infinity();
  for (double StereoRig::*member : {&StereoRig::fx_px, &StereoRig::fy_px, &StereoRig::baseline_m}) {
    for (const double bad : {0.0, -1.0, static_cast<double>(NAN), inf}) {
      StereoRig rig = rig_of_the_paper();
      rig.*member = bad;
      assert_false(is_valid(rig));
    }
  }
  for (double StereoRig::*member : {&StereoRig::cx_px, &StereoRig::cy_px}) {
    StereoRig rig = rig_of_the_paper();
    rig.*member = -10.0;  // a principal point may lie outside the image
    assert_true(is_valid(rig));
    for (const double bad : {static_cast<double>(NAN), inf, -inf}) {
      rig.*member = bad;
      assert_false(is_valid(rig));
    }
  }
  for (int StereoRig::*member : {&StereoRig::width_px, &StereoRig::height_px}) {
    for (const int bad : {0, -512}) {
      StereoRig rig = rig_of_the_paper();
      rig.*member = bad;
      assert_false(is_valid(rig));
    }
  }
  StereoRig rig = rig_of_the_paper();
  rig.T_rover_cam.t.x() = NAN;
  assert_false(is_valid(rig));
}

void test_preconditions_assert(void**) {
  static const StereoRig rig = rig_of_the_paper();
  assert_true(test::asserts([] { project(rig, Vec3(0.0, 0.0, 0.0)); }));
  assert_true(test::asserts([] { project(rig, Vec3(0.0, 0.0, -1.0)); }));
  assert_true(test::asserts([] { triangulate(rig, {10.0, 5.0, 10.0, 5.0}); }));
  assert_true(test::asserts([] { triangulate(rig, {10.0, 5.0, 11.0, 5.0}); }));
}

/// Without a lens all is as it was, to the bit; with one it is moved along the ray from the principal point,
/// and back by the inverse.
void test_lens(void**) {
  StereoRig rig;
  rig.width_px = 512;
  rig.height_px = 384;
  rig.fx_px = 394.2;
  rig.fy_px = 390.1;
  rig.cx_px = 255.3;
  rig.cy_px = 191.7;
  rig.baseline_m = 0.12;
  for (const double lens : {-0.3, -0.02, 0.0, 0.02, 0.1}) {
    for (int k = 0; k < 40; ++k) {
      const double u = 12.7 * k;
      const double v = 9.6 * k;
      const StereoPixel ideal = {u, v, 500.0 - u, 0.9 * v};
      const StereoPixel seen = with_lens(rig, lens, ideal);
      const StereoPixel back = without_lens(rig, lens, seen);
      assert_near(back.u_left, ideal.u_left, lens == 0.0 ? 0.0 : 1e-9);
      assert_near(back.v_left, ideal.v_left, lens == 0.0 ? 0.0 : 1e-9);
      assert_near(back.u_right, ideal.u_right, lens == 0.0 ? 0.0 : 1e-9);
      assert_near(back.v_right, ideal.v_right, lens == 0.0 ? 0.0 : 1e-9);
      const double x = (u - rig.cx_px) / rig.fx_px;
      const double y = (v - rig.cy_px) / rig.fy_px;
      const double xd = (seen.u_left - rig.cx_px) / rig.fx_px;
      const double yd = (seen.v_left - rig.cy_px) / rig.fy_px;
      assert_near(x * yd - y * xd, 0.0, 1e-12);
      assert_near(xd, x * (1.0 + lens * (xd * xd + yd * yd)), 1e-12);
      if (lens < 0.0) assert_true(xd * xd + yd * yd <= x * x + y * y);  // a barrel
    }
  }
  const ImageOffset offset = {0.75, -1.5, -0.02};
  const StereoPixel ideal = {400.0, 40.0, 370.0, 40.0};
  const StereoPixel back = to_ideal(rig, offset, to_seen(rig, offset, ideal));
  assert_near(back.u_right, ideal.u_right, 1e-9);
  assert_near(back.v_right, ideal.v_right, 1e-9);
  assert_near(to_seen(rig, {0.75, -1.5}, ideal).v_right, 40.75, 0.0);
  assert_near(to_seen(rig, {0.75, -1.5}, ideal).u_right, 368.5, 0.0);
}

/// The middle of a pixel that is the mean of four lies between them: a point's place in the one is that
/// in the other.
void test_halved(void**) {
  StereoRig rig;
  rig.width_px = 513;
  rig.height_px = 384;
  rig.fx_px = 400.0;
  rig.fy_px = 380.0;
  rig.cx_px = 250.0;
  rig.cy_px = 190.0;
  rig.baseline_m = 0.12;
  const StereoRig half = halved(rig);
  assert_int_equal(half.width_px, 256);
  assert_int_equal(half.height_px, 192);
  const Vec3 p(0.4, -0.3, 2.0);
  const StereoPixel whole_px = project(rig, p);
  const StereoPixel half_px = project(half, p);
  assert_near(from_halved(half_px.u_left), whole_px.u_left, 1e-12);
  assert_near(from_halved(half_px.v_left), whole_px.v_left, 1e-12);
  assert_near(from_halved(half_px.u_right), whole_px.u_right, 1e-12);
  assert_near(from_halved(0.0), 0.5, 0.0);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_projection_by_hand),
      cmocka_unit_test(test_round_trip),
      cmocka_unit_test(test_sampson),
      cmocka_unit_test(test_mast_by_hand),
      cmocka_unit_test(test_mast_agrees_with_the_sample),
      cmocka_unit_test(test_lens),
      cmocka_unit_test(test_halved),
      cmocka_unit_test(test_validity_corners),
      cmocka_unit_test(test_preconditions_assert),
  };
  return cmocka_run_group_tests_name("stereo_rig", tests, nullptr, nullptr);
}
