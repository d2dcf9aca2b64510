// Fixes expected and observed: the probability of so few against every outcome, and what is said of a drive
// over the right map and over a wrong one.
#include "report/expectation.hpp"

#include <cmath>

#include "ground_tools/scratch.hpp"
#include "localizer/localizer.hpp"
#include "replay/status_names.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;
using nlohmann::ordered_json;

namespace {

const test::Scratch scratch;

/// A station every 2 m, each with its probability, and a fix tried at each, the first `applied` of them used.
std::vector<ExpectedFix> stations(const std::vector<double>& probabilities) {
  std::vector<ExpectedFix> forecast;
  for (const double p : probabilities) forecast.push_back({2.0 * forecast.size() + 1.0, p});
  return forecast;
}
std::vector<TriedFix> tries(std::size_t count, std::size_t applied, double late_m = 0.0) {
  std::vector<TriedFix> tried;
  for (std::size_t i = 0; i < count; ++i) tried.push_back({2.0 * i + 1.0 + late_m, i < applied});
  return tried;
}

void test_against_every_outcome(void**) {
  static std::vector<double> p;
  p = {0.9, 0.8, 0.99, 0.5, 1.0, 0.0, 0.7};
  for (std::size_t observed = 0; observed <= p.size(); ++observed) {
    double so_few = 0.0;
    for (unsigned outcome = 0; outcome < (1U << p.size()); ++outcome) {
      double probability = 1.0;
      std::size_t events = 0;
      for (std::size_t i = 0; i < p.size(); ++i) {
        const bool happens = ((outcome >> i) & 1U) != 0;
        probability *= happens ? p[i] : 1.0 - p[i];
        events += happens ? 1 : 0;
      }
      if (events <= observed) so_few += probability;
    }
    const Expectation e = expectation_of(stations(p), tries(p.size(), observed));
    assert_near(e.so_few, so_few, 1e-14);
    assert_near(e.expected, 4.89, 1e-12);
    assert_int_equal(e.observed, observed);
    assert_int_equal(e.tried, p.size());
  }
}

void test_the_limit(void**) {
  const std::vector<ExpectedFix> three = stations({0.9, 0.9, 0.89});
  assert_true(!expectation_of(three, tries(3, 0)).likely_wrong());  // 0.0011
  const std::vector<ExpectedFix> surer = stations({0.9, 0.9, 0.91});
  assert_true(expectation_of(surer, tries(3, 0)).likely_wrong());
  assert_false(expectation_of(surer, tries(3, 1)).likely_wrong());
}

/// Each fix is held against the station nearest to it; stations that the drive did not reach do not count.
void test_which_station(void**) {
  static std::vector<double> p;
  p = {0.1, 0.9, 0.2, 0.8};
  assert_near(expectation_of(stations(p), tries(2, 2, 0.9)).expected, 1.0, 1e-12);
  assert_near(expectation_of(stations(p), tries(2, 2, 1.1)).expected, 1.1, 1e-12);
  const Expectation e = expectation_of(stations(p), tries(6, 6));
  assert_int_equal(e.beyond, 0 + 1);  // at 9 m the last station is one gap away, at 11 m it is not
  assert_int_equal(e.tried, 5);
  assert_int_equal(expectation_of(stations({0.5}), {{50.0, true}}).tried, 0);
}

void test_words(void**) {
  const auto says = [](const Expectation& e, const char* what) {
    if (words_of(e).find(what) == std::string::npos) fail_msg("'%s' without '%s'", words_of(e).c_str(), what);
  };
  const std::vector<ExpectedFix> ten = stations(std::vector<double>(10, 0.9));
  says(expectation_of(ten, tries(10, 9)), "expected 9.0 to be used, and 9 were");
  says(expectation_of(ten, tries(10, 9)), "nothing here speaks against map or start");
  says(expectation_of(ten, tries(10, 6)), "worth a look");
  says(expectation_of(ten, tries(10, 1)), "and 1 was. ");
  says(expectation_of(ten, tries(10, 1)), "the map or the start is likely wrong");
  says(expectation_of(ten, {}), "nothing can be told");
}

ordered_json run_of(std::size_t fixes, std::size_t applied) {
  ordered_json run = {{"summary", {{"frames", 30 * fixes}}}, {"paths", {{"vo", ordered_json::array()}}}};
  for (std::size_t i = 0; i < 30 * fixes; ++i) {
    run["paths"]["vo"].push_back(3.0);
    run["paths"]["vo"].push_back(-2.0 * static_cast<double>(i) / 30.0);
  }
  run["fixes"] = {{"snapshot", ordered_json::array()}, {"status", ordered_json::array()}};
  for (std::size_t i = 0; i < fixes; ++i) {
    run["fixes"]["snapshot"].push_back(30 * i + 16);  // 1 m after the fix before
    run["fixes"]["status"].push_back(i < applied ? "applied" : "too_little_evidence");
  }
  return run;
}

/// What stands in summary.json, for good and wrong maps. 20 fixes at 0.9: 18 expected.
void test_of_a_run(void**) {
  static ordered_json run;
  const std::vector<ExpectedFix> forecast = stations(std::vector<double>(20, 0.9));
  for (const std::size_t applied : {0, 3, 11, 16, 20}) {
    run = run_of(20, applied);
    set_against("drive/forecast.csv", forecast, run);
    const ordered_json& f = run.at("summary").at("forecast");
    assert_true(f.at("file") == "drive/forecast.csv");
    assert_true(f.at("tried") == 20 && f.at("observed") == applied && f.at("beyond") == 0);
    assert_near(f.at("expected").get<double>(), 18.0, 1e-9);
    assert_true(f.at("likely_wrong") == (applied <= 11));
    assert_true((f.at("probability_of_so_few") < 1e-3) == (applied <= 11));
    const auto words = f.at("words").get<std::string>();
    assert_true((words.find("likely wrong") != std::string::npos) == (applied <= 11));
  }
}

/// A search that goes on is one try, whether it ends or not.
void test_a_search_that_goes_on(void**) {
  static ordered_json run;
  const std::vector<ExpectedFix> forecast = stations(std::vector<double>(6, 0.9));
  run = run_of(6, 6);
  const std::string unfinished = fix_status_name(static_cast<std::uint8_t>(FixStatus::kRunning));
  assert_string_equal(unfinished.c_str(), "unfinished");  // neither refused nor declined
  run["fixes"]["status"] = {unfinished, unfinished, unfinished, "applied", "applied", "applied"};
  set_against("f.csv", forecast, run);
  assert_true(run.at("summary").at("forecast").at("tried") == 3);
  assert_true(run.at("summary").at("forecast").at("observed") == 3);
  run["fixes"]["status"] = {"ambiguous", "ambiguous", unfinished, unfinished, unfinished, unfinished};
  set_against("f.csv", forecast, run);
  assert_true(run.at("summary").at("forecast").at("tried") == 3);
  assert_true(run.at("summary").at("forecast").at("observed") == 0);
}

void test_files(void**) {
  const auto with = [](const std::string& text) { return scratch.file("f.csv", text); };
  static std::vector<ExpectedFix> read;
  read = read_forecast(with("arc_m,x_m,p_applied\n1.5,2,0.25\n1.5,4,1\n"));
  assert_int_equal(read.size(), 2);
  assert_near(read[0].distance_m, 1.5, 0.0);
  assert_near(read[0].applied, 0.25, 0.0);
  assert_refused(read_forecast(scratch.path("none.csv")), "none.csv");
  assert_refused(read_forecast(with("arc_m,x_m\n1,2\n")), "p_applied");
  assert_refused(read_forecast(with("arc_m,p_applied\n")), "forecasts no fix");
  assert_refused(read_forecast(with("arc_m,p_applied\n1,1.5\n")), "f.csv:2: is no probability");
  assert_refused(read_forecast(with("arc_m,p_applied\n2,0.5\n1,0.5\n")), "f.csv:3");
  assert_refused(read_forecast(with("arc_m,p_applied\n2,often\n")), "often");
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_against_every_outcome),
      cmocka_unit_test(test_the_limit),
      cmocka_unit_test(test_which_station),
      cmocka_unit_test(test_words),
      cmocka_unit_test(test_of_a_run),
      cmocka_unit_test(test_a_search_that_goes_on),
      cmocka_unit_test(test_files),
  };
  return cmocka_run_group_tests_name("ground_tools/report/expectation", tests, nullptr, nullptr);
}
