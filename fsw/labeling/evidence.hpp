/// Which regions are boulders? Those whose 3D points stand above the local ground.
///
/// Regions of one intensity (METHOD B.2) also hold sand, mineral patches and shadows,
/// so each is tested: a plane
///   z = a (x - x_0) + b (y - y_0) + c
/// is fitted to the points around the region (its box widened by half its size; of many, each second or
/// third one, so that a hundred are left), robustly and one-sidedly, since what is not ground there stands
/// above it: weight (1 + (r/s)^2)^-2 above the plane and (1 + (r/2s)^2)^-1 below, until it rests, in
/// fifteen iterations at most. A point is raised where it stands `min_height_m` and three standard
/// deviations above that plane. A region with `min_raised` raised points of its own, and one at least
/// `min_top_m` high, is a boulder's; then the points around it that carry no label but are raised as well
/// belong to it too (a lit face often has the ground's grey). Without `test_height` every region's points
/// count: that is the paper's variant.
///
/// Frame: `site`, z up, metres. Heights are vertical.
#pragma once

#include <cstdint>

#include "core/eigen.hpp"
#include "core/fixed_vector.hpp"
#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "image/image_view.hpp"
#include "labeling/plane_fit.hpp"
#include "mission_cfg.hpp"

namespace cairn {

/// A 3D point of one frame, with the region it was seen in.
struct SurfacePoint {
  Vec3 p_site_m = Vec3(0.0, 0.0, 0.0);
  float sigma_height_m = 0.0F;  ///< standard deviation of its height
  std::int16_t u = 0;           ///< pixel of the left image
  std::int16_t v = 0;
  std::uint8_t label = 0;  ///< region, 1 ...; 0: none
  bool raised = false;     ///< out: belongs to a boulder
};
inline constexpr std::size_t kMaxSurfacePoints = cfg::kMaxProbes;
/// In scan order: rows of equal v, u rising.
using SurfacePoints = FixedVector<SurfacePoint, kMaxSurfacePoints>;

/// Bounding box of a region, px of the left image, inclusive. It holds all points that carry the label.
struct RegionBox {
  std::uint8_t label = 0;
  std::int16_t u_min = 0;
  std::int16_t u_max = 0;
  std::int16_t v_min = 0;
  std::int16_t v_max = 0;
};
using RegionBoxes = FixedVector<RegionBox, cfg::kMaxLabels>;

struct RegionEvidenceParams {
  bool test_height = true;  ///< false: the paper's regions as they are
  double min_height_m = cfg::kMission.boulder_min_height_m;
  double min_top_m = cfg::kMission.boulder_min_top_m;
  int min_raised = 2;
  int min_ground_points = 8;     ///< around a region; with fewer it is left out
  double plane_scale_m = 0.015;  ///< s above: roughness of ground that is no boulder
};

enum class CAIRN_NODISCARD RegionEvidenceStatus : std::uint8_t {
  kIdle,
  kRunning,
  kDone,
  kNoPoints,  ///< no surface point: nothing can be said
};

class RegionEvidenceJob {
 public:
  static constexpr std::size_t kUnitPoints = 384;
  static constexpr std::uint32_t kOpenOps = 50;
  static constexpr std::uint32_t unit_ops(std::size_t points, std::uint32_t each) {
    return 20U + each * static_cast<std::uint32_t>(points);
  }
  static constexpr std::uint32_t kMostEach = 12;
  /// Where each point matters to a region: what belongs to it, and the ground next to it ...
  static PixelBounds close_by(const RegionBox& region);
  /// ... and where ground is looked for at all, of which half of the points are enough: none outside matters.
  static PixelBounds surroundings(const RegionBox& region);

  /// `points` is borrowed until done and gets its `raised` set.
  RegionEvidenceStatus start(const RegionEvidenceParams& params, const RegionBoxes& regions,
                             SurfacePoints& points);
  /// Unit: 384 points, of all as they are sorted by rows, or of a region's ground in one iteration of the
  /// plane; or its points in one row; some 4600 operations at most. The same for every slicing.
  Progress step(WorkBudget& budget);
  RegionEvidenceStatus status() const { return status_; }
  /// Regions that passed.
  int boulders() const { return boulders_; }
  /// Regions left out for want of ground points around them.
  int untested() const { return untested_; }

 private:
  /// Of one region, in this order.
  enum class Phase : std::uint8_t {
    kIndex,  ///< once for all regions: where each row begins
    kOpen,
    kGather,  ///< ground around it, and how many points it has itself
    kFit,     ///< the plane of the ground, an iteration after the other
    kOwn,     ///< its own points that are raised
    kMark,    ///< what belongs to it
  };
  /// Points, from one on to before another.
  struct Span {
    std::size_t begin;
    std::size_t end;
  };
  std::size_t first_at_or_below(int v) const;
  const RegionBox& region() const { return (*regions_)[next_]; }
  void open();
  void next_phase();
  void after_gather();
  void thin_ground();
  void after_iteration();
  void enter(Phase phase, std::size_t begin, std::size_t end);
  void next_region();
  Span next_span() const;
  std::size_t first_right_of(int u, std::size_t begin, std::size_t end) const;
  void unit(const Span& span);
  void index(std::size_t end);
  void gather(std::size_t index);
  void fit(std::size_t end);
  void own(const SurfacePoint& p);
  void mark(SurfacePoint& p) const;
  bool is_raised(const SurfacePoint& p) const;

  RegionEvidenceStatus status_ = RegionEvidenceStatus::kIdle;
  RegionEvidenceParams params_;
  const RegionBoxes* regions_ = nullptr;
  SurfacePoints* points_ = nullptr;
  std::size_t next_ = 0;  ///< region
  Phase phase_ = Phase::kOpen;
  std::size_t cursor_ = 0;  ///< of points, or of ground_
  std::size_t end_ = 0;
  PixelBounds wide_;            ///< where its ground is looked for
  PixelBounds near_;            ///< where its points are
  std::size_t near_begin_ = 0;  ///< points of its rows
  std::size_t near_end_ = 0;
  int labelled_ = 0;  ///< its own points there
  int iteration_ = 0;
  GroundPlane plane_{};
  PlaneSums sums_;
  int own_ = 0;  ///< its own points that are raised
  double top_m_ = 0.0;
  int boulders_ = 0;
  int untested_ = 0;
  std::uint8_t label_[kMaxSurfacePoints] = {};            ///< of each point: all that most are asked for
  FixedVector<std::uint16_t, kMaxSurfacePoints> ground_;  ///< points around the region at hand
  int row_ = 0;
  std::uint16_t row_begin_[cfg::kImageHeight + 1] = {};  ///< first point at or below row v
};

}  // namespace cairn
