/// The whole method on one rover: stereo pairs in, a corrected pose out. Where all modules of floor 3 meet.
///
/// Three tasks, each resumable, called by the executive of floor 5:
///   VO            every frame, first
///   boulders      every frame after VO; adds to the local map
///   registration  when the schedule says: `begin_fix` takes a snapshot, steps register it,
///                 `apply_fix` corrects
/// A fix is applied in the frame that the schedule names and not when it happens to be ready, so that the
/// result is the same to the bit however the work is sliced.
///
/// Frames (doc/FRAMES.md). VO runs in `site`. A fix changes only T_map_site, a planar motion, and thereby x,
/// y and yaw of T_map_rover = lift(T_map_site) T_site_rover; height, pitch and roll stay VO's (METHOD section
/// C) but for what measured gravity tells. The local map lies in `site` and does not jump. VO alone, without
/// map, fixes and attitudes, is integrated beside it for comparison.
///
/// The correction. `kWeighted` looks for the pose in all that its covariance allows, asks the evidence for a
/// proof (map_fix.hpp), and weighs what is proved against VO (pose_fusion.hpp): a fix from few or ill placed
/// boulders moves the pose little, and what fixes tell of VO's scale and turn is used on the steps to come.
/// `kWhole` is the paper's variant: ICP from the VO pose, believed where it converges and taken whole, which
/// makes the early path worse than plain VO.
///
/// Attitude. Gravity of a rover that stands (accelerometers) corrects pitch and roll, the height that their
/// errors have cost, and the tilt of steps to come (attitude_fusion.hpp). A heading (sun sensor) corrects yaw
/// and what goes with it (pose_fusion.hpp); while a fix is under way it waits as what it says of T_map_site,
/// so that the fix takes its share of it away, and widens by the steps meanwhile. That the rover stood is the
/// sender's word: pictures taken at stops are a step apart, too, so VO cannot tell (adr/0013-attitude.md).
/// Without such input nothing differs to the bit.
///
/// Heights. Where the map carries heights, the first frame with boulders after an applied fix is held against
/// them: the ground in view tells height and tilt (ground_height.hpp), and nothing of x, y and yaw.
///
/// Frames without a motion. While VO's reference stands, the pose is held or goes by motion priors, and sigma
/// grows by what the rover may do; the next good pair measures the whole way from the reference, and what was
/// held or told by priors counts no more. Where VO loses its reference the pose is guessed for good: sigma
/// keeps what the guess may be off, trust tells of it, and where that is more than a pair's own error the
/// boulders seen before are forgotten. The same where something speaks against VO's motion (vo_watch.hpp).
/// Pictures of ground that VO cannot follow may be of a slide: without a prior, sigma is that of one.
///
/// Slips. Where boulders seen before agree with the map and those in view do not, VO missed a motion: the fix
/// is not used, older boulders are forgotten, and sigma grows as if VO had not seen a frame of the window.
/// At once it shows where boulders seen the frame before are in view and not where they were
/// (boulder_tracks.hpp): the step is doubted, by a slide of six of the longest steps that VO holds possible
/// at 3 sigma. One that was longer is beyond what sigma says, and trust alone tells.
///
/// Lost. By command, once trust.hpp says so, or where declined fixes together speak against the pose at 1000
/// to 1, it is looked for in the whole map: by the very fix that completes the odds. From then on sigma says
/// that it may be anywhere, as after the command, until a fix finds it.
///
/// Poor windows. What is declined for want of evidence leaves a hypothesis behind (carried_hypothesis.hpp).
/// The next fix begins with it: fresh boulders are looked at under it, and where all windows together are a
/// proof, the fix is that of this local map about the pose that they proved. Else the search goes on as ever.
///
/// A search takes as many frames as it takes, while the rover drives on; the record stays kRunning until
/// then, and the correction is of the frame that the search began with. Only the paper's ICP can be late.
#pragma once

#include <array>
#include <cstdint>

#include "core/enum_count.hpp"
#include "core/nodiscard.hpp"
#include "labeling/relief.hpp"
#include "localizer/attitude_fusion.hpp"
#include "localizer/boulder_observer.hpp"
#include "localizer/boulder_tracks.hpp"
#include "localizer/carried_hypothesis.hpp"
#include "localizer/ground_height.hpp"
#include "localizer/landmarks.hpp"
#include "localizer/map_fix.hpp"
#include "localizer/pose_fusion.hpp"
#include "localizer/trust.hpp"
#include "localizer/visual_odometry.hpp"
#include "localizer/vo_watch.hpp"
#include "orbital_map/map_reader.hpp"
#include "orbital_map/orbital_map.hpp"
#include "registration/icp.hpp"

