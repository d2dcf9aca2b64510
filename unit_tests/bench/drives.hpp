/// Drives of 60 m without images. What flies: boulder tracks, search and verdict (MapFix) on an encoded map,
/// fusion and trust, on the parameters that fly and joined as localizer/localizer.cpp joins them, fixes begun
/// every 30 frames and applied before the next. What is made up: VO's steps, sightings of boulders, the map.
///
/// Errors are drawn from the models that the filter has (localizer/pose_fusion.hpp): k, w and their walks,
/// noise of a metre and of a turn, a shift of the map that comes and goes. `vo_share` makes those of VO
/// smaller, `common_share` that of the map.
///
/// A search is done before the next fix is due, however long it takes: on board one in a dense map is not.
#pragma once

#include <cstdint>
#include <vector>

#include "bench/lost_rover.hpp"
#include "bench/point_sets.hpp"
#include "localizer/boulder_tracks.hpp"
#include "localizer/map_fix.hpp"
#include "localizer/pose_fusion.hpp"
#include "localizer/trust.hpp"

namespace cairn::bench {

struct DriveCase {
  double per_m2 = 1.0;
  double start_error_m = -1.0;  ///< in a direction at random; -1: drawn from start_sigma_m
  double start_sigma_m = 0.05;  ///< as claimed
  double start_sigma_rad = 0.01;
  double slip_m = 0.0;        ///< half way, in a direction at random, that nothing tells of
  double vo_share = 1.0;      ///< of the errors of VO
  double common_share = 1.0;  ///< of the map's shift
  bool coarse = false;        ///< as maps of 25 cm a pixel: pairs and shift of 0.1 m
  std::uint32_t frames = 1000;
};

struct DrivePose {
  double error_m = 0.0;
  double sigma_m = 0.0;  ///< root of the trace of x and y
  double nees2 = 0.0;    ///< squared distance in sigmas, of x and y
  bool lost = false;     ///< trust says so
  bool confirmed = false;
  bool claimed = false;
};

struct DriveResult {
  std::vector<DrivePose> poses;  ///< one a metre, the last one at the end
  int fixes = 0;                 ///< applied
};

class DrivenRover {
 public:
  void drive(const DriveCase& c, std::uint64_t seed, DriveResult& out);

 private:
  struct Rock {
    Vec2 p_map_m;
    std::uint8_t last = 0;              ///< sighting of the frame before, plus 1 ...
    Vec2 last_site_m = Vec2(0.0, 0.0);  ///< ... and where that lay
  };
  void lay(Rng& rng);
  void step(Rng& rng, std::uint32_t frame);
  void look(Rng& rng, std::uint32_t frame);
  void begin_fix(std::uint32_t frame);
  void apply_fix(DriveResult& out);
  void turn_about(const Vec2& pivot_map_m, const Pose2& correction);
  Pose2 T_map_rover() const { return T_map_site_ * T_site_rover_; }
  DrivePose pose() const;

  DriveCase case_;
  FusionParams model_;
  std::vector<Pose2> path_;
  std::vector<Rock> rocks_;  ///< that the rover can see: of the map, and others
  EncodedMap encoded_;
  Pose2 truth_;
  double scale_ = 0.0;
  double turn_rad_per_m_ = 0.0;

  BoulderTracks tracks_;
  LocalMap local_;
  MapFix fix_;
  PoseFusion fusion_;
  TrustState trust_;
  Pose2 T_map_site_;
  Pose2 T_site_rover_;
  Vec2 pivot_map_m_ = Vec2(0.0, 0.0);
  std::uint32_t fix_frame_ = 0;
  std::uint32_t fix_created_ = 0;      ///< tracks, by the snapshot, and ...
  std::uint32_t applied_created_ = 0;  ///< ... by that of the last fix applied
  bool open_ = false;
  bool fix_lost_ = false;
  double against_nats_ = 0.0;
};

}  // namespace cairn::bench
