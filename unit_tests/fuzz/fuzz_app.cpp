// The whole flight module, through hal: any sequence of commands, pairs, maps, upsets, uploads and slices.
//
// Input: options, then operations to the end. Whatever comes, the module goes on; no packet is malformed,
// holds a number that is not finite or a status that there is not; packets are numbered without a gap; and a
// command that was not accepted changes nothing.
#include <cmath>
#include <limits>
#include <vector>

#include "app/flight_app.hpp"
#include "fuzz/fuzz_support.hpp"
#include "hal/camera.hpp"
#include "hal/link.hpp"
#include "hal/nvm.hpp"
#include "hal/watchdog.hpp"
#include "orbital_map/small_map.hpp"

using namespace cairn;
using namespace cairn::fuzz;
using app::CommandStatus;
using app::CommandType;

namespace {

constexpr int kWidth = 128;  // of the rig, smaller than there is room for
constexpr int kHeight = 96;
constexpr std::size_t kBankBytes = 2048;
constexpr int kMostOperations = 32;

struct Side {
  int width = 0;  ///< 0: missing
  int height = 0;
  std::uint8_t seed = 0;
  int shift_px = 0;
  std::uint32_t pair = 0;  ///< no two pictures of a camera are the same: what repeats itself is frozen
};
struct Pair {
  std::uint32_t number = 0;
  std::uint64_t t_us = 0;
  Side left;
  Side right;
};
using Bytes = std::vector<std::uint8_t>;

/// The other side of hal, as it is promised: banks do not move.
struct Machine {
  std::vector<Pair> pairs;  ///< come in this order
  std::size_t next_pair = 0;
  std::vector<Bytes> commands;
  std::size_t next_command = 0;
  std::uint8_t bank[2][kBankBytes] = {};
  std::size_t bank_bytes[2] = {0, kBankBytes};
  int in_use = 0;
  bool banks_switch = true;
  int pictures = 0;  ///< whole pairs that may still come; they take longer than all else
  bool link = true;

