// The flight module through the host's hal: commands, maps, spoiled pairs, a link without room.
#include "app/flight_app.hpp"

#include <algorithm>
#include <limits>

#include "core/big_endian.hpp"
#include "core/crc32.hpp"
#include "hal/nvm.hpp"
#include "integration/ground_station.hpp"
#include "integration/replay.hpp"

using namespace cairn;
using namespace cairn::test;
using app::CommandStatus;
using app::CommandType;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kPixels = cfg::kImageWidth * cfg::kImageHeight;

ground::Dataset data;
std::vector<std::uint8_t> rock_map;
GroundStation down;
std::uint32_t next_number = 0;
Localizer reference;

int open_sample(void**) {
  data = ground::Dataset::open(kSample);
  FlightMap made;
  assert_status(made.make(true_rocks(kSample)), MapStatus::kUsable);
  rock_map = made.bytes;
  return 0;
}

void begin(const LocalizerParams& params = {}) {
  down.begin(params, rig_of(data));
  next_number = 100;
}
void begin_at_start(const LocalizerParams& params = {}) {
  begin(params);
  send(start_command(*data.truth_rover(0)));
  down.run();
  assert_int_equal(down.acks.back().status, 0);
}

host::Picture left(std::size_t i) { return picture(ground::load_grey(data.frames()[i].left)); }
host::Picture right(std::size_t i) { return picture(ground::load_grey(data.frames()[i].right)); }
host::Picture plain(std::uint8_t grey) {
  return {cfg::kImageWidth, cfg::kImageHeight, std::vector<std::uint8_t>(kPixels, grey)};
}

void queue(host::Picture l, host::Picture r) {
  ++next_number;
  host::feed_pair(next_number, 1000ULL * next_number, std::move(l), std::move(r));
}
/// One pair; its report.
const app::FrameReport& take(host::Picture l, host::Picture r) {
  const std::size_t before = down.frames.size();
  queue(std::move(l), std::move(r));
  down.run();
  assert_int_equal(down.frames.size(), before + 1);
  assert_int_equal(down.frames.back().number, next_number);
  assert_int_equal(down.frames.back().t_capture_us, 1000ULL * next_number);
  return down.frames.back();
}
const app::FrameReport& take(std::size_t i) { return take(left(i), right(i)); }

/// A health packet now: that of a map that is none.
const app::HealthReport& health() {
  host::load_map_bank({});
  send(app::Command());
  down.run();
  return down.healths.back();
}

std::uint32_t count(const app::HealthReport& h, CommandStatus status) {
  return h.commands[static_cast<std::size_t>(status)];
}

/// Sends raw bytes up; the ack.
app::AckReport answer(std::vector<std::uint8_t> bytes) {
  const std::size_t before = down.acks.size();
  host::feed_telecommand(std::move(bytes));
  down.run();
  assert_int_equal(down.acks.size(), before + 1);
  return down.acks.back();
}
template <typename Detail>
void check_answer(const app::Command& unnumbered, CommandStatus status, Detail detail) {
  const app::Command command = numbered(unnumbered);
  const app::AckReport ack = answer(packet_of(command));
  assert_status(ack.status, status);
  assert_int_equal(ack.detail, static_cast<int>(detail));
  assert_status(ack.command_type, command.type);
  assert_int_equal(ack.command_sequence, command.sequence);
}

void test_without_a_start_nothing_moves(void**) {
  begin();
  for (std::size_t i = 0; i < 3; ++i) {
    const app::FrameReport& r = take(i);
    assert_status(r.pose_source, PoseSource::kNone);
    assert_status(r.vo_status, VoStatus::kIdle);
    assert_int_equal(r.vo_ops + r.boulder_ops + r.fix_ops, 0);
    assert_true(r.T_map_cam.t == down.frames[0].T_map_cam.t);
  }
  assert_int_equal(health().frames, 0);
  send(start_command(*data.truth_rover(3)));
  down.run();
  assert_status(take(3).pose_source, PoseSource::kStart);
  assert_at_most((down.frames.back().T_map_cam.t - data.truth_cam(3)->t).norm(), 0.01);
  assert_status(take(4).pose_source, PoseSource::kVo);
}

/// A larger raw camera whose tables shift by whole pixels: the telemetry is that of the rectified pairs, to
/// the bit, whatever the slices; a side of another size is missing.
struct Raw {
  static constexpr int kWidth = cfg::kImageWidth + 9;
  static constexpr int kHeight = cfg::kImageHeight + 6;
  static constexpr int kRight = 4;
  static constexpr int kDown = 3;
  RemapTable table;
  std::uint8_t left[kWidth * kHeight];
  std::uint8_t right[kWidth * kHeight];
  app::RawPairs pairs;
};
Raw raw;

host::Picture unshifted(const host::Picture& rectified) {
  host::Picture out = {Raw::kWidth, Raw::kHeight, std::vector<std::uint8_t>(Raw::kWidth * Raw::kHeight, 7)};
  for (int v = 0; v < cfg::kImageHeight; ++v) {
    std::copy_n(rectified.pixels.begin() + v * cfg::kImageWidth, cfg::kImageWidth,
                out.pixels.begin() + (v + Raw::kDown) * Raw::kWidth + Raw::kRight);
  }
  return out;
}

void make_raw() {
  raw.table.width_px = cfg::kImageWidth;
  raw.table.height_px = cfg::kImageHeight;
  const int columns = remap::nodes_along(cfg::kImageWidth, remap::kSpacing);
  const int rows = remap::nodes_along(cfg::kImageHeight, remap::kSpacing);
  for (int i = 0; i < columns * rows; ++i) {
    raw.table.nodes[static_cast<std::size_t>(i)] = {
        (i % columns * remap::kSpacing + Raw::kRight) << remap::kFractionBits,
        (i / columns * remap::kSpacing + Raw::kDown) << remap::kFractionBits};
  }
  const std::uint32_t crc = crc_of(raw.table);
  raw.pairs = {&raw.table, &raw.table, crc, crc, Raw::kWidth, Raw::kHeight, raw.left, raw.right};
}

