#include "registration/evidence_sum.hpp"

#include "core/exp_log.hpp"

namespace cairn {
namespace {

constexpr int kMostWindows = 64;      // more of them add to the ratio, and to Fisher's rule as one
constexpr double kMostChance = 50.0;  // of one window: no decoy scored at all

}  // namespace

void EvidenceSum::add(const Verdict& window) {
  const bool first = windows_ == 0;
  ++windows_;
  log_ratio_ += window.log_ratio;
  const bool regular = !first && window.beyond_decoys < window.chance_log;
  const double chance = regular ? window.beyond_decoys : window.chance_log;
  chance_ += chance < 0.0 ? 0.0 : chance > kMostChance ? kMostChance : chance;
  last_ = window.status;
}

double EvidenceSum::chance_log() const {
  const int n = windows_ < kMostWindows ? windows_ : kMostWindows;
  double sum = 0.0;
  double term = 1.0;
  for (int k = 0; k < n; ++k) {
    sum += term;
    term *= chance_ / (k + 1);
  }
  return n > 0 ? chance_ - ln(sum) : 0.0;
}

VerdictStatus EvidenceSum::verdict(const VerdictParams& params) const {
  const double needed = params.ln_threshold - params.prior_log_odds;
  switch (last_) {
    case VerdictStatus::kNone:
    case VerdictStatus::kNoHypothesis:
    case VerdictStatus::kInconsistentWithPrior:
    case VerdictStatus::kViewDisagrees:
    case VerdictStatus::kAmbiguous: return last_;
    default: break;
  }
  if (log_ratio_ + params.calibration < needed) return VerdictStatus::kTooLittleEvidence;
  return chance_log() < needed ? VerdictStatus::kChanceAgreement : VerdictStatus::kAccepted;
}

}  // namespace cairn
