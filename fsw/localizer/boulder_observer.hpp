/// Boulders of one stereo frame, and which of the frame before they go on (METHOD B.2).
///
/// Segmentation of the left image; disparities on a grid; test of each region for standing above the ground;
/// clustering of the raised 3D points, which merges the regions of one boulder (lit face, shaded face) and
/// separates what one region joined; voting between the raised points of the last frame, carried over by VO,
/// and the boulders of this one; assignment.
///
/// Where a boulder is. The mean of its points lies on the side that faces the camera: the far side is hidden.
/// `kMean` is that mean, the paper's choice. `kFootprint` takes what is seen whole, the near edge and the
/// width across the line of sight, and puts the centre half a width behind the near edge (boulders are about
/// as deep as they are wide).
#pragma once

#include <cstdint>

#include "core/enum_count.hpp"
#include "core/nodiscard.hpp"
#include "features/stereo_probe.hpp"
#include "geometry/own_hardware.hpp"
#include "geometry/stereo_rig.hpp"
#include "labeling/clustering.hpp"
#include "labeling/evidence.hpp"
#include "labeling/voting.hpp"
#include "segmentation/segmentation.hpp"

namespace cairn {

enum class BoulderCentre : std::uint8_t { kMean, kFootprint };

struct BoulderParams {
  SegmentationParams segmentation;
  StereoProbeParams probe;
  RegionEvidenceParams evidence;
  ClusteringParams clustering{cfg::kMission.boulder_cut_m};
  BoulderCentre centre = BoulderCentre::kFootprint;
  double max_range_m = cfg::kMission.boulder_max_range_m;
  OwnHardware own = kMissionHardware;  ///< nothing there is a boulder
  double probe_sigma_px = cfg::kProbeSigma_px;
  std::uint32_t plan_ops = cfg::kProbePlanOps;  ///< of segmentation and disparities; these have what is left
  int min_points = 3;                           ///< of a cluster
  int min_votes = 1;
};

/// One boulder in one frame.
struct BoulderSighting {
  Vec3 p_site_m = Vec3(0.0, 0.0, 0.0);  ///< centre; z: mean height of its points
  float diameter_m = 0.0F;              ///< width across the line of sight
  float spread_m = 0.0F;                ///< root mean square distance of its points from their mean
  float range_m = 0.0F;                 ///< horizontal distance from the camera
  std::uint16_t points = 0;
  std::uint8_t previous = 0;  ///< sighting of the last frame that it goes on, plus 1; 0: new
};
using BoulderSightings = FixedVector<BoulderSighting, cfg::kMaxLabels>;

enum class CAIRN_NODISCARD ObserveStatus : std::uint8_t {
  kIdle,
  kRunning,
  kBoulders,    ///< result() holds at least one
  kNoBoulders,  ///< nothing stands above the ground; no fault
  kNoRegions,   ///< segmentation found none: black or saturated image, or noise
  kNoPoints,    ///< no disparities
  kBadInput,    ///< images of the wrong size, or a pose or plane that is not valid
};
inline constexpr std::size_t kObserveStatusCount = 7;
static_assert(enum_has<ObserveStatus, kObserveStatusCount>());

struct ObserveCounts {
  int regions = 0;
  int probes = 0;
  int thinned_rows = 0;    ///< of probes, for want of room in the plan
  int evident = 0;         ///< regions that passed the test
  int raised = 0;          ///< points
  int dropped_points = 0;  ///< raised points without room
  int dropped_boulders = 0;
  int matched = 0;  ///< boulders that go on one of the last frame
};

class BoulderObserver {
 public:
  /// With so many raised points, or the same of one cluster: what no job of its own counts.
  static constexpr std::uint32_t kRun = 512;      ///< surface points gathered in a unit
  static constexpr std::uint32_t kCarried = 128;  ///< points of the last frame carried over in a unit
  static constexpr std::uint32_t kLiftOps = 60;   ///< of one probe, as ray_of() has it
  static constexpr std::uint32_t kCollectOps = 2 * kRun;
  static constexpr std::uint32_t kCarryOps = 20 * kCarried;
  static constexpr std::uint32_t start_ops(std::uint32_t points) { return 3U * points; }
  static constexpr std::uint32_t sort_ops(std::uint32_t points) { return 4U * points; }
  static constexpr std::uint32_t describe_ops(std::uint32_t points) { return 60U + 4U * points; }
  static constexpr std::uint32_t paint_ops(std::uint32_t points) { return 1900U + 3U * points; }
  static constexpr std::uint32_t keep_ops(std::uint32_t points) { return 1U + 3U * points; }

