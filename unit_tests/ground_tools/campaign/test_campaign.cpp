// Campaigns: what is drawn, how fixes are judged, intervals, and going on where a campaign was stopped.
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <set>

#include "base/output_file.hpp"
#include "base/statistics.hpp"
#include "campaign/findings.hpp"
#include "campaign/findings_plot.hpp"
#include "campaign/fix_verdict.hpp"
#include "campaign/setup.hpp"
#include "campaign/trial_table.hpp"
#include "geometry/pose3.hpp"
#include "ground_tools/scratch.hpp"
#include "sim/traverse.hpp"

using namespace cairn;
using namespace cairn::ground;
using cairn::test::Scratch;

namespace {

namespace fs = std::filesystem;

const Scratch scratch;

std::string text_of(const fs::path& path) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  return {bytes.begin(), bytes.end()};
}

// ---- drawing ----------------------------------------------------------------------------------------------

void test_drawn_scenes_are_valid(void**) {
  for (std::uint64_t seed = kFirstSeed; seed < kFirstSeed + 200; ++seed) {
    static Setup setup;
    static std::string toml;
    setup = draw_setup(seed);
    toml = sim::to_toml(setup.scene);
    static std::string why;
    why = test::refusal([] { static_cast<void>(sim::load_scene(scratch.file("drawn.toml", toml))); });
    if (!why.empty()) fail_msg("seed %d: %s", static_cast<int>(seed), why.c_str());
    assert_string_equal(sim::to_toml(sim::load_scene(scratch.path("drawn.toml"))).c_str(), toml.c_str());
    assert_string_equal(sim::to_toml(draw_setup(seed).scene).c_str(), toml.c_str());
  }
}

void within(double value, double low, double high, const char* what) {
  if (!(value >= low && value <= high)) fail_msg("%s = %g, not in %g .. %g", what, value, low, high);
}

void test_drawn_numbers_are_in_range_and_fill_it(void**) {
  static std::map<std::string, std::pair<double, double>> seen;
  const auto number = [](const char* what, double value, double low, double high) {
    within(value, low, high, what);
    const double share = (value - low) / (high - low);
    const auto [at, is_new] = seen.try_emplace(what, share, share);
    if (!is_new) at->second = {std::min(at->second.first, share), std::max(at->second.second, share)};
  };
  for (std::uint64_t seed = kFirstSeed; seed < kFirstSeed + 200; ++seed) {
    static Setup s;
    s = draw_setup(seed);
    number("k", s.scene.rocks.k, 0.03, 0.15);
    number("burial", s.scene.rocks.burial, 0.15, 0.5);
    number("albedo_spread", s.scene.rocks.albedo_spread, 0.2, 0.6);
    number("relief", s.scene.site.relief_rms_m, 0.05, 0.4);
    number("ripples", s.scene.site.ripple_height_m, 0.0, 0.025);
    number("texture", s.scene.site.texture_contrast, 0.04, 0.12);
    number("patches", s.scene.site.patch_contrast, 0.05, 0.25);
    number("sun elevation", s.scene.sun.elevation_deg, 25.0, 65.0);
    number("sun azimuth", s.scene.sun.azimuth_deg, 0.0, 360.0);
    number("ortho elevation", s.scene.ortho_sun.elevation_deg, 25.0, 65.0);
    number("ortho azimuth", s.scene.ortho_sun.azimuth_deg, 0.0, 360.0);
    number("noise", s.scene.camera.noise_dn, 1.0, 4.0);
    number("dust", s.scene.camera.dust_spots, 0, 10);
    number("slip", s.scene.traverse.slip, 0.0, 0.1);
    number("scale", s.worse_scale, 0.97, 1.03);
    number("yaw", s.worse_yaw_deg_per_m, -0.1, 0.1);
    assert_true(s.scene.sun.azimuth_deg != s.scene.ortho_sun.azimuth_deg);
    assert_int_equal(s.scene.seed, seed);
    const std::vector<sim::PathPoint> path = sim::plan(s.scene);
    within(path.back().arc_m, 0.85 * 15.0, 25.5, "path");
    within(s.scene.site.width_m, 8.0, 34.0, "width");
    within(s.scene.site.height_m, 8.0, 34.0, "height");
  }
  for (const auto& [what, range] : seen) {
    if (range.first > 0.05 || range.second < 0.95)
      fail_msg("%s: drawn from %g to %g of its range alone", what.c_str(), range.first, range.second);
  }
}

