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
/// Only the grey value of a mode is kept. Regions are delineated on the pixel lattice by neighbours with
/// agreeing modes (region_map.hpp), to which the place of a mode adds nothing. Trajectories do not adopt
/// the modes of pixels that they step on ("basins of attraction"): with these bandwidths one takes 1.2 to 2
/// iterations, so that adoption was measured to save at most a tenth of the time, at the cost of exactness
/// and of independence between pixels.
///
/// Integer arithmetic only. Cost: (2 hs + 1)^2 operations an iteration, at most `max_iterations` of them a
/// pixel.
#pragma once

#include <cstdint>

#include "core/work_budget.hpp"
#include "image/image_view.hpp"

namespace cairn {

struct MeanShiftParams {
  int spatial_radius_px = 3;   ///< hs, 1 to 32, pixels of the image given
  int range_radius_grey = 16;  ///< hr, 1 to 255, grey levels
  int max_iterations = 5;      ///< 1 to 100
  int convergence = 1;  ///< 0 or more: a trajectory rests when (x, y) stays or |dx| + |dy| + dg^2 <= this
};

enum class [[nodiscard]] MeanShiftStatus : std::uint8_t{
    kIdle,      ///< never started
    kRunning,   ///< call step() again
    kDone,      ///< the output is whole
    kBadInput,  ///< an empty view, views of different sizes, or a parameter out of its range
};

/// One iteration of one trajectory is the unit of work. Both views are borrowed until the job is done; they
/// must not overlap (a trajectory reads the input behind the scan).
class MeanShiftJob {
 public:
  MeanShiftStatus start(const MeanShiftParams& params, const ImageU8& input, const MutableImageU8& output);
  Progress step(WorkBudget& budget);
  MeanShiftStatus status() const { return status_; }

 private:
  bool iterate();
  void shift();

  struct Point {
    int x = 0;
    int y = 0;
    int grey = 0;
  };

  MeanShiftParams params_;
  ImageU8 input_;
  MutableImageU8 output_;
  MeanShiftStatus status_ = MeanShiftStatus::kIdle;
  int x_px_ = 0;  ///< cursor: the pixel whose trajectory is under way
  int y_px_ = 0;
  int iteration_ = 0;
  Point at_;
};

}  // namespace cairn
