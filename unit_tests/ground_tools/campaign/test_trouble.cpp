// Troubles of a campaign: what is drawn, what the rover then meets, and what is told of it.
#include "campaign/trouble.hpp"

#include <cmath>
#include <map>

#include "base/output_file.hpp"
#include "cmap/cmap_file.hpp"
#include "ground_tools/scratch.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

const test::Scratch scratch;
constexpr std::size_t kPairs = 330;
constexpr double kStep_m = 0.06;

TroubleSetup drawn(std::uint64_t seed, Trouble trouble) {
  return draw_trouble(seed, trouble, kPairs, kStep_m);
}

/// Each is in its range, fills it, and changes nothing else.
void test_what_is_drawn(void**) {
  static std::map<std::string, std::pair<double, double>> seen;
  const auto number = [](const char* what, double value, double low, double high) {
    if (!(value >= low && value <= high)) fail_msg("%s = %g, not in %g .. %g", what, value, low, high);
    const double share = (value - low) / (high - low);
    auto& [least, most] = seen.try_emplace(what, share, share).first->second;
    least = std::min(least, share);
    most = std::max(most, share);
  };
  double squares = 0.0;
  for (std::uint64_t seed = 1000; seed < 1400; ++seed) {
    const TroubleSetup start = drawn(seed, Trouble::kStartError);
    number("sigma", start.start_sigma_xy_m, 0.5, 5.0);
    number("sigma yaw", start.start_sigma_yaw_rad * kDegPerRad, 2.0, 20.0);
    squares += std::pow(start.start_error.x_m / start.start_sigma_xy_m, 2) +
               std::pow(start.start_error.yaw_rad / start.start_sigma_yaw_rad, 2);
    assert_true(start.gone == 0 && start.black == 0 && !start.mirrored);
    const TroubleSetup site = drawn(seed, Trouble::kWrongSite);
    assert_true(site.mirrored && site.start_error.x_m == 0.0 && site.gone + site.black == 0);
    const TroubleSetup slip = drawn(seed, Trouble::kSlip);
    number("slid", kStep_m * static_cast<double>(slip.gone), 0.54, 1.2);
    number("from", static_cast<double>(slip.first), 66.0, 165.0);
    assert_true(slip.black == 0 && slip.start_error.yaw_rad == 0.0 && slip.start_sigma_xy_m == 0.05);
    const TroubleSetup dark = drawn(seed, Trouble::kDark);
    assert_true(dark.black == 9 || dark.black == 25 || dark.black == 100);
    assert_true(dark.first + dark.black < kPairs - 60 && dark.gone == 0);  // two fixes after it
    const TroubleSetup kidnap = drawn(seed, Trouble::kKidnap);
    number("off", kidnap.start_error.translation().norm(), 3.0, 8.0);
    assert_true(kidnap.start_error.yaw_rad == kPi && kidnap.start_sigma_xy_m == 0.05);
  }
  assert_true(squares > 680.0 && squares < 920.0);  // errors are as large as their sigmas say
  for (const auto& [what, range] : seen) {
    if (range.first > 0.1 || range.second < 0.9)
      fail_msg("%s: drawn from %g to %g of its range alone", what.c_str(), range.first, range.second);
  }
}

/// Pair k shows k, and is taken at x = k.
class Track : public Drive {
 public:
  std::string name() const override { return "track"; }
  const StereoRig& rig() const override { return rig_; }
  std::size_t size() const override { return 20; }
  FrameTag tag(std::size_t index) const override { return {static_cast<int>(index) + 100, 7.0}; }
  PairImages images(std::size_t index) const override {
    PairImages pair;
    pair.left = pair.right = {2, 1, {static_cast<std::uint8_t>(index + 1), 9}};
    return pair;
  }
  std::optional<Pose3> truth_cam(std::size_t index) const override { return truth_rover(index); }
  std::optional<Pose3> truth_rover(std::size_t index) const override {
    Pose3 pose;
    pose.t.x() = static_cast<double>(index);
    return pose;
  }
  const std::vector<TruthRock>& truth_rocks() const override { return rocks_; }

 private:
  StereoRig rig_;
  std::vector<TruthRock> rocks_;
};

void test_pairs_that_are_gone(void**) {
  static Track track;
  TroubleSetup setup;
  setup.first = 5;
  setup.gone = 3;
  const TroubledDrive drive(track, setup);
  assert_int_equal(drive.size(), 17);
  for (std::size_t i = 0; i < drive.size(); ++i) {
    const std::size_t k = i < 5 ? i : i + 3;
    assert_int_equal(drive.images(i).left.pixels[0], k + 1);
    assert_true(drive.truth_rover(i)->t.x() == static_cast<double>(k));
    assert_true(drive.truth_cam(i)->t.x() == static_cast<double>(k));
    assert_int_equal(drive.tag(i).number, i);  // nothing tells of the gap
  }
}

