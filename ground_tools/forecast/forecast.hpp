/// Where along a planned drive fixes will succeed, and how good they will be. A closed model, no images; why
/// it is as it is: doc/DESIGN.md, "The forecast".
///
/// At each fix of the schedule (forecast/sweep.hpp: when, and what ground its local map covers):
///
/// 1. Boulder i of the map in the footprint is found with q_i = c_i d(D_i) (forecast/detection.hpp).
/// 2. The number k of true boulders in the local map is Poisson-binomial over them (base/event_count.hpp).
///    Beside them are `clutter_per_m2` times the ground swept others, as they are on average. Whether they
///    prove the pose is the verdict's own question, answered in closed form (forecast/proof.hpp) for the
///    density of the map around there and for the covariance that the fix finds: as the prior is wider, more
///    is needed. Once a fix was applied the track is confirmed, and the verdict asks for less; that counts
///    with the probability of it.
/// 3. Given that, i is a true pair with w_i = q_i P(k without i >= n - 1) / P(k >= n), n the fewest that
///    pass in half of the cases. These make the information matrix of x, y and yaw. The variance of a pair
///    is that of the verdict's covariance: its own, weighed against its parameter's with ten degrees of it.
/// 4. Errors of x, y, yaw and of the rates of scale and turn grow and shrink as in localizer/pose_fusion.hpp.
///    What is carried on is the covariance over both outcomes: applied P_after + (1 - applied) P_before.
///    What all boulders of a map share (`sigma_common_m`) is one of them.
/// 5. The fix is right where the pose after it is within `right_within_m` of truth: the Gaussian of P_after
///    over that disc.
///
/// All of 1 to 3 is a mean over the drives that there may be (kShiftNodes).
///
/// Not in it: relief that hides boulders, frames that VO or the boulder search lose, ground that repeats
/// itself (ambiguous, chance agreement), errors larger than their sigma.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "base/boulder_table.hpp"
#include "forecast/detection.hpp"
#include "forecast/sweep.hpp"
#include "localizer/pose_fusion.hpp"
#include "orbital_map/cmap_format.hpp"
#include "registration/verdict.hpp"

namespace cairn::ground {

struct ForecastModel {
  StereoRig rig;  ///< with T_rover_cam
  double max_range_m = cfg::kMission.boulder_max_range_m;
  double map_window_radius_m = cfg::kMission.map_window_radius_m;  ///< over which density is taken
  TrackParams tracks;
  double window_m = 0.0;           ///< of way, where landmarks serve the map; 0: the tracks' window
  double footprint_sigma_m = 0.0;  ///< that landmarks have for it, beside range and drift, on an axis
  double rock_half_m = 0.0;        ///< of the curve for what the map has not; 0: that of what it has
  EvidenceParams evidence;
  VerdictParams verdict;
  double track_log_odds = cfg::kMission.track_log_odds;
  double same_within_m = cfg::kMission.icp_gate_final_m;  ///< a ground boulder and the map's, of campaigns
  FusionParams fusion;
  DetectionCurve detection;
  double clutter_per_m2 = 0.0;    ///< of the swept ground: local boulders that are none of the map's, and
                                  ///< not for its resolution
  double sigma_pair_m = 0.022;    ///< of a right pair, per axis; the flight module's own where that is larger
  double sigma_common_m = 0.017;  ///< per axis, of what all boulders of a map have in common: its shift
  double sigma_start_xy_m = 0.05;
  double sigma_start_yaw_rad = 0.01;
  double right_within_m = 0.15;
  double blind_below = 0.5;
};

/// The mission's rig, and what drives told of maps of that method (doc/RESULTS.md tells which
/// drives): the defaults above are of the shadow-aware detector, and taken for tables, too. Where the mission
/// keeps landmarks for maps of such pixels, the model is theirs: lengths go with the pixel.
ForecastModel mission_model(cmap::Method method = cmap::Method::kShadow, double pixel_m = 0.0);

/// A Gaussian in the plane: standard deviations along its axes, and where the longer one points,
/// counter-clockwise from east, in (-pi/2, pi/2].
struct Ellipse {
  double major_m = 0.0;
  double minor_m = 0.0;
  double azimuth_rad = 0.0;
};
Ellipse ellipse_of(const Mat2& covariance_m2);
/// Probability that a draw from it lies within `radius_m` of its middle.
double within_disc(const Ellipse& ellipse, double radius_m);

/// Standard deviations of a pose, in the rover's axes.
struct PoseSigma {
  double along_m = 0.0;
  double across_m = 0.0;
  double yaw_rad = 0.0;
  bool lost = false;  ///< larger than the map, or than half a turn: the numbers mean nothing more
};

struct FixStation {
  PathPoint at;           ///< where the local map is taken
  std::size_t frame = 0;  ///< of the drive
  int boulders = 0;       ///< of the map, in the footprint
  double found = 0.0;     ///< of them, expected
  double clutter = 0.0;   ///< and others, expected
  double per_m2 = 0.0;    ///< of the map's boulders around there
  double needed = 0.0;    ///< fewest true boulders that prove the pose in 98 cases of 100
  double lever_m = 0.0;   ///< rms distance of the true ones from their mean, expected
  double applied = 0.0;   ///< probability of a fix that is applied
  double right = 0.0;     ///< and that leaves the pose right
  PoseSigma before;       ///< of the error that the fix finds, whatever became of those before it
  PoseSigma after;     ///< of the error that it leaves where it is applied; that before it where it cannot be
  Ellipse ellipse;     ///< the same for x and y, in the map
  bool blind = false;  ///< applied < blind_below
};

/// A stretch without a fix to count on: from the last station that is not blind, or the start, to the next,
/// or the end.
struct BlindStretch {
  std::size_t first_frame = 0;
  std::size_t last_frame = 0;
  double from_m = 0.0;  ///< arc length
  double to_m = 0.0;
  PoseSigma at_end;  ///< of the error by then
};

struct Forecast {
  std::vector<FixStation> stations;
  std::vector<BlindStretch> blind;
  PoseSigma at_end;
};

/// The model for a map: of landmarks, where they serve its pixel and the model is not theirs yet; what the
/// map is too coarse for is added to the clutter (forecast/unmapped.hpp).
ForecastModel model_for(const ForecastModel& model, const std::vector<TableBoulder>& boulders,
                        const MapExtent& extent, double pixel_m = 0.0);

/// Sigma of a pair on an axis, as the flight module takes it for these boulders of the map at frame `last`.
double claimed_sigma_m(const ForecastModel& model, const Sweep& sweep, const std::vector<PathPoint>& drive,
                       std::size_t last, const std::vector<TableBoulder>& footprint);

/// Takes the model as it stands. Asks for at least one frame. `done` is told the share of the drive.
Forecast forecast(const ForecastModel& model, const std::vector<TableBoulder>& boulders,
                  const std::vector<PathPoint>& drive, const std::function<void(double)>& done = {});

}  // namespace cairn::ground
