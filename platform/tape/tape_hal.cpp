#include "platform/tape/tape_hal.hpp"

#include <cstring>

#include "core/big_endian.hpp"
#include "hal/camera.hpp"
#include "hal/link.hpp"
#include "hal/nvm.hpp"
#include "hal/watchdog.hpp"
#include "platform/tape/tape_format.hpp"

namespace cairn {
namespace tape {
namespace {

/// What is copied of each image in one call: the processor does it, and no call may be long.
constexpr std::size_t kPieceBytes = 8192;

struct Deck {
  const std::uint8_t* next = nullptr;  ///< the record that comes; its structure has been checked
  std::size_t copied[2] = {};          ///< bytes of its images, where it is a pair, that have been delivered
  hal::Bytes map;
  void (*sink)(const std::uint8_t*, std::size_t) = nullptr;
};
Deck deck;

Record type() { return static_cast<Record>(be::get_u32(deck.next)); }
std::uint32_t size() { return be::get_u32(deck.next + 4); }
const std::uint8_t* body() { return deck.next + kRecordHeaderBytes; }
std::size_t padded(std::uint32_t bytes) { return (std::size_t{bytes} + 3U) & ~std::size_t{3}; }
std::size_t pixels_of(const std::uint8_t* extent) {
  return std::size_t{be::get_u32(extent)} * be::get_u32(extent + 4);
}
void advance() {
  deck.next += kRecordHeaderBytes + padded(size());
  deck.copied[0] = deck.copied[1] = 0;
}

/// The map bank is written when the tape comes to it, not when the module asks.
void write_banks() {
  while (deck.next != nullptr && type() == Record::kMapBank) {
    deck.map = {body(), size()};
    advance();
  }
}

bool is_sound(Record record, const std::uint8_t* bytes, std::uint32_t count) {
  if (record == Record::kRig) return count == kRigBytes;
  if (record != Record::kPair) return record <= Record::kPair;
  if (count < kPairHeaderBytes) return false;
  std::uint64_t pixels = 0;
  for (int side = 0; side < 2; ++side) {
    const std::uint32_t width = be::get_u32(bytes + 12 + 8 * side);
    const std::uint32_t height = be::get_u32(bytes + 16 + 8 * side);
    if (width > kMaxExtent || height > kMaxExtent) return false;
    pixels += std::uint64_t{width} * height;
  }
  return pixels == count - kPairHeaderBytes;
}

TapeStatus check(const std::uint8_t* bytes, std::size_t size) {
  if (size < kHeaderBytes || be::get_u32(bytes) != kMagic) return TapeStatus::kNoTape;
  if (be::get_u32(bytes + 4) != kVersion) return TapeStatus::kVersion;
  std::size_t at = kHeaderBytes;
  for (bool first = true;; first = false) {
    if (size - at < kRecordHeaderBytes) return TapeStatus::kTruncated;
    const auto record = static_cast<Record>(be::get_u32(bytes + at));
    const std::uint32_t count = be::get_u32(bytes + at + 4);
    at += kRecordHeaderBytes;
    if (count > size - at || padded(count) > size - at) return TapeStatus::kTruncated;
    if (first != (record == Record::kRig)) return TapeStatus::kNoRig;
    if (!is_sound(record, bytes + at, count)) return TapeStatus::kBadRecord;
    if (record == Record::kEnd) return TapeStatus::kReady;
    at += padded(count);
  }
}

/// Copies the next piece of an image of the tape into the camera's buffer, or leaves the side out where it
/// has no room. False: there is more of it.
bool deliver(const std::uint8_t* from, const std::uint8_t* extent, std::size_t capacity, std::uint8_t* to,
             std::size_t& copied, int& width, int& height) {
  const std::size_t pixels = pixels_of(extent);
  if (to == nullptr || pixels == 0 || pixels > capacity) return true;
  const std::size_t left = pixels - copied;
  const std::size_t piece = left < kPieceBytes ? left : kPieceBytes;
  std::memcpy(to + copied, from + copied, piece);
  copied += piece;
  width = static_cast<int>(be::get_u32(extent));
  height = static_cast<int>(be::get_u32(extent + 4));
  return copied == pixels;
}

}  // namespace

TapeStatus open(const std::uint8_t* bytes, std::size_t size, StereoRig& rig) {
  deck = Deck();
  const TapeStatus status = check(bytes, size);
  if (status != TapeStatus::kReady) return status;
  deck.next = bytes + kHeaderBytes;
  const std::uint8_t* p = body();
  rig.width_px = static_cast<int>(be::get_u32(p));
  rig.height_px = static_cast<int>(be::get_u32(p + 4));
  rig.fx_px = be::get_f64(p + 8);
  rig.fy_px = be::get_f64(p + 16);
  rig.cx_px = be::get_f64(p + 24);
  rig.cy_px = be::get_f64(p + 32);
  rig.baseline_m = be::get_f64(p + 40);
  advance();
  write_banks();
  return status;
}

void on_telemetry(void (*sink)(const std::uint8_t* packet, std::size_t size)) { deck.sink = sink; }

bool at_end() { return deck.next == nullptr || type() == Record::kEnd; }

}  // namespace tape

namespace hal {

using tape::deck;

bool camera_take(const StereoBuffer& buffer, StereoInfo& info) {
  if (tape::at_end() || tape::type() != tape::Record::kPair) return false;
  const std::uint8_t* p = tape::body();
  info = StereoInfo();
  info.number = be::get_u32(p);
  info.t_capture_us = be::get_u64(p + 4);
  const std::uint8_t* left = p + tape::kPairHeaderBytes;
  const std::uint8_t* right = left + tape::pixels_of(p + 12);
  if (!tape::deliver(left, p + 12, buffer.capacity, buffer.left, deck.copied[0], info.left_width,
                     info.left_height) ||
      !tape::deliver(right, p + 20, buffer.capacity, buffer.right, deck.copied[1], info.right_width,
                     info.right_height))
    return false;
  tape::advance();
  tape::write_banks();
  return true;
}

bool telemetry_send(const std::uint8_t* packet, std::size_t size) {
  if (deck.sink == nullptr) return false;
  deck.sink(packet, size);
  return true;
}

std::size_t telecommand_receive(std::uint8_t* out, std::size_t capacity) {
  if (tape::at_end() || tape::type() != tape::Record::kTelecommand) return 0;
  const std::size_t size = tape::size() < capacity ? tape::size() : capacity;
  std::memcpy(out, tape::body(), size);
  tape::advance();
  tape::write_banks();
  return size;
}

Bytes map_bank() { return deck.map; }

Room spare_map_bank() { return {}; }  // a tape brings its maps whole

bool switch_map_banks() { return false; }

void watchdog_kick() {}

}  // namespace hal
}  // namespace cairn