void test_raw_pairs(void**) {
  begin_at_start();
  for (std::size_t i = 0; i < 4; ++i) take(i);
  const std::vector<app::FrameReport> rectified = down.frames;
  make_raw();
  for (const std::uint32_t slice : {cfg::kSliceOps, 9000U}) {
    begin();
    assert_status(app::root.init({}, rig_of(data), &raw.pairs), LocalizerStatus::kReady);
    send(start_command(*data.truth_rover(0)));
    for (std::size_t i = 0; i < 4; ++i) {
      queue(unshifted(left(i)), unshifted(right(i)));
      down.run(slice);
    }
    assert_int_equal(down.frames.size(), rectified.size());
    for (std::size_t i = 0; i < rectified.size(); ++i) {
      assert_true(down.frames[i].T_map_cam.t == rectified[i].T_map_cam.t);
      assert_int_equal(down.frames[i].vo_ops, rectified[i].vo_ops);
      assert_status(down.frames[i].vo_status, rectified[i].vo_status);
    }
  }
  assert_status(take(left(4), unshifted(right(4))).vo_status, VoStatus::kBadImage);
  assert_status(take(unshifted(left(5)), unshifted(right(5))).vo_status, VoStatus::kMotion);
}

/// Tables that are not what the ground made: a rig that cannot be used.
void test_raw_pairs_without_their_tables(void**) {
  begin();
  make_raw();
  ++raw.table.nodes[100].v;
  assert_status(app::root.init({}, rig_of(data), &raw.pairs), LocalizerStatus::kBadRig);
  assert_status(app::root.init({}, rig_of(data)), LocalizerStatus::kReady);
}

void test_init_clears_everything(void**) {
  begin_at_start();
  host::load_map_bank(rock_map);
  send(app::Command());
  app::Command trim;
  trim.type = CommandType::kSetTrim;
  trim.number[0] = 2.0;
  send(trim);
  down.run();
  take(0);
  take(1);
  const double doubled = (down.frames[1].T_map_cam_vo.t - down.frames[0].T_map_cam_vo.t).norm();
  begin();
  take(0);
  assert_true(down.frames[0].T_map_cam.t.norm() < 2.0);  // where the camera sits, no more
  assert_near(down.frames[0].sigma_xy_m, 0.0, 0.0);
  send(start_command(*data.truth_rover(0)));
  down.run();
  take(0);
  take(1);
  const double plain_step = (down.frames[2].T_map_cam_vo.t - down.frames[1].T_map_cam_vo.t).norm();
  assert_near(doubled, 2.0 * plain_step, 0.005);
  for (const app::HealthReport& h : down.healths) assert_int_equal(h.map_status, 0);
  for (std::size_t i = 0; i < down.sequences.size(); ++i) assert_int_equal(down.sequences[i], i);
}

void test_bad_rig(void**) {
  StereoRig rig = rig_of(data);
  rig.baseline_m = kNaN;
  assert_status(app::root.init({}, rig), LocalizerStatus::kBadRig);
  rig = rig_of(data);
  rig.width_px = cfg::kImageWidth + 2;
  assert_status(app::root.init({}, rig), LocalizerStatus::kBadRig);
  assert_status(app::root.init({}, app::mission_rig()), LocalizerStatus::kReady);
}

void test_start_commands(void**) {
  begin();
  const app::ContentStatus why[] = {app::ContentStatus::kNotFinite,  app::ContentStatus::kNotFinite,
                                    app::ContentStatus::kNotFinite,  app::ContentStatus::kQuaternion,
                                    app::ContentStatus::kQuaternion, app::ContentStatus::kSigmaXy,
                                    app::ContentStatus::kSigmaYaw,   app::ContentStatus::kNotFinite};
  for (int what = 0; what < 8; ++what) {
    app::Command c = start_command(*data.truth_rover(0), 70 + what);
    if (what == 0) c.pose.t.x() = kNaN;
    if (what == 1) c.pose.t.z() = std::numeric_limits<double>::infinity();
    if (what == 2) c.pose.q.w() = kNaN;
    if (what == 3) c.pose.q.coeffs() *= 0.0;
    if (what == 4) c.pose.q.coeffs() *= 1.5;
    if (what == 5) c.number[0] = 0.0;
    if (what == 6) c.number[1] = -0.01;
    if (what == 7) c.number[1] = kNaN;
    check_answer(c, CommandStatus::kRefused, why[what]);
  }
  assert_status(take(0).pose_source, PoseSource::kNone);
  check_answer(start_command(*data.truth_rover(0), 99), CommandStatus::kAccepted, 0);
  take(0);
  // A refused one does not disturb the drive.
  app::Command bad = start_command(*data.truth_rover(0), 100);
  bad.pose.t.y() = kNaN;
  check_answer(bad, CommandStatus::kRefused, app::ContentStatus::kNotFinite);
  assert_status(take(1).pose_source, PoseSource::kVo);
  const app::HealthReport& h = health();
  assert_int_equal(count(h, CommandStatus::kRefused), 10);  // with the one that asks for health
  assert_int_equal(count(h, CommandStatus::kAccepted), 1);
}

void test_trim_commands(void**) {
  begin();
  const double inf = std::numeric_limits<double>::infinity();
  const struct {
    double scale, yaw;
    app::ContentStatus status;
  } trims[] = {{1.0, 0.0, app::ContentStatus::kGood},       {0.5, -0.1, app::ContentStatus::kGood},
               {2.0, 0.1, app::ContentStatus::kGood},       {0.4999, 0.0, app::ContentStatus::kScale},
               {2.001, 0.0, app::ContentStatus::kScale},    {kNaN, 0.0, app::ContentStatus::kNotFinite},
               {inf, 0.0, app::ContentStatus::kNotFinite},  {1.0, 0.1001, app::ContentStatus::kTurn},
               {1.0, kNaN, app::ContentStatus::kNotFinite}, {1.0, -0.11, app::ContentStatus::kTurn}};
  for (const auto& trim : trims) {
    app::Command c;
    c.type = CommandType::kSetTrim;
    c.number[0] = trim.scale;
    c.number[1] = trim.yaw;
    const bool good = trim.status == app::ContentStatus::kGood;
    check_answer(c, good ? CommandStatus::kAccepted : CommandStatus::kRefused, trim.status);
  }
}

