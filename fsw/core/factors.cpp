#include "core/factors.hpp"

namespace cairn {
namespace {

/// Rows and columns i and k of a symmetric matrix change places.
void exchange(double* m, int n, int i, int k) {
  for (int c = 0; c < n; ++c) {
    const double kept = m[c * n + i];
    m[c * n + i] = m[c * n + k];
    m[c * n + k] = kept;
  }
  for (int r = 0; r < n; ++r) {
    const double kept = m[i * n + r];
    m[i * n + r] = m[k * n + r];
    m[k * n + r] = kept;
  }
}

}  // namespace

void factorise(double* m, int* order, int n) {
  for (int k = 0; k < n; ++k) order[k] = k;
  for (int k = 0; k < n; ++k) {
    int largest = k;
    for (int i = k + 1; i < n; ++i) {
      if (m[i * n + i] > m[largest * n + largest]) largest = i;
    }
    if (largest != k) {
      exchange(m, n, largest, k);
      const int kept = order[k];
      order[k] = order[largest];
      order[largest] = kept;
    }
    double* const column = m + k * n;
    const double pivot = column[k];
    for (int c = k + 1; c < n; ++c) {
      const double share = column[c] / pivot;
      for (int r = k + 1; r < n; ++r) m[c * n + r] -= column[r] * share;
    }
    for (int r = k + 1; r < n; ++r) column[r] /= pivot;
  }
}

void solve_by_factors(const double* m, const int* order, int n, double* x, double* work) {
  for (int i = 0; i < n; ++i) {
    double sum = x[order[i]];
    for (int c = 0; c < i; ++c) sum -= m[c * n + i] * work[c];
    work[i] = sum;
  }
  for (int i = n - 1; i >= 0; --i) {
    double sum = work[i] / m[i * n + i];
    for (int r = i + 1; r < n; ++r) sum -= m[i * n + r] * work[r];
    work[i] = sum;
  }
  for (int i = 0; i < n; ++i) x[order[i]] = work[i];
}

}  // namespace cairn
