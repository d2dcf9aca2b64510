// The whole localizer on the sample: how good it is, how it takes bad input, and that
// slicing changes nothing.
#include "localizer/localizer.hpp"

#include <cstring>

#include "core/random.hpp"
#include "integration/replay.hpp"

using namespace cairn;
using namespace cairn::test;

namespace {

Localizer localizer;
ground::Dataset data;
std::vector<ground::TableBoulder> rocks;
FlightMap true_map;
constexpr std::size_t kFrames = kSanitized ? 31 : 91;
constexpr std::size_t kShort = kSanitized ? 10 : 20;

LocalizerStatus set_start(std::size_t index = 0) {
  return localizer.set_start(*data.truth_rover(index), 0.02, 0.004);
}

void begin(const LocalizerParams& params = {}) {
  assert_status(localizer.init(params, rig_of(data)), LocalizerStatus::kReady);
  assert_status(localizer.set_trim({}), LocalizerStatus::kReady);
  localizer.set_map(true_map.map);
  assert_status(set_start(), LocalizerStatus::kReady);
}

const Pair& pair_of(std::size_t index) {
  static Pair pair;
  load(data.frames()[index], pair);
  return pair;
}

void run(std::size_t first, std::size_t end) {
  for (std::size_t i = first; i < end; ++i) frame(localizer, pair_of(i));
}

double error_m(std::size_t index) { return (localizer.T_map_cam().t - data.truth_cam(index)->t).norm(); }

// ---- how good it is

void test_corrected_by_true_rocks(void**) {
  begin();
  const Drive d = drive(localizer, {}, data, kFrames);
  assert_at_most(d.vo_end_m, 0.008 * d.path_m);
  assert_at_most(d.end_xy_m, 0.03);
  assert_at_most(d.largest_xy_m, 0.05);
  assert_at_most(d.largest_excess_m, 0.06);
  assert_at_most(std::fabs(d.end_yaw_deg), 0.5);
  // A clump of rocks of 0.3 m, seen in pieces, is in all three local maps: less here than over
  // the whole field (0.86).
  assert_at_least(d.local.share(), 0.75);
  assert_at_least(d.local.boulders, 5 * d.rounds);
  assert_int_equal(d.rounds, kFrames / kFixInterval);
  const LocalizerHealth& h = localizer.health();
  assert_int_equal(h.frames, kFrames);
  assert_int_equal(h.vo[static_cast<int>(VoStatus::kMotion)], kFrames - 1);
  assert_int_equal(h.vo[static_cast<int>(VoStatus::kFirstFrame)], 1);
  assert_int_equal(h.boulders[static_cast<int>(ObserveStatus::kBoulders)], kFrames);
  assert_int_equal(h.fixes[static_cast<int>(FixStatus::kApplied)], d.fixes);
  assert_int_equal(h.extrapolated + h.abandoned_boulders + h.dropped_tracks + h.bad_priors, 0);
  assert_at_least(d.fixes, 1);
}

void test_paper_variant(void**) {
  begin(paper_params());
  const Drive d = drive(localizer, paper_params(), data, kFrames);
  assert_at_most(d.vo_end_m, 0.10 * d.path_m);
  assert_at_most(d.largest_xy_m, 0.5);
  assert_int_equal(localizer.health().vo[static_cast<int>(VoStatus::kMotion)], kFrames - 1);
  assert_near(localizer.fusion().scale(), 0.0, 0.0);  // fixes are taken whole
}

/// The map origin moved by 0.2 m: a whole fix follows it, a weighted one hardly, and both keep height,
/// pitch and roll.
void test_whole_and_weighted_fixes(void**) {
  static std::vector<ground::TableBoulder> moved;
  moved = rocks;
  for (ground::TableBoulder& b : moved) b.p_map_m.x() += 0.2;
  static FlightMap map;
  assert_status(map.make(moved), MapStatus::kUsable);
  for (const CorrectionMode mode : {CorrectionMode::kWhole, CorrectionMode::kWeighted}) {
    LocalizerParams params;
    params.correction = mode;
    begin(params);
    localizer.set_map(map.map);
    assert_status(localizer.set_start(*data.truth_rover(0), 0.2, 0.02), LocalizerStatus::kReady);
    run(0, kShort);
    const Pose3 before = localizer.T_map_rover();
    const Pose3 vo_before = localizer.vo_T_map_cam();
    const FixStatus status = fix(localizer);
    const Pose3 after = localizer.T_map_rover();
    assert_near((localizer.vo_T_map_cam().t - vo_before.t).norm(), 0.0, 0.0);
    assert_near(after.t.z(), before.t.z(), 1e-12);
    const Attitude a = attitude_of(before.q);
    const Attitude b = attitude_of(after.q);
    assert_near(a.pitch_rad, b.pitch_rad, 1e-12);
    assert_near(a.roll_rad, b.roll_rad, 1e-12);
    const FixRecord& record = localizer.last_fix();
    assert_int_equal(record.frame, kShort);
    assert_near(record.correction.x_m, after.t.x() - before.t.x(), 1e-12);
    assert_near(record.correction.y_m, after.t.y() - before.t.y(), 1e-12);
    assert_near(record.correction.yaw_rad, b.yaw_rad - a.yaw_rad, 1e-12);
    assert_status(status, FixStatus::kApplied);
    assert_near(after.t.x() - before.t.x(), 0.2, 0.05);
  }
}

void test_trim(void**) {
  begin();
  for (const StepTrim& bad : {StepTrim{0.49, 0.0}, StepTrim{2.01, 0.0}, StepTrim{NAN, 0.0},
                              StepTrim{1.0, 0.101}, StepTrim{1.0, -0.101}, StepTrim{1.0, NAN}}) {
    assert_status(localizer.set_trim(bad), LocalizerStatus::kBadTrim);
  }
  for (const StepTrim& good : {StepTrim{0.5, 0.1}, StepTrim{2.0, -0.1}, StepTrim{1.0, 0.0}}) {
    assert_status(localizer.set_trim(good), LocalizerStatus::kReady);
  }
  run(0, kShort);
  const Pose3 start = *data.truth_cam(0);
  const Pose3 plain = localizer.vo_T_map_cam();
  begin();
  const double turn = 0.01;
  assert_status(localizer.set_trim({1.02, turn}), LocalizerStatus::kReady);
  run(0, kShort);
  const Pose3 worse = localizer.vo_T_map_cam();
  const double way = (plain.t - start.t).norm();
  assert_near((worse.t - start.t).norm() / way, 1.02, 0.003);
  const double turned = turn * (data.truth_rover(kShort - 1)->t - data.truth_rover(0)->t).norm();
  assert_near(rotation_error_deg(worse, plain) * kRadPerDeg, turned, 0.03 * turned);
  assert_near(wrap_angle(planar(worse).yaw_rad - planar(plain).yaw_rad), turned, 0.3 * turned);
  assert_near((localizer.T_map_cam().t - worse.t).norm(), 0.0, 1e-12);  // no fix yet
}

// ---- bad input

void test_bad_rigs(void**) {
  StereoRig rig = rig_of(data);
  rig.width_px = 0;
  assert_status(localizer.init({}, rig), LocalizerStatus::kBadRig);
  rig.width_px = cfg::kImageWidth + 1;
  assert_status(localizer.init({}, rig), LocalizerStatus::kBadRig);
  rig = rig_of(data);
  rig.height_px = cfg::kImageHeight + 1;
  assert_status(localizer.init({}, rig), LocalizerStatus::kBadRig);
  rig = rig_of(data);
  rig.baseline_m = NAN;
  assert_status(localizer.init({}, rig), LocalizerStatus::kBadRig);
  rig = rig_of(data);
  rig.T_rover_cam.t.x() = INFINITY;
  assert_status(localizer.init({}, rig), LocalizerStatus::kBadRig);
}

void test_bad_starts(void**) {
  assert_status(localizer.init({}, rig_of(data)), LocalizerStatus::kReady);
  assert_status(localizer.pose_source(), PoseSource::kNone);
  const Pair& pair = pair_of(0);
  assert_status(localizer.begin_frame(pair.left.view(), pair.right.view(), nullptr),
                LocalizerStatus::kNoStart);
  finish_frame(localizer);
  assert_int_equal(localizer.frame(), 0);
  Pose3 bad = *data.truth_rover(0);
  bad.t.y() = NAN;
  assert_status(localizer.set_start(bad, 0.02, 0.004), LocalizerStatus::kBadPose);
  bad = *data.truth_rover(0);
  bad.q = Quat(0.0, 0.0, 0.0, 0.0);
  assert_status(localizer.set_start(bad, 0.02, 0.004), LocalizerStatus::kBadPose);
  for (const double sigma : {0.0, -1.0, static_cast<double>(NAN), static_cast<double>(INFINITY)}) {
    assert_status(localizer.set_start(*data.truth_rover(0), sigma, 0.004), LocalizerStatus::kBadPose);
    assert_status(localizer.set_start(*data.truth_rover(0), 0.02, sigma), LocalizerStatus::kBadPose);
  }
  assert_status(localizer.begin_frame(pair.left.view(), pair.right.view(), nullptr),
                LocalizerStatus::kNoStart);
  assert_status(set_start(), LocalizerStatus::kReady);
  assert_near((localizer.T_map_rover().t - data.truth_rover(0)->t).norm(), 0.0, 1e-9);
  frame(localizer, pair);
  assert_status(localizer.pose_source(), PoseSource::kStart);
  assert_near(error_m(0), 0.0, 1e-6);
}

/// A new start in the middle of a frame: that frame is over, and the next one is the first of the new site.
void test_start_within_a_frame(void**) {
  begin();
  run(0, 2);
  const Pair& pair = pair_of(2);
  assert_status(localizer.begin_frame(pair.left.view(), pair.right.view(), nullptr), LocalizerStatus::kReady);
  assert_status(set_start(3), LocalizerStatus::kReady);
  assert_status(localizer.pose_source(), PoseSource::kNone);
  finish_frame(localizer);
  assert_status(localizer.pose_source(), PoseSource::kNone);
  assert_int_equal(localizer.health().vo[static_cast<int>(VoStatus::kIdle)], 0);
  frame(localizer, pair_of(3));
  assert_status(localizer.pose_source(), PoseSource::kStart);
  frame(localizer, pair_of(4));
  assert_status(localizer.pose_source(), PoseSource::kVo);
  assert_at_most(error_m(4), 0.01);
  assert_int_equal(localizer.health().abandoned_boulders, 0);
}

/// Frame 2 is spoiled: the pose is held, and catches up with frame 3.
struct Spoiled {
  const char* what;
  VoStatus status;
};

void spoil(Pair& pair, int kind) {
  static Random random(17);
  const auto fill = [](ground::Image& image, std::uint8_t grey) {
    image.pixels.assign(image.pixels.size(), grey);
  };
  switch (kind) {
    case 0: pair.left = {}; break;
    case 1: pair.right = {}; break;
    case 2: pair.left = pair.right = {}; break;
    case 3:
      fill(pair.left, 0);
      fill(pair.right, 0);
      break;
    case 4:
      fill(pair.left, 255);
      fill(pair.right, 255);
      break;
    case 5: fill(pair.right, 0); break;
    case 6:
      for (std::uint8_t& p : pair.left.pixels) p = static_cast<std::uint8_t>(random.below(256));
      for (std::uint8_t& p : pair.right.pixels) p = static_cast<std::uint8_t>(random.below(256));
      break;
    case 7: --pair.left.height; break;
    case 8: pair.right.width -= 2; break;
    default: std::swap(pair.left, pair.right); break;
  }
}

void test_spoiled_images(void**) {
  constexpr Spoiled kKinds[] = {
      {"no left image", VoStatus::kBadImage},    {"no right image", VoStatus::kBadImage},
      {"no images", VoStatus::kBadImage},        {"black", VoStatus::kFewFeatures},
      {"saturated", VoStatus::kFewFeatures},     {"right black", VoStatus::kFewFeatures},
      {"noise", VoStatus::kFewStereo},           {"left too low", VoStatus::kBadImage},
      {"right too narrow", VoStatus::kBadImage}, {"left and right swapped", VoStatus::kFewStereo},
  };
  for (int kind = 0; kind < 10; ++kind) {
    begin();
    run(0, 2);
    static Pair pair;
    pair = pair_of(2);
    spoil(pair, kind);
    const Pose3 before = localizer.T_map_cam();
    frame(localizer, pair);
    print_message("%s: status %d, source %d\n", kKinds[kind].what, static_cast<int>(localizer.vo().status()),
                  static_cast<int>(localizer.pose_source()));
    assert_status(localizer.vo().status(), kKinds[kind].status);
    assert_status(localizer.pose_source(), PoseSource::kHeld);
    assert_near((localizer.T_map_cam().t - before.t).norm(), 0.0, 0.0);
    run(3, 4);
    assert_status(localizer.pose_source(), PoseSource::kVo);
    assert_at_most(error_m(3), 0.015);
    assert_int_equal(localizer.health().vo[static_cast<int>(kKinds[kind].status)], 1);
    assert_int_equal(localizer.health().extrapolated, 0);
  }
}

/// By chance a few features of swapped images match. Such a frame must never become VO's reference.
void test_swapped_at_every_place(void**) {
  static Pair pair;
  for (std::size_t i = 2; i < data.frames().size(); i += kSanitized ? 50 : 5) {
    begin();
    assert_status(set_start(i - 1), LocalizerStatus::kReady);
    run(i - 1, i);
    pair = pair_of(i);
    std::swap(pair.left, pair.right);
    frame(localizer, pair);
    assert_status(localizer.vo().status(), VoStatus::kFewStereo);
    run(i, i + 1);
    assert_status(localizer.pose_source(), PoseSource::kVo);
    assert_at_most(error_m(i), 0.01);
  }
}

void test_spoiled_first_frame(void**) {
  begin();
  static Pair pair;
  pair = {};
  frame(localizer, pair);
  assert_status(localizer.pose_source(), PoseSource::kHeld);
  run(0, 2);
  assert_status(localizer.pose_source(), PoseSource::kVo);
  assert_at_most(error_m(1), 0.01);
}

void test_dropped_frames(void**) {
  begin();
  run(0, 3);
  run(4, 5);
  assert_status(localizer.pose_source(), PoseSource::kVo);
  run(6, 8);
  assert_at_most(error_m(7), 0.02);
}

/// A place that was never seen before: VO has nothing to go by.
void test_lost(void**) {
  const Pose3 step = data.truth_cam(1)->inverse() * *data.truth_cam(2);
  for (const bool with_prior : {false, true}) {
    begin();
    run(0, 3);
    const Pose3 before = localizer.T_map_cam();
    Pose3 prior;
    prior.t = Vec3(0.0, 0.0, 0.2);
    frame(localizer, pair_of(70), with_prior ? &prior : nullptr);
    assert_status(localizer.pose_source(), PoseSource::kExtrapolated);
    assert_int_equal(localizer.health().extrapolated, 1);
    const Pose3 moved = before.inverse() * localizer.T_map_cam();
    assert_at_most((moved.t - (with_prior ? prior : step).t).norm(), 0.01);
    const Pose3 at_70 = localizer.T_map_cam();
    frame(localizer, pair_of(71));
    assert_status(localizer.vo().status(), VoStatus::kMotion);  // boulders may tell that the prior was none
    const Pose3 true_step = data.truth_cam(70)->inverse() * *data.truth_cam(71);
    assert_at_most((at_70.inverse() * localizer.T_map_cam()).t.norm() - true_step.t.norm(), 0.01);
  }
}

Trust trust() { return localizer.trust(); }

/// Whatever happened: the pose is within three of the sigmas that are claimed for it.
void assert_honest(const Pose3& truth) {
  assert_at_most(xy_error_m(localizer.T_map_cam(), truth), 3.0 * localizer.fusion().sigma_xy_m());
  assert_at_most(std::fabs(yaw_error_deg(localizer.T_map_cam(), truth)) * kRadPerDeg,
                 3.0 * localizer.fusion().sigma_yaw_rad());
}

void assert_honest(std::size_t index) { assert_honest(*data.truth_cam(index)); }

Pose3 true_step(std::size_t index) { return data.truth_cam(index - 1)->inverse() * *data.truth_cam(index); }

/// Pictures go dark for a while. Without priors the pose is held, and the rover may be anywhere near; with
/// them it goes along. Short: the next good pair bridges it, as if nothing had been. Long: it stays doubtful.
void test_dark_frames(void**) {
  const Pair missing;
  for (const std::size_t dark : {std::size_t{3}, std::size_t{20}}) {  // VO bridges ten yet
    for (const bool with_priors : {false, true}) {
      begin();
      run(0, 4);
      assert_status(trust(), Trust::kClaimed);
      const double before = localizer.fusion().sigma_xy_m();
      for (std::size_t i = 4; i < 4 + dark; ++i) {
        const Pose3 prior = true_step(i);
        frame(localizer, missing, with_priors ? &prior : nullptr);
        assert_status(localizer.pose_source(), with_priors ? PoseSource::kPrior : PoseSource::kHeld);
        assert_status(trust(), Trust::kCoasting);
        assert_honest(i);
        if (with_priors) assert_at_most(error_m(i), 0.01);
      }
      assert_at_least(localizer.fusion().sigma_xy_m(), std::hypot(before, 0.005 * static_cast<double>(dark)));
      const bool bridged = dark == 3;
      for (std::size_t i = 4 + dark; i < 6 + dark; ++i) {
        frame(localizer, pair_of(i));
        assert_honest(i);
      }
      assert_status(localizer.pose_source(), PoseSource::kVo);
      assert_status(trust(), bridged ? Trust::kClaimed : Trust::kUnconfirmed);
      if (bridged) {
        assert_at_most(error_m(5 + dark), 0.015);
        assert_at_most(localizer.fusion().sigma_xy_m(), before + 0.002);
      } else {
        assert_at_least(localizer.fusion().sigma_xy_m(),
                        std::hypot(before, 0.005 * static_cast<double>(dark)));
      }
    }
  }
}

/// Pairs that never came: VO goes over them, farther than the mission allows from frame to frame.
void test_missed_pairs(void**) {
  LocalizerParams params;
  params.vo.max_step_m = 0.1;
  begin(params);
  run(0, 4);
  const Pair& pair = pair_of(6);
  localizer.miss(2, nullptr);
  frame(localizer, pair);
  assert_status(localizer.pose_source(), PoseSource::kVo);
  assert_int_equal(localizer.vo().result().frames, 3);
  assert_at_most(error_m(6), 0.015);
  assert_at_most(localizer.fusion().sigma_xy_m(), 0.03);
  assert_status(trust(), Trust::kClaimed);
  frame(localizer, pair_of(7));  // the step of one frame is a third of what was measured
  assert_int_equal(localizer.vo().result().frames, 1);
  assert_at_most(error_m(7), 0.015);
  // Where VO can't go over it, what the missed pairs hide stays.
  begin();
  run(0, 4);
  const Pair& far = pair_of(70);
  localizer.miss(65, nullptr);
  frame(localizer, far);
  assert_status(localizer.pose_source(), PoseSource::kExtrapolated);
  assert_status(trust(), Trust::kUnconfirmed);
  assert_honest(70);
  frame(localizer, pair_of(71));
  assert_honest(71);
  assert_status(trust(), Trust::kUnconfirmed);
}

/// A slide in one step, farther than VO follows and than it holds possible: whatever it makes of the pair,
/// the error is within what sigma says. After that VO goes on.
void test_a_slide_of_metres(void**) {
  for (const std::size_t far : {12U, 20U, 28U, 36U, 44U}) {
    begin();
    run(0, 4);
    frame(localizer, pair_of(3 + far));
    assert_honest(3 + far);
    frame(localizer, pair_of(4 + far));
    assert_status(localizer.pose_source(), PoseSource::kVo);
    assert_honest(4 + far);
    print_message("%zu pairs on: %.2f m off at sigma %.2f\n", far, error_m(4 + far),
                  localizer.fusion().sigma_xy_m());
  }
}

/// A camera that delivers its last pair again, while the rover drives on.
void test_frozen_pair(void**) {
  for (const bool with_priors : {false, true}) {
    begin();
    run(0, 4);
    for (std::size_t i = 4; i < 7; ++i) {
      const Pose3 prior = true_step(i);
      frame(localizer, pair_of(3), with_priors ? &prior : nullptr);
      assert_status(localizer.watch(), WatchStatus::kFrozen);
      assert_status(localizer.pose_source(), with_priors ? PoseSource::kPrior : PoseSource::kHeld);
      assert_status(trust(), Trust::kCoasting);
      assert_honest(i);
    }
    frame(localizer, pair_of(7));
    assert_status(localizer.watch(), WatchStatus::kClear);
    assert_status(trust(), Trust::kClaimed);
    assert_at_most(error_m(7), 0.015);
    assert_int_equal(localizer.health().watch[static_cast<int>(WatchStatus::kFrozen)], 3);
  }
}

/// A prior that tells of another motion: the pose is VO's, but no longer sure of itself.
void test_contradicted(void**) {
  begin();
  run(0, 4);
  Pose3 prior = true_step(4);
  frame(localizer, pair_of(4), &prior);
  assert_status(localizer.watch(), WatchStatus::kClear);
  assert_status(trust(), Trust::kClaimed);
  const double before = localizer.fusion().sigma_xy_m();
  prior = true_step(5);
  prior.t *= -2.0;
  frame(localizer, pair_of(5), &prior);
  assert_status(localizer.watch(), WatchStatus::kContradicted);
  assert_status(localizer.pose_source(), PoseSource::kDoubted);
  assert_status(trust(), Trust::kUnconfirmed);
  assert_at_least(localizer.fusion().sigma_xy_m(), std::hypot(before, 2.5 * true_step(5).t.norm()));
  assert_at_most(error_m(5), 0.015);
  frame(localizer, pair_of(6));
  assert_status(localizer.watch(), WatchStatus::kClear);
  assert_status(trust(), Trust::kUnconfirmed);
}

/// A right picture that is a frame late, wherever on the way: no motion is believed that it leads to.
void test_late_right_image(void**) {
  static Pair pair;
  for (std::size_t i = 3; i + 1 < data.frames().size(); i += kSanitized ? 40 : 8) {
    begin();
    assert_status(set_start(i - 2), LocalizerStatus::kReady);
    run(i - 2, i - 1);
    run(i - 1, i);
    pair = pair_of(i);
    pair.right = pair_of(i - 1).right;  // frozen: the one before's
    frame(localizer, pair);
    assert_status(localizer.watch(), WatchStatus::kFrozen);
    pair = pair_of(i + 1);
    pair.right = pair_of(i).right;  // late, and new
    frame(localizer, pair);
    assert_status(localizer.vo().status(), VoStatus::kFewStereo);
    assert_status(trust(), Trust::kCoasting);
    assert_honest(i + 1);
  }
}

/// The pair of frame i, its lower rows that of frame 0: the rover's own deck, or ground that stands still.
const Pair& with_deck(std::size_t i, int share_percent) {
  static Pair deck, pair;
  deck = pair_of(0);
  pair = pair_of(i);
  for (ground::Image* side : {&pair.left, &pair.right}) {
    const ground::Image& own = side == &pair.left ? deck.left : deck.right;
    const int ground_rows = side->height * (100 - share_percent) / 100;
    const auto from = static_cast<std::size_t>(ground_rows) * static_cast<std::size_t>(side->width);
    for (std::size_t k = from; k < side->pixels.size(); ++k) side->pixels[k] = own.pixels[k];
  }
  return pair;
}

/// A deck that the mission knows of, and one that it doesn't: VO takes its motion from what moves.
void test_own_hardware(void**) {
  for (const bool known : {false, true}) {
    LocalizerParams params;
    const StereoRig rig = rig_of(data);
    if (known) params.vo.own.cover({0, rig.height_px * 6 / 10, rig.width_px, rig.height_px});
    params.boulders.own = params.vo.own;
    begin(params);
    for (std::size_t i = 0; i < kShort; ++i) {
      frame(localizer, with_deck(i, known ? 40 : 20));
      if (i == 0) continue;
      assert_status(localizer.pose_source(), PoseSource::kVo);
      assert_status(localizer.watch(), known ? WatchStatus::kClear : WatchStatus::kOwnHardware);
      if (!known) assert_at_least(localizer.vo().result().own_points, 12);
      if (known) assert_int_equal(localizer.vo().result().own_points, 0);
      assert_at_most(error_m(i), 0.03);
      assert_honest(i);
    }
  }
}

/// Most of the view stands still. It may be a deck, it may be the ground, and the rest an arm that moves: the
/// pose is within three sigmas either way, and not reported as good, until a motion prior tells.
void test_a_view_that_mostly_stands_still(void**) {
  enum class Prior { kNone, kMoves, kStands };
  for (const Prior what : {Prior::kNone, Prior::kMoves, Prior::kStands}) {
    begin();
    for (std::size_t i = 0; i < 8; ++i) {
      const Pose3 prior = what == Prior::kMoves && i > 0 ? true_step(i) : Pose3();
      frame(localizer, with_deck(i, 70), what == Prior::kNone ? nullptr : &prior);
      if (i == 0) continue;
      assert_true(localizer.vo().result().mostly_own);
      assert_honest(i);
      if (what == Prior::kMoves) {
        assert_status(localizer.pose_source(), PoseSource::kVo);
        assert_status(localizer.watch(), WatchStatus::kOwnHardware);
        assert_status(trust(), Trust::kClaimed);
        continue;
      }
      assert_honest(*data.truth_cam(0));  // it never moved
      assert_status(localizer.pose_source(), PoseSource::kDoubted);
      assert_status(localizer.watch(),
                    what == Prior::kNone ? WatchStatus::kMostlyStill : WatchStatus::kContradicted);
      assert_status(trust(), Trust::kUnconfirmed);
    }
  }
}

void test_motion_priors(void**) {
  begin();
  run(0, 2);
  Pose3 prior = data.truth_cam(1)->inverse() * *data.truth_cam(2);
  frame(localizer, pair_of(2), &prior);
  assert_int_equal(localizer.health().bad_priors, 0);
  prior.t.z() = NAN;
  frame(localizer, pair_of(3), &prior);
  prior = {};
  prior.q = Quat(2.0, 0.0, 0.0, 0.0);
  frame(localizer, pair_of(4), &prior);
  assert_status(localizer.pose_source(), PoseSource::kVo);
  assert_int_equal(localizer.health().bad_priors, 2);
  assert_at_most(error_m(4), 0.01);
  begin();
  run(0, 1);
  assert_int_equal(localizer.health().bad_priors, 0);
}

// ---- attitude

Vec3 true_up(std::size_t index) { return data.truth_rover(index)->q.conjugate() * Vec3(0.0, 0.0, 1.0); }
double true_yaw_rad(std::size_t index) { return planar(*data.truth_rover(index)).yaw_rad; }

double tilt_error_rad(std::size_t index) {
  const Vec3 up = localizer.T_map_rover().q * true_up(index);
  return std::hypot(up.x(), up.y());
}

/// The start's pitch and roll are off by half a degree, which costs 0.01 m a metre of height until gravity
/// comes. x, y and yaw stay, and so does VO alone.
void test_gravity_corrects_tilt_and_height(void**) {
  begin();
  Pose3 start = *data.truth_rover(0);
  start.q = (quat_exp(Vec3(0.006, -0.007, 0.0)) * start.q).normalized();
  assert_status(localizer.set_start(start, 0.02, 0.004), LocalizerStatus::kReady);
  run(0, kShort);
  const std::size_t last = kShort - 1;
  const Pose3 before = localizer.T_map_rover();
  const Pose3 vo_before = localizer.vo_T_map_cam();
  const double height_before_m = std::fabs(before.t.z() - data.truth_rover(last)->t.z());
  const double tilt_before_rad = tilt_error_rad(last);
  assert_at_least(tilt_before_rad, 0.007);
  assert_status(localizer.take_gravity(true_up(last), 0.001), AttitudeStatus::kFused);
  assert_status(localizer.gravity_status(), AttitudeStatus::kFused);
  assert_at_most(tilt_error_rad(last), 0.2 * tilt_before_rad);
  const Pose3 after = localizer.T_map_rover();
  assert_at_most(std::fabs(after.t.z() - data.truth_rover(last)->t.z()), 0.7 * height_before_m + 0.0005);
  assert_near(after.t.x(), before.t.x(), 0.0);
  assert_near(after.t.y(), before.t.y(), 0.0);
  assert_near(planar(after).yaw_rad, planar(before).yaw_rad, 0.002);
  assert_near((localizer.vo_T_map_cam().t - vo_before.t).norm(), 0.0, 0.0);
  run(kShort, kShort + 1);  // and steps go on from there
  assert_at_most(tilt_error_rad(kShort), 0.2 * tilt_before_rad);
  assert_int_equal(localizer.health().gravity[static_cast<int>(AttitudeStatus::kFused)], 1);
  assert_status(localizer.gravity_status(), AttitudeStatus::kNone);
}

void test_a_heading_corrects_yaw(void**) {
  begin();
  Pose3 start = *data.truth_rover(0);
  start.q = (quat_exp(Vec3(0.0, 0.0, 0.02)) * start.q).normalized();
  assert_status(localizer.set_start(start, 0.02, 0.02), LocalizerStatus::kReady);
  run(0, kShort);
  const std::size_t last = kShort - 1;
  const double off_m = xy_error_m(localizer.T_map_rover(), *data.truth_rover(last));
  assert_status(localizer.take_heading(true_yaw_rad(last), 0.001), AttitudeStatus::kFused);
  assert_at_most(std::fabs(wrap_angle(planar(localizer.T_map_rover()).yaw_rad - true_yaw_rad(last))), 0.001);
  assert_at_most(xy_error_m(localizer.T_map_rover(), *data.truth_rover(last)), 0.4 * off_m);
  assert_at_most(localizer.fusion().sigma_yaw_rad(), 0.001);
  // The same angle, a turn away; and what can't be.
  assert_status(
      localizer.take_heading(true_yaw_rad(last) - 2.0 * kPi * (true_yaw_rad(last) > 0.0 ? 1 : -1), 0.001),
      AttitudeStatus::kFused);
  assert_status(localizer.take_heading(true_yaw_rad(last) + 0.1, 0.01), AttitudeStatus::kInconsistent);
  for (const double bad : {6.3, static_cast<double>(NAN)})
    assert_status(localizer.take_heading(bad, 0.01), AttitudeStatus::kBadInput);
  for (const double bad : {0.0, -0.1, 1.01, 0.99e-4, static_cast<double>(NAN)})
    assert_status(localizer.take_heading(0.0, bad), AttitudeStatus::kBadInput);
  assert_int_equal(localizer.health().headings[static_cast<int>(AttitudeStatus::kFused)], 2);
  assert_int_equal(localizer.health().headings[static_cast<int>(AttitudeStatus::kInconsistent)], 1);
  assert_int_equal(localizer.health().headings[static_cast<int>(AttitudeStatus::kBadInput)], 7);
}

/// Before the fix is applied and after it a heading leads to the same pose: neither lost nor taken twice.
void test_a_heading_waits_for_the_fix(void**) {
  Pose3 pose[2];
  double sigma_rad[2] = {};
  constexpr std::size_t kBegun = kShort - 3;
  for (const bool waits : {false, true}) {
    LocalizerParams params;
    params.tracks.min_sightings = 1;
    begin(params);
    run(0, kBegun);
    localizer.begin_fix();
    assert_status(localizer.last_fix().status, FixStatus::kRunning);
    run(kBegun, kShort);
    const auto heading = [&] { return localizer.take_heading(true_yaw_rad(kShort - 1) + 0.004, 0.002); };
    if (waits) {
      const Pose3 before = localizer.T_map_rover();
      assert_status(heading(), AttitudeStatus::kWaiting);
      assert_status(heading(), AttitudeStatus::kWaiting);  // the first one is passed over
      assert_near((localizer.T_map_rover().t - before.t).norm(), 0.0, 0.0);
    }
    WorkBudget all = WorkBudget::unlimited();
    assert_status(localizer.step_fix(all), Progress::kDone);
    localizer.apply_fix();
    assert_status(localizer.last_fix().status, FixStatus::kApplied);
    if (!waits) assert_status(heading(), AttitudeStatus::kFused);
    assert_status(localizer.heading_status(), AttitudeStatus::kFused);
    pose[waits ? 1 : 0] = localizer.T_map_rover();
    sigma_rad[waits ? 1 : 0] = localizer.fusion().sigma_yaw_rad();
    const auto& counts = localizer.health().headings;
    assert_int_equal(counts[static_cast<int>(AttitudeStatus::kFused)], 1);
    assert_int_equal(counts[static_cast<int>(AttitudeStatus::kWaiting)], waits ? 2 : 0);
    assert_int_equal(counts[static_cast<int>(AttitudeStatus::kPassedOver)], waits ? 1 : 0);
  }
  assert_near((pose[1].t - pose[0].t).norm(), 0.0, 1e-9);
  assert_near((pose[1].q.coeffs() - pose[0].q.coeffs()).norm(), 0.0, 1e-9);
  assert_near(sigma_rad[1], sigma_rad[0], 1e-9);
}

void test_attitudes_without_a_pose(void**) {
  const auto refused = [&](AttitudeStatus status) {
    assert_status(localizer.take_gravity(true_up(0), 0.003), status);
    assert_status(localizer.take_heading(true_yaw_rad(0), 0.003), status);
  };
  begin();
  refused(AttitudeStatus::kNoPose);
  run(0, 2);
  assert_status(localizer.begin_frame(ImageU8(), ImageU8(), nullptr), LocalizerStatus::kReady);
  assert_status(localizer.pose_source(), PoseSource::kHeld);
  refused(AttitudeStatus::kNoPose);
  assert_int_equal(localizer.health().gravity[static_cast<int>(AttitudeStatus::kNoPose)], 2);
  const Pair& pair = pair_of(2);
  assert_status(localizer.begin_frame(pair.left.view(), pair.right.view(), nullptr), LocalizerStatus::kReady);
  refused(AttitudeStatus::kNoPose);  // VO is not done
  finish_frame(localizer);
  // A heading waits, the pose is guessed, and nobody uses it any more.
  localizer.begin_fix();
  assert_status(localizer.take_heading(true_yaw_rad(2), 0.003), AttitudeStatus::kWaiting);
  assert_status(set_start(2), LocalizerStatus::kReady);
  assert_int_equal(localizer.health().headings[static_cast<int>(AttitudeStatus::kPassedOver)], 1);
  begin(paper_params());
  run(0, 1);
  refused(AttitudeStatus::kPaper);
}

void test_unfinished_boulders_are_counted(void**) {
  begin();
  run(0, 2);
  for (std::size_t i = 2; i < 4; ++i) {
    const Pair& pair = pair_of(i);
    assert_status(localizer.begin_frame(pair.left.view(), pair.right.view(), nullptr),
                  LocalizerStatus::kReady);
    WorkBudget all = WorkBudget::unlimited();
    assert_status(localizer.step_vo(all), Progress::kDone);
    WorkBudget some(1'000'000);
    if (i == 2) assert_status(localizer.step_boulders(some), Progress::kMore);
  }
  frame(localizer, pair_of(4));
  assert_int_equal(localizer.health().abandoned_boulders, 2);
  assert_int_equal(localizer.health().boulders[static_cast<int>(ObserveStatus::kBoulders)], 3);
  assert_at_most(error_m(4), 0.01);
}

// ---- fixes

/// A fix after five frames, every boulder counting from its first sighting on.
FixStatus fix_after(LocalizerParams params, const OrbitalMap& map, std::size_t frames) {
  params.tracks.min_sightings = 1;
  begin(params);
  localizer.set_map(map);
  run(0, frames);
  const Pose3 before = localizer.T_map_cam();
  const FixStatus status = fix(localizer);
  if (status != FixStatus::kApplied) assert_near((localizer.T_map_cam().t - before.t).norm(), 0.0, 0.0);
  assert_int_equal(localizer.health().fixes[static_cast<int>(status)], 1);
  return status;
}

void test_maps_that_are_none(void**) {
  begin();
  assert_status(localizer.last_fix().status, FixStatus::kNone);
  assert_status(fix_after({}, OrbitalMap(), 2), FixStatus::kNoMap);
  static FlightMap map;
  assert_status(map.make({}, {0.0, -30.0, 20.0, -10.0}), MapStatus::kNoBoulders);
  assert_status(fix_after({}, map.map, 2), FixStatus::kNoMap);
  map.bytes = true_map.bytes;
  map.bytes.back() ^= 0x10U;  // of the only tile
  assert_status(map.validate(), MapStatus::kPayloadCrc);
  assert_status(fix_after({}, map.map, 2), FixStatus::kNoMap);
  map.bytes[4] ^= 0x80U;
  assert_status(map.validate(), MapStatus::kUnknownVersion);
  assert_status(fix_after({}, map.map, 2), FixStatus::kNoMap);
  run(2, 4);
  assert_at_most(error_m(3), 0.01);
  localizer.set_map(true_map.map);  // a good one comes
  assert_status(fix(localizer), FixStatus::kApplied);
  assert_at_most(error_m(3), 0.05);
}

void test_every_fix_status(void**) {
  constexpr std::size_t kSome = 3;
  LocalizerParams whole;
  whole.correction = CorrectionMode::kWhole;
  assert_status(fix_after(whole, true_map.map, kSome), FixStatus::kApplied);
  assert_at_most(error_m(kSome - 1), 0.1);
  assert_at_least(localizer.last_fix().pairs, 4);
  assert_int_equal(localizer.last_fix().local_boulders, localizer.local_map().size());
  assert_status(fix_after({}, true_map.map, 0), FixStatus::kNoLocalBoulders);
  LocalizerParams params = whole;
  params.map_window_radius_m = 0.0;
  assert_status(fix_after(params, true_map.map, kSome), FixStatus::kNoMapBoulders);
  params = whole;
  params.icp.min_pairs = 200;
  assert_status(fix_after(params, true_map.map, kSome), FixStatus::kTooFewPairs);
  params = whole;
  params.icp.min_lever_m = 100.0;
  assert_status(fix_after(params, true_map.map, kSome), FixStatus::kWeakGeometry);
  params = whole;
  params.icp.max_iterations = 1;
  assert_status(fix_after(params, true_map.map, kSome), FixStatus::kIterationLimit);
  params = whole;
  params.icp.max_correction_m = 1.0e-6;
  assert_status(fix_after(params, true_map.map, kSome), FixStatus::kBeyondLimit);
  params = whole;
  params.icp.max_iterations = 0;
  assert_status(fix_after(params, true_map.map, kSome), FixStatus::kBadInput);
}

/// The site's map, mirrored: another place as dense as this one.
const OrbitalMap& mirrored_map() {
  static FlightMap map;
  std::vector<ground::TableBoulder> mirrored = rocks;
  double middle = 0.0;
  for (const ground::TableBoulder& b : rocks) middle += b.p_map_m.x() / static_cast<double>(rocks.size());
  for (ground::TableBoulder& b : mirrored) b.p_map_m.x() = 2.0 * middle - b.p_map_m.x();
  assert_status(map.make(mirrored), MapStatus::kUsable);
  return map.map;
}

/// Another place's map is never believed, moves nothing, and is told.
void test_another_places_map(void**) {
  begin();
  localizer.set_map(mirrored_map());
  bool told = false;
  for (std::size_t n = 0; n < (kSanitized ? 2U : 3U); ++n) {
    run(30 * n, 30 * n + 28);
    const Pose3 before = localizer.T_map_cam();
    assert_true(fix(localizer) != FixStatus::kApplied);
    assert_near((localizer.T_map_cam().t - before.t).norm(), 0.0, 0.0);
    assert_true(localizer.trust() != Trust::kConfirmed);
    told = told || localizer.trust() != Trust::kClaimed;
  }
  if (!kSanitized) assert_true(told);
}

/// A start that is unknown, one that is a metre off and says so, and one that claims to be good: all end
/// where the rover is, and the last is noticed.
void test_starts_that_are_off(void**) {
  if (kSanitized) skip();  // minutes there
  const Pose3 truth = *data.truth_rover(0);
  struct Start {
    Vec3 off_m;
    double yaw_rad, sigma_m, sigma_rad;
  };
  for (const Start& s :
       {Start{Vec3(3.0, -2.0, 0.0), 2.0, Localizer::kUnknownStart_m, kPi},
        Start{Vec3(0.8, -0.6, 0.0), 0.1, 1.0, 0.1}, Start{Vec3(0.8, -0.6, 0.0), 0.0, 0.05, 0.01}}) {
    begin();
    Pose3 start = truth;
    start.t += s.off_m;
    start.q = (lift({0.0, 0.0, s.yaw_rad}).q * truth.q).normalized();
    assert_status(localizer.set_start(start, s.sigma_m, s.sigma_rad), LocalizerStatus::kReady);
    const Trust at_start = s.sigma_m > 1.0e3 ? Trust::kLost
                           : s.sigma_m > 0.5 ? Trust::kUnconfirmed
                                             : Trust::kClaimed;
    assert_status(localizer.trust(), at_start);
    for (std::size_t n = 0; n < 3; ++n) {
      run(30 * n, 30 * n + 30);
      const FixStatus status = fix(localizer);
      if (status == FixStatus::kApplied) assert_at_most(error_m(30 * n + 29), 0.15);
      if (n == 0 && status != FixStatus::kApplied && s.sigma_m > 0.5)
        assert_status(localizer.trust(), at_start);
    }
    assert_status(localizer.trust(), s.sigma_m > 0.5 ? Trust::kConfirmed : localizer.trust());
    if (s.sigma_m > 0.5) {
      assert_at_most(error_m(89), 0.1);
    } else {
      assert_true(localizer.trust() != Trust::kConfirmed || error_m(89) < 0.1);
    }
  }
}

void test_late_fix(void**) {
  LocalizerParams params;
  params.correction = CorrectionMode::kWhole;
  params.tracks.min_sightings = 1;
  begin(params);
  run(0, 3);
  localizer.begin_fix();
  assert_status(localizer.last_fix().status, FixStatus::kRunning);
  WorkBudget tiny(1);
  assert_status(localizer.step_fix(tiny), Progress::kMore);
  const Pose3 before = localizer.T_map_cam();
  localizer.apply_fix();
  assert_status(localizer.last_fix().status, FixStatus::kLate);
  assert_near((localizer.T_map_cam().t - before.t).norm(), 0.0, 0.0);
  localizer.apply_fix();  // closed: nothing more to apply
  assert_int_equal(localizer.health().fixes[static_cast<int>(FixStatus::kLate)], 1);
  assert_status(fix(localizer), FixStatus::kApplied);
}

/// A map that claims more boulders around here than anything has room for is cut, or refused, and said so; no
/// unit of work is longer on it.
void test_a_map_that_is_all_boulders(void**) {
  constexpr int kAcross = kSanitized ? 150 : 400;
  constexpr std::uint64_t kLongestUnit = 20000;
  static FlightMap crowded;
  const Vec2 centre = planar(*data.truth_rover(0)).translation();
  std::vector<ground::TableBoulder> boulders;
  for (int i = 0; i < kAcross * kAcross; ++i) {
    ground::TableBoulder b{};
    b.p_map_m = centre + 0.02 * Vec2(i % kAcross - 0.5 * kAcross, 0.5 * kAcross - i / kAcross);
    boulders.push_back(b);
  }
  assert_status(crowded.make(boulders), MapStatus::kUsable);
  for (const CorrectionMode mode : {CorrectionMode::kWhole, CorrectionMode::kWeighted}) {
    LocalizerParams params;
    params.correction = mode;
    params.map_window_radius_m = params.map_fix.map_window_radius_m = 10.0;
    params.tracks.min_sightings = 1;
    begin(params);
    localizer.set_map(crowded.map);
    run(0, 2);
    localizer.begin_fix();
    assert_status(localizer.last_fix().status, FixStatus::kRunning);
    std::uint64_t ops = 0;
    for (Progress progress = Progress::kMore; progress == Progress::kMore;) {
      WorkBudget one(1);
      progress = localizer.step_fix(one);
      assert_at_most(one.spent(), kLongestUnit);
      ops += one.spent();
      if (mode == CorrectionMode::kWhole && localizer.last_fix().map_boulders != 0) break;  // ICP's from here
    }
    localizer.apply_fix();
    const FixRecord& f = localizer.last_fix();
    if (mode == CorrectionMode::kWhole) {
      assert_true(f.map_window_full);
      assert_int_equal(f.map_boulders, cfg::kMaxMapWindowBoulders);
      assert_at_most(ops, 50 * cfg::kMaxMapWindowBoulders + 100000);
    } else if (!kSanitized) {
      assert_status(f.status, FixStatus::kNoSearchRoom);
    }
  }
  localizer.set_map(true_map.map);
}

/// A search that isn't done at the correction is neither lost nor begun anew, whether it is done before the
/// next fix would begin or after, and its fix is of its snapshot.
void test_fix_goes_on(void**) {
  LocalizerParams params;
  params.tracks.min_sightings = 1;
  for (const bool done_between : {false, true}) {
    begin(params);
    run(0, 6);
    localizer.begin_fix();
    const std::uint32_t snapshot = localizer.last_fix().frame;
    WorkBudget tiny(1);
    assert_status(localizer.step_fix(tiny), Progress::kMore);
    const Pose3 before = localizer.T_map_cam();
    localizer.apply_fix();
    assert_status(localizer.last_fix().status, FixStatus::kRunning);
    assert_near((localizer.T_map_cam().t - before.t).norm(), 0.0, 0.0);
    run(6, 9);
    WorkBudget all = WorkBudget::unlimited();
    if (done_between) assert_status(localizer.step_fix(all), Progress::kDone);
    assert_status(fix(localizer), FixStatus::kApplied);
    assert_int_equal(localizer.last_fix().frame, snapshot);
    assert_int_equal(localizer.health().fixes[static_cast<int>(FixStatus::kLate)], 0);
    assert_at_most(error_m(8), 0.05);
  }
}

/// Boulders that left the window are in no local map, though none were seen since.
void test_local_map_forgets_over_empty_ground(void**) {
  LocalizerParams params;
  params.tracks.min_sightings = 1;
  params.tracks.window_frames = 2;
  begin(params);
  run(0, 3);
  static Pair missing;
  missing = {};
  for (int i = 0; i < 2; ++i) frame(localizer, missing);
  assert_status(fix(localizer), FixStatus::kApplied);
  frame(localizer, missing);
  assert_status(fix(localizer), FixStatus::kNoLocalBoulders);
}

// ---- slices

/// All that a run gives, as bytes.
struct Outcome {
  std::vector<std::uint8_t> bytes;

