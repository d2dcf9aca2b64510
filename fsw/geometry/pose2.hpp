/// Rigid motion in the plane (SE(2)): what a fix corrects.
///
/// `T_to_from` carries a point of frame `from` into frame `to`: p_to = R(yaw) p_from + t. Neighbours cancel:
/// T_a_c = T_a_b * T_b_c. Metres and radians; yaw counter-clockwise from +x.
#pragma once

#include "core/eigen.hpp"
#include "core/trig.hpp"

namespace cairn {

struct Pose2 {
  double x_m = 0.0;
  double y_m = 0.0;
  double yaw_rad = 0.0;

  Vec2 translation() const { return {x_m, y_m}; }
  Vec2 operator*(const Vec2& p) const {
    const SinCos r = sin_cos(yaw_rad);
    return {r.cos * p.x() - r.sin * p.y() + x_m, r.sin * p.x() + r.cos * p.y() + y_m};
  }
  Pose2 operator*(const Pose2& b) const {
    const Vec2 t = *this * b.translation();
    return {t.x(), t.y(), wrap_angle(yaw_rad + b.yaw_rad)};
  }
  Pose2 inverse() const {
    const SinCos r = sin_cos(yaw_rad);
    return {-(r.cos * x_m + r.sin * y_m), -(-r.sin * x_m + r.cos * y_m), -yaw_rad};
  }
};

/// True where every member is finite (and the yaw in trig's range).
bool is_finite(const Pose2& pose);

}  // namespace cairn