void test_damaged_commands(void**) {
  begin();
  const std::vector<std::uint8_t> good = packet_of(start_command(*data.truth_rover(0), 5));
  std::uint32_t bad = 0;
  const auto check = [&](std::vector<std::uint8_t> bytes) {
    const app::AckReport ack = answer(std::move(bytes));
    assert_status(ack.status, CommandStatus::kBadPacket);
    assert_int_equal(ack.command_sequence, 0);
    assert_int_equal(ack.command_type, 0);
    assert_int_equal(ack.detail, 0);
    ++bad;
  };
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    std::vector<std::uint8_t> bytes = good;
    bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
    check(bytes);
  }
  for (std::size_t size = 1; size < good.size(); ++size) check({good.begin(), good.begin() + size});
  check(std::vector<std::uint8_t>(app::kMaxPacketBytes + 100, 7));  // more than fits: cut, and so damaged
  std::vector<std::uint8_t> unknown = packet_of(app::Command());
  unknown[0] = app::kCommandTypeCount + 1;
  be::put_u32(unknown.data() + 8, crc32(unknown.data(), 8));
  const app::AckReport ack = answer(unknown);
  assert_status(ack.status, CommandStatus::kUnknownType);
  assert_int_equal(ack.command_type, app::kCommandTypeCount + 1);
  ++bad;
  host::feed_telecommand({});  // nothing is no command
  down.run();
  assert_int_equal(down.acks.size(), bad);
  assert_status(take(0).pose_source, PoseSource::kNone);
  const app::HealthReport& h = health();
  assert_int_equal(count(h, CommandStatus::kBadPacket), bad - 1);
  assert_int_equal(count(h, CommandStatus::kUnknownType), 1);
}

void test_commands_wait_for_the_frames_end(void**) {
  begin_at_start();
  take(0);
  queue(left(1), right(1));
  assert_status(app::root.cycle(), app::FlightApp::State::kBusy);  // the pair is taken
  assert_status(app::root.cycle(1000), app::FlightApp::State::kBusy);
  assert_true(app::root.executive().busy());
  const app::Command start = numbered(start_command(*data.truth_rover(7)));
  send(start);
  queue(left(7), right(7));
  const std::size_t acks = down.acks.size();
  while (down.frames.size() < 2) {
    assert_int_equal(down.acks.size(), acks);
    static_cast<void>(app::root.cycle());
  }
  assert_status(down.frames.back().pose_source, PoseSource::kVo);
  down.run();
  assert_int_equal(down.acks.back().command_sequence, start.sequence);
  assert_int_equal(down.frames.size(), 3);
  assert_status(down.frames.back().pose_source, PoseSource::kStart);
  assert_at_most((down.frames.back().T_map_cam.t - data.truth_cam(7)->t).norm(), 0.01);
  assert_int_equal(app::root.executive().minor(), 0);
}

void check_map(std::vector<std::uint8_t> bytes, MapStatus at_once, MapStatus in_the_end) {
  host::load_map_bank(std::move(bytes));
  const std::size_t healths = down.healths.size();
  const app::AckReport ack = answer(packet_of(app::Command()));
  assert_status(ack.status,
                at_once == MapStatus::kChecking ? CommandStatus::kAccepted : CommandStatus::kRefused);
  assert_status(ack.detail, at_once);
  assert_int_equal(down.healths.size(), healths + 1);
  assert_status(down.healths.back().map_status, in_the_end);
}
void check_map(std::vector<std::uint8_t> bytes, MapStatus at_once) {
  check_map(std::move(bytes), at_once, at_once);
}

void test_maps(void**) {
  begin();
  check_map({}, MapStatus::kNoMap);
  check_map(rock_map, MapStatus::kChecking, MapStatus::kUsable);
  check_map({rock_map.begin(), rock_map.begin() + 100}, MapStatus::kTruncated);
  check_map({rock_map.begin(), rock_map.end() - 1}, MapStatus::kTruncated);
  std::vector<std::uint8_t> bytes = rock_map;
  bytes[0] ^= 1U;
  check_map(bytes, MapStatus::kBadMagic);
  bytes = rock_map;
  bytes[20] ^= 1U;
  check_map(bytes, MapStatus::kHeaderCrc);
  bytes = rock_map;
  bytes[cmap::kVersionAt] = 1;
  check_map(bytes, MapStatus::kUnknownVersion);
  bytes = rock_map;
  bytes.back() ^= 16U;  // of the only tile
  check_map(bytes, MapStatus::kChecking, MapStatus::kPayloadCrc);
  check_map(ground::encode_cmap({}, {0.0, 0.0, 10.0, 10.0}, 0.01, {}), MapStatus::kChecking,
            MapStatus::kNoBoulders);
  check_map(rock_map, MapStatus::kChecking, MapStatus::kUsable);
}

/// A bank that was written anew, and badly, leaves the module without a map; the fix says so. Blind frames,
/// as a fix needs no picture for it.
void test_a_bad_map_is_no_map(void**) {
  begin_at_start();
  check_map(rock_map, MapStatus::kChecking, MapStatus::kUsable);
  for (int n = 0; n < cfg::kMinorFrames; ++n) take({}, {});
  assert_status(down.fixes.back().status, FixStatus::kNoLocalBoulders);
  assert_true(down.healths.back().map_crc != 0);
  std::vector<std::uint8_t> bytes = rock_map;
  bytes.back() ^= 16U;
  check_map(bytes, MapStatus::kChecking, MapStatus::kPayloadCrc);
  assert_int_equal(down.healths.back().map_crc, 0);
  for (int n = 0; n < cfg::kMinorFrames; ++n) take({}, {});
  assert_status(down.fixes.back().status, FixStatus::kNoMap);
  assert_int_equal(down.fixes.size(), 2);
  assert_int_equal(down.fixes.back().map_boulders, 0);
  assert_status(down.healths.back().map_status, MapStatus::kPayloadCrc);
  assert_int_equal(down.healths.back().fixes[static_cast<int>(FixStatus::kNoMap)], 1);
  assert_int_equal(down.healths.back().fixes[static_cast<int>(FixStatus::kNoLocalBoulders)], 1);
  assert_int_equal(down.healths.back().frames, 2 * cfg::kMinorFrames);
}

