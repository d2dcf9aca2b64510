// cairn run: replays a data set through the flight module.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "commands.hpp"
#include "map/cmap_file.hpp"
#include "output_file.hpp"
#include "plot/ortho_piece.hpp"
#include "plot/svg_plot.hpp"
#include "progress_line.hpp"
#include "replay/replay.hpp"
#include "replay/status_names.hpp"
#include "tool_error.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

struct RunOptions {
  fs::path dataset;
  fs::path map;
  fs::path output;
  fs::path ortho;
  std::string frames;
  std::string start;
  std::string degrade;
  bool no_map = false;
  bool paper = false;
};

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == separator) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

/// A finite number that fills the whole text.
double number(const std::string& text, const std::string& option, const std::string& mend) {
  try {
    std::size_t used = 0;
    const double value = std::stod(text, &used);
    if (used == text.size() && std::isfinite(value)) return value;
  } catch (const std::exception&) {
  }
  throw ToolError("{}: '{}' is no finite number; {}", option, text, mend);
}

Pose3 parse_start(const std::string& text) {
  const std::string mend = "give x,y,z,roll,pitch,yaw of the rover in the map (metres, degrees)";
  const std::vector<std::string> parts = split(text, ',');
  if (parts.size() != 6) throw ToolError("--start: {} values; {}", parts.size(), mend);
  double v[6];
  for (std::size_t i = 0; i < 6; ++i) v[i] = number(parts[i], "--start", mend);
  const Attitude attitude{v[5] * kRadPerDeg, v[4] * kRadPerDeg, v[3] * kRadPerDeg};
  return {quat_from_attitude(attitude), Vec3(v[0], v[1], v[2])};
}

StepTrim parse_degrade(const std::string& text) {
  const std::string mend = "give scale=FACTOR and yaw=ANGLEdeg/m, as in scale=1.02,yaw=0.1deg/m";
  StepTrim trim;
  for (const std::string& part : split(text, ',')) {
    const std::size_t equals = part.find('=');
    const std::string key = part.substr(0, equals);
    std::string value = equals == std::string::npos ? "" : part.substr(equals + 1);
    if (key == "scale") {
      trim.scale = number(value, "--degrade", mend);
    } else if (key == "yaw") {
      double unit = 0.0;
      for (const auto& [suffix, factor] :
           {std::pair<std::string, double>{"deg/m", kRadPerDeg}, {"rad/m", 1.0}}) {
        if (value.size() > suffix.size() &&
            value.compare(value.size() - suffix.size(), suffix.size(), suffix) == 0) {
          value.resize(value.size() - suffix.size());
          unit = factor;
          break;
        }
      }
      if (unit == 0.0) throw ToolError("--degrade: '{}' has no unit; {}", part, mend);
      trim.yaw_rad_per_m = unit * number(value, "--degrade", mend);
    } else {
      throw ToolError("--degrade: '{}' is not known; {}", part, mend);
    }
  }
  return trim;
}

void parse_frames(const std::string& text, ReplayOptions& options) {
  const std::string mend =
      "give FIRST:END, whole numbers counted from 0, END not included; either may be left out";
  const std::vector<std::string> parts = split(text, ':');
  const auto index = [&](const std::string& part) {
    if (part.empty() || part.size() > 9 || part.find_first_not_of("0123456789") != std::string::npos) {
      throw ToolError("--frames: '{}' is not a part; {}", text, mend);
    }
    return static_cast<std::size_t>(std::stoul(part));
  };
  if (parts.size() != 2) throw ToolError("--frames: '{}' is not a part; {}", text, mend);
  if (!parts[0].empty()) options.first_frame = index(parts[0]);
  if (!parts[1].empty()) options.end_frame = index(parts[1]);
}

std::string boulders_csv(const Replay& replay) {
  std::string text = "id,x,y,z,size,sightings\n";
  for (const auto& [id, b] : replay.boulders) {
    text += fmt::format("{},{:.4f},{:.4f},{:.4f},{:.3f},{}\n", id, b.x_m, b.y_m, b.z_m, b.diameter_m,
                        b.sightings);
  }
  return text;
}

std::string fixes_csv(const Replay& replay) {
  std::string text =
      "frame,status,dx_m,dy_m,dyaw_deg,pairs,rms_m,trimmed,gated,local_boulders,map_boulders,map_window_full,"
      "iterations,scale,sigma_xy_m,sigma_yaw_deg\n";
  for (const app::FixReport& f : replay.fixes) {
    text +=
        fmt::format("{},{},{:.5f},{:.5f},{:.5f},{},{:.5f},{},{},{},{},{},{},{:.6f},{:.5f},{:.5f}\n", f.number,
                    fix_status_name(f.status), f.dx_m, f.dy_m, f.dyaw_rad * kDegPerRad, f.pairs, f.rms_m,
                    f.trimmed, f.gated, f.local_boulders, f.map_boulders, f.map_window_full, f.iterations,
                    f.scale, f.sigma_xy_m, f.sigma_yaw_rad * static_cast<float>(kDegPerRad));
  }
  return text;
}

