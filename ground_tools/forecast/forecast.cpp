#include "forecast/forecast.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <string_view>

#include "app/flight_app.hpp"
#include "base/event_count.hpp"
#include "forecast/proof.hpp"
#include "forecast/unmapped.hpp"
#include "localizer/landmarks.hpp"

namespace cairn::ground {
namespace {

constexpr double kSure = 0.98;             // of FixStation::needed
constexpr double kSpotCell_m = 0.25;       // of the swept ground
constexpr double kLongSpotCell_m = 1.0;    // of that of landmarks, tens of metres long
constexpr double kVarianceFreedom = 10.0;  // of the pairs' variance in the verdict's covariance

/// The error of localizer/pose_fusion.hpp, of which the covariance alone is carried:
/// a forecast knows no corrections.
class ErrorForecast {
 public:
  explicit ErrorForecast(const ForecastModel& model) : params_(model.fusion) {
    params_.common_xy_m = model.sigma_common_m;
    P_ = errors_at_start(params_, model.sigma_start_xy_m, model.sigma_start_yaw_rad);
  }

  const ErrorCovariance& covariance() const { return P_; }

  void drive(const PathPoint& from, const PathPoint& to) {
    PlanarStep step;
    step.d_map_m = Vec2(to.x_m - from.x_m, to.y_m - from.y_m);
    step.turn_rad = wrap_angle(to.yaw_rad - from.yaw_rad);
    P_ = grown(P_, growth(params_, step));
  }

  /// After a fix that is applied and whose boulders tell `information` of x, y and yaw, `fresh` of it what no
  /// fix before has told.
  ErrorCovariance fixed(const Mat3& information, double fresh) const {
    const Mat3 known = information * fresh + Mat3::Identity() * kNothing;
    return updated(P_, Vec3(0.0, 0.0, 0.0), known.inverse()).P;
  }

  /// Over both outcomes, of which `after` has the given probability.
  void mix(double probability, const ErrorCovariance& after) {
    P_ = probability * after + (1.0 - probability) * P_;
  }

 private:
  static constexpr double kNothing = 1e-6;  // so that no information is a measurement, too

  FusionParams params_;
  ErrorCovariance P_;
};

/// `size_m` is that of the map: 0 where it holds nothing.
PoseSigma sigma_of(const ErrorCovariance& P, double heading_rad, double size_m) {
  const Vec2 along(std::cos(heading_rad), std::sin(heading_rad));
  const Vec2 across(-along.y(), along.x());
  const Mat2 xy = P.topLeftCorner<2, 2>();
  PoseSigma sigma{std::sqrt(along.dot(xy * along)), std::sqrt(across.dot(xy * across)), std::sqrt(P(2, 2))};
  sigma.lost = sigma.yaw_rad > kPi || (size_m > 0.0 && std::hypot(sigma.along_m, sigma.across_m) > size_m);
  return sigma;
}

/// Those that any frame of the drive can have in view.
std::vector<TableBoulder> near_drive(const std::vector<TableBoulder>& boulders,
                                     const std::vector<PathPoint>& drive, double reach_m) {
  MapExtent box{drive[0].x_m, drive[0].y_m, drive[0].x_m, drive[0].y_m};
  for (const PathPoint& p : drive) {
    box = {std::min(box.min_x_m, p.x_m), std::min(box.min_y_m, p.y_m), std::max(box.max_x_m, p.x_m),
           std::max(box.max_y_m, p.y_m)};
  }
  std::vector<TableBoulder> near;
  std::copy_if(boulders.begin(), boulders.end(), std::back_inserter(near),
               [&](const TableBoulder& b) { return box.contains(b.p_map_m, -reach_m); });
  return near;
}

/// What the verdict asks for at a station.
struct Demand {
  ProofCase proof;         ///< but for the radius
  double needed = 0.0;     ///< nats, of a track that no fix has confirmed
  double confirmed = 0.0;  ///< probability that one has
};

/// The true boulders that a fix may come to in a drive of some shift (forecast/detection.hpp).
class TrueOnes {
 public:
  TrueOnes(const ForecastModel& model, const PathPoint& at, const std::vector<TableBoulder>& footprint,
           double shift)
      : model_(model) {
    for (const TableBoulder& b : footprint) {
      places_m_.push_back(b.p_map_m - Vec2(at.x_m, at.y_m));
      found_.push_back(std::clamp(b.confidence, 0.0, 1.0) * model.detection(b.diameter_m, shift));
    }
  }