/// Sparse fields have fewer rocks; all else is drawn as usual.
void test_sparse_fields(void**) {
  for (std::uint64_t seed = kFirstSeed; seed < kFirstSeed + 100; ++seed) {
    static Setup usual, sparse;
    usual = draw_setup(seed);
    sparse = draw_setup(seed, Abundance::kSparse);
    within(sparse.scene.rocks.k, 0.02, 0.032, "k");
    sparse.scene.rocks.k = usual.scene.rocks.k;
    assert_string_equal(sim::to_toml(sparse.scene).c_str(), sim::to_toml(usual.scene).c_str());
    assert_true(sparse.map_pixel_m == usual.map_pixel_m && sparse.worse_scale == usual.worse_scale);
  }
}

void test_maps_and_kinds_come_equally_often(void**) {
  static std::map<std::pair<double, int>, int> count;
  for (std::uint64_t seed = 1003; seed < 1003 + 56; ++seed) {
    const Setup s = draw_setup(seed);
    ++count[{s.map_pixel_m, static_cast<int>(s.scene.traverse.kind)}];
  }
  assert_int_equal(count.size(), 28);
  for (const auto& [pair, times] : count) assert_int_equal(times, 2);
}

// ---- judging ----------------------------------------------------------------------------------------------

void test_verdicts_at_each_border(void**) {
  const auto over = [](double v) { return std::nextafter(v, 1.0e9); };
  assert_true(kRightWithin_m == 0.15 && kFalseBeyond_m == 0.3);
  assert_true(judge_fix(true, 0.0, 0.0) == FixVerdict::kRight);
  assert_true(judge_fix(true, 0.15, 1.0e-9) == FixVerdict::kRight);
  assert_true(judge_fix(true, over(0.15), 1.0e-9) == FixVerdict::kWeak);
  assert_true(judge_fix(true, 0.3, 1.0e-9) == FixVerdict::kWeak);
  assert_true(judge_fix(true, over(0.3), 1.0e-9) == FixVerdict::kFalse);
  // A sigma of 0.5 m on each axis: three times the root of the trace are 2.1 m.
  assert_true(judge_fix(true, 2.12, 0.5) == FixVerdict::kWeak);
  assert_true(judge_fix(true, 2.13, 0.5) == FixVerdict::kFalse);
  assert_true(judge_fix(false, 0.0, 0.0) == FixVerdict::kDeclined);
  assert_true(judge_fix(false, 9.0, 0.1) == FixVerdict::kDeclined);
}

/// A drive of known poses along x, without images.
class Track : public Drive {
 public:
  std::string name() const override { return "track"; }
  const StereoRig& rig() const override { return rig_; }
  std::size_t size() const override { return 4; }
  FrameTag tag(std::size_t index) const override { return {static_cast<int>(index) + 100, 0.0}; }
  PairImages images(std::size_t) const override { return {}; }
  std::optional<Pose3> truth_cam(std::size_t) const override { return std::nullopt; }
  std::optional<Pose3> truth_rover(std::size_t index) const override {
    return Pose3{quat_from_attitude({0.7, 0.1, -0.1}), Vec3(static_cast<double>(index), 2.0, 0.5)};
  }
  const std::vector<TruthRock>& truth_rocks() const override { return rocks_; }

 private:
  StereoRig rig_;
  std::vector<TruthRock> rocks_;
};

/// Frames 100 to 103; the rover is thought to be at truth + `error_m`.
void add_fix(const Track& track, Replay& replay, std::size_t index, FixStatus status, const Vec2& error_m,
             const Vec2& moved_m) {
  ReplayFrame frame;
  frame.index = index;
  frame.report.number = static_cast<std::uint32_t>(index) + 100;
  Pose3 T_map_rover = *track.truth_rover(index);
  T_map_rover.t += Vec3(error_m.x(), error_m.y(), 3.0);  // height counts for nothing
  frame.report.T_map_cam = T_map_rover * rig_of(track).T_rover_cam;
  replay.frames.push_back(frame);
  app::FixReport fix;
  fix.number = frame.report.number;
  fix.status = static_cast<std::uint8_t>(status);
  fix.dx_m = moved_m.x();
  fix.dy_m = moved_m.y();
  fix.sigma_xy_m = 0.05F;
  replay.fixes.push_back(fix);
}

