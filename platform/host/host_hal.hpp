/// The other side of `hal` on the host: what a replay puts in and takes out. One flight module a process.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "hal/camera.hpp"

namespace cairn::host {

/// A side without pixels is a missing image.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;
};

/// The next pair that the camera delivers.
void feed_pair(std::uint32_t number, std::uint64_t t_capture_us, Picture left, Picture right);
void feed_telecommand(std::vector<std::uint8_t> packet);
void load_map_bank(std::vector<std::uint8_t> bytes);
/// The spare bank, empty at first: kSpareBankBytes where nothing is said, none for 0.
void give_spare_bank(std::size_t bytes);
inline constexpr std::size_t kSpareBankBytes = 128 * 1024;
/// Whether the banks can be switched; they can where nothing is said.
void let_banks_switch(bool allowed);
/// Called with each telemetry packet.
void on_telemetry(std::function<void(const std::uint8_t*, std::size_t)> sink);
/// Everything as at the start of the process.
void reset();

}  // namespace cairn::host
