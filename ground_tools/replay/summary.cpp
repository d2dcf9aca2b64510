#include "replay/summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/statistics.hpp"
#include "replay/status_names.hpp"

namespace cairn::ground {
namespace {

using nlohmann::ordered_json;

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

/// Share of the ground boulders that lie within 0.10 m of a true rock.
std::optional<double> boulder_precision(const Replay& replay, const std::vector<TruthRock>& rocks) {
  if (rocks.empty() || replay.boulders.empty()) return std::nullopt;
  int near = 0;
  for (const auto& [id, b] : replay.boulders) {
    const Vec2 p(b.x_m, b.y_m);
    near += std::any_of(rocks.begin(), rocks.end(),
                        [&](const TruthRock& r) { return (r.p_map_m - p).norm() <= 0.10; })
                ? 1
                : 0;
  }
  return static_cast<double>(near) / static_cast<double>(replay.boulders.size());
}

template <std::size_t N>
ordered_json counts_json(const std::array<std::uint32_t, N>& counts, std::string (*name)(std::uint8_t)) {
  ordered_json json = ordered_json::object();
  for (std::size_t i = 0; i < N; ++i) {
    if (counts[i] != 0) json[name(static_cast<std::uint8_t>(i))] = counts[i];
  }
  return json;
}

}  // namespace

RunErrors errors_of(const Replay& replay) {
  return {compare(replay.vo, replay.truth), compare(replay.corrected, replay.truth)};
}

double largest_excess(const TrajectoryErrors& vo, const TrajectoryErrors& corrected) {
  double excess = 0.0;
  for (std::size_t i = 0; i < vo.poses.size() && i < corrected.poses.size(); ++i) {
    excess = std::max(excess, corrected.poses[i].xy_m - vo.poses[i].xy_m);
  }
  return excess;
}

namespace {

std::string doubt_words(const std::array<std::uint32_t, kWatchStatusCount>& doubt) {
  switch (static_cast<WatchStatus>(std::max_element(doubt.begin(), doubt.end()) - doubt.begin())) {
    case WatchStatus::kMostlyStill:
      return "most of what is seen stands still while the rest moves: if it is the rover itself, draw it and give --mask";
    case WatchStatus::kJumped:
      return "boulders in view are not where they were, so that VO missed a motion (frames left out, a slip?)";
    default: return "another sensor tells of another motion";
  }
}

}  // namespace

std::string MotionCounts::words() const {
  std::string text = fmt::format("of {} frames {} held, {} extrapolated", frames, held, extrapolated);
  if (by_prior > 0) text += fmt::format(", {} by prior", by_prior);
  if (doubted > 0) text += fmt::format(", {} doubted", doubted);
  return text;
}

std::string MotionCounts::cause() const {
  if (unmeasured() == 0) return doubt_words(doubt);
  if (mostly_frozen()) {
    const bool left = 2 * frozen_left > frozen, right = 2 * frozen_right > frozen;
    return fmt::format(
        "{} are those of frames before, to the bit (a camera or its recording has frozen, or frames are "
        "given twice?)",
        left    ? "left images"
        : right ? "right images"
                : "images");
  }
  const auto most = static_cast<VoStatus>(std::max_element(why.begin(), why.end()) - why.begin());
  const bool few =
      most == VoStatus::kFewStereo || most == VoStatus::kFewMatches || most == VoStatus::kNoConsensus;
  if (few && noisy) return "images are too noisy for what the ground shows";
  if (few && lens != 0.0) {
    return fmt::format("the lens seems distorted beyond what the calibration tells (k1 about {:.3f})", lens);
  }
  switch (most) {
    case VoStatus::kBadImage: return "images are missing, unreadable, or of another size";
    case VoStatus::kFewFeatures: return "images show too little texture (dark, saturated, blurred?)";
    case VoStatus::kFewStereo:
      return "too few points are found in both images of a pair (not rectified, disparities beyond the mission's, or "
             "not of the same moment?)";
    case VoStatus::kFewMatches:
    case VoStatus::kNoConsensus:
      return "too few points agree from frame to frame (steps too large, frames out of order, or most of the image "
             "moves by itself?)";
    case VoStatus::kImplausible:
      return "steps would be larger than a rover's (wrong baseline, or frames out of order?)";
    default: return "VO says nothing of the cause";
  }
}

MotionCounts motion_counts(const Replay& replay) {
  MotionCounts counts;
  counts.frames = replay.frames.size();
  counts.lens = replay.offset.lens;
  for (const ReplayFrame& f : replay.frames) {
    const auto source = static_cast<PoseSource>(f.report.pose_source);
    if (source == PoseSource::kStart || source == PoseSource::kNone) continue;
    counts.measured += source == PoseSource::kVo ? 1U : 0U;
    counts.held += source == PoseSource::kHeld ? 1U : 0U;
    counts.extrapolated += source == PoseSource::kExtrapolated ? 1U : 0U;
    counts.by_prior += source == PoseSource::kPrior ? 1U : 0U;
    counts.doubted += source == PoseSource::kDoubted ? 1U : 0U;
    if (source == PoseSource::kDoubted) ++counts.doubt.at(f.report.watch);
    if (source == PoseSource::kVo || source == PoseSource::kDoubted) continue;
    if (f.report.watch != static_cast<std::uint8_t>(WatchStatus::kFrozen)) {
      ++counts.why.at(f.report.vo_status);
      continue;
    }
    ++counts.frozen;
    counts.frozen_left += f.left_again && !f.right_again ? 1U : 0U;
    counts.frozen_right += f.right_again && !f.left_again ? 1U : 0U;
  }
  counts.noisy = replay.health.halved > counts.unmeasured();
  return counts;
}

std::string rig_words(const Replay& replay) {
  std::string words;
  const auto add = [&words](const std::string& text) { words += (words.empty() ? "" : "; ") + text; };
  const ImageOffset& o = replay.offset;
  if (o.rows_px != 0.0)
    add(fmt::format("right images lie {:.2f} px {}", std::fabs(o.rows_px),
                    o.rows_px > 0.0 ? "lower" : "higher"));
  if (o.columns_px != 0.0)
    add(fmt::format("disparities are {:.2f} px too {}", std::fabs(o.columns_px),
                    o.columns_px > 0.0 ? "short" : "long"));
  if (o.lens != 0.0) add(fmt::format("lens k1 of about {:.3f}", o.lens));
  return words;
}

std::string trust_words(const Replay& replay) {
  if (replay.frames.empty()) return {};
  std::array<std::size_t, kTrustCount> frames{};
  for (const ReplayFrame& f : replay.frames) {
    if (f.report.trust < frames.size()) ++frames[f.report.trust];
  }
  std::string counts;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i] > 0)
      counts += fmt::format("{}{} {}", counts.empty() ? "" : ", ", trust_name(static_cast<std::uint8_t>(i)),
                            frames[i]);
  }
  const app::FrameReport& end = replay.frames.back().report;
  const bool lost = end.trust == static_cast<std::uint8_t>(Trust::kLost);
  const std::string sigma = lost ? "" : fmt::format(", {:.2f} m in x and y (1 sigma)", end.sigma_xy_m);
  return fmt::format("pose at the end: {}{}; of all frames {}", trust_name(end.trust), sigma, counts);
}

