#include "campaign/trial_forecast.hpp"

#include <algorithm>
#include <cmath>

#include "base/number_table.hpp"
#include "base/output_file.hpp"
#include "base/statistics.hpp"
#include "campaign/trial_table.hpp"
#include "cmap/cmap_file.hpp"
#include "forecast/unmapped.hpp"
#include "schedule.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

constexpr double kCell_m = 0.1;  // of the swept ground

/// Frames from the snapshot of a fix to its correction.
constexpr std::size_t kFramesToApply = cfg::kFixDueMinor - cfg::kFixBeginMinor;

std::vector<ForecastFix> fixes_of(const Forecast& made, const CsvTable& table, std::uint64_t seed) {
  std::map<std::size_t, const FixStation*> stations;
  for (const FixStation& s : made.stations) stations[s.frame + kFramesToApply] = &s;
  std::vector<ForecastFix> fixes;
  const std::size_t frame = table.column("frame"), vo = table.column("vo"), status = table.column("status");
  const std::size_t after = table.column("after_m"), sigma = table.column("sigma_xy_m");
  for (std::size_t row = 0; row < table.size(); ++row) {
    const auto at = stations.find(static_cast<std::size_t>(table.number(row, frame)));
    if (at == stations.end()) continue;
    ForecastFix fix;
    fix.seed = seed;
    fix.vo = table.word(row, vo);
    fix.forecast = *at->second;
    fix.applied = table.word(row, status) == "applied";
    fix.after_m = table.any_number(row, after);
    fix.verdict = judge_fix(fix.applied, fix.after_m, table.any_number(row, sigma));
    fixes.push_back(fix);
  }
  return fixes;
}

/// Each local boulder goes to the nearest boulder of the map within the gate, and each of those keeps the
/// nearest: as the registration pairs them, at the true pose.
class Pairing {
 public:
  Pairing(const std::vector<Vec2>& map_m, const std::vector<Vec2>& local_m, double gate_m)
      : of_map_(map_m.size(), -1) {
    for (std::size_t l = 0; l < local_m.size(); ++l) {
      int nearest = -1;
      double best = gate_m;
      for (std::size_t m = 0; m < map_m.size(); ++m) {
        const double distance = (map_m[m] - local_m[l]).norm();
        if (distance > best) continue;
        best = distance;
        nearest = static_cast<int>(m);
      }
      if (nearest < 0) {
        alone_.push_back(l);
        continue;
      }
      int& kept = of_map_[static_cast<std::size_t>(nearest)];
      const auto far = [&](int k) {
        return (local_m[static_cast<std::size_t>(k)] - map_m[static_cast<std::size_t>(nearest)]).norm();
      };
      if (kept < 0 || best < far(kept)) kept = static_cast<int>(l);
    }
  }

  int local_of(std::size_t map) const { return of_map_[map]; }  ///< -1: none
  const std::vector<std::size_t>& alone() const { return alone_; }

 private:
  std::vector<int> of_map_;
  std::vector<std::size_t> alone_;
};

/// The standard deviation of the Gaussian with this median of sizes.
double robust_sigma(std::vector<double> values, double otherwise) {
  if (values.empty()) return otherwise;
  for (double& v : values) v = std::fabs(v);
  return median(values) / 0.67448975;
}

}  // namespace

DriveEvidence evidence_of(const ForecastModel& model, const std::vector<TableBoulder>& boulders,
                          const std::vector<PathPoint>& drive, const LocalMaps& snapshots) {
  const Sweep sweep(model.rig, model.max_range_m, model.tracks, model.window_m);
  const double gate_m = model.same_within_m;
  DriveEvidence evidence;
  std::vector<Vec2> residuals_m;
  std::vector<Vec2> map_m;
  for (const TableBoulder& b : boulders) map_m.push_back(b.p_map_m);
  const auto far_from_map = [&](const Vec2& p) {
    return std::none_of(map_m.begin(), map_m.end(), [&](const Vec2& m) { return (m - p).norm() <= gate_m; });
  };
  std::map<std::size_t, double> free_m2;
  for (const auto& [key, local_m] : snapshots) {
    const std::size_t last = key.second;
    if (last >= drive.size()) continue;
    if (free_m2.find(last) == free_m2.end()) {
      const std::vector<Vec2> spots = sweep.spots(drive, last, kCell_m);
      free_m2[last] =
          kCell_m * kCell_m * static_cast<double>(std::count_if(spots.begin(), spots.end(), far_from_map));
    }
    evidence.swept_m2 += free_m2[last];
    const Pairing pairing(map_m, local_m, gate_m);
    evidence.clutter += pairing.alone().size();
    for (std::size_t m = 0; m < map_m.size(); ++m) {
      if (!sweep.in_footprint(drive, last, map_m[m])) continue;
      const int local = pairing.local_of(m);
      evidence.looks.push_back({boulders[m].diameter_m, boulders[m].confidence, 0.0, local >= 0});
      if (local >= 0) residuals_m.push_back(local_m[static_cast<std::size_t>(local)] - map_m[m]);
    }
  }
  // Medians, since a part of the pairs is by chance.
  if (residuals_m.size() < 10) return evidence;
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double> along;
    for (const Vec2& r : residuals_m) along.push_back(r[axis]);
    const double common_m = median(along);
    evidence.common_m.push_back(common_m);
    for (const double r : along) evidence.pair_m.push_back(r - common_m);
  }
  return evidence;
}

