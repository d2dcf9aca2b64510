/// A replay in numbers: the table that is printed, and `summary.json`.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/boulder_table.hpp"
#include "dataset/dataset.hpp"
#include "replay/replay.hpp"

namespace cairn::ground {

/// What was run.
struct RunTitle {
  std::string dataset;
  std::string map;           ///< file; empty: none
  double map_pixel_m = 0.0;  ///< of the orthoimage that the map was made from; 0: not known
  std::string variant = "cairn";
  std::string degrade;  ///< as given; empty: VO as it is
  std::filesystem::path ortho;
  std::vector<TableBoulder> orbital;   ///< the map's
  std::vector<TruthRock> truth_rocks;  ///< empty: not known
};

struct RunErrors {
  std::optional<TrajectoryErrors> vo;  ///< both or none
  std::optional<TrajectoryErrors> corrected;
};
RunErrors errors_of(const Replay& replay);

/// The largest amount by which the corrected error in x, y exceeds that of VO alone; 0 where it never does.
double largest_excess(const TrajectoryErrors& vo, const TrajectoryErrors& corrected);

/// How the poses came about.
struct MotionCounts {
  std::size_t frames = 0;
  std::size_t measured = 0;  ///< by VO
  std::size_t held = 0;
  std::size_t extrapolated = 0;
  std::size_t by_prior = 0;
  std::size_t doubted = 0;       ///< measured, and something speaks against it
  std::size_t frozen = 0;        ///< of those not measured: a picture was one of a frame before
  std::size_t frozen_left = 0;   ///< of these: the left one alone was that of the very frame before
  std::size_t frozen_right = 0;  ///< likewise the right one
  std::array<std::uint32_t, kVoStatusCount> why{};       ///< of the others not measured, by `VoStatus`
  std::array<std::uint32_t, kWatchStatusCount> doubt{};  ///< of those doubted, by `WatchStatus`
  bool noisy = false;  ///< more frames than those were looked at halved, for their noise
  double lens = 0.0;   ///< as estimated on board

  std::size_t unmeasured() const { return held + extrapolated + by_prior; }
  /// Most of those not measured are so for that.
  bool mostly_frozen() const { return 2 * frozen > unmeasured(); }
  /// `of 50 frames 7 held, 2 extrapolated`
  std::string words() const;
  /// What VO says that most of these lacked, or else what it doubts.
  std::string cause() const;
};
MotionCounts motion_counts(const Replay& replay);

/// What the pose at the end is worth by its own word, and of how many frames it said what: one that is lost
/// may lie near the truth by luck. Empty without frames.
std::string trust_words(const Replay& replay);

/// What was found out on board of the rig beyond its calibration, where that is more than a perfect rig's
/// matches fake; else empty.
std::string rig_words(const Replay& replay);

/// One line on the ground held against the map's heights; empty where none was.
std::string heights_words(const LocalizerHealth& health);

/// Where fewer than half of the measured gravities or headings were taken, a line each, with what is most
/// often wrong in them.
std::vector<std::string> attitude_doubts(const LocalizerHealth& health);

/// Where VO measured that the rover stands and no truth says the same, a line that tells of both readings:
/// all poses within 1 mm a frame of the first one (2 to 20 mm in all) and 0.5 degrees. Else empty.
std::string standing_words(const Replay& replay);

/// Where images are hardly in the order of time, a line that says so; else empty: VO turns back at more than
/// a quarter of the frames with steps of 5 mm and more before and behind them, and its places in the order in
/// which they lie along their line make a path of 0.7 of it at most. A drive out and back turns once.
std::string order_words(const Replay& replay);

/// Where stamps are hardly in seconds, a line that says so; else empty: times, not numbers of frames, by
/// which the rover drives less than 2 mm a second in steps of 5 s or more, or more than 60 m a second.
std::string pace_words(const Replay& replay);

/// Where VO and truth can hardly be of the same drive, a line that says so and what to look at; else empty:
/// on 0.3 m or more, VO's path is longer or shorter by a quarter or more, or ends a quarter of it off. Both
/// are taken over the frames that have truth.
std::string truth_words(const RunErrors& errors);

nlohmann::ordered_json summary_json(const RunTitle& title, const Replay& replay, const RunErrors& errors);

/// To stdout.
void print_table(const Replay& replay, const RunErrors& errors);

}  // namespace cairn::ground