void check_held(const app::FrameReport& r, VoStatus status) {
  assert_status(r.vo_status, status);
  assert_status(r.pose_source, PoseSource::kHeld);
  const app::FrameReport& before = down.frames[down.frames.size() - 2];
  assert_true(r.T_map_cam.t == before.T_map_cam.t);
  assert_true(r.T_map_cam.q.coeffs() == before.T_map_cam.q.coeffs());
  assert_int_equal(r.boulders + r.regions + r.boulders_matched, 0);
}
/// The next good frame catches up, whatever was before it.
void check_good(std::size_t i) {
  const app::FrameReport& r = take(i);
  assert_status(r.vo_status, VoStatus::kMotion);
  assert_status(r.pose_source, PoseSource::kVo);
  assert_at_most((r.T_map_cam.t - data.truth_cam(i)->t).norm(), 0.02);
}

void test_spoiled_pairs(void**) {
  begin_at_start();
  take(0);
  check_good(1);
  check_held(take({}, right(2)), VoStatus::kBadImage);
  check_good(2);
  check_held(take(left(3), {}), VoStatus::kBadImage);
  check_held(take({}, {}), VoStatus::kBadImage);
  check_good(4);
  host::Picture large{cfg::kImageWidth, cfg::kImageHeight + 1,
                      std::vector<std::uint8_t>(kPixels + cfg::kImageWidth, 90)};
  check_held(take(large, large), VoStatus::kBadImage);
  // As many pixels as there is room for, but not the mission's shape.
  host::Picture wide{2 * cfg::kImageWidth, cfg::kImageHeight / 2, left(5).pixels};
  check_held(take(wide, wide), VoStatus::kBadImage);
  host::Picture small{cfg::kImageWidth / 2, cfg::kImageHeight / 2,
                      std::vector<std::uint8_t>(kPixels / 4, 90)};
  check_held(take(small, small), VoStatus::kBadImage);
  check_held(take(left(5), small), VoStatus::kBadImage);
  check_held(take(small, right(5)), VoStatus::kBadImage);
  check_good(5);
  check_held(take(plain(0), plain(0)), VoStatus::kFewFeatures);
  check_held(take(plain(255), plain(255)), VoStatus::kFewFeatures);
  check_good(6);
  check_held(take(left(7), plain(0)), VoStatus::kFewFeatures);
  check_good(7);
  const app::HealthReport& h = health();
  assert_int_equal(h.frames, 18);
  assert_int_equal(h.vo[static_cast<int>(VoStatus::kBadImage)], 8);
  assert_int_equal(h.vo[static_cast<int>(VoStatus::kFewFeatures)], 3);
  assert_int_equal(h.vo[static_cast<int>(VoStatus::kMotion)], 6);
}

void test_swapped_and_noise_pairs(void**) {
  begin_at_start();
  take(0);
  check_good(1);
  check_held(take(right(2), left(2)), VoStatus::kFewStereo);
  check_good(2);
  Random random(4);
  host::Picture noise = plain(0);
  for (std::uint8_t& p : noise.pixels) p = static_cast<std::uint8_t>(random.below(256));
  check_held(take(noise, noise), VoStatus::kFewStereo);
  check_good(3);
}

app::Command prior_command(std::uint32_t pair, const Pose3& T_prev_cur) {
  app::Command c;
  c.type = CommandType::kMotionPrior;
  c.pair = pair;
  c.pose = T_prev_cur;
  return c;
}
Pose3 true_step(std::size_t i) { return data.truth_cam(i - 1)->inverse() * *data.truth_cam(i); }

void test_bad_motion_priors_are_refused_and_counted(void**) {
  begin_at_start();
  take(0);
  app::Command prior = prior_command(next_number + 1, Pose3());
  prior.pose.t.x() = kNaN;
  check_answer(prior, CommandStatus::kRefused, app::ContentStatus::kNotFinite);
  check_good(1);
  prior.pose = Pose3();
  prior.pose.q.coeffs() *= 3.0;
  check_answer(prior, CommandStatus::kRefused, app::ContentStatus::kQuaternion);
  check_answer(prior_command(next_number + 5000, Pose3()), CommandStatus::kRefused,
               app::ContentStatus::kPairFar);
  check_good(2);
  check_answer(prior_command(next_number + 1, true_step(3)), CommandStatus::kAccepted,
               app::ContentStatus::kGood);
  check_good(3);
  check_good(4);  // a prior serves one pair
  assert_int_equal(health().bad_priors, 3);
}

/// Frames that VO cannot see move by the prior that names them, and by no other.
void test_a_motion_prior_serves_the_pair_that_it_names(void**) {
  begin_at_start();
  take(0);
  take(1);
  Pose3 far;  // 0.3 m forward: nothing like the drive's own steps
  far.t.z() = 0.3;
  bool upside_down = false;
  std::size_t place = 20;
  const auto lost = [&]() -> double {  // head over heels, and back: VO loses its way
    ++place;
    host::Picture l = left(place);
    host::Picture r = right(place);
    upside_down = !upside_down;
    if (upside_down) {
      std::reverse(l.pixels.begin(), l.pixels.end());
      std::reverse(r.pixels.begin(), r.pixels.end());
      std::swap(l, r);
    }
    const Vec3 before = down.frames.back().T_map_cam.t;
    const app::FrameReport& report = take(std::move(l), std::move(r));
    assert_status(report.pose_source, PoseSource::kExtrapolated);
    return (report.T_map_cam.t - before).norm();
  };
  const double own = (data.truth_cam(1)->t - data.truth_cam(0)->t).norm();
  check_answer(prior_command(next_number + 2, far), CommandStatus::kAccepted, 0);
  assert_near(lost(), own, 0.03);  // not yet
  assert_near(lost(), 0.3, 0.01);  // now
  assert_near(lost(), own, 0.03);  // and no more
  // Of a pair that was taken: as stale as an older number, and told apart by the detail.
  check_answer(prior_command(next_number, far), CommandStatus::kStale, app::ContentStatus::kPairGone);
  assert_near(lost(), own, 0.03);
  // Its pair never comes: it bridges the gap.
  check_answer(prior_command(next_number + 1, far), CommandStatus::kAccepted, 0);
  ++next_number;
  assert_near(lost(), 0.3 + own, 0.03);
  assert_int_equal(health().bad_priors, 1);
}

