/// How high and how tilted the rover is, by the ground that it sees and the heights that the map carries.
///
/// Surface points of one frame that no boulder claims, as they lie in `map` by the pose that is known,
/// against the bilinear surface between the map's posts there: a point at (dx, dy) from the rover stands
///     r = h(x, y) - z = e_z + a_x dy - a_y dx
/// too low, where e_z is what the rover's height lacks and a what its attitude does, R_true = exp(a) R. Least
/// squares over all points, the outlying ones robustly less (weight (1 + e^2 / (3 sigma)^2)^-2, five rounds).
///
/// What it is uncertain by, beside the points' own noise:
///   roughness    the ground off the map's surface: alike within a square of posts, counted once in it
///   disparities  all off by one bias: a lean along the view. Exact, as a vector of covariance 1
///   place        x, y off by sigma on sloping ground
///   common       what the map's heights are off near each other: all by the same, and leaning by as much
///                over `common_reach_m`, since an elevation model's errors are no wider
/// and where points scatter by more than expected, their share grows by as much.
///
/// A tile whose CRC does not hold, whose heights contradict themselves or are missing has no points.
///
/// Cost. Units: a tile's place, 256 bytes of its CRC, a row of posts, one round of the fit.
#pragma once

#include "core/fixed_vector.hpp"
#include "core/nodiscard.hpp"
#include "geometry/pose3.hpp"
#include "labeling/evidence.hpp"
#include "orbital_map/orbital_map.hpp"

namespace cairn {

struct GroundHeightParams {
  double probe_sigma_px = cfg::kProbeSigma_px;
  double bias_px = 0.1;            ///< sigma of what all disparities of a frame are off by
  double common_reach_m = 10.0;    ///< how far errors of the map's heights are alike
  double common_tilt_rad = 0.001;  ///< what disparities make of a tilt in common, all frames alike
  int min_points = 40;
};

enum class CAIRN_NODISCARD GroundHeightStatus : std::uint8_t {
  kIdle,
  kRunning,
  kFitted,
  kNoHeights,  ///< the map has none, or too few of them there, or there are too few points
};

/// What height and attitude lack: z, a_x, a_y in `map`.
struct GroundOffset {
  Vec3 offset = Vec3(0.0, 0.0, 0.0);
  Mat3 covariance = Mat3::Identity();
  Vec3 least = Vec3(0.0, 0.0, 0.0);  ///< sigmas, of it, that all measurements share: they average out in none
  int points = 0;
};

class GroundHeightJob {
 public:
  static constexpr std::size_t kMaxPoints = 120;
  static constexpr std::uint32_t kStartOps = 40 * kMaxPoints;  ///< of start(), which the caller books
  static constexpr std::uint32_t kTileOps = 10;
  static constexpr std::uint32_t kRowOps = 12 * cmap::kMaxPosts + 20 * kMaxPoints;
  static constexpr std::uint32_t kRoundOps = 40 * kMaxPoints;

  /// Copies what it needs of the points; the map's bytes are borrowed until done. `T_map_rover` and the
  /// points are of one frame, `T_map_site` carries the latter into `map`. Cost: kStartOps.
  GroundHeightStatus start(const GroundHeightParams& params, const OrbitalMap& map,
                           const SurfacePoints& points, const Pose3& T_map_site, const Vec3& rover_map_m,
                           double sigma_xy_m);
  Progress step(WorkBudget& budget);
  GroundHeightStatus status() const { return status_; }
  const GroundOffset& result() const { return result_; }

 private:
  enum class Phase : std::uint8_t { kTile, kCrc, kRow, kFit };
  struct Point {
    Vec3 d_m = Vec3(0.0, 0.0, 0.0);  ///< from the rover
    double lack_m = 0.0;             ///< r
    double sigma_m = 0.0;            ///< of its height, by its disparity
    bool known = false;
  };

  std::uint32_t unit_ops() const;
  void unit();
  void tile();
  void crc();
  void row();
  void take_between_rows();
  void next_tile();
  void weigh();
  void round();

  GroundHeightParams params_;
  GroundHeightStatus status_ = GroundHeightStatus::kIdle;
  Phase phase_ = Phase::kTile;
  OrbitalMap map_;
  Vec3 rover_map_m_ = Vec3(0.0, 0.0, 0.0);
  double sigma_xy_m_ = 0.0;
  OrbitalMap::Span columns_;
  OrbitalMap::Span rows_;
  std::uint32_t column_ = 0;
  std::uint32_t row_ = 0;
  MapTile tile_;
  std::uint32_t cursor_ = 0;  ///< byte of the tile, then its row of posts
  std::uint32_t crc_ = 0;
  cmap::HeightDecoder decoder_;
  cmap::Post posts_[cmap::kMaxPosts];
  cmap::Post before_[cmap::kMaxPosts];  ///< the row south of it
  FixedVector<Point, kMaxPoints> points_;
  double rough_m2_ = 0.0;  ///< variance of a point, by the ground's roughness
  int round_ = 0;
  GroundOffset result_;
};

}  // namespace cairn