  double found() const { return std::accumulate(found_.begin(), found_.end(), 0.0); }

  double lever_m() const {
    const double sum = found();
    if (!(sum > 0.0)) return 0.0;
    Vec2 mean(0.0, 0.0);
    for (std::size_t i = 0; i < found_.size(); ++i) mean += found_[i] / sum * places_m_[i];
    double squares = 0.0;
    for (std::size_t i = 0; i < found_.size(); ++i)
      squares += found_[i] * (places_m_[i] - mean).squaredNorm();
    return std::sqrt(squares / sum);
  }

  /// Probability of a proof.
  double proved(const Proof& proof, const Demand& demand) const {
    const std::vector<double> counts = distribution(found_);
    double sum = 0.0;
    for (std::size_t k = 2; k < counts.size(); ++k) {
      sum += counts[k] * ((1.0 - demand.confirmed) * proof.passes(k, demand.needed) +
                          demand.confirmed * proof.passes(k, demand.needed - model_.track_log_odds));
    }
    return sum;
  }

  /// On x, y and yaw, by the true pairs of a fix that is applied; `fewest` of them at least. `claimed_m`:
  /// sigma of a pair, as the verdict takes it.
  Mat3 information(std::size_t fewest, double claimed_m) const {
    const std::vector<double> right = given_at_least(found_, std::min(fewest, found_.size()));
    const double pairs = std::accumulate(right.begin(), right.end(), 0.0);
    const double claimed = std::pow(claimed_m, 2);
    const double variance =
        (kVarianceFreedom * claimed + pairs * std::pow(model_.sigma_pair_m, 2)) / (kVarianceFreedom + pairs);
    Mat3 sum = Mat3::Zero();
    for (std::size_t i = 0; i < right.size(); ++i) {
      const Vec2& d = places_m_[i];
      Mat3 of_one;
      of_one << 1.0, 0.0, -d.y(), 0.0, 1.0, d.x(), -d.y(), d.x(), d.squaredNorm();
      sum += right[i] / std::clamp(variance, 0.25 * claimed, 9.0 * claimed) * of_one;
    }
    return sum;
  }