void test_fixes_of_a_replay_are_judged(void**) {
  static Track track;
  static Replay replay;
  add_fix(track, replay, 0, FixStatus::kApplied, Vec2(0.06, 0.08), Vec2(-0.3, 0.08));
  add_fix(track, replay, 1, FixStatus::kApplied, Vec2(0.4, 0.0), Vec2(-0.2, 0.0));  // better, and false
  add_fix(track, replay, 2, FixStatus::kApplied, Vec2(0.2, 0.0), Vec2(0.2, 0.0));   // worse, and but weak
  add_fix(track, replay, 3, FixStatus::kBeyondLimit, Vec2(0.3, 0.4), Vec2(0.2, 0.0));
  const std::vector<JudgedFix> fixes = judge_fixes(replay, track);
  assert_int_equal(fixes.size(), 4);
  const FixVerdict expected[] = {FixVerdict::kRight, FixVerdict::kFalse, FixVerdict::kWeak,
                                 FixVerdict::kDeclined};
  const double before_m[] = {0.36, 0.6, 0.0, 0.5};
  const double after_m[] = {0.1, 0.4, 0.2, 0.5};
  for (std::size_t i = 0; i < 4; ++i) {
    assert_true(fixes[i].verdict == expected[i]);
    assert_near(fixes[i].before_m, before_m[i], 1e-9);
    assert_near(fixes[i].after_m, after_m[i], 1e-9);
  }
  const std::string rows = to_csv_rows(fixes, "worse");
  assert_non_null(std::strstr(rows.c_str(), "worse,101,applied,false,0.6000,0.4000,"));
  assert_non_null(std::strstr(rows.c_str(), "worse,103,beyond_limit,declined,0.5000,0.5000,"));
}

// ---- statistics -------------------------------------------------------------------------------------------

/// Newcombe, Statistics in Medicine 17 (1998), table I: method 3.
void test_wilson_against_published_values(void**) {
  const struct {
    std::size_t hits, n;
    double low, high;
  } known[] = {{81, 263, 0.2553, 0.3662},
               {15, 148, 0.0624, 0.1605},
               {0, 20, 0.0, 0.1611},
               {1, 29, 0.0061, 0.1718},
               {29, 29, 0.8830, 1.0}};
  for (const auto& k : known) {
    const Interval i = wilson(k.hits, k.n);
    assert_near(i.low, k.low, 5e-5);
    assert_near(i.high, k.high, 5e-5);
  }
  assert_true(wilson(0, 0).low == 0.0 && wilson(0, 0).high == 1.0);
}

std::vector<double> one_to(int n) {
  std::vector<double> values;
  for (int i = 0; i < n; ++i) values.push_back(1.0 + (i * 7) % n);  // in no order; 7 does not divide n
  return values;
}

/// Ranks from the sign test's table (Conover, Practical Nonparametric Statistics).
void test_median_and_its_ranks(void**) {
  const struct {
    int n, low;
  } known[] = {{1, 1},  {2, 1},  {5, 1},  {6, 1},   {8, 1},   {9, 2},
               {10, 2}, {20, 6}, {25, 8}, {30, 10}, {50, 18}, {100, 40}};
  for (const auto& k : known) {
    const Median m = median_of(one_to(k.n));
    assert_int_equal(m.n, k.n);
    assert_near(m.value, 0.5 * (k.n + 1), 1e-12);
    assert_near(m.interval.low, k.low, 1e-12);
    assert_near(m.interval.high, k.n + 1 - k.low, 1e-12);
  }
  const double none = std::numeric_limits<double>::quiet_NaN();
  assert_near(median_of({none, 3.0, none}).value, 3.0, 0.0);
  assert_int_equal(median_of({none}).n, 0);
  assert_true(std::isnan(median_of({}).value));
}

// ---- the table and going on -------------------------------------------------------------------------------