  /// Forgets the last frame.
  void init(const BoulderParams& params, const StereoRig& rig);
  /// Images are borrowed until done. `plane`: disparity plane of the frame (VisualOdometry::disparity_plane);
  /// `offset`: of the right image (RectificationEstimator::offset), rows taken whole.
  ObserveStatus start(const ImageU8& left, const ImageU8& right, const Vec3& plane, const Pose3& T_site_cam,
                      const ImageOffset& offset = {});
  Progress step(WorkBudget& budget);
  /// Ends an unfinished frame without a result: the next one votes with the frame before.
  void abandon();
  ObserveStatus status() const { return status_; }
  const BoulderSightings& result() const { return sightings_; }
  const ObserveCounts& counts() const { return counts_; }
  /// For telemetry and pictures: the regions, and the surface points with their verdict.
  const SegmentationJob& segmentation() const { return segmentation_; }
  /// Once a frame is done, until the next one is begun: what was probed, however far away, and where a probe
  /// lies from the camera, in axes of `site`. False where it shows nothing of the ground.
  const StereoProbeJob::Probes& probes() const { return probe_.result(); }
  bool ray_of(const StereoProbe& probe, Vec3& ray_m) const;
  const Vec3& camera_site_m() const { return T_site_cam_.t; }
  const SurfacePoints& surface() const { return surface_; }
  /// The sighting (index in result() plus 1; 0: none) that a surface point is part of,
  /// while status() is kBoulders.
  std::uint8_t sighting_of(const SurfacePoint& p) const {
    return grid_[(p.v / StereoProbeJob::kSpacing) * kGridColumns + p.u / StereoProbeJob::kSpacing];
  }

 private:
  enum class Phase : std::uint8_t {
    kSegment,
    kProbe,
    kLift,
    kEvidence,
    kCollect,  ///< the raised points
    kCluster,
    kSort,  ///< them by cluster
    kDescribe,
    kPaint,  ///< the sightings, where they are in the image
    kCarry,  ///< the last frame's points there
    kVote,
    kKeep,  ///< this frame's for the next
  };
  struct Member {
    Vec3 p_site_m = Vec3(0.0, 0.0, 0.0);
    std::uint8_t sighting = 0;  ///< index + 1
  };
  static constexpr int kGridColumns = cfg::kImageWidth / StereoProbeJob::kSpacing + 1;
  static constexpr int kGridRows = cfg::kImageHeight / StereoProbeJob::kSpacing + 1;

  bool run_phase(WorkBudget& budget);
  bool work(WorkBudget& budget);  ///< a job or units of the phase; false: budget spent
  std::uint32_t unit_ops() const;
  bool unit();  ///< false: the phase goes on
  void next_phase();
  void begin_probes();
  void begin_evidence();
  void lift(const StereoProbe& probe);
  bool collect();
  void begin_clustering();
  void sort_by_cluster();
  bool observe_cluster();
  /// `members`: indices of raised points.
  BoulderSighting describe(const std::uint16_t* members, int points) const;
  void paint_sightings();
  bool carry();
  void keep();
  void finish(ObserveStatus status);

  BoulderParams params_;
  StereoRig rig_;
  ObserveStatus status_ = ObserveStatus::kIdle;
  Phase phase_ = Phase::kSegment;
  std::size_t cursor_ = 0;
  std::uint64_t spent_ops_ = 0;  ///< on this frame
  ImageU8 left_;
  ImageU8 right_;
  Vec3 plane_ = Vec3(0.0, 0.0, 0.0);
  ImageOffset offset_;
  Pose3 T_site_cam_;
  ObserveCounts counts_;

  SegmentationJob segmentation_;
  StereoProbeJob probe_;
  RegionBoxes boxes_;
  StereoProbeJob::Boxes close_by_;
  StereoProbeJob::Boxes surroundings_;
  SurfacePoints surface_;
  RegionEvidenceJob evidence_;
  ClusterPoints raised_;
  FixedVector<std::uint16_t, cfg::kMaxClusterPoints> raised_surface_;  ///< index in surface_
  ClusteringJob clustering_;
  BoulderSightings sightings_;
  VotingJob voting_;
  FixedVector<Member, cfg::kMaxClusterPoints> last_members_;  ///< raised points of the last frame
  int last_sightings_ = 0;
  std::uint16_t by_cluster_[cfg::kMaxClusterPoints] = {};         ///< raised points, ascending in each
  std::uint16_t cluster_begin_[cfg::kMaxClusterPoints + 1] = {};  ///< in by_cluster_
  std::uint8_t sighting_of_[cfg::kMaxClusterPoints] = {};         ///< by cluster, index + 1; 0: too small
  std::uint8_t grid_[kGridRows * kGridColumns] = {};              ///< sighting at each probe, index + 1
};

}  // namespace cairn