  std::uint32_t packets = 0;  ///< sent, heard or not
  app::AckReport ack;
  std::uint32_t acks = 0;
  app::HealthReport health;
};
Machine* machine = nullptr;

std::uint8_t texture(unsigned seed, int u, int v) {
  const auto hash = [&](int i, int j) {
    std::uint32_t h =
        static_cast<std::uint32_t>(i) * 0x9E3779B1U ^ static_cast<std::uint32_t>(j) * 0x85EBCA77U;
    h ^= seed * 0xC2B2AE3DU;
    h = (h ^ h >> 15U) * 0x2C1B3C6DU;
    return (h ^ h >> 12U) & 255U;
  };
  const int x = u & 3;
  const int y = v & 3;
  const int i = u >> 2;
  const int j = v >> 2;
  const unsigned upper = hash(i, j) * (4U - x) + hash(i + 1, j) * x;
  const unsigned lower = hash(i, j + 1) * (4U - x) + hash(i + 1, j + 1) * x;
  return static_cast<std::uint8_t>((upper * (4U - y) + lower * y) / 16U);
}

/// Where a boulder is, seen from above: six of them, of the seed's size.
bool on_boulder(unsigned seed, int u, int v) {
  const int du = (u + 8) % 40 - 20;
  const int dv = (v + 10) % 30 - 15;
  return du * du + dv * dv < 30 + static_cast<int>(4 * seed) && v > 20;
}

/// Ground that comes nearer downward, with boulders that stand out of it.
int disparity(unsigned seed, int u, int v) { return 4 + v / 8 + (on_boulder(seed, u, v) ? 3 : 0); }

int grey(unsigned seed, int u, int v, int shift_px) {
  const int ground = texture(seed, u + shift_px, v);
  return on_boulder(seed, u, v) ? 170 + ground / 4 : 40 + ground / 4;
}

void draw(const Side& side, bool right, std::uint8_t* out, std::size_t capacity, int& width, int& height) {
  const std::size_t pixels = static_cast<std::size_t>(side.width) * static_cast<std::size_t>(side.height);
  if (out == nullptr || pixels == 0 || pixels > capacity) return;
  for (int v = 0; v < side.height; ++v) {
    for (int u = 0; u < side.width; ++u) {
      const unsigned seed = side.seed & 15U;
      const int d = right ? disparity(seed, u + 4 + v / 8, v) : 0;
      const int noise = texture(side.pair, 4 * u, 4 * v) & 1U;
      *out++ = side.seed >= 0xF0 ? side.seed
                                 : static_cast<std::uint8_t>(grey(seed, u + d, v, side.shift_px) + noise);
    }
  }
  width = side.width;
  height = side.height;
}

// ---- what comes down --------------------------------------------------------------------------------------

template <typename... Numbers>
void finite(Numbers... numbers) {
  for (const double v : {static_cast<double>(numbers)...}) CAIRN_ASSERT(std::isfinite(v));
}
void sound(const Pose3& pose) { CAIRN_ASSERT(is_valid(pose)); }
void below(unsigned status, std::size_t count) { CAIRN_ASSERT(status < count); }

void check(const app::FrameReport& r) {
  below(r.pose_source, kPoseSourceCount);
  below(r.vo_status, kVoStatusCount);
  below(r.boulder_status, kObserveStatusCount);
  below(r.trust, kTrustCount);
  sound(r.T_map_cam_vo);
  sound(r.T_map_cam);
  finite(r.sigma_xy_m, r.sigma_yaw_rad, r.sigma_tilt_rad, r.sigma_z_m, r.rms_px, r.scale, r.turn_rad_per_m);
  CAIRN_ASSERT(r.sigma_xy_m >= 0.0F && r.sigma_yaw_rad >= 0.0F && r.rms_px >= 0.0F);
  CAIRN_ASSERT(r.sigma_tilt_rad >= 0.0F && r.sigma_z_m >= 0.0F);
  CAIRN_ASSERT(r.gravity < kAttitudeStatusCount && r.heading < kAttitudeStatusCount);
}
void check(const app::FixReport& r) {
  below(r.status, kFixStatusCount);
  below(r.map_window_full, 2);
  below(r.lost, 2);
  finite(r.dx_m, r.dy_m, r.dyaw_rad, r.scale, r.rms_m, r.sigma_xy_m, r.sigma_yaw_rad, r.chi2, r.log_ratio,
         r.second_log_ratio, r.chance_log, r.windows_log_ratio);
}
void check(const app::BoulderReport& r) { finite(r.x_m, r.y_m, r.z_m, r.diameter_m, r.spread_m); }
void check(const app::AckReport& r) {
  below(r.status, app::kCommandStatusCount);
  machine->ack = r;
  ++machine->acks;
}
void check(const app::HealthReport& r) {
  below(r.map_status, kMapStatusCount);
  finite(r.rows_px, r.columns_px, r.lens, r.turn_x_rad, r.turn_z_rad, r.baseline_y_rad, r.baseline_z_rad);
  machine->health = r;
}
void check(const app::UploadReport& r) {
  CAIRN_ASSERT(r.taken <= r.chunks && r.first_missing <= r.chunks && r.chunks <= cfg::kMaxMapChunks);
}

template <typename Report>
bool is(const std::uint8_t* bytes, std::size_t size) {
  Report report;
  if (app::decode(bytes, size, report) != app::PacketStatus::kGood) return false;
  check(report);
  return true;
}

void hear(const std::uint8_t* bytes, std::size_t size) {
  app::PacketHead head;
  CAIRN_ASSERT(app::check_packet(bytes, size, head) == app::PacketStatus::kGood);
  CAIRN_ASSERT(head.sequence == machine->packets);
  CAIRN_ASSERT(is<app::FrameReport>(bytes, size) || is<app::FixReport>(bytes, size) ||
               is<app::BoulderReport>(bytes, size) || is<app::AckReport>(bytes, size) ||
               is<app::HealthReport>(bytes, size) || is<app::UploadReport>(bytes, size));
}

// ---- what goes up -----------------------------------------------------------------------------------------

/// Of all kinds: of a drive, at the limits, absurd, any bits.
double number(Input& in) {
  static const double kOnes[] = {0.0,
                                 -0.0,
                                 1.0,
                                 -1.0,
                                 0.05,
                                 1e-3,
                                 1e-4,
                                 1e-9,
                                 0.5,
                                 2.0,
                                 -0.1,
                                 10.0,
                                 1e5,
                                 1e8,
                                 -1e8,
                                 1e160,
                                 1e200,
                                 0.3,
                                 1e-310,
                                 4.0,
                                 std::numeric_limits<double>::quiet_NaN(),
                                 std::numeric_limits<double>::infinity()};
  const std::uint8_t kind = in.u8();
  if (kind < sizeof kOnes / sizeof *kOnes) return kOnes[kind];
  if (kind < 0xE0) return (in.u16() - 32768) * 1e-3;
  std::uint8_t bits[8];
  for (std::uint8_t& b : bits) b = in.u8();
  return be::get_f64(bits);
}

Pose3 pose(Input& in) {
  Pose3 p;
  const std::uint8_t kind = in.u8();
  for (int i = 0; i < 3; ++i) p.t[i] = number(in);
  if ((kind & 1U) != 0) {
    p.q = quat_from_attitude({in.u8() * 0.025, in.u8() * 0.001, in.u8() * 0.001});
    if ((kind & 2U) != 0) p.q.coeffs() *= 1.0 + (in.u8() - 128) * 1e-5;
  } else if ((kind & 2U) != 0) {
    p.q = Quat(number(in), number(in), number(in), number(in));
  }
  return p;
}

/// The same map of version 3: flat ground of height 0, but for what the input changes.
Bytes with_heights(const test::MapBytes& map, Input& in) {
  constexpr std::uint32_t kSpacing = 10;
  constexpr std::size_t kFlatBytes = 1 + (11 * 10 + 7) / 8;  // a zero bit a post
  Bytes out(map.bytes, map.bytes + test::kMapHeader - cmap::kCrcBytes);
  out[cmap::kVersionAt] = cmap::kHeightsVersion;
  be::put_u16(out.data() + cmap::kHeadBytesAt, test::kMapHeader + cmap::kHeightBytes);
  const std::size_t head = out.size();
  out.resize(head + cmap::kHeightBytes + cmap::kCrcBytes + 2U * map.tiles);
  std::uint8_t* const fields = out.data() + head;
  const std::uint8_t kind = in.u8();
  be::put_u32(fields + cmap::kHeightSpacingAt, (kind & 1U) != 0 ? in.u32() : kSpacing);
  be::put_u32(fields + cmap::kHeightQuantumAt, (kind & 2U) != 0 ? in.u32() : 1000U);
  be::put_f64(fields + cmap::kHeightBaseAt, (kind & 4U) != 0 ? number(in) : 0.0);
  be::put_f32(fields + cmap::kHeightSigmaAt, static_cast<float>((kind & 8U) != 0 ? number(in) : 0.01));
  be::put_f32(fields + cmap::kHeightCommonAt, static_cast<float>((kind & 16U) != 0 ? number(in) : 0.05));
  const std::size_t payloads = out.size();
  for (unsigned tile = 0; tile < map.tiles; ++tile) {
    be::put_u16(out.data() + payloads - 2U * (map.tiles - tile),
                static_cast<std::uint16_t>(out.size() - payloads));
    out.push_back(0);
    out.push_back(kFlatBytes);
    out.resize(out.size() + kFlatBytes);
    for (int n = kind >> 5U; n > 0; --n) out[out.size() - kFlatBytes + in.u8() % kFlatBytes] = in.u8();
    out.insert(out.end(), map.bytes + map.payload(tile), map.bytes + map.payload(tile + 1U));
  }
  repair_map(out.data(), out.size());
  return out;
}

/// A good map of boulders that the pictures show to a rover at (0, 0), but for what the input changes.
Bytes map_bytes(Input& in) {
  static test::MapBytes made;
  const test::GridBoulder boulders[] = {{0, 53, 35, 75},  {0, 62, 35, 75},  {0, 71, 35, 75},
                                        {0, 50, 36, 150}, {0, 55, 36, 150}, {0, 59, 36, 150},
                                        {0, 64, 36, 150}, {0, 69, 36, 150}, {0, 60, 42, 150},
                                        {1, 5, 40, 150},  {1, 60, 45, 600}};
  test::make_map(made, 2, 1, 100, 0.05, boulders, sizeof boulders / sizeof *boulders);
  be::put_f64(made.bytes + cmap::kOriginXAt, -2.0);
  be::put_f64(made.bytes + cmap::kOriginYAt, -2.0);
  const std::uint8_t kind = in.u8();
  Bytes map = (kind & 32U) != 0 ? with_heights(made, in) : Bytes(made.bytes, made.bytes + made.size);
  if ((kind & 1U) != 0) be::put_f64(map.data() + cmap::kOriginXAt, number(in));
  if ((kind & 2U) != 0) be::put_u32(map.data() + cmap::kCountAt, in.u32());
  if ((kind & 4U) != 0) be::put_u32(map.data() + cmap::kQuantumAt, in.u32());
  if ((kind & 8U) != 0) map[in.u16() % map.size()] = in.u8();
  if ((kind & 16U) == 0) repair_map(map.data(), map.size());
  return map;
}

/// The newest command of a type that was accepted.
struct Newest {
  bool any = false;
  std::uint32_t sequence = 0;
  Bytes packet;
};

struct Session {
  std::uint32_t sequence[app::kCommandTypeCount + 1] = {};
  std::vector<Bytes> sent;
  Newest newest[app::kCommandTypeCount + 1];
  bool heard_all = true;  ///< every ack: `newest` is as the module has it
  Bytes upload;
  std::uint32_t next_pair = 0;
};

/// Pose, sigma and map, to the bit.
struct Standing {
  Pose3 T_map_rover = app::root.localizer().T_map_rover();
  Pose3 T_map_cam_vo = app::root.localizer().vo_T_map_cam();
  double sigma_xy_m = app::root.localizer().fusion().sigma_xy_m();
  double sigma_yaw_rad = app::root.localizer().fusion().sigma_yaw_rad();
  std::uint32_t map_crc = app::root.localizer().map().head_crc();

