/// Candidate boulders of one image: mean-shift segmentation as METHOD B.2 has it.
///
///   halving     mean of 2 x 2 pixels (scale_divisor 2), rounded: a quarter of the work, and less noise
///   stretch     a dull picture's grey levels, where it is halved, to `least_deviation_grey`, fourfold at
///               most: what follows takes grey levels as they are
///   filter      mean shift (mean_shift.hpp)
///   connection  neighbouring pixels whose modes differ by at most `connect_grey` are one region
///               (region_map.hpp). Out of memory for regions, as with strong gravel under a low sun, it
///               starts over with about twice the tolerance, up to `merge_grey`
///   merging     neighbouring regions of similar mean, then elimination of small ones (region_merge.hpp)
///   selection   regions up to `max_area_fraction` of the image (what is larger is ground or sky) that stand
///               out from their neighbours by `min_contrast_grey` on average along their outline. Those with
///               the largest contrast times area get labels 1, 2, ... in that order, `max_labels` at most
///
/// A region is a piece of image of one intensity, not yet a boulder: a lit and a shaded face may be two
/// regions, a patch of sand or a shadow may be one. Whether its 3D points stand above the ground is for later
/// stages to say. The grey-level parameters suit an image that uses most of the 8 bits (companded by a square
/// root or exposed to be so).
///
/// Pixel coordinates of results are those of the full image (u right, v down, centre of the top-left pixel
/// (0, 0)), areas and lengths are full-resolution pixels. Where the divisor is 2, an odd last row or column
/// is not looked at. Integer arithmetic but for the means and centroids of the result.
///
/// Cost: some 5 million operations for 512 x 384 at half resolution, 2 of them in the filter and 2 in the
/// merging; the same bits come out however it is sliced. The largest unit of work is 256 regions of the
/// merging, or 8 operations a pixel of a row.
#pragma once

#include <cstdint>

#include "core/fixed_vector.hpp"
#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "image/image_view.hpp"
#include "mission_cfg.hpp"
#include "segmentation/mean_shift.hpp"
#include "segmentation/region_map.hpp"
#include "segmentation/region_merge.hpp"

namespace cairn {

struct SegmentationParams {
  int scale_divisor = cfg::kMission.segmentation_divisor;      ///< 1 or 2, the mission's or more
  int spatial_radius_px = cfg::kMission.mean_shift_radius_px;  ///< of the mean shift, working pixels, 1 to 32
  int range_radius_grey = cfg::kMission.mean_shift_radius_grey;    ///< 1 to 255
  int max_iterations = 2;                                          ///< 1 to 100
  int convergence = 1;                                             ///< as in MeanShiftParams
  bool each_second = true;                                         ///< the same
  int connect_grey = cfg::kMission.region_connect_grey;            ///< 0 to 255
  int merge_grey = cfg::kMission.region_merge_grey;                ///< 0 to 255
  int min_area_px = cfg::kMission.min_region_area_px;              ///< full-resolution pixels, 0 or more
  double max_area_fraction = cfg::kMission.max_region_fraction;    ///< of the image, above 0 up to 1
  int min_contrast_grey = cfg::kMission.min_region_contrast_grey;  ///< 0 to 255
  int least_deviation_grey = 16;                       ///< of all pixels from their mean, 0 to 255
  int max_labels = static_cast<int>(cfg::kMaxLabels);  ///< 1 to cfg::kMaxLabels
};

enum class CAIRN_NODISCARD SegmentationStatus : std::uint8_t {
  kIdle,            ///< never started
  kRunning,         ///< call step() again
  kDone,            ///< labels and regions are there to be used
  kNoRegions,       ///< nothing between the area limits: a black, saturated or blank image. No labels
  kTooManyRegions,  ///< more pieces than the memory holds: noise, not a scene. No labels
  kBadInput,        ///< an empty or too large view, or a parameter out of its range
};

/// One labelled region.
struct Region {
  std::uint8_t label = 0;  ///< 1 ... : its value in the label image, and its place in regions() plus one
  int area_px = 0;
  float mean_grey = 0.0F;      ///< of the filtered image
  float contrast_grey = 0.0F;  ///< mean step of the filtered means across its outline inside the image
  float centroid_u_px = 0.0F;
  float centroid_v_px = 0.0F;
  int u_min_px = 0;  ///< bounding box, both ends inside
  int u_max_px = 0;
  int v_min_px = 0;
  int v_max_px = 0;
  int outline_px = 0;  ///< length of its outline inside the image
  int border_px = 0;   ///< length of its outline along the image border: above 0, it may be cut off
};
using Regions = FixedVector<Region, cfg::kMaxLabels>;

/// The label image at working resolution.
struct LabelView {
  ImageU8 image;    ///< 0: no region
  int divisor = 1;  ///< full-resolution pixels to one of `image`: 1 or 2

