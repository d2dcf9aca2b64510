#include "forecast/proof.hpp"

#include <algorithm>
#include <cmath>

#include "core/trig.hpp"
#include "localizer/map_fix.hpp"

namespace cairn::ground {
namespace {

constexpr double kShare[] = {0.25, 0.5, 0.75, 0.92};  // p of registration/verdict.hpp

/// Mean of f over an exponential variable of mean 1, by its quantiles.
template <typename F>
double over_exponential(const F& f) {
  constexpr int kSteps = 400;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) sum += f(-std::log1p(-(i + 0.5) / kSteps));
  return sum / kSteps;
}

}  // namespace

double log_volume_of(const Mat3& covariance, double per_m2) {
  const MapFixParams params;
  if (!prior_is_wide(params, covariance, per_m2))
    return 1.5 * std::log(2.0 * kPi) + 0.5 * std::log(covariance.determinant());
  // As when lost: a disc and a sector.
  const double reach = params.search.reach_sigmas;
  const double area_m2 = kPi * reach * reach * (covariance(0, 0) + covariance(1, 1));
  return std::log(area_m2 * 2.0 * std::min(kPi, reach * std::sqrt(covariance(2, 2))));
}

Proof::Proof(const ProofCase& of) {
  const double s2 = of.sigma_m * of.sigma_m;
  const double peak = 1.0 / (2.0 * kPi * s2 * of.per_m2);  // N(0) / lambda
  const double error = of.error_m * of.error_m / s2;
  const double spacing = 1.0 / (2.0 * kPi * s2 * of.per_m2);  // mean of d^2 / 2s^2
  for (std::size_t i = 0; i < kShares; ++i) {
    const double p = kShare[i];
    gain_[i] = over_exponential([&](double e) { return std::log1p(p * peak * std::exp(-error * e)); });
    clutter_[i] = of.clutter * over_exponential([&](double e) {
                    return std::log(1.0 - p + p * peak * std::exp(-spacing * e));
                  });
  }
  log_volume_ = of.log_volume + std::log(of.rms_radius_m) - 1.5 - 1.5 * std::log(2.0 * kPi) -
                3.0 * std::log(of.sigma_m);
}

double Proof::expected(double trues) const {
  double sums[kShares];
  for (std::size_t i = 0; i < kShares; ++i) sums[i] = trues * gain_[i] + clutter_[i];
  const double most = *std::max_element(sums, sums + kShares);
  double mean = 0.0;
  for (const double sum : sums) mean += std::exp(sum - most) / kShares;
  return most + std::log(mean) - std::log1p(std::exp(log_volume_ + 1.5 * std::log(trues)));
}

double Proof::passes(std::size_t trues, double needed) const {
  if (trues < 2) return 0.0;
  const auto k = static_cast<double>(trues);
  return 0.5 * std::erfc(-(expected(k) - needed) / std::sqrt(2.0 * k));
}

std::size_t Proof::fewest(double needed, double sure) const {
  std::size_t k = 2;
  while (k < kNever && passes(k, needed) < sure) ++k;
  return k;
}

}  // namespace cairn::ground
