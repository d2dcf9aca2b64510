#include "forecast/forecast.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "app/flight_app.hpp"
#include "base/event_count.hpp"
#include "forecast/unmapped.hpp"

namespace cairn::ground {
namespace {

/// p/A of registration/icp.hpp: how much smaller the mean square of the kept residuals is than that of all.
double trimming_loss(double trimmed) {
  const double kept = 1.0 - trimmed;
  return trimmed > 0.0 ? kept / (kept + trimmed * std::log(trimmed)) : 1.0;
}

/// The error of localizer/pose_fusion.hpp, of which the covariance alone is carried:
/// a forecast knows no corrections.
class ErrorForecast {
 public:
  explicit ErrorForecast(const ForecastModel& model)
      : params_(model.fusion),
        fresh_(std::min(1.0, static_cast<double>(cfg::kMinorFrames) / model.tracks.window_frames)) {
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

  /// After a fix that is applied and whose boulders tell `information` of x, y and yaw.
  ErrorCovariance fixed(const Mat3& information, bool first) const {
    const Mat3 known = information * (first ? 1.0 : fresh_) + Mat3::Identity() * kNothing;
    return updated(P_, Vec3(0.0, 0.0, 0.0), known.inverse()).P;
  }

  /// Over both outcomes, of which `after` has the given probability.
  void mix(double probability, const ErrorCovariance& after) {
    P_ = probability * after + (1.0 - probability) * P_;
  }

 private:
  static constexpr double kNothing = 1e-6;  // so that no information is a measurement, too

  FusionParams params_;
  double fresh_;  ///< of a local map, what the fix before did not use
  ErrorCovariance P_;
};

PoseSigma sigma_of(const ErrorCovariance& P, double heading_rad) {
  const Vec2 along(std::cos(heading_rad), std::sin(heading_rad));
  const Vec2 across(-along.y(), along.x());
  const Mat2 xy = P.topLeftCorner<2, 2>();
  return {std::sqrt(along.dot(xy * along)), std::sqrt(across.dot(xy * across)), std::sqrt(P(2, 2))};
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

/// The pairs that a fix may come to in a drive of some shift (forecast/detection.hpp),
/// and what they are worth.
class Pairs {
 public:
  Pairs(const ForecastModel& model, const PathPoint& at, const std::vector<TableBoulder>& footprint,
        double shift)
      : model_(model) {
    const double gate_m = model.icp.gate_final_m;
    const double by_chance = 1.0 - std::exp(-model.clutter_per_m2 * kPi * gate_m * gate_m);
    for (const TableBoulder& b : footprint) {
      const double found = std::clamp(b.confidence, 0.0, 1.0) * model.detection(b.diameter_m, shift);
      places_m_.push_back(b.p_map_m - Vec2(at.x_m, at.y_m));
      found_.push_back(found);
      paired_.push_back(1.0 - (1.0 - found) * (1.0 - by_chance));
    }
    right_ = given_at_least(paired_, fewest_pairs(model.icp));
    for (std::size_t i = 0; i < right_.size(); ++i)
      right_[i] *= paired_[i] > 0.0 ? found_[i] / paired_[i] : 0.0;
  }

  double found() const { return std::accumulate(found_.begin(), found_.end(), 0.0); }
  double paired() const { return std::accumulate(paired_.begin(), paired_.end(), 0.0); }

  /// Of the right pairs, expected.
  double lever_m() const {
    double sum = 0.0;
    Vec2 mean(0.0, 0.0);
    for (std::size_t i = 0; i < right_.size(); ++i) {
      sum += right_[i];
      mean += right_[i] * places_m_[i];
    }
    if (!(sum > 0.0)) return 0.0;
    mean /= sum;
    double squares = 0.0;
    for (std::size_t i = 0; i < right_.size(); ++i)
      squares += right_[i] * (places_m_[i] - mean).squaredNorm();
    return std::sqrt(squares / sum);
  }

  double enough() const {
    return lever_m() >= model_.icp.min_lever_m ? at_least(paired_, fewest_pairs(model_.icp)) : 0.0;
  }

  /// On x, y and yaw, by the right pairs of a fix that is applied.
  Mat3 information() const {
    const double sigma_m = std::max(model_.sigma_pair_m, model_.icp.sigma_pair_m);
    const double kept = 1.0 - model_.icp.trim_fraction;
    const double each = kept / (sigma_m * sigma_m * trimming_loss(model_.icp.trim_fraction));
    Mat3 sum = Mat3::Zero();
    for (std::size_t i = 0; i < right_.size(); ++i) {
      const Vec2& d = places_m_[i];
      Mat3 of_one;
      of_one << 1.0, 0.0, -d.y(), 0.0, 1.0, d.x(), -d.y(), d.x(), d.squaredNorm();
      sum += each * right_[i] * of_one;
    }
    return sum;
  }

 private:
  const ForecastModel& model_;
  std::vector<Vec2> places_m_;  ///< about the rover, map axes
  std::vector<double> found_;
  std::vector<double> paired_;
  std::vector<double> right_;  ///< given that the fix is applied
};

/// Over the drives that there may be. Returns the information of an applied fix.
Mat3 weigh_pairs(const ForecastModel& model, const std::vector<TableBoulder>& footprint,
                 FixStation& station) {
  Mat3 information = Mat3::Zero();
  for (const ShiftNode& node : kShiftNodes) {
    const Pairs pairs(model, station.at, footprint, node.shift);
    const double enough = pairs.enough();
    station.found += node.weight * pairs.found();
    station.pairs += node.weight * pairs.paired();
    station.lever_m += node.weight * pairs.lever_m();
    station.enough += node.weight * enough;
    information += node.weight * enough * pairs.information();
  }
  station.boulders = static_cast<int>(footprint.size());
  if (station.enough > 0.0) information /= station.enough;
  return information;
}

/// Of what a fix finds: the pose's error and what the map's boulders have in common.
Mat2 offset_of_fix(const ErrorCovariance& P) {
  const Mat2 cross = P.block<2, 2>(0, 5);
  return P.topLeftCorner<2, 2>() + P.block<2, 2>(5, 5) + cross + cross.transpose();
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

}  // namespace

ForecastModel mission_model(cmap::Method method) {
  ForecastModel model;
  model.rig = app::mission_rig();
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

std::size_t fewest_pairs(const IcpParams& params) {
  for (int n = params.min_pairs;; ++n) {
    if (n - static_cast<int>(params.trim_fraction * n) >= params.min_pairs)
      return static_cast<std::size_t>(n);
  }
}

ForecastModel model_for(const ForecastModel& model, const std::vector<TableBoulder>& boulders,
                        const MapExtent& extent) {
  ForecastModel adapted = model;
  adapted.clutter_per_m2 += unmapped_per_m2(boulders, extent, model.detection);
  return adapted;
}

Forecast forecast(const ForecastModel& model, const std::vector<TableBoulder>& boulders,
                  const std::vector<PathPoint>& drive) {
  CAIRN_ASSERT(!drive.empty());
  const Sweep sweep(model.rig, model.max_range_m, model.tracks);
  const std::vector<TableBoulder> near = near_drive(boulders, drive, sweep.reach_m());
  Forecast made;
  ErrorForecast error(model);
  std::size_t frame = 0;
  for (const std::size_t last : fix_frames(drive.size())) {
    for (; frame < last; ++frame) error.drive(drive[frame], drive[frame + 1]);
    FixStation station;
    station.at = drive[last];
    station.frame = last;
    std::vector<TableBoulder> footprint;
    std::copy_if(near.begin(), near.end(), std::back_inserter(footprint),
                 [&](const TableBoulder& b) { return sweep.in_footprint(drive, last, b.p_map_m); });
    const Mat3 information = weigh_pairs(model, footprint, station);
    const ErrorCovariance& before = error.covariance();
    station.before = sigma_of(before, station.at.yaw_rad);
    station.caught = within_disc(ellipse_of(offset_of_fix(before)), model.icp.gate_start_m);
    station.applied = station.enough * station.caught;
    station.blind = !(station.applied >= model.blind_below);
    const ErrorCovariance after =
        station.enough > 0.0 ? error.fixed(information, made.stations.empty()) : before;
    station.after = sigma_of(after, station.at.yaw_rad);
    station.ellipse = ellipse_of(after.topLeftCorner<2, 2>());
    station.right = station.applied * within_disc(station.ellipse, model.right_within_m);
    error.mix(station.applied, after);
    made.stations.push_back(station);
  }
  for (; frame + 1 < drive.size(); ++frame) error.drive(drive[frame], drive[frame + 1]);
  made.at_end = sigma_of(error.covariance(), drive.back().yaw_rad);
  made.blind = blind_stretches(made, drive);
  return made;
}

}  // namespace cairn::ground