/// Of a pair that never came, so far back in a gap that nothing is bridged with it.
void test_a_prior_passed_over_is_counted(void**) {
  begin_at_start();
  take(0);
  check_answer(prior_command(next_number + 1, Pose3()), CommandStatus::kAccepted, 0);
  next_number += app::MotionPriors::kRoom + 5;
  take({}, {});
  assert_int_equal(health().bad_priors, 1);
}

/// A camera that numbers its pairs anew: priors of the old numbers are let go, and counted.
void test_priors_of_a_camera_that_begins_anew(void**) {
  begin_at_start();
  take(0);
  check_answer(prior_command(next_number + 5, Pose3()), CommandStatus::kAccepted, 0);
  for (std::uint32_t n = 1; n <= app::PairOrder::kRestartedAfter; ++n) host::feed_pair(n, n, {}, {});
  down.run();
  assert_status(down.frames.back().pair_status, app::PairStatus::kRenumbered);
  assert_int_equal(health().bad_priors, 1);
}

app::Command attitude_command(std::uint32_t pair, std::size_t place) {
  app::Command c;
  c.type = CommandType::kAttitude;
  c.pair = pair;
  const Vec3 up = data.truth_rover(place)->q.conjugate() * Vec3(0.0, 0.0, 1.0);
  c.attitude = {{up.x(), up.y(), up.z()}, 0.002, planar(*data.truth_rover(place)).yaw_rad, 0.002};
  return c;
}

/// Before its pair is there nothing is corrected; with it, in the report of this pair, all is; and no more.
void test_an_attitude_serves_the_pair_that_it_names(void**) {
  begin_at_start();
  take(0);
  check_answer(attitude_command(next_number + 2, 2), CommandStatus::kAccepted, 0);
  check_answer(attitude_command(next_number + 4, 4), CommandStatus::kAccepted, 0);
  double sigma_rad[5] = {};
  for (std::size_t i = 1; i < 5; ++i) {
    const app::FrameReport& r = take(i);
    const AttitudeStatus expected = i % 2 == 0 ? AttitudeStatus::kFused : AttitudeStatus::kNone;
    assert_status(r.gravity, expected);
    assert_status(r.heading, expected);
    sigma_rad[i] = static_cast<double>(r.sigma_tilt_rad);
  }
  assert_at_most(sigma_rad[2], 0.8 * sigma_rad[1]);
  // Gravity alone, and its pair is blind.
  app::Command alone = attitude_command(next_number + 1, 5);
  alone.attitude.sigma_yaw_rad = 0.0;
  check_answer(alone, CommandStatus::kAccepted, 0);
  const app::FrameReport& blind = take({}, {});
  assert_status(blind.gravity, AttitudeStatus::kNoPose);
  assert_status(blind.heading, AttitudeStatus::kNone);
  const app::HealthReport h = health();
  assert_int_equal(h.gravity[static_cast<int>(AttitudeStatus::kFused)], 2);
  assert_int_equal(h.gravity[static_cast<int>(AttitudeStatus::kNoPose)], 1);
  assert_int_equal(h.headings[static_cast<int>(AttitudeStatus::kFused)], 2);
  assert_int_equal(h.bad_attitudes, 0);
}

void test_bad_attitudes_are_refused_and_counted(void**) {
  begin_at_start();
  take(0);
  app::Command bad = attitude_command(next_number + 1, 1);
  bad.attitude.up_rover[1] = kNaN;
  check_answer(bad, CommandStatus::kRefused, app::ContentStatus::kNotFinite);
  bad = attitude_command(next_number + 1, 1);
  bad.attitude.sigma_tilt_rad = -0.002;
  check_answer(bad, CommandStatus::kRefused, app::ContentStatus::kSigmaTilt);
  check_answer(attitude_command(next_number, 0), CommandStatus::kStale, app::ContentStatus::kPairGone);
  check_answer(attitude_command(next_number + 5000, 0), CommandStatus::kRefused,
               app::ContentStatus::kPairFar);
  // One that is far off is taken to the localizer, and refused there.
  bad = attitude_command(next_number + 1, 1);
  bad.attitude.up_rover = {{0.0, 0.6, 0.8}};
  bad.attitude.yaw_rad += 1.0;
  check_answer(bad, CommandStatus::kAccepted, 0);
  const app::FrameReport& r = take(1);
  assert_status(r.gravity, AttitudeStatus::kInconsistent);
  assert_status(r.heading, AttitudeStatus::kInconsistent);
  // And one whose pair never comes.
  check_answer(attitude_command(next_number + 1, 1), CommandStatus::kAccepted, 0);
  ++next_number;
  check_good(2);
  assert_int_equal(health().bad_attitudes, 5);
}

/// After a life with all sorts of faults, init() is as power-on: nothing counted, nothing that waits.
void test_init_forgets_a_busy_life(void**) {
  begin_at_start();
  check_map(rock_map, MapStatus::kChecking, MapStatus::kUsable);
  check_answer(prior_command(next_number + 3, Pose3()), CommandStatus::kAccepted, 0);
  check_answer(prior_command(next_number + 9, Pose3()), CommandStatus::kAccepted, 0);
  check_answer(prior_command(next_number + 5000, Pose3()), CommandStatus::kAccepted, 0);  // no pair yet
  take(0);
  check_answer(prior_command(next_number + 5000, Pose3()), CommandStatus::kRefused,
               app::ContentStatus::kPairFar);
  next_number += 3;
  take(1);  // a gap
  host::feed_pair(next_number, 1000ULL * next_number, {}, {});
  host::feed_telecommand({1, 2, 3});
  GroundStation::cut();
  down.run();

  begin();
  assert_false(app::root.localizer().map().usable());
  const app::HealthReport h = health();
  for (const std::uint32_t n : h.pairs) assert_int_equal(n, 0);
  for (const std::uint32_t n : h.vo) assert_int_equal(n, 0);
  for (const CommandStatus status : {CommandStatus::kAccepted, CommandStatus::kBadPacket})
    assert_int_equal(count(h, status), 0);
  assert_int_equal(count(h, CommandStatus::kRefused), 1);  // the one that asks for health
  assert_int_equal(h.frames + h.missed_pairs + h.bad_priors + h.lost_packets + h.map_crc, 0);
  send(start_command(*data.truth_rover(0)));
  assert_status(take({}, {}).pair_status, app::PairStatus::kFirst);
  next_number += 20;  // past all that the priors of before were for
  take({}, {});
  assert_int_equal(health().bad_priors, 0);
  begin();
  check_answer(prior_command(0x90000000U, Pose3()), CommandStatus::kAccepted, 0);  // of any pair, again
}

