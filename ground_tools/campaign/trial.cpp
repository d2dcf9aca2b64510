#include "campaign/trial.hpp"

#include <chrono>
#include <cmath>

#include "campaign/local_maps.hpp"
#include "campaign/statistics.hpp"
#include "map/cmap_file.hpp"
#include "map/detector.hpp"
#include "map/raster.hpp"
#include "output_file.hpp"
#include "replay/summary.hpp"
#include "sim/orthoimage.hpp"
#include "sim/simulated_drive.hpp"
#include "tool_error.hpp"

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

/// The paper's detector on an orthoimage of the site; the map's bytes.
std::vector<std::uint8_t> make_map(const sim::World& world, double pixel_m, const fs::path& folder,
                                   bool keep_ortho, double& boulders, const ShareDone& progress) {
  const fs::path path = folder / sim::ortho_name(pixel_m);
  sim::write_orthoimages(world, {{path, pixel_m}}, [&](double share) { progress(0.8 * share); });
  const DetectorParams params;
  const Raster raster = read_orthoimage(path);
  const std::vector<TableBoulder> found =
      detect_boulders(raster, params, [&](double share) { progress(0.8 + 0.2 * share); });
  boulders = static_cast<double>(found.size());
  std::vector<std::uint8_t> map =
      encode_cmap(found, extent_of(raster), suitable_quantum_m(pixel_m),
                  {cmap::Method::kOtsu, pixel_m, to_text(params), raster.reference_system});
  write_file(folder / "site.cmap", {reinterpret_cast<const char*>(map.data()), map.size()});
  if (!keep_ortho) remove_orthoimages(folder);
  return map;
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

}  // namespace

void run_trial(Trial& trial, const fs::path& folder, bool keep_ortho,
               const std::function<void(double)>& progress) {
  const auto begun = std::chrono::steady_clock::now();
  make_folder(folder);
  remove_orthoimages(folder);
  const fs::path scene_file = folder / "scene.toml";
  write_file(scene_file, sim::to_toml(trial.setup.scene));
  const sim::World world(sim::load_scene(scene_file));
  const KeptDrive drive(world, scene_file.string());

  // Shares of the time, as measured.
  constexpr double kMapped = 0.3;
  constexpr double kDriven = 0.8;
  ReplayOptions options;
  options.map = make_map(world, trial.setup.map_pixel_m, folder, keep_ortho, trial.map_boulders,
                         [&](double share) { progress(kMapped * share); });
  std::string csv = kFixColumns;
  std::string seen = kSeenColumns;
  const auto replay = [&](const char* vo, double from, double to, RunFigures& figures) {
    SnapshotKeeper keeper(drive);
    options.watch = [&](const ReplayFrame& frame, const host::Picture&) { keeper.watch(frame); };
    const Replay run =
        run_replay(drive, options, [&](double share) { progress(from + (to - from) * share); });
    const RunErrors errors = errors_of(run);
    if (!errors.vo || !errors.corrected) {
      throw ToolError("{}: the flight module reported no pose; see whether cairn run takes this scene",
                      scene_file.string());
    }
    const std::vector<JudgedFix> fixes = judge_fixes(run, drive);
    figures = figures_of(errors, fixes);
    csv += to_csv_rows(fixes, vo);
    seen += to_csv_rows(keeper.snapshots(), vo);
    trial.frames = static_cast<double>(run.frames.size());
    trial.path_m = errors.vo->path_m;
  };
  replay("as_it_is", kMapped, kDriven, trial.as_it_is);
  options.trim = trial.setup.worse();
  replay("worse", kDriven, 1.0, trial.worse);
  write_file(folder / "fixes.csv", csv);
  write_file(folder / "seen.csv", seen);
  trial.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

}  // namespace cairn::ground
