/// Disparities on a regular grid: the 3D points by which a region is judged to stand above the ground or not.
///
/// Keypoints are too few for that: a 0.1 m boulder two metres off covers some 20 x 15 px and holds one or
/// two of them. Each probe compares an 8 x 8 window of the left image with windows of the same row of the
/// right one (sum of absolute differences), over disparities about the ground's plane: nearer than the
/// ground, where boulders stand, by up to `above` of it, and farther by `below`. Sub-pixel by the
/// equiangular fit (a V through three differences). Left out: windows without horizontal texture, minima at
/// the end of the range, minima that a second one rivals, and windows whose ground the right image does not
/// hold: at the left rim of the left one. Outside the boxes that matter, where such are told, probes are
/// fewer: around them half, as on a chessboard, and elsewhere each second one of each second row. Where all
/// would take more than is planned, as in noise, the lower rows have half of theirs, or a quarter: what is
/// near is large in the picture and has many.
///
/// Most disparities are dismissed without comparing pixels: the differences of sums over parts of the
/// window are together no larger than the sum of the pixels' differences, so that where they exceed what
/// could still be the least, or its rival once that is found, the disparity is neither (successive
/// elimination; first the sums of quarters, then of half columns, then the pixels of half of the window).
/// The search begins at the last probe's disparity, next to which the least usually lies. The answer is
/// that of the whole comparison, to the bit.
///
/// Two pixels at a time: a band of eight rows is stored as words that hold one pixel of the upper four rows
/// and one of the lower four, sixteen bits each.
///
/// Source: block matching after Kanade & Okutomi 1994; equiangular fit Shimizu & Okutomi 2001; elimination
/// Li & Salari, IEEE Trans. Image Processing 4(1), 1995.
///
/// Cost, operations: a row of probes 12 a column and 4 a box; a probe 100, 4 a disparity, 8 for each that the
/// quarters do not dismiss (some 10 of 40) and 16 for each half that is compared by pixels (some 10).
#pragma once

#include <cstdint>

#include "core/eigen.hpp"
#include "core/fixed_vector.hpp"
#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "image/image_view.hpp"
#include "mission_cfg.hpp"

namespace cairn {

struct StereoProbeParams {
  int min_disparity_px = cfg::kMission.min_disparity_px;
  int max_disparity_px = cfg::kMission.max_disparity_px;
  double below = 0.2;        ///< search range: disparity of the plane times (1 - below) - 2 px ...
  double above = 0.6;        ///< ... to times (1 + above) + 2 px
  int min_texture = 160;     ///< sum of horizontal grey differences in the window; noise of one level has 63
  double uniqueness = 0.85;  ///< best difference below this share of the best one elsewhere
};

struct StereoProbe {
  std::int16_t u = 0;  ///< 5th of the window's 8 columns in the left image: its centre is at u - 0.5 ...
  std::int16_t v = 0;  ///< ... and v - 0.5
  float d_px = 0.0F;
};

enum class CAIRN_NODISCARD ProbeStatus : std::uint8_t {
  kIdle,
  kRunning,
  kDone,
  kBadInput,  ///< views of different or unfit sizes, or a plane that is not finite
};

class StereoProbeJob {
 public:
  static constexpr int kSpacing = cfg::kMission.probe_spacing_px;
  static constexpr int kMaxRange = 256;  ///< disparities
  /// The bands of one image.
  static constexpr std::uint32_t band_ops(int width) { return 6U * static_cast<std::uint32_t>(width); }
  static constexpr std::uint32_t row_ops(std::size_t boxes) {
    return 400U + 4U * static_cast<std::uint32_t>(boxes);
  }
  /// Before it is known what must be compared ...
  static constexpr std::uint32_t probe_ops(int steps) {
    return 100U + (steps > 0 ? 4U * static_cast<std::uint32_t>(steps) : 0U);
  }
  /// ... and where everything must be, by columns even twice, and the two beside the least once more.
  static constexpr std::uint32_t most_probe_ops(int steps) {
    return probe_ops(steps) + 48U * static_cast<std::uint32_t>(steps + 2);
  }
  /// Disparities of a probe: most where the range about the plane's ends at the largest.
  static constexpr int most_steps(const StereoProbeParams& p) {
    const double high = p.max_disparity_px;
    const int steps = static_cast<int>(high - (high - 2.0) / (1.0 + p.above) * (1.0 - p.below) + 2.0) + 2;
    return steps < kMaxRange ? steps : kMaxRange;
  }
  using Probes = FixedVector<StereoProbe, cfg::kMaxProbes>;
  using Boxes = FixedVector<PixelBounds, cfg::kMaxLabels>;

