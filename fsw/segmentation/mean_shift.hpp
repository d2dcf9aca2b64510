/// Mean-shift filter of a grey image (METHOD B.2; Comaniciu and Meer, PAMI 24(5), 2002).
///
/// Each pixel starts a trajectory at its own place and grey value (x, y, g). One iteration moves it to the
/// mean of the pixels within the spatial radius whose grey value is within the range radius of g:
///   W = { (u, v) : |u - x| <= hs, |v - y| <= hs, |I(u, v) - g| <= hr }
///   (x, y, g) <- mean over W of (u, v, I(u, v))
/// that is mean shift with flat kernels in both domains. The output is the grey value where the trajectory
/// comes to rest: texture is flattened, edges stay where they are. The square spatial window, places and grey
/// values rounded (halves to even) at each iteration, and the rule that stops a trajectory are those of
/// OpenCV's pyrMeanShiftFiltering without pyramid, which is the oracle: equal bits on images (for three equal
/// channels and hr sqrt(3); unit_tests/opencv/test_mean_shift.cpp).
///
/// With `each_second`, only pixels whose x + y is even walk. Another takes the mode of that neighbour (left,
/// right, above; ties: the first) whose grey value is nearest to its own: half of the work, and on three
/// drives as many boulders as when all walk, and as right.
///
/// Only the grey value of a mode is kept. Regions are delineated on the pixel lattice by neighbours with
/// agreeing modes (region_map.hpp), to which the place of a mode adds nothing. Trajectories do not adopt
/// the modes of pixels that they step on ("basins of attraction"): with these bandwidths one takes 1.2 to 2
/// iterations, so that adoption was measured to save at most a tenth of the time, at the cost of exactness
/// and of independence between pixels.
///
/// Windows of radius 2 at most are summed four pixels at a time: a word holds four pixels of a column; the
/// fifth row goes pixel by pixel. That takes a range radius of 25 at most, with which the grey values of five
/// members, counted from the lowest, fit a byte. The words of the rows about the scan are kept; a trajectory
/// that strays from them, and other radii, go by pixels alone: the same numbers.
///
/// Integer arithmetic only. Cost, operations: an iteration 8 (2 hs + 1) by words, (2 hs + 1)^2 by pixels, at
/// most `max_iterations` of them a trajectory; words 2 a pixel; pixels that do not walk 2.
#pragma once

#include <cstdint>

#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "image/image_view.hpp"
#include "mission_cfg.hpp"

namespace cairn {

struct MeanShiftParams {
  int spatial_radius_px = 2;   ///< hs, 1 to 32, pixels of the image given
  int range_radius_grey = 16;  ///< hr, 1 to 255, grey levels
  int max_iterations = 2;      ///< 1 to 100
  int convergence = 1;  ///< 0 or more: a trajectory rests when (x, y) stays or |dx| + |dy| + dg^2 <= this
  bool each_second = false;  ///< of the pixels
};

enum class CAIRN_NODISCARD MeanShiftStatus : std::uint8_t {
  kIdle,      ///< never started
  kRunning,   ///< call step() again
  kDone,      ///< the output is whole
  kBadInput,  ///< an empty view, views of different sizes, or a parameter out of its range
};

/// The unit of work is a run of trajectories (eight by words, one by pixels), the words of one row, or the
/// pixels of one that did not walk. Both views are borrowed until the job is done; they must not overlap (a
/// trajectory reads the input behind the scan).
class MeanShiftJob {
 public:
  static constexpr int kRun = 8;  ///< trajectories of a unit, by words
  static constexpr std::uint32_t pack_ops(int width) { return 2U * static_cast<std::uint32_t>(width); }
  static constexpr std::uint32_t fill_ops(int width) { return static_cast<std::uint32_t>(width); }
  /// Of one iteration of one trajectory, by words.
  static constexpr std::uint32_t shift_ops(int radius_px) {
    return 8U * static_cast<std::uint32_t>(2 * radius_px + 1);
  }
  static constexpr std::uint32_t most_run_ops(const MeanShiftParams& p) {
    return static_cast<std::uint32_t>(kRun * p.max_iterations) * shift_ops(p.spatial_radius_px);
  }

  MeanShiftStatus start(const MeanShiftParams& params, const ImageU8& input, const MutableImageU8& output);
  Progress step(WorkBudget& budget);
  MeanShiftStatus status() const { return status_; }

 private:
  static constexpr int kRing = 16;  ///< rows of words: 8 above the scan, its own and 7 below

  int step_px() const { return params_.each_second ? 2 : 1; }
  void pack_row(int y);
  int settle_run(int length);
  void begin_row(int y);
  void fill_row();

  MeanShiftParams params_;
  ImageU8 input_;
  MutableImageU8 output_;
  MeanShiftStatus status_ = MeanShiftStatus::kIdle;
  int x_px_ = 0;  ///< cursor: the pixel whose trajectory is next
  int y_px_ = 0;
  bool by_words_ = false;
  int packed_rows_ = 0;  ///< of the image, from the top
  /// [row % kRing][column]: the pixel of that row in the uppermost byte, the three below it in the others.
  std::uint32_t words_[kRing][cfg::kImageWidth] = {};
};

}  // namespace cairn
