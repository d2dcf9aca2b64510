// cairn table: what many runs came to, beside Table I of the paper.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/json_file.hpp"
#include "base/output_file.hpp"
#include "base/statistics.hpp"
#include "base/tool_error.hpp"
#include "commands/commands.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;

/// Table I of Hourdakis and Lourakis (2015): errors after 100 m, VO alone about 2.5 m.
struct PaperRow {
  double pixel_m;
  double position_m;
  double rotation_deg;
  int boulders;
};
constexpr PaperRow kPaper[] = {
    {0.005, 0.7743, 0.3809, 8593},
    {0.0066667, 0.9939, 0.5378, 6348},
    {0.01, 0.6954, 0.9254, 1951},
    {0.02, 1.2522, 1.2457, 2522},
};

/// Runs of one map resolution and one VO, over the seeds.
struct Key {
  std::string degrade;
  std::string map;  ///< file name without extension

  bool operator<(const Key& o) const { return degrade != o.degrade ? degrade < o.degrade : map < o.map; }
};

struct Row {
  double pixel_m = 0.0;
  std::map<std::string, std::vector<double>> figures;
};

constexpr const char* kFigures[] = {
    "path_m",   "map_boulders",  "vo_end_xy_m",    "vo_end_3d_percent", "vo_rotation_deg",
    "end_xy_m", "largest_xy_m",  "yaw_deg",        "end_3d_m",          "end_rotation_deg",
    "excess_m", "fixes_applied", "fixes_declined", "boulder_precision"};

void add(const fs::path& folder, std::map<Key, Row>& table) {
  const fs::path file = folder / "summary.json";
  const json s = read_json(file, "is not the summary of a run; give folders that cairn run wrote");
  try {
    const fs::path map = s.at("map").get<std::string>();
    Row& row = table[{s.at("degrade"), map.stem().string()}];
    row.pixel_m = s.at("map_pixel_m");
    const json& vo = s.at("vo");
    const json& c = s.at("corrected");
    double fixes = 0.0;
    double applied = 0.0;
    for (const auto& [name, count] : s.at("counts").at("fixes").items()) {
      fixes += count.get<double>();
      if (name == "applied") applied = count;
    }
    const std::vector<double> values = {s.at("path_m"),
                                        s.at("map_boulders"),
                                        vo.at("end_xy_m"),
                                        vo.at("end_3d_percent"),
                                        vo.at("end_rotation_deg"),
                                        c.at("end_xy_m"),
                                        c.at("largest_xy_m"),
                                        std::fabs(c.at("end_yaw_deg").get<double>()),
                                        c.at("end_3d_m"),
                                        c.at("end_rotation_deg"),
                                        s.at("largest_excess_over_vo_m"),
                                        applied,
                                        fixes - applied,
                                        s.value("boulders_within_0.10_m_of_a_rock", 0.0)};
    for (std::size_t i = 0; i < values.size(); ++i) row.figures[kFigures[i]].push_back(values[i]);
  } catch (const json::exception&) {
    throw ToolError("{}: has no errors against truth; give runs of a drive whose truth is known",
                    file.string());
  }
}

/// Median, with the range where there are several.
std::string told(const std::vector<double>& v, int decimals) {
  const auto [low, high] = std::minmax_element(v.begin(), v.end());
  return v.size() == 1 ? fmt::format("{:.{}f}", v[0], decimals)
                       : fmt::format("{:.{}f} [{:.{}f}, {:.{}f}]", median(v), decimals, *low, decimals, *high,
                                     decimals);
}

/// Coarser maps below finer ones; maps without a resolution (tables of true rocks) first.
std::vector<std::pair<Key, Row>> sorted(const std::map<Key, Row>& table) {
  std::vector<std::pair<Key, Row>> rows(table.begin(), table.end());
  std::stable_sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) {
    return a.first.degrade != b.first.degrade ? a.first.degrade < b.first.degrade
                                              : a.second.pixel_m < b.second.pixel_m;
  });
  return rows;
}

