/// Temporal association of labels by votes (METHOD section B.2).
///
/// Features tracked from frame t to t+1 vote for the pair of regions that they lie in: an n x m matrix,
/// regions of t by regions of t+1. The assignment with the most votes (labeling/assignment.hpp) says which
/// region of t+1 goes on which region of t. A pair with fewer than `min_votes` counts as none before the
/// assignment, so that it cannot push a good one aside; what the assignment pairs without a vote is no match.
///
/// Labels are 1 .. n (0 is 'none'), as in the label images. Cost: start() passes once over n m entries, a
/// vote is one operation; step() takes 2 an entry, a row a unit, and then what the assignment takes.
#pragma once

#include <cstdint>

#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "labeling/assignment.hpp"
#include "mission_cfg.hpp"

namespace cairn {

enum class CAIRN_NODISCARD VotingStatus : std::uint8_t {
  kIdle,        ///< never started
  kCollecting,  ///< add votes, then associate()
  kRunning,     ///< call step() again
  kDone,        ///< the result may be read
  kBadInput,    ///< more labels than kMaxLabels, a negative number, or min_votes below 1
};

struct VotingResult {
  /// [label of t+1] = the label of t that it goes on, or 0: a new boulder. Index 0 is unused.
  std::uint8_t previous_of[cfg::kMaxLabels + 1] = {};
  /// [label of t] = the label of t+1 that goes on with it, or 0: lost. Index 0 is unused.
  std::uint8_t next_of[cfg::kMaxLabels + 1] = {};
  int matched = 0;
  int new_labels = 0;   ///< labels of t+1 without a partner
  int lost_labels = 0;  ///< labels of t without a partner: without votes, or all outvoted
};

class VotingJob {
 public:
  static constexpr std::uint32_t sift_ops(int labels) { return 2U * static_cast<std::uint32_t>(labels); }

  /// kCollecting for `labels_t` labels in frame t and `labels_t1` in t+1, or kBadInput.
  VotingStatus start(int labels_t, int labels_t1, int min_votes);

  /// One tracked feature in region `label_t` of frame t and `label_t1` of t+1. False where it does not count:
  /// a label is 0 or above the number given, or the job is not collecting. A cell stays at 65535.
  [[nodiscard]] bool add_vote(int label_t, int label_t1);
  /// 0 for labels that there are not; once done, 0 below min_votes.
  int votes(int label_t, int label_t1) const;

  /// Ends the collection: kRunning, or kDone where one frame has no labels. Other states stay as they are.
  VotingStatus associate();
  Progress step(WorkBudget& budget);
  VotingStatus status() const { return status_; }
  const VotingResult& result() const { return result_; }  ///< once done

 private:
  bool in_range(int label_t, int label_t1) const;
  void begin_assignment();
  void read_assignment();

  VotingStatus status_ = VotingStatus::kIdle;
  int labels_t_ = 0;
  int labels_t1_ = 0;
  int min_votes_ = 1;
  int sifted_ = 0;  ///< rows of votes without those that are too few
  std::uint16_t votes_[cfg::kMaxLabels * cfg::kMaxLabels] = {};  ///< row-major, stride labels_t1_
  AssignmentJob<cfg::kMaxLabels> assignment_;
  VotingResult result_;
};

}  // namespace cairn
