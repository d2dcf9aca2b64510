#include "app/pair_order.hpp"

namespace cairn::app {

PairStatus PairOrder::after(const Pair& last, const Pair& pair) {
  const std::uint32_t ahead = pair.number - last.number;
  if (pair.t_capture_us < last.t_capture_us) return PairStatus::kOld;
  if (ahead == 1) return PairStatus::kNext;
  if (ahead > 1 && ahead < 0x80000000U) return PairStatus::kGap;
  if (pair.t_capture_us > last.t_capture_us) return PairStatus::kRenumbered;
  return ahead == 0 ? PairStatus::kRepeated : PairStatus::kOld;
}

PairStatus PairOrder::judge(std::uint32_t number, std::uint64_t t_capture_us) {
  const Pair pair{number, t_capture_us};
  status_ = any_ ? after(last_, pair) : PairStatus::kFirst;
  if (!to_be_used(status_)) {
    row_ = row_ > 0 && after(let_go_, pair) == PairStatus::kNext ? row_ + 1 : 1;
    let_go_ = pair;
    if (row_ < kRestartedAfter) return status_;
    status_ = PairStatus::kRenumbered;
  }
  missed_ = 0;
  if (status_ == PairStatus::kGap) missed_ = number - last_.number - 1;
  if (status_ == PairStatus::kRenumbered) missed_ = kUnknownGap;
  any_ = true;
  row_ = 0;
  last_ = pair;
  return status_;
}

}  // namespace cairn::app
