/// The inverse of a small symmetric positive definite matrix from its factors, column by column: Eigen's
/// solve for a whole matrix goes through blocked products, which keep sizes of caches in a static.
#pragma once

#include "core/eigen.hpp"

namespace cairn {

/// `factors`: Eigen's LLT or LDLT of an N x N matrix, computed and good.
template <int N, typename Factors>
Eigen::Matrix<double, N, N> inverse_by(const Factors& factors) {
  Eigen::Matrix<double, N, N> out;
  for (int k = 0; k < N; ++k) {
    Eigen::Matrix<double, N, 1> unit = Eigen::Matrix<double, N, 1>::Zero();
    unit[k] = 1.0;
    const Eigen::Matrix<double, N, 1> column = factors.solve(unit);
    for (int r = 0; r < N; ++r) out(r, k) = column[r];
  }
  return out;
}

}  // namespace cairn