std::vector<std::string> attitude_doubts(const LocalizerHealth& health) {
  std::vector<std::string> doubts;
  const auto add = [&doubts](const auto& counts, const char* what, const char* mend) {
    std::uint32_t came = 0;
    std::string others;
    for (std::size_t i = 1; i < counts.size(); ++i) {  // 0: none came
      came += counts[i];
      if (counts[i] > 0 && i != static_cast<std::size_t>(AttitudeStatus::kFused))
        others += fmt::format("{}{} {}", others.empty() ? "" : ", ", counts[i],
                              attitude_status_name(static_cast<std::uint8_t>(i)));
    }
    const std::uint32_t taken = counts[static_cast<std::size_t>(AttitudeStatus::kFused)];
    if (2 * taken < came)
      doubts.push_back(fmt::format("of {} measured {} {} taken ({}); {}", came, what,
                                   taken == 0 ? "none was" : fmt::format("{} were", taken), others, mend));
  };
  add(health.gravity, "gravities",
      "is `up` away from gravity, in the rover frame (forward, left, up), of a rover that stood, and its sigma true?");
  add(health.headings, "headings",
      "is yaw in degrees, counter-clockwise from east (90 minus a compass heading), and its sigma true?");
  return doubts;
}

std::string heights_words(const LocalizerHealth& health) {
  if (std::accumulate(health.heights.begin(), health.heights.end(), 0U) == 0) return {};
  const auto count = [&health](AttitudeStatus status) {
    return health.heights[static_cast<std::size_t>(status)];
  };
  return fmt::format("heights of the map: taken {} times, inconsistent {}", count(AttitudeStatus::kFused),
                     count(AttitudeStatus::kInconsistent));
}

