// Camera models: against formulas written out anew, and against themselves backwards.
#include "dataset/camera_model.hpp"

#include <cmath>
#include <vector>

#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

CameraModel pinhole() {
  CameraModel camera;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = 400.0;
  camera.fy_px = 410.0;
  camera.cx_px = 322.0;
  camera.cy_px = 238.0;
  return camera;
}

std::vector<CameraModel> all_lenses() {
  std::vector<CameraModel> out(6, pinhole());
  out[1].lens = Lens::kRadialTangential;
  out[1].k = {-0.28, 0.07, 2e-4, -3e-4, 0.0};
  out[2].lens = Lens::kRational;
  out[2].k = {0.1, -0.02, 1e-4, 2e-4, 0.001, 0.2, 0.01, 0.001};
  out[3].lens = Lens::kEquidistant;
  out[3].k = {-0.01, 0.02, -0.01, 0.002};
  out[4].lens = Lens::kCahvor;
  out[4].k = {0.001, -0.05, 0.02};
  out[4].axis = Vec3(0.02, -0.01, 1.0).normalized();
  out[5].lens = Lens::kCahvore;
  out[5].k = {0.001, 0.01, -0.002, 0.003, 0.002, 0.001, 0.4};
  out[5].axis = Vec3(-0.01, 0.015, 1.0).normalized();
  return out;
}

// What is seen at a pixel is projected onto that pixel, corners included.
void test_directions_undo_projections(void**) {
  for (const CameraModel& camera : all_lenses()) {
    int seen = 0;
    for (int v = 0; v < 480; v += 31) {
      for (int u = 0; u < 640; u += 29) {
        const std::optional<Vec3> ray = direction(camera, Vec2(u, v));
        if (!ray) continue;
        ++seen;
        const std::optional<Vec2> back = project(camera, 1000.0 * *ray);
        assert_true(back.has_value());
        assert_at_most((*back - Vec2(u, v)).norm(), 1e-6);
      }
    }
    if (seen != 16 * 23)
      fail_msg("%s: %d of %d pixels have a direction", lens_name(camera.lens), seen, 16 * 23);
  }
}

// JPL's CAHVOR as it is written in the label's own frame of reference, on points near and far.
void test_cahvor_is_the_labels(void**) {
  Cahv m{Vec3(0.442604, -0.0611635, -1.25106), Vec3(0.93995, -0.338133, 0.0464979),
         Vec3(884.72, 981.763, 24.1472), Vec3(418.579, -152.039, 1245.75)};
  m.o = Vec3(0.946551, -0.315595, 0.0666419);
  m.r = Vec3(0.00096, -0.002183, 0.018547);
  const PosedCamera posed = from_cahv(m, Lens::kCahvor);
  int inside = 0;
  for (double across = -0.5; across <= 0.5; across += 0.1) {
    for (double down = -0.5; down <= 0.5; down += 0.1) {
      for (const double range : {1.0, 30.0}) {
        const Vec3 p = range * (m.a + across * Vec3(0.34, 0.94, 0.0) + down * Vec3(0.0, 0.0, 1.0));
        const double omega = p.dot(m.o);
        const Vec3 lambda = p - omega * m.o;
        const double tau = lambda.squaredNorm() / (omega * omega);
        const Vec3 bent = p + (m.r.x() + m.r.y() * tau + m.r.z() * tau * tau) * lambda;
        const Vec2 expected(bent.dot(m.h) / bent.dot(m.a), bent.dot(m.v) / bent.dot(m.a));
        const std::optional<Vec2> got = project(posed.camera, posed.T_cam_ref * (p + m.c));
        assert_true(got.has_value());
        assert_at_most((*got - expected).norm(), 1e-2);  // the label's O and A are rounded to six digits
        inside +=
            expected.x() >= 0.0 && expected.x() < 1024.0 && expected.y() >= 0.0 && expected.y() < 1024.0;
      }
    }
  }
  assert_at_least(inside, 50);
}