 private:
  const ForecastModel& model_;
  std::vector<Vec2> places_m_;  ///< about the rover, map axes
  std::vector<double> found_;
};

/// Over the drives that there may be. Returns the information of an applied fix.
Mat3 weigh_boulders(const ForecastModel& model, const std::vector<TableBoulder>& footprint,
                    const Demand& demand, FixStation& station) {
  Mat3 information = Mat3::Zero();
  const double likely = demand.needed - (demand.confirmed > 0.5 ? model.track_log_odds : 0.0);
  for (const ShiftNode& node : kShiftNodes) {
    const TrueOnes ones(model, station.at, footprint, node.shift);
    const double lever_m = ones.lever_m();
    station.found += node.weight * ones.found();
    station.lever_m += node.weight * lever_m;
    if (!(lever_m > 0.0)) continue;
    ProofCase of = demand.proof;
    of.rms_radius_m = lever_m;
    const Proof proof(of);
    const double proved = ones.proved(proof, demand);
    station.applied += node.weight * proved;
    information += node.weight * proved * ones.information(proof.fewest(likely, 0.5), of.sigma_m);
    station.needed += node.weight * static_cast<double>(proof.fewest(likely, kSure));
  }
  station.boulders = static_cast<int>(footprint.size());
  if (station.applied > 0.0) information /= station.applied;
  return information;
}

/// Of the boulders expected in a local map, the share that no fix before has had: those that came into view
/// after the frame `previous` of the last one.
double fresh_share_of(const Sweep& sweep, const std::vector<PathPoint>& drive, std::size_t previous,
                      std::size_t last, const std::vector<TableBoulder>& footprint,
                      const DetectionCurve& detection) {
  double all = 0.0;
  double fresh = 0.0;
  for (const TableBoulder& b : footprint) {
    const double found = b.confidence * detection(b.diameter_m);
    bool seen = false;
    for (std::size_t frame = sweep.first_of_window(drive, last); frame <= previous && !seen; ++frame)
      seen = sweep.in_view(drive[frame], b.p_map_m);
    all += found;
    fresh += seen ? 0.0 : found;
  }
  constexpr double kLeastShare = 0.05;
  return all > 0.0 ? std::max(kLeastShare, fresh / all) : 1.0;
}

/// Boulders a square metre within `radius_m`, the ground cut to the box of all boulders.
double density_at(const std::vector<TableBoulder>& boulders, const MapExtent& box, const PathPoint& at,
                  double radius_m) {
  const Vec2 p(at.x_m, at.y_m);
  double count = 1.0;
  for (const TableBoulder& b : boulders) count += (b.p_map_m - p).norm() <= radius_m ? 1.0 : 0.0;
  const auto side = [&](double middle, double low, double high) {
    return std::max(0.0, std::min(middle + radius_m, high) - std::max(middle - radius_m, low));
  };
  const double share = side(p.x(), box.min_x_m, box.max_x_m) * side(p.y(), box.min_y_m, box.max_y_m) /
                       (4.0 * radius_m * radius_m);
  return count / (kPi * radius_m * radius_m * std::max(share, 0.05));
}

std::vector<BlindStretch> blind_stretches(const Forecast& made, const std::vector<PathPoint>& drive) {
  std::vector<BlindStretch> all;
  BlindStretch open;
  bool is_open = false;
  const auto close = [&](std::size_t frame, const PoseSigma& sigma) {
    if (!is_open) return;
    open.last_frame = frame;
    open.from_m = drive[open.first_frame].arc_m;
    open.to_m = drive[frame].arc_m;
    open.at_end = sigma;
    all.push_back(open);
    is_open = false;
  };
  std::size_t last_good = 0;
  for (const FixStation& s : made.stations) {
    if (s.blind) {
      if (!is_open) open.first_frame = last_good;
      is_open = true;
      continue;
    }
    close(s.frame, s.before);
    last_good = s.frame;
  }
  if (made.stations.empty()) is_open = true;
  close(drive.size() - 1, made.at_end);
  return all;
}

bool landmarks_serve(double pixel_m) {
  return cfg::kHaveLandmarks && pixel_m >= cfg::kMission.landmark_least_pixel_m;
}

/// What drives told of a rig's landmarks (doc/RESULTS.md, "Forecasts").
struct LandmarkFit {
  DetectionCurve found;  ///< lengths in pixels of the map
  double rock_px;        ///< half of the rocks of that size are offered, the map has them or not
  double footprint_cells;
};
constexpr LandmarkFit kMastFit{{0.9, 2.4, 8.0, 0.8}, 3.2, 1.2};
constexpr LandmarkFit kDroneFit{{0.75, 2.8, 8.0, 0.4}, 2.2, 1.6};

/// On maps of such pixels. Decoys, of few boulders, hardly ever decide, so that the verdict's calibration
/// counts in full.
void serve_by_landmarks(double pixel_m, ForecastModel& model) {
  const LandmarkParams landmarks;
  const LandmarkFit& fit = std::string_view(cfg::kMission.name) == "drone" ? kDroneFit : kMastFit;
  model.window_m = landmarks.window_m;
  model.max_range_m = cfg::kMission.relief_range_m;
  model.tracks.min_sightings = 1;  // the relief holds what any frame shows
  model.detection = fit.found;
  model.detection.half_m *= pixel_m;
  model.rock_half_m = fit.rock_px * pixel_m;
  model.sigma_common_m = std::hypot(landmarks.common_share * pixel_m, landmarks.common_own_m);
  model.evidence.sigma_pair_m = landmarks.pixel_share * pixel_m;
  model.footprint_sigma_m = fit.footprint_cells * cfg::kMission.relief_cell_m;
  model.sigma_pair_m = std::hypot(landmarks.pixel_share * pixel_m, cfg::kMission.relief_cell_m);
  model.verdict.ln_threshold -= model.verdict.calibration;
}

}  // namespace

ForecastModel mission_model(cmap::Method method, double pixel_m) {
  ForecastModel model;
  model.rig = app::mission_rig();
  if (landmarks_serve(pixel_m)) {
    serve_by_landmarks(pixel_m, model);
    return model;
  }
  if (method == cmap::Method::kOtsu) {
    // Blobs are shadows, moved and of another size, and many are none of boulders.
    model.detection = {0.68, 0.086, 6.3, 1.09};
    model.clutter_per_m2 = 0.10;
    model.sigma_pair_m = 0.025;
    model.sigma_common_m = 0.03;
  }
  return model;
}

Ellipse ellipse_of(const Mat2& covariance_m2) {
  const double mean = 0.5 * (covariance_m2(0, 0) + covariance_m2(1, 1));
  const double half = 0.5 * (covariance_m2(0, 0) - covariance_m2(1, 1));
  const double cross = covariance_m2(0, 1);
  const double spread = std::hypot(half, cross);
  return {std::sqrt(mean + spread), std::sqrt(std::max(0.0, mean - spread)), 0.5 * std::atan2(cross, half)};
}

/// Over the directions: in the direction u the density of |draw| is Rayleigh's with s^-2 = u' C^-1 u. The
/// trapezoid rule converges fast, the integrand being periodic; in the ellipse's own angle,
/// draw = (major cos t, minor sin t) r, the directions are uniform, and it stays smooth for a thin ellipse.
double within_disc(const Ellipse& ellipse, double radius_m) {
  constexpr int kSteps = 256;
  double outside = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double t = 2.0 * kPi * i / kSteps;
    const double x = ellipse.major_m * std::cos(t);
    const double y = ellipse.minor_m * std::sin(t);
    const double squared = x * x + y * y;
    if (squared > 0.0) outside += std::exp(-0.5 * radius_m * radius_m / squared);
  }
  return 1.0 - outside / kSteps;
}

