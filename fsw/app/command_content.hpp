/// The ranges of every number that a telecommand may bring, in one place, and the one judge of them. What
/// passes can make no number of the module infinite or NaN; what does not pass changes nothing.
///
/// Numbers of uploads (UploadPlan) and of chunks are judged where they are used: map_transfer.hpp.
#pragma once

#include <cstdint>

#include "app/telecommand.hpp"
#include "core/enum_count.hpp"
#include "core/nodiscard.hpp"
#include "localizer/localizer.hpp"
#include "orbital_map/cmap_format.hpp"

namespace cairn::app {

/// Why the content of `set start`, `set trim`, `motion prior` or `attitude` was not accepted.
enum class CAIRN_NODISCARD ContentStatus : std::uint8_t {
  kGood,
  kNotFinite,   ///< a number is NaN or infinite
  kSubnormal,   ///< a number is so small that nobody measured it: damage, or an error of the sender
  kPosition,    ///< no map lies there
  kHeight,      ///< no ground lies there
  kQuaternion,  ///< not of unit length
  kSigmaXy,     ///< out of its range
  kSigmaYaw,    ///< out of its range
  kScale,       ///< out of its range
  kTurn,        ///< out of its range
  kStep,        ///< farther than the rover goes between two pairs
  kRotation,    ///< more than it turns between them
  kPairFar,     ///< of a stereo pair that is far from coming
  kPairGone,    ///< of a stereo pair that was taken, or one before it
  kNothing,     ///< neither gravity nor heading
  kUp,          ///< not of unit length: more than gravity, or less
  kSigmaTilt,   ///< out of its range
  kHeading,     ///< out of its range
};
inline constexpr std::size_t kContentStatusCount = 18;
static_assert(enum_has<ContentStatus, kContentStatusCount>());

struct Range {
  double least;
  double most;
};

/// East and north, each way: as far as a map's origin may lie, where a double still tells 15 nm.
inline constexpr double kMaxStartPosition_m = cmap::kMaxCoordinate;
/// Up and down: several times the highest mountain of the planets.
inline constexpr double kMaxStartHeight_m = 1e5;
/// A quaternion's length may be off by so much, as one is that was sent with few digits; it is then made 1.
inline constexpr double kMaxLengthError = 1e-3;
/// From better than any survey, so that no fix is ever overruled by a claim, to a start that is unknown over
/// any map that a rover is looked for in.
inline constexpr Range kStartSigmaXy_m = {1e-3, 1e5};
/// From better than any star tracker to more than a full turn: heading unknown.
inline constexpr Range kStartSigmaYaw_rad = {1e-4, 10.0};
/// `set trim`: as StepTrim says.
inline constexpr Range kTrimScale = {StepTrim::kLeastScale, StepTrim::kMostScale};
inline constexpr Range kTrimTurn_rad_per_m = {-StepTrim::kMostTurn_rad_per_m, StepTrim::kMostTurn_rad_per_m};
/// A motion prior is refused from so many times the mission's largest step between two pairs on: wheels may
/// spin, and what VO is held against must be able to differ from it.
inline constexpr double kPriorSteps = 4.0;
inline constexpr double kMaxPriorStep_m = kPriorSteps * cfg::kMission.max_step_m;
inline constexpr double kMaxPriorRotation_rad = kPriorSteps * cfg::kMission.max_step_rad;
/// `attitude`: as the localizer says (attitude_fusion.hpp), where the part is there at all.
inline constexpr Range kAttitudeSigma_rad = {kLeastAttitudeSigma_rad, kMostAttitudeSigma_rad};
/// A turn either way, so that compasses of 0 to 360 degrees and of -180 to 180 are both at home.
inline constexpr Range kHeading_rad = {-2.0 * kPi, 2.0 * kPi};
/// The pair of a motion prior or attitude is at most so many numbers ahead of the last one taken.
inline constexpr std::uint32_t kMaxPairsAhead = 1000;

/// Judges `set start`, `set trim`, `motion prior` and `attitude` (all but the pair); kGood for any other
/// command. Makes a quaternion that is good to kMaxLengthError, but not to what is_valid(Pose3) asks for, one
/// of unit length.
ContentStatus judge_content(Command& command);
/// Judges the pair of a motion prior or attitude by the number of the last pair taken. Numbers may wrap.
ContentStatus judge_pair(std::uint32_t pair, std::uint32_t last_taken);

}  // namespace cairn::app
