/// Stereo visual odometry, frame by frame (METHOD section A): where the modules `features` and `vo` meet.
///
/// One frame: what its pair gives (stereo_frame.hpp); matches from the reference frame within windows
/// predicted from the last motion; RANSAC, and its inliers refined on reprojection error; sub-pixel alignment
/// of the reference patches in both current images, warped by slope and by that motion; refinement on
/// reprojection error, in which a patch that no longer looks alike, or is of much contrast, counts less.
///
/// The rover's own hardware, where the mission does not know of it (geometry/own_hardware.hpp), stands still
/// in the picture while the ground moves. Matches that stand still are left out of RANSAC where both they and
/// the others are enough for a motion; those of them that the motion found moves are left out for good.
///
/// Noise makes keypoints of its own where ground has little contrast. In images halved (means of 2 x 2
/// pixels) it is half as large, and the ground's contrast about the same: a pair whose noise is too large for
/// what its keypoints show is looked at once more, halved, becomes the reference, and so are those after it,
/// until they show enough without. Noise of 20 grey levels then costs 0.8 % of the way instead of 18; halved
/// at 10, it would be 0.7 instead of 0.5.
///
/// A pair's work is planned (`plan_ops`): of points, which texture has many of, so many are aligned, evenly
/// over the image, as what is left allows; a second alignment and a wider search for matches are left out
/// where nothing is. Real ground of 8300 pictures takes less than the plan.
///
/// The reference is an earlier frame, kept while enough of its points are still seen (at most
/// `max_reference_age` frames, and longer while all stands still, where patches keep their look): errors then
/// add up once a reference, not once a frame.
/// `max_reference_age = 1` is frame to frame, as in the paper; `paper_exact` also leaves out every sub-pixel
/// step and takes the absolute orientation of the RANSAC inliers.
#pragma once

#include <cstdint>

#include "core/enum_count.hpp"
#include "core/nodiscard.hpp"
#include "image/noise.hpp"
#include "localizer/stereo_frame.hpp"
#include "vo/motion.hpp"

namespace cairn {

enum class CAIRN_NODISCARD VoStatus : std::uint8_t {
  kIdle,         ///< never started
  kRunning,      ///< call step() again
  kFirstFrame,   ///< the frame became the reference; motion is the identity, and nothing is wrong
  kMotion,       ///< motion estimated: the only status that may move the pose
  kBadImage,     ///< an image is missing or of the wrong size; the reference stays
  kFewFeatures,  ///< black, saturated or featureless image; the reference stays
  kFewStereo,    ///< too few left-right matches, or off their rows (swapped, say); the reference stays
  kFewMatches,   ///< too few matches from the reference; the frame becomes the new reference
  kNoConsensus,  ///< matches do not agree on a motion; the frame becomes the new reference
  kImplausible,  ///< motion larger than the mission allows; the frame becomes the new reference
};
inline constexpr std::size_t kVoStatusCount = 10;
static_assert(enum_has<VoStatus, kVoStatusCount>());

/// Those of a pair, whose `match` and `align` also serve from frame to frame, and those of the motion.
struct VoParams : StereoFrameParams {
  int search_radius_px = cfg::kMission.search_radius_px;
  /// Without a prediction; every other point is asked then (all of them in paper_exact): the window holds
  /// nine times the candidates, a consensus needs few, and all points are aligned by it later.
  int first_search_radius_px = cfg::kMission.first_search_radius_px;
  int max_reference_age = cfg::kMission.max_reference_age;
  double min_reference_share = 0.5;  ///< of the reference's points; below it the reference is renewed
  double max_step_m = cfg::kMission.max_step_m;  ///< of the rover, not of a camera that swings on its mast
  double max_step_rad = cfg::kMission.max_step_rad;
  std::uint32_t plan_ops = cfg::kVoPlanOps;  ///< of one pair: fewer points are aligned where all take more
  MotionParams motion;
};

struct VoResult {
  Pose3 T_prev_cur;  ///< current camera in the previous good frame's camera: the step
  /// Rotation xyz (rad), translation xyz (m): of the motion from the reference, perturbed in the current
  /// camera (right of T_prev_cur). That is the step's where the reference is the previous frame.
  Mat6 covariance = Mat6::Zero();
  int features_left = 0;
  int features_right = 0;
  int stereo = 0;   ///< stereo points
  int matches = 0;  ///< from the reference
  /// Points that stand still in the picture where the motion moves them, of this frame's matches and of those
  /// that this reference left out: the rover's own hardware. 0 where they are fewer than a motion takes.
  int own_points = 0;
  /// They are more than all other matches: is it the hardware that stands still, or is it the ground, and
  /// what moves is an arm, or dust? The motion is that of what moves.
  bool mostly_own = false;
  int inliers = 0;
  double rms_px = 0.0;
  int frames = 0;  ///< that the motion spans: 1, and those without a usable pair before it
  bool reference_renewed = false;
};

class VisualOdometry {
 public:
  /// Forgets the reference and the last motion. False where the rig is not valid.
  [[nodiscard]] bool init(const VoParams& params, const StereoRig& rig);