  bool operator==(const Standing& b) const {
    return T_map_rover.t == b.T_map_rover.t && T_map_rover.q.coeffs() == b.T_map_rover.q.coeffs() &&
           T_map_cam_vo.t == b.T_map_cam_vo.t && sigma_xy_m == b.sigma_xy_m &&
           sigma_yaw_rad == b.sigma_yaw_rad && map_crc == b.map_crc;
  }
};

void run(std::uint32_t slice_ops) {
  for (int n = 0; app::root.cycle(slice_ops) == app::FlightApp::State::kBusy; ++n) CAIRN_ASSERT(n < 2000000);
}

/// What is not newer than all of its type is neither carried out nor taken for something else.
void check_order(Session& s, const app::Command& command, const Bytes& packet, CommandStatus status) {
  if (command.type == CommandType::kMapChunk || command.type == CommandType::kReportUpload) return;
  Newest& newest = s.newest[static_cast<int>(command.type)];
  if (s.heard_all && newest.any) {
    const auto ahead = static_cast<std::int32_t>(command.sequence - newest.sequence);
    if (ahead < 0) CAIRN_ASSERT(status == CommandStatus::kStale);
    if (ahead == 0) {
      const bool same = packet == newest.packet;
      CAIRN_ASSERT(status == (same ? CommandStatus::kRepeated : CommandStatus::kContradicts));
    }
  }
  if (status == CommandStatus::kAccepted) newest = {true, command.sequence, packet};
}

/// One command by itself; what is not accepted changes nothing (a bank that was found bad may end its map).
void send(Session& s, const Bytes& packet, std::uint32_t slice_ops) {
  if (packet.empty()) return;
  run(slice_ops);
  const Standing before;
  const std::uint32_t acks = machine->acks;
  machine->commands.push_back(packet);
  static_cast<void>(app::root.cycle(slice_ops));  // the command, and no more
  const Standing after;
  if (machine->link) {
    CAIRN_ASSERT(machine->acks == acks + 1);
    const auto status = static_cast<CommandStatus>(machine->ack.status);
    CAIRN_ASSERT(status == CommandStatus::kAccepted || after == before);
    app::Command command;
    if (app::decode(packet.data(), packet.size(), command) == CommandStatus::kAccepted) {
      check_order(s, command, packet, status);
      const bool moves = command.type == CommandType::kSetStart || command.type == CommandType::kUseUpload;
      CAIRN_ASSERT(moves || after == before);
      if (command.type == CommandType::kSetStart && status == CommandStatus::kAccepted)
        CAIRN_ASSERT((after.T_map_rover.t - command.pose.t).norm() <= 1e-6);
    } else {
      CAIRN_ASSERT(status == CommandStatus::kBadPacket || status == CommandStatus::kUnknownType);
    }
  }
  s.heard_all = s.heard_all && machine->link;
  if (s.sent.size() < 16) s.sent.push_back(packet);
}

Bytes packet_of(const app::Command& command) {
  static app::Packet packet;
  app::encode(command, packet);
  return {packet.begin(), packet.end()};
}

Bytes make_command(Session& s, Input& in) {
  static Bytes chunk;
  app::Command c;
  const std::uint8_t kind = in.u8();
  const unsigned type = 1U + kind % app::kCommandTypeCount;
  c.type = static_cast<CommandType>(type);
  const int step = (kind & 128U) != 0 ? static_cast<std::int8_t>(in.u8()) : 1;
  c.sequence = s.sequence[type] += static_cast<std::uint32_t>(step);
  switch (c.type) {
    case CommandType::kSetStart:
      c.pose = pose(in);
      c.number = {number(in), number(in)};
      break;
    case CommandType::kSetTrim: c.number = {number(in), number(in)}; break;
    case CommandType::kMotionPrior:
      c.pair = s.next_pair + static_cast<std::uint32_t>(static_cast<std::int8_t>(in.u8()));
      c.pose = pose(in);
      break;
    case CommandType::kAttitude: {
      c.pair = s.next_pair + static_cast<std::uint32_t>(static_cast<std::int8_t>(in.u8()));
      const Pose3 attitude = pose(in);
      const Vec3 up = attitude.q.conjugate() * Vec3(0.0, 0.0, 1.0);
      c.attitude = {{up.x(), up.y(), up.z()}, number(in), number(in), number(in)};
      break;
    }
    case CommandType::kBeginUpload:
      s.upload = map_bytes(in);
      c.upload = {static_cast<std::uint8_t>(in.u8() & 3U), crc32(s.upload.data(), s.upload.size()),
                  static_cast<std::uint32_t>(s.upload.size()), 64};
      break;
    case CommandType::kMapChunk: {
      const unsigned n = in.u8() & 15U;
      const std::size_t at = std::min<std::size_t>(64U * n, s.upload.size());
      const std::size_t data = std::min<std::size_t>(64, s.upload.size() - at);
      chunk.assign(data + chunk::kOverheadBytes, 0);
      if (data == 0) chunk.push_back(0);
      be::put_u32(chunk.data(), crc32(s.upload.data(), s.upload.size()));
      be::put_u16(chunk.data() + chunk::kNumberAt, static_cast<std::uint16_t>(n));
      std::copy_n(s.upload.begin() + static_cast<std::ptrdiff_t>(at), data, chunk.begin() + chunk::kDataAt);
      const std::size_t crc_at = chunk.size() - chunk::kCrcBytes;
      be::put_u32(chunk.data() + crc_at, crc32(chunk.data(), crc_at));
      c.chunk = chunk.data();
      c.chunk_bytes = chunk.size();
      break;
    }
    case CommandType::kUseUpload: c.upload.id = crc32(s.upload.data(), s.upload.size()); break;
    case CommandType::kLoadMap:
    case CommandType::kReportUpload: break;
  }
  return packet_of(c);
}

/// Any bytes as a packet, its CRC made to hold.
Bytes any_packet(Input& in) {
  Bytes packet(in.u8() % 100U);
  for (std::uint8_t& b : packet) b = in.u8();
  if (packet.size() >= 12) {
    packet[1] = app::kPacketVersion;
    be::put_u16(packet.data() + 2, static_cast<std::uint16_t>(packet.size()));
    be::put_u32(packet.data() + packet.size() - 4, crc32(packet.data(), packet.size() - 4));
  }
  return packet;
}

Side side(Input& in, std::uint8_t kind) {
  Side s;
  if ((kind & 7U) == 7) {
    s.width = in.u8() * 2;
    s.height = in.u8();
  } else if ((kind & 4U) == 0) {
    return s;
  } else {
    s.width = kWidth;
    s.height = kHeight;
  }
  return s;
}

void feed(Session& s, Input& in, std::uint8_t kind) {
  Pair p;
  s.next_pair += (kind & 64U) != 0 ? in.u8() : 1U;
  p.number = s.next_pair;
  p.t_us = 100000ULL * p.number;
  p.left = side(in, kind);
  p.right = side(in, (kind & 128U) != 0 ? in.u8() : kind);
  if (p.left.width == kWidth && p.right.width == kWidth && machine->pictures-- <= 0) p.right = Side();
  p.left.seed = p.right.seed = (kind & 16U) != 0 ? in.u8() : 0;
  p.left.pair = p.right.pair = p.number;
  p.left.shift_px = p.right.shift_px = (kind & 32U) != 0 ? static_cast<int>(s.next_pair % 8) : 0;
  machine->pairs.push_back(p);
}

void operate(Session& s, Input& in, std::uint32_t slice_ops) {
  const std::uint8_t operation = in.u8();
  switch (operation % 10) {
    case 0:
    case 1: send(s, make_command(s, in), slice_ops); break;
    case 2: send(s, any_packet(in), slice_ops); break;
    case 3:  // once more, or later
      if (!s.sent.empty()) send(s, s.sent[in.u8() % s.sent.size()], slice_ops);
      break;
    case 4: feed(s, in, in.u8()); break;
    case 5:  // blind frames, to the end of a major frame, the last ones good
      for (unsigned n = in.u8() % 32U, good = operation / 64U; n > 0; --n) feed(s, in, n <= good ? 4 : 0);
      run(slice_ops);
      break;
    case 6: {  // the bank in use is written: the map that lay there is over when it is asked for again
      const Bytes map = map_bytes(in);
      std::copy(map.begin(), map.end(), machine->bank[machine->in_use]);
      machine->bank_bytes[machine->in_use] = (operation & 128U) != 0 ? in.u16() % kBankBytes : map.size();
      app::Command load;
      load.sequence = ++s.sequence[static_cast<int>(CommandType::kLoadMap)];
      send(s, packet_of(load), slice_ops);
      break;
    }
    case 7: {  // an upset of either bank
      const std::uint16_t at = in.u16();
      machine->bank[at >> 15U][at % kBankBytes] ^= static_cast<std::uint8_t>(1U << (in.u8() & 7U));
      break;
    }
    case 8:
      for (unsigned n = in.u8(); n > 0; --n) static_cast<void>(app::root.cycle(1U + 16U * in.u8()));
      break;
    default: {
      const std::uint8_t what = in.u8();
      machine->link = (what & 1U) == 0;
      machine->banks_switch = (what & 2U) == 0;
      break;
    }
  }
}

}  // namespace

