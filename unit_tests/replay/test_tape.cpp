// Tapes made by hand, byte by byte as doc/ICD.md has them: each fault has its status, and a good tape gives
// what is on it, in its order.
#include <cstring>

#include "hal/camera.hpp"
#include "hal/link.hpp"
#include "hal/nvm.hpp"
#include "platform/tape/tape_hal.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using tape::TapeStatus;

namespace {

std::uint8_t bytes[100000];
std::size_t size = 0;

void u32(std::uint32_t v) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes[size++] = static_cast<std::uint8_t>(v >> shift);
}
void header() {
  std::memset(bytes, 0xEE, sizeof bytes);
  size = 0;
  u32(0x43544150);
  u32(1);
}
void record(std::uint32_t type, std::uint32_t body) {
  u32(type);
  u32(body);
}
/// 8 x 4 pixels; fx 1.5, fy -2, cx 0.25, cy 4, baseline 0.125: few bits each.
void rig() {
  record(1, 48);
  for (const std::uint32_t v :
       {8U, 4U, 0x3FF80000U, 0U, 0xC0000000U, 0U, 0x3FD00000U, 0U, 0x40100000U, 0U, 0x3FC00000U, 0U})
    u32(v);
}
void pair(std::uint32_t number, std::uint32_t left_width, std::uint32_t left_height,
          std::uint32_t right_width, std::uint32_t right_height, std::uint32_t pixels) {
  record(4, 28 + pixels);
  for (const std::uint32_t v : {number, 1U, number, left_width, left_height, right_width, right_height})
    u32(v);
  for (std::uint32_t i = 0; i < pixels; ++i) bytes[size++] = static_cast<std::uint8_t>(number + i);
  while (size % 4 != 0) bytes[size++] = 0;
}
void text(std::uint32_t type, const char* body) {
  record(type, static_cast<std::uint32_t>(std::strlen(body)));
  for (; *body != '\0'; ++body) bytes[size++] = static_cast<std::uint8_t>(*body);
  while (size % 4 != 0) bytes[size++] = 0;
}
void end() { record(0, 0); }

std::uint8_t left[8], right[8];
StereoRig out;
hal::StereoInfo info;

bool take() {
  std::memset(left, 0, sizeof left);
  return hal::camera_take({left, right, sizeof left}, info);
}

/// Refused, and then there is nothing on it.
void check_refused(TapeStatus status) {
  assert_status(tape::open(bytes, size, out), status);
  assert_true(tape::at_end());
  assert_false(take());
  assert_int_equal(hal::telecommand_receive(left, sizeof left), 0);
  assert_int_equal(hal::map_bank().size, 0);
}

void test_no_tape(void**) {
  header();
  size = 0;
  check_refused(TapeStatus::kNoTape);
  size = 7;
  check_refused(TapeStatus::kNoTape);
  size = 8;
  for (int i = 0; i < 4; ++i) {
    bytes[i] ^= 1U;
    check_refused(TapeStatus::kNoTape);
    bytes[i] ^= 1U;
  }
}

void test_version(void**) {
  for (const int at : {4, 7}) {
    header();
    bytes[at] ^= 2U;
    rig();
    end();
    check_refused(TapeStatus::kVersion);
  }
}

void test_truncated(void**) {
  header();
  rig();
  text(2, "abcde");  // ends in padding
  pair(1, 3, 1, 1, 2, 5);
  const std::size_t whole = size + 8;
  end();
  for (size = 8; size < whole; ++size) check_refused(TapeStatus::kTruncated);
  assert_status(tape::open(bytes, size, out), TapeStatus::kReady);
  for (const std::uint32_t body : {0xFFFFFFFFU, 0xFFFFFFFDU, 0x80000000U, 4000U}) {
    header();
    rig();
    record(3, body);
    end();
    check_refused(TapeStatus::kTruncated);
  }
}

