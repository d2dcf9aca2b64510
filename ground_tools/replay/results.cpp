#include "replay/results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/json_file.hpp"
#include "plot/ortho_piece.hpp"
#include "plot/svg_plot.hpp"
#include "replay/status_names.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::array kNames = {"vo.tum",       "corrected.tum", "truth.tum",  "boulders.csv",
                               "orbital.csv",  "fixes.csv",     "frames.csv", "pairs.csv",
                               "summary.json", "pictures.json", "plot.svg"};

bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
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
      "iterations,scale,sigma_xy_m,sigma_yaw_deg,sigma_x_m,sigma_y_m,correlation_xy,snapshot,lost,chi2,log_ratio,"
      "second_log_ratio,chance_log,hypotheses,windows,windows_log_ratio\n";
  for (std::size_t i = 0; i < replay.fixes.size(); ++i) {
    const app::FixReport& f = replay.fixes[i];
    const Mat2& P = replay.fix_covariance_m2.at(i);
    const double sigma_x = std::sqrt(P(0, 0));
    const double sigma_y = std::sqrt(P(1, 1));
    text += fmt::format(
        "{},{},{:.5f},{:.5f},{:.5f},{},{:.5f},{},{},{},{},{},{},{:.6f},{:.5f},{:.5f},{:.5f},{:.5f},{:.4f},{},{},{:.3f},{:.3f},{:.3f},{:.3f},{},{},{:.3f}\n",
        f.number, fix_status_name(f.status), f.dx_m, f.dy_m, f.dyaw_rad * kDegPerRad, f.pairs, f.rms_m,
        f.trimmed, f.gated, f.local_boulders, f.map_boulders, f.map_window_full, f.iterations, f.scale,
        f.sigma_xy_m, f.sigma_yaw_rad * static_cast<float>(kDegPerRad), sigma_x, sigma_y,
        P(0, 1) / (sigma_x * sigma_y), f.snapshot, f.lost, f.chi2, f.log_ratio, f.second_log_ratio,
        f.chance_log, f.hypotheses, f.windows, f.windows_log_ratio);
  }
  return text;
}

double ms_of(const ReplayFrame& frame, std::initializer_list<cfg::Task> tasks) {
  double seconds = 0.0;
  for (const cfg::Task task : tasks) seconds += frame.task_seconds[static_cast<int>(task)];
  return 1.0e3 * seconds;
}

std::string frames_csv(const Replay& replay) {
  std::string text =
      "frame,stamp_s,pair,missed_pairs,pose,watch,vo,boulder_search,trust,gravity,heading,features,stereo,matches,own_points,inliers,rms_px,"
      "regions,evident_regions,boulders,boulders_matched,sigma_xy_m,sigma_yaw_deg,sigma_tilt_deg,sigma_z_m,vo_ops,boulder_ops,fix_ops,vo_ms,boulder_ms,fix_ms,"
      "ms\n";
  for (std::size_t i = 0; i < replay.frames.size(); ++i) {
    const ReplayFrame& f = replay.frames[i];
    const app::FrameReport& r = f.report;
    text += fmt::format(
        "{},{:.9f},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{:.4f},{},{},{},{},{:.5f},{:.5f},{:.5f},{:.5f},{},{},{},",
        r.number, replay.vo[i].stamp_s, pair_status_name(r.pair_status), r.missed_pairs,
        pose_source_name(r.pose_source), watch_status_name(r.watch), vo_status_name(r.vo_status),
        observe_status_name(r.boulder_status), trust_name(r.trust), attitude_status_name(r.gravity),
        attitude_status_name(r.heading), r.features_left, r.stereo, r.matches, r.own_points, r.inliers,
        r.rms_px, r.regions, r.evident_regions, r.boulders, r.boulders_matched, r.sigma_xy_m,
        r.sigma_yaw_rad * static_cast<float>(kDegPerRad), r.sigma_tilt_rad * static_cast<float>(kDegPerRad),
        r.sigma_z_m, r.vo_ops, r.boulder_ops, r.fix_ops);
    text += fmt::format(
        "{:.3f},{:.3f},{:.3f},{:.3f}\n", ms_of(f, {cfg::Task::kVo}), ms_of(f, {cfg::Task::kBoulders}),
        ms_of(f, {cfg::Task::kFixBegin, cfg::Task::kFix, cfg::Task::kFixApply}), 1.0e3 * f.seconds);
  }
  return text;
}

std::string pairs_csv(const Replay& replay) {
  std::string text = "frame,x_m,y_m,map_x_m,map_y_m\n";
  for (const FixPair& p : replay.pairs) {
    text += fmt::format("{},{:.4f},{:.4f},{:.4f},{:.4f}\n", p.frame, p.seen_map_m.x(), p.seen_map_m.y(),
                        p.map_m.x(), p.map_m.y());
  }
  return text;
}

/// The paths with a margin that shows what the rover saw beside them.
Box surroundings(const Replay& replay) {
  Box box{Vec2::Constant(1.0e300), Vec2::Constant(-1.0e300)};
  for (const Trajectory* path : {&replay.vo, &replay.corrected, &replay.truth}) {
    for (const StampedPose& p : *path) {
      box.low_m = box.low_m.cwiseMin(p.pose.t.head<2>());
      box.high_m = box.high_m.cwiseMax(p.pose.t.head<2>());
    }
  }
  const Vec2 margin = Vec2::Constant(std::max(3.0, 0.1 * box.size_m().maxCoeff()));
  return {box.low_m - margin, box.high_m + margin};
}