namespace {

struct Extent {
  double away_m = 0.0;
  double turn_rad = 0.0;
};

/// The farthest from the first pose.
Extent extent_of(const Trajectory& trajectory) {
  Extent most;
  for (const StampedPose& at : trajectory) {
    const Pose3 step = trajectory.front().pose.inverse() * at.pose;
    most.away_m = std::max(most.away_m, step.t.norm());
    most.turn_rad = std::max(most.turn_rad, quat_log(step.q).norm());
  }
  return most;
}

/// Slow rovers move by millimetres a frame, and VO's noise by tenths of one.
bool stands(const Trajectory& trajectory) {
  constexpr double kStep_m = 0.001, kLeast_m = 0.002, kMost_m = 0.020, kTurn_rad = 0.5 * kRadPerDeg;
  const Extent extent = extent_of(trajectory);
  return extent.away_m <= std::clamp(kStep_m * static_cast<double>(trajectory.size()), kLeast_m, kMost_m) &&
         extent.turn_rad <= kTurn_rad;
}

}  // namespace

std::string standing_words(const Replay& replay) {
  if (replay.vo.size() < 2 || !stands(replay.vo)) return {};
  if (replay.truth.size() == replay.vo.size() && stands(replay.truth)) return {};
  const Extent extent = extent_of(replay.vo);
  return fmt::format(
      "nothing moved: over {} frames VO stays within {:.1f} mm and {:.2f} degrees of its start; right where the "
      "rover stood, else its pictures show no ground that goes by (its own deck, one scene again and again?)",
      replay.vo.size(), 1.0e3 * extent.away_m, extent.turn_rad * kDegPerRad);
}

namespace {

double path_of(const std::vector<Vec3>& places_m) {
  double path_m = 0.0;
  for (std::size_t i = 1; i < places_m.size(); ++i) path_m += (places_m[i] - places_m[i - 1]).norm();
  return path_m;
}

std::vector<Vec3> places_of(const Trajectory& trajectory) {
  std::vector<Vec3> out;
  for (const StampedPose& at : trajectory) out.push_back(at.pose.t);
  return out;
}

/// In the order in which they lie along their line: from their mean to the place farthest from it.
std::vector<Vec3> along_their_line(std::vector<Vec3> places_m) {
  const Vec3 mean_m = std::accumulate(places_m.begin(), places_m.end(), Vec3(0.0, 0.0, 0.0)) /
                      static_cast<double>(places_m.size());
  const Vec3 end_m = *std::max_element(places_m.begin(), places_m.end(), [&](const Vec3& a, const Vec3& b) {
    return (a - mean_m).norm() < (b - mean_m).norm();
  });
  const Vec3 line_m = end_m - mean_m;
  std::sort(places_m.begin(), places_m.end(),
            [&](const Vec3& a, const Vec3& b) { return a.dot(line_m) < b.dot(line_m); });
  return places_m;
}

}  // namespace

std::string order_words(const Replay& replay) {
  constexpr double kLeastStep_m = 0.005, kShorter = 0.7;
  const std::vector<Vec3> places_m = places_of(replay.vo);
  std::size_t turns = 0, back = 0;
  for (std::size_t i = 2; i < places_m.size(); ++i) {
    const Vec3 before_m = places_m[i - 1] - places_m[i - 2], step_m = places_m[i] - places_m[i - 1];
    if (before_m.norm() < kLeastStep_m || step_m.norm() < kLeastStep_m) continue;
    ++turns;
    back += before_m.dot(step_m) < 0.0 ? 1U : 0U;
  }
  if (back < 2 || 4 * back <= turns) return {};
  const double path_m = path_of(places_m), sorted_m = path_of(along_their_line(places_m));
  if (sorted_m > kShorter * path_m) return {};
  return fmt::format(
      "VO turns back at {} of {} frames, {:.2f} m in all, and the same places in another order are a drive of {:.2f} "
      "m: the order of the images' names is not that of time; name them so that it is",
      back, turns, path_m, sorted_m);
}

