// What pairs say about themselves: pairs over a textured plane, and what people do to them.
#include "dataset/pair_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "core/trig.hpp"
#include "support/cmocka.hpp"
#include "support/plane_scene.hpp"
#include "support/sanitized.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

constexpr int kWidth = 256, kHeight = 192;
constexpr std::size_t kFrames = 4, kLong = 12;

struct MemoryDrive : Drive {
  StereoRig the_rig{kWidth, kHeight, 200.0, 200.0, 127.5, 95.5, 0.12, {}};
  std::vector<PairImages> pairs;

  std::string name() const override { return "memory"; }
  const StereoRig& rig() const override { return the_rig; }
  std::size_t size() const override { return pairs.size(); }
  FrameTag tag(std::size_t index) const override { return {static_cast<int>(index), 0.0}; }
  PairImages images(std::size_t index) const override { return pairs[index]; }
  std::optional<Pose3> truth_cam(std::size_t) const override { return {}; }
  std::optional<Pose3> truth_rover(std::size_t) const override { return {}; }
  const std::vector<TruthRock>& truth_rocks() const override {
    static const std::vector<TruthRock> none;
    return none;
  }
};

Image blank() {
  Image out;
  out.width = kWidth;
  out.height = kHeight;
  out.pixels.resize(std::size_t{kWidth} * kHeight);
  return out;
}

/// 6 cm a frame.
const MemoryDrive& good_and_long() {
  static MemoryDrive drive;
  if (!drive.pairs.empty()) return drive;
  static test::PlaneScene scene;
  scene.make(7);
  const Pose3 T_rover_cam = mast_pose(0.7, 39.0 * kRadPerDeg, drive.the_rig.baseline_m);
  Random random(3);
  for (std::size_t i = 0; i < kLong; ++i) {
    const Pose3 T_map_cam =
        Pose3{Quat(1.0, 0.0, 0.0, 0.0), Vec3(0.06 * static_cast<double>(i), 0.0, 0.0)} * T_rover_cam;
    PairImages pair;
    pair.left = pair.right = blank();
    scene.render(drive.the_rig, T_map_cam, false, 1.0, random, pair.left.pixels.data());
    scene.render(drive.the_rig, T_map_cam, true, 1.0, random, pair.right.pixels.data());
    drive.pairs.push_back(std::move(pair));
  }
  return drive;
}

const MemoryDrive& good() {
  static MemoryDrive drive;
  if (drive.pairs.empty()) {
    drive = good_and_long();
    drive.pairs.resize(kFrames);
  }
  return drive;
}

/// Each pixel from where `from` says, bilinear; the border repeated.
Image moved(const Image& image, const std::function<Vec2(Vec2)>& from) {
  Image out = blank();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const Vec2 at = from(Vec2(x, y));
      const double u = std::clamp(at.x(), 0.0, kWidth - 1.001), v = std::clamp(at.y(), 0.0, kHeight - 1.001);
      const int i = static_cast<int>(u), j = static_cast<int>(v);
      const double a = u - i, b = v - j;
      const ImageU8 g = image.view();
      out.pixels[static_cast<std::size_t>(y * kWidth + x)] =
          static_cast<std::uint8_t>((1.0 - b) * ((1.0 - a) * g.at(i, j) + a * g.at(i + 1, j)) +
                                    b * ((1.0 - a) * g.at(i, j + 1) + a * g.at(i + 1, j + 1)) + 0.5);
    }
  }
  return out;
}

void expect(const MemoryDrive& drive, PairFault::Kind kind, const char* words) {
  static PairFault fault;
  fault = check_pairs(drive, 0, drive.size());
  if (fault.kind != kind || fault.words.find(words) == std::string::npos)
    fail_msg("kind %d, '%s' in place of '%s'", static_cast<int>(fault.kind), fault.words.c_str(), words);
}

/// The same done to each image of a copy.
MemoryDrive& with(const std::function<void(PairImages&)>& change) {
  static MemoryDrive drive;
  drive = good();
  for (PairImages& pair : drive.pairs) change(pair);
  return drive;
}

void test_good_pairs_say_nothing(void**) { expect(good(), PairFault::Kind::kNone, ""); }

void test_matches_are_where_they_are(void**) {
  static std::vector<PatchMatch> matches;
  const PairImages& pair = good().pairs[0];
  matches = match_patches(pair.left.view(), pair.right.view());
  assert_true(matches.size() > 60);
  // The plane 0.7 m below, 39 degrees down: d = fx b / z, z = h / (y cos + sin), y = (v - cy) / fy.
  std::size_t near = 0;
  for (const PatchMatch& m : matches) {
    const double y = (m.left_px.y() - 95.5) / 200.0, tilt = 39.0 * kRadPerDeg;
    const double disparity = 200.0 * 0.12 * (y * std::cos(tilt) + std::sin(tilt)) / 0.7;
    near += std::fabs(m.disparity_px - disparity) < 0.3 && std::fabs(m.lower_px) < 0.3 ? 1U : 0U;
  }
  assert_true(10 * near > 9 * matches.size());
}

