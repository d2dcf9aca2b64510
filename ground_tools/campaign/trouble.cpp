#include "campaign/trouble.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/number_table.hpp"
#include "base/tool_error.hpp"
#include "campaign/findings.hpp"
#include "campaign/trial_table.hpp"
#include "cmap/cmap_file.hpp"
#include "replay/status_names.hpp"
#include "replay/summary.hpp"
#include "sim/hash_random.hpp"

namespace cairn::ground {
namespace {

using nlohmann::ordered_json;

constexpr const char* kNames[kTroubles] = {"start_error", "wrong_site", "slip", "dark", "kidnap"};

std::optional<Trouble> trouble_of(std::string_view name) {
  for (int t = 0; t < kTroubles; ++t) {
    if (name == kNames[t]) return static_cast<Trouble>(t);
  }
  return std::nullopt;
}

/// Of the drives under one trouble.
struct TroubleFindings {
  std::size_t drives = 0;
  std::array<Share, kFixVerdicts> fixes;
  Share right, misled;
  Median end_xy_m;
};

TroubleFindings findings_of(const std::vector<TroubledRun>& runs, Trouble trouble) {
  TroubleFindings f;
  std::vector<double> end_xy_m;
  std::size_t all = 0;
  for (const TroubledRun& run : runs) {
    if (run.trouble != trouble) continue;
    ++f.drives;
    f.right.hits += run.right() ? 1 : 0;
    f.misled.hits += run.misled() ? 1 : 0;
    end_xy_m.push_back(run.end_xy_m);
    for (std::size_t v = 0; v < run.fixes.size(); ++v) {
      f.fixes[v].hits += run.fixes[v];
      all += run.fixes[v];
    }
  }
  f.right.of = f.misled.of = f.drives;
  for (Share& share : f.fixes) share.of = all;
  f.end_xy_m = median_of(end_xy_m);
  return f;
}

ordered_json json_of(const Share& s) {
  const Interval i = s.interval();
  return {{"count", s.hits}, {"of", s.of}, {"share", s.value()}, {"low", i.low}, {"high", i.high}};
}

TroubledRun run_one(const Drive& drive, const std::vector<std::uint8_t>& map, const TroubleSetup& setup,
                    const std::function<void(double)>& progress) {
  const TroubledDrive troubled(drive, setup);
  ReplayOptions options;
  options.map = troubled_map(map, setup);
  const auto truth = troubled.truth_rover(0);
  if (!truth) throw ToolError("{}: has no truth to start from", drive.name());
  Pose3 start = *truth;
  start.t += Vec3(setup.start_error.x_m, setup.start_error.y_m, 0.0);
  start.q = lift({0.0, 0.0, setup.start_error.yaw_rad}).q * start.q;
  options.T_map_rover = start;
  options.start_sigma_xy_m = setup.start_sigma_xy_m;
  options.start_sigma_yaw_rad = setup.start_sigma_yaw_rad;
  const Replay replay = run_replay(troubled, options, progress);
  const RunErrors errors = errors_of(replay);
  if (!errors.corrected) throw ToolError("{}: the flight module reported no pose", drive.name());
  TroubledRun run;
  for (const JudgedFix& fix : judge_fixes(replay, troubled))
    ++run.fixes[static_cast<std::size_t>(fix.verdict)];
  run.end_xy_m = errors.corrected->end.xy_m;
  run.end_sigma_m = std::sqrt(2.0) * static_cast<double>(replay.frames.back().report.sigma_xy_m);
  run.end_trust = trust_name(replay.frames.back().report.trust);
  return run;
}

}  // namespace

const char* name_of(Trouble trouble) { return kNames[static_cast<int>(trouble)]; }

std::vector<Trouble> parse_troubles(const std::string& text) {
  std::vector<Trouble> troubles;
  for (const std::string_view name : split(text, ',')) {
    if (name == "all") {
      for (int t = 0; t < kTroubles; ++t) troubles.push_back(static_cast<Trouble>(t));
      continue;
    }
    const auto trouble = trouble_of(name);
    if (!trouble) {
      throw ToolError("--troubles: '{}' is none; give all, or names between commas: {}", name,
                      fmt::join(kNames, ", "));
    }
    troubles.push_back(*trouble);
  }
  std::sort(troubles.begin(), troubles.end());
  troubles.erase(std::unique(troubles.begin(), troubles.end()), troubles.end());
  return troubles;
}

TroubleSetup draw_trouble(std::uint64_t seed, Trouble trouble, std::size_t pairs, double step_m) {
  const auto number = static_cast<std::uint64_t>(trouble);
  const auto in = [&](std::uint64_t k, double low, double high) {
    return low + (high - low) * sim::uniform(seed, sim::Stream::kTrouble, number, k);
  };
  const auto gauss = [&](std::uint64_t k) { return sim::normal(seed, sim::Stream::kTrouble, number, k); };
  TroubleSetup s;
  switch (trouble) {
    case Trouble::kStartError:
      s.start_sigma_xy_m = in(0, 0.5, 5.0);
      s.start_sigma_yaw_rad = in(1, 2.0, 20.0) * kRadPerDeg;
      s.start_error = {s.start_sigma_xy_m * gauss(2), s.start_sigma_xy_m * gauss(3),
                       s.start_sigma_yaw_rad * gauss(4)};
      break;
    case Trouble::kWrongSite: s.mirrored = true; break;
    case Trouble::kSlip:
      s.gone = static_cast<std::size_t>(in(0, 0.6, 1.2) / step_m);
      s.first = static_cast<std::size_t>(in(1, 0.2, 0.5) * static_cast<double>(pairs));
      break;
    case Trouble::kDark: {
      constexpr std::size_t kBlack[] = {9, 25, 100};
      s.black = kBlack[seed % std::size(kBlack)];
      s.first = static_cast<std::size_t>(in(0, 0.15, 0.3) * static_cast<double>(pairs));
      break;
    }
    case Trouble::kKidnap: {
      const SinCos to = sin_cos(in(0, -kPi, kPi));
      const double far_m = in(1, 3.0, 8.0);
      s.start_error = {far_m * to.cos, far_m * to.sin, kPi};
      break;
    }
  }
  return s;
}

FrameTag TroubledDrive::tag(std::size_t index) const {
  return {static_cast<int>(index), static_cast<double>(index)};
}

PairImages TroubledDrive::images(std::size_t index) const {
  PairImages pair = drive_.images(of(index));
  if (index >= setup_.first && index < setup_.first + setup_.black) {
    std::fill(pair.left.pixels.begin(), pair.left.pixels.end(), std::uint8_t{0});
    std::fill(pair.right.pixels.begin(), pair.right.pixels.end(), std::uint8_t{0});
  }
  return pair;
}

std::vector<std::uint8_t> troubled_map(const std::vector<std::uint8_t>& map, const TroubleSetup& setup) {
  if (!setup.mirrored) return map;
  CmapContent content = decode_cmap(map, "site.cmap");
  const MapExtent& e = content.extent;
  for (TableBoulder& b : content.boulders) b.p_map_m.x() = e.min_x_m + e.max_x_m - b.p_map_m.x();
  return encode_cmap(content.boulders, content.extent, content.quantum_m, {});
}

bool TroubledRun::misled() const {
  const bool known = end_trust == "lost" || end_trust == "unconfirmed" || end_xy_m <= 3.0 * end_sigma_m;
  return !right() && !known;
}

std::vector<TroubledRun> run_troubles(const Drive& drive, const std::vector<std::uint8_t>& map,
                                      std::uint64_t seed, const std::vector<Trouble>& troubles,
                                      const std::function<void(double)>& progress) {
  const auto truth = [&](std::size_t i) { return drive.truth_rover(i).value_or(Pose3()).t; };
  double path_m = 0.0;
  for (std::size_t i = 1; i < drive.size(); ++i) path_m += (truth(i) - truth(i - 1)).norm();
  const double step_m = path_m / static_cast<double>(drive.size());
  std::vector<TroubledRun> runs;
  for (const Trouble trouble : troubles) {
    const double done = static_cast<double>(runs.size());
    runs.push_back(run_one(drive, map, draw_trouble(seed, trouble, drive.size(), step_m), [&](double share) {
      progress((done + share) / static_cast<double>(troubles.size()));
    }));
    runs.back().seed = seed;
    runs.back().trouble = trouble;
  }
  return runs;
}

std::string to_csv(const std::vector<TroubledRun>& runs) {
  std::string text =
      "seed,trouble,fixes_right,fixes_weak,fixes_declined,fixes_false,end_xy_m,end_sigma_m,"
      "end_trust,end\n";
  for (const TroubledRun& r : runs) {
    text += fmt::format("{},{},{},{:.4f},{:.4f},{},{}\n", r.seed, name_of(r.trouble), fmt::join(r.fixes, ","),
                        r.end_xy_m, r.end_sigma_m, r.end_trust,
                        r.right() ? "right" : (r.misled() ? "misled" : "known"));
  }
  return text;
}

std::vector<TroubledRun> read_troubles(const std::filesystem::path& path) {
  const CsvTable table(path, kMendTrial);
  if (table.cut_off()) throw ToolError("{}: its last line is cut off; {}", path.string(), kMendTrial);
  const std::size_t name = table.column("trouble"), trust = table.column("end_trust");
  std::vector<TroubledRun> runs;
  for (std::size_t row = 0; row < table.size(); ++row) {
    const auto number = [&](const std::string& column) {
      return table.number(row, table.column(column.c_str()));
    };
    const auto trouble = trouble_of(table.word(row, name));
    if (!trouble) {
      throw ToolError("{}:{}: '{}' is no trouble; {}", path.string(), table.line(row), table.word(row, name),
                      kMendTrial);
    }
    TroubledRun run;
    run.seed = static_cast<std::uint64_t>(number("seed"));
    run.trouble = *trouble;
    for (int v = 0; v < kFixVerdicts; ++v) {
      run.fixes[static_cast<std::size_t>(v)] =
          static_cast<std::size_t>(number(std::string("fixes_") + name_of(static_cast<FixVerdict>(v))));
    }
    run.end_xy_m = number("end_xy_m");
    run.end_sigma_m = number("end_sigma_m");
    run.end_trust = table.word(row, trust);
    runs.push_back(run);
  }
  return runs;
}

void print_troubles(const std::vector<TroubledRun>& runs) {
  if (runs.empty()) return;
  fmt::print(
      "\nUnder troubles: fixes, and the pose at the end\n  {:<12} {:>6}  {:<28}  {:<22} {:>14} {:>14}\n", "",
      "drives", "right/weak/declined/false", "end in x, y (m)", "right", "misled");
  for (int t = 0; t < kTroubles; ++t) {
    const TroubleFindings f = findings_of(runs, static_cast<Trouble>(t));
    if (f.drives == 0) continue;
    const auto share = [](const Share& s) { return fmt::format("{} of {}", s.hits, s.of); };
    fmt::print("  {:<12} {:>6}  {:<28}  {:<22} {:>14} {:>14}\n", kNames[t], f.drives,
               fmt::format("{}/{}/{}/{}", f.fixes[0].hits, f.fixes[1].hits, f.fixes[2].hits, f.fixes[3].hits),
               fmt::format("{:.3f} [{:.3f}, {:.3f}]", f.end_xy_m.value, f.end_xy_m.interval.low,
                           f.end_xy_m.interval.high),
               share(f.right), share(f.misled));
  }
}

ordered_json troubles_json(const std::vector<TroubledRun>& runs) {
  ordered_json json = ordered_json::object();
  for (int t = 0; t < kTroubles; ++t) {
    const TroubleFindings f = findings_of(runs, static_cast<Trouble>(t));
    if (f.drives == 0) continue;
    ordered_json& of = json[kNames[t]];
    of["drives"] = f.drives;
    of["end_xy_m"] = {
        {"median", f.end_xy_m.value}, {"low", f.end_xy_m.interval.low}, {"high", f.end_xy_m.interval.high}};
    of["end_right"] = json_of(f.right);
    of["end_misled"] = json_of(f.misled);
    for (int v = 0; v < kFixVerdicts; ++v)
      of["fixes"][name_of(static_cast<FixVerdict>(v))] = json_of(f.fixes[static_cast<std::size_t>(v)]);
  }
  return json;
}

}  // namespace cairn::ground