/// Figures that differ from trial to trial.
void pretend(Trial& t) {
  const auto i = static_cast<double>(t.setup.seed - kFirstSeed);
  t.map_boulders = 400.0 + i;
  t.frames = 330.0;
  t.path_m = 19.5;
  t.seconds = 1.5;
  for (RunFigures* f : {&t.as_it_is, &t.worse}) {
    f->vo_end_xy_m = (f == &t.worse ? 0.5 : 0.1) + 0.01 * i;
    f->end_xy_m = 0.05 + 0.001 * i;
    f->end_yaw_deg = -0.1 * i;
    f->median_fix_error_m = i == 1.0 ? std::numeric_limits<double>::quiet_NaN() : 0.06;
    f->fixes = {8.0, 1.0, i, 0.0};
  }
}

void test_a_stopped_campaign_goes_on(void**) {
  static fs::path folder;
  folder = scratch.path("stopped/x").parent_path();
  static std::vector<std::uint64_t> ran;
  const auto stops_at = [](std::uint64_t seed) {
    return [seed](Trial& t) {
      if (t.setup.seed == seed) throw ToolError("stopped");
      ran.push_back(t.setup.seed);
      pretend(t);
    };
  };
  assert_refused(run_campaign(folder, 5, kFirstSeed, stops_at(kFirstSeed + 2)), "stopped");
  assert_int_equal(read_trials(folder / "trials.csv", kFirstSeed).size(), 2);
  static std::vector<Trial> all;
  all = run_campaign(folder, 5, kFirstSeed, stops_at(0));
  assert_int_equal(ran.size(), 5);
  for (std::size_t i = 0; i < 5; ++i) assert_int_equal(ran[i], kFirstSeed + i);
  assert_int_equal(all.size(), 5);
  // The same as one that was never stopped.
  static fs::path other;
  other = scratch.path("through/x").parent_path();
  static_cast<void>(run_campaign(other, 5, kFirstSeed, pretend));
  assert_string_equal(text_of(folder / "trials.csv").c_str(), text_of(other / "trials.csv").c_str());
  // Nothing left to do; fewer than there are.
  assert_int_equal(run_campaign(folder, 5, kFirstSeed, stops_at(0)).size(), 5);
  assert_int_equal(run_campaign(folder, 3, kFirstSeed, stops_at(0)).size(), 5);
  assert_int_equal(ran.size(), 5);
}

void test_the_table_is_read_as_it_was_written(void**) {
  static fs::path folder;
  folder = scratch.path("table/x").parent_path();
  static_cast<void>(run_campaign(folder, 4, kFirstSeed, pretend));
  const std::vector<Trial> trials = read_trials(folder / "trials.csv", kFirstSeed);
  assert_string_equal(to_csv(trials).c_str(), text_of(folder / "trials.csv").c_str());
  assert_near(trials[3].worse.vo_end_xy_m, 0.53, 1e-12);
  assert_near(trials[3].as_it_is.end_yaw_deg, -0.3, 1e-12);
  assert_near(trials[3].worse.fixes[2], 3.0, 0.0);
  assert_true(std::isnan(trials[1].worse.median_fix_error_m));
}

void refused_table(const std::string& text, const char* word) {
  static fs::path folder;
  folder = scratch.file("damaged/trials.csv", text).parent_path();
  assert_refused(run_campaign(folder, 9, kFirstSeed, pretend), "trials.csv");
  assert_refused(run_campaign(folder, 9, kFirstSeed, pretend), word);
  assert_string_equal(text_of(folder / "trials.csv").c_str(), text.c_str());  // left as it was
}