std::string paper_figures(double pixel_m) {
  for (const PaperRow& p : kPaper) {
    if (std::fabs(p.pixel_m - pixel_m) < 0.02 * p.pixel_m)
      return fmt::format("{:.2f} m, {:.2f} deg ({})", p.position_m, p.rotation_deg, p.boulders);
  }
  return "-";
}

void print(const std::vector<std::pair<Key, Row>>& rows) {
  std::string group = "none yet";
  for (const auto& [key, row] : rows) {
    const auto& f = row.figures;
    if (key.degrade != group) {
      group = key.degrade;
      fmt::print(
          "\n{} after {:.0f} m; median [range] of {} drives; VO alone ends {} m off in x, y ({} % in 3D, {} "
          "deg)\n",
          group.empty() ? "VO as it is," : fmt::format("VO made worse ({}),", group), median(f.at("path_m")),
          f.at("path_m").size(), told(f.at("vo_end_xy_m"), 3), told(f.at("vo_end_3d_percent"), 2),
          told(f.at("vo_rotation_deg"), 2));
      fmt::print("  {:<10} {:>9}  {:<22} {:<22} {:<20} {:<22} {:<20} {:<22} {:<10} {}\n", "map", "boulders",
                 "end x, y (m)", "largest x, y (m)", "end yaw (deg)", "end 3D (m)", "whole rotation (deg)",
                 "largest excess over VO (m)", "fixes", "paper: 3D, rotation (boulders)");
    }
    fmt::print("  {:<10} {:>9.0f}  {:<22} {:<22} {:<20} {:<22} {:<20} {:<22} {:<10} {}\n", key.map,
               median(f.at("map_boulders")), told(f.at("end_xy_m"), 3), told(f.at("largest_xy_m"), 3),
               told(f.at("yaw_deg"), 2), told(f.at("end_3d_m"), 3), told(f.at("end_rotation_deg"), 2),
               told(f.at("excess_m"), 3),
               fmt::format("{:.0f} of {:.0f}", median(f.at("fixes_applied")),
                           median(f.at("fixes_applied")) + median(f.at("fixes_declined"))),
               paper_figures(row.pixel_m));
  }
}

std::string csv(const std::vector<std::pair<Key, Row>>& rows) {
  std::string text = "degrade,map,pixel_m,drives";
  for (const char* name : kFigures) text += fmt::format(",{}_median,{}_min,{}_max", name, name, name);
  text += '\n';
  for (const auto& [key, row] : rows) {
    text += fmt::format("\"{}\",{},{:.6f},{}", key.degrade, key.map, row.pixel_m,
                        row.figures.at("path_m").size());
    for (const char* name : kFigures) {
      const std::vector<double>& v = row.figures.at(name);
      const auto [low, high] = std::minmax_element(v.begin(), v.end());
      text += fmt::format(",{:.5f},{:.5f},{:.5f}", median(v), *low, *high);
    }
    text += '\n';
  }
  return text;
}

struct TableOptions {
  std::vector<fs::path> runs;
  fs::path output;
};

void tabulate(const TableOptions& options) {
  std::map<Key, Row> table;
  for (const fs::path& run : options.runs) add(run, table);
  const auto rows = sorted(table);
  if (!options.output.empty()) write_file(options.output, csv(rows));
  print(rows);
}

}  // namespace

void add_table_command(Command app) {
  const auto options = std::make_shared<TableOptions>();
  Command command =
      app.add_command("table", "Errors of many runs by map and VO, beside Table I of the paper");
  command
      .add_option("runs", options->runs,
                  "folders that cairn run wrote; runs with maps of the same name "
                  "are grouped")
      .required();
  command.add_option("-o,--output", options->output, "the same as CSV").written();
  command.on_run([options] { tabulate(*options); });
}

}  // namespace cairn::ground