std::string pace_words(const Replay& replay) {
  constexpr double kLeastPath_m = 0.3, kLongStep_s = 5.0, kSlow_m_s = 0.002, kFast_m_s = 60.0;
  std::vector<double> steps_s;
  bool numbers = true;  // of frames, in place of times
  for (std::size_t i = 0; i < replay.vo.size() && i < replay.frames.size(); ++i) {
    numbers = numbers && replay.vo[i].stamp_s == static_cast<double>(replay.frames[i].report.number);
    if (i > 0) steps_s.push_back(replay.vo[i].stamp_s - replay.vo[i - 1].stamp_s);
  }
  if (numbers || steps_s.empty() || extent_of(replay.vo).away_m < kLeastPath_m) return {};
  const double step_s = median(steps_s);
  const double step_m = path_of(places_of(replay.vo)) / static_cast<double>(steps_s.size());
  const bool slow = step_s >= kLongStep_s && step_m < kSlow_m_s * step_s;
  if (!slow && step_m < kFast_m_s * step_s) return {};
  return fmt::format(
      "stamps are {:.3g} s and VO's steps {:.3g} m apart, {:.3g} m an hour; are the times {}? write seconds",
      step_s, step_m, 3600.0 * step_m / step_s, slow ? "milliseconds" : "in a larger unit");
}

std::string truth_words(const RunErrors& errors) {
  constexpr double kLeastPath_m = 0.3, kMostScale = 1.25, kMostOff = 0.25;
  if (!errors.vo) return {};
  const TrajectoryErrors& vo = *errors.vo;
  double away_m = 0.0;  // of the estimate from the start: jitter is no path
  for (const PoseError& e : vo.poses) away_m = std::max(away_m, e.estimated_away_m);
  if (std::max(vo.path_m, away_m) < kLeastPath_m) return {};
  const double ratio = vo.estimated_path_m / vo.path_m;
  if (ratio > kMostScale || ratio < 1.0 / kMostScale) {
    return fmt::format(
        "VO's path is {:.2f} m, the true one {:.4g} m{}; are baseline and focal length those of these images, and "
        "is the truth in metres, and of this drive?",
        vo.estimated_path_m, vo.path_m, vo.path_m == 0.0 ? " (it never moves)" : "");
  }
  if (vo.end.xyz_m < kMostOff * vo.path_m) return {};
  return fmt::format(
      "VO ends {:.2f} m off the truth after {:.2f} m; is the truth that of the left camera (T_map_cam, or KITTI's "
      "axes), and of these frames?",
      vo.end.xyz_m, vo.path_m);
}

