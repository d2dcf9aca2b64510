/// Evidence added up over windows, where one window is too poor for a proof.
///
/// The windows speak of one hypothesis. The first is searched from the prior that there is; the pose that
/// it ends at, declined for want of evidence, is kept as provisional, carried on by odometry with its
/// covariance and the odometry's, and is the prior of the next window's search, and so on. By the chain
/// rule the logarithms of the windows' marginal likelihood ratios add up to that of all.
///
/// Sound under three conditions, all the caller's:
///   no local boulder counts twice: a window holds only boulders that no window before it held
///   every window counts, those that agree with nothing, too (PoseSearchJob gives each a log_ratio)
///   the prior of a window comes from the windows before it alone
/// Then, under the null of scattered boulders, exp(log_ratio) is a martingale of mean 1 at most, and
/// P(log_ratio ever > t) <= e^-t (Ville's inequality): one may look after each window and stop when one
/// likes. A rival pose on the right map is as unrelated as another map. A hypothesis whose sum falls below
/// drop() is better started anew; each new start is a new draw.
///
/// What chance does on this map is measured in each window (Verdict::chance_log, minus the logarithm of a
/// tail probability at best). Such logarithms do not simply add up: of n of them with sum T, Fisher's rule
/// gives the probability e^-T sum over k < n of T^k / k!. Windows on regular ground are not independent: what
/// fits a lattice's phase once fits it again. So from the second on the small volume of the prior, which the
/// first window left, counts for nothing: Verdict::beyond_decoys is taken where that is less.
///
/// The last window must not be ambiguous, nor inconsistent with what the hypothesis predicts.
#pragma once

#include "registration/verdict.hpp"

namespace cairn {

class EvidenceSum {
 public:
  void reset() { *this = EvidenceSum(); }
  void add(const Verdict& window);

  int windows() const { return windows_; }
  double log_ratio() const { return log_ratio_; }
  double chance_log() const;
  /// Of the sum, by the rules of judge(); kNone before the first window.
  VerdictStatus verdict(const VerdictParams& params) const;
  /// True where the hypothesis speaks against itself: nats below zero.
  bool drop() const { return log_ratio_ < -3.0; }

 private:
  int windows_ = 0;
  double log_ratio_ = 0.0;
  double chance_ = 0.0;
  VerdictStatus last_ = VerdictStatus::kNone;
};

}  // namespace cairn
