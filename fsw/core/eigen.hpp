/// The one header through which flight code sees Eigen.
///
/// Fixed sizes only, no heap, no vectorisation (the same bits on every target), no over-alignment (objects
/// are laid out alike on 32-bit and 64-bit machines). Decompositions that allocate are not used;
/// doc/DESIGN.md lists those that are clean.
#pragma once

// The macros stand on the compiler's command line too, so that no translation unit can differ.
#ifndef EIGEN_DONT_VECTORIZE
#error "build with -DEIGEN_DONT_VECTORIZE -DEIGEN_NO_MALLOC -DEIGEN_NO_IO -DEIGEN_MAX_ALIGN_BYTES=0"
#endif

#include "core/assert.hpp"

// Eigen's own checks end where ours do, not in the C library's assert, which prints and aborts.
#define eigen_assert(condition) CAIRN_ASSERT(condition)

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace cairn {

using Vec2 = Eigen::Matrix<double, 2, 1>;
using Vec3 = Eigen::Matrix<double, 3, 1>;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat2 = Eigen::Matrix<double, 2, 2>;
using Mat3 = Eigen::Matrix<double, 3, 3>;
using Mat6 = Eigen::Matrix<double, 6, 6>;
using Quat = Eigen::Quaternion<double>;  ///< Hamilton, q_to_from

}  // namespace cairn