void test_damaged_tables_are_refused(void**) {
  static std::vector<Trial> trials(3);
  for (std::size_t i = 0; i < 3; ++i) {
    trials[i].setup = draw_setup(kFirstSeed + i);
    pretend(trials[i]);
  }
  static std::string good;
  good = to_csv(trials);
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.rfind(from), from.size(), to);
    return text;
  };
  refused_table("", "not a table of trials");
  refused_table("seed\n1\n", "not a table of trials");
  refused_table(with(",330,", ",3x0,"), ":4: is damaged");
  refused_table(with(",330,", ",nan,"), ":4: is damaged");
  refused_table(with(",330,", ",,"), ":4: is damaged");
  refused_table(with(",330,", ","), ":4: is damaged");
  refused_table(with(",330,", ",330,330,"), ":4: is damaged");
  refused_table(good.substr(0, good.size() - 1), ":4: is damaged");
  refused_table(good.substr(0, good.size() - 100), ":4: is damaged");
  refused_table(good + "\n", ":5: is not the trial of seed 1003");
  refused_table(with(",1002,", ",1007,"), ":4: is not the trial of seed 1002");
  refused_table(good + good.substr(good.find('\n') + 1), ":5: is not the trial of seed 1003");
  const fs::path folder = scratch.file("other/trials.csv", good).parent_path();
  assert_refused(run_campaign(folder, 9, 7, pretend), ":2: is not the trial of seed 7");
  assert_refused(run_campaign(scratch.file("a_file", "") / "below", 9, 7, pretend),
                 "cannot make this folder");
}

// ---- findings ---------------------------------------------------------------------------------------------

void test_findings_count_and_take_medians(void**) {
  static std::vector<Trial> trials(9);
  for (std::size_t i = 0; i < trials.size(); ++i) {
    trials[i].setup = draw_setup(kFirstSeed + i);
    pretend(trials[i]);
  }
  const Findings all = findings_of(trials);
  assert_int_equal(all.trials, 9);
  assert_near(all.worse.vo_end_xy_m.value, 0.54, 1e-12);
  assert_near(all.worse.vo_end_xy_m.interval.low, 0.51, 1e-12);
  assert_near(all.as_it_is.end_yaw_deg.value, 0.4, 1e-12);  // without sign
  assert_int_equal(all.as_it_is.median_fix_error_m.n, 8);
  assert_int_equal(all.as_it_is.fixes[0].hits, 72);
  assert_int_equal(all.as_it_is.fixes[2].hits, 36);
  assert_int_equal(all.as_it_is.fixes[3].of, 117);
  const std::vector<Findings> maps = findings_by_map(trials);
  assert_int_equal(maps.size(), 4);
  assert_near(maps[0].map_pixel_m, 0.005, 0.0);
  std::size_t of_maps = 0;
  for (const Findings& f : maps) of_maps += f.trials;
  assert_int_equal(of_maps, 9);
  const nlohmann::ordered_json json = findings_json(trials);
  assert_int_equal(json["all"]["worse"]["fixes"]["weak"]["count"].get<int>(), 9);
  assert_near(json["all"]["as_it_is"]["vo_end_xy_m"]["median"].get<double>(), 0.14, 1e-12);
}

int count(const std::string& text, const std::string& what) {
  int found = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
  return found;
}

void test_the_picture_stands_for_any_number_of_trials(void**) {
  for (const std::size_t n : {1, 4, 40}) {
    static std::vector<Trial> trials;
    trials.assign(n, {});
    for (std::size_t i = 0; i < n; ++i) trials[i].setup = draw_setup(kFirstSeed + i);  // errors of 0
    const std::string svg = plot_findings(trials);
    assert_int_equal(count(svg, "<polyline"), 2 * (4 + 2));  // each with its light edge: curves and key
    assert_int_equal(count(svg, " mm</text>"), std::min<std::size_t>(n, 4));
    assert_int_equal(count(svg, "nan") + count(svg, "inf"), 0);
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_drawn_scenes_are_valid),
      cmocka_unit_test(test_drawn_numbers_are_in_range_and_fill_it),
      cmocka_unit_test(test_sparse_fields),
      cmocka_unit_test(test_maps_and_kinds_come_equally_often),
      cmocka_unit_test(test_verdicts_at_each_border),
      cmocka_unit_test(test_fixes_of_a_replay_are_judged),
      cmocka_unit_test(test_wilson_against_published_values),
      cmocka_unit_test(test_median_and_its_ranks),
      cmocka_unit_test(test_a_stopped_campaign_goes_on),
      cmocka_unit_test(test_the_table_is_read_as_it_was_written),
      cmocka_unit_test(test_damaged_tables_are_refused),
      cmocka_unit_test(test_findings_count_and_take_medians),
      cmocka_unit_test(test_the_picture_stands_for_any_number_of_trials),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
