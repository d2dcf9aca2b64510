#include "platform/tape/player.hpp"

#include "app/flight_app.hpp"
#include "core/crc32.hpp"

extern "C" {
extern const std::uint8_t cairn_tape_begin[];
extern const std::uint8_t cairn_tape_end[];
}

namespace cairn::tape {
namespace {

Telemetry* heard = nullptr;

void listen(const std::uint8_t* packet, std::size_t size) {
  app::PacketHead head;
  if (app::check_packet(packet, size, head) != app::PacketStatus::kGood) {
    ++heard->bad;
    return;
  }
  const auto type = static_cast<app::TelemetryType>(head.type);
  std::uint32_t* sum = &heard->rest;
  if (type == app::TelemetryType::kFrame) {
    sum = &heard->poses;
    ++heard->frames;
    app::FrameReport frame;
    if (heard->on_frame != nullptr && app::decode(packet, size, frame) == app::PacketStatus::kGood)
      heard->on_frame(frame);
  } else if (type == app::TelemetryType::kFix) {
    sum = &heard->fixes;
    app::FixReport fix;
    const bool applied = app::decode(packet, size, fix) == app::PacketStatus::kGood &&
                         fix.status == static_cast<std::uint8_t>(FixStatus::kApplied);
    heard->applied += applied ? 1 : 0;
  } else if (type == app::TelemetryType::kBoulder) {
    sum = &heard->boulders;
  }
  *sum = crc32(packet, size, *sum);
}

}  // namespace

TapeStatus play(int frames, Telemetry& telemetry, std::uint32_t slice_ops) {
  const auto on_frame = telemetry.on_frame;
  telemetry = Telemetry();
  telemetry.on_frame = on_frame;
  heard = &telemetry;
  StereoRig rig = app::mission_rig();
  const TapeStatus status =
      open(cairn_tape_begin, static_cast<std::size_t>(cairn_tape_end - cairn_tape_begin), rig);
  if (status != TapeStatus::kReady) return status;
  on_telemetry(listen);
  if (app::root.init(LocalizerParams(), rig) != LocalizerStatus::kReady) return TapeStatus::kNoRig;
  // It is idle while a pair is on its way.
  while (telemetry.frames < frames &&
         (app::root.cycle(slice_ops) == app::FlightApp::State::kBusy || !at_end())) {
  }
  return TapeStatus::kReady;
}

}  // namespace cairn::tape