ordered_json errors_json(const TrajectoryErrors& e) {
  return {{"end_xy_m", e.end.xy_m},
          {"end_z_m", e.end.position_map_m.z()},
          {"end_3d_m", e.end.xyz_m},
          {"end_3d_percent", e.percent_of_path(e.end.xyz_m)},
          {"end_rotation_deg", e.end.rotation_deg},
          {"end_yaw_deg", e.end.yaw_deg},
          {"largest_xy_m", e.largest_xy.xy_m},
          {"rms_xy_m", e.rms_xy_m}};
}

/// The largest amount by which the corrected error in x, y exceeds that of VO alone.
double largest_excess(const TrajectoryErrors& vo, const TrajectoryErrors& corrected) {
  double excess = 0.0;
  for (std::size_t i = 0; i < vo.poses.size() && i < corrected.poses.size(); ++i) {
    excess = std::max(excess, corrected.poses[i].xy_m - vo.poses[i].xy_m);
  }
  return excess;
}

/// Share of the ground boulders that lie within 0.10 m of a true rock.
std::optional<double> boulder_precision(const Replay& replay, const Dataset& dataset) {
  if (dataset.truth_rocks().empty() || replay.boulders.empty()) return std::nullopt;
  int near = 0;
  for (const auto& [id, b] : replay.boulders) {
    const Vec2 p(b.x_m, b.y_m);
    const auto& rocks = dataset.truth_rocks();
    near += std::any_of(rocks.begin(), rocks.end(),
                        [&](const TruthRock& r) { return (r.p_map_m - p).norm() <= 0.10; })
                ? 1
                : 0;
  }
  return static_cast<double>(near) / static_cast<double>(replay.boulders.size());
}

template <std::size_t N>
ordered_json counts_json(const std::uint32_t (&counts)[N], std::string (*name)(std::uint8_t)) {
  ordered_json json = ordered_json::object();
  for (std::size_t i = 0; i < N; ++i) {
    if (counts[i] != 0) json[name(static_cast<std::uint8_t>(i))] = counts[i];
  }
  return json;
}

ordered_json summary_json(const RunOptions& options, const Dataset& dataset, const Replay& replay,
                          const std::optional<TrajectoryErrors>& vo,
                          const std::optional<TrajectoryErrors>& corrected) {
  ordered_json s;
  s["mission"] = cfg::kMission.name;
  s["dataset"] = options.dataset.string();
  s["map"] = options.no_map ? "" : options.map.string();
  s["variant"] = options.paper ? "paper" : "cairn";
  s["frames"] = replay.frames.size();
  if (vo && corrected) {
    s["path_m"] = vo->path_m;
    s["vo"] = errors_json(*vo);
    s["corrected"] = errors_json(*corrected);
    s["largest_excess_over_vo_m"] = largest_excess(*vo, *corrected);
  }
  if (const auto share = boulder_precision(replay, dataset)) s["boulders_within_0.10_m_of_a_rock"] = *share;
  s["boulders"] = replay.boulders.size();
  if (!replay.frames.empty()) {
    s["rates"] = {
        {"scale", replay.frames.back().report.scale},
        {"turn_deg_per_m", replay.frames.back().report.turn_rad_per_m * static_cast<float>(kDegPerRad)}};
  }
  s["counts"]["vo"] = counts_json(replay.health.vo, vo_status_name);
  s["counts"]["boulders"] = counts_json(replay.health.boulders, observe_status_name);
  s["counts"]["fixes"] = counts_json(replay.health.fixes, fix_status_name);
  s["counts"]["overruns"] = counts_json(replay.executive.overruns, task_name);
  s["counts"]["unreadable_images"] = replay.unreadable_images;
  s["counts"]["extrapolated"] = replay.health.extrapolated;
  s["counts"]["abandoned_boulders"] = replay.health.abandoned_boulders;
  s["counts"]["dropped_tracks"] = replay.health.dropped_tracks;
  s["counts"]["dropped_pairs"] = replay.executive.dropped_pairs;
  s["counts"]["bad_priors"] = replay.health.bad_priors;
  if (!options.no_map) s["map_status"] = map_status_name(replay.map_status);
  for (int i = 0; i < app::FlightApp::kParts; ++i) {
    s["memory_bytes"][app::FlightApp::parts()[i].name] = app::FlightApp::parts()[i].bytes;
  }
  double seconds = 0.0;
  double longest = 0.0;
  std::uint32_t most_vo = 0;
  std::uint32_t most_boulders = 0;
  for (const ReplayFrame& f : replay.frames) {
    seconds += f.seconds;
    longest = std::max(longest, f.seconds);
    most_vo = std::max(most_vo, f.report.vo_ops);
    most_boulders = std::max(most_boulders, f.report.boulder_ops);
  }
  s["time"] = {{"mean_ms_a_frame",
                1e3 * seconds / static_cast<double>(std::max<std::size_t>(1, replay.frames.size()))},
               {"longest_ms", 1e3 * longest},
               {"most_vo_ops", most_vo},
               {"most_boulder_ops", most_boulders}};
  return s;
}

