#include "report/run_folder.hpp"

#include <algorithm>
#include <cmath>

#include "base/json_file.hpp"
#include "base/number_table.hpp"
#include "base/output_file.hpp"
#include "base/tool_error.hpp"
#include "dataset/trajectory.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr const char* kNotWhole = "is not whole; run `cairn run` again";

/// A trajectory of `count` poses; of any number where `count` is SIZE_MAX.
Trajectory read_path(const fs::path& path, std::size_t count) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  Trajectory trajectory = read_tum(path);
  if (bytes.empty() || bytes.back() != '\n')
    throw ToolError("{}: its last line is cut off; run `cairn run` again", path.string());
  if (count != SIZE_MAX && trajectory.size() != count) {
    throw ToolError("{}: has {} poses, but summary.json tells of {} frames; run `cairn run` again",
                    path.string(), trajectory.size(), count);
  }
  return trajectory;
}

ordered_json flat(const Trajectory& trajectory) {
  ordered_json path = ordered_json::array();
  for (const StampedPose& p : trajectory) {
    path.push_back(rounded(p.pose.t.x()));
    path.push_back(rounded(p.pose.t.y()));
  }
  return path;
}

ordered_json curves(const TrajectoryErrors& errors) {
  ordered_json xy = ordered_json::array();
  ordered_json xyz = ordered_json::array();
  ordered_json rotation = ordered_json::array();
  ordered_json yaw = ordered_json::array();
  for (const PoseError& e : errors.poses) {
    xy.push_back(rounded(e.xy_m));
    xyz.push_back(rounded(e.xyz_m));
    rotation.push_back(rounded(e.rotation_deg));
    yaw.push_back(rounded(e.yaw_deg));
  }
  return {{"xy_m", xy}, {"xyz_m", xyz}, {"rotation_deg", rotation}, {"yaw_deg", yaw}};
}

/// Along the true path where each frame has a true pose, else along the corrected one.
std::vector<double> distances(const Trajectory& truth, const Trajectory& corrected) {
  const Trajectory& path = truth.size() == corrected.size() ? truth : corrected;
  std::vector<double> distance;
  for (std::size_t i = 0; i < path.size(); ++i) {
    distance.push_back(i == 0 ? 0.0 : distance.back() + (path[i].pose.t - path[i - 1].pose.t).norm());
  }
  for (double& d : distance) d = rounded(d);
  return distance;
}

CsvTable read_table(const fs::path& path) {
  CsvTable table(path, "run `cairn run` again");
  if (table.cut_off()) throw ToolError("{}: its last line is cut off; run `cairn run` again", path.string());
  return table;
}

/// Columns by name; numbers are rounded to 1e-5, so that they take little room as text.
ordered_json columns(const CsvTable& table, std::initializer_list<const char*> words,
                     std::initializer_list<const char*> numbers) {
  ordered_json json = ordered_json::object();
  for (const char* name : words) {
    ordered_json& out = json[name] = ordered_json::array();
    for (std::size_t row = 0; row < table.size(); ++row) out.push_back(table.word(row, table.column(name)));
  }
  for (const char* name : numbers) {
    ordered_json& out = json[name] = ordered_json::array();
    for (std::size_t row = 0; row < table.size(); ++row)
      out.push_back(std::round(table.any_number(row, table.column(name)) * 1.0e5) / 1.0e5);
  }
  return json;
}

/// Where each fix was made, and the error in x and y on both sides of it.
void place_fixes(ordered_json& run, const fs::path& path, const Trajectory& truth,
                 const Trajectory& corrected) {
  ordered_json& fixes = run["fixes"];
  for (const char* name : {"x_m", "y_m", "distance_m", "before_m", "after_m"})
    fixes[name] = ordered_json::array();
  const auto frames = run["frames"]["frame"].get<std::vector<double>>();
  const auto at_frame = fixes["frame"].get<std::vector<double>>();
  for (std::size_t i = 0; i < at_frame.size(); ++i) {
    const auto found = std::find(frames.begin(), frames.end(), at_frame[i]);
    if (found == frames.end()) {
      throw ToolError("{}: frame {} is not in frames.csv; run `cairn run` again", path.string(),
                      static_cast<long>(at_frame[i]));
    }
    const auto k = static_cast<std::size_t>(found - frames.begin());
    const Vec2 after = corrected[k].pose.t.head<2>();
    const Vec2 before = after - Vec2(fixes["dx_m"][i].get<double>(), fixes["dy_m"][i].get<double>());
    fixes["x_m"].push_back(rounded(after.x()));
    fixes["y_m"].push_back(rounded(after.y()));
    fixes["distance_m"].push_back(run["frames"]["distance_m"][k]);
    const StampedPose* const truly = find_stamp(truth, corrected[k].stamp_s);
    const auto error = [&](const Vec2& p) {
      return truly == nullptr ? ordered_json() : ordered_json(rounded((p - truly->pose.t.head<2>()).norm()));
    };
    fixes["before_m"].push_back(error(before));
    fixes["after_m"].push_back(error(after));
  }
}