  /// `plane`: d = plane[0] u + plane[1] v + plane[2], of the left image. `right_lower_px`: rows by which the
  /// right image lies lower; windows that it does not hold are left out. Images are borrowed until done.
  ProbeStatus start(const StereoProbeParams& params, const ImageU8& left, const ImageU8& right,
                    const Vec3& plane, int right_lower_px = 0);
  /// Before the first step: asks for so much less texture, of a dull picture (SegmentationJob::gain_q8) ...
  void allow_for_gain(int gain_q8) { params_.min_texture = params_.min_texture * 256 / gain_q8; }
  /// ... and puts all probes into `boxes` of the left image, half of them into what is `around`, and few
  /// elsewhere (borrowed until done).
  void attend_to(const Boxes& boxes, const Boxes& around) {
    boxes_ = &boxes;
    around_ = &around;
  }
  /// The same: what all rows may take, but for what a quarter of the probes takes beyond it.
  void plan(std::uint32_t ops) { planned_ops_ = ops; }
  /// Unit: the boxes of a row, the preparation of one image's row of probes, or one probe.
  Progress step(WorkBudget& budget);
  ProbeStatus status() const { return status_; }
  /// Found disparities, row by row.
  const Probes& result() const { return probes_; }
  int thinned_rows() const { return thinned_rows_; }

 private:
  struct Range {
    int low;
    int high;
  };
  /// Eight rows of an image, in columns of words with a pixel of the upper four rows in the upper half and
  /// the one four rows below it in the lower half.
  struct Band {
    std::uint32_t pairs[4 * cfg::kImageWidth];
    std::uint32_t columns[cfg::kImageWidth];   ///< sums of the four, halves as above
    std::uint32_t quarters[cfg::kImageWidth];  ///< sums of four columns, from this one on
  };
  using Seen = std::uint32_t;  ///< what is known of the sum at a disparity
  /// One probe's.
  struct Search {
    int x;                   ///< left rim of the window in the left image
    std::uint32_t left_sum;  ///< grey values of that window
    std::uint32_t cost;
    Seen* end;
    Seen seen[kMaxRange];  ///< what may be the least or its rival
  };

  static constexpr int kCells = cfg::kImageWidth / kSpacing;  ///< probes of a row, at most

  bool row_is_in_right() const;
  void next_row();
  void count_boxes(const Boxes& boxes, std::int16_t (&edges)[kCells + 1]) const;
  void choose_probes();
  [[gnu::cold]] double weight_of_probe(int v) const;
  [[gnu::cold]] int thinning(int wanted);
  void next_probe();
  template <bool kComplements>
  static void prepare(const ImageU8& image, int v, Band& band);
  Range search_range(int u, int v) const;
  std::uint32_t most_of_rivals(const Search& search, std::uint32_t least) const;
  std::uint32_t half(int left_x, int x, std::uint32_t most) const;
  Seen compare(Search& search, int d, std::uint32_t by_columns, std::uint32_t most) const;
  Seen find_least(Search& search, const Range& range) const;
  std::uint32_t probe(int u, int v, const Range& range);
  bool judge(Search& search, Seen best, float& d_px) const;

  ProbeStatus status_ = ProbeStatus::kIdle;
  StereoProbeParams params_;
  ImageU8 left_;
  ImageU8 right_;
  Vec3 plane_ = Vec3(0.0, 0.0, 0.0);
  /// In memory: as a constant it is two instructions wherever it is used.
  std::uint32_t signs_ = 0x80008000U;
  std::uint32_t limit_q16_ = 0;  ///< 1 / uniqueness, rounded up; 0: nothing can be dismissed
  int right_lower_px_ = 0;
  const Boxes* boxes_ = nullptr;  ///< none: everything matters
  const Boxes* around_ = nullptr;
  bool wanted_[kCells];
  int u_ = 0;
  int v_ = 0;
  bool chosen_ = false;  ///< what wanted_ holds is of the row v_
  int prepared_ = 0;     ///< bands that hold the rows about v_, of two
  int last_d_ = 0;       ///< where the last search ended
  std::uint32_t planned_ops_ = UINT32_MAX;
  std::uint32_t spent_ops_ = 0;
  std::uint32_t probe_ops_ = 0;     ///< of it by probes ...
  std::uint32_t probe_weight_ = 0;  ///< ... and theirs, by their disparities
  int rows_ = 0;                    ///< chosen so far ...
  int wanted_probes_ = 0;           ///< ... what they would have had ...
  int thinned_rows_ = 0;            ///< ... and how many of them were thinned
  Band left_band_;
  Band right_band_;
  Probes probes_;
};

}  // namespace cairn