std::vector<Vec2> flat(const Trajectory& trajectory) {
  std::vector<Vec2> path;
  for (const StampedPose& p : trajectory) path.emplace_back(p.pose.t.x(), p.pose.t.y());
  return path;
}

ReplayPlot plot_of(const RunOptions& options, const Replay& replay, const std::optional<TrajectoryErrors>& vo,
                   const std::optional<TrajectoryErrors>& corrected,
                   const std::vector<PlotBoulder>& orbital) {
  ReplayPlot plot;
  plot.title = fmt::format("{} over {}", options.dataset.filename().string(),
                           options.no_map ? "no map" : options.map.filename().string());
  plot.orthoimage = options.ortho;
  plot.truth_map_m = flat(replay.truth);
  plot.vo_map_m = flat(replay.vo);
  plot.corrected_map_m = flat(replay.corrected);
  plot.orbital = orbital;
  for (const auto& [id, b] : replay.boulders) plot.ground.push_back({Vec2(b.x_m, b.y_m), b.diameter_m});
  if (vo && corrected) {
    plot.subtitle =
        fmt::format("{:.1f} m: VO alone ends {:.3f} m off in x, y; corrected {:.3f} m (largest {:.3f} m)",
                    vo->path_m, vo->end.xy_m, corrected->end.xy_m, corrected->largest_xy.xy_m);
    for (const PoseError& e : vo->poses) plot.vo_error.push_back({e.distance_m, e.xy_m});
    for (const PoseError& e : corrected->poses) plot.corrected_error.push_back({e.distance_m, e.xy_m});
  }
  for (const app::FixReport& f : replay.fixes) {
    const auto at = std::find_if(replay.frames.begin(), replay.frames.end(),
                                 [&](const ReplayFrame& r) { return r.report.number == f.number; });
    if (at == replay.frames.end()) continue;
    PlotFix fix;
    fix.correction_m = Vec2(f.dx_m, f.dy_m);
    fix.p_map_m = Vec2(at->report.T_map_cam.t.x(), at->report.T_map_cam.t.y()) - fix.correction_m;
    fix.used = f.status == static_cast<std::uint8_t>(FixStatus::kApplied);
    const auto k = static_cast<std::size_t>(at - replay.frames.begin());
    if (corrected && k < corrected->poses.size()) fix.distance_m = corrected->poses[k].distance_m;
    plot.fixes.push_back(fix);
  }
  return plot;
}

void print_table(const Replay& replay, const std::optional<TrajectoryErrors>& vo,
                 const std::optional<TrajectoryErrors>& corrected) {
  std::size_t applied = 0;
  for (const app::FixReport& f : replay.fixes) {
    applied += f.status == static_cast<std::uint8_t>(FixStatus::kApplied) ? 1U : 0U;
  }
  fmt::print("{} frames, {} fixes applied of {}, {} ground boulders\n", replay.frames.size(), applied,
             replay.fixes.size(), replay.boulders.size());
  if (!vo || !corrected) {
    fmt::print("no truth in the data set: no errors to tell\n");
    return;
  }
  fmt::print("errors after {:.2f} m          VO alone   corrected\n", vo->path_m);
  const auto row = [](const char* name, double a, double b, const char* unit) {
    fmt::print("  {:<24} {:>10.3f}  {:>10.3f}  {}\n", name, a, b, unit);
  };
  row("end, x and y", vo->end.xy_m, corrected->end.xy_m, "m");
  row("largest, x and y", vo->largest_xy.xy_m, corrected->largest_xy.xy_m, "m");
  row("end, 3D", vo->end.xyz_m, corrected->end.xyz_m, "m");
  row("end, 3D share of path", vo->percent_of_path(vo->end.xyz_m),
      corrected->percent_of_path(corrected->end.xyz_m), "%");
  row("end, yaw", vo->end.yaw_deg, corrected->end.yaw_deg, "degrees");
  row("end, whole rotation", vo->end.rotation_deg, corrected->end.rotation_deg, "degrees");
}

