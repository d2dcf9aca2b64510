#include "platform/host/host_hal.hpp"

#include <algorithm>
#include <cstring>
#include <deque>
#include <utility>

#include "hal/link.hpp"
#include "hal/nvm.hpp"
#include "hal/watchdog.hpp"

namespace cairn {
namespace {

struct Pair {
  std::uint32_t number;
  std::uint64_t t_capture_us;
  host::Picture left;
  host::Picture right;
};

struct Machine {
  std::deque<Pair> pairs;
  std::deque<std::vector<std::uint8_t>> commands;
  std::vector<std::uint8_t> map;
  std::vector<std::uint8_t> spare = std::vector<std::uint8_t>(host::kSpareBankBytes);
  bool banks_switch = true;
  std::function<void(const std::uint8_t*, std::size_t)> sink;
};

Machine& machine() {
  static Machine instance;
  return instance;
}

/// Copies a picture where it has pixels and fits; else leaves the side missing.
bool deliver(const host::Picture& picture, std::uint8_t* out, std::size_t capacity, int& width, int& height) {
  if (picture.pixels.empty() || picture.pixels.size() > capacity) return false;
  std::memcpy(out, picture.pixels.data(), picture.pixels.size());
  width = picture.width;
  height = picture.height;
  return true;
}

}  // namespace

namespace host {

void feed_pair(std::uint32_t number, std::uint64_t t_capture_us, Picture left, Picture right) {
  machine().pairs.push_back({number, t_capture_us, std::move(left), std::move(right)});
}
void feed_telecommand(std::vector<std::uint8_t> packet) { machine().commands.push_back(std::move(packet)); }
void load_map_bank(std::vector<std::uint8_t> bytes) { machine().map = std::move(bytes); }
void give_spare_bank(std::size_t bytes) { machine().spare.assign(bytes, 0); }
void let_banks_switch(bool allowed) { machine().banks_switch = allowed; }
void on_telemetry(std::function<void(const std::uint8_t*, std::size_t)> sink) {
  machine().sink = std::move(sink);
}
void reset() { machine() = Machine(); }

}  // namespace host

namespace hal {

bool camera_take(const StereoBuffer& buffer, StereoInfo& info) {
  std::deque<Pair>& pairs = machine().pairs;
  if (pairs.empty()) return false;
  const Pair& pair = pairs.front();
  info = StereoInfo();
  info.number = pair.number;
  info.t_capture_us = pair.t_capture_us;
  deliver(pair.left, buffer.left, buffer.capacity, info.left_width, info.left_height);
  deliver(pair.right, buffer.right, buffer.capacity, info.right_width, info.right_height);
  pairs.pop_front();
  return true;
}

bool telemetry_send(const std::uint8_t* packet, std::size_t size) {
  if (!machine().sink) return false;
  machine().sink(packet, size);
  return true;
}

std::size_t telecommand_receive(std::uint8_t* out, std::size_t capacity) {
  std::deque<std::vector<std::uint8_t>>& commands = machine().commands;
  if (commands.empty()) return 0;
  const std::size_t size = commands.front().size() < capacity ? commands.front().size() : capacity;
  std::copy_n(commands.front().begin(), size, out);
  commands.pop_front();
  return size;
}

Bytes map_bank() { return {machine().map.data(), machine().map.size()}; }

Room spare_map_bank() { return {machine().spare.data(), machine().spare.size()}; }

bool switch_map_banks() {
  Machine& m = machine();
  if (!m.banks_switch) return false;
  std::swap(m.map, m.spare);  // what they hold stays where it is
  return true;
}

void watchdog_kick() {}

}  // namespace hal
}  // namespace cairn