/// Pairs that come again, late or in another order leave everything as it is; the next good one goes on.
void test_repeated_and_overtaken_pairs(void**) {
  begin_at_start();
  for (std::size_t i = 0; i < 4; ++i) take(i);
  const std::uint32_t newest = next_number;
  const Pose3 before = down.frames.back().T_map_cam;
  const std::size_t reports = down.frames.size();
  const auto feed_again = [](std::uint32_t number, std::size_t i) {
    host::feed_pair(number, 1000ULL * number, left(i), right(i));
    down.run();
  };
  feed_again(newest, 3);      // repeated
  feed_again(newest - 2, 1);  // stale
  feed_again(newest - 1, 2);
  assert_int_equal(down.frames.size(), reports);
  const app::HealthReport h = health();
  assert_int_equal(h.frames, 4);
  assert_int_equal(h.pairs[static_cast<std::size_t>(app::PairStatus::kRepeated)], 1);
  assert_int_equal(h.pairs[static_cast<std::size_t>(app::PairStatus::kOld)], 2);
  assert_int_equal(h.missed_pairs, 0);
  const app::FrameReport& next = take(4);
  assert_status(next.pair_status, app::PairStatus::kNext);
  assert_status(next.pose_source, PoseSource::kVo);
  const double step = (data.truth_cam(4)->t - data.truth_cam(3)->t).norm();
  assert_near((next.T_map_cam.t - before.t).norm(), step, 0.01);
}

/// Two pairs change places: the later is used, over the gap; the earlier is let go.
void test_swapped_order_and_gaps(void**) {
  begin_at_start();
  for (std::size_t i = 0; i < 4; ++i) take(i);
  assert_int_equal(down.frames.back().missed_pairs, 0);
  const std::uint32_t fourth = ++next_number;
  const app::FrameReport fifth = take(5);
  assert_status(fifth.pair_status, app::PairStatus::kGap);
  assert_int_equal(fifth.missed_pairs, 1);
  assert_status(fifth.pose_source, PoseSource::kVo);
  assert_at_most((fifth.T_map_cam.t - data.truth_cam(5)->t).norm(), 0.02);
  const std::size_t reports = down.frames.size();
  host::feed_pair(fourth, 1000ULL * fourth, left(4), right(4));
  down.run();
  assert_int_equal(down.frames.size(), reports);
  next_number += 8;
  const app::FrameReport far = take(14);
  assert_int_equal(far.missed_pairs, 8);
  assert_status(far.pose_source, PoseSource::kVo);
  assert_at_most((far.T_map_cam.t - data.truth_cam(14)->t).norm(), 0.03);
  assert_int_equal(health().missed_pairs, 9);
}

/// Pose, sigma and map, to the bit.
struct Standing {
  Pose3 T_map_rover = app::root.localizer().T_map_rover();
  Pose3 T_map_cam_vo = app::root.localizer().vo_T_map_cam();
  double sigma_xy_m = app::root.localizer().fusion().sigma_xy_m();
  std::uint32_t map_crc = app::root.localizer().map().head_crc();
  int minor = app::root.executive().minor();

  friend bool operator==(const Standing& a, const Standing& b) {
    return a.T_map_rover.t == b.T_map_rover.t && a.T_map_rover.q.coeffs() == b.T_map_rover.q.coeffs() &&
           a.T_map_cam_vo.t == b.T_map_cam_vo.t && a.sigma_xy_m == b.sigma_xy_m && a.map_crc == b.map_crc &&
           a.minor == b.minor;
  }
};

/// Each command a second time, overtaken by its successor, and with its number on another content.
void test_commands_that_come_again_change_nothing(void**) {
  begin_at_start();
  host::load_map_bank(rock_map);
  app::Command load;
  app::Command trim;
  trim.type = CommandType::kSetTrim;
  trim.number[0] = 1.0;
  app::Command upload;
  upload.type = CommandType::kBeginUpload;
  upload.upload = {1, 77, 1000, 100};
  const app::Command start = start_command(*data.truth_rover(0));
  const app::Command prior = prior_command(next_number + 4, Pose3());
  for (app::Command c : {start, trim, prior, load, upload}) {
    c = numbered(c);
    app::Command older = c;
    older.sequence = c.sequence - 1;
    const app::AckReport first = answer(packet_of(c));
    assert_status(first.status, CommandStatus::kAccepted);
    assert_int_equal(first.newest, c.sequence);
    if (c.type == start.type) {
      take(0);
      check_good(1);
      check_good(2);
    }
    const Standing before;
    const std::size_t uploads = down.uploads.size();
    check_answer(c, CommandStatus::kRepeated, first.detail);
    assert_int_equal(down.acks.back().newest, c.sequence);
    check_answer(older, CommandStatus::kStale, 0);
    assert_int_equal(down.acks.back().newest, c.sequence);
    app::Command other = c;
    other.type = c.type;
    other.pose.t.x() += 1.0;
    other.pair += 1;
    other.number[0] += 0.5;
    other.upload.id += 1;
    if (c.type != load.type) check_answer(other, CommandStatus::kContradicts, 0);
    assert_true(Standing() == before);
    assert_int_equal(down.uploads.size(), uploads);
  }
  const app::FrameReport& r = take(3);  // goes on from where it was; the prior says that it stands
  assert_status(r.vo_status, VoStatus::kMotion);
  assert_status(r.pose_source, PoseSource::kDoubted);
  assert_at_most((r.T_map_cam.t - data.truth_cam(3)->t).norm(), 0.02);
  const app::HealthReport& h = health();
  assert_int_equal(count(h, CommandStatus::kRepeated), 5);
  assert_int_equal(count(h, CommandStatus::kStale), 5);
  assert_int_equal(count(h, CommandStatus::kContradicts), 4);
}