// CAHVORE without a lens of its own, and perspective, is a pinhole; as a fish-eye it is one of equal angles.
void test_cahvore_between_its_limits(void**) {
  Cahv m{Vec3(0.1, 0.2, 0.3), Vec3(0.0, 0.0, 1.0), Vec3(400.0, 0.0, 320.0), Vec3(0.0, 400.0, 240.0)};
  m.o = m.a;
  for (const Vec3& p : {Vec3(0.0, 0.0, 2.0), Vec3(1.0, 0.5, 2.0), Vec3(-3.0, 2.0, 2.0)}) {
    const double r = p.head<2>().norm(), theta = std::atan2(r, p.z());
    m.linearity = 1.0;
    const PosedCamera perspective = from_cahv(m, Lens::kCahvore);
    assert_near(
        (*project(perspective.camera, p) - Vec2(400.0 * p.x() / 2.0 + 320.0, 400.0 * p.y() / 2.0 + 240.0))
            .norm(),
        0.0, 1e-9);
    m.linearity = 0.0;
    const PosedCamera fisheye = from_cahv(m, Lens::kCahvore);
    const Vec2 expected =
        Vec2(320.0, 240.0) + (r > 0.0 ? Vec2(p.head<2>() * (400.0 * theta / r)) : Vec2(0.0, 0.0));
    assert_near((*project(fisheye.camera, p) - expected).norm(), 0.0, 1e-9);
  }
  // The pupil moves: with e0 the near is seen elsewhere than the far, in the middle nowhere else.
  m.linearity = 1.0;
  m.e = Vec3(0.05, 0.0, 0.0);
  const CameraModel moving = from_cahv(m, Lens::kCahvore).camera;
  const auto apart = [&](const Vec3& p) {
    return (*project(moving, p) - *project(moving, 1000.0 * p)).norm();
  };
  assert_near(apart(Vec3(0.0, 0.0, 1.0)), 0.0, 1e-9);
  assert_at_least(apart(Vec3(0.8, 0.0, 1.0)), 0.1);
  // Gennery's equation of the angle holds at what was found: (theta - sin) E = zeta sin - lambda cos.
  const double x = (project(moving, Vec3(0.8, 0.0, 1.0))->x() - 320.0) / 400.0;
  const double theta = std::atan(x);
  assert_near(1.0 * std::sin(theta) - 0.8 * std::cos(theta), (theta - std::sin(theta)) * 0.05, 1e-12);
}

void test_nothing_is_seen_behind(void**) {
  for (const CameraModel& camera : all_lenses())
    assert_false(project(camera, Vec3(0.1, 0.1, -1.0)).has_value());
  // Beyond where barrel distortion turns back: r (1 - 0.28 r2) does at r2 = 1 / 0.84.
  CameraModel barrel = pinhole();
  barrel.lens = Lens::kRadialTangential;
  barrel.k = {-0.28};
  assert_true(project(barrel, Vec3(1.0, 0.0, 1.0)).has_value());
  assert_false(project(barrel, Vec3(1.2, 0.0, 1.0)).has_value());
}

void test_fields_of_view(void**) {
  CameraModel camera = pinhole();
  camera.cx_px = 319.5;
  camera.cy_px = 239.5;
  const Vec2 fov = *fields_of_view(camera);
  assert_near(fov.x(), 2.0 * std::atan(320.0 / 400.0), 1e-9);
  assert_near(fov.y(), 2.0 * std::atan(240.0 / 410.0), 1e-9);
  camera.width_px = 0;
  assert_false(fields_of_view(camera).has_value());
}

CameraPair good_pair() {
  CameraPair pair;
  pair.left = pair.right = pinhole();
  pair.T_right_left.t = Vec3(-0.12, 0.0, 0.0);
  return pair;
}

void check(const CameraPair& pair, const char* fault, const char* why) {
  static std::string got;
  got = fault_of(pair);
  if (fault[0] == '\0' ? !got.empty() : got.find(fault) == std::string::npos)
    fail_msg("fault '%s', expected '%s'", got.c_str(), fault);
  got = why_not_rectified(pair);
  if (why[0] == '\0' ? !got.empty() : got.find(why) == std::string::npos)
    fail_msg("not rectified for '%s', expected '%s'", got.c_str(), why);
}

void test_faults_and_what_is_not_rectified(void**) {
  check(good_pair(), "", "");
  assert_near(rectified_rig(good_pair()).baseline_m, 0.12, 0.0);
  const auto with = [](const auto& change, const char* fault, const char* why) {
    CameraPair pair = good_pair();
    change(pair);
    check(pair, fault, why);
  };
  with([](CameraPair& p) { p.left.fx_px = NAN; }, "left camera holds a number that is not finite", "");
  with([](CameraPair& p) { p.right.fy_px = 0.0; }, "above 0", "focal lengths differ");
  with([](CameraPair& p) { p.left.fx_px = p.left.fy_px = 1.0e200; }, "no camera's", "differ");
  with([](CameraPair& p) { p.right.fy_px = 2.5 * p.right.fx_px; }, "no camera's", "differ");
  with([](CameraPair& p) { p.left.fx_px = p.left.fy_px = 0.8, p.left.cx_px = p.left.cy_px = 0.5; },
       "normalised", "differ");
  with([](CameraPair& p) { p.right.cx_px = 2555.0; }, "right camera's principal point (2555, 238) is outside",
       "principal");
  with([](CameraPair& p) { p.T_right_left.t.x() = -120.0; }, "0.12 if these are millimetres", "");
  with([](CameraPair& p) { p.T_right_left.t.x() = 0.0; }, "same place", "");
  with([](CameraPair& p) { p.T_right_left.t.x() = 0.12; }, "swapped", "");
  with([](CameraPair& p) { p.T_right_left.t = Vec3(0.0, -0.3, 0.0); }, "side by side", "x axis");
  with([](CameraPair& p) { p.left.lens = Lens::kEquidistant; }, "", "a lens (equidistant)");
  with([](CameraPair& p) { p.left.skew_px = 0.1; }, "", "skew");
  with([](CameraPair& p) { p.right.cy_px += 3.2; }, "", "principal points differ");
  with([](CameraPair& p) { p.right.fx_px *= 1.01; }, "", "focal lengths differ");
  with([](CameraPair& p) { p.T_right_left.q = quat_exp(Vec3(0.001, 0.0, 0.0)); }, "",
       "turned by 0.0573 degrees");
  // A hundredth of the baseline to the side is let pass, whatever its length.
  for (const double b : {0.12, 1.0}) {
    with([b](CameraPair& p) { p.T_right_left.t = Vec3(-b, 0.009 * b, 0.0); }, "", "");
    with([b](CameraPair& p) { p.T_right_left.t = Vec3(-b, 0.011 * b, 0.0); }, "", "x axis, 1.1 % of");
    with([b](CameraPair& p) { p.T_right_left.t = Vec3(-b, 0.0, -0.011 * b); }, "", "x axis");
  }
  with([](CameraPair& p) { p.T_right_left.t.x() = -0.12 / 400.0; }, "0.12 if a projection's fourth column",
       "");
  with([](CameraPair& p) { p.T_right_left.t.x() = -0.12e-3; }, "0.12 if these are thousandths", "");
}

