/// A replay of the sample over the map of its true rocks, as the bytes of its telemetry.
#pragma once

#include <cstdint>
#include <vector>

#include "integration/replay.hpp"
#include "replay/replay.hpp"

namespace cairn::test {

/// Frame, fix and boulder packets as they are coded, all with sequence 0. No time of this machine is in them.
struct ReplayBytes {
  std::vector<std::uint8_t> frames;
  std::vector<std::uint8_t> fixes;
  std::vector<std::uint8_t> boulders;
  std::vector<std::uint8_t> counts;  ///< the executive's and the localizer's, in packets of health
  std::size_t applied = 0;
};

template <typename Report>
void append(const Report& report, std::vector<std::uint8_t>& out) {
  static app::Packet packet;
  app::encode(report, 0, packet);
  out.insert(out.end(), packet.begin(), packet.end());
}

inline ReplayBytes replay_sample(std::size_t frames, std::uint32_t slice_ops) {
  static FlightMap map;
  assert_status(map.make(true_rocks(kSample)), MapStatus::kUsable);
  ground::ReplayOptions options;
  options.map = map.bytes;
  options.end_frame = frames;
  options.slice_ops = slice_ops;
  const ground::Replay replay = ground::run_replay(ground::Dataset::open(kSample), options, nullptr);
  assert_int_equal(replay.frames.size(), frames);
  ReplayBytes bytes;
  for (const ground::ReplayFrame& f : replay.frames) append(f.report, bytes.frames);
  for (const app::FixReport& f : replay.fixes) {
    append(f, bytes.fixes);
    bytes.applied += f.status == static_cast<std::uint8_t>(FixStatus::kApplied) ? 1U : 0U;
  }
  for (const auto& [id, boulder] : replay.boulders) append(boulder, bytes.boulders);
  app::HealthReport health;
  health.frames = replay.health.frames;
  health.vo = replay.health.vo;
  health.boulders = replay.health.boulders;
  health.fixes = replay.health.fixes;
  health.overruns = replay.executive.overruns;
  health.dropped_pairs = replay.executive.dropped_pairs;
  append(health, bytes.counts);
  return bytes;
}

}  // namespace cairn::test
