// SPDX-License-Identifier: Apache-2.0
// All that Cairn asks of a board, each in a few lines: camera, link, map bank, watchdog, assertion
// handler. The camera of this example looks at a textured wall, moves to its right, and in the middle stands
// for three periods of the watchdog; a real one comes here.
#include "my_hal.hpp"

#include "app/flight_app.hpp"
#include "hal/camera.hpp"
#include "hal/link.hpp"
#include "hal/nvm.hpp"
#include "hal/watchdog.hpp"
#include "platform/bare/board.h"  // board_putc, board_exit: your own board's

namespace my {
namespace {

void print(const char* before, long number, const char* after) {
  char digits[12];
  int n = 0;
  unsigned long rest =
      number < 0 ? 0UL - static_cast<unsigned long>(number) : static_cast<unsigned long>(number);
  do digits[n++] = static_cast<char>('0' + rest % 10U);
  while ((rest /= 10U) != 0 && n < 11);
  if (number < 0) digits[n++] = '-';
  board_put(before);
  while (n > 0) board_putc(digits[--n]);
  board_put(after);
}

using cairn::cfg::kImageHeight;
using cairn::cfg::kImageWidth;
using cairn::cfg::kMission;

constexpr int kDisparity_px = 16;
constexpr int kShift_px = 6;  // a frame
// f b / d away, the wall moves by Z / f = b / d a pixel.
constexpr double kStep_m = kMission.baseline_m * kShift_px / kDisparity_px;
constexpr int kFrames = 6;

// In instructions of the emulated processor. The watchdog's period is several of the longest cycles.
constexpr std::uint64_t kWatchdogPeriod = 200'000'000;
constexpr std::uint64_t kLongestWait = kWatchdogPeriod / 2;
constexpr std::uint64_t kStand = 3 * kWatchdogPeriod;  // after half of the frames

int frames = 0;
int frames_right = 0;  // with the motion that the camera made
int camera_frames = 0;
std::uint64_t stands_until = 0;
bool start_commanded = false;
cairn::Pose3 last_pose;

std::uint64_t last_kick = 0;
std::uint64_t longest_unkicked = 0;
long kicks = 0;

/// A real watchdog is a device, and needs nobody to ask.
void watchdog_bites_where_late() {
  const std::uint64_t unkicked = board_instructions() - last_kick;
  if (unkicked > longest_unkicked) longest_unkicked = unkicked;
  if (unkicked <= kWatchdogPeriod) return;
  board_put("the watchdog resets the processor\n");
  board_exit(4);
}

bool has_pair() { return camera_frames < kFrames && board_instructions() >= stands_until; }

/// The drive of this example ends here; a rover's does not.
[[noreturn]] void end() {
  print("cycles ", kicks, "");
  print(", watchdog kicked after at most ", static_cast<long>(100 * longest_unkicked / kWatchdogPeriod),
        " % of its period");
  print(", stack ", static_cast<long>(board_stack_used()), " bytes");
  print(", frames as they should be ", frames_right, "");
  print(" of ", frames, "\n");
  board_exit(frames_right == frames ? 0 : 1);
}

std::uint32_t hash(int u, int v) {
  std::uint32_t h = static_cast<std::uint32_t>(u) * 0x9E3779B1U ^ static_cast<std::uint32_t>(v) * 0x85EBCA77U;
  h = (h ^ h >> 15U) * 0x2C1B3C6DU;
  h = (h ^ h >> 12U) * 0x297A2D39U;
  return h ^ h >> 15U;
}

/// 0 to 255: hashes on a grid of 2^log2_cell pixels, linear in between.
int noise(int u, int v, int log2_cell) {
  const int cell = 1 << log2_cell;
  const int column = u >> log2_cell;
  const int row = v >> log2_cell;
  const int x = u & (cell - 1);
  const int y = v & (cell - 1);
  const auto grey = [&](int i, int j) { return static_cast<int>(hash(column + i, row + j) & 255U); };
  const int upper = grey(0, 0) * (cell - x) + grey(1, 0) * x;
  const int lower = grey(0, 1) * (cell - x) + grey(1, 1) * x;
  return (upper * (cell - y) + lower * y) >> (2 * log2_cell);
}

void draw(std::uint8_t* pixels, int first_column) {
  for (int v = 0; v < kImageHeight; ++v) {
    for (int u = 0; u < kImageWidth; ++u) {
      const int grey = (3 * noise(u + first_column, v, 3) + noise(u + first_column, v, 5)) / 4;
      pixels[v * kImageWidth + u] = static_cast<std::uint8_t>(grey);
    }
  }
}

long um(double metres) { return static_cast<long>(metres * 1.0e6 + (metres < 0.0 ? -0.5 : 0.5)); }

void report(const cairn::app::FrameReport& frame) {
  const cairn::Vec3 step = last_pose.q.conjugate() * (frame.T_map_cam_vo.t - last_pose.t);
  last_pose = frame.T_map_cam_vo;
  const bool first = frames++ == 0;
  const cairn::Vec3 error = step - cairn::Vec3(kStep_m, 0.0, 0.0);
  const bool right = first ? frame.pose_source == static_cast<std::uint8_t>(cairn::PoseSource::kStart)
                           : frame.vo_status == static_cast<std::uint8_t>(cairn::VoStatus::kMotion) &&
                                 error.squaredNorm() < 1.0e-6;
  frames_right += right ? 1 : 0;
  print("frame ", static_cast<long>(frame.number), ": VO status ");
  print("", frame.vo_status, first ? " (first frame)" : " (motion)");
  print(", inliers ", frame.inliers, first ? "\n" : "");
  if (first) return;
  print(", moved right ", um(step.x()), "");
  print(", down ", um(step.y()), "");
  print(", forward ", um(step.z()), " um");
  print(" (true: ", um(kStep_m), ", 0, 0)\n");
  if (frames == kFrames) end();
}

}  // namespace

void wait_for_work() {  // a rover: the processor sleeps, a timer wakes it
  const std::uint64_t from = board_instructions();
  while (!has_pair() && board_instructions() - from < kLongestWait) watchdog_bites_where_late();
}

void safe_state() { board_exit(2); }

}  // namespace my