void test_right_images_lower(void**) {
  for (const double lower : {1.5, -3.25, 6.0}) {
    const auto shift = [lower](PairImages& pair) {
      pair.right = moved(pair.right, [lower](Vec2 p) { return Vec2(p.x(), p.y() - lower); });
    };
    static PairFault fault;
    fault = check_pairs(with(shift), 0, kFrames);
    assert_true(fault.kind == PairFault::Kind::kLower);
    double told = 0.0;
    assert_int_equal(std::sscanf(fault.words.c_str(), "right images lie %lf px", &told), 1);
    assert_near(told, std::fabs(lower), 0.1);
    assert_true((fault.words.find("lower than") != std::string::npos) == (lower > 0.0));
    if (test::kSanitized) return;
  }
  // A tenth of a pixel is what rectification leaves.
  expect(with([](PairImages& pair) {
           pair.right = moved(pair.right, [](Vec2 p) { return Vec2(p.x(), p.y() - 0.2); });
         }),
         PairFault::Kind::kNone, "");
}

void test_swapped(void**) {
  expect(with([](PairImages& pair) { std::swap(pair.left, pair.right); }), PairFault::Kind::kSwapped,
         "exchange the folders");
}

/// Each image mirrored top to bottom, and a wall that is as far everywhere.
void test_upside_down(void**) {
  const auto mirrored = [](const Image& image) {
    return moved(image, [](Vec2 p) { return Vec2(p.x(), kHeight - 1.0 - p.y()); });
  };
  expect(with([&](PairImages& pair) {
           pair.left = mirrored(pair.left);
           pair.right = mirrored(pair.right);
         }),
         PairFault::Kind::kUpsideDown, "mirrored top to bottom");
  expect(with([](PairImages& pair) {
           pair.right = moved(pair.left, [](Vec2 p) { return Vec2(p.x() + 12.0, p.y()); });
         }),
         PairFault::Kind::kNone, "");
}

void test_dark_same_and_nothing_in_common(void**) {
  const auto darker = [](PairImages& pair) {
    for (Image* image : {&pair.left, &pair.right}) {
      for (std::uint8_t& g : image->pixels) g = static_cast<std::uint8_t>(g / 64);
    }
  };
  expect(with(darker), PairFault::Kind::kDark, "of 255");
  expect(with([](PairImages& pair) { pair.right = pair.left; }), PairFault::Kind::kSame, "same picture");
  // Beyond the rows that are searched, whatever a neighbour's flow looks like.
  expect(with([](PairImages& pair) {
           pair.right = moved(pair.right, [](Vec2 p) { return Vec2(p.x(), p.y() - 60.0); });
         }),
         PairFault::Kind::kNothingMatches, "within 48 rows");
  expect(with([](PairImages& pair) {
           pair.right = moved(pair.right, [](Vec2 p) { return Vec2(p.x(), p.y() - 17.0); });
         }),
         PairFault::Kind::kLower, "17.");
  // Texture on each side, and none in common.
  expect(with([](PairImages& pair) { std::reverse(pair.right.pixels.begin(), pair.right.pixels.end()); }),
         PairFault::Kind::kNothingMatches, "nothing in common");
}

/// Noise hides what left and right share: it is that which is told, and still what else is wrong.
void test_noisy(void**) {
  const auto noisy = [](PairImages& pair) {
    static Random random(17);
    for (Image* image : {&pair.left, &pair.right}) {
      for (std::uint8_t& g : image->pixels) {
        double noise = -6.0;
        for (int i = 0; i < 12; ++i) noise += random.next() / 4294967296.0;
        g = static_cast<std::uint8_t>(std::clamp(g + 25.0 * noise, 0.0, 255.0));
      }
    }
  };
  expect(with(noisy), PairFault::Kind::kNoisy, "images are noisy");
  expect(with([&](PairImages& pair) {
           std::swap(pair.left, pair.right);
           noisy(pair);
         }),
         PairFault::Kind::kSwapped, "exchange the folders");
  expect(with([&](PairImages& pair) {
           pair.right = moved(pair.right, [](Vec2 p) { return Vec2(p.x(), p.y() - 8.0); });
           noisy(pair);
         }),
         PairFault::Kind::kLower, "lower than");
  expect(with([&](PairImages& pair) {
           std::reverse(pair.right.pixels.begin(), pair.right.pixels.end());
           noisy(pair);
         }),
         PairFault::Kind::kNothingMatches, "nothing in common");
}

