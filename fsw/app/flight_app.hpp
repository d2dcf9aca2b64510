/// The flight module as a whole: images and commands in through `hal`, telemetry out. All its memory is in
/// this object, and the one instance of it is `cairn::app::root`.
///
/// The platform calls `cycle` from its main loop, as often as it can; each call spends about cfg::kSliceOps
/// operations, so that other work of the processor is never held up longer. Where there is nothing to do the
/// platform may sleep, but not past half the watchdog's period: only a cycle kicks.
///
/// A cycle: kick the watchdog, then the first of these that there is: go on with the minor frame, and report
/// it at its end; go on with the rectification of a raw pair; carry out one telecommand; go on with the
/// validation of a map, or with the verification of an upload; take the next pair. So no telecommand falls
/// into a minor frame, whatever the slicing.
///
/// Telecommands are judged in this order: packet (telecommand.hpp), sequence number (command_order.hpp),
/// values (command_content.hpp), then by who carries them out. What is refused changes nothing.
///
/// The map in use stays until another one is whole and good. `load map` validates the bank beside it: a good
/// map takes over, and where the bank turns out bad the map in use goes on as long as its own bytes are still
/// there (OrbitalMap::still_in), with what the upset cost it.
///
/// Pairs are judged by pair_order.hpp before anything is done with them. One that is let go begins no minor
/// frame and gives no report. Pairs that never came, or came while VO was at the one before, are missed: to
/// the localizer they are frames in the dark.
#pragma once

#include <cstdint>

#include "app/command_content.hpp"
#include "app/command_order.hpp"
#include "app/executive.hpp"
#include "app/pair_input.hpp"
#include "app/pair_order.hpp"
#include "app/pair_rectifier.hpp"
#include "app/telecommand.hpp"
#include "app/telemetry.hpp"

namespace cairn::app {

/// The mission's rig, as it stands in mission_cfg.
StereoRig mission_rig();

class FlightApp {
 public:
  /// Clears everything. kReady, or why the rig cannot be used. `raw`, borrowed for good, where the camera's
  /// pairs are raw; tables that do not fit are kBadRig.
  LocalizerStatus init(const LocalizerParams& params, const StereoRig& rig, const RawPairs* raw = nullptr);

  /// What a cycle left to do.
  enum class State : std::uint8_t {
    kIdle,  ///< nothing until something comes in; call again within half the watchdog's period
    kBusy,  ///< call again
  };
  State cycle(std::uint32_t slice_ops = cfg::kSliceOps);

  const Localizer& localizer() const { return localizer_; }
  const Executive& executive() const { return executive_; }

 private:
  bool take_command();  ///< false: nothing to do, here and below
  CommandStatus carry_out(Command& command, std::uint8_t& detail);
  CommandStatus set_start(Command& command, std::uint8_t& detail);
  CommandStatus set_trim(Command& command, std::uint8_t& detail);
  CommandStatus judge_for_pair(Command& command, std::uint8_t& detail) const;
  CommandStatus take_prior(Command& command, std::uint8_t& detail);
  CommandStatus take_attitude(Command& command, std::uint8_t& detail);
  CommandStatus load_map(std::uint8_t& detail);
  CommandStatus begin_upload(const UploadPlan& plan, std::uint8_t& detail);
  CommandStatus take_chunk(const Command& command, std::uint8_t& detail);
  CommandStatus use_upload(std::uint32_t id, std::uint8_t& detail);
  bool validate_map(WorkBudget& slice);
  bool verify_upload(WorkBudget& slice);
  bool take_pair();
  bool rectify_pair(WorkBudget& slice);
  void begin_pair(const ImageU8& left, const ImageU8& right);
  /// Tells the localizer of the pairs that never came before this one, with the priors that there are.
  void miss_pairs(std::uint32_t number);
  void end_minor();
  void report_minor();
  void report_fix();
  void report_health();
  void report_upload();
  template <typename Report>
  void send(const Report& report);

  Localizer localizer_;
  Executive executive_;
  MapValidation validation_;
  bool validating_ = false;
  MapStatus map_status_ = MapStatus::kIdle;  ///< of the last map that was judged for use
  MapTransfer transfer_;
  CommandOrder order_;
  MotionPriors priors_;
  Attitudes attitudes_;
  PairOrder pairs_;
  PairRectifier rectifier_;
  std::array<std::uint32_t, kPairStatusCount> pair_counts_{};  ///< by PairStatus
  std::uint32_t missed_pairs_ = 0;
  bool any_pair_ = false;
  std::uint32_t pair_number_ = 0;
  std::uint64_t pair_time_us_ = 0;
  std::uint32_t sequence_ = 0;
  std::uint32_t bad_priors_ = 0;
  std::uint32_t bad_attitudes_ = 0;
  std::array<std::uint32_t, kCommandStatusCount> commands_{};  ///< by CommandStatus
  std::uint32_t lost_packets_ = 0;
  Packet packet_;
  std::uint8_t left_[cfg::kImagePixels] = {};
  std::uint8_t right_[cfg::kImagePixels] = {};
};

/// What the root is made of, and the budgets of mission_cfg.
struct RootPart {
  const char* name;
  std::size_t bytes;
  std::size_t max_bytes;
};
inline constexpr RootPart kRootParts[] = {
    {"images", 2 * cfg::kImagePixels, 2 * cfg::kImagePixels},
    {"visual odometry", sizeof(VisualOdometry), cfg::kVoMaxBytes},
    {"boulder observer", sizeof(BoulderObserver), cfg::kObserverMaxBytes},
    {"  of it segmentation", sizeof(SegmentationJob), cfg::kSegmentationMaxBytes},
    {"boulder tracks and local map", sizeof(BoulderTracks) + sizeof(LocalMap), cfg::kTracksMaxBytes},
    {"relief", sizeof(Relief) + sizeof(ReliefStorage<cfg::kReliefSide>), cfg::kReliefMaxBytes},
    {"landmarks", sizeof(Landmarks), cfg::kLandmarksMaxBytes},
    {"registration", sizeof(IcpJob), cfg::kIcpJobMaxBytes},
    {"fix by the map", sizeof(MapFix), cfg::kMapFixMaxBytes},
    {"  of it map window", sizeof(MapBoulders), cfg::kMapWindowMaxBytes},
    {"  of it search in the whole map", sizeof(WideMap), cfg::kWideMapMaxBytes},
    {"map transfer", sizeof(MapTransfer), cfg::kTransferMaxBytes},
    {"root, all static memory", sizeof(FlightApp), cfg::kRootMaxBytes},
};
constexpr bool root_parts_fit() {
  for (const RootPart& part : kRootParts) {
    if (part.bytes > part.max_bytes) return false;
  }
  return true;
}
static_assert(root_parts_fit(), "static memory: a part is over its budget in mission_cfg (make size)");

extern FlightApp root;

}  // namespace cairn::app