  /// Pairs that never came before the one that is started next. `motion_prior` as below, of each.
  void miss(std::uint32_t pairs, const Pose3* motion_prior = nullptr);
  /// Starts on a pair (borrowed until done). `motion_prior`, where given, replaces the last motion as the
  /// prediction of the motion from the pair before, used or not; a pose that is not valid asserts. What is
  /// predicted, and what the mission allows, adds up over pairs that were missed or could not be used.
  VoStatus start(const ImageU8& left, const ImageU8& right, const Pose3* motion_prior = nullptr);
  Progress step(WorkBudget& budget);
  VoStatus status() const { return status_; }
  const VoResult& result() const { return result_; }
  /// Of the motion since the last frame that was measured or became the reference, before this one was looked
  /// at: made of motion priors, and of the last motion.
  const Pose3& predicted() const { return predicted_; }
  /// In the pixels looked at (halved()) ...
  const RectificationEstimator& rectification() const { return stereo_.rectification(); }
  bool halved() const { return stereo_.halved(); }
  /// ... and in those of the images.
  ImageOffset offset() const;
  /// Of the ground in the last frame that had stereo points: disparity d = plane . (u, v, 1), px
  /// of the images.
  const Vec3& disparity_plane() const { return plane_; }

 private:
  enum class Phase : std::uint8_t { kNoise, kStereo, kMatch, kRansac, kConsensus, kAlign, kRefine };

  StereoFrame& current() { return frames_[1 - reference_]; }
  StereoFrame& reference() { return frames_[reference_]; }
  const StereoFrame& reference() const { return frames_[reference_]; }
  bool run_phase(WorkBudget& budget);  ///< false: budget spent
  Progress work(WorkBudget& budget);   ///< of the phase
  void next_phase();
  void take_stereo();
  void take_plane();
  bool halved_is_better() const;
  void look_again();
  void end_second_look();
  void begin_match(bool wide);
  bool may_search_wide() const;
  void begin_ransac();
  void begin_consensus();
  void split_still_pairs();
  void leave_out_own_points(const Pose3& T_cur_ref);
  void begin_alignment(const Pose3& T_cur_ref);
  [[gnu::cold]] void start_alignment();
  std::uint32_t affordable_points() const;
  bool is_chosen(std::size_t i) const;  ///< for the alignment under way
  /// True where the refined motion moved the predictions so far that patches left out may now be found.
  bool align_again();
  /// Whether the reference's points lie, in mean squares, more than `least_px` apart after two motions.
  [[gnu::cold]] bool apart(const Pose3& T_a_ref, const Pose3& T_b_ref, double least_px);
  /// The left half first; false: the point cannot be found there.
  bool align_left(std::size_t i);
  void align_right(std::size_t i);
  float weight_of(float correlation) const;  ///< of the point under way
  [[gnu::cold]] void accept(const MotionResult& motion);
  void finish(VoStatus status);
  void lose(VoStatus status);  ///< the frame becomes the reference, the step is unknown
  void renew_reference();
  void predict(const Pose3* motion_prior);

  VoParams params_;
  StereoRig rig_;  ///< of the pixels looked at
  VoStatus status_ = VoStatus::kIdle;
  Phase phase_ = Phase::kNoise;
  bool worked_ = false;  ///< the phase's work is done
  std::size_t cursor_ = 0;
  std::uint32_t spent_ops_ = 0;        ///< on this pair ...
  std::uint32_t second_look_ops_ = 0;  ///< ... and what is kept for another look at it
  std::uint32_t most_aligned_ = 0;

  int reference_ = 0;
  bool have_reference_ = false;
  int reference_age_ = 0;
  int reference_own_points_ = 0;
  int alignments_ = 0;
  bool wide_ = false;
  bool motion_known_ = false;      ///< some motion was measured
  bool prediction_known_ = false;  ///< that, or motion priors for all frames since the last good one
  bool settled_ = true;            ///< the last frame was measured, or became the reference
  int elapsed_ = 0;                ///< frames that the prediction spans
  Pose3 last_step_;                ///< of one frame
  Pose3 predicted_;                ///< T_prev_cur
  Pose3 T_ref_prev_;               ///< previous good frame in the reference camera
  Pose3 T_cur_ref_;
  Vec3 plane_ = Vec3(0.0, 0.0, 0.0);
  VoResult result_;

  NoiseJob noise_;
  ImageU8 left_image_;
  ImageU8 right_image_;
  double contrast_ = 0.0;                  ///< of the keypoints, noise included, grey levels
  bool looked_again_ = false;              ///< this pair is, at pixels of the other size ...
  VoStatus first_look_ = VoStatus::kIdle;  ///< ... after this

  StereoFrame frames_[2];
  StereoFrameJob stereo_;
  FixedVector<SearchWindow, cfg::kMaxFeatures> windows_;
  MatchJob match_;
  MotionPairs pairs_;
  std::size_t still_pairs_ = 0;  ///< that stand behind those in `pairs_`
  /// The point at hand.
  struct Aligned {
    PatchTemplate patch;
    Alignment left;
    StereoPixel expected;  ///< in the images, as their lens and offset have it
    float warp_right[4] = {};
    bool half = false;  ///< found on the left
  };
  Aligned aligned_;
  RansacMotionJob ransac_;
  RefineMotionJob refine_;
};

}  // namespace cairn