std::optional<TrialForecast> forecast_trial(const ForecastModel& model, const fs::path& folder,
                                            std::uint64_t seed) {
  std::error_code ignored;
  for (const char* file : {"scene.toml", "site.cmap", "fixes.csv"}) {
    if (!fs::exists(folder / file, ignored)) return std::nullopt;
  }
  const fs::path map_file = folder / "site.cmap";
  const CmapContent map = decode_cmap(read_file(map_file), map_file.string());
  const std::vector<PathPoint> drive = sim::plan(sim::load_scene(folder / "scene.toml"));
  TrialForecast trial;
  const CsvTable fixes(folder / "fixes.csv", kMendTrial);
  trial.fixes = fixes_of(
      forecast(model_for(model, map.boulders, map.extent, map.pixel_m), map.boulders, drive), fixes, seed);
  if (!fs::exists(folder / "seen.csv", ignored)) return trial;
  LocalMaps snapshots;
  for (std::size_t row = 0; row < fixes.size(); ++row) {
    const auto frame = static_cast<std::size_t>(fixes.number(row, fixes.column("frame")));
    if (frame < kFramesToApply) continue;
    snapshots[{std::string(fixes.word(row, fixes.column("vo"))), frame - kFramesToApply}];
  }
  const CsvTable seen(folder / "seen.csv", kMendTrial);
  const std::size_t vo = seen.column("vo"), snapshot = seen.column("snapshot");
  const std::size_t x = seen.column("x_m"), y = seen.column("y_m");
  for (std::size_t row = 0; row < seen.size(); ++row) {
    const auto at = static_cast<std::size_t>(seen.number(row, snapshot));
    snapshots[{std::string(seen.word(row, vo)), at}].emplace_back(seen.number(row, x), seen.number(row, y));
  }
  trial.evidence = evidence_of(model, map.boulders, drive, snapshots);
  trial.evidence.boulders = map.boulders;
  trial.evidence.extent = map.extent;
  return trial;
}

ForecastModel fitted(const ForecastModel& model, const std::vector<TrialForecast>& trials) {
  ForecastModel fit = model;
  std::vector<std::vector<Look>> looks;
  std::vector<double> pair_m;
  double common_squares = 0.0;
  double commons = 0.0;
  const double gate_m2 = kPi * model.same_within_m * model.same_within_m;
  for (const TrialForecast& t : trials) {
    const DriveEvidence& e = t.evidence;
    if (e.looks.empty() || !(e.swept_m2 > 0.0)) continue;
    looks.push_back(e.looks);
    const double clutter_per_m2 = static_cast<double>(e.clutter) / e.swept_m2;
    for (Look& look : looks.back()) look.by_chance = 1.0 - std::exp(-clutter_per_m2 * gate_m2);
    pair_m.insert(pair_m.end(), e.pair_m.begin(), e.pair_m.end());
    for (const double c : e.common_m) common_squares += c * c;
    commons += static_cast<double>(e.common_m.size());
  }
  if (looks.empty()) return fit;
  fit.detection = fit_detection(looks).curve;
  // What is left of the clutter when each map's resolution has had its share.
  double swept_m2 = 0.0;
  double clutter = 0.0;
  for (const TrialForecast& t : trials) {
    const DriveEvidence& e = t.evidence;
    swept_m2 += e.swept_m2;
    clutter +=
        static_cast<double>(e.clutter) - e.swept_m2 * unmapped_per_m2(e.boulders, e.extent, fit.detection);
  }
  fit.clutter_per_m2 = std::max(0.0, clutter / swept_m2);
  fit.sigma_pair_m = robust_sigma(pair_m, model.sigma_pair_m);
  if (commons > 0.0) fit.sigma_common_m = std::sqrt(common_squares / commons);
  return fit;
}

}  // namespace cairn::ground
