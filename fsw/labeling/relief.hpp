/// Large boulders by what stands above the ground, seen from above, as an orbiter sees them.
///
/// The surface points of many frames are laid in a grid in `site`: each cell keeps the weighted mean of the
/// heights in it, weight 1 / (s0^2 + (s1 range^2)^2), so that near views, which are the best placed, overrule
/// far ones, and what one view hides another fills in. No boulder need be whole in any picture, nor of one
/// grey; the grid knows what it has not seen.
///
/// A survey of the grid about the rover. In blocks of 8 x 8 cells the mean of the cells below the block's
/// mean tells how low it lies; a plane through 5 x 5 blocks, one-sided and robust (labeling/plane_fit.hpp),
/// is the ground of the middle one. Cells that stand `min_height_m` above it and touch are one boulder.
///
/// Where its centre is. The far side of a boulder is hidden until the rover is past it, and the mean of what
/// is seen lies on the near side, by a fifth to a third of the boulder. What is seen whole is the near edge
/// and the width across the line of sight; boulders are about as deep as they are wide. So with u the mean
/// direction that its cells were seen along, m their mean, w the width across u, d the depth seen:
///     centre = m + (max(w, min(d, deepest w)) - d) / 2 along u,
/// which is the near edge and half the depth. Width and depth are four standard deviations of the cells, as
/// of a disc, and not from rim to rim: stereo's windows smear rims, mostly on the hidden side, and what
/// smears both ways takes from m what it gives to d. What of d is beyond `deepest` w is ground that the
/// boulder hides, over which windows carried its top. A cell weighs W / (W + half_told) with what it was
/// told, W. Errors: that of a rim, half a cell; along, beside it a twentieth of the depth, and
/// `depth_share` of what of it was not seen but taken to be there. Cut. Where much of the rim that faces the
/// rover borders on cells never seen, the boulder may go on there: `open_share` tells how much of it. Cells
/// that were never seen but at a side of the picture, as the rover passed, are where that side cuts it: of
/// the diameter, `cut_share` for each share of such cells is what its centre may be off.
///
/// Frame: `site`, z up, metres. Cells are addressed modulo the grid's side, and each knows which place it
/// stands for, so that nothing is moved as the rover drives. A cell seen again after `stale_m` of way starts
/// anew: meanwhile odometry has drifted.
///
/// A mission's cell says how large the boulders are that are looked for, half a pixel of the maps or so, and
/// other lengths go with it.
///
/// Memory: 21 bytes a cell. Cost: 40 operations a point; a survey some 60 a cell.
#pragma once

#include <cstdint>

#include "core/eigen.hpp"
#include "core/fixed_vector.hpp"
#include "core/nodiscard.hpp"
#include "core/work_budget.hpp"
#include "labeling/plane_fit.hpp"
#include "mission_cfg.hpp"

namespace cairn {

struct ReliefParams {
  double cell_m = cfg::kMission.relief_cell_m;
  double max_range_m = cfg::kMission.relief_range_m;  ///< farther points are left out
  double min_height_m = cfg::kMission.relief_min_height_m;
  double near_sigma_m = 0.24 * cfg::kMission.relief_cell_m;  ///< s0
  /// s1: a quarter of a pixel of disparity, as depth.
  double sigma_per_range2 = 0.25 / (cfg::kMission.fx_px * cfg::kMission.baseline_m);
  double plane_scale_m = 0.4 * cfg::kMission.relief_cell_m;  ///< roughness of ground, from block to block
  double stale_m = 30.0;
  int min_cells = 6;
  double half_told = 2000.0;  ///< two points from five metres
  double depth_share = 0.3;
  double cut_share = 2.5;
  double deepest = 1.6;  ///< widths; 0.22 to 0.15 m of error along the view at k = 0.30
};

/// What stands above the ground at one place.
struct ReliefBoulder {
  Vec2 p_site_m = Vec2(0.0, 0.0);  ///< centre of the footprint
  Vec2 view = Vec2(1.0, 0.0);      ///< unit: from the rover to it, mean over what is seen of it
  double z_site_m = 0.0;           ///< mean of its cells
  double height_m = 0.0;           ///< of its highest cell above the ground
  double diameter_m = 0.0;         ///< of the disc of its area, the hidden part counted as taken to be there
  double sigma_m = 0.0;            ///< of the centre, on an axis
  double range_m = 0.0;            ///< from the centre of the survey
  double open_share = 0.0;         ///< of the rim that faces the rover: borders on what was never seen
  double way_m = 0.0;              ///< when one of its cells was seen last
  int cells = 0;
};

struct ReliefCell {
  float height_m = 0.0F;
  float weight = 0.0F;  ///< 0: nothing seen
  float view_x = 0.0F;
  float view_y = 0.0F;
  /// Way when it was seen last, in steps of 5 cm; but the lowest bit: whether it was ever seen away from the
  /// sides of a picture.
  std::uint16_t way_inside = 0;
  std::uint8_t tile_x = 0;  ///< which of the places that share the cell
  std::uint8_t tile_y = 0;
};
/// 8 x 8 cells: how low they lie, then the ground there.
struct ReliefBlock {
  float low_m = 0.0F;
  float a = 0.0F;
  float b = 0.0F;
  float c = 0.0F;
  bool seen = false;
  bool ground = false;
};
enum class ReliefMark : std::uint8_t { kUnseen, kGround, kRaised, kTaken };

/// The grid, which outlives the Relief that works on it. `side`: a power of two, 8 to 256.
struct ReliefGrid {
  std::uint32_t side = 0;
  ReliefCell* cells = nullptr;    ///< side x side
  ReliefMark* marks = nullptr;    ///< the same
  ReliefBlock* blocks = nullptr;  ///< (side / 8)^2
};
template <std::uint32_t Side>
struct ReliefStorage {
  static_assert(Side >= 8 && Side <= 256 && (Side & (Side - 1)) == 0, "a power of two, 8 to 256");
  ReliefCell cells[Side * Side];
  ReliefMark marks[Side * Side] = {};
  ReliefBlock blocks[Side / 8 * (Side / 8)];
  ReliefGrid grid() { return {Side, cells, marks, blocks}; }
};

class Relief {
 public:
  static constexpr std::uint32_t kBlock = 8;       ///< cells of a block's side
  static constexpr double kSurveyCells = 12.0;     ///< of way, from one survey to the next
  static constexpr std::size_t kMaxBoulders = 96;  ///< of a survey
  static constexpr std::size_t kMaxCells = 1024;   ///< of a boulder
  static constexpr std::uint32_t kAddOps = 40;
  static constexpr std::uint32_t kLowOps = 20 * kBlock * kBlock;
  static constexpr std::uint32_t kPlaneOps = 25 * 8 * 22 + 400;
  static constexpr std::uint32_t mark_ops(std::uint32_t side) { return 14U * side; }
  static constexpr std::uint32_t scan_ops(std::uint32_t side) { return 4U * side; }
  static constexpr std::size_t kFlood = 32;  ///< cells of a unit
  static constexpr std::uint32_t kFloodOps = 80 * kFlood;
  static constexpr std::size_t kExtent = 96;
  static constexpr std::uint32_t kExtentOps = 45 * kExtent + 200;
  using Boulders = FixedVector<ReliefBoulder, kMaxBoulders>;

