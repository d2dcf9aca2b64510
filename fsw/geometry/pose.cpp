#include <cmath>

#include "geometry/pose3.hpp"

namespace cairn {

bool is_finite(const Pose2& pose) {
  return std::isfinite(pose.x_m) && std::isfinite(pose.y_m) && std::fabs(pose.yaw_rad) <= 1.0e6;
}

Quat quat_from_attitude(const Attitude& a) {
  const SinCos y = sin_cos(0.5 * a.yaw_rad);
  const SinCos p = sin_cos(0.5 * a.pitch_rad);
  const SinCos r = sin_cos(0.5 * a.roll_rad);
  const Quat qz(y.cos, 0.0, 0.0, y.sin);
  const Quat qy(p.cos, 0.0, p.sin, 0.0);
  const Quat qx(r.cos, r.sin, 0.0, 0.0);
  return qz * qy * qx;
}

Attitude attitude_of(const Quat& q) {
  const Mat3 R = q.toRotationMatrix();
  Attitude a;
  const double horizontal = std::sqrt(R(0, 0) * R(0, 0) + R(1, 0) * R(1, 0));
  a.pitch_rad = atan2(-R(2, 0), horizontal);
  if (horizontal > 1.0e-9) {
    a.yaw_rad = atan2(R(1, 0), R(0, 0));
    a.roll_rad = atan2(R(2, 1), R(2, 2));
  } else {
    a.yaw_rad = atan2(-R(0, 1), R(1, 1));
  }
  return a;
}

Quat quat_exp(const Vec3& w_rad) {
  const double angle = std::sqrt(w_rad.squaredNorm());
  if (angle < 1.0e-12) return Quat(1.0, 0.5 * w_rad.x(), 0.5 * w_rad.y(), 0.5 * w_rad.z()).normalized();
  const SinCos half = sin_cos(0.5 * angle);
  const Vec3 v = w_rad * (half.sin / angle);
  return {half.cos, v.x(), v.y(), v.z()};
}

Vec3 quat_log(const Quat& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  const Vec3 v(sign * q.x(), sign * q.y(), sign * q.z());
  const double n = std::sqrt(v.squaredNorm());
  if (n < 1.0e-12) return 2.0 * v;
  return v * (2.0 * atan2(n, sign * q.w()) / n);
}

Pose3 lift(const Pose2& pose) {
  const SinCos half = sin_cos(0.5 * pose.yaw_rad);
  return {Quat(half.cos, 0.0, 0.0, half.sin), Vec3(pose.x_m, pose.y_m, 0.0)};
}

Pose2 planar(const Pose3& pose) {
  const Vec3 forward = pose.q * Vec3(1.0, 0.0, 0.0);
  return {pose.t.x(), pose.t.y(), atan2(forward.y(), forward.x())};
}

bool is_valid(const Pose3& pose) {
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(pose.t[i])) return false;
  }
  const double n2 = pose.q.squaredNorm();
  return std::fabs(n2 - 1.0) <= 2.0e-6;  // false for NaN as well
}

}  // namespace cairn