std::string orbital_csv(const RunTitle& title, const Box& box) {
  std::vector<TableBoulder> near;
  for (const TableBoulder& b : title.orbital) {
    const bool inside =
        (b.p_map_m.array() >= box.low_m.array()).all() && (b.p_map_m.array() <= box.high_m.array()).all();
    if (inside) near.push_back(b);
  }
  return to_csv(near);
}

std::string pictures_json(const RunTitle& title, const Box& box, const PictureRecorder& pictures) {
  ordered_json json;
  json["ortho"] = nullptr;
  if (!title.ortho.empty()) {
    constexpr int kOrthoSidePx = 1600;
    const OrthoPiece piece = read_ortho_piece(title.ortho, box, kOrthoSidePx);
    if (!piece.base64.empty()) {
      json["ortho"] = {{"low_m", {piece.box.low_m.x(), piece.box.low_m.y()}},
                       {"high_m", {piece.box.high_m.x(), piece.box.high_m.y()}},
                       {"jpeg", piece.base64}};
    }
  }
  json["stride"] = PictureRecorder::kStride;
  json["strips"] = pictures.strips();
  return json.dump() + "\n";
}

std::vector<Vec2> flat(const Trajectory& trajectory) {
  std::vector<Vec2> path;
  for (const StampedPose& p : trajectory) path.emplace_back(p.pose.t.x(), p.pose.t.y());
  return path;
}

/// What the flight module says of its own pose, frame by frame, where there is an error to stand beside it.
void add_claims(const Replay& replay, const TrajectoryErrors& corrected, ReplayPlot& plot) {
  if (corrected.poses.size() != replay.frames.size()) return;
  for (std::size_t k = 0; k < replay.frames.size(); ++k) {
    const app::FrameReport& r = replay.frames[k].report;
    const double distance_m = corrected.poses[k].distance_m;
    plot.three_sigma.push_back({distance_m, 3.0 * static_cast<double>(r.sigma_xy_m)});
    const std::string trust = trust_name(r.trust);
    if (plot.trust.empty() || plot.trust.back().state != trust)
      plot.trust.push_back({distance_m, distance_m, trust});
    plot.trust.back().to_m = distance_m;
  }
}

ReplayPlot plot_of(const RunTitle& title, const Replay& replay, const RunErrors& errors) {
  const auto& [vo, corrected] = errors;
  ReplayPlot plot;
  plot.title = fmt::format("{} over {}", fs::path(title.dataset).filename().string(),
                           title.map.empty() ? "no map" : fs::path(title.map).filename().string());
  plot.orthoimage = title.ortho;
  plot.truth_map_m = flat(replay.truth);
  plot.vo_map_m = flat(replay.vo);
  plot.corrected_map_m = flat(replay.corrected);
  for (const TableBoulder& b : title.orbital) plot.orbital.push_back({b.p_map_m, b.diameter_m});
  for (const auto& [id, b] : replay.boulders) plot.ground.push_back({Vec2(b.x_m, b.y_m), b.diameter_m});
  if (vo && corrected) {
    plot.subtitle =
        fmt::format("{:.1f} m: VO alone ends {:.3f} m off in x, y; corrected {:.3f} m (largest {:.3f} m)",
                    vo->path_m, vo->end.xy_m, corrected->end.xy_m, corrected->largest_xy.xy_m);
    for (const PoseError& e : vo->poses) plot.vo_error.push_back({e.distance_m, e.xy_m});
    for (const PoseError& e : corrected->poses) plot.corrected_error.push_back({e.distance_m, e.xy_m});
    add_claims(replay, *corrected, plot);
  }
  for (const app::FixReport& f : replay.fixes) {
    const auto at = std::find_if(replay.frames.begin(), replay.frames.end(),
                                 [&](const ReplayFrame& r) { return r.report.number == f.number; });
    if (at == replay.frames.end()) continue;
    PlotFix fix;
    fix.correction_m = Vec2(f.dx_m, f.dy_m);
    fix.p_map_m = Vec2(at->report.T_map_cam.t.x(), at->report.T_map_cam.t.y()) - fix.correction_m;
    fix.used = f.status == static_cast<std::uint8_t>(FixStatus::kApplied);
    fix.verdict = fix_status_name(f.status);
    const auto k = static_cast<std::size_t>(at - replay.frames.begin());
    if (corrected && k < corrected->poses.size()) fix.distance_m = corrected->poses[k].distance_m;
    plot.fixes.push_back(fix);
  }
  return plot;
}

}  // namespace

Results::Results(const fs::path& folder) : folder_(folder), made_(!is_there(folder)) {
  make_folder(folder);
  for (const char* name : kNames) files_.emplace_back(folder / name);
}

Results::~Results() {
  files_.clear();
  std::error_code ignored;
  if (made_) fs::remove(folder_, ignored);  // only where it is empty
}

void Results::write(const RunTitle& title, const Replay& replay, const RunErrors& errors,
                    const PictureRecorder& pictures) {
  const Box box = surroundings(replay);
  const std::string summary = to_text(summary_json(title, replay, errors));
  const std::string texts[] = {to_tum(replay.vo),
                               to_tum(replay.corrected),
                               to_tum(replay.truth),
                               boulders_csv(replay),
                               orbital_csv(title, box),
                               fixes_csv(replay),
                               frames_csv(replay),
                               pairs_csv(replay),
                               summary,
                               pictures_json(title, box, pictures),
                               render_svg(plot_of(title, replay, errors))};
  static_assert(std::size(texts) == kNames.size(), "a text for each name");
  for (std::size_t i = 0; i < files_.size(); ++i) files_[i].write(texts[i]);
  const HoldInterrupts all_or_none;
  for (OutputFile& file : files_) file.commit();
}

std::string Results::names() const {
  return (folder_ / fmt::format("{{{}}}", fmt::join(kNames, ","))).string();
}

}  // namespace cairn::ground