  void init(const ReliefParams& params, const ReliefGrid& grid);
  void clear();
  /// A point of the surface, `ray_m` from the camera, in axes of `site`; `way_m`: driven so far; `inside`:
  /// not at a side of the picture. Not while a survey is under way.
  void add(const Vec3& p_site_m, const Vec3& ray_m, double way_m, bool inside);
  /// About the rover, who has driven `way_m`.
  void start(const Vec2& centre_site_m, double way_m);
  Progress step(WorkBudget& budget);  ///< the same for every slicing
  bool surveying() const { return phase_ != Phase::kIdle; }
  const Boulders& result() const { return boulders_; }
  std::uint32_t dropped() const { return dropped_; }            ///< boulders without room, or too large
  const Vec2& centre_site_m() const { return centre_site_m_; }  ///< of the last survey
  double way_m() const { return way_m_; }                       ///< then
  double stale_m() const { return params_.stale_m; }
  /// Half of the ground that a plane is fitted to: what is wider may as well be a swell, and is dropped.
  double widest_m() const { return 0.5 * 5.0 * kBlock * params_.cell_m; }
  /// What stands so near is in a survey whole.
  double sure_m() const {
    return 0.5 * (grid_.side - kBlock) * params_.cell_m - kSurveyCells * params_.cell_m;
  }

 private:
  enum class Phase : std::uint8_t { kIdle, kLows, kPlanes, kMark, kScan, kFlood, kExtent };
  using Mark = ReliefMark;
  struct Sums {
    double x = 0.0;
    double y = 0.0;
    double z = 0.0;
    double view_x = 0.0;
    double view_y = 0.0;
    double top_m = 0.0;
    std::uint32_t age = 0;  ///< steps of 5 cm
  };
  /// Sums along the view and across it, and of the rim that faces the rover.
  struct Extents {
    double w = 0.0;
    double a = 0.0;
    double c = 0.0;
    double aa = 0.0;
    double cc = 0.0;
    int open = 0;
    int front = 0;
    int cut = 0;

    void add(double weight, double along, double across) {
      w += weight;
      a += weight * along;
      c += weight * across;
      aa += weight * along * along;
      cc += weight * across * across;
    }
  };

  std::uint32_t blocks() const { return grid_.side / kBlock; }  ///< of the grid's side
  std::uint8_t tile_of(std::uint32_t index) const { return static_cast<std::uint8_t>(index / grid_.side); }
  ReliefCell& cell_of(std::uint32_t ix, std::uint32_t iy) const;
  const ReliefCell* cell_at(std::uint32_t wx, std::uint32_t wy) const;
  std::uint32_t unit_ops() const;
  void unit();
  void low();
  void plane();
  void mark();
  void scan();
  void flood();
  void take(std::uint32_t wx, std::uint32_t wy);
  void extent();
  void describe();
  double x_of(std::uint32_t wx) const;
  double y_of(std::uint32_t wy) const;
  double height(std::uint32_t wx, std::uint32_t wy, const ReliefCell& cell) const;

  ReliefParams params_;
  ReliefGrid grid_;
  Phase phase_ = Phase::kIdle;
  std::uint32_t origin_x_ = 0;  ///< of the survey's window, cells
  std::uint32_t origin_y_ = 0;
  Vec2 centre_site_m_ = Vec2(0.0, 0.0);
  double way_m_ = 0.0;
  std::uint16_t now_ = 0;  ///< the same, as ReliefCell::way_inside has it
  std::uint32_t cursor_ = 0;
  std::uint32_t scan_ = 0;
  std::size_t head_ = 0;  ///< of the flood, in list_
  bool too_large_ = false;
  Sums sums_;
  Vec2 mean_ = Vec2(0.0, 0.0);
  Vec2 u_ = Vec2(1.0, 0.0);
  Extents extents_;
  Boulders boulders_;
  std::uint32_t dropped_ = 0;
  FixedVector<std::uint16_t, kMaxCells> list_;  ///< cells of the boulder at hand, in the window
};

}  // namespace cairn