/// The ground has lost its count: the ack tells what to go on from. A module started anew takes any number.
void test_a_ground_segment_that_begins_anew(void**) {
  begin();
  app::Command start = start_command(*data.truth_rover(0), 0xFFFFFFF0U);
  check_answer(start, CommandStatus::kAccepted, 0);
  start.sequence = 0xFFFFFF00U;
  const app::AckReport ack = answer(packet_of(start));
  assert_status(ack.status, CommandStatus::kStale);
  start.sequence = ack.newest + 1;
  check_answer(start, CommandStatus::kAccepted, 0);
  start.sequence = 5;  // beyond the wrap
  check_answer(start, CommandStatus::kAccepted, 0);
  begin();
  start.sequence = 0xFFFFFF00U;
  check_answer(start, CommandStatus::kAccepted, 0);
}

/// It changed nothing, so that the same packet may be sent again when what it waits for is there.
void test_a_refused_command_may_come_again(void**) {
  begin();
  app::Command load;
  load.sequence = 7;
  check_answer(load, CommandStatus::kRefused, MapStatus::kNoMap);
  host::load_map_bank(rock_map);
  check_answer(load, CommandStatus::kAccepted, MapStatus::kChecking);
  check_answer(load, CommandStatus::kRepeated, MapStatus::kChecking);
  assert_true(app::root.localizer().map().usable());
}

/// Any one flipped bit of the bank: a map that worked goes on, with the status of the bank told.
void test_an_upset_bank_keeps_its_map(void**) {
  begin_at_start();
  check_map(rock_map, MapStatus::kChecking, MapStatus::kUsable);
  const std::uint32_t crc = down.healths.back().map_crc;
  assert_int_equal(crc, app::root.localizer().map().head_crc());
  const hal::Bytes bank = hal::map_bank();
  auto* bytes = const_cast<std::uint8_t*>(bank.data);  // the upset
  for (std::size_t bit = 0; bit < 8 * bank.size; bit += kSanitized ? 97 : 7) {
    bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
    send(app::Command());
    down.run();
    bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
    const auto status = static_cast<MapStatus>(down.healths.back().map_status);
    assert_true(status != MapStatus::kUsable);
    assert_int_equal(down.healths.back().map_crc, crc);
  }
  assert_true(app::root.localizer().map().count() > 0);
  for (int n = 0; n < cfg::kMinorFrames; ++n) take({}, {});
  // In the same place, but another map that is bad: the old one is gone, and is not mixed with it.
  FlightMap other;
  auto rocks = true_rocks(kSample);
  for (auto& rock : rocks) rock.p_map_m.x() += 1.0;
  rocks.resize(rocks.size() / 2);
  assert_status(other.make(rocks), MapStatus::kUsable);
  assert_true(other.bytes.size() <= bank.size);
  std::copy(other.bytes.begin(), other.bytes.end(), bytes);
  bytes[20] ^= 1U;
  send(app::Command());
  down.run();
  assert_status(down.healths.back().map_status, MapStatus::kHeaderCrc);
  assert_int_equal(down.healths.back().map_crc, 0);
  assert_false(app::root.localizer().map().usable());
}

/// Each field of a frame's report is what the localizer holds under that name.
void check_frame(const app::FrameReport& r) {
  const Localizer& now = app::root.localizer();
  assert_true(r.T_map_cam_vo.t == now.vo_T_map_cam().t && r.T_map_cam.t == now.T_map_cam().t);
  assert_true(r.T_map_cam.q.coeffs() == now.T_map_cam().q.coeffs());
  assert_near(r.sigma_xy_m, now.fusion().sigma_xy_m(), 1e-6);
  assert_near(r.sigma_yaw_rad, now.fusion().sigma_yaw_rad(), 1e-6);
  assert_near(r.scale, now.fusion().scale(), 1e-6);
  assert_near(r.turn_rad_per_m, now.fusion().turn_rad_per_m(), 1e-6);
  assert_status(r.pose_source, now.pose_source());
  assert_status(r.vo_status, now.vo().status());
  assert_status(r.boulder_status, now.observer().status());
  assert_status(r.watch, now.watch());
  assert_status(r.trust, now.trust());
  assert_int_equal(r.matches, now.vo().result().matches);
  assert_int_equal(r.own_points, now.vo().result().own_points);
  assert_int_equal(r.inliers, now.vo().result().inliers);
  assert_int_equal(r.features_left, now.vo().result().features_left);
  assert_int_equal(r.features_right, now.vo().result().features_right);
  assert_int_equal(r.regions, now.observer().counts().regions);
  assert_int_equal(r.evident_regions, now.observer().counts().evident);
  assert_int_equal(r.boulders, now.observer().result().size());
  assert_int_equal(r.boulders_matched, now.observer().counts().matched);
}

void check_fix(const app::FixReport& r) {
  const FixRecord& fix = app::root.localizer().last_fix();
  assert_status(r.status, fix.status);
  assert_near(r.dx_m, fix.correction.x_m, 1e-12);
  assert_near(r.dy_m, fix.correction.y_m, 1e-12);
  assert_near(r.dyaw_rad, fix.correction.yaw_rad, 1e-12);
  assert_near(r.rms_m, fix.rms_m, 1e-6);
  assert_near(r.sigma_xy_m, fix.sigma_xy_m, 1e-6);
  assert_near(r.sigma_yaw_rad, fix.sigma_yaw_rad, 1e-6);
  assert_near(r.chi2, fix.chi2, 1e-4);
  assert_near(r.log_ratio, fix.log_ratio, 1e-4);
  assert_near(r.second_log_ratio, fix.second_log_ratio, 1e-4);
  assert_near(r.chance_log, fix.chance_log, 1e-4);
  assert_near(r.windows_log_ratio, fix.windows_log_ratio, 1e-4);
  assert_int_equal(r.windows, fix.windows);
  assert_int_equal(r.local_boulders, fix.local_boulders);
  assert_int_equal(r.map_boulders, fix.map_boulders);
  assert_int_equal(r.pairs, fix.pairs);
  assert_int_equal(r.trimmed, fix.trimmed);
  assert_int_equal(r.gated, fix.gated);
  assert_int_equal(r.snapshot, fix.frame);
}

