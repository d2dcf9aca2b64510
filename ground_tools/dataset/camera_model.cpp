#include "dataset/camera_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace cairn::ground {
namespace {

constexpr double kLeastBaseline_m = 0.01, kMostBaseline_m = 10.0;
constexpr double kMostPixels = 1.0e5;  // of a focal length, and of a principal point
constexpr double kMostAspect = 2.0;    // of focal lengths: pixels that are oblong
constexpr double kMostOffRow = 0.01;   // of the baseline

/// The factor of the radius squared.
double radial_factor(const CameraModel& camera, double r2) {
  const auto& k = camera.k;
  const double over = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  return camera.lens == Lens::kRational ? over / (1.0 + r2 * (k[5] + r2 * (k[6] + r2 * k[7]))) : over;
}

std::optional<Vec2> brown(const CameraModel& camera, const Vec2& a) {
  // A polynomial that has turned back shows places that the lens does not see.
  const double r2 = a.squaredNorm();
  const double r = std::sqrt(r2);
  double before = 0.0;
  constexpr int kSteps = 8;
  for (int i = 1; i <= kSteps; ++i) {
    const double at = r * i / kSteps;
    const double bent = at * radial_factor(camera, at * at);
    if (r > 0.0 && !(bent > before)) return std::nullopt;
    before = bent;
  }
  const double p1 = camera.k[2], p2 = camera.k[3], ab = a.x() * a.y();
  return Vec2(a * radial_factor(camera, r2) + Vec2(2.0 * p1 * ab + p2 * (r2 + 2.0 * a.x() * a.x()),
                                                   p1 * (r2 + 2.0 * a.y() * a.y()) + 2.0 * p2 * ab));
}

std::optional<Vec2> equidistant(const CameraModel& camera, const Vec2& a) {
  const double r = a.norm();
  if (r < 1.0e-12) return a;
  const auto bent = [&](double theta) {
    const double t = theta * theta;
    return theta * (1.0 + t * (camera.k[0] + t * (camera.k[1] + t * (camera.k[2] + t * camera.k[3]))));
  };
  const double theta = std::atan(r);
  if (!(bent(theta) > bent(0.98 * theta))) return std::nullopt;
  return Vec2(a * (bent(theta) / r));
}

std::optional<Vec3> cahvor(const CameraModel& camera, const Vec3& p) {
  const double omega = p.dot(camera.axis);
  if (!(omega > 0.0)) return std::nullopt;
  const Vec3 lambda = p - omega * camera.axis;
  const double tau = lambda.squaredNorm() / (omega * omega);
  return Vec3(p + (camera.k[0] + tau * (camera.k[1] + tau * camera.k[2])) * lambda);
}

/// The entrance pupil moves along the axis with the angle theta of the ray, found by Newton.
std::optional<Vec3> cahvore(const CameraModel& camera, const Vec3& p) {
  const auto& k = camera.k;
  const double zeta = p.dot(camera.axis);
  const Vec3 beside = p - zeta * camera.axis;
  const double lambda = beside.norm();
  if (lambda < 1.0e-12 * p.norm()) return zeta > 0.0 ? std::optional<Vec3>(p) : std::nullopt;
  double theta = std::atan2(lambda, zeta);
  for (int i = 0; i < 50; ++i) {
    const double s = std::sin(theta), c = std::cos(theta), t = theta * theta;
    const double shift = k[3] + t * (k[4] + t * k[5]);
    const double slope = theta * (2.0 * k[4] + 4.0 * t * k[5]);
    const double upsilon = zeta * c + lambda * s - (1.0 - c) * shift - (theta - s) * slope;
    const double step = (zeta * s - lambda * c - (theta - s) * shift) / upsilon;
    if (!std::isfinite(step)) return std::nullopt;
    theta -= step;
    if (std::fabs(step) < 1.0e-14) break;
  }
  const double linearity = k[6];
  const double angle = linearity * theta;
  double chi = theta;
  if (linearity > 1.0e-15) {
    if (!(angle < kPi / 2.0)) return std::nullopt;
    chi = std::tan(angle) / linearity;
  } else if (linearity < -1.0e-15) {
    chi = std::sin(angle) / linearity;
  }
  if (!(theta * chi > 0.0)) return std::nullopt;
  const double chi2 = chi * chi;
  const double mu = k[0] + chi2 * (k[1] + chi2 * k[2]);
  return Vec3((lambda / chi) * camera.axis + (1.0 + mu) * beside);
}

std::optional<Vec2> through_lens(const CameraModel& camera, const Vec3& p) {
  if (camera.lens == Lens::kCahvor || camera.lens == Lens::kCahvore) {
    const std::optional<Vec3> bent = camera.lens == Lens::kCahvor ? cahvor(camera, p) : cahvore(camera, p);
    if (!bent || !(bent->z() > 0.0)) return std::nullopt;
    return Vec2(bent->x() / bent->z(), bent->y() / bent->z());
  }
  if (!(p.z() > 0.0)) return std::nullopt;
  const Vec2 a(p.x() / p.z(), p.y() / p.z());
  switch (camera.lens) {
    case Lens::kRadialTangential:
    case Lens::kRational: return brown(camera, a);
    case Lens::kEquidistant: return equidistant(camera, a);
    default: return a;
  }
}

Vec2 pinhole(const CameraModel& camera, const Vec2& a) {
  return {camera.fx_px * a.x() + camera.skew_px * a.y() + camera.cx_px, camera.fy_px * a.y() + camera.cy_px};
}

double angle_between(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

bool is_finite(const CameraModel& c) {
  const auto all = {c.fx_px, c.fy_px, c.cx_px, c.cy_px, c.skew_px, c.axis.sum()};
  const auto finite = [](double value) { return std::isfinite(value); };
  return std::all_of(all.begin(), all.end(), finite) && std::all_of(c.k.begin(), c.k.end(), finite);
}

constexpr double kMostOffMiddle = 0.12, kMostApart = 1.05;

/// Its principal point is farther from the middle of the image than nearly all cameras have it.
bool off_middle(const CameraModel& c) {
  const double u = (c.width_px - 1) / 2.0, v = (c.height_px - 1) / 2.0;
  return c.width_px > 0 && (std::fabs(c.cx_px - u) > kMostOffMiddle * c.width_px ||
                            std::fabs(c.cy_px - v) > kMostOffMiddle * c.height_px);
}

/// Oblong pixels.
bool apart(const CameraModel& c) {
  return std::max(c.fx_px, c.fy_px) > kMostApart * std::min(c.fx_px, c.fy_px);
}

/// The order in which the four numbers are a usual camera's, where they are none as they stand; else null.
const char* order_that_fits(const CameraModel& c) {
  constexpr double kSquare = 1.02, kNear = 0.1;  // of the middle's column and row
  const double u = (c.width_px - 1) / 2.0, v = (c.height_px - 1) / 2.0;
  const auto usual = [&](double fx, double fy, double cx, double cy) {
    return std::max(fx, fy) <= kSquare * std::min(fx, fy) && std::fabs(cx - u) < kNear * u &&
           std::fabs(cy - v) < kNear * v;
  };
  if (c.width_px == 0 || !(off_middle(c) || apart(c))) return nullptr;
  if (usual(c.fx_px, c.cx_px, c.fy_px, c.cy_px)) return "fx cx fy cy";
  if (usual(c.cx_px, c.cy_px, c.fx_px, c.fy_px)) return "cx cy fx fy";
  if (usual(c.fx_px, c.fy_px, c.cy_px, c.cx_px)) return "fx fy cy cx";
  return nullptr;
}

std::string fault_of_camera(const CameraModel& c, const char* side) {
  if (!is_finite(c)) return fmt::format("the {} camera holds a number that is not finite", side);
  if (!(c.fx_px > 0.0 && c.fy_px > 0.0))
    return fmt::format("focal lengths must be above 0; the {} camera has fx {:g}, fy {:g}", side, c.fx_px,
                       c.fy_px);
  if (std::max({c.fx_px, c.fy_px, std::fabs(c.cx_px), std::fabs(c.cy_px)}) < 8.0) {
    return fmt::format(
        "the {} camera's intrinsics ({:g} {:g} {:g} {:g}) look normalised by the image's size; give pixels: "
        "multiply fx and cx by the width, fy and cy by the height",
        side, c.fx_px, c.fy_px, c.cx_px, c.cy_px);
  }
  if (std::max({c.fx_px, c.fy_px, std::fabs(c.cx_px), std::fabs(c.cy_px)}) > kMostPixels ||
      std::max(c.fx_px, c.fy_px) > kMostAspect * std::min(c.fx_px, c.fy_px)) {
    return fmt::format(
        "the {} camera's intrinsics ({:g} {:g} {:g} {:g}) are no camera's; fx, fy, cx and cy are asked for, in "
        "pixels",
        side, c.fx_px, c.fy_px, c.cx_px, c.cy_px);
  }
  if (const char* const order = order_that_fits(c)) {
    return fmt::format(
        "the {} camera's intrinsics ({:g} {:g} {:g} {:g}) are those of its {} x {} images in the order {}; the order "
        "asked for is fx fy cx cy",
        side, c.fx_px, c.fy_px, c.cx_px, c.cy_px, c.width_px, c.height_px, order);
  }
  if (c.width_px > 0 &&
      !(c.cx_px >= 0.0 && c.cx_px < c.width_px && c.cy_px >= 0.0 && c.cy_px < c.height_px)) {
    return fmt::format(
        "the {} camera's principal point ({:g}, {:g}) is outside of the image of {} x {}; was it calibrated at "
        "another size? scale fx, cx, fy, cy with the image",
        side, c.cx_px, c.cy_px, c.width_px, c.height_px);
  }
  return {};
}

std::string fault_of_baseline(const CameraPair& pair) {
  const double b = baseline_m(pair);
  if (!std::isfinite(b)) return "the right camera's place is not finite";
  if (b < 1.0e-6) {
    return "both cameras stand at the same place (no baseline); the right projection alone has -fx times the "
           "baseline in its fourth column";
  }
  if (b < kLeastBaseline_m) {
    return fmt::format(
        "a baseline of {:g} m is not that of a rover; metres are asked for (millimetres of Middlebury's files): "
        "{:g} if these are thousandths, {:g} if a projection's fourth column lacks the factor fx",
        b, b * 1.0e3, b * pair.left.fx_px);
  }
  if (b > kMostBaseline_m) {
    const double fx = pair.left.fx_px;
    return fmt::format(
        "a baseline of {:g} m is not that of a rover; metres are asked for: {:g} if these are millimetres, {:g} if "
        "centimetres, {:g} if it is the product with fx",
        b, b * 1.0e-3, b * 1.0e-2, b / fx);
  }
  if (pair.T_right_left.t.x() > 0.5 * b)
    return fmt::format(
        "the right camera stands {:g} m to the left of the left one; are left and right swapped, "
        "or the baseline's sign (it must be above 0)?",
        pair.T_right_left.t.x());
  if (!(-pair.T_right_left.t.x() > 0.5 * b))
    return "the cameras do not stand side by side, and no other pairs are known; is the pose of a camera the inverse of "
           "what its format has, or its matrix column by column?";
  return {};
}

/// What can be wrong, and is a few rigs' own: with the mend.
std::string doubt_of_camera(const CameraModel& c, const char* side) {
  constexpr double kNear = 0.1;
  const double u = (c.width_px - 1) / 2.0, v = (c.height_px - 1) / 2.0;
  const bool off = off_middle(c);
  if (!off && !apart(c)) return {};
  const std::string found =
      off ? fmt::format(
                "the {} camera's principal point ({:g}, {:g}) is far from the middle of the {} x {} image",
                side, c.cx_px, c.cy_px, c.width_px, c.height_px)
          : fmt::format("the {} camera's focal lengths, fx {:g} and fy {:g}, are those of oblong pixels",
                        side, c.fx_px, c.fy_px);
  const double scale = off ? u / c.cx_px : 1.0;
  if (off && std::fabs(scale - 1.0) > kNear && std::fabs(scale * c.cy_px - v) < kNear * v)
    return found + fmt::format("; calibrated at another size? multiply fx, fy, cx and cy by {:.3g}", scale);
  return found + "; look whether the calibration is of these images, and its numbers in their order";
}

}  // namespace

PosedCamera from_cahv(const Cahv& model, Lens lens) {
  PosedCamera out;
  CameraModel& camera = out.camera;
  const Vec3 z = model.a.normalized();
  const Vec3 down = model.v - model.v.dot(z) * z;
  const Vec3 y = down.normalized();
  const Vec3 x = y.cross(z);
  camera.fx_px = model.h.dot(x);
  camera.skew_px = model.h.dot(y);
  camera.cx_px = model.h.dot(z);
  camera.fy_px = down.norm();
  camera.cy_px = model.v.dot(z);
  Mat3 R_cam_ref;
  R_cam_ref << x.transpose(), y.transpose(), z.transpose();
  out.T_cam_ref.q = Quat(R_cam_ref).normalized();
  out.T_cam_ref.t = -(R_cam_ref * model.c);
  camera.lens = lens;
  if (lens == Lens::kNone) return out;
  camera.axis = (R_cam_ref * model.o).normalized();
  camera.k = {model.r.x(), model.r.y(), model.r.z(), 0.0, 0.0, 0.0, 0.0, 0.0};
  if (lens == Lens::kCahvore) {
    for (int i = 0; i < 3; ++i) camera.k[static_cast<std::size_t>(3 + i)] = model.e[i];
    camera.k[6] = model.linearity;
  }
  return out;
}

std::optional<Vec2> project(const CameraModel& camera, const Vec3& p_cam_m) {
  const std::optional<Vec2> a = through_lens(camera, p_cam_m);
  if (!a) return std::nullopt;
  return pinhole(camera, *a);
}

std::optional<Vec3> direction(const CameraModel& camera, const Vec2& pixel) {
  // CAHVORE's pupil moves by millimetres: at a kilometre nobody sees that.
  constexpr double kFar_m = 1000.0;
  const auto seen = [&](const Vec2& a) { return project(camera, kFar_m * Vec3(a.x(), a.y(), 1.0)); };
  const double y = (pixel.y() - camera.cy_px) / camera.fy_px;
  const Vec2 straight((pixel.x() - camera.cx_px - camera.skew_px * y) / camera.fx_px, y);
  // Strong lenses see nothing where the pinhole would: from the middle outwards.
  for (const double share : {1.0, 0.7, 0.4}) {
    Vec2 a = share * straight;
    for (int i = 0; i < 50; ++i) {
      const std::optional<Vec2> at = seen(a);
      constexpr double kStep = 1.0e-6;
      const std::optional<Vec2> along_x = seen(a + Vec2(kStep, 0.0));
      const std::optional<Vec2> along_y = seen(a + Vec2(0.0, kStep));
      if (!at || !along_x || !along_y) break;
      const Vec2 off = pixel - *at;
      if (off.norm() < 1.0e-7) return Vec3(a.x(), a.y(), 1.0);
      Mat2 J;
      J.col(0) = (*along_x - *at) / kStep;
      J.col(1) = (*along_y - *at) / kStep;
      const double det = J(0, 0) * J(1, 1) - J(0, 1) * J(1, 0);
      if (!(std::fabs(det) > 1.0e-6)) break;
      Vec2 step((J(1, 1) * off.x() - J(0, 1) * off.y()) / det, (J(0, 0) * off.y() - J(1, 0) * off.x()) / det);
      constexpr double kLongest = 0.5;
      if (step.norm() > kLongest) step *= kLongest / step.norm();
      a += step;
    }
  }
  return std::nullopt;
}

std::optional<Vec2> fields_of_view(const CameraModel& camera) {
  if (camera.width_px <= 0 || camera.height_px <= 0) return std::nullopt;
  const double w = camera.width_px - 0.5, h = camera.height_px - 0.5;
  const double u = (camera.width_px - 1) / 2.0, v = (camera.height_px - 1) / 2.0;
  const auto left = direction(camera, {-0.5, v}), right = direction(camera, {w, v});
  const auto top = direction(camera, {u, -0.5}), bottom = direction(camera, {u, h});
  if (!left || !right || !top || !bottom) return std::nullopt;
  return Vec2(angle_between(*left, *right), angle_between(*top, *bottom));
}

const char* lens_name(Lens lens) {
  switch (lens) {
    case Lens::kNone: return "none";
    case Lens::kRadialTangential: return "radial-tangential";
    case Lens::kRational: return "rational";
    case Lens::kEquidistant: return "equidistant";
    case Lens::kCahvor: return "CAHVOR";
    case Lens::kCahvore: return "CAHVORE";
  }
  return "?";
}

double baseline_m(const CameraPair& pair) { return pair.T_right_left.t.norm(); }

std::string why_not_rectified(const CameraPair& pair) {
  const CameraModel& a = pair.left;
  const CameraModel& b = pair.right;
  if (a.lens != Lens::kNone || b.lens != Lens::kNone)
    return fmt::format("the images have a lens ({})", lens_name(a.lens != Lens::kNone ? a.lens : b.lens));
  if (a.skew_px != 0.0 || b.skew_px != 0.0) return "the pixels have a skew";
  const double turn = quat_log(pair.T_right_left.q).norm();
  if (turn > 1.0e-6)
    return fmt::format("the right camera is turned by {:.4f} degrees against the left one",
                       turn * kDegPerRad);
  if (std::fabs(a.fx_px - b.fx_px) > 1e-6 * a.fx_px || std::fabs(a.fy_px - b.fy_px) > 1e-6 * a.fy_px)
    return fmt::format("focal lengths differ (left {:g} {:g}, right {:g} {:g})", a.fx_px, a.fy_px, b.fx_px,
                       b.fy_px);
  if (std::fabs(a.cx_px - b.cx_px) > 1e-3 || std::fabs(a.cy_px - b.cy_px) > 1e-3)
    return fmt::format("principal points differ (left {:g} {:g}, right {:g} {:g})", a.cx_px, a.cy_px, b.cx_px,
                       b.cy_px);
  const Vec3& t = pair.T_right_left.t;
  if (const double off = std::hypot(t.y(), t.z()); !(off <= kMostOffRow * baseline_m(pair)))
    return fmt::format("the right camera stands {:g} m off the left one's x axis, {:.1f} % of the baseline",
                       off, 100.0 * off / baseline_m(pair));
  return {};
}

std::string fault_of(const CameraPair& pair) {
  for (const auto& [camera, side] : {std::pair(&pair.left, "left"), {&pair.right, "right"}}) {
    if (std::string fault = fault_of_camera(*camera, side); !fault.empty()) return fault;
  }
  return fault_of_baseline(pair);
}

std::string doubt_of(const CameraPair& pair) {
  const std::string left = doubt_of_camera(pair.left, "left");
  return left.empty() ? doubt_of_camera(pair.right, "right") : left;
}

StereoRig rectified_rig(const CameraPair& pair) {
  StereoRig rig;
  rig.width_px = pair.left.width_px;
  rig.height_px = pair.left.height_px;
  rig.fx_px = pair.left.fx_px;
  rig.fy_px = pair.left.fy_px;
  rig.cx_px = pair.left.cx_px;
  rig.cy_px = pair.left.cy_px;
  rig.baseline_m = -pair.T_right_left.t.x();
  return rig;
}

}  // namespace cairn::ground
