#include "labeling/voting.hpp"

#include "core/assert.hpp"

namespace cairn {

VotingStatus VotingJob::start(int labels_t, int labels_t1, int min_votes) {
  const int most = static_cast<int>(cfg::kMaxLabels);
  result_ = VotingResult();
  if (labels_t < 0 || labels_t > most || labels_t1 < 0 || labels_t1 > most || min_votes < 1) {
    return status_ = VotingStatus::kBadInput;
  }
  labels_t_ = labels_t;
  labels_t1_ = labels_t1;
  min_votes_ = min_votes;
  for (int i = 0; i < labels_t * labels_t1; ++i) votes_[i] = 0;
  return status_ = VotingStatus::kCollecting;
}

bool VotingJob::in_range(int label_t, int label_t1) const {
  return label_t >= 1 && label_t <= labels_t_ && label_t1 >= 1 && label_t1 <= labels_t1_;
}

bool VotingJob::add_vote(int label_t, int label_t1) {
  if (status_ != VotingStatus::kCollecting || !in_range(label_t, label_t1)) return false;
  std::uint16_t& cell = votes_[(label_t - 1) * labels_t1_ + label_t1 - 1];
  if (cell < 0xFFFF) ++cell;
  return true;
}

int VotingJob::votes(int label_t, int label_t1) const {
  return in_range(label_t, label_t1) ? votes_[(label_t - 1) * labels_t1_ + label_t1 - 1] : 0;
}

VotingStatus VotingJob::associate() {
  if (status_ != VotingStatus::kCollecting) return status_;
  status_ = VotingStatus::kRunning;
  sifted_ = labels_t1_ > 0 ? 0 : labels_t_;
  if (sifted_ == labels_t_) begin_assignment();
  return status_;
}

void VotingJob::begin_assignment() {
  const AssignmentMatrix matrix{votes_, labels_t_, labels_t1_, labels_t1_};
  const AssignmentStatus begun = assignment_.start(matrix, AssignmentSense::kMostVotes);
  CAIRN_ASSERT(begun == AssignmentStatus::kRunning || begun == AssignmentStatus::kSolved);
  if (begun == AssignmentStatus::kSolved) read_assignment();
}

Progress VotingJob::step(WorkBudget& budget) {
  if (status_ != VotingStatus::kRunning) return Progress::kDone;
  while (sifted_ < labels_t_) {
    if (!budget.take(sift_ops(labels_t1_))) return Progress::kMore;
    std::uint16_t* const row = votes_ + sifted_ * labels_t1_;
    for (int i = 0; i < labels_t1_; ++i) {
      if (row[i] < min_votes_) row[i] = 0;
    }
    if (++sifted_ == labels_t_) begin_assignment();
  }
  if (assignment_.step(budget) == Progress::kMore) return Progress::kMore;
  read_assignment();
  return Progress::kDone;
}

void VotingJob::read_assignment() {
  for (int i = 1; i <= labels_t_; ++i) {
    const std::uint16_t col = assignment_.col_of_row(static_cast<std::size_t>(i) - 1U);
    if (col == AssignmentCore::kNone || votes(i, col + 1) == 0) continue;
    result_.next_of[i] = static_cast<std::uint8_t>(col + 1);
    result_.previous_of[col + 1] = static_cast<std::uint8_t>(i);
    ++result_.matched;
  }
  result_.new_labels = labels_t1_ - result_.matched;
  result_.lost_labels = labels_t_ - result_.matched;
  status_ = VotingStatus::kDone;
}

}  // namespace cairn
