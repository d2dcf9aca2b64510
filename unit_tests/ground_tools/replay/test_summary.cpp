// What a run tells in words: how the poses came about, what most of those not measured lacked, and what was
// found out on board of the rig.
#include "replay/summary.hpp"

#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

Replay drive(int measured, int held, VoStatus why) {
  Replay replay;
  for (int i = 0; i < measured + held; ++i) {
    ReplayFrame frame{};
    const bool is_held = i >= measured;
    frame.report.pose_source = static_cast<std::uint8_t>(is_held ? PoseSource::kHeld : PoseSource::kVo);
    frame.report.vo_status = static_cast<std::uint8_t>(is_held ? why : VoStatus::kMotion);
    replay.frames.push_back(frame);
  }
  return replay;
}

bool says(const std::string& text, const char* word) { return text.find(word) != std::string::npos; }

/// Noise and a lens are causes of matches that are missing or disagree, where the flight module saw them;
/// never of images that are missing, nor of a drive without either.
void test_causes(void**) {
  for (const VoStatus why : {VoStatus::kFewStereo, VoStatus::kFewMatches, VoStatus::kNoConsensus}) {
    Replay replay = drive(30, 10, why);
    const std::string plain = motion_counts(replay).cause();
    assert_false(says(plain, "noisy") || says(plain, "lens seems"));
    replay.health.halved = 10;  // no more than were held: noise may be theirs or not
    assert_string_equal(motion_counts(replay).cause().c_str(), plain.c_str());
    replay.offset.lens = -0.02;
    assert_true(says(motion_counts(replay).cause(), "lens seems distorted"));
    assert_true(says(motion_counts(replay).cause(), "-0.020"));
    replay.health.halved = 25;
    assert_true(says(motion_counts(replay).cause(), "too noisy"));
  }
  Replay missing = drive(30, 10, VoStatus::kBadImage);
  missing.health.halved = 25;
  missing.offset.lens = -0.02;
  assert_true(says(motion_counts(missing).cause(), "missing"));
}

void test_counts(void**) {
  const MotionCounts counts = motion_counts(drive(30, 10, VoStatus::kFewMatches));
  assert_int_equal(counts.measured, 30);
  assert_int_equal(counts.unmeasured(), 10);
  assert_true(says(counts.words(), "of 40 frames 10 held"));
}

/// Frozen pictures are not missing ones, and the side that froze has its name.
void test_frozen(void**) {
  Replay replay = drive(30, 10, VoStatus::kBadImage);
  const auto freeze = [&](int from, bool left, bool right) {
    for (int i = 40 - from; i < 40; ++i) {
      ReplayFrame& frame = replay.frames[static_cast<std::size_t>(i)];
      frame.report.watch = static_cast<std::uint8_t>(WatchStatus::kFrozen);
      frame.left_again = left;
      frame.right_again = right;
    }
  };
  freeze(5, true, true);
  assert_true(says(motion_counts(replay).cause(), "missing"));
  freeze(6, true, true);
  assert_true(motion_counts(replay).mostly_frozen());
  assert_int_equal(motion_counts(replay).cause().rfind("images are those of frames before", 0), 0);
  freeze(6, true, false);
  assert_int_equal(motion_counts(replay).cause().rfind("left images", 0), 0);
  freeze(6, false, true);
  assert_int_equal(motion_counts(replay).cause().rfind("right images", 0), 0);
}

void test_doubted(void**) {
  Replay replay = drive(10, 0, VoStatus::kMotion);
  for (std::size_t i = 2; i < 10; ++i) {
    replay.frames[i].report.pose_source = static_cast<std::uint8_t>(PoseSource::kDoubted);
    replay.frames[i].report.watch =
        static_cast<std::uint8_t>(i < 4 ? WatchStatus::kJumped : WatchStatus::kMostlyStill);
  }
  const MotionCounts counts = motion_counts(replay);
  assert_true(counts.measured == 2 && counts.doubted == 8 && counts.unmeasured() == 0);
  assert_true(says(counts.words(), "0 extrapolated, 8 doubted"));
  assert_true(says(counts.cause(), "give --mask"));
}

