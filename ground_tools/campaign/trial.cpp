#include "campaign/trial.hpp"

#include <chrono>
#include <cmath>
#include <optional>

#include "base/interrupts.hpp"
#include "base/output_file.hpp"
#include "base/statistics.hpp"
#include "base/tool_error.hpp"
#include "campaign/local_maps.hpp"
#include "cmap/cmap_file.hpp"
#include "core/assert.hpp"
#include "detect/map_build.hpp"
#include "ortho/raster.hpp"
#include "ortho/raster_source.hpp"
#include "replay/summary.hpp"
#include "sim/orthoimage.hpp"
#include "sim/simulated_drive.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

/// A simulated drive that remembers its images.
class KeptDrive : public Drive {
 public:
  explicit KeptDrive(const sim::World& world, const std::string& name)
      : drive_(world, name), images_(drive_.size()) {}

  std::string name() const override { return drive_.name(); }
  const StereoRig& rig() const override { return drive_.rig(); }
  std::size_t size() const override { return drive_.size(); }
  FrameTag tag(std::size_t index) const override { return drive_.tag(index); }
  PairImages images(std::size_t index) const override {
    PairImages& kept = images_.at(index);
    if (kept.left.pixels.empty()) kept = drive_.images(index);
    return kept;
  }
  std::optional<Pose3> truth_cam(std::size_t index) const override { return drive_.truth_cam(index); }
  std::optional<Pose3> truth_rover(std::size_t index) const override { return drive_.truth_rover(index); }
  const std::vector<TruthRock>& truth_rocks() const override { return drive_.truth_rocks(); }

 private:
  sim::SimulatedDrive drive_;
  mutable std::vector<PairImages> images_;
};

/// What a trial that was stopped may have left: an orthoimage, whole or not.
void remove_orthoimages(const fs::path& folder) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    if (entry.path().filename().string().rfind("ortho_", 0) == 0) fs::remove(entry.path(), ignored);
  }
}

/// A map of the trial, and the folder that tells of it.
struct TrialMap {
  fs::path folder;
  double pixel_m = 0.0;
  std::vector<std::uint8_t> bytes;
  double boulders = 0.0;
};

/// The trial's own map first.
std::vector<TrialMap> maps_of(const Trial& trial, const fs::path& folder, bool coarser) {
  std::vector<TrialMap> maps(1);
  maps[0].folder = folder;
  maps[0].pixel_m = trial.setup.map_pixel_m;
  if (!coarser) return maps;
  for (const int times : kCoarser) {
    const double pixel_m = times * trial.setup.map_pixel_m;
    if (pixel_m > kCoarsest_m) break;
    TrialMap map;
    map.folder = folder / coarser_name(times);
    map.pixel_m = pixel_m;
    maps.push_back(map);
  }
  return maps;
}

/// Maps as the ground segment makes them by default: the images' labels tell where the sun stood.
void make_maps(const sim::World& world, const fs::path& folder, bool keep_ortho, std::vector<TrialMap>& maps,
               const ShareDone& progress) {
  std::vector<sim::OrthoProduct> products;
  for (const TrialMap& map : maps) products.push_back({folder / sim::ortho_name(map.pixel_m), map.pixel_m});
  sim::write_orthoimages(world, products, [&](double share) { progress(0.8 * share); });
  const MpiRanks alone;
  for (TrialMap& map : maps) {
    const std::unique_ptr<RasterSource> image = open_orthoimage(folder / sim::ortho_name(map.pixel_m), 0);
    const RasterFacts& facts = image->facts();
    CAIRN_ASSERT(facts.sun.has_value());
    Detection detection;
    detection.method = cmap::Method::kShadow;
    detection.sun = *facts.sun;
    MapBuild build(*image, detection, BuildSettings(), alone);
    const std::vector<TableBoulder> found = build.run();
    map.boulders = static_cast<double>(found.size());
    CmapSource source;
    source.method = detection.method;
    source.pixel_m = map.pixel_m;
    source.parameters = to_text(detection);
    source.reference_system = facts.reference_system;
    map.bytes = encode_cmap(found, extent_of(facts.geo, facts.width, facts.height),
                            suitable_quantum_m(map.pixel_m), source);
    make_folder(map.folder);
    write_file(map.folder / "site.cmap", {reinterpret_cast<const char*>(map.bytes.data()), map.bytes.size()});
  }
  progress(1.0);
  if (!keep_ortho) remove_orthoimages(folder);
}

