#include "base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cairn::ground {

Interval wilson(std::size_t hits, std::size_t n) {
  if (n == 0) return {0.0, 1.0};
  constexpr double z = 1.959963984540054;  // 97.5 % of the normal distribution
  const auto count = static_cast<double>(n);
  const double share = static_cast<double>(hits) / count;
  const double middle = share + z * z / (2.0 * count);
  const double half = z * std::sqrt(share * (1.0 - share) / count + z * z / (4.0 * count * count));
  const double scale = 1.0 + z * z / count;
  return {std::max(0.0, (middle - half) / scale), std::min(1.0, (middle + half) / scale)};
}

double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto upper = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), upper, values.end());
  if (values.size() % 2 == 1) return *upper;
  return 0.5 * (*std::max_element(values.begin(), upper) + *upper);
}

Median median_of(std::vector<double> values) {
  values.erase(std::remove_if(values.begin(), values.end(), [](double v) { return std::isnan(v); }),
               values.end());
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (values.empty()) return {kNone, {kNone, kNone}, 0};
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  // The rank r from either end misses the median with P(Bin(n, 1/2) < r) each.
  const auto count = static_cast<double>(n);
  std::size_t rank = 1;
  double below = 0.0;
  for (std::size_t r = 1; 2 * r <= n; ++r) {
    const auto k = static_cast<double>(r - 1);
    below += std::exp(std::lgamma(count + 1.0) - std::lgamma(k + 1.0) - std::lgamma(count - k + 1.0) -
                      count * std::log(2.0));
    if (below > 0.025) break;
    rank = r;
  }
  return {median(values), {values[rank - 1], values[n - rank]}, n};
}

}  // namespace cairn::ground