void test_pairs_that_are_black(void**) {
  static Track track;
  TroubleSetup setup;
  setup.first = 5;
  setup.black = 3;
  const TroubledDrive drive(track, setup);
  assert_int_equal(drive.size(), 20);
  for (std::size_t i = 0; i < drive.size(); ++i) {
    const PairImages pair = drive.images(i);
    const bool black = i >= 5 && i < 8;
    assert_int_equal(pair.left.pixels.size(), 2);
    for (const Image* image : {&pair.left, &pair.right})
      assert_true((image->pixels[0] == 0) == black && (image->pixels[1] == 0) == black);
    assert_true(drive.truth_rover(i)->t.x() == static_cast<double>(i));
  }
}

/// Another place: as many boulders on the same ground, no longer where they were.
void test_another_site(void**) {
  std::vector<TableBoulder> boulders(3);
  const Vec2 places[] = {Vec2(1.0, 1.0), Vec2(2.0, 7.0), Vec2(9.0, 3.0)};
  for (std::size_t i = 0; i < 3; ++i) {
    boulders[i].p_map_m = places[i];
    boulders[i].diameter_m = 0.1 * (1.0 + static_cast<double>(i));
  }
  const std::vector<std::uint8_t> map = encode_cmap(boulders, {0.0, 0.0, 10.0, 8.0}, 0.01, {});
  assert_true(troubled_map(map, {}) == map);
  TroubleSetup setup;
  setup.mirrored = true;
  const CmapContent made = decode_cmap(troubled_map(map, setup), "made");
  assert_int_equal(made.boulders.size(), 3);
  for (const TableBoulder& b : made.boulders) {
    const auto i = static_cast<std::size_t>(std::round(10.0 * b.diameter_m)) - 1;
    assert_near(b.p_map_m.x(), 10.0 - places[i].x(), 0.02);
    assert_near(b.p_map_m.y(), places[i].y(), 0.02);
  }
}

void test_names(void**) {
  assert_int_equal(parse_troubles("all").size(), kTroubles);
  assert_true(parse_troubles("kidnap,dark,kidnap") ==
              (std::vector<Trouble>{Trouble::kDark, Trouble::kKidnap}));
  assert_refused(parse_troubles("dark,wet"), "'wet' is none; give all, or names between commas: start_error");
  assert_refused(parse_troubles(""), "--troubles");
}

TroubledRun ended(double end_xy_m, double sigma_m, const char* trust) {
  TroubledRun run;
  run.seed = 1003;
  run.trouble = Trouble::kSlip;
  run.fixes = {1, 2, 3, 4};
  run.end_xy_m = end_xy_m;
  run.end_sigma_m = sigma_m;
  run.end_trust = trust;
  return run;
}

void test_who_is_misled(void**) {
  assert_true(ended(0.15, 0.01, "confirmed").right() && !ended(0.15, 0.01, "confirmed").misled());
  assert_true(ended(0.16, 0.05, "confirmed").misled());
  assert_false(ended(0.16, 0.06, "confirmed").misled());  // within three sigmas
  assert_true(ended(9.0, 0.05, "coasting").misled());
  assert_false(ended(9.0, 0.05, "lost").misled() || ended(9.0, 0.05, "unconfirmed").misled());
}

void test_the_table(void**) {
  static std::vector<TroubledRun> runs;
  runs = {ended(0.16, 0.05, "confirmed"), ended(0.1, 0.05, "coasting"), ended(4.0, 0.5, "lost")};
  runs[2].trouble = Trouble::kKidnap;
  const std::string text = to_csv(runs);
  assert_true(text.find("1003,slip,1,2,3,4,0.1600,0.0500,confirmed,misled\n") != std::string::npos);
  const std::filesystem::path path = scratch.file("troubles.csv", text);
  assert_string_equal(to_csv(read_troubles(path)).c_str(), text.c_str());
  const nlohmann::ordered_json json = troubles_json(runs);
  assert_int_equal(json.size(), 2);
  assert_true(json["slip"]["drives"] == 2 && json["slip"]["end_misled"]["count"] == 1);
  assert_true(json["slip"]["fixes"]["false"]["count"] == 8 && json["slip"]["fixes"]["false"]["of"] == 20);
  assert_true(json["kidnap"]["end_right"]["count"] == 0 && json["kidnap"]["end_misled"]["count"] == 0);
  assert_refused(read_troubles(scratch.file("cut.csv", text.substr(0, text.size() - 3))), "cut.csv");
  std::string other = text;
  other.replace(other.find("slip"), 4, "wind");
  assert_refused(read_troubles(scratch.file("other.csv", other)), "other.csv:2: 'wind' is no trouble");
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_what_is_drawn),
      cmocka_unit_test(test_pairs_that_are_gone),
      cmocka_unit_test(test_pairs_that_are_black),
      cmocka_unit_test(test_another_site),
      cmocka_unit_test(test_names),
      cmocka_unit_test(test_who_is_misled),
      cmocka_unit_test(test_the_table),
  };
  return cmocka_run_group_tests_name("ground_tools/campaign/trouble", tests, nullptr, nullptr);
}