ordered_json summary_json(const RunTitle& title, const Replay& replay, const RunErrors& errors) {
  ordered_json s;
  s["mission"] = cfg::kMission.name;
  s["dataset"] = title.dataset;
  s["map"] = title.map;
  s["map_pixel_m"] = title.map_pixel_m;
  s["map_boulders"] = title.orbital.size();
  s["variant"] = title.variant;
  s["degrade"] = title.degrade;
  s["frames"] = replay.frames.size();
  if (errors.vo && errors.corrected) {
    s["path_m"] = errors.vo->path_m;
    s["vo"] = errors_json(*errors.vo);
    s["corrected"] = errors_json(*errors.corrected);
    s["largest_excess_over_vo_m"] = largest_excess(*errors.vo, *errors.corrected);
  }
  if (const auto share = boulder_precision(replay, title.truth_rocks))
    s["boulders_within_0.10_m_of_a_rock"] = *share;
  s["boulders"] = replay.boulders.size();
  if (!replay.frames.empty()) {
    s["rates"] = {
        {"scale", replay.frames.back().report.scale},
        {"turn_deg_per_m", replay.frames.back().report.turn_rad_per_m * static_cast<float>(kDegPerRad)}};
  }
  s["rig"] = {{"rows_px", replay.offset.rows_px},  {"columns_px", replay.offset.columns_px},
              {"lens", replay.offset.lens},        {"turn_x_rad", replay.angles[0]},
              {"turn_z_rad", replay.angles[1]},    {"baseline_y_rad", replay.angles[2]},
              {"baseline_z_rad", replay.angles[3]}};
  const MotionCounts motion = motion_counts(replay);
  s["counts"]["poses"] = {{"measured", motion.measured},         {"held", motion.held},
                          {"extrapolated", motion.extrapolated}, {"by_prior", motion.by_prior},
                          {"doubted", motion.doubted},           {"frozen", motion.frozen}};
  s["counts"]["vo"] = counts_json(replay.health.vo, vo_status_name);
  s["counts"]["boulders"] = counts_json(replay.health.boulders, observe_status_name);
  s["counts"]["fixes"] = counts_json(replay.health.fixes, fix_status_name);
  s["counts"]["gravity"] = counts_json(replay.health.gravity, attitude_status_name);
  s["counts"]["headings"] = counts_json(replay.health.headings, attitude_status_name);
  s["counts"]["heights"] = counts_json(replay.health.heights, attitude_status_name);
  s["counts"]["overruns"] = counts_json(replay.executive.overruns, task_name);
  s["counts"]["unreadable_images"] = replay.unreadable_images;
  s["counts"]["halved"] = replay.health.halved;
  s["counts"]["extrapolated"] = replay.health.extrapolated;
  s["counts"]["abandoned_boulders"] = replay.health.abandoned_boulders;
  s["counts"]["dropped_tracks"] = replay.health.dropped_tracks;
  s["counts"]["dropped_pairs"] = replay.executive.dropped_pairs;
  s["counts"]["bad_priors"] = replay.health.bad_priors;
  if (!title.map.empty()) s["map_status"] = map_status_name(replay.map_status);
  for (const app::RootPart& part : app::kRootParts) s["memory_bytes"][part.name] = part.bytes;
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

void print_table(const Replay& replay, const RunErrors& errors) {
  const auto& [vo, corrected] = errors;
  std::size_t applied = 0;
  for (const app::FixReport& f : replay.fixes) {
    applied += f.status == static_cast<std::uint8_t>(FixStatus::kApplied) ? 1U : 0U;
  }
  fmt::print("{} frames, {} fixes applied of {}, {} ground boulders\n", replay.frames.size(), applied,
             replay.fixes.size(), replay.boulders.size());
  if (const std::string trust = trust_words(replay); !trust.empty()) fmt::print("{}\n", trust);
  if (const std::string rig = rig_words(replay); !rig.empty())
    fmt::print("found out on board of the rig: {}\n", rig);
  const auto count = [](const auto& of, AttitudeStatus status) {
    return of[static_cast<std::size_t>(status)];
  };
  const LocalizerHealth& h = replay.health;
  std::uint32_t attitudes = 0;
  for (std::size_t i = 0; i < kAttitudeStatusCount; ++i) attitudes += h.gravity[i] + h.headings[i];
  if (attitudes > 0)
    fmt::print(
        "attitudes: gravity taken {} times, inconsistent {}; headings taken {} times, inconsistent {}\n",
        count(h.gravity, AttitudeStatus::kFused), count(h.gravity, AttitudeStatus::kInconsistent),
        count(h.headings, AttitudeStatus::kFused), count(h.headings, AttitudeStatus::kInconsistent));
  if (const std::string heights = heights_words(h); !heights.empty()) fmt::print("{}\n", heights);
  if (!vo || !corrected) {
    fmt::print("no truth in the data set: no errors are computed\n");
    return;
  }
  fmt::print("errors after {:.2f} m          VO alone   corrected\n", vo->path_m);
  const auto row = [](const char* name, double a, double b, const char* unit) {
    fmt::print("  {:<24} {:>10.3f}  {:>10.3f}  {}\n", name, a, b, unit);
  };
  row("end, x and y", vo->end.xy_m, corrected->end.xy_m, "m");
  row("largest, x and y", vo->largest_xy.xy_m, corrected->largest_xy.xy_m, "m");
  row("end, 3D", vo->end.xyz_m, corrected->end.xyz_m, "m");
  if (vo->path_m > 0.0)
    row("end, 3D share of path", vo->percent_of_path(vo->end.xyz_m),
        corrected->percent_of_path(corrected->end.xyz_m), "%");
  row("end, yaw", vo->end.yaw_deg, corrected->end.yaw_deg, "degrees");
  row("end, whole rotation", vo->end.rotation_deg, corrected->end.rotation_deg, "degrees");
}

}  // namespace cairn::ground