namespace cairn {

enum class CorrectionMode : std::uint8_t { kWeighted, kWhole };

/// Scale and turn that each VO step gets before anything else sees it: trims a rig whose baseline or toe-in
/// is known to be off. Worsening VO on purpose, for trials, is the same thing.
struct StepTrim {
  static constexpr double kLeastScale = 0.5;
  static constexpr double kMostScale = 2.0;
  static constexpr double kMostTurn_rad_per_m = 0.1;

  double scale = 1.0;
  double yaw_rad_per_m = 0.0;  ///< added turn about the rover's z, either way
};

struct LocalizerParams {
  VoParams vo;
  BoulderParams boulders;
  TrackParams tracks;
  ReliefParams relief;
  LandmarkParams landmarks;
  IcpParams icp;
  CorrectionMode correction = CorrectionMode::kWeighted;
  FusionParams fusion;
  TiltParams tilt;
  GroundHeightParams ground;
  TrustParams trust;
  WatchParams watch;
  MapFixParams map_fix;
  /// Odds, as their logarithm, that a track which a fix has confirmed is on the right map near
  /// the right pose.
  double track_log_odds = cfg::kMission.track_log_odds;
  double map_window_radius_m = cfg::kMission.map_window_radius_m;
  /// Whether evidence of windows that are too poor alone adds up to a proof. Not until it holds on lattices
  /// of another place, too: three sums of 23,500 were false there (adr/0008-verdict-on-a-fix.md).
  bool add_windows = false;
};

/// The paper's own choices throughout, for comparison: plain keypoints and absolute orientation, regions
/// without the test of height, means of points, similarity ICP, each fix taken whole.
LocalizerParams paper_params();

enum class CAIRN_NODISCARD LocalizerStatus : std::uint8_t {
  kReady,    ///< accepted
  kBadRig,   ///< rig not valid or larger than this build
  kBadPose,  ///< NaN, infinity, a quaternion that is none, or a sigma that is not positive
  kBadTrim,  ///< out of range
  kNoStart,  ///< no start pose was given yet
};

/// How the pose of a frame came about. After kHeld and kPrior the next good frame measures the whole way
/// from VO's reference.
enum class PoseSource : std::uint8_t {
  kNone,          ///< no start pose yet
  kStart,         ///< first frame after the start pose
  kVo,            ///< moved by VO, and nothing speaks against it
  kHeld,          ///< pair unusable, no motion prior: the pose before
  kExtrapolated,  ///< VO lost its way: moved from its reference by motion priors or the last step; counted
  kPrior,         ///< pair unusable: moved by the motion prior
  kDoubted,       ///< moved by VO, which something speaks against (WatchStatus)
};
inline constexpr std::size_t kPoseSourceCount = 7;
static_assert(enum_has<PoseSource, kPoseSourceCount>());

/// What became of a registration: one cause each.
enum class CAIRN_NODISCARD FixStatus : std::uint8_t {
  kNone,               ///< none yet
  kRunning,            ///< begun
  kApplied,            ///< the pose was corrected
  kNoMap,              ///< no usable orbital map
  kNoMapBoulders,      ///< none near the rover
  kNoLocalBoulders,    ///< nothing to register
  kTooFewPairs,        ///< the paper's ICP alone
  kWeakGeometry,       ///< proved, and too uncertain to weigh; or the paper's pairs lie too close for a yaw
  kIterationLimit,     ///< the paper's ICP went on moving
  kBeyondLimit,        ///< the paper's ICP moved the pose farther than its parameters let it
  kBadInput,           ///< not finite, or out of its range
  kLate,               ///< the paper's ICP did not finish in its time, or the map was changed
  kInconsistent,       ///< farther off than sigma allows (pose_fusion.hpp), or boulders in view do not agree
                       ///< where those before do
  kNoSearchRoom,       ///< the map holds more boulders there than there is room for
  kNoHypothesis,       ///< no pose in reach agrees at all
  kTooLittleEvidence,  ///< unrelated boulders could agree as well (registration/verdict.hpp), as in ...
  kAmbiguous,          ///< ... another pose agrees nearly as well
  kChanceAgreement,    ///< ... this map agrees as well at poses that are wrong
};
inline constexpr std::size_t kFixStatusCount = 18;
static_assert(enum_has<FixStatus, kFixStatusCount>());

struct FixRecord {
  std::uint32_t frame = 0;  ///< of the snapshot
  FixStatus status = FixStatus::kNone;
  Pose2 correction;  ///< of the rover's pose in map: new minus old (x, y, yaw)
  double scale = 1.0;
  double rms_m = 0.0;
  double chi2 = 0.0;        ///< against the pose before, three degrees of freedom; 0 where it was not weighed
  double sigma_xy_m = 0.0;  ///< after the fix
  double sigma_yaw_rad = 0.0;
  std::uint16_t local_boulders = 0;
  std::uint16_t map_boulders = 0;
  std::uint16_t pairs = 0;
  std::uint16_t trimmed = 0;
  std::uint16_t gated = 0;
  std::uint16_t iterations = 0;
  bool map_window_full = false;
  bool lost = false;              ///< looked for in the whole map
  double log_ratio = 0.0;         ///< 'same ground' against 'chance', nats (registration/verdict.hpp)
  double second_log_ratio = 0.0;  ///< of the second best pose; -1000: none
  double chance_log = 0.0;        ///< what this map does by chance, nats
  std::uint32_t hypotheses = 0;   ///< poses looked at
  /// Windows whose evidence was added up: for what is applied, else for the hypothesis that is carried on; 0:
  /// there is none.
  std::uint8_t windows = 0;
  double windows_log_ratio = 0.0;  ///< of these together, as log_ratio
};

struct LocalizerHealth {
  std::uint32_t frames = 0;
  std::array<std::uint32_t, kVoStatusCount> vo{};             ///< by VoStatus
  std::array<std::uint32_t, kObserveStatusCount> boulders{};  ///< by ObserveStatus
  std::array<std::uint32_t, kFixStatusCount> fixes{};         ///< by FixStatus
  std::uint32_t halved = 0;                                   ///< frames looked at halved, for their noise
  std::uint32_t extrapolated = 0;
  std::uint32_t abandoned_boulders = 0;  ///< frames whose boulders were not finished in time
  std::uint32_t dropped_tracks = 0;
  std::uint32_t bad_priors = 0;
  std::array<std::uint32_t, kWatchStatusCount> watch{};  ///< by WatchStatus
  /// By AttitudeStatus; a heading that waited counts as that, and by what became of it.
  std::array<std::uint32_t, kAttitudeStatusCount> gravity{};
  std::array<std::uint32_t, kAttitudeStatusCount> headings{};
  std::array<std::uint32_t, kAttitudeStatusCount> heights{};  ///< of the ground by the map's heights
};

class Localizer {
 public:
  static constexpr double kUnknownStart_m = PoseFusion::kAnywhere_m;

