/// Disparities on a regular grid: the 3D points by which a region is judged to stand above the ground or not.
///
/// Keypoints are too few for that: a 0.1 m boulder two metres off covers some 20 x 15 px and holds one or two
/// of them. Each probe compares an 8 x 8 window of the left image with windows of the same row of the right
/// one (sum of absolute differences), over disparities about the ground's plane: nearer than the ground,
/// where boulders stand, by up to `above` of it, and farther by `below`. Sub-pixel by the equiangular fit (a
/// V through three differences). Left out: windows without horizontal texture, minima at the end of the
/// range, and minima that a second one rivals.
///
/// Source: block matching after Kanade & Okutomi 1994; equiangular fit Shimizu & Okutomi 2001.
#pragma once

#include <cstdint>

#include "core/eigen.hpp"
#include "core/fixed_vector.hpp"
#include "core/work_budget.hpp"
#include "image/image_view.hpp"
#include "mission_cfg.hpp"

namespace cairn {

struct StereoProbeParams {
  int min_disparity_px = cfg::kMission.min_disparity_px;
  int max_disparity_px = cfg::kMission.max_disparity_px;
  double below = 0.2;        ///< search range: disparity of the plane times (1 - below) - 2 px ...
  double above = 0.6;        ///< ... to times (1 + above) + 2 px
  int min_texture = 160;     ///< sum of horizontal grey differences in the window
  double uniqueness = 0.85;  ///< best difference below this share of the best one elsewhere; at least 0.01
};

struct StereoProbe {
  std::int16_t u = 0;  ///< 5th of the window's 8 columns in the left image: its centre is at u - 0.5 ...
  std::int16_t v = 0;  ///< ... and v - 0.5
  float d_px = 0.0F;
};

enum class [[nodiscard]] ProbeStatus : std::uint8_t{
    kIdle, kRunning, kDone,
    kBadInput,  ///< views of different or unfit sizes, or a plane that is not finite
};

class StereoProbeJob {
 public:
  static constexpr int kSpacing = cfg::kMission.probe_spacing_px;
  using Probes = FixedVector<StereoProbe, cfg::kMaxProbes>;

  /// `plane`: d = plane[0] u + plane[1] v + plane[2], of the left image. Images are borrowed until done.
  ProbeStatus start(const StereoProbeParams& params, const ImageU8& left, const ImageU8& right,
                    const Vec3& plane);
  /// Unit: one probe, the first of a row with that row's packing.
  Progress step(WorkBudget& budget);
  ProbeStatus status() const { return status_; }
  /// Found disparities, row by row.
  const Probes& result() const { return probes_; }

 private:
  struct Range {
    int low;
    int high;
  };
  Range search_range(int u, int v) const;
  void pack_rows();
  void probe(int u, int v, const Range& range);

  ProbeStatus status_ = ProbeStatus::kIdle;
  StereoProbeParams params_;
  ImageU8 left_;
  ImageU8 right_;
  Vec3 plane_ = Vec3(0.0, 0.0, 0.0);
  int u_ = 0;
  int v_ = 0;
  int last_ = 0;                    // disparity of the probe before
  std::uint32_t rival_margin_ = 0;  // differences above the least one by this share, in 1/256, are no rivals
  std::uint32_t left_words_[4][cfg::kImageWidth] = {};  // a row of probes: its rows j and j + 4 in a word
  std::uint32_t right_words_[4][cfg::kImageWidth] = {};
  Probes probes_;
};

}  // namespace cairn