  template <typename T>
  void add(const T& value) {
    const auto* p = reinterpret_cast<const std::uint8_t*>(&value);
    bytes.insert(bytes.end(), p, p + sizeof value);
  }
  void add_pose(const Pose3& pose) {
    for (int i = 0; i < 3; ++i) add(pose.t[i]);
    for (int i = 0; i < 4; ++i) add(pose.q.coeffs()[i]);
  }
};

/// Asks for one job's next slice; its budget comes from a list that goes round.
template <typename Step>
void in_slices(const std::vector<std::uint32_t>& budgets, std::size_t& next, const Step& step) {
  for (Progress progress = Progress::kMore; progress == Progress::kMore;) {
    WorkBudget budget(budgets[next++ % budgets.size()]);
    progress = step(budget);
  }
}

Outcome sliced_run(const std::vector<std::uint32_t>& budgets) {
  Outcome out;
  std::size_t next = 0;
  LocalizerParams params;
  params.tracks.min_sightings = 2;
  begin(params);
  bool fixing = false;
  for (std::size_t i = 0; i < (kSanitized ? 5U : 9U); ++i) {
    const Pair& pair = pair_of(i);
    assert_status(localizer.begin_frame(pair.left.view(), pair.right.view(), nullptr),
                  LocalizerStatus::kReady);
    in_slices(budgets, next, [](WorkBudget& b) { return localizer.step_vo(b); });
    // A fix begun in the frame before takes turns with the boulders, and is applied at the end of this frame.
    Progress boulders = Progress::kMore;
    Progress fix = Progress::kMore;
    while (boulders == Progress::kMore || fix == Progress::kMore) {
      WorkBudget one(budgets[next++ % budgets.size()]);
      boulders = localizer.step_boulders(one);
      WorkBudget two(budgets[next++ % budgets.size()]);
      fix = localizer.step_fix(two);
    }
    if (fixing) {
      localizer.apply_fix();
      out.add(localizer.last_fix().correction.x_m);
      out.add(localizer.last_fix().correction.y_m);
      out.add(localizer.last_fix().correction.yaw_rad);
      out.add(localizer.last_fix().pairs);
      out.add(localizer.last_fix().rms_m);
      out.add(localizer.last_fix().status);
    }
    fixing = i % 3 == 2;
    if (fixing) {
      localizer.begin_fix();
      for (const LocalBoulder& b : localizer.local_map()) {
        out.add(b.p_site_m.x());
        out.add(b.p_site_m.y());
        out.add(b.z_site_m);
        out.add(b.diameter_m);
        out.add(b.spread_m);
        out.add(b.id);
        out.add(b.sightings);
      }
    }
    out.add_pose(localizer.vo_T_map_cam());
    out.add_pose(localizer.T_map_cam());
    out.add(localizer.fusion().sigma_xy_m());
    out.add(localizer.fusion().scale());
  }
  return out;
}

void test_slices_give_the_same(void**) {
  static Outcome whole, parts;
  whole = sliced_run({UINT32_MAX});
  assert_at_least(localizer.health().fixes[static_cast<int>(FixStatus::kApplied)], 1);
  assert_true(whole.bytes.size() > 600);
  static std::vector<std::vector<std::uint32_t>> slicings;
  slicings = {{1}, {977}, {250'007}, {1, 5'000'000, 33, 70'001, 9}};
  for (const std::vector<std::uint32_t>& budgets : slicings) {
    parts = sliced_run(budgets);
    assert_int_equal(parts.bytes.size(), whole.bytes.size());
    assert_memory_equal(parts.bytes.data(), whole.bytes.data(), whole.bytes.size());
  }
}

int open_sample(void**) {
  data = ground::Dataset::open(kSample);
  rocks = true_rocks(kSample);
  return true_map.make(rocks) == MapStatus::kUsable ? 0 : 1;
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_corrected_by_true_rocks),
      cmocka_unit_test(test_paper_variant),
      cmocka_unit_test(test_whole_and_weighted_fixes),
      cmocka_unit_test(test_trim),
      cmocka_unit_test(test_bad_rigs),
      cmocka_unit_test(test_bad_starts),
      cmocka_unit_test(test_start_within_a_frame),
      cmocka_unit_test(test_spoiled_images),
      cmocka_unit_test(test_swapped_at_every_place),
      cmocka_unit_test(test_spoiled_first_frame),
      cmocka_unit_test(test_dropped_frames),
      cmocka_unit_test(test_lost),
      cmocka_unit_test(test_dark_frames),
      cmocka_unit_test(test_missed_pairs),
      cmocka_unit_test(test_a_slide_of_metres),
      cmocka_unit_test(test_frozen_pair),
      cmocka_unit_test(test_late_right_image),
      cmocka_unit_test(test_own_hardware),
      cmocka_unit_test(test_a_view_that_mostly_stands_still),
      cmocka_unit_test(test_contradicted),
      cmocka_unit_test(test_motion_priors),
      cmocka_unit_test(test_gravity_corrects_tilt_and_height),
      cmocka_unit_test(test_a_heading_corrects_yaw),
      cmocka_unit_test(test_a_heading_waits_for_the_fix),
      cmocka_unit_test(test_attitudes_without_a_pose),
      cmocka_unit_test(test_unfinished_boulders_are_counted),
      cmocka_unit_test(test_maps_that_are_none),
      cmocka_unit_test(test_every_fix_status),
      cmocka_unit_test(test_another_places_map),
      cmocka_unit_test(test_starts_that_are_off),
      cmocka_unit_test(test_late_fix),
      cmocka_unit_test(test_fix_goes_on),
      cmocka_unit_test(test_a_map_that_is_all_boulders),
      cmocka_unit_test(test_local_map_forgets_over_empty_ground),
      cmocka_unit_test(test_slices_give_the_same),
  };
  return cmocka_run_group_tests_name("integration/localizer", tests, open_sample, nullptr);
}
