// Forecasts beside outcomes: scores by hand, what a trial's folder gives, and the parameters found again from
// drives that were drawn from them.
#include "campaign/reliability.hpp"

#include <cmath>
#include <cstring>

#include "base/output_file.hpp"
#include "campaign/reliability_plot.hpp"
#include "cmap/cmap_file.hpp"
#include "forecast/model_file.hpp"
#include "ground_tools/scratch.hpp"
#include "support/noise.hpp"
#include "support/sanitized.hpp"

using namespace cairn;
using namespace cairn::ground;
using cairn::test::Scratch;

namespace {

namespace fs = std::filesystem;

const Scratch scratch;

ForecastFix fix(std::uint64_t seed, double forecast, bool applied, bool right) {
  ForecastFix f;
  f.seed = seed;
  f.forecast.applied = forecast;
  f.forecast.right = 0.5 * forecast;
  f.applied = applied;
  f.verdict = right ? FixVerdict::kRight : applied ? FixVerdict::kWeak : FixVerdict::kDeclined;
  return f;
}

void test_scores_by_hand(void**) {
  static std::vector<ForecastFix> fixes;
  fixes = {fix(1, 0.9, true, true), fix(1, 0.95, true, false), fix(2, 0.2, false, false),
           fix(2, 0.25, true, true), fix(3, 1.0, true, true)};
  const Reliability r = reliability_of(fixes, FixEvent::kApplied);
  assert_int_equal(r.fixes, 5);
  assert_int_equal(r.observed.hits, 4);
  assert_near(r.forecast, (0.9 + 0.95 + 0.2 + 0.25 + 1.0) / 5.0, 1e-12);
  const double brier = (0.01 + 0.0025 + 0.04 + 0.5625 + 0.0) / 5.0;
  assert_near(r.brier, brier, 1e-12);
  assert_near(r.base_brier, 0.8 * 0.2, 1e-12);
  assert_near(r.skill, 1.0 - brier / 0.16, 1e-12);
  assert_int_equal(r.bins.size(), 2);  // 0.2 to 0.3; 0.9 to 1, both ends in
  assert_int_equal(r.bins[0].observed.of, 2);
  assert_int_equal(r.bins[0].observed.hits, 1);
  assert_near(r.bins[0].forecast, 0.225, 1e-12);
  assert_int_equal(r.bins[1].observed.of, 3);
  assert_near(r.bins[1].low, 0.9, 1e-12);
  const Reliability right = reliability_of(fixes, FixEvent::kRight);
  assert_int_equal(right.observed.hits, 3);
  assert_near(right.forecast, 0.5 * r.forecast, 1e-12);
}

void test_nothing_and_one_outcome_alone(void**) {
  const Reliability none = reliability_of({}, FixEvent::kApplied);
  assert_int_equal(none.fixes, 0);
  assert_true(std::isnan(none.skill));
  assert_int_equal(none.bins.size(), 0);
  const Reliability always =
      reliability_of({fix(1, 0.9, true, true), fix(2, 0.8, true, true)}, FixEvent::kApplied);
  assert_near(always.base_brier, 0.0, 0.0);
  assert_true(std::isnan(always.skill));
  static std::string svg;
  svg = plot_reliability({});
  assert_non_null(std::strstr(svg.c_str(), "no skill"));
  assert_null(std::strstr(svg.c_str(), "nan"));
}

/// Outcomes drawn from the forecasts: calibrated bins, and a skill whose interval holds that of the law.
void test_forecasts_that_keep_their_word(void**) {
  static std::vector<ForecastFix> fixes;
  Random random(11);
  for (int i = 0; i < 20000; ++i) {
    const double p = test::uniform(random, 0.0, 1.0);
    fixes.push_back(fix(static_cast<std::uint64_t>(i / 50), p, test::uniform(random, 0.0, 1.0) < p, false));
  }
  const Reliability r = reliability_of(fixes, FixEvent::kApplied);
  assert_int_equal(r.bins.size(), 10);
  for (const ReliabilityBin& b : r.bins) assert_near(b.observed.value(), b.forecast, 0.05);
  // E (p - o)^2 = E p (1 - p) = 1/6, the base rate's is 1/4.
  assert_near(r.brier, 1.0 / 6.0, 0.005);
  assert_near(r.skill, 1.0 / 3.0, 0.02);
  assert_true(r.skill_interval.low < r.skill && r.skill_interval.high > r.skill);
  assert_true(r.skill_interval.high - r.skill_interval.low > 0.01 &&
              r.skill_interval.high - r.skill_interval.low < 0.05);
}

// ---- a trial's folder -------------------------------------------------------------------------------------

constexpr double kTruthClutter = 0.5;
const Vec2 kShift_m(0.05, -0.03);

/// A scene without images, a map of random boulders, and what a rover would have seen that finds 7
/// of 10 large ones.
fs::path make_trial(int number) {
  const std::string folder = "trial" + std::to_string(number) + "/";
  const sim::Scene scene =
      sim::load_scene({}, {"site.size_m=30", "traverse.kind=straight", "traverse.length_m=20"});
  const fs::path file = scratch.file(folder + "scene.toml", sim::to_toml(scene));
  const std::vector<PathPoint> drive = sim::plan(scene);
  Random random(static_cast<std::uint64_t>(100 + number));
  std::vector<TableBoulder> boulders;
  for (int i = 0; i < 900; ++i) {
    TableBoulder b;
    b.p_map_m = Vec2(test::uniform(random, 0.0, 30.0), test::uniform(random, -30.0, 0.0));
    b.diameter_m = test::uniform(random, 0.05, 0.5);
    boulders.push_back(b);
  }
  const std::vector<std::uint8_t> map = encode_cmap(boulders, {0.0, -30.0, 30.0, 0.0}, 0.001, {});
  write_file(scratch.path(folder + "site.cmap"), {reinterpret_cast<const char*>(map.data()), map.size()});
  const ForecastModel model = mission_model();
  const Sweep sweep(model.rig, model.max_range_m, model.tracks);
  const DetectionCurve truth{0.7, 0.15, 5.0, 0.0};
  std::string seen = "vo,snapshot,x_m,y_m,diameter_m,sightings\n";
  std::string fixes =
      "vo,frame,status,verdict,before_m,after_m,sigma_xy_m,pairs,rms_m,local_boulders,map_boulders\n";
  for (const std::size_t last : fix_frames(drive.size())) {
    const auto see = [&](const Vec2& p) {
      seen += fmt::format("as_it_is,{},{:.4f},{:.4f},0.2,9\n", last, p.x(), p.y());
    };
    for (const TableBoulder& b : boulders) {
      if (sweep.in_footprint(drive, last, b.p_map_m) && test::uniform(random, 0.0, 1.0) < truth(b.diameter_m))
        see(b.p_map_m + kShift_m + 0.03 * Vec2(test::normal(random), test::normal(random)));
    }
    for (const Vec2& spot : sweep.spots(drive, last, 0.1)) {
      if (test::uniform(random, 0.0, 1.0) < kTruthClutter * 0.01) see(spot);
    }
    fixes += fmt::format("as_it_is,{},{},x,0.2,0.1,0,9,0,9,9\n", last + 5,
                         last % 60 == 24 ? "applied" : "too_few_pairs");
  }
  write_file(scratch.path(folder + "seen.csv"), seen);
  write_file(scratch.path(folder + "fixes.csv"), fixes);
  return file.parent_path();
}

void test_a_trial_is_read(void**) {
  static fs::path folder;
  folder = make_trial(0);
  static std::optional<TrialForecast> trial;
  trial = forecast_trial(mission_model(), folder, 7);
  assert_true(trial.has_value());
  assert_int_equal(trial->fixes.size(), 11);  // 20 m: 334 frames, begun at 24, 54, ... 324
  assert_int_equal(trial->fixes[1].forecast.frame, 54);
  assert_true(trial->fixes[0].applied && !trial->fixes[1].applied);
  assert_true(trial->fixes[0].verdict == FixVerdict::kRight);
  assert_int_equal(trial->fixes[3].seed, 7);
  const std::string rows = forecast_csv({*trial});
  assert_non_null(std::strstr(rows.c_str(), "\n7,as_it_is,54,"));
  // What a version before left out, and what is damaged.
  fs::remove(folder / "seen.csv");
  assert_int_equal(forecast_trial(mission_model(), folder, 7)->evidence.looks.size(), 0);
  fs::rename(folder / "fixes.csv", folder / "away.csv");
  assert_false(forecast_trial(mission_model(), folder, 7).has_value());
  fs::rename(folder / "away.csv", folder / "fixes.csv");
  write_file(folder / "seen.csv", "vo,snapshot,x_m,y_m,diameter_m,sightings\nas_it_is,24,1.0\n");
  assert_refused(forecast_trial(mission_model(), folder, 7), "seen.csv:2: 3 fields under 6");
  write_file(folder / "seen.csv", "vo,snapshot,x_m,y_m,diameter_m,sightings\nas_it_is,24,a,1,1,1\n");
  assert_refused(forecast_trial(mission_model(), folder, 7), "'a' in column 'x_m' is not a number");
  write_file(folder / "seen.csv", "vo,snapshot\nas_it_is,24\n");
  assert_refused(forecast_trial(mission_model(), folder, 7), "no column");
}

void test_parameters_are_found_again(void**) {
  static std::vector<TrialForecast> trials;
  const int drives = test::kSanitized ? 1 : 4;
  for (int i = 1; i <= drives; ++i) trials.push_back(*forecast_trial(mission_model(), make_trial(i), 1));
  static ForecastModel fit;
  fit = fitted(mission_model(), trials);
  if (test::kSanitized) return;
  assert_near(fit.detection.most, 0.7, 0.05);
  assert_near(fit.detection.half_m, 0.15, 0.015);
  assert_near(fit.clutter_per_m2, kTruthClutter, 0.12);
  assert_near(fit.sigma_pair_m, 0.03, 0.012);
  assert_near(fit.sigma_common_m, std::sqrt(0.5 * kShift_m.squaredNorm()), 0.008);
  assert_at_most(fit.detection.spread, 0.3);
  assert_near(fitted(mission_model(), {}).detection.most, mission_model().detection.most, 0.0);
}

// ---- the model as a file ----------------------------------------------------------------------------------

void test_model_files(void**) {
  static ForecastModel written, read;
  written = mission_model();
  written.detection = {0.66, 0.21, 7.5, 0.4};
  written.clutter_per_m2 = 0.9;
  written.sigma_common_m = 0.011;
  read = mission_model();
  read_model(scratch.file("model.json", model_json(written).dump(2)), read);
  assert_string_equal(model_json(read).dump().c_str(), model_json(written).dump().c_str());
  read_model(scratch.file("part.json", "{\"clutter_per_m2\": 2}"), read);
  assert_near(read.clutter_per_m2, 2.0, 0.0);
  assert_near(read.detection.power, 7.5, 0.0);
  const auto refused = [](const char* text, const char* word) {
    static ForecastModel any;
    static fs::path file;
    any = mission_model();
    file = scratch.file("bad.json", text);
    assert_refused((read_model(file, any), 0), word);
  };
  refused("", "is not a model");
  refused("[1]", "is not a model");
  refused("{\"cluter_per_m2\": 2}", "unknown key 'cluter_per_m2'");
  refused("{\"detection\": {\"hlaf_m\": 2}}", "unknown key 'hlaf_m'");
  refused("{\"clutter_per_m2\": \"2\"}", "must be a number");
  refused("{\"clutter_per_m2\": -1}", "out of range");
  refused("{\"detection\": {\"most\": 1.5}}", "most: 1.5 is out of range");
  refused("{\"detection\": 3}", "unknown key 'detection'");
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_scores_by_hand),
      cmocka_unit_test(test_nothing_and_one_outcome_alone),
      cmocka_unit_test(test_forecasts_that_keep_their_word),
      cmocka_unit_test(test_a_trial_is_read),
      cmocka_unit_test(test_parameters_are_found_again),
      cmocka_unit_test(test_model_files),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