namespace cairn {

void assert_failed(const char* file, int line) {
  board_put("flight assertion failed: ");
  board_put(file);
  my::print(" line ", line, "\n");
  my::safe_state();
}

namespace hal {

bool camera_take(const StereoBuffer& buffer, StereoInfo& info) {
  if (!my::has_pair()) return false;
  if (buffer.left == nullptr || buffer.capacity < cfg::kImagePixels) return true;  // a pair that is let go
  const int moved = my::camera_frames * my::kShift_px;
  my::draw(buffer.left, moved);
  my::draw(buffer.right,
           moved + my::kDisparity_px);  // what the left camera sees at u, the right one sees at u - d
  info = StereoInfo();
  info.number = static_cast<std::uint32_t>(my::camera_frames++);
  if (my::camera_frames == my::kFrames / 2) my::stands_until = board_instructions() + my::kStand;
  info.t_capture_us = info.number * std::uint64_t{1000000};
  info.left_width = info.right_width = cfg::kImageWidth;
  info.left_height = info.right_height = cfg::kImageHeight;
  return true;
}

bool telemetry_send(const std::uint8_t* packet, std::size_t size) {
  app::FrameReport frame;
  if (app::decode(packet, size, frame) == app::PacketStatus::kGood) my::report(frame);
  return true;  // a rover: into the downlink's queue, false where that is full
}

/// One command, `set start`: nothing moves before it. A rover gets it from the ground.
std::size_t telecommand_receive(std::uint8_t* out, std::size_t capacity) {
  if (my::start_commanded) return 0;
  my::start_commanded = true;
  app::Command start;
  start.type = app::CommandType::kSetStart;
  start.number[0] = 0.05;  // m
  start.number[1] = 0.01;  // rad
  app::Packet packet;
  app::encode(start, packet);
  std::size_t size = 0;
  for (; size < packet.size() && size < capacity; ++size) out[size] = packet[size];
  return size;
}

Bytes map_bank() { return {}; }  // without a map, odometry runs alone; a rover: the bank with the .cmap

Room spare_map_bank() { return {}; }  // without it, uplinked maps are refused; a rover: its second bank

bool switch_map_banks() { return false; }  // a rover: which bank is in use, kept over resets

void watchdog_kick() {  // a rover: the watchdog's register
  my::watchdog_bites_where_late();
  my::last_kick = board_instructions();
  ++my::kicks;
}

}  // namespace hal
}  // namespace cairn
