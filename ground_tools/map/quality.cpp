#include "map/quality.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/trig.hpp"

namespace cairn::ground {
namespace {

constexpr std::size_t kLeastBoulders = 20;  ///< that a law is fitted to
constexpr double kMostK = 0.6;
constexpr double kNearRadii = 1.5;
constexpr double kFew = 0.1;
constexpr double kMany = 8.0;

double exponent_of(double k) { return 1.79 + 0.152 / k; }

/// k of F(D) = `share`; F grows with k.
double fitted_k(double diameter_m, double share) {
  double low = 1e-5;
  double high = kMostK;
  if (high * std::exp(-exponent_of(high) * diameter_m) < share) return 0.0;
  for (int i = 0; i < 60; ++i) {
    const double k = std::sqrt(low * high);
    (k * std::exp(-exponent_of(k) * diameter_m) < share ? low : high) = k;
  }
  return low;
}

/// N(D), by the trapezoid in log x; beyond 25 / q nothing is left.
double number_per_m2(double k, double diameter_m) {
  const double q = exponent_of(k);
  constexpr int kSteps = 400;
  const double most = std::log((diameter_m + 25.0 / q) / diameter_m);
  double sum = 0.0;
  for (int i = 0; i <= kSteps; ++i) {
    const double x = diameter_m * std::exp(most * i / kSteps);
    const double density = 4.0 * k * q * std::exp(-q * x) / (kPi * x * x);
    sum += (i == 0 || i == kSteps ? 0.5 : 1.0) * density * x;
  }
  return sum * most / kSteps;
}

bool is_near(const Vec2& p_map_m, const std::vector<TableBoulder>& craters) {
  return std::any_of(craters.begin(), craters.end(), [&](const TableBoulder& c) {
    return (c.p_map_m - p_map_m).norm() < kNearRadii * 0.5 * c.diameter_m;
  });
}

/// Share of the ground near craters, from a grid of places.
double ground_near(const std::vector<TableBoulder>& craters, const MapExtent& extent) {
  constexpr int kSide = 48;
  int near = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    const Vec2 p(extent.min_x_m + (extent.max_x_m - extent.min_x_m) * (i % kSide + 0.5) / kSide,
                 extent.min_y_m + (extent.max_y_m - extent.min_y_m) * (i / kSide + 0.5) / kSide);
    near += is_near(p, craters) ? 1 : 0;
  }
  return static_cast<double>(near) / (kSide * kSide);
}

}  // namespace

std::vector<std::string> MapQuality::doubts() const {
  std::vector<std::string> lines;
  const auto n = static_cast<double>(boulders);
  const double most_near = ground_near_craters + 3.0 * std::sqrt(0.25 / std::max(1.0, n));
  if (craters > 10 && share_near_craters > std::max(0.3, most_near)) {
    lines.push_back(fmt::format(
        "{:.0f} % of the boulders lie in or at craters, which take {:.0f} % of the ground: walls and rims may be "
        "among them",
        100.0 * share_near_craters, 100.0 * ground_near_craters));
  }
  if (craters >= 20 && craters > 5 * boulders) {
    lines.push_back(
        fmt::format("there are {} craters and {} boulders: most boulders may be none", craters, boulders));
  }
  if (k > 0.0 && (of_expected < kFew || of_expected > kMany)) {
    lines.push_back(fmt::format(
        "there are {:.2g} times as many boulders as their larger ones let expect (Golombek and Rapp): the sizes "
        "are not those of a field of boulders",
        of_expected));
  }
  return lines;
}

MapQuality quality_of(const std::vector<TableBoulder>& boulders, const std::vector<TableBoulder>& craters,
                      const MapExtent& extent) {
  MapQuality q;
  q.boulders = boulders.size();
  q.craters = craters.size();
  q.area_m2 = (extent.max_x_m - extent.min_x_m) * (extent.max_y_m - extent.min_y_m);
  if (!craters.empty() && !boulders.empty()) {
    const auto near = std::count_if(boulders.begin(), boulders.end(),
                                    [&](const TableBoulder& b) { return is_near(b.p_map_m, craters); });
    q.share_near_craters = static_cast<double>(near) / static_cast<double>(boulders.size());
  }
  if (!craters.empty()) q.ground_near_craters = ground_near(craters, extent);
  if (boulders.size() < kLeastBoulders) return q;
  std::vector<double> diameters_m;
  for (const TableBoulder& b : boulders) diameters_m.push_back(b.diameter_m);
  std::sort(diameters_m.begin(), diameters_m.end());
  const double least_m = diameters_m[diameters_m.size() / 20];
  const double large_m = diameters_m[diameters_m.size() * 3 / 4];
  double covered_m2 = 0.0;
  for (const double d : diameters_m) covered_m2 += d >= large_m ? 0.25 * kPi * d * d : 0.0;
  q.k = fitted_k(large_m, covered_m2 / q.area_m2);
  if (q.k > 0.0)
    q.of_expected = static_cast<double>(boulders.size()) / (q.area_m2 * number_per_m2(q.k, least_m));
  return q;
}

std::string to_text(const MapQuality& q) {
  std::string text = fmt::format("{} boulders, {:.3g} per m2", q.boulders, q.density_per_m2());
  if (q.k > 0.0)
    text += fmt::format(" ({:.2g} times what their larger ones let expect, k = {:.2g})", q.of_expected, q.k);
  if (q.craters > 0) {
    text +=
        fmt::format("; {} craters or other hollows, {:.0f} % of the boulders at them, {:.0f} % of the ground",
                    q.craters, 100.0 * q.share_near_craters, 100.0 * q.ground_near_craters);
  }
  return text;
}

nlohmann::ordered_json to_json(const MapQuality& q) {
  const auto known = [](double value) {
    return value > 0.0 ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
  };
  return {{"boulders", q.boulders},
          {"craters", q.craters},
          {"area_m2", q.area_m2},
          {"density_per_m2", q.density_per_m2()},
          {"golombek_rapp_k", known(q.k)},
          {"of_expected", known(q.of_expected)},
          {"share_near_craters", q.share_near_craters},
          {"ground_near_craters", q.ground_near_craters},
          {"doubts", q.doubts()}};
}

}  // namespace cairn::ground
