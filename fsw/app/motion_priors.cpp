#include "app/motion_priors.hpp"

namespace cairn::app {

void MotionPriors::put(std::uint32_t pair, const Pose3& T_prev_cur) {
  for (Waiting& w : waiting_) {
    if (w.pair == pair) {
      w.T_prev_cur = T_prev_cur;
      return;
    }
  }
  if (waiting_.full()) remove(0);
  waiting_.append({pair, false, T_prev_cur});
}

const Pose3* MotionPriors::of(std::uint32_t pair) {
  for (Waiting& w : waiting_) {
    if (w.pair != pair) continue;
    w.used = true;
    return &w.T_prev_cur;
  }
  return nullptr;
}

void MotionPriors::let_go(std::uint32_t pair) {
  for (std::size_t i = waiting_.size(); i > 0; --i) {
    const std::uint32_t ahead = waiting_[i - 1].pair - pair;
    if (ahead == 0 || ahead >= 0x80000000U) remove(i - 1);
  }
}

void MotionPriors::let_go_all() {
  while (!waiting_.empty()) remove(waiting_.size() - 1);
}

void MotionPriors::remove(std::size_t i) {
  if (!waiting_[i].used) ++unused_;
  for (; i + 1 < waiting_.size(); ++i) waiting_[i] = waiting_[i + 1];
  waiting_.resize(waiting_.size() - 1);
}

}  // namespace cairn::app