void test_doubts(void**) {
  const auto doubt = [](double fx, double fy, double cx, double cy, const char* words, int width_px = 512) {
    CameraPair pair = good_pair();
    pair.left.width_px = width_px;
    pair.left.height_px = 384;
    pair.left.fx_px = fx, pair.left.fy_px = fy, pair.left.cx_px = cx, pair.left.cy_px = cy;
    pair.right = pair.left;
    static std::string got;
    for (CameraModel* const one : {&pair.left, &pair.right}) {
      got = doubt_of(pair);
      if (words[0] == '\0' ? !got.empty() : got.find(words) == std::string::npos)
        fail_msg("doubt '%s', expected '%s'", got.c_str(), words);
      *one = good_pair().left;  // then the same of the right camera alone
    }
  };
  CameraPair good = good_pair();
  assert_string_equal(doubt_of(good).c_str(), "");
  doubt(394.0, 410.0, 255.5 + 60.0, 191.5 - 45.0, "");
  doubt(394.0, 394.0, 255.5 + 63.0, 191.5, "far from the middle");
  doubt(394.0, 394.0, 255.5, 191.5 - 47.0, "far from the middle");
  doubt(197.0, 197.0, 127.5, 95.5, "multiply fx, fy, cx and cy by 2");
  doubt(394.0, 420.0, 255.5, 191.5, "oblong pixels");
  doubt(394.0, 394.0, 191.5, 255.5, "", 0);  // no size, no middle
}

/// Four numbers in another order are no rig with a centre far off, but a mistake with its mend.
void test_intrinsics_in_another_order(void**) {
  const auto order = [](double fx, double fy, double cx, double cy, const char* words, int width_px = 512) {
    CameraPair pair = good_pair();
    pair.left.width_px = pair.right.width_px = width_px;
    pair.left.height_px = pair.right.height_px = 384;
    for (CameraModel* const c : {&pair.left, &pair.right})
      c->fx_px = fx, c->fy_px = fy, c->cx_px = cx, c->cy_px = cy;
    check(pair, words, "");
  };
  order(394.0, 258.0, 394.2, 189.0,
        "left camera's intrinsics (394 258 394.2 189) are those of its 512 x 384");
  order(394.0, 258.0, 394.2, 189.0, "in the order fx cx fy cy");
  order(258.0, 189.0, 394.0, 394.2, "in the order cx cy fx fy");
  order(300.0, 300.0, 189.0, 258.0, "in the order fx fy cy cx");
  order(394.0, 258.0, 394.2, 189.0, "", 0);  // no size, no middle
  order(394.0, 258.0, 380.0, 189.0, "");     // oblong, whatever the order
  order(394.0, 394.0, 330.0, 240.0, "");     // a part of a sensor
  order(250.0, 250.0, 255.5, 191.5, "");     // wide angles: any order looks the same
  order(255.5, 255.5, 200.0, 185.0, "");
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_directions_undo_projections),
      cmocka_unit_test(test_cahvor_is_the_labels),
      cmocka_unit_test(test_cahvore_between_its_limits),
      cmocka_unit_test(test_nothing_is_seen_behind),
      cmocka_unit_test(test_fields_of_view),
      cmocka_unit_test(test_faults_and_what_is_not_rectified),
      cmocka_unit_test(test_doubts),
      cmocka_unit_test(test_intrinsics_in_another_order),
  };
  return cmocka_run_group_tests_name("ground_tools/dataset/camera_model", tests, nullptr, nullptr);
}