void test_right_images_of_another_frame(void**) {
  const std::pair<int, const char*> cases[] = {{1, "are one frame late"},
                                               {-1, "are one frame early"},
                                               {2, "are 2 frames late"},
                                               {-3, "are 3 frames early"}};
  for (const auto& [frames, words] : cases) {
    static MemoryDrive late;
    late = good_and_long();
    for (int i = 0; i < static_cast<int>(kLong); ++i) {
      const int from = i - frames;
      if (from >= 0 && from < static_cast<int>(kLong))
        late.pairs[static_cast<std::size_t>(i)].right =
            good_and_long().pairs[static_cast<std::size_t>(from)].right;
    }
    expect(late, PairFault::Kind::kLate, words);
    if (test::kSanitized) return;
  }
}

/// One side, or both; black pictures are all the same, and no frozen ones.
void test_frozen(void**) {
  expect(with([](PairImages& pair) { pair.left = good().pairs[0].left; }), PairFault::Kind::kFrozen,
         "left images repeat from frame to frame, to the bit, and right ones change");
  expect(with([](PairImages& pair) { pair.right = good().pairs[0].right; }), PairFault::Kind::kFrozen,
         "right images repeat from frame to frame, to the bit, and left ones change");
  expect(with([](PairImages& pair) { pair = good().pairs[0]; }), PairFault::Kind::kFrozen,
         "left and right images repeat");
  expect(with([](PairImages& pair) { pair.left = pair.right = blank(); }), PairFault::Kind::kDark,
         "are dark");
  expect(with([](PairImages& pair) {
           pair.left = pair.right = blank();
           for (Image* image : {&pair.left, &pair.right}) image->pixels.assign(image->pixels.size(), 255);
         }),
         PairFault::Kind::kBright, "expose shorter");
}

void test_turned_and_bent(void**) {
  expect(with([](PairImages& pair) {
           pair.right = moved(pair.right, [](Vec2 p) { return Vec2(p.x(), p.y() - 0.02 * (p.x() - 127.5)); });
         }),
         PairFault::Kind::kTurned, "px of roll");
  // A lens on both: where its pixel came from, to first order.
  const auto lens = [](Vec2 p) {
    const Vec2 c(127.5, 95.5);
    const Vec2 a = (p - c) / 200.0;
    return Vec2(c + (p - c) * (1.0 + 0.28 * a.squaredNorm()));
  };
  expect(with([&](PairImages& pair) {
           pair.left = moved(pair.left, lens);
           pair.right = moved(pair.right, lens);
         }),
         PairFault::Kind::kBent, "raw lenses");
}

void test_fit_by_hand(void**) {
  static std::vector<PatchMatch> matches;
  matches.clear();
  assert_false(fit_rows(matches, 100, 80).has_value());
  for (int x = 5; x < 100; x += 10) {
    for (int y = 5; y < 80; y += 10) {
      const double lower = 0.7 + 2.0 * (x - 50.0) / 100.0;
      matches.push_back({Vec2(x, y), 12.0, (x + y) % 70 == 0 ? 9.0 : lower});
    }
  }
  const std::optional<RowFit> fit = fit_rows(matches, 100, 80);
  assert_near(fit->offset_px, 0.7, 0.01);
  assert_near(fit->roll_px, 2.0, 0.02);
  assert_near(fit->rest_px, 0.0, 0.01);
  assert_near(fit->swapped, 0.0, 0.0);
  // In the corners, 50 px from the middle and 40 px: 2 px at the disparity of most.
  for (PatchMatch& m : matches) {
    const Vec2 off = m.left_px - Vec2(50.0, 40.0);
    m.disparity_px = m.left_px.y() > 60.0 ? 24.0 : 12.0;
    m.lower_px = 2.0 * off.x() / 50.0 * off.y() / 40.0 * m.disparity_px / 12.0;
  }
  assert_near(fit_rows(matches, 100, 80)->bend_px, 2.0, 0.05);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_good_pairs_say_nothing),
      cmocka_unit_test(test_matches_are_where_they_are),
      cmocka_unit_test(test_right_images_lower),
      cmocka_unit_test(test_swapped),
      cmocka_unit_test(test_upside_down),
      cmocka_unit_test(test_dark_same_and_nothing_in_common),
      cmocka_unit_test(test_noisy),
      cmocka_unit_test(test_right_images_of_another_frame),
      cmocka_unit_test(test_frozen),
      cmocka_unit_test(test_turned_and_bent),
      cmocka_unit_test(test_fit_by_hand),
  };
  return cmocka_run_group_tests_name("ground_tools/dataset/pair_check", tests, nullptr, nullptr);
}
