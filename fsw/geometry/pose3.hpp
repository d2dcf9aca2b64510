/// Rigid motion in space (SE(3)): unit quaternion (Hamilton, q_to_from) and translation, metres.
///
/// p_to = q p_from + t, and T_a_c = T_a_b * T_b_c. Attitude angles follow R = Rz(yaw) Ry(pitch) Rx(roll).
#pragma once

#include "core/eigen.hpp"
#include "geometry/pose2.hpp"

namespace cairn {

struct Pose3 {
  Quat q = Quat(1.0, 0.0, 0.0, 0.0);
  Vec3 t = Vec3(0.0, 0.0, 0.0);

  Vec3 operator*(const Vec3& p) const { return q * p + t; }
  Pose3 operator*(const Pose3& b) const { return {(q * b.q).normalized(), q * b.t + t}; }
  Pose3 inverse() const {
    const Quat qi = q.conjugate();
    return {qi, -(qi * t)};
  }
};

struct Attitude {
  double yaw_rad = 0.0;
  double pitch_rad = 0.0;
  double roll_rad = 0.0;
};

Quat quat_from_attitude(const Attitude& a);
/// Pitch in [-pi/2, pi/2]; at the poles roll is 0.
Attitude attitude_of(const Quat& q);

/// Quaternion of the rotation vector `w_rad` (axis times angle), and back (angle in [0, pi]).
Quat quat_exp(const Vec3& w_rad);
Vec3 quat_log(const Quat& q);

/// The planar motion that carries a spatial pose's x, y and yaw, lifted to space
/// (rotation about z, no height).
Pose3 lift(const Pose2& pose);
/// x, y and yaw of a pose in space. Yaw is that of the body's x axis projected vertically.
Pose2 planar(const Pose3& pose);

/// True where every number is finite and the quaternion has unit length to 1e-6.
bool is_valid(const Pose3& pose);

}  // namespace cairn