/// A rover that stands is told from a slow one, and is no surprise where the truth says the same.
void test_standing(void**) {
  const auto words = [](int frames, double step_m, double turn_rad, double true_step_m = -1.0) {
    Replay replay;
    for (int i = 0; i < frames; ++i) {
      const Pose3 pose{quat_exp(Vec3(0.0, 0.0, turn_rad * i)), Vec3(step_m * i, 0.0, 0.0)};
      replay.vo.push_back({static_cast<double>(i), pose});
      if (true_step_m >= 0.0)
        replay.truth.push_back(
            {static_cast<double>(i), {Quat(1.0, 0.0, 0.0, 0.0), Vec3(true_step_m * i, 0.0, 0.0)}});
    }
    return standing_words(replay);
  };
  assert_true(says(words(25, 0.0002, 0.0), "over 25 frames VO stays within 4.8 mm and 0.00 degrees"));
  assert_true(words(25, 0.002, 0.0).empty());
  assert_true(words(2, 0.003, 0.0).empty());
  assert_false(words(2, 0.001, 0.0).empty());
  assert_true(words(300, 0.0001, 0.0).empty());
  assert_true(words(25, 0.0, 0.001).empty());
  assert_true(words(25, 0.0002, 0.0, 0.0).empty());
  assert_false(words(25, 0.0002, 0.0, 0.01).empty());
  assert_true(words(1, 0.0, 0.0).empty());
}

Replay drive_over(const std::vector<Vec3>& places_m, double interval_s = 1.0, int first_number = 0) {
  Replay replay;
  for (const Vec3& place_m : places_m) {
    const std::size_t i = replay.vo.size();
    replay.vo.push_back({interval_s * static_cast<double>(i), {Quat(1.0, 0.0, 0.0, 0.0), place_m}});
    ReplayFrame frame{};
    frame.report.number = static_cast<std::uint32_t>(first_number) + static_cast<std::uint32_t>(i);
    replay.frames.push_back(frame);
  }
  return replay;
}

/// Frames that are not in the order of time; drives that turn back now and then, shake, or stand, are.
void test_order(void**) {
  const auto words = [](const std::vector<int>& order, double side_m = 0.0, double step_m = 0.06) {
    std::vector<Vec3> places_m;
    for (const int i : order)
      places_m.emplace_back(step_m * i, side_m * static_cast<double>(places_m.size() % 2), 0.0);
    return order_words(drive_over(places_m));
  };
  assert_true(says(words({0, 4, 1, 6, 2, 7, 3, 5}), "VO turns back at 6 of 6 frames, 1.62 m in all"));
  assert_true(says(words({0, 4, 1, 6, 2, 7, 3, 5}), "are a drive of 0.42 m"));
  assert_false(words({0, 2, 1, 3, 5, 4, 6, 8, 7, 9}).empty());  // pairs exchanged
  assert_true(words({0, 1, 2, 3, 4, 5, 6, 7}).empty());
  assert_true(words({0, 1, 2, 3, 4, 5, 4, 3, 2, 1, 0}).empty());  // out and back
  assert_true(words({0, 1, 2, 3, 2, 1, 0, 1, 2, 3}).empty());
  assert_true(words({0, 1, 0}).empty());
  assert_true(words({0, 1, 2, 3, 4, 5, 6, 7}, 0.12).empty());         // sways, and gets on
  assert_true(words({0, 4, 1, 6, 2, 7, 3, 5}, 0.0, 0.0005).empty());  // stands
  assert_true(order_words(drive_over({})).empty());
}

/// Milliseconds from 0, taken for seconds, are a drive of metres an hour; numbers of frames are no times.
void test_pace(void**) {
  const auto words = [](double interval_s, double step_m = 0.06, int first_number = 1) {
    std::vector<Vec3> places_m;
    for (int i = 0; i < 10; ++i) places_m.emplace_back(step_m * i, 0.0, 0.0);
    return pace_words(drive_over(places_m, interval_s, first_number));
  };
  assert_true(says(words(50.0), "stamps are 50 s and VO's steps 0.06 m apart, 4.32 m an hour"));
  assert_true(says(words(50.0), "milliseconds"));
  assert_true(says(words(0.0005), "larger unit"));
  assert_true(words(0.05).empty());
  assert_true(words(20.0).empty());
  assert_true(words(120.0, 0.6).empty());  // as Spirit drove
  assert_true(words(0.1, 3.0).empty());    // a car
  assert_true(words(50.0, 0.001).empty());
  assert_true(words(1.0, 100.0, 0).empty());
  assert_false(words(1.0, 100.0, 1).empty());
}

