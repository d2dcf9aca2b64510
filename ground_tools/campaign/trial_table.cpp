#include "campaign/trial_table.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "base/number_table.hpp"
#include "base/output_file.hpp"
#include "base/tool_error.hpp"
#include "mission_cfg.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDrawnNames =
    "mission,seed,k,sun_elevation_deg,sun_azimuth_deg,ortho_sun_elevation_deg,ortho_sun_azimuth_deg,map_"
    "pixel_m,"
    "kind,worse_scale,worse_yaw_deg_per_m";

/// What was drawn, as its line begins.
std::string drawn(const Setup& s) {
  return fmt::format("{},{},{},{},{},{},{},{},{},{},{}", cfg::kMission.name, s.seed, s.scene.rocks.k,
                     s.scene.sun.elevation_deg, s.scene.sun.azimuth_deg, s.scene.ortho_sun.elevation_deg,
                     s.scene.ortho_sun.azimuth_deg, s.map_pixel_m, sim::name_of(s.scene.traverse.kind),
                     s.worse_scale, s.worse_yaw_deg_per_m);
}

// What was found, once for names, writing and reading: a visitor is called with name, value, decimals.

template <typename V, typename Figures>
void visit_figures(const V& visit, const std::string& prefix, Figures& f) {
  visit(prefix + "vo_end_xy_m", f.vo_end_xy_m, 4);
  visit(prefix + "vo_end_xy_percent", f.vo_end_xy_percent, 3);
  visit(prefix + "vo_end_3d_percent", f.vo_end_3d_percent, 3);
  visit(prefix + "vo_end_yaw_deg", f.vo_end_yaw_deg, 3);
  visit(prefix + "end_xy_m", f.end_xy_m, 4);
  visit(prefix + "largest_xy_m", f.largest_xy_m, 4);
  visit(prefix + "end_yaw_deg", f.end_yaw_deg, 3);
  visit(prefix + "excess_over_vo_m", f.excess_over_vo_m, 4);
  visit(prefix + "median_fix_error_m", f.median_fix_error_m, 4);
  for (int v = 0; v < kFixVerdicts; ++v) {
    visit(prefix + "fixes_" + name_of(static_cast<FixVerdict>(v)), f.fixes[static_cast<std::size_t>(v)], 0);
  }
}

template <typename V, typename AnyTrial>
void visit_found(const V& visit, AnyTrial& t) {
  visit("map_boulders", t.map_boulders, 0);
  visit("frames", t.frames, 0);
  visit("path_m", t.path_m, 3);
  visit("seconds", t.seconds, 1);
  visit_figures(visit, "", t.as_it_is);
  visit_figures(visit, "worse_", t.worse);
}

std::string names() {
  std::string text = kDrawnNames;
  const Trial any;
  visit_found([&](const std::string& name, double, int) { text += "," + name; }, any);
  return text;
}

/// A finite number that fills the text; an empty text is NaN where there is nothing to tell.
bool read_number(const std::string& text, bool may_be_empty, double& value) {
  if (text.empty()) {
    value = std::numeric_limits<double>::quiet_NaN();
    return may_be_empty;
  }
  const std::optional<double> number = to_finite(text);
  value = number.value_or(0.0);
  return number.has_value();
}

/// The numbers of `text`, ",1,2,3"; false where one is no number, missing or too much.
bool read_found(const std::string& text, Trial& trial) {
  std::size_t at = 0;
  bool good = true;
  visit_found(
      [&](const std::string& name, double& value, int) {
        if (!good || at >= text.size() || text[at] != ',') {
          good = false;
          return;
        }
        const std::size_t end = std::min(text.find(',', at + 1), text.size());
        const bool may_be_empty = name.find("median_fix_error_m") != std::string::npos;
        good = read_number(text.substr(at + 1, end - at - 1), may_be_empty, value);
        at = end;
      },
      trial);
  return good && at == text.size();
}

}  // namespace

std::string to_csv(const std::vector<Trial>& trials) {
  std::string text = names() + "\n";
  for (const Trial& trial : trials) {
    text += drawn(trial.setup);
    visit_found(
        [&](const std::string&, double value, int decimals) {
          text += std::isnan(value) ? "," : fmt::format(",{:.{}f}", value, decimals);
        },
        trial);
    text += '\n';
  }
  return text;
}

std::vector<Trial> read_trials(const fs::path& path, std::uint64_t first_seed, Abundance abundance) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  const std::string text(bytes.begin(), bytes.end());
  const std::string mend = "give another folder, or remove this file to start again";
  std::vector<Trial> trials;
  int line = 0;
  for (std::size_t at = 0; at < text.size() || line == 0; ++line) {
    const std::size_t end = text.find('\n', at);
    const std::string words = text.substr(at, end - at);
    at = end == std::string::npos ? text.size() : end + 1;
    if (line == 0) {
      if (words != names())
        throw ToolError("{}: is not a table of trials of this version; {}", path.string(), mend);
      continue;
    }
    Trial trial;
    trial.setup = draw_setup(first_seed + trials.size(), abundance);
    const std::string head = drawn(trial.setup);
    if (words.compare(0, head.size(), head) != 0) {
      throw ToolError(
          "{}:{}: is not the trial of seed {} with mission {}: damaged, or another campaign's; {}",
          path.string(), line + 1, trial.setup.seed, cfg::kMission.name, mend);
    }
    if (end == std::string::npos || !read_found(words.substr(head.size()), trial)) {
      throw ToolError("{}:{}: is damaged; remove this line and all after it, and run again", path.string(),
                      line + 1);
    }
    trials.push_back(trial);
  }
  return trials;
}

std::vector<Trial> run_campaign(const fs::path& folder, std::size_t trials, std::uint64_t first_seed,
                                const RunTrial& run, Abundance abundance) {
  static_cast<void>(
      draw_setup(first_seed, abundance));  // a mission without a rig is told before anything is written
  make_folder(folder);
  const fs::path file = folder / "trials.csv";
  std::error_code ignored;
  std::vector<Trial> done;
  if (fs::exists(file, ignored)) done = read_trials(file, first_seed, abundance);
  write_file(file, to_csv(done));  // so that a folder that cannot be written is told before the work
  while (done.size() < trials) {
    Trial trial;
    trial.setup = draw_setup(first_seed + done.size(), abundance);
    run(trial);
    done.push_back(trial);
    write_file(file, to_csv(done));
  }
  return done;
}

}  // namespace cairn::ground
