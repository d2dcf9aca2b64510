/// The other end of the flight module on the host, for tests: commands and pairs in, packets out.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "app/flight_app.hpp"
#include "dataset/image.hpp"
#include "platform/host/host_hal.hpp"
#include "support/cmocka.hpp"

namespace cairn::test {

/// Everything that came down, each kind in order. Static in a test file.
struct GroundStation {
  std::vector<app::FrameReport> frames;
  std::vector<app::FixReport> fixes;
  std::vector<app::BoulderReport> boulders;
  std::vector<app::AckReport> acks;
  std::vector<app::HealthReport> healths;
  std::vector<app::UploadReport> uploads;
  std::vector<std::uint32_t> sequences;

  /// An empty machine and a flight module as at power-on, listened to.
  void begin(const LocalizerParams& params, const StereoRig& rig) {
    *this = {};
    host::reset();
    listen();
    assert_status(app::root.init(params, rig), LocalizerStatus::kReady);
  }
  void listen() {
    host::on_telemetry([this](const std::uint8_t* bytes, std::size_t size) { take(bytes, size); });
  }
  /// No link: every packet is lost.
  static void cut() { host::on_telemetry(nullptr); }

  void run(std::uint32_t slice_ops = cfg::kSliceOps) {
    while (app::root.cycle(slice_ops) == app::FlightApp::State::kBusy) {
    }
  }

 private:
  template <typename Report>
  static bool keep(const std::uint8_t* bytes, std::size_t size, std::vector<Report>& out) {
    Report report;
    if (app::decode(bytes, size, report) != app::PacketStatus::kGood) return false;
    out.push_back(report);
    return true;
  }
  void take(const std::uint8_t* bytes, std::size_t size) {
    app::PacketHead head;
    assert_status(app::check_packet(bytes, size, head), app::PacketStatus::kGood);
    sequences.push_back(head.sequence);
    assert_true(keep(bytes, size, frames) || keep(bytes, size, fixes) || keep(bytes, size, boulders) ||
                keep(bytes, size, acks) || keep(bytes, size, healths) || keep(bytes, size, uploads));
  }
};

/// Gives a command without a number (0) the next one.
inline app::Command numbered(app::Command command) {
  static std::uint32_t last = 1000;
  if (command.sequence == 0) command.sequence = ++last;
  return command;
}

inline std::vector<std::uint8_t> packet_of(const app::Command& command) {
  static app::Packet packet;
  app::encode(numbered(command), packet);
  return {packet.begin(), packet.end()};
}

inline app::Command start_command(const Pose3& T_map_rover, std::uint32_t sequence = 0) {
  app::Command c;
  c.type = app::CommandType::kSetStart;
  c.sequence = sequence;
  c.pose = T_map_rover;
  c.number[0] = 0.05;
  c.number[1] = 0.01;
  return c;
}

inline void send(const app::Command& command) { host::feed_telecommand(packet_of(command)); }

inline host::Picture picture(ground::Image image) {
  return {image.width, image.height, std::move(image.pixels)};
}

}  // namespace cairn::test