/// All results or none. The files are opened before the work, so that a folder that cannot be written is told
/// at once; a folder made for nothing goes again.
class Results {
 public:
  explicit Results(const fs::path& folder) : folder_(folder), made_(!is_there(folder)) {
    make_folder(folder);
    for (const char* name : kNames) files_.emplace_back(folder / name);
  }
  ~Results() {
    files_.clear();
    std::error_code ignored;
    if (made_) fs::remove(folder_, ignored);  // only where it is empty
  }
  Results(const Results&) = delete;
  Results& operator=(const Results&) = delete;

  /// The contents, in the order of the names.
  void write(const std::vector<std::string>& texts) {
    for (std::size_t i = 0; i < files_.size(); ++i) files_[i].write(texts.at(i));
    for (OutputFile& file : files_) file.commit();
  }
  std::string names() const { return (folder_ / fmt::format("{{{}}}", fmt::join(kNames, ","))).string(); }

 private:
  static bool is_there(const fs::path& folder) {
    std::error_code ignored;
    return fs::exists(folder, ignored);
  }

  static constexpr std::array kNames = {"vo.tum",    "corrected.tum", "boulders.csv",
                                        "fixes.csv", "summary.json",  "plot.svg"};
  fs::path folder_;
  bool made_;
  std::deque<OutputFile> files_;
};

void run(const RunOptions& options) {
  if (options.no_map != options.map.empty()) {
    throw ToolError("--map: {}", options.no_map ? "goes not with --no-map; leave one out"
                                                : "is missing; give a .cmap, or --no-map for VO alone");
  }
  ReplayOptions replay_options;
  if (options.paper) replay_options.params = paper_params();
  if (!options.frames.empty()) parse_frames(options.frames, replay_options);
  if (!options.start.empty()) replay_options.T_map_rover = parse_start(options.start);
  if (!options.degrade.empty()) replay_options.trim = parse_degrade(options.degrade);
  std::vector<PlotBoulder> orbital;
  if (!options.no_map) {
    replay_options.map = read_file(options.map);
    const CmapContent map = decode_cmap(replay_options.map, options.map.string());
    if (map.boulders.empty())
      throw ToolError("{}: {}", options.map.string(), explain(MapStatus::kNoBoulders));
    for (const TableBoulder& b : map.boulders) {
      orbital.push_back({b.p_map_m, b.diameter_m});
    }
  }
  const Dataset dataset = Dataset::open(options.dataset);
  if (!options.ortho.empty())
    static_cast<void>(read_ortho_piece(options.ortho, Box(), 1));  // told before the work
  Results results(options.output);
  Replay replay;
  {
    ProgressLine progress(fmt::format("run {}", options.dataset.filename().string()));
    replay = run_replay(dataset, replay_options, [&](double share) { progress.show(share); });
  }
  for (const std::string& warning : replay.warnings) fmt::print(stderr, "cairn: warning: {}\n", warning);
  const auto vo = compare(replay.vo, replay.truth);
  const auto corrected = compare(replay.corrected, replay.truth);
  const ordered_json summary = summary_json(options, dataset, replay, vo, corrected);
  results.write({to_tum(replay.vo), to_tum(replay.corrected), boulders_csv(replay), fixes_csv(replay),
                 summary.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n",
                 render_svg(plot_of(options, replay, vo, corrected, orbital))});
  print_table(replay, vo, corrected);
  fmt::print("written: {}\n", results.names());
}

}  // namespace

void add_run_command(CLI::App& app) {
  const auto options = std::make_shared<RunOptions>();
  CLI::App* command =
      app.add_subcommand("run", "Replay a data set of stereo pairs through the flight module");
  command->add_option("--dataset", options->dataset, "folder of stereo pairs (layout: doc/USER_GUIDE.md)")
      ->required();
  command->add_option("--map", options->map, "orbital boulder map (.cmap)");
  command->add_flag("--no-map", options->no_map, "visual odometry alone");
  command->add_option("-o,--output", options->output, "folder for the results")->required();
  command->add_option("--ortho", options->ortho, "orthoimage to draw the plot on");
  command->add_option("--frames", options->frames, "part of the data set, FIRST:END, counted from 0");
  command->add_option("--start", options->start,
                      "rover's start in the map: x,y,z,roll,pitch,yaw (metres, degrees)");
  command->add_option("--degrade", options->degrade, "worsen each VO step, e.g. scale=1.02,yaw=0.1deg/m");
  command->add_flag("--paper", options->paper, "the paper's own choices throughout");
  command->callback([options] { run(*options); });
}

}  // namespace cairn::ground
