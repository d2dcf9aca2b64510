/// The flight module as a whole: images and commands in through `hal`, telemetry out. All its memory is in
/// this object, and the one instance of it is `cairn::app::root`.
///
/// The platform calls `cycle` from its main loop, as often as it can; each call spends about cfg::kSliceOps
/// operations, so that other work of the processor is never held up longer. A cycle: kick the watchdog, then
/// the first of these that there is: go on with the minor frame, and report it at its end; carry out one
/// telecommand; go on with the validation of a map; take the next pair. So no telecommand falls into a minor
/// frame, and what it does depends on no slicing.
#pragma once

#include <cstdint>

#include "app/executive.hpp"
#include "app/telecommand.hpp"
#include "app/telemetry.hpp"

namespace cairn::app {

/// The mission's rig, as it stands in mission_cfg.
StereoRig mission_rig();

class FlightApp {
 public:
  /// Clears everything. kReady, or why the rig cannot be used.
  LocalizerStatus init(const LocalizerParams& params, const StereoRig& rig);

  /// What a cycle left to do.
  enum class State : std::uint8_t {
    kIdle,  ///< nothing until something comes in
    kBusy,  ///< call again
  };
  State cycle(std::uint32_t slice_ops = cfg::kSliceOps);

  const Localizer& localizer() const { return localizer_; }
  const Executive& executive() const { return executive_; }

  /// Bytes of a part of the root, for `make size` and the budget in mission_cfg.
  struct Part {
    const char* name;
    std::size_t bytes;
  };
  static constexpr int kParts = 9;
  static const Part* parts();

 private:
  bool take_command();  ///< false: nothing to do, here and below
  CommandStatus carry_out(const Command& command, std::uint8_t& detail);
  bool validate_map(WorkBudget& slice);
  bool take_pair();
  void report_minor();
  void report_fix();
  void report_health();
  template <typename Report>
  void send(const Report& report);

  Localizer localizer_;
  Executive executive_;
  MapValidation validation_;
  bool validating_ = false;
  Pose3 prior_;
  bool have_prior_ = false;
  std::uint32_t pair_number_ = 0;
  std::uint64_t pair_time_us_ = 0;
  std::uint32_t sequence_ = 0;
  std::uint32_t bad_commands_ = 0;
  std::uint32_t lost_packets_ = 0;
  Packet packet_;
  std::uint8_t left_[cfg::kImagePixels] = {};
  std::uint8_t right_[cfg::kImagePixels] = {};
};

static_assert(sizeof(FlightApp) <= cfg::kRootMaxBytes, "static memory: over the budget in mission_cfg");

extern FlightApp root;

}  // namespace cairn::app
