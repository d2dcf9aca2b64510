/// Absolute orientation: the rigid motion that carries one set of 3D points onto another, by unit quaternions
/// (Horn 1987; METHOD section A).
///
/// Minimises sum |to_i - (R from_i + t)|^2: the rotation is the eigenvector of the largest eigenvalue of
/// Horn's 4x4 matrix, found by cyclic Jacobi rotations (Eigen's solver of that size allocates).
#pragma once

#include <cstddef>

#include "core/nodiscard.hpp"
#include "geometry/pose3.hpp"

namespace cairn {

enum class CAIRN_NODISCARD OrientationStatus : std::uint8_t {
  kSolved,
  kTooFewPoints,  ///< fewer than three
  kDegenerate,    ///< points on a line, in one place or not finite: the rotation is not determined
};

/// Points `from[i]` and `to[i]`, i < count, same units. Writes T_to_from.
OrientationStatus absolute_orientation(const Vec3* from, const Vec3* to, std::size_t count, Pose3& T_to_from);

}  // namespace cairn
