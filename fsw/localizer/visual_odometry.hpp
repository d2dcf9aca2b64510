/// Stereo visual odometry, frame by frame (METHOD section A): where the modules `features` and `vo` meet.
///
/// One frame: features left and right; matches left to right; sub-pixel disparities under the ground's slope;
/// matches from the reference frame within windows predicted from the last motion; RANSAC, and its inliers
/// refined on reprojection error; sub-pixel alignment of the reference patches in both current images, warped
/// by slope and by that motion; refinement on reprojection error.
///
/// The reference is an earlier frame, kept while enough of its points are still seen (at most
/// `max_reference_age` frames): errors then add up once a reference, not once a frame.
/// `max_reference_age = 1` is frame to frame, as in the paper; `paper_exact` also leaves out every sub-pixel
/// step and takes the absolute orientation of the RANSAC inliers.
#pragma once

#include <cstdint>

#include "core/enum_count.hpp"
#include "core/nodiscard.hpp"
#include "features/extractor.hpp"
#include "features/match.hpp"
#include "features/patch_align.hpp"
#include "vo/motion.hpp"
#include "vo/rectification.hpp"

namespace cairn {

enum class CAIRN_NODISCARD VoStatus : std::uint8_t {
  kIdle,         ///< never started
  kRunning,      ///< call step() again
  kFirstFrame,   ///< the frame became the reference; motion is the identity, and nothing is wrong
  kMotion,       ///< motion estimated: the only status that may move the pose
  kBadImage,     ///< an image is missing or of the wrong size; the reference stays
  kFewFeatures,  ///< black, saturated or featureless image; the reference stays
  kFewStereo,    ///< too few left-right matches (left and right swapped, say); the reference stays
  kFewMatches,   ///< too few matches from the reference; the frame becomes the new reference
  kNoConsensus,  ///< matches do not agree on a motion; the frame becomes the new reference
  kImplausible,  ///< motion larger than the mission allows; the frame becomes the new reference
};
inline constexpr std::size_t kVoStatusCount = 10;
static_assert(enum_has<VoStatus, kVoStatusCount>());

/// A stereo point of a frame.
struct StereoPoint {
  bool valid = false;
  StereoPixel keypoint;  ///< as the detector found it, on the epipolar line
  double d_px = 0.0;     ///< disparity of the patch about the whole pixel (iu, iv), refined
  double v_px = 0.0;     ///< its row, on the epipolar line
};

struct VoParams {
  int min_disparity_px = cfg::kMission.min_disparity_px;
  int max_disparity_px = cfg::kMission.max_disparity_px;
  int epipolar_band_px = 2;
  int search_radius_px = cfg::kMission.search_radius_px;
  /// Without a prediction; every other point is asked then (all of them in paper_exact): the window holds
  /// nine times the candidates, a consensus needs few, and all points are aligned by it later.
  int first_search_radius_px = cfg::kMission.first_search_radius_px;
  int max_reference_age = cfg::kMission.max_reference_age;
  /// Of the left features; with fewer stereo points the frame is kFewStereo. Left and right swapped gives up
  /// to 3 % by chance, good images give 60 %.
  double min_stereo_share = 0.05;
  double min_reference_share = 0.5;  ///< of the reference's points; below it the reference is renewed
  double max_step_m = cfg::kMission.max_step_m;
  double max_step_rad = cfg::kMission.max_step_rad;
  bool paper_exact = false;
  MatchParams match;
  AlignParams align;
  MotionParams motion;
  RectificationParams rectification;  ///< not used where paper_exact
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
  int inliers = 0;
  double rms_px = 0.0;
  bool reference_renewed = false;
};

class VisualOdometry {
 public:
  /// Forgets the reference and the last motion. False where the rig is not valid.
  [[nodiscard]] bool init(const VoParams& params, const StereoRig& rig);

  /// Starts on a pair (borrowed until done). `motion_prior`, where given, replaces the last motion as the
  /// prediction of T_prev_cur; one that is not a valid pose is ignored and counted.
  VoStatus start(const ImageU8& left, const ImageU8& right, const Pose3* motion_prior = nullptr);
  Progress step(WorkBudget& budget);
  VoStatus status() const { return status_; }
  const VoResult& result() const { return result_; }
  std::uint32_t bad_priors() const { return bad_priors_; }
  const RectificationEstimator& rectification() const { return rectification_; }
  /// The share of the disparity plane d = a u + b v + c in this frame, as fitted: slopes
  /// of the ground for others.
  const Vec3& disparity_plane() const { return plane_; }

 private:
  enum class Phase : std::uint8_t {
    kLeft,
    kRight,
    kStereoMatch,
    kPlane,
    kStereoRefine,
    kMatch,
    kRansac,
    kConsensus,
    kAlign,
    kRefine
  };
  struct Frame {
    FeatureExtractor left;
    FixedVector<StereoPoint, cfg::kMaxFeatures> points;  ///< index of the left feature
    Vec3 plane = Vec3(0.0, 0.0, 0.0);
    std::size_t valid_points = 0;
  };

  Frame& current() { return frames_[1 - reference_]; }
  Frame& reference() { return frames_[reference_]; }
  bool run_phase(WorkBudget& budget);  ///< false: budget spent
  void begin_stereo_match();
  void collect_stereo();
  void fit_plane();
  void refine_point(std::size_t i);
  void begin_match(bool wide);
  void begin_ransac();
  void begin_consensus();
  void begin_alignment(const Pose3& T_cur_ref);
  void start_alignment();
  /// True where the refined motion moved the predictions so far that patches left out may now be found.
  bool align_again();
  void align_point(std::size_t i);
  void accept(const MotionResult& motion);
  void finish(VoStatus status);
  void lose(VoStatus status);  ///< the frame becomes the reference, the step is unknown
  void renew_reference();

  VoParams params_;
  StereoRig rig_;
  VoStatus status_ = VoStatus::kIdle;
  Phase phase_ = Phase::kLeft;
  std::size_t cursor_ = 0;
  ImageU8 right_image_;
  std::uint32_t bad_priors_ = 0;

  int reference_ = 0;
  bool have_reference_ = false;
  int reference_age_ = 0;
  int alignments_ = 0;
  bool wide_ = false;
  bool motion_known_ = false;
  Pose3 predicted_step_;  ///< T_prev_cur
  Pose3 T_ref_prev_;      ///< previous good frame in the reference camera
  Pose3 T_cur_ref_;
  Vec3 plane_ = Vec3(0.0, 0.0, 0.0);
  VoResult result_;
  RectificationEstimator rectification_;

  Frame frames_[2];
  FeatureExtractor right_;
  FixedVector<SearchWindow, cfg::kMaxFeatures> windows_;
  MatchJob match_;
  MotionPairs pairs_;
  RansacMotionJob ransac_;
  RefineMotionJob refine_;
};

}  // namespace cairn