void test_no_rig(void**) {
  header();
  end();
  check_refused(TapeStatus::kNoRig);
  header();
  text(2, "command");
  rig();
  end();
  check_refused(TapeStatus::kNoRig);
  header();
  rig();
  rig();
  end();
  check_refused(TapeStatus::kNoRig);
}

void test_bad_record(void**) {
  for (const std::uint32_t body : {0U, 44U, 47U, 49U, 52U}) {
    header();
    record(1, body);
    size += (body + 3) / 4 * 4;
    end();
    check_refused(TapeStatus::kBadRecord);
  }
  for (const std::uint32_t type : {5U, 0x80000000U, 0xFFFFFFFFU}) {
    header();
    rig();
    text(type, "what");
    end();
    check_refused(TapeStatus::kBadRecord);
  }
  header();
  rig();
  record(4, 24);
  size += 24;
  end();
  check_refused(TapeStatus::kBadRecord);
  struct {
    std::uint32_t left_width, left_height, right_width, right_height, pixels;
  } const extents[] = {
      {2, 2, 2, 2, 7},
      {2, 2, 2, 2, 9},
      {0, 5, 5, 0, 1},
      {0x10000, 0, 0, 0, 0},  // no more than 65535, so that no product is beyond 32 bits
      {0, 0, 0, 0x10000, 0},
      {0x10000, 0x10000, 0, 0, 0},
      {0xFFFFFFFF, 0xFFFFFFFF, 3, 2863311531U, 2},  // 2^64 + 2 in all
  };
  for (const auto& e : extents) {
    header();
    rig();
    pair(1, e.left_width, e.left_height, e.right_width, e.right_height, e.pixels);
    end();
    check_refused(TapeStatus::kBadRecord);
  }
}

void test_rig(void**) {
  header();
  rig();
  end();
  out = StereoRig();
  assert_status(tape::open(bytes, size, out), TapeStatus::kReady);
  assert_int_equal(out.width_px, 8);
  assert_int_equal(out.height_px, 4);
  assert_near(out.fx_px, 1.5, 0);
  assert_near(out.fy_px, -2, 0);
  assert_near(out.cx_px, 0.25, 0);
  assert_near(out.cy_px, 4, 0);
  assert_near(out.baseline_m, 0.125, 0);
  assert_true(tape::at_end());
}

void test_in_the_order_of_the_tape(void**) {
  header();
  rig();
  text(3, "first map");
  text(2, "start");
  text(3, "map");
  pair(7, 3, 1, 1, 2, 5);
  text(2, "a long command");
  end();
  assert_status(tape::open(bytes, size, out), TapeStatus::kReady);
  assert_false(tape::at_end());
  assert_int_equal(hal::map_bank().size, 9);
  assert_false(take());  // the command comes first
  std::uint8_t command[8] = {};
  assert_int_equal(hal::telecommand_receive(command, sizeof command), 5);
  assert_memory_equal(command, "start", 5);
  assert_int_equal(hal::map_bank().size, 3);
  assert_memory_equal(hal::map_bank().data, "map", 3);
  assert_int_equal(hal::telecommand_receive(command, sizeof command), 0);  // the pair comes first
  assert_true(take());
  assert_int_equal(info.number, 7);
  assert_true(info.t_capture_us == 0x100000007ULL);
  assert_int_equal(info.left_width, 3);
  assert_int_equal(info.left_height, 1);
  assert_int_equal(info.right_width, 1);
  assert_int_equal(info.right_height, 2);
  const std::uint8_t pixels[] = {7, 8, 9, 10, 11};
  assert_memory_equal(left, pixels, 3);
  assert_memory_equal(right, pixels + 3, 2);
  assert_int_equal(hal::telecommand_receive(command, sizeof command), 8);  // cut
  assert_memory_equal(command, "a long c", 8);
  assert_true(tape::at_end());
  assert_false(take());
}

