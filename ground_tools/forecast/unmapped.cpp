#include "forecast/unmapped.hpp"

#include <algorithm>
#include <cmath>

#include "sim/rocks.hpp"

namespace cairn::ground {
namespace {

constexpr std::size_t kFewest = 10;
constexpr double kLargest_m = 10.0;
constexpr double kSmallest_m = 0.04;  // smaller ones are pebbles
constexpr int kSteps = 40;

/// The k of which the law has so many boulders larger than `from_m`; it rises with k.
double abundance(double per_m2, double from_m) {
  double low = 0.001;
  double high = 0.5;
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    (sim::rocks_per_m2(middle, from_m, kLargest_m) < per_m2 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

double unmapped_per_m2(const std::vector<TableBoulder>& boulders, const MapExtent& extent,
                       const DetectionCurve& curve) {
  const double area_m2 = (extent.max_x_m - extent.min_x_m) * (extent.max_y_m - extent.min_y_m);
  if (boulders.size() < kFewest || !(area_m2 > 0.0)) return 0.0;
  std::vector<double> diameters_m;
  for (const TableBoulder& b : boulders) diameters_m.push_back(b.diameter_m);
  const auto tenth = diameters_m.begin() + static_cast<std::ptrdiff_t>(diameters_m.size() / 10);
  std::nth_element(diameters_m.begin(), tenth, diameters_m.end());
  const double smallest_m = *tenth;
  double count = 0.0;
  for (const TableBoulder& b : boulders)
    count += b.diameter_m >= smallest_m ? std::clamp(b.confidence, 0.0, 1.0) : 0.0;
  if (smallest_m <= kSmallest_m) return 0.0;
  const double k = abundance(count / area_m2, smallest_m);
  double sum = 0.0;
  const double step = (smallest_m - kSmallest_m) / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const double from_m = kSmallest_m + i * step;
    sum += curve(from_m + 0.5 * step) * sim::rocks_per_m2(k, from_m, from_m + step);
  }
  return sum;
}

}  // namespace cairn::ground
