/// A small symmetric positive definite matrix in factors, m = P' L D L' P with L unit lower triangular, D
/// diagonal and P an order of rows, by the largest pivot left (Golub and Van Loan, Matrix Computations, 4.2).
///
/// One kernel for all sizes: Eigen's own, made anew for each size and caller, were 20 kB of code and half the
/// time to build those who call them.
#pragma once

#include <cstddef>

#include "core/eigen.hpp"

namespace cairn {

/// `m`: n x n, column by column, both triangles alike; becomes L below its diagonal and D on it. What stands
/// above the diagonal means nothing then. `order`: which row each stands for.
void factorise(double* m, int* order, int n);
/// Solves for `x`, in place, by what factorise() made; `work`: n numbers.
void solve_by_factors(const double* m, const int* order, int n, double* x, double* work);

template <int N>
class Factors {
 public:
  using Matrix = Eigen::Matrix<double, N, N>;
  using Vector = Eigen::Matrix<double, N, 1>;

  explicit Factors(const Matrix& m) : m_(m) { factorise(m_.data(), order_, N); }

  /// Whether the matrix is positive definite. Where not, what solve() and inverse() give means nothing.
  bool positive() const {
    for (int k = 0; k < N; ++k) {
      if (!(m_(k, k) > 0.0)) return false;
    }
    return true;
  }
  /// Of D, k of 0 to N - 1, from large to small. Their product is the determinant.
  double pivot(int k) const { return m_(k, k); }

  Vector solve(const Vector& b) const {
    Vector x = b;
    Vector work;
    solve_by_factors(m_.data(), order_, N, x.data(), work.data());
    return x;
  }
  Matrix inverse() const {
    Matrix out = Matrix::Identity();
    Vector work;
    for (int k = 0; k < N; ++k) solve_by_factors(m_.data(), order_, N, &out(0, k), work.data());
    return out;
  }

 private:
  Matrix m_;
  int order_[static_cast<std::size_t>(N)];
};

}  // namespace cairn