void test_images_without_room_are_left_out(void**) {
  header();
  rig();
  pair(1, 3, 3, 4, 2, 17);
  pair(2, 0, 0, 8, 1, 8);  // a side that was missing
  pair(3, 1, 1, 1, 1, 2);
  end();
  assert_status(tape::open(bytes, size, out), TapeStatus::kReady);
  assert_true(take());
  assert_int_equal(info.left_width, 0);
  assert_int_equal(left[0], 0);
  assert_int_equal(info.right_width, 4);
  assert_int_equal(right[0], 1 + 9);
  assert_true(take());
  assert_int_equal(info.left_width, 0);
  assert_int_equal(info.right_width, 8);
  assert_true(hal::camera_take({nullptr, nullptr, 0}, info));  // let go
  assert_int_equal(info.number, 3);
  assert_int_equal(info.left_width, 0);
  assert_true(tape::at_end());
}

std::uint8_t large[2][20000];

/// Bytes of the buffers that a call wrote, where no pixel of the pair is 0.
std::size_t written(bool& taken) {
  std::memset(large, 0, sizeof large);
  taken = hal::camera_take({large[0], large[1], sizeof large[0]}, info);
  std::size_t count = 0;
  for (const auto& side : large) {
    for (const std::uint8_t pixel : side) count += pixel != 0 ? 1 : 0;
  }
  return count;
}

/// However large a pair is, no call copies more than 16 KB; what comes in the end is all of it, and the next
/// pair is whole again where one was let go half way.
void test_a_large_pair_comes_in_pieces(void**) {
  header();
  rig();
  const std::size_t first = size + 8 + 28;
  pair(1, 150, 100, 200, 100, 35000);
  pair(2, 150, 100, 200, 100, 35000);
  std::memset(bytes + first, 0x55, 35000);
  end();
  assert_status(tape::open(bytes, size, out), TapeStatus::kReady);
  std::size_t sum = 0;
  for (bool taken = false; !taken;) {
    const std::size_t count = written(taken);
    assert_in_range(count, 1, 16384);
    sum += count;
  }
  assert_int_equal(sum, 35000);
  assert_int_equal(info.number, 1);

  assert_status(tape::open(bytes, size, out), TapeStatus::kReady);
  const hal::StereoBuffer buffer = {large[0], large[1], sizeof large[0]};
  assert_false(hal::camera_take(buffer, info));
  assert_true(hal::camera_take({nullptr, nullptr, 0}, info));  // let go
  assert_int_equal(info.number, 1);
  std::memset(large, 0, sizeof large);
  while (!hal::camera_take(buffer, info)) assert_false(tape::at_end());
  assert_int_equal(info.number, 2);
  for (std::size_t i = 0; i < 15000; ++i) assert_int_equal(large[0][i], (2 + i) & 0xFF);
  for (std::size_t i = 0; i < 20000; ++i) assert_int_equal(large[1][i], (2 + 15000 + i) & 0xFF);
}

std::size_t heard = 0;

void test_telemetry(void**) {
  header();
  rig();
  end();
  assert_status(tape::open(bytes, size, out), TapeStatus::kReady);
  assert_false(hal::telemetry_send(bytes, 3));
  tape::on_telemetry([](const std::uint8_t* packet, std::size_t count) { heard = packet[0] + count; });
  assert_true(hal::telemetry_send(bytes, 3));
  assert_int_equal(heard, 'C' + 3);
  tape::on_telemetry(nullptr);
  assert_false(hal::telemetry_send(bytes, 3));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_no_tape),
      cmocka_unit_test(test_version),
      cmocka_unit_test(test_truncated),
      cmocka_unit_test(test_no_rig),
      cmocka_unit_test(test_bad_record),
      cmocka_unit_test(test_rig),
      cmocka_unit_test(test_in_the_order_of_the_tape),
      cmocka_unit_test(test_images_without_room_are_left_out),
      cmocka_unit_test(test_a_large_pair_comes_in_pieces),
      cmocka_unit_test(test_telemetry),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
