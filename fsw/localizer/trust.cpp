#include "localizer/trust.hpp"

namespace cairn {
namespace {

constexpr Trust C = Trust::kConfirmed;
constexpr Trust O = Trust::kCoasting;
constexpr Trust U = Trust::kUnconfirmed;
constexpr Trust L = Trust::kLost;

constexpr int kColumns = 4;  // kClaimed is another word for confirmed here

/// The header's table: a row an event, a column a state.
constexpr Trust kNext[kTrustEvents][kColumns] = {
    {C, C, C, C},  // kStartGiven
    {U, U, U, U},  // kStartWide
    {L, L, L, L},  // kStartUnknown
    {C, O, U, L},  // kStepMeasured
    {C, C, U, L},  // kCaughtUp
    {O, O, U, L},  // kHeld
    {U, U, U, L},  // kGuessed
    {U, U, U, L},  // kDoubted
    {C, O, C, C},  // kFixAccepted
    {U, U, U, L},  // kFixInconsistent
    {C, O, U, L},  // kFixDeclined
    {C, O, U, L},  // kFixUndecided
    {U, U, L, L},  // kFixRefuted
};

Trust next(Trust state, TrustEvent event) { return kNext[static_cast<int>(event)][static_cast<int>(state)]; }

}  // namespace

void TrustState::init(const TrustParams& params) {
  params_ = params;
  state_ = Trust::kLost;
  claimed_ = true;
  since_ = Trust::kConfirmed;
  held_ = false;
  refusals_ = 0;
}

TrustEvent TrustState::start_of(double sigma_xy_m, double sigma_yaw_rad) const {
  const bool known = sigma_xy_m <= params_.start_sigma_xy_m && sigma_yaw_rad <= params_.start_sigma_yaw_rad;
  return known ? TrustEvent::kStartGiven : TrustEvent::kStartWide;
}

Mat3 TrustState::doubt() const {
  if (!claimed_) return Mat3::Zero();
  const double xy = params_.doubt_xy_m * params_.doubt_xy_m;
  return Vec3(xy, xy, params_.doubt_yaw_rad * params_.doubt_yaw_rad).asDiagonal();
}

void TrustState::on(TrustEvent event) {
  state_ = next(state_, event);
  switch (event) {
    case TrustEvent::kStartGiven:
    case TrustEvent::kStartWide:
    case TrustEvent::kStartUnknown:
      claimed_ = true;
      since_ = Trust::kConfirmed;
      held_ = false;
      refusals_ = 0;
      break;
    case TrustEvent::kCaughtUp:
    case TrustEvent::kHeld:
    case TrustEvent::kGuessed: held_ = event == TrustEvent::kHeld; [[fallthrough]];
    case TrustEvent::kStepMeasured:
    case TrustEvent::kDoubted: since_ = next(since_, event); break;
    case TrustEvent::kFixAccepted:
      state_ = since_;
      claimed_ = false;
      refusals_ = 0;
      break;
    case TrustEvent::kFixInconsistent:
    case TrustEvent::kFixDeclined:
      ++refusals_;
      if (refusals_ >= static_cast<std::uint32_t>(params_.lost_after)) state_ = Trust::kLost;
      break;
    case TrustEvent::kFixRefuted:
    case TrustEvent::kFixUndecided: break;
  }
}

}  // namespace cairn