  /// Label at a full-resolution pixel coordinate; 0 outside of the image.
  std::uint8_t label_at(double u_px, double v_px) const;
};

class SegmentationJob {
 public:
  static constexpr int kRun = 256;  ///< region numbers looked at in one unit of the selection, at most
  static constexpr std::uint32_t row_ops(int width) { return 4U * static_cast<std::uint32_t>(width); }
  static constexpr std::uint32_t select_ops(int max_labels) {
    return static_cast<std::uint32_t>(kRun + max_labels);
  }

  /// `image`: a working pixel at least, at most the mission's size and cfg::kWorkingPixels. Borrowed until
  /// the job is done.
  SegmentationStatus start(const SegmentationParams& params, const ImageU8& image);
  Progress step(WorkBudget& budget);
  SegmentationStatus status() const { return status_; }

  /// Valid until the next start(); empty (image.data null) unless the status is kDone.
  LabelView labels() const;
  /// By label. Empty unless the status is kDone.
  const Regions& regions() const { return regions_; }
  /// Regions that passed the selection but found no label left.
  int dropped() const { return dropped_; }
  /// For telemetry and tuning: the tolerance that the connection ended with (above connect_grey where that
  /// gave more pieces than there is memory for), the pieces it gave, and the passes of the merging.
  int tolerance_grey() const { return tolerance_grey_; }
  /// How far a dull picture was stretched, in 1/256; 256: not at all.
  int gain_q8() const { return gain_q8_; }

 private:
  enum class Phase : std::uint8_t { kHalve, kStretch, kFilter, kConnect, kMerge, kOutline, kSelect, kPaint };

  void begin_merge();
  std::uint32_t unit_cost() const;
  void do_unit();
  void halve_row(int y);
  void end_halving();
  void stretch_row(int y);
  void begin_connect();
  void connect_next_row();
  void out_of_numbers();
  void outline_row(int y);
  void step_across(std::uint16_t a, std::uint16_t b);
  void select_next();
  bool is_candidate(std::uint16_t number) const;
  std::uint64_t weight(std::uint16_t number) const;
  void insert(std::uint16_t number);
  void begin_paint();
  void paint_row(int y);
  void finish();

  struct Sums {
    std::uint64_t x = 0;
    std::uint64_t y = 0;
    int x_min = 0;
    int x_max = 0;
    int y_min = 0;
    int y_max = 0;
    int border = 0;
  };

  SegmentationParams params_;
  ImageU8 image_;
  SegmentationStatus status_ = SegmentationStatus::kIdle;
  Phase phase_ = Phase::kHalve;
  int cursor_ = 0;  ///< next row or region number of the phase
  int width_ = 0;   ///< working size
  int height_ = 0;
  int tolerance_grey_ = 0;       ///< of the connection
  std::uint32_t sum_grey_ = 0;   ///< over the halved image
  std::uint64_t sum_grey2_ = 0;  ///< of the squares
  std::int32_t gain_q8_ = 256;   ///< of the stretch, about the mean
  int dropped_ = 0;
  MeanShiftJob filter_;
  RegionMergeJob merge_;
  RegionMap map_;
  FixedVector<std::uint16_t, cfg::kMaxLabels> selected_;
  std::uint64_t weights_[cfg::kMaxLabels] = {};  ///< theirs
  FixedVector<Sums, cfg::kMaxLabels> sums_;
  Regions regions_;
  std::uint8_t half_[cfg::kImagePixels / 4] = {};
  std::uint8_t plane_[cfg::kWorkingPixels] = {};  ///< the filtered image, then the labels
  std::uint8_t label_of_[kMaxRegionNumbers] = {};
  std::uint32_t outline_[kMaxRegionNumbers] = {};     ///< pixel sides between a region and others
  std::uint32_t steps_grey_[kMaxRegionNumbers] = {};  ///< sum of the differences of mean across them
};
static_assert(sizeof(SegmentationJob) <= cfg::kSegmentationMaxBytes,
              "raise kSegmentationMaxBytes in mission_cfg");

}  // namespace cairn