RunFigures figures_of(const RunErrors& errors, const std::vector<JudgedFix>& fixes) {
  const TrajectoryErrors& vo = *errors.vo;
  const TrajectoryErrors& corrected = *errors.corrected;
  RunFigures f;
  f.vo_end_xy_m = vo.end.xy_m;
  f.vo_end_xy_percent = vo.percent_of_path(vo.end.xy_m);
  f.vo_end_3d_percent = vo.percent_of_path(vo.end.xyz_m);
  f.vo_end_yaw_deg = vo.end.yaw_deg;
  f.end_xy_m = corrected.end.xy_m;
  f.largest_xy_m = corrected.largest_xy.xy_m;
  f.end_yaw_deg = corrected.end.yaw_deg;
  f.excess_over_vo_m = largest_excess(vo, corrected);
  std::vector<double> after_m;
  for (const JudgedFix& fix : fixes) {
    f.fixes[static_cast<std::size_t>(fix.verdict)] += 1.0;
    if (fix.verdict != FixVerdict::kDeclined) after_m.push_back(fix.after_m);
  }
  f.median_fix_error_m = median_of(after_m).value;
  return f;
}

/// Both replays with a map; fills the trial's figures and writes the map's folder.
void replay_over(const Drive& drive, const TrialMap& map, Trial& trial, const ShareDone& progress,
                 const std::function<void()>& next) {
  ReplayOptions options;
  options.map = map.bytes;
  std::string csv = kFixColumns;
  std::string seen = kSeenColumns;
  const auto replay = [&](const char* vo, RunFigures& figures) {
    SnapshotKeeper keeper(drive);
    options.watch = [&](const ReplayFrame& frame, const host::Picture&) { keeper.watch(frame); };
    const Replay run = run_replay(drive, options, progress);
    const RunErrors errors = errors_of(run);
    if (!errors.vo || !errors.corrected) {
      throw ToolError("{}: the flight module reported no pose; see whether cairn run takes this scene",
                      drive.name());
    }
    const std::vector<JudgedFix> fixes = judge_fixes(run, drive);
    figures = figures_of(errors, fixes);
    csv += to_csv_rows(fixes, vo);
    seen += to_csv_rows(keeper.snapshots(), vo);
    trial.frames = static_cast<double>(run.frames.size());
    trial.path_m = errors.vo->path_m;
    next();
  };
  replay("as_it_is", trial.as_it_is);
  options.trim = trial.setup.worse();
  replay("worse", trial.worse);
  write_file(map.folder / "scene.toml", sim::to_toml(trial.setup.scene));
  write_file(map.folder / "fixes.csv", csv);
  write_file(map.folder / "seen.csv", seen);
}

}  // namespace

void run_trial(Trial& trial, const fs::path& folder, const TrialOptions& wanted,
               const std::function<void(double)>& progress) {
  const auto begun = std::chrono::steady_clock::now();
  std::optional<Unfinished> unfinished;  // a trial counts whole
  if (!fs::exists(folder)) unfinished.emplace(folder);
  make_folder(folder);
  remove_orthoimages(folder);
  const fs::path scene_file = folder / "scene.toml";
  write_file(scene_file, sim::to_toml(trial.setup.scene));
  const sim::World world(sim::load_scene(scene_file));
  const KeptDrive drive(world, scene_file.string());

  // Shares of the time, as measured: maps, the first replay with the rendering, and all others.
  constexpr double kMapped = 0.3;
  constexpr double kDriven = 0.9;
  std::vector<TrialMap> maps = maps_of(trial, folder, wanted.coarser_maps);
  make_maps(world, folder, wanted.keep_ortho, maps, [&](double share) { progress(kMapped * share); });
  trial.map_boulders = maps[0].boulders;
  double from = kMapped;
  double to = kDriven;
  const double each = (1.0 - kDriven) / static_cast<double>(2 * maps.size() - 1);
  for (const TrialMap& map : maps) {
    Trial of_map = trial;
    replay_over(
        drive, map, of_map, [&](double share) { progress(from + (to - from) * share); },
        [&] {
          from = to;
          to += each;
        });
    if (&map == &maps[0]) trial = of_map;
  }
  if (!wanted.troubles.empty()) {
    const std::vector<TroubledRun> runs =
        run_troubles(drive, maps[0].bytes, trial.setup.seed, wanted.troubles,
                     [&](double share) { progress(1.0 - 0.05 * (1.0 - share)); });
    write_file(folder / "troubles.csv", to_csv(runs));
  }
  trial.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

}  // namespace cairn::ground
