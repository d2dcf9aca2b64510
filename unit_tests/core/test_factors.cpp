// Factors of symmetric matrices: solutions, inverses and determinants by definition, at every size that is
// used, with units ten decades apart; matrices that are not positive definite are told.
#include "core/factors.hpp"

#include <cmath>
#include <limits>

#include "support/cmocka.hpp"
#include "support/noise.hpp"

using namespace cairn;

namespace {

template <int N>
using Matrix = Eigen::Matrix<double, N, N>;
template <int N>
using Vector = Eigen::Matrix<double, N, 1>;

/// With rows and columns of very different units, as of metres and radians. Its determinant: `det`.
template <int N>
Matrix<N> positive_matrix(Random& random, double decades, double& det) {
  Matrix<N> lower = Matrix<N>::Zero();
  det = 1.0;
  for (int r = 0; r < N; ++r) {
    for (int c = 0; c < r; ++c) lower(r, c) = test::normal(random);
    lower(r, r) = 0.5 + std::fabs(test::normal(random));
    const double unit = std::pow(10.0, decades * test::uniform(random, -0.5, 0.5));
    lower.row(r) *= unit;
    det *= lower(r, r) * lower(r, r);
  }
  return lower.lazyProduct(lower.transpose());
}

/// |m x - b| where each row's own size is one.
template <int N>
double miss(const Matrix<N>& m, const Vector<N>& x, const Vector<N>& b) {
  double most = 0.0;
  for (int r = 0; r < N; ++r) {
    double sum = -b[r];
    double size = std::fabs(b[r]);
    for (int c = 0; c < N; ++c) {
      sum += m(r, c) * x[c];
      size += std::fabs(m(r, c) * x[c]);
    }
    most = std::fmax(most, std::fabs(sum) / size);
  }
  return most;
}

template <int N>
void check_size() {
  Random random(100 + N);
  for (int k = 0; k < 500; ++k) {
    double det = 0.0;
    const Matrix<N> m = positive_matrix<N>(random, k < 250 ? 0.0 : 5.0, det);
    const Factors factors(m);
    assert_true(factors.positive());
    Vector<N> b;
    for (int r = 0; r < N; ++r) b[r] = test::normal(random) * std::sqrt(m(r, r));
    assert_at_most(miss<N>(m, factors.solve(b), b), 1e-13);
    const Matrix<N> inverse = factors.inverse();
    for (int c = 0; c < N; ++c)
      assert_at_most(miss<N>(m, inverse.col(c), Matrix<N>::Identity().col(c)), 1e-13);
    double product = 1.0;
    for (int i = 0; i < N; ++i) {
      product *= factors.pivot(i);
      if (i > 0) assert_at_most(factors.pivot(i), factors.pivot(i - 1) * (1.0 + 1e-12));
    }
    assert_at_most(std::fabs(product / det - 1.0), 1e-9);
  }
}

void test_solves_at_every_size(void**) {
  check_size<1>();
  check_size<2>();
  check_size<3>();
  check_size<4>();
  check_size<6>();
  check_size<7>();
}

void test_what_is_not_positive_is_told(void**) {
  Random random(9);
  for (int k = 0; k < 300; ++k) {
    double det = 0.0;
    Matrix<4> m = positive_matrix<4>(random, 2.0, det);
    const int i = k % 4;
    if (k % 3 == 0) m(i, i) = -m(i, i);
    if (k % 3 == 1) {  // more correlated than one
      const int j = (i + 1) % 4;
      m(i, j) = m(j, i) = 1.01 * std::sqrt(m(i, i) * m(j, j));
    }
    if (k % 3 == 2) {
      const int j = (i + k) % 4;
      m(i, j) = m(j, i) = std::numeric_limits<double>::quiet_NaN();
    }
    assert_false(Factors(m).positive());
  }
  assert_false(Factors(Matrix<3>(Matrix<3>::Zero())).positive());
}

/// The last pivot is what is left of a direction beside all others: small where two rows say nearly the same.
void test_last_pivot_shows_a_weak_direction(void**) {
  for (const double apart : {1e-3, 1e-6}) {
    Matrix<3> m;
    m << 4.0, 2.0, 2.0, 2.0, 3.0, 3.0, 2.0, 3.0, 3.0 + apart;
    const Factors factors(m);
    assert_true(factors.positive());
    assert_at_least(factors.pivot(2), 0.5 * apart);
    assert_at_most(factors.pivot(2), 2.0 * apart);
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_solves_at_every_size),
      cmocka_unit_test(test_what_is_not_positive_is_told),
      cmocka_unit_test(test_last_pivot_shows_a_weak_direction),
  };
  return cmocka_run_group_tests_name("core/factors", tests, nullptr, nullptr);
}
