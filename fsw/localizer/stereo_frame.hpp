/// What one stereo pair gives: points with sub-pixel disparities, and the ground's plane (METHOD section A).
///
/// Features left and right; matches from left to right along the epipolar line; a robust plane through their
/// disparities; then the patch about each left keypoint's whole pixel is found in the right image, warped by
/// the plane's slope where the point lies on it, and corrected for what is left of the rectification's
/// errors. The whole pixel, because the same patch is the template that later frames are searched for, and
/// so its bias cancels.
///
/// Left to right, features are told apart by sparse patches (features/sparse_patch.hpp), which alignment then
/// judges: an eighth of the time of descriptors, and as many points. Then the left features that became
/// points are described for the next frame; all of them where points are few, since matches that few rivals
/// contest are wrong more often. With `paper_exact` all features of both images are described and matched so.
///
/// Cost. Units: those of extractor and matcher, one iteration of the plane (20 operations a point), the
/// refinement of one point (kTemplateOps + kAlignOps), a descriptor, and once over all (kOverPointsOps).
#pragma once

#include <cstdint>

#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "features/extractor.hpp"
#include "features/match.hpp"
#include "features/patch_align.hpp"
#include "geometry/own_hardware.hpp"
#include "vo/rectification.hpp"

namespace cairn {

enum class CAIRN_NODISCARD StereoStatus : std::uint8_t {
  kIdle,         ///< never started
  kRunning,      ///< call step() again
  kPoints,       ///< the frame is complete: the only status in which it may be used
  kBadImage,     ///< an image is missing or of the wrong size
  kFewFeatures,  ///< black, saturated or featureless image
  kFewPoints,    ///< too few left-right matches, or off their rows (swapped, of two times, a raw lens, say)
};

struct StereoFrameParams {
  int min_disparity_px = cfg::kMission.min_disparity_px;
  int max_disparity_px = cfg::kMission.max_disparity_px;
  int epipolar_band_px = 2;  ///< about the row where a partner is expected
  int search_band_px = 8;    ///< where that finds too few in the first pairs: 6 px off, and the band
  OwnHardware own = kMissionHardware;  ///< features there give no points
  bool paper_exact = false;            ///< disparities of the keypoints as the detector found them
  MatchParams match;
  MatchParams match_patches = {0.8F, 26000};  ///< left to right, unless paper_exact; alignment judges them
  AlignParams align;
  RectificationParams rectification;  ///< not used where paper_exact
};

/// A stereo point of a frame.
struct StereoPoint {
  bool valid = false;
  StereoPixel keypoint;     ///< as the detector found it, on the epipolar line
  double d_px = 0.0;        ///< disparity of the patch about the whole pixel (iu, iv), refined
  double u_px = 0.0;        ///< where the ideal left camera sees it
  double v_px = 0.0;        ///< likewise, on the epipolar line
  float found_u_px = 0.0F;  ///< where it was found in the right image
  float found_v_px = 0.0F;

  void take(const StereoPixel& corrected);
};

struct StereoFrame {
  FeatureExtractor left;                               ///< features, and the image that patches are cut from
  FixedVector<StereoPoint, cfg::kMaxFeatures> points;  ///< by index of the left feature
  std::size_t valid_points = 0;
  float patch_variance = 0.0F;       ///< mean PatchTemplate::variance of the refined points
  Vec3 plane = Vec3(0.0, 0.0, 0.0);  ///< disparity of the ground: d = plane . (u, v, 1), px