  /// Forgets everything but trim and map.
  LocalizerStatus init(const LocalizerParams& params, const StereoRig& rig);
  /// Declares where the rover is: T_map_rover, with what it is uncertain by. A claim until a fix; from a
  /// sigma of kUnknownStart_m on, that it is lost, and the pose stands for the place until a fix is found in
  /// the whole map; wider than TrustParams allows, unconfirmed. Starts a new site and forgets boulders.
  LocalizerStatus set_start(const Pose3& T_map_rover, double sigma_xy_m, double sigma_yaw_rad);
  LocalizerStatus set_trim(const StepTrim& trim);
  /// A validated map, or a default one for none. Its bytes stay with the caller. A fix that is under way on
  /// the map before is given up.
  void set_map(const OrbitalMap& map);
  const OrbitalMap& map() const { return map_; }

  /// Begins a frame. The images are borrowed until the next call; null data stands for a missing image.
  /// `motion_prior`: T_prev_cur of the left camera, or null; one that is no pose is left out and counted. An
  /// unfinished observation of the frame before is abandoned and counted.
  LocalizerStatus begin_frame(const ImageU8& left, const ImageU8& right, const Pose3* motion_prior);
  /// Pairs that never came before the next frame, with the motion prior of each, or null. Before the first
  /// frame after a start pose they are nothing to us: the start pose is that frame's.
  void miss(std::uint32_t pairs, const Pose3* motion_prior);
  Progress step_vo(WorkBudget& budget);
  /// VO still reads the pair: it must stay as it is, and another one must wait.
  bool vo_open() const { return stage_ == FrameStage::kVo; }
  Progress step_boulders(WorkBudget& budget);  ///< nothing to do, kDone, while VO is open

