#include "campaign/findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mission_cfg.hpp"

namespace cairn::ground {
namespace {

using nlohmann::ordered_json;
using Runs = std::vector<const RunFigures*>;

struct Figure {
  const char* name;
  const char* words;
  double RunFigures::*value;
  Median RunFindings::*median;
  int decimals;
};
constexpr Figure kFigures[] = {
    {"vo_end_xy_m", "VO alone, end in x, y (m)", &RunFigures::vo_end_xy_m, &RunFindings::vo_end_xy_m, 3},
    {"vo_end_xy_percent", "  of the path (%)", &RunFigures::vo_end_xy_percent,
     &RunFindings::vo_end_xy_percent, 2},
    {"vo_end_3d_percent", "  in 3D, of the path (%)", &RunFigures::vo_end_3d_percent,
     &RunFindings::vo_end_3d_percent, 2},
    {"vo_end_yaw_deg", "  yaw (degrees)", &RunFigures::vo_end_yaw_deg, &RunFindings::vo_end_yaw_deg, 2},
    {"end_xy_m", "corrected, end in x, y (m)", &RunFigures::end_xy_m, &RunFindings::end_xy_m, 3},
    {"largest_xy_m", "  largest on the way (m)", &RunFigures::largest_xy_m, &RunFindings::largest_xy_m, 3},
    {"end_yaw_deg", "  yaw (degrees)", &RunFigures::end_yaw_deg, &RunFindings::end_yaw_deg, 2},
    {"excess_over_vo_m", "  largest excess over VO (m)", &RunFigures::excess_over_vo_m,
     &RunFindings::excess_over_vo_m, 3},
    {"median_fix_error_m", "  error after a fix (m)", &RunFigures::median_fix_error_m,
     &RunFindings::median_fix_error_m, 3},
};

RunFindings findings_of(const Runs& runs) {
  RunFindings f;
  for (const Figure& figure : kFigures) {
    std::vector<double> values;
    for (const RunFigures* run : runs) values.push_back(std::fabs(run->*figure.value));
    f.*figure.median = median_of(values);
  }
  std::size_t all = 0;
  for (const RunFigures* run : runs) {
    for (std::size_t v = 0; v < f.fixes.size(); ++v) {
      const auto count = static_cast<std::size_t>(run->fixes[v]);
      f.fixes[v].hits += count;
      all += count;
    }
  }
  for (Share& share : f.fixes) share.of = all;
  return f;
}

std::string told(const Median& m, int decimals) {
  if (m.n == 0) return "-";
  return fmt::format("{:.{}f} [{:.{}f}, {:.{}f}]", m.value, decimals, m.interval.low, decimals,
                     m.interval.high, decimals);
}

std::string told(const Share& s) {
  if (s.of == 0) return "-";
  const Interval i = s.interval();
  return fmt::format("{:.1f} [{:.1f}, {:.1f}] ({})", 100.0 * s.value(), 100.0 * i.low, 100.0 * i.high,
                     s.hits);
}

ordered_json json_of(const Median& m) {
  if (m.n == 0) return nullptr;
  return {{"median", m.value}, {"low", m.interval.low}, {"high", m.interval.high}, {"n", m.n}};
}

ordered_json json_of(const RunFindings& f) {
  ordered_json json;
  for (const Figure& figure : kFigures) json[figure.name] = json_of(f.*figure.median);
  for (int v = 0; v < kFixVerdicts; ++v) {
    const Share& s = f.fixes[static_cast<std::size_t>(v)];
    json["fixes"][name_of(static_cast<FixVerdict>(v))] = {{"count", s.hits},
                                                          {"of", s.of},
                                                          {"share", s.value()},
                                                          {"low", s.interval().low},
                                                          {"high", s.interval().high}};
  }
  return json;
}

ordered_json json_of(const Findings& f) {
  ordered_json json;
  if (f.map_pixel_m > 0.0) json["map_pixel_m"] = f.map_pixel_m;
  json["trials"] = f.trials;
  json["map_boulders"] = json_of(f.map_boulders);
  json["as_it_is"] = json_of(f.as_it_is);
  json["worse"] = json_of(f.worse);
  return json;
}

}  // namespace

Findings findings_of(const std::vector<Trial>& trials) {
  Findings f;
  f.trials = trials.size();
  std::vector<double> boulders;
  Runs as_it_is;
  Runs worse;
  for (const Trial& t : trials) {
    boulders.push_back(t.map_boulders);
    as_it_is.push_back(&t.as_it_is);
    worse.push_back(&t.worse);
  }
  f.map_boulders = median_of(boulders);
  f.as_it_is = findings_of(as_it_is);
  f.worse = findings_of(worse);
  return f;
}

std::vector<Findings> findings_by_map(const std::vector<Trial>& trials) {
  std::vector<Findings> all;
  for (const double pixel_m : kMapPixels_m) {
    std::vector<Trial> of_map;
    std::copy_if(trials.begin(), trials.end(), std::back_inserter(of_map),
                 [pixel_m](const Trial& t) { return t.setup.map_pixel_m == pixel_m; });
    if (of_map.empty()) continue;
    all.push_back(findings_of(of_map));
    all.back().map_pixel_m = pixel_m;
  }
  return all;
}

void print_findings(const std::vector<Trial>& trials) {
  const Findings all = findings_of(trials);
  std::vector<double> path_m;
  for (const Trial& t : trials) path_m.push_back(t.path_m);
  fmt::print("\n{} drives of {:.1f} m (median), seeds {} to {}; medians and shares with 95 % intervals{}\n",
             all.trials, median(path_m), trials.front().setup.seed, trials.back().setup.seed,
             all.trials < 6 ? " (of fewer than 6 drives: their range)" : "");
  fmt::print("  {:<28}  {:<34}  {}\n", "", "VO as it is", "VO made worse");
  for (const Figure& f : kFigures) {
    fmt::print("  {:<28}  {:<34}  {}\n", f.words, told(all.as_it_is.*f.median, f.decimals),
               told(all.worse.*f.median, f.decimals));
  }
  fmt::print("  {:<28}  {:<34}  {}\n", "fixes tried", all.as_it_is.fixes[0].of, all.worse.fixes[0].of);
  for (std::size_t v = 0; v < kFixVerdicts; ++v) {
    fmt::print("  {:<28}  {:<34}  {}\n", fmt::format("fixes {} (%)", name_of(static_cast<FixVerdict>(v))),
               told(all.as_it_is.fixes[v]), told(all.worse.fixes[v]));
  }
  fmt::print("\nBy map resolution\n  {:<6} {:>6} {:>8}  {:<10} {:<22} {:>5}", "map", "drives", "boulders",
             "VO", "end in x, y (m)", "fixes");
  for (int v = 0; v < kFixVerdicts; ++v)
    fmt::print("  {:<23}", fmt::format("{} (%)", name_of(static_cast<FixVerdict>(v))));
  fmt::print("\n");
  for (const Findings& f : findings_by_map(trials)) {
    for (const auto& [name, run] : {std::pair("as it is", &f.as_it_is), std::pair("made worse", &f.worse)}) {
      fmt::print("  {:<6} {:>6} {:>8.0f}  {:<10} {:<22} {:>5}", fmt::format("{:g} mm", 1.0e3 * f.map_pixel_m),
                 f.trials, f.map_boulders.value, name, told(run->end_xy_m, 3), run->fixes[0].of);
      for (const Share& s : run->fixes) fmt::print("  {:<23}", told(s));
      fmt::print("\n");
    }
  }
}

ordered_json findings_json(const std::vector<Trial>& trials) {
  ordered_json json;
  json["mission"] = cfg::kMission.name;
  json["first_seed"] = trials.front().setup.seed;
  json["right_within_m"] = kRightWithin_m;
  json["all"] = json_of(findings_of(trials));
  json["by_map"] = ordered_json::array();
  for (const Findings& f : findings_by_map(trials)) json["by_map"].push_back(json_of(f));
  return json;
}

}  // namespace cairn::ground