namespace cairn::hal {

bool camera_take(const StereoBuffer& buffer, StereoInfo& info) {
  if (machine->next_pair == machine->pairs.size()) return false;
  const Pair& p = machine->pairs[machine->next_pair++];
  info = StereoInfo();
  info.number = p.number;
  info.t_capture_us = p.t_us;
  draw(p.left, false, buffer.left, buffer.capacity, info.left_width, info.left_height);
  draw(p.right, true, buffer.right, buffer.capacity, info.right_width, info.right_height);
  return true;
}

bool telemetry_send(const std::uint8_t* packet, std::size_t size) {
  if (machine->link) hear(packet, size);
  ++machine->packets;
  return machine->link;
}

std::size_t telecommand_receive(std::uint8_t* out, std::size_t capacity) {
  if (machine->next_command == machine->commands.size()) return 0;
  const ::Bytes& packet = machine->commands[machine->next_command++];
  const std::size_t size = std::min(packet.size(), capacity);
  std::copy_n(packet.begin(), size, out);
  return size;
}

hal::Bytes map_bank() { return {machine->bank[machine->in_use], machine->bank_bytes[machine->in_use]}; }
Room spare_map_bank() { return {machine->bank[1 - machine->in_use], kBankBytes}; }
bool switch_map_banks() {
  if (!machine->banks_switch) return false;
  machine->in_use = 1 - machine->in_use;
  machine->bank_bytes[machine->in_use] = kBankBytes;
  return true;
}
void watchdog_kick() {}

}  // namespace cairn::hal

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Machine fresh;
  fresh = Machine();
  machine = &fresh;
  Input in(data, size);
  const std::uint8_t options = in.u8();
  const std::uint32_t slice_ops = (options & 1U) != 0 ? 1000U + 16U * in.u8() : cfg::kSliceOps;
  // One input in sixteen sees: by no byte of its own, or nearly all that the fuzzer keeps would be slow.
  machine->pictures = crc32(data, size) % 16U == 0 ? 16 : 0;
  LocalizerParams params;
  if ((options & 2U) != 0) params = paper_params();
  StereoRig rig = app::mission_rig();
  rig.width_px = kWidth;
  rig.height_px = kHeight;
  const LocalizerStatus ready = app::root.init(params, rig);
  CAIRN_ASSERT(ready == LocalizerStatus::kReady);
  Session session;
  for (int n = 0; n < kMostOperations && in.left() > 0; ++n) operate(session, in, slice_ops);
  run(slice_ops);
  // At the end health is asked for, and every command is accounted for.
  machine->link = true;
  const std::uint32_t sent = static_cast<std::uint32_t>(machine->commands.size());
  machine->bank_bytes[machine->in_use] = 0;
  app::Command load;
  load.sequence = ++session.sequence[static_cast<int>(CommandType::kLoadMap)];
  for (int n = 0; n < 2; ++n) {  // where its number is not new, the ack tells one that is
    machine->commands.push_back(packet_of(load));
    run(slice_ops);
    load.sequence = machine->ack.newest + 1;
  }
  CAIRN_ASSERT(!app::root.localizer().map().usable());
  std::uint32_t counted = 0;
  for (const std::uint32_t n : machine->health.commands) counted += n;
  CAIRN_ASSERT(counted == machine->commands.size() && counted > sent);
  return 0;
}
