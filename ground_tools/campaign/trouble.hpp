/// What a drive meets when something goes wrong: the axes of a campaign beside VO made worse. Each is a
/// replay of its own over a trial's drive and map.
///
///   start_error  start off by its sigma: 0.5 to 5 m on an axis, 2 to 20 degrees; that sigma is claimed
///   wrong_site   the map is mirrored: no place in it is a place of the site
///   slip         the rover slides 0.6 to 1.2 m on between two pairs, some way into the drive
///   dark         9, 25 or 100 pairs in a row are black
///   kidnap       start 3 to 8 m and 180 degrees off
///
/// All but the first claim a start good to 0.05 m and 0.01 rad.
///
/// A map that is turned would be no other site: a lost rover rightly finds itself in it.
///
/// What came of a drive: its fixes by verdict (fix_verdict.hpp), and whether its last pose is right (within
/// 0.15 m), known to be bad (trust says unconfirmed or lost, or it is within three sigmas), or neither:
/// misled.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/statistics.hpp"
#include "campaign/fix_verdict.hpp"
#include "dataset/drive.hpp"

namespace cairn::ground {

enum class Trouble : std::uint8_t { kStartError, kWrongSite, kSlip, kDark, kKidnap };
inline constexpr int kTroubles = 5;
const char* name_of(Trouble trouble);

/// "all", or names between commas. Throws ToolError that lists them.
std::vector<Trouble> parse_troubles(const std::string& text);

/// How one is carried out; what is not concerned stays as here.
struct TroubleSetup {
  Pose2 start_error;  ///< of the rover in map: x, y, and its heading
  double start_sigma_xy_m = 0.05;
  double start_sigma_yaw_rad = 0.01;
  std::size_t first = 0;  ///< index of the first pair that is gone or black
  std::size_t gone = 0;   ///< pairs that were never taken
  std::size_t black = 0;  ///< pairs without light
  bool mirrored = false;  ///< the map, east for west
};
/// Pure: the same seed gives the same. `step_m`: from pair to pair; `pairs`: of the drive, 200 and more for
/// the longest dark stretch to fit.
TroubleSetup draw_trouble(std::uint64_t seed, Trouble trouble, std::size_t pairs, double step_m);

/// The drive as the rover then meets it: pairs numbered in a row. Borrows `drive`.
class TroubledDrive : public Drive {
 public:
  TroubledDrive(const Drive& drive, const TroubleSetup& setup) : drive_(drive), setup_(setup) {}
  std::string name() const override { return drive_.name(); }
  const StereoRig& rig() const override { return drive_.rig(); }
  std::size_t size() const override { return drive_.size() - setup_.gone; }
  FrameTag tag(std::size_t index) const override;
  PairImages images(std::size_t index) const override;
  std::optional<Pose3> truth_cam(std::size_t index) const override { return drive_.truth_cam(of(index)); }
  std::optional<Pose3> truth_rover(std::size_t index) const override { return drive_.truth_rover(of(index)); }
  const std::vector<TruthRock>& truth_rocks() const override { return drive_.truth_rocks(); }

 private:
  std::size_t of(std::size_t index) const { return index < setup_.first ? index : index + setup_.gone; }

  const Drive& drive_;
  TroubleSetup setup_;
};

/// The map that is given to the rover: `map` itself, or mirrored about the middle of its ground.
std::vector<std::uint8_t> troubled_map(const std::vector<std::uint8_t>& map, const TroubleSetup& setup);

/// What came of one drive.
struct TroubledRun {
  std::uint64_t seed = 0;
  Trouble trouble = Trouble::kStartError;
  std::array<std::size_t, kFixVerdicts> fixes = {};
  double end_xy_m = 0.0;
  double end_sigma_m = 0.0;  ///< root of the trace
  std::string end_trust;

  bool right() const { return end_xy_m <= kRightWithin_m; }
  bool misled() const;  ///< neither right nor known to be bad
};

/// Replays the drive under each trouble.
std::vector<TroubledRun> run_troubles(const Drive& drive, const std::vector<std::uint8_t>& map,
                                      std::uint64_t seed, const std::vector<Trouble>& troubles,
                                      const std::function<void(double)>& progress);

/// A line of names, then a line a drive.
std::string to_csv(const std::vector<TroubledRun>& runs);
/// Throws ToolError where the file is damaged.
std::vector<TroubledRun> read_troubles(const std::filesystem::path& path);

/// By trouble, those that there are: to stdout, and as JSON.
void print_troubles(const std::vector<TroubledRun>& runs);
nlohmann::ordered_json troubles_json(const std::vector<TroubledRun>& runs);

}  // namespace cairn::ground
