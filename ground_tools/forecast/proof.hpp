/// How many true boulders the proof of a fix takes (registration/verdict.hpp), before there is any: the log
/// ratio that is to be expected of k true boulders and c others, in closed form.
///
///     g(k) = ln mean over p of exp( k a(p) + c b(p) ) - ln( 1 + V / v(k) )
///     a(p) = E ln[ 1 + p N(r) / lambda ], r the error of a true pair
///     b(p) = E ln[ 1 - p + p N(d) / lambda ], d the distance of the nearest unrelated boulder
///     v(k) = e^1.5 (2 pi)^1.5 s^3 / (k^1.5 R)
///
/// N the Gaussian of the verdict's sigma s, lambda boulders a square metre, R the rms radius of the local
/// boulders, V the volume of the prior, p the verdict's own shares. Where the prior knows more than the pairs
/// tell, the last term is next to nothing. The spread of it is sqrt(k): each true boulder's r^2 / 2s^2 is
/// exponential. The fix is applied where g and that spread pass what is needed.
///
/// Held against trials with a search (a test has the table): within two boulders of what 98 % take, at 0.01
/// to 4 boulders a square metre, 30 to 60 % clutter, priors of 0.1 to 20 m.
#pragma once

#include <cstddef>
#include <vector>

#include "core/eigen.hpp"
#include "registration/verdict.hpp"

namespace cairn::ground {

struct ProofCase {
  double per_m2 = 1.0;        ///< boulders of the map around there
  double sigma_m = 0.05;      ///< of a pair, as the verdict takes it, per axis
  double error_m = 0.05;      ///< of a pair, as it is
  double clutter = 0.0;       ///< local boulders that are none of the map's
  double rms_radius_m = 3.0;  ///< of the local boulders
  double log_volume = 0.0;    ///< of the prior: m^2 rad
};

/// ln of the volume in which the flight module looks for a pose with this covariance of x, y, yaw, where the
/// map has so many boulders a square metre.
double log_volume_of(const Mat3& covariance, double per_m2);

/// Its parts that do not depend on k are worked out once.
class Proof {
 public:
  explicit Proof(const ProofCase& of);
  /// g(k), k at least 1.
  double expected(double trues) const;
  /// That k true boulders pass `needed` nats: 0 below two.
  double passes(std::size_t trues, double needed) const;
  /// Fewest that pass with probability `sure`; kNever where 1000 do not.
  std::size_t fewest(double needed, double sure) const;
  static constexpr std::size_t kNever = 1000;

 private:
  static constexpr std::size_t kShares = 4;
  double gain_[kShares];     ///< a
  double clutter_[kShares];  ///< c b
  double log_volume_;        ///< of V / v(1)
};

}  // namespace cairn::ground
