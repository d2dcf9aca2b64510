/// One fix by itself: a local map of boulders against a map, by the flight module's own search, verdict and
/// covariance (localizer/map_fix.hpp), as its `Localizer` asks for them on the same parameters.
///
/// The local map lies in a frame `local` of its own, as the rover's site is one: metres, x and y at right
/// angles, anticlockwise. What is looked for is T_map_local.
///
/// With a prior the pivot of the search is the origin of `local`, since that is what the prior's sigmas speak
/// of; without one it is the middle of the boulders, so that it does not matter where that frame has its
/// origin. What comes out is always about the origin, its covariance with what an error of the yaw does in
/// second order there: far from the boulders a few milliradians are metres both ways.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "localizer/map_fix.hpp"

namespace cairn::ground {

/// A CSV table with a line of names: x or x_m, y or y_m; where known diameter (diameter_m, size), sigma
/// (sigma_m: error of the boulder's place in the local map, on an axis) and height (height_m: checked, and
/// not used, since the flight module's local map has none). Fields of the latter three may be empty or 0:
/// not known. Other columns are passed over.
///
/// Throws ToolError: cannot be read, a column missing, a field that is no number or out of its range, more
/// boulders than the flight module's local map holds, boulders farther than 100 km from one another.
LocalMap read_local_map(const std::filesystem::path& path);
double farthest_from_origin(const LocalMap& local);

/// Boulders that are of no use to a search and would spoil it for the others, taken out of a local map.
struct LeftOut {
  std::size_t far = 0;    ///< kFarSpreads times as far from the middle as half of all: one in ten at most
  std::size_t vague = 0;  ///< with a sigma beyond kMostUseful_m
};
LeftOut leave_out_useless(LocalMap& local);
inline constexpr double kFarSpreads = 8.0;
inline constexpr double kMostUseful_m = 1.0;

/// Independent errors of T_map_local: of x, y, and of the yaw.
struct LocalPrior {
  Pose2 T_map_local;
  double sigma_x_m = 0.0;  ///< these two: kLeastSigma_m to kMostSigma_m
  double sigma_y_m = 0.0;
  double sigma_yaw_rad = 0.0;  ///< kLeastSigma_rad to pi
};
inline constexpr double kLeastSigma_m = 1.0e-4;
inline constexpr double kMostSigma_m = 1.0e4;
inline constexpr double kLeastSigma_rad = 1.0e-5;
inline constexpr double kMostFromOrigin_m = 1.0e5;  ///< boulders with a prior, from the origin of `local`

/// Headings of `local` in map: from the first anticlockwise to the second.
struct Sector {
  double from_rad = -kPi;
  double width_rad = 2.0 * kPi;  ///< kLeastSector_rad to 2 pi
};
inline constexpr double kLeastSector_rad = 0.02;

struct OneFix {
  MapFixStatus status = MapFixStatus::kIdle;
  MapFixResult result;
  bool lost = false;               ///< looked for without the prior's help: there was none, or it is wide
  Pose2 T_map_local;               ///< what the map alone says, where accepted
  Mat3 covariance = Mat3::Zero();  ///< of its x, y, yaw (m, m, rad), where accepted
  std::uint64_t operations = 0;

  bool accepted() const { return status == MapFixStatus::kAccepted; }
  /// The verdict weighed something: its log ratio is one.
  bool weighed() const;
  bool has_second() const;  ///< of the second best pose
};

/// `map` is a validated one. Without a prior: anywhere in the map, at a heading of the sector. With one, as a
/// track is fixed; where a sector is given, too, anywhere within reach of its x and y (reach_sigmas) at a
/// heading of the sector, and inconsistent where that heading is beyond reach of its yaw.
OneFix fix_once(const MapFixParams& params, const OrbitalMap& map, const LocalMap& local,
                const std::optional<LocalPrior>& prior, const std::optional<Sector>& sector);

}  // namespace cairn::ground
