/// Large boulders over the last tens of metres of way, for maps whose pixels are so coarse that they hold no
/// others: a map of 25 cm a pixel has none below 0.6 m or so, one in fifty square metres, where the sliding
/// window of boulder_tracks.hpp sees two of them. (adr/0014-landmarks.md)
///
/// What a survey of the relief (labeling/relief.hpp) shows near the rover takes the place of what is known
/// there: the relief holds all views of this passage, so its word on a boulder is not averaged with what it
/// said before but replaces it. A boulder keeps its number while it is found within `same_m`, or two fifths
/// of its diameter, of where it was. What is no longer found where it should be is forgotten: it was a part
/// of another, or nothing. Boulders that the rover has left behind stay as they were seen last.
///
/// Error of a boulder's place, on an axis, against the rover now: that of its footprint, and what odometry
/// drifts meanwhile, with `way` driven since it was seen:
///   sigma^2 = own^2 + (range_share nearest)^2 + noise^2 way + (drift_share way)^2
/// with `nearest` the range from which it was seen best: from afar less of its top is in view, and stereo's
/// depth is worse. So boulders far behind weigh less, and a local map that is bent is not taken for one
/// that is not.
///
/// What is offered. A map's smallest boulders are some `least_px` pixels wide; smaller landmarks are clutter.
/// A cell of the relief is a boulder's where one point of it is, and stereo's windows smear its rims: it
/// looks wider by `rims_m`.
/// Not offered either: those with more than `max_open` of the rim that faces the rover not seen yet.
///
/// What a fix is made of. All that is offered goes into the proof, but each landmark moves the pose by what
/// no fix has been told of it yet. Landmarks stay for the whole window, so that otherwise the same few would
/// be believed at every fix, the later the more. With `told` the information of a pair, 1 / (own^2 + pair^2),
/// at the fix that it was most at, the share of it that is fresh is 1 - told / now: seen from nearer, its own
/// place is known better, but where the map has it is as far off as it was.
///
/// Lengths that are a matter of how large the boulders are go with the relief's cell.
///
/// Frame `site`. Cost: a boulder of a survey 6 operations a landmark.
#pragma once

#include <cstdint>

#include "geometry/boulder.hpp"
#include "labeling/relief.hpp"

namespace cairn {

struct LandmarkParams {
  double least_pixel_m = cfg::kMission.landmark_least_pixel_m;  ///< finer maps are matched by the window
  double window_m = cfg::kMission.landmark_window_m;            ///< of way
  double least_px = 2.4;
  double same_m = 4.0 * cfg::kMission.relief_cell_m;
  double min_diameter_m = 2.8 * cfg::kMission.relief_cell_m;  ///< smaller ones are not kept
  double max_open = 0.5;
  double noise_m = cfg::kMission.drift_noise_xy_m;  ///< of one metre of way
  double range_share = 0.012;
  double rims_m = 1.6 * cfg::kMission.relief_cell_m;
  double drift_share = 0.004;
  /// Of VerdictParams::view_log: few are in view, and those that a map leaves out stand together. At 100 to
  /// 1, as of the window, one right fix in 300 was taken for a slip.
  double view_nats = 9.2;
  double pixel_share = 0.4;   ///< error of a boulder's place in the map, on an axis, pixels
  double common_share = 0.4;  ///< what all of them have of it in common: sunlit sides, a shift of the image
  /// What all landmarks have in common, on an axis: the side that they were seen from, windows that smear.
  double common_own_m = 0.5 * cfg::kMission.relief_cell_m;
};

class Landmarks {
 public:
  static constexpr std::uint32_t take_ops(std::size_t landmarks) {
    return 60U + 6U * static_cast<std::uint32_t>(landmarks);
  }

  void init(const LandmarkParams& params);
  void clear();  ///< numbers go on
  /// A map of such pixels is matched by landmarks; 0: a table, whose pixel nobody knows.
  bool serve(double pixel_m) const { return params_.least_pixel_m > 0.0 && pixel_m >= params_.least_pixel_m; }
  /// Takes in a survey (borrowed until done) about the rover. What lies within `radius_m` of it should be in
  /// the survey, if it was seen within the last `fresh_m` of way.
  void start(const Relief::Boulders& survey, const Vec2& rover_site_m, double way_m, double radius_m,
             double fresh_m);
  Progress step(WorkBudget& budget);
  bool open() const { return survey_ != nullptr; }
  /// A fix by a map of such pixels was made of those that are no longer fresh.
  void used(const LocalMap& local, double pixel_m);
  /// Those that a map of such pixels can hold.
  void build(double pixel_m, double way_m, LocalMap& out) const;
  /// Of a pair with such a map, beside the landmark's own error.
  double sigma_pair_m(double pixel_m) const { return params_.pixel_share * pixel_m; }
  double common_m(double pixel_m) const;  ///< of all pairs with it
  std::size_t size() const { return landmarks_.size(); }
  std::uint32_t created() const { return next_id_; }

 private:
  struct Landmark {
    ReliefBoulder seen;
    double nearest_m = 0.0;
    std::uint32_t id = 0;
    std::uint16_t surveys = 0;
    bool found = false;  ///< in this survey
    double told = 0.0;   ///< 1/m2, the most that a fix took it for; 0: none was made of it
  };
  double information(const LocalBoulder& b, double pixel_m) const;
  void take(const ReliefBoulder& b);
  void conclude();

  LandmarkParams params_;
  const Relief::Boulders* survey_ = nullptr;
  Vec2 rover_site_m_ = Vec2(0.0, 0.0);
  double way_m_ = 0.0;
  double radius_m_ = 0.0;
  double fresh_m_ = 0.0;
  std::size_t cursor_ = 0;
  std::uint32_t next_id_ = 0;
  FixedVector<Landmark, cfg::kMaxLandmarks> landmarks_;
};

}  // namespace cairn