/// Of landmarks as Landmarks::build has it, in the mean square.
double claimed_sigma_m(const ForecastModel& model, const Sweep& sweep, const std::vector<PathPoint>& drive,
                       std::size_t last, const std::vector<TableBoulder>& footprint) {
  if (model.window_m == 0.0 || footprint.empty()) return model.evidence.sigma_pair_m;
  const LandmarkParams landmarks;
  double squares = 0.0;
  for (const TableBoulder& b : footprint) {
    const SpotView view = sweep.view_of(drive, last, b.p_map_m);
    const double since_m = drive[last].arc_m - view.last_arc_m;
    squares += std::pow(landmarks.range_share * view.nearest_m, 2) +
               std::pow(landmarks.noise_m, 2) * since_m + std::pow(landmarks.drift_share * since_m, 2);
  }
  return std::hypot(model.evidence.sigma_pair_m, model.footprint_sigma_m,
                    std::sqrt(squares / static_cast<double>(footprint.size())));
}

ForecastModel model_for(const ForecastModel& model, const std::vector<TableBoulder>& boulders,
                        const MapExtent& extent, double pixel_m) {
  ForecastModel adapted = model;
  if (adapted.window_m == 0.0 && landmarks_serve(pixel_m)) serve_by_landmarks(pixel_m, adapted);
  DetectionCurve of_rocks = adapted.detection;
  if (adapted.rock_half_m > 0.0) of_rocks.half_m = adapted.rock_half_m;
  adapted.clutter_per_m2 += unmapped_per_m2(boulders, extent, of_rocks);
  return adapted;
}

