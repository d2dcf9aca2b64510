// Lenses against OpenCV's, of which the coefficients come.
#include <opencv2/calib3d.hpp>

#include "dataset/camera_model.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

void compare(Lens lens, const std::vector<double>& coefficients) {
  CameraModel camera;
  camera.fx_px = 460.0;
  camera.fy_px = 455.0;
  camera.cx_px = 367.0;
  camera.cy_px = 248.0;
  camera.lens = lens;
  std::copy(coefficients.begin(), coefficients.end(), camera.k.begin());
  const cv::Matx33d K(460.0, 0.0, 367.0, 0.0, 455.0, 248.0, 0.0, 0.0, 1.0);
  std::vector<cv::Point3d> points;
  for (double x = -0.8; x <= 0.8; x += 0.1) {
    for (double y = -0.5; y <= 0.5; y += 0.1) points.emplace_back(2.0 * x, 2.0 * y, 2.0);
  }
  std::vector<cv::Point2d> pixels;
  const cv::Vec3d zero(0.0, 0.0, 0.0);
  if (lens == Lens::kEquidistant) {
    cv::fisheye::projectPoints(points, pixels, zero, zero, K, coefficients);
  } else {
    cv::projectPoints(points, zero, zero, K, coefficients, pixels);
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::optional<Vec2> at = project(camera, Vec3(points[i].x, points[i].y, points[i].z));
    assert_true(at.has_value());
    assert_near(at->x(), pixels[i].x, 1e-9);
    assert_near(at->y(), pixels[i].y, 1e-9);
  }
}

void test_lenses_are_opencvs(void**) {
  compare(Lens::kNone, {0.0, 0.0, 0.0, 0.0});
  compare(Lens::kRadialTangential, {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05});
  compare(Lens::kRadialTangential, {-0.28, 0.074, 2e-3, -1e-3, 0.01});
  compare(Lens::kRational, {0.4, -0.1, 1e-3, 2e-3, 0.01, 0.7, 0.02, 0.03});
  compare(Lens::kEquidistant, {-0.013, 0.021, -0.013, 0.002});
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_lenses_are_opencvs)};
  return cmocka_run_group_tests_name("opencv/lenses", tests, nullptr, nullptr);
}
