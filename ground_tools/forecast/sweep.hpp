/// Which ground the cameras have swept when a fix is begun: the footprint of the local map.
///
/// The ground is taken as flat and the rover as level. A spot is in view in a frame where both images show it
/// and it lies no farther from the left camera, seen from above, than boulders are looked for. It is in the
/// footprint of a fix where that was so in `min_sightings` frames or more of the local map's window: of
/// frames, or, where landmarks serve the map (localizer/landmarks.hpp), of way.
#pragma once

#include <cstddef>
#include <vector>

#include "core/trig.hpp"
#include "geometry/stereo_rig.hpp"
#include "localizer/boulder_tracks.hpp"
#include "sim/traverse.hpp"

namespace cairn::ground {

using sim::PathPoint;

/// What of a way is drawn and not driven: a way taken from a drive has its points some centimetres off.
inline constexpr double kWayWidth_m = 0.03;
/// A smaller angle between two legs is steered in driving: the chords of a curve of 5 m radius, 2 m apart,
/// have 23 degrees between them.
inline constexpr double kSteeredRad = 25.0 * kRadPerDeg;

/// The frames of a drive over way-points: along straight legs that pass within kWayWidth_m of each, so that
/// it does not matter how densely a way is drawn. The rover steers through angles up to kSteeredRad, and
/// turns in place at larger ones; there the frames begin anew, as the simulator's do (sim::plan). Asks for
/// two points or more, the first two not the same.
std::vector<PathPoint> drive_over(const std::vector<Vec2>& waypoints_map_m, double step_m,
                                  double turn_step_deg);

/// Where in the schedule (mission_cfg/schedule.hpp) a fix is begun; every fix of a drive of `frames` frames.
std::vector<std::size_t> fix_frames(std::size_t frames);

/// Of a spot, over the frames of the window that show it.
struct SpotView {
  int frames = 0;
  double nearest_m = 0.0;   ///< from the rover, and ...
  double last_arc_m = 0.0;  ///< ... where it was in view last; 0: never
};

class Sweep {
 public:
  /// `window_m` 0: the tracks' window.
  Sweep(const StereoRig& rig, double max_range_m, const TrackParams& tracks, double window_m = 0.0);

  /// With its near rim and those to both sides, where a radius is given.
  bool in_view(const PathPoint& at, const Vec2& p_map_m, double radius_m = 0.0) const;
  /// In the window that ends with frame `last`.
  SpotView view_of(const std::vector<PathPoint>& drive, std::size_t last, const Vec2& p_map_m,
                   double radius_m = 0.0) const;
  bool in_footprint(const std::vector<PathPoint>& drive, std::size_t last, const Vec2& p_map_m,
                    double radius_m = 0.0) const {
    return view_of(drive, last, p_map_m, radius_m).frames >= tracks_.min_sightings;
  }
  std::size_t first_of_window(const std::vector<PathPoint>& drive, std::size_t last) const;
  /// Nothing farther than this from the rover is in view.
  double reach_m() const { return reach_m_; }
  /// Spots of a square grid in the footprint, each for cell_m^2 of ground.
  std::vector<Vec2> spots(const std::vector<PathPoint>& drive, std::size_t last, double cell_m) const;

 private:
  bool in_pictures(const Vec2& p_rover_m) const;

  StereoRig rig_;
  Pose3 T_cam_rover_;
  double max_range_m_;
  double reach_m_;
  TrackParams tracks_;
  double window_m_;
};

}  // namespace cairn::ground