Forecast forecast(const ForecastModel& model, const std::vector<TableBoulder>& boulders,
                  const std::vector<PathPoint>& drive, const std::function<void(double)>& done) {
  CAIRN_ASSERT(!drive.empty());
  const Sweep sweep(model.rig, model.max_range_m, model.tracks, model.window_m);
  const double spot_m = model.window_m > 0.0 ? kLongSpotCell_m : kSpotCell_m;
  const std::vector<TableBoulder> near = near_drive(boulders, drive, sweep.reach_m());
  const MapExtent box = extent_of(boulders);
  const double size_m = std::hypot(box.max_x_m - box.min_x_m, box.max_y_m - box.min_y_m);
  Forecast made;
  ErrorForecast error(model);
  double never_fixed = 1.0;
  std::size_t frame = 0;
  for (const std::size_t last : fix_frames(drive.size())) {
    if (done) done(static_cast<double>(last) / static_cast<double>(drive.size()));
    for (; frame < last; ++frame) error.drive(drive[frame], drive[frame + 1]);
    FixStation station;
    station.at = drive[last];
    station.frame = last;
    std::vector<TableBoulder> footprint;
    std::copy_if(near.begin(), near.end(), std::back_inserter(footprint), [&](const TableBoulder& b) {
      // What a side of the picture cuts is seldom offered as a landmark.
      const double whole_m = model.window_m > 0.0 ? 0.5 * b.diameter_m : 0.0;
      return sweep.in_footprint(drive, last, b.p_map_m, whole_m);
    });
    const ErrorCovariance& before = error.covariance();
    station.per_m2 = density_at(boulders, box, station.at, model.map_window_radius_m);
    station.clutter =
        model.clutter_per_m2 * spot_m * spot_m * static_cast<double>(sweep.spots(drive, last, spot_m).size());
    Demand demand;
    demand.proof.per_m2 = station.per_m2;
    demand.proof.sigma_m = claimed_sigma_m(model, sweep, drive, last, footprint);
    demand.proof.error_m = model.sigma_pair_m;
    demand.proof.clutter = station.clutter;
    demand.proof.log_volume = log_volume_of(before.topLeftCorner<3, 3>(), station.per_m2);
    demand.needed = model.verdict.ln_threshold;
    demand.confirmed = 1.0 - never_fixed;
    const Mat3 information = weigh_boulders(model, footprint, demand, station);
    never_fixed *= 1.0 - station.applied;
    station.before = sigma_of(before, station.at.yaw_rad, size_m);
    station.blind = !(station.applied >= model.blind_below);
    const double fresh = made.stations.empty() ? 1.0
                                               : fresh_share_of(sweep, drive, made.stations.back().frame,
                                                                last, footprint, model.detection);
    const ErrorCovariance after = station.applied > 0.0 ? error.fixed(information, fresh) : before;
    station.after = sigma_of(after, station.at.yaw_rad, size_m);
    station.ellipse = ellipse_of(after.topLeftCorner<2, 2>());
    station.right = station.applied * within_disc(station.ellipse, model.right_within_m);
    error.mix(station.applied, after);
    made.stations.push_back(station);
  }
  for (; frame + 1 < drive.size(); ++frame) error.drive(drive[frame], drive[frame + 1]);
  made.at_end = sigma_of(error.covariance(), drive.back().yaw_rad, size_m);
  made.blind = blind_stretches(made, drive);
  return made;
}

}  // namespace cairn::ground