  const Feature& feature(std::size_t i) const { return left.result().features[i]; }
  /// The patch's middle in the left camera's frame, m.
  Vec3 point_m(const StereoRig& rig, std::size_t i) const;
  /// Does the ground's plane hold at this point? A boulder or a hole keeps the frontal model.
  bool on_plane(std::size_t i) const;
  /// Points and plane where another estimate sees them than that with `before`.
  void correct(const RectificationEstimator& rectification, const ImageOffset& before);
};

/// What is done once for each point between two stages of the work, a unit of its own.
inline constexpr std::uint32_t kOverPointsOps = 30U * cfg::kMaxFeatures;

/// A refined match may lie so many pixels off the row where it is expected; beyond it, it is none.
inline constexpr float kMaxRowOffset_px = 1.5F;

class StereoFrameJob {
 public:
  static constexpr std::uint32_t plane_ops(std::size_t points) {
    return 20U * static_cast<std::uint32_t>(points + 1);
  }
  /// Forgets what was learnt of the rectification. `min_points`: fewest that are of use to the caller.
  void init(const StereoFrameParams& params, const StereoRig& rig, int min_points);
  /// Looks at images halved from now on, or whole again; all that is told is of those pixels. What was learnt
  /// of the rectification stays.
  void look(bool halved);
  bool halved() const { return halved_; }
  const StereoRig& rig() const { return rig_; }  ///< of the pixels looked at
  /// Whether the rover's own hardware stands at (u, v) of the pixels looked at.
  bool is_own(double u, double v) const;
  /// Images and frame are borrowed until done. kRunning, or kBadImage.
  StereoStatus start(const ImageU8& left, const ImageU8& right, StereoFrame& frame);
  Progress step(WorkBudget& budget);  ///< the same bits for every slicing
  StereoStatus status() const { return status_; }

  /// Of this pair's right image, until the next start().
  const FeatureExtractor& right() const { return right_; }
  int features_left() const { return features_left_; }
  int features_right() const { return features_right_; }
  int points() const { return points_; }  ///< valid ones, as far as the pair got

  /// What is left of the rig's rectification; one estimate for all of a frame. end_frame() takes in what the
  /// pair's matches tell: to be called when nobody measures in this pair any more.
  const RectificationEstimator& rectification() const { return rectification_; }
  RectificationEstimator& rectification() { return rectification_; }
  void end_frame() { rectification_.end_frame(); }

 private:
  enum class Phase : std::uint8_t { kLeft, kRight, kMatch, kPlane, kRefine, kDescribe };

  bool run_phase(WorkBudget& budget);  ///< false: budget spent
  Progress work(WorkBudget& budget);   ///< of the phase
  void next_phase();
  void begin_match();
  [[gnu::cold]] bool search_rows();  ///< once a pair: small code will do
  void collect();
  void fit_plane(bool first);
  void take_plane();
  void refine_point(std::size_t i);
  bool rows_agree() const;
  void count_points();

  StereoFrameParams params_;
  StereoRig whole_rig_;
  StereoRig rig_;
  bool halved_ = false;
  int min_disparity_px_ = 0;  ///< in the pixels looked at
  int max_disparity_px_ = 0;
  int min_points_ = 0;
  StereoStatus status_ = StereoStatus::kIdle;
  Phase phase_ = Phase::kLeft;
  bool worked_ = false;  ///< the phase's work is done
  std::size_t cursor_ = 0;
  int features_left_ = 0;
  int searches_left_ = 0;  ///< pairs that may be matched in the wide band
  bool wide_ = false;      ///< this one is
  bool searched_ = false;  ///< this one was
  int features_right_ = 0;
  int points_ = 0;
  bool describe_all_ = false;  ///< points are few: matches need all rivals
  int aligned_ = 0;            ///< patches found in the right image ...
  int on_row_ = 0;             ///< ... of these, with both sides on one row once corrected
  ImageU8 right_image_;
  StereoFrame* frame_ = nullptr;
  Vec3 plane_ = Vec3(0.0, 0.0, 0.0);  ///< about the image centre, slopes per half width
  RectificationEstimator rectification_;
  FeatureExtractor right_;
  FixedVector<SearchWindow, cfg::kMaxFeatures> windows_;
  MatchJob match_;
};

}  // namespace cairn