/// A start 0.2 m off, made good by a fix. Boulders are told in the map, where the rocks of the truth lie.
void test_reports_tell_what_is(void**) {
  begin();
  check_frame(take(0));  // lost: no start yet
  Pose3 start = *data.truth_rover(0);
  start.t.x() -= 0.2;
  app::Command c = start_command(start);
  c.number[0] = 0.2;
  send(c);
  host::load_map_bank(rock_map);
  send(app::Command());
  down.run();
  assert_near(app::root.localizer().fusion().sigma_xy_m(), 0.2, 0.001);
  assert_near(app::root.localizer().fusion().sigma_yaw_rad(), 0.01, 1e-4);
  for (std::size_t i = 0; i < cfg::kMinorFrames; ++i) check_frame(take(i));
  assert_int_equal(down.fixes.size(), 1);
  check_fix(down.fixes.back());
  assert_status(down.fixes.back().status, FixStatus::kApplied);
  assert_near(down.fixes.back().dx_m, 0.2, 0.05);
  assert_near(down.fixes.back().dy_m, 0.0, 0.05);
  assert_int_equal(down.fixes.back().local_boulders, down.boulders.size());
  OnRocks on;
  for (const app::BoulderReport& b : down.boulders) on.add({b.x_m, b.y_m}, data.truth_rocks());
  assert_at_least(on.share(), 0.75);
  check_frame(take(cfg::kMinorFrames));
  assert_true(down.frames.back().T_map_cam_vo.t != down.frames.back().T_map_cam.t);
}

void test_a_link_without_room(void**) {
  begin_at_start();
  take(0);
  const std::size_t received = down.sequences.size();
  GroundStation::cut();
  queue(left(1), right(1));
  app::Command trim;
  trim.type = CommandType::kSetTrim;
  trim.number[0] = 1.0;
  send(trim);
  down.run();
  queue(left(2), right(2));
  down.run();
  assert_int_equal(down.sequences.size(), received);
  down.listen();
  check_good(3);  // the module went on all the while
  assert_int_equal(down.sequences.back(), received + 3);
  assert_int_equal(health().lost_packets, 3);
}

/// VO that takes more than one minor frame: the pair after it is dropped, and neither its number nor its
/// pixels get into the report of the one that VO is at.
void test_overrun_of_vo(void**) {
  LocalizerParams slow;
  slow.vo.motion.max_hypotheses = 3500;
  slow.vo.motion.confidence = 1.0 - 1e-15;
  slow.vo.motion.inlier_px = 0.04;
  slow.vo.motion.min_inliers = 4;
  begin_at_start(slow);
  take(0);
  // For the pair that is dropped: it goes with it.
  const app::Command prior = prior_command(next_number + 2, Pose3());
  const app::FrameReport first = take(1);
  assert_status(first.vo_status, VoStatus::kRunning);
  send(prior);
  queue(left(20), right(20));
  down.run();
  const app::FrameReport second = down.frames.back();
  assert_int_equal(down.frames.size(), 3);
  assert_int_equal(second.number, first.number);
  assert_int_equal(second.t_capture_us, first.t_capture_us);

  assert_status(reference.init(slow, rig_of(data)), LocalizerStatus::kReady);
  assert_status(reference.set_start(*data.truth_rover(0), 0.05, 0.01), LocalizerStatus::kReady);
  static Pair pair;
  for (std::size_t i = 0; i < 2; ++i) {
    load(data.frames()[i], pair);
    frame(reference, pair);
  }
  assert_status(second.vo_status, reference.vo().status());
  assert_true(second.T_map_cam.t == reference.T_map_cam().t);
  assert_int_equal(second.regions, reference.observer().counts().regions);
  assert_int_equal(second.boulders, reference.observer().result().size());
  assert_int_equal(second.evident_regions, reference.observer().counts().evident);

  take(2);
  const app::HealthReport& h = health();
  assert_int_equal(h.dropped_pairs, 1);
  assert_at_least(h.overruns[static_cast<int>(cfg::Task::kVo)], 1);
  assert_int_equal(h.frames, 3);
  assert_int_equal(h.bad_priors, 0);
}

void test_parts_are_within_the_root(void**) {
  std::size_t sum = 0;
  for (const app::RootPart& part : app::kRootParts) {
    assert_true(part.bytes > 0);
    assert_true(part.bytes <= part.max_bytes);
    const bool within_another = part.name[0] == ' ';
    if (!within_another && part.bytes != sizeof(app::FlightApp)) sum += part.bytes;
  }
  // What the parts leave out is small.
  assert_at_most(sum, sizeof(app::FlightApp));
  assert_at_least(sum, sizeof(app::FlightApp) - sizeof(app::FlightApp) / 20);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_without_a_start_nothing_moves),
      cmocka_unit_test(test_raw_pairs),
      cmocka_unit_test(test_raw_pairs_without_their_tables),
      cmocka_unit_test(test_init_clears_everything),
      cmocka_unit_test(test_bad_rig),
      cmocka_unit_test(test_start_commands),
      cmocka_unit_test(test_trim_commands),
      cmocka_unit_test(test_damaged_commands),
      cmocka_unit_test(test_commands_wait_for_the_frames_end),
      cmocka_unit_test(test_maps),
      cmocka_unit_test(test_a_bad_map_is_no_map),
      cmocka_unit_test(test_spoiled_pairs),
      cmocka_unit_test(test_swapped_and_noise_pairs),
      cmocka_unit_test(test_bad_motion_priors_are_refused_and_counted),
      cmocka_unit_test(test_a_motion_prior_serves_the_pair_that_it_names),
      cmocka_unit_test(test_an_attitude_serves_the_pair_that_it_names),
      cmocka_unit_test(test_bad_attitudes_are_refused_and_counted),
      cmocka_unit_test(test_a_prior_passed_over_is_counted),
      cmocka_unit_test(test_priors_of_a_camera_that_begins_anew),
      cmocka_unit_test(test_init_forgets_a_busy_life),
      cmocka_unit_test(test_repeated_and_overtaken_pairs),
      cmocka_unit_test(test_swapped_order_and_gaps),
      cmocka_unit_test(test_commands_that_come_again_change_nothing),
      cmocka_unit_test(test_a_ground_segment_that_begins_anew),
      cmocka_unit_test(test_a_refused_command_may_come_again),
      cmocka_unit_test(test_an_upset_bank_keeps_its_map),
      cmocka_unit_test(test_reports_tell_what_is),
      cmocka_unit_test(test_a_link_without_room),
      cmocka_unit_test(test_overrun_of_vo),
      cmocka_unit_test(test_parts_are_within_the_root),
  };
  return cmocka_run_group_tests(tests, open_sample, nullptr);
}