/// Keys that the page reads without asking whether they are there.
void check_keys(const ordered_json& summary, const ordered_json& pictures) {
  for (const char* key : {"mission", "dataset", "map", "variant", "degrade"})
    static_cast<void>(summary.at(key).get<std::string>());
  for (const char* key : {"counts", "memory_bytes"}) static_cast<void>(summary.at(key).items());
  for (const char* key : {"vo", "boulders", "fixes", "overruns"})
    static_cast<void>(summary.at("counts").at(key).items());
  static_cast<void>(summary.at("map_pixel_m").get<double>());
  if (!pictures.at("strips").is_array())
    throw ToolError("pictures.json: holds no strips; run `cairn run` again");
  for (const ordered_json& strip : pictures.at("strips")) {
    for (const ordered_json& picture : strip) {
      for (const char* key :
           {"frame", "width", "height", "jpeg", "camera_m", "heading_rad", "points", "boulders"})
        static_cast<void>(picture.at(key));
    }
  }
}

ordered_json read_files(const fs::path& folder) {
  ordered_json run;
  const fs::path absolute = fs::weakly_canonical(folder);
  run["name"] = absolute.filename().string();
  run["summary"] = read_json(folder / "summary.json", kNotWhole);
  const ordered_json pictures = read_json(folder / "pictures.json", kNotWhole);
  check_keys(run["summary"], pictures);
  const auto count = run["summary"].at("frames").get<std::size_t>();

  const Trajectory vo = read_path(folder / "vo.tum", count);
  const Trajectory corrected = read_path(folder / "corrected.tum", count);
  const Trajectory truth = read_path(folder / "truth.tum", SIZE_MAX);
  run["paths"] = {{"truth", flat(truth)}, {"vo", flat(vo)}, {"corrected", flat(corrected)}};
  const auto vo_errors = compare(vo, truth);
  const auto corrected_errors = compare(corrected, truth);
  run["errors"] = nullptr;
  if (vo_errors && corrected_errors) {
    ordered_json along = ordered_json::array();
    for (const PoseError& e : vo_errors->poses) along.push_back(rounded(e.distance_m));
    run["errors"] = {
        {"distance_m", along}, {"vo", curves(*vo_errors)}, {"corrected", curves(*corrected_errors)}};
  }

  const CsvTable frames = read_table(folder / "frames.csv");
  if (frames.size() != count) {
    throw ToolError("{}: has {} frames, but summary.json tells of {}; run `cairn run` again",
                    (folder / "frames.csv").string(), frames.size(), count);
  }
  run["frames"] = columns(frames, {"pose", "vo", "trust"},
                          {"frame", "inliers", "boulders", "sigma_xy_m", "sigma_yaw_deg", "vo_ops",
                           "boulder_ops", "fix_ops", "vo_ms", "boulder_ms", "fix_ms", "ms"});
  run["frames"]["distance_m"] = distances(truth, corrected);
  run["fixes"] = columns(read_table(folder / "fixes.csv"), {"status"},
                         {"frame", "snapshot", "dx_m", "dy_m", "dyaw_deg", "pairs", "rms_m", "trimmed",
                          "gated", "local_boulders", "map_boulders", "sigma_x_m", "sigma_y_m",
                          "correlation_xy", "sigma_yaw_deg", "lost", "log_ratio", "second_log_ratio"});
  place_fixes(run, folder / "fixes.csv", truth, corrected);
  run["pairs"] = columns(read_table(folder / "pairs.csv"), {}, {"frame", "x_m", "y_m", "map_x_m", "map_y_m"});
  run["ground"] = columns(read_table(folder / "boulders.csv"), {}, {"id", "x", "y", "size", "sightings"});
  run["orbital"] = columns(read_table(folder / "orbital.csv"), {}, {"x_m", "y_m", "diameter_m"});
  for (const char* key : {"ortho", "stride", "strips"}) run[key] = pictures.at(key);
  return run;
}

}  // namespace

ordered_json read_run_folder(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored))
    throw ToolError("{}: no such folder; give one that `cairn run -o` wrote", folder.string());
  if (!fs::exists(folder / "summary.json", ignored))
    throw ToolError("{}: holds no summary.json; give a folder that `cairn run -o` wrote", folder.string());
  try {
    return read_files(folder);
  } catch (const nlohmann::json::exception& error) {
    throw ToolError("{}: its JSON files are not of this version ({}); run `cairn run` again", folder.string(),
                    error.what());
  }
}

}  // namespace cairn::ground