  /// The direction away from gravity in the rover frame, measured where the frame was taken and while the
  /// rover stood; sigma about any horizontal axis. After VO of the frame is done.
  AttitudeStatus take_gravity(const Vec3& up_rover, double sigma_rad);
  /// Yaw of the rover in `map` where the frame was taken, within a turn either way. After VO is done.
  AttitudeStatus take_heading(double yaw_rad, double sigma_rad);

  /// Merges tracks, so that begin_fix() need not: in slices.
  Progress prepare_fix(WorkBudget& budget);
  static constexpr std::uint32_t kBeginFixOps = 5000;
  static constexpr std::uint32_t kApplyFixOps = 1500;
  static constexpr std::size_t kLaid = 32;  ///< points laid in the relief in a unit
  static constexpr std::uint32_t kLayOps = kLaid * (BoulderObserver::kLiftOps + Relief::kAddOps);
  void begin_fix();
  Progress step_fix(WorkBudget& budget);
  /// Corrects the pose if the fix converged; closes the record either way.
  void apply_fix();

  std::uint32_t frame() const { return health_.frames; }  ///< frames begun so far
  PoseSource pose_source() const { return pose_source_; }
  /// VO alone, in the map frame as the start pose gave it.
  Pose3 vo_T_map_cam() const;
  /// Corrected.
  Pose3 T_map_cam() const;
  Pose3 T_map_rover() const;
  const Pose2& T_map_site() const { return T_map_site_; }
  const PoseFusion& fusion() const { return fusion_; }
  const AttitudeFusion& tilt() const { return tilt_; }
  AttitudeStatus gravity_status() const { return gravity_status_; }  ///< of what came for this frame, and ...
  AttitudeStatus heading_status() const { return heading_status_; }  ///< ... or became of one that waited
  const FixRecord& last_fix() const { return fix_; }
  Trust trust() const { return trust_.state(); }
  WatchStatus watch() const { return watch_status_; }       ///< of this frame
  const LocalMap& local_map() const { return local_map_; }  ///< of the last begin_fix
  const LocalizerHealth& health() const { return health_; }
  const VisualOdometry& vo() const { return vo_; }
  const BoulderObserver& observer() const { return observer_; }
  BoulderTracks& tracks() { return tracks_; }
  const Landmarks& landmarks() const { return landmarks_; }

 private:
  /// How far the frame is.
  enum class FrameStage : std::uint8_t {
    kNoStart,    ///< no start pose, so no frame
    kDone,       ///< nothing more to do before the next pair
    kVo,         ///< pair taken, VO at work
    kBoulders,   ///< pose known, boulders not begun
    kObserving,  ///< boulders at work
    kTracking,   ///< and put on their tracks
    kHeights,    ///< the ground in view against the map's heights
    kRelief,     ///< what the frame shows is laid in the relief
    kSurvey,     ///< large boulders in it
    kLandmarks   ///< and put among those that are known
  };