void test_what_was_found_of_the_rig(void**) {
  Replay replay = drive(3, 0, VoStatus::kMotion);
  assert_true(rig_words(replay).empty());
  replay.offset.rows_px = 3.02;
  replay.offset.columns_px = -0.4;
  replay.offset.lens = -0.018;
  const std::string words = rig_words(replay);
  assert_true(says(words, "3.02 px lower") && says(words, "0.40 px too long") &&
              says(words, "k1 of about -0.018"));
  replay.offset.rows_px = -1.0;
  replay.offset.columns_px = 0.25;
  assert_true(says(rig_words(replay), "1.00 px higher") && says(rig_words(replay), "0.25 px too short"));
}

// A pose that is lost has no sigma to be read as one.
void test_what_the_pose_is_worth(void**) {
  assert_true(trust_words({}).empty());
  Replay replay = drive(3, 0, VoStatus::kMotion);
  for (ReplayFrame& f : replay.frames) {
    f.report.trust = static_cast<std::uint8_t>(Trust::kConfirmed);
    f.report.sigma_xy_m = 0.034F;
  }
  assert_true(says(trust_words(replay), "at the end: confirmed, 0.03 m"));
  replay.frames.back().report.trust = static_cast<std::uint8_t>(Trust::kLost);
  replay.frames.back().report.sigma_xy_m = 1.0e4F;
  const std::string words = trust_words(replay);
  assert_true(says(words, "at the end: lost") && says(words, "lost 1"));
  assert_false(says(words, " m in x"));
}

void test_heights(void**) {
  LocalizerHealth health;
  assert_true(heights_words(health).empty());
  health.heights[static_cast<std::size_t>(AttitudeStatus::kFused)] = 7;
  health.heights[static_cast<std::size_t>(AttitudeStatus::kInconsistent)] = 2;
  assert_string_equal(heights_words(health).c_str(), "heights of the map: taken 7 times, inconsistent 2");
}

/// In the summary each is told in its own field.
void test_rig_in_the_summary(void**) {
  Replay replay = drive(3, 0, VoStatus::kMotion);
  replay.offset.rows_px = 1.5;
  replay.offset.columns_px = -0.25;
  replay.offset.lens = -0.125;
  for (int i = 0; i < 4; ++i) replay.angles[i] = 0.5 * (i + 1);
  replay.health.heights[static_cast<std::size_t>(AttitudeStatus::kFused)] = 7;
  const nlohmann::ordered_json s = summary_json({}, replay, {});
  const nlohmann::ordered_json rig = {{"rows_px", 1.5},       {"columns_px", -0.25}, {"lens", -0.125},
                                      {"turn_x_rad", 0.5},    {"turn_z_rad", 1.0},   {"baseline_y_rad", 1.5},
                                      {"baseline_z_rad", 2.0}};
  assert_true(s["rig"] == rig);
  assert_true(s["counts"]["heights"].size() == 1 && s["counts"]["heights"].begin().value() == 7);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_causes),
      cmocka_unit_test(test_counts),
      cmocka_unit_test(test_frozen),
      cmocka_unit_test(test_doubted),
      cmocka_unit_test(test_standing),
      cmocka_unit_test(test_order),
      cmocka_unit_test(test_pace),
      cmocka_unit_test(test_what_was_found_of_the_rig),
      cmocka_unit_test(test_heights),
      cmocka_unit_test(test_what_the_pose_is_worth),
      cmocka_unit_test(test_rig_in_the_summary),
  };
  return cmocka_run_group_tests_name("ground_tools/replay/summary", tests, nullptr, nullptr);
}