  /// The prior, or null for none and for one that is no pose, which is counted.
  const Pose3* checked(const Pose3* motion_prior);
  void take_vo_result();
  Pose3 rover_step(const Pose3& T_prev_cur) const;
  bool measured();
  bool nothing_against();
  void doubt_step(const Pose3& between);
  void hidden(std::uint32_t frames, const Pose3* motion_prior);
  void guessed();
  void mark_reference();
  AttitudeStatus may_take() const;
  void correct_tilt(const TiltResult& r);
  void observed();
  void take_heights();
  AttitudeStatus use_heading();
  void use_waiting_heading();
  void pass_over_heading();
  void tear_local_map();
  bool by_landmarks() const { return cfg::kHaveLandmarks && landmarks_.serve(map_.pixel_m()); }
  Progress step_relief(WorkBudget& budget);
  void lay_in_relief();
  void forget_relief();
  void expect_of_map();
  void begin_site(const Pose3& T_map_rover, double sigma_xy_m, double sigma_yaw_rad);
  void begin_registration();  ///< the paper's, and ...
  void begin_map_fix();       ///< ... with search and verdict
  Progress read_window(WorkBudget& budget);
  void window_read();
  FixStatus take_registration();
  FixStatus take_map_fix();
  /// Of a fix with search and verdict, in this order.
  enum class FixStage : std::uint8_t {
    kConfirm,  ///< fresh boulders under the hypothesis that was carried along
    kTake,     ///< all of them, about the pose that windows together proved
    kSearch,   ///< all of them, wherever the pose may be, ...
    kDoubt,    ///< ... where it may be if the start was farther off than it claimed, ...
    kAnywhere  ///< ... and in the whole map, where fixes together speak against the pose
  };
  MapFixStatus start_stage(FixStage stage, const LocalMap& local);
  bool next_stage();
  bool look_farther();
  bool searched() const { return fix_stage_ >= FixStage::kSearch; }
  Vec3 start_of_stage() const;
  void carry_on(FixStatus status);
  bool goes_on() const;
  void slipped();
  void slid(std::uint32_t steps);
  void jumped();
  void turn_about(const Vec2& pivot_map_m, const Pose2& correction);
  void finish_fix(FixStatus status);

  LocalizerParams params_;
  StereoRig rig_;
  OrbitalMap map_;
  StepTrim trim_;
  LocalizerHealth health_;
  FrameStage stage_ = FrameStage::kNoStart;
  PoseSource pose_source_ = PoseSource::kNone;

  ImageU8 left_;
  ImageU8 right_;
  /// The rover in `site`.
  struct Track {
    Pose3 corrected;  ///< VO, its steps calibrated by what fixes told
    Pose3 vo;         ///< VO alone
  };
  Track T_site_rover_;
  Track at_reference_;         ///< at the last frame that VO measured, began from or gave up
  std::uint32_t unseen_ = 0;   ///< frames since then
  std::uint32_t spanned_ = 1;  ///< steps that the last measurement made one of
  bool primed_ = true;         ///< all of these had a motion prior, and this one has
  Pose3 prior_;
  bool have_prior_ = false;
  Pose2 T_map_site_start_;
  Pose2 T_map_site_;
  PoseFusion fusion_;
  AttitudeFusion tilt_;
  GroundHeightJob ground_;
  bool heights_due_ = false;  ///< since a fix was applied
  AttitudeStatus gravity_status_ = AttitudeStatus::kNone;
  AttitudeStatus heading_status_ = AttitudeStatus::kNone;
  /// What a heading says of T_map_site, until it is used.
  struct Heading {
    bool waiting = false;
    double yaw_map_site_rad = 0.0;
    double variance_rad2 = 0.0;  ///< grows with the steps since
    double way_m = 0.0;          ///< since
  };
  Heading heading_;
  Vec2 fix_pivot_map_m_ = Vec2(0.0, 0.0);  ///< the rover at the snapshot, or at VO's reference before it
  std::uint32_t fix_created_ = 0;          ///< tracks created by the snapshot ...
  std::uint32_t applied_created_ = 0;  ///< ... and by that of the last fix applied; 0: none since the start

  VisualOdometry vo_;
  BoulderObserver observer_;
  BoulderTracks tracks_;
  ReliefStorage<cfg::kReliefSide> relief_grid_;
  Relief relief_;
  Landmarks landmarks_;
  std::size_t laid_ = 0;         ///< cursor over the frame's probes
  double way_m_ = 0.0;           ///< driven since the start pose, as VO has it
  double surveyed_way_m_ = 0.0;  ///< at the last survey of the relief
  LocalMap local_map_;
  MapReader map_reader_;  ///< of the paper's registration; its window is map_fix_'s
  bool reading_ = false;  ///< the window: ICP has not begun
  IcpJob icp_;
  MapFix map_fix_;
  FixStage fix_stage_ = FixStage::kSearch;
  Vec2 fix_pivot_site_m_ = Vec2(0.0, 0.0);  ///< the same in `site`
  double fix_odds_ = 0.0;                   ///< of the track before, as their logarithm
  CarriedHypothesis carried_;
  TrustState trust_;
  VoWatch watch_;
  WatchStatus watch_status_ = WatchStatus::kClear;
  double against_nats_ = 0.0;  ///< of fixes that were declined since the last one applied
  FixRecord fix_;              ///< its status says whether one is open: kRunning
};

}  // namespace cairn
