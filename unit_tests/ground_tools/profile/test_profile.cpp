// cairn profile: what the plugin wrote is read whole or refused, jobs are added up over their slices, and a
// broken budget fails the command.
#include "profile/profile.hpp"

#include <string>
#include <vector>

#include "ground_tools/browser.hpp"
#include "ground_tools/program.hpp"
#include "profile/budget.hpp"
#include "profile/diff.hpp"
#include "profile/page.hpp"
#include "profile/tables.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

const test::Scratch scratch;

// Two frames. VO: 10 + 20 + 30, then 5 + 50 cycles (in millions); a fix begun in the first ends
// in the second.
const std::string kHead =
    "cairn-profile\t1\nprocessor\tTest "
    "board\nclock_mhz\t100.0\ntotal\t400000000\t500000000\nclasses\tinteger\tload\n";
const std::string kFunctions =
    "function\t1\tmain\t1\t400000000\t500000000\t400000000\t500000000\t1\t2\t3\t10\t20\n"
    "function\t2\t_ZN5cairn9Localizer11begin_frameEv\t2\t1\t15000000\t1\t10000000\t0\t0\t0\t5\t5\n"
    "function\t3\t_ZN5cairn9Localizer7step_voEv\t3\t100\t100000000\t90\t50000000\t0\t7\t9\t6\t6\n"
    "function\t4\t_ZN5cairn9Localizer9begin_fixEv\t1\t1\t1000000\t1\t1000000\t0\t0\t0\t1\t1\n"
    "function\t5\t_ZN5cairn9Localizer8step_fixEv\t2\t1\t4000000\t1\t3000000\t0\t0\t0\t1\t1\n"
    "function\t6\t_ZN5cairn9Localizer7step_voEv.part.0\t2\t1\t1\t1\t1\t0\t0\t0\t1\t1\n";
const std::string kNodes =
    "node\t0\t0\t0\t0\t0\t0\t0\t0\t0\n"
    "node\t1\t0\t1\t1\t100\t380000000\t0\t10\t20\n"
    "node\t2\t1\t2\t2\t1\t15000000\t1\t1\t5000000\n"
    "node\t3\t1\t3\t3\t90\t100000000\t1\t40\t50000000\n"
    "node\t4\t1\t4\t1\t1\t1000000\t0\t0\t0\n"
    "node\t5\t1\t5\t2\t1\t4000000\t1\t1\t3000000\n";
const std::string kSpans =
    "frame\t1000\t200\t110000000\nframe\t2000\t200\t60000000\n"
    "call\t2\t1000\t1\t10000000\ncall\t3\t1100\t20\t20000000\ncall\t3\t1200\t30\t30000000\n"
    "call\t4\t1300\t1\t1000000\ncall\t5\t1400\t1\t1000000\n"
    "call\t2\t2000\t1\t5000000\ncall\t3\t2100\t40\t50000000\ncall\t5\t2200\t1\t3000000\n";
const std::string kWhole = kHead + kFunctions + kNodes + kSpans + "detail\t1\nend\n";

std::string budget(const std::string& vo_s, const std::string& fix_s) {
  return "frame = \"cairn::Localizer::begin_frame\"\n"
         "[[job]]\nname = \"visual odometry\"\nbegins = \"cairn::Localizer::begin_frame\"\n"
         "calls = [\"cairn::Localizer::begin_frame\", \"cairn::Localizer::step_vo\"]\nbudget_s = { board = " +
         vo_s +
         " }\n[[job]]\nname = \"registration\"\nbegins = \"cairn::Localizer::begin_fix\"\n"
         "calls = [\"cairn::Localizer::begin_fix\", \"cairn::Localizer::step_fix\"]\nbudget_s = { board = " +
         fix_s + " }\n";
}

Profile profile;
std::vector<JobReport> jobs;

int setup(void**) {
  profile = read_profile(scratch.file("run.tsv", kWhole));
  jobs = report_jobs(profile, read_budgets(scratch.file("budget.toml", budget("0.6", "0.1")), "board"));
  return 0;
}

void test_reads_what_was_written(void**) {
  assert_string_equal(profile.processor.c_str(), "Test board");
  assert_int_equal(profile.frames.size(), 2);
  assert_int_equal(profile.detail_frame, 1);
  assert_int_equal(profile.nodes.size(), 6);
  const ProfileFunction& vo = profile.functions[profile.nodes[3].function];
  assert_string_equal(vo.name.c_str(), "Localizer::step_vo");
  assert_int_equal(vo.self.cycles, 100000000);
  assert_int_equal(vo.detail_self.cycles, 50000000);
  assert_int_equal(vo.data_misses, 7);
  assert_int_equal(vo.counts[1], 6);
}

void test_jobs_over_their_slices(void**) {
  assert_int_equal(jobs.size(), 2);
  assert_int_equal(jobs[0].rounds.size(), 2);
  assert_int_equal(jobs[0].rounds[0].cost.cycles, 60000000);
  assert_int_equal(jobs[0].rounds[0].cost.instructions, 51);
  assert_int_equal(jobs[0].rounds[1].cost.cycles, 55000000);
  assert_int_equal(jobs[0].longest().frame, 0);
  assert_int_equal(jobs[0].mean().cycles, 57500000);
  assert_near(jobs[0].longest_s(100.0), 0.6, 1e-12);
  assert_int_equal(jobs[1].rounds.size(), 1);  // over two frames
  assert_int_equal(jobs[1].rounds[0].cost.cycles, 5000000);
  assert_int_equal(jobs[1].rounds[0].frame, 0);
}

void test_budget_at_its_bound(void**) {
  assert_false(jobs[0].broken(100.0));  // 0.6 s of 0.6 s
  assert_true(jobs[0].broken(99.9));
  assert_string_equal(broken_budgets(jobs, 100.0).c_str(), "");
  static std::string line;
  line = broken_budgets(jobs, 50.0);
  assert_string_equal(line.c_str(), "budget exceeded: visual odometry takes 1.200 s of 0.600 s in frame 0");
  line = broken_budgets(jobs, 25.0);
  assert_true(line.find("registration takes 0.200 s of 0.100 s") != std::string::npos);
}

std::vector<JobReport> with_ops(const std::string& cycles_per_op) {
  const std::string table =
      "[[job]]\nname = \"visual odometry\"\ntask = \"vo\"\nbegins = \"cairn::Localizer::begin_frame\"\n"
      "calls = [\"cairn::Localizer::begin_frame\", \"cairn::Localizer::step_vo\"]\n"
      "budget_s = { board = 1.0 }\ncycles_per_op = { board = " +
      cycles_per_op + " }\n";
  const std::string console =
      "boot\nops of frame 0: vo 20000000, boulders 1, fix 0\nops of frame 1: vo 11000000, boulders 1, fix 0\n";
  return report_jobs(profile, read_budgets(scratch.file("ops.toml", table), "board"),
                     read_frame_ops(scratch.file("run.log", console)));
}

void test_cycles_of_an_operation(void**) {
  static std::vector<JobReport> told;
  told = with_ops("5.0");  // VO weighs 1: 60e6 cycles of 20e6 operations, 55e6 of 11e6
  assert_int_equal(told[0].rounds[0].ops, 20000000);
  assert_near(told[0].cycles_per_op(), 5.0, 1e-12);
  assert_false(told[0].broken(100.0));
  told = with_ops("4.9");
  assert_true(told[0].broken(100.0));
  static std::string line;
  line = broken_budgets(told, 100.0);
  assert_true(line.find("visual odometry takes 5.00 cycles a weighted operation, 4.90 in the table") !=
              std::string::npos);
}

void test_job_that_never_ran(void**) {
  static std::vector<JobReport> none;
  none = jobs;
  none[1].rounds.clear();
  assert_true(none[1].broken(1.0e6));
  assert_true(broken_budgets(none, 1.0e6).find("registration never ran") != std::string::npos);
  assert_true(profile_text(profile, none, 100.0, 10).find("never ran") != std::string::npos);
}

void test_tables(void**) {
  static std::string text;
  text = profile_text(profile, jobs, 100.0, 3);
  assert_true(text.find("Localizer::step_vo") != std::string::npos);
  assert_true(text.find("Localizer::begin_fix") == std::string::npos);  // the first three alone
  text = rounds_csv(jobs, 100.0);
  assert_string_equal(text.c_str(),
                      "job,frame,instructions,cycles,seconds\n\"visual odometry\",0,51,60000000,0.600000\n"
                      "\"visual odometry\",1,41,55000000,0.550000\n\"registration\",0,3,5000000,0.050000\n");
  text = functions_csv(profile);
  assert_true(text.find(",integer,load\n\"main\",1,100,380000000,") != std::string::npos);
  text = jobs_csv(jobs, 50.0);
  assert_true(text.find("\"visual odometry\",2,46,51,57500000,60000000,0,50,1.200000,0.6,1") !=
              std::string::npos);
}

void test_page_needs_nothing_else(void**) {
  static std::string page;
  static Profile hostile;
  hostile = profile;
  hostile.functions[0].name = "</script><b>";
  page = profile_page(hostile, jobs, "board", 100.0);
  assert_true(page.find("</script><b>") == std::string::npos);
  assert_true(page.find("default-src 'none'") != std::string::npos);
  assert_true(page.find("http://") == std::string::npos && page.find("https://") == std::string::npos);
  assert_true(page.find("Localizer::step_vo") != std::string::npos);
}

const char* const kProbe = R"js((() => {
  const all = (what) => [...document.querySelectorAll(what)];
  const out = {
    jobs: all('#jobs tbody tr').length, functions: all('#functions tbody tr').length, bars: all('#flame button').length,
    legend: all('#legend .swatch').map((e) => getComputedStyle(e).backgroundColor),
    sideways: document.documentElement.scrollWidth - innerWidth};
  for (const e of all('button')) e.click();
  for (const e of all('input')) {
    e.value = 'step';
    e.dispatchEvent(new Event('input'));
  }
  out.found = all('#functions tbody tr').length;
  out.fault = document.getElementById('fault').hidden ? '' : document.getElementById('fault').textContent;
  return out;
})())js";

nlohmann::json told;

void test_in_a_browser(void**) {
  if (test::browser().empty()) {
    print_message("skipped: no browser is installed\n");
    skip();
  }
  for (const bool dark : {false, true}) {
    told =
        test::ask_page(scratch, profile_page(profile, jobs, "board", 100.0), kProbe, dark ? 500 : 1280, dark);
    print_message("%s\n", told.dump().c_str());
    assert_true(told.at("fault") == "");
    assert_true(told.at("jobs") == 2 && told.at("functions") == 5 && told.at("found") == 2);
    assert_true(told.at("bars") >= 5 && told.at("sideways") <= 0);
    // The colours of VO's path and of fixes, as the report has them.
    assert_true(told.at("legend").at(0) == "rgb(213, 94, 0)" &&
                told.at("legend").at(1) == "rgb(204, 121, 167)");
  }
}

void refuse(const std::string& text, const char* word) {
  const auto path = scratch.file("bad.tsv", text);
  assert_refused(read_profile(path), word);
}

void test_refuses_bad_profiles(void**) {
  assert_refused(read_profile(scratch.path("none.tsv")), "none.tsv");
  refuse("", "cut off");
  refuse("function\t1\n", "is not a profile");
  refuse("cairn-profile\t2\n", "is not a profile");
  refuse(kHead + kFunctions + kNodes + kSpans, "cut off");
  refuse(kHead + kFunctions + "node\t0\t0\t0\t0\tx\t0\t0\t0\t0\n", "'x' is not a number");
  refuse(kHead + kFunctions + "node\t0\t0\t0\t0\n", "too short");
  refuse(kHead + kFunctions + "node\t1\t0\t0\t0\t0\t0\t0\t0\t0\n", "out of order");
  refuse(kHead + kFunctions + kNodes + "node\t6\t9\t1\t1\t1\t1\t0\t0\t0\n", "comes before");
  refuse(kHead + kFunctions + kNodes + "call\t77\t1\t1\t1\n", "refers to a function");
  refuse(kHead + "function\t1\tmain\t1\t1\t1\t1\t1\t0\t0\t0\t5\n", "one count per class");
  refuse(kHead + "end\n", "contains no run");
}

void test_refuses_bad_budgets(void**) {
  const auto refuse_budget = [](const std::string& text, const char* word) {
    const auto path = scratch.file("bad.toml", text);
    assert_refused(read_budgets(path, "board"), word);
  };
  refuse_budget("frame = ", "bad.toml:1:");
  refuse_budget("frame = \"x\"\n", "no [[job]]");
  refuse_budget("[[job]]\nbegins = \"x\"\n", "without a name");
  refuse_budget("[[job]]\nname = \"x\"\n", "needs 'begins'");
  refuse_budget("[[job]]\nname = \"x\"\nbegins = \"f\"\ncalls = [\"f\", 3]\n", "needs 'begins'");
  refuse_budget(budget("0.0", "1.0"), "no budget for board");
  assert_refused(read_budgets(scratch.file("good.toml", budget("1.0", "1.0")), "moon"), "budget_s.moon");
}

void test_command(void**) {
  scratch.file("good.toml", budget("1.0", "1.0"));
  static std::string given;
  given = "profile '" + scratch.path("run.tsv").string() + "' --target board --budget '" +
          scratch.path("good.toml").string() + "'";
  static test::Ended good;
  good = test::run_cairn(scratch, given + " -o '" + scratch.path("out").string() + "'");
  assert_int_equal(good.code, 0);
  for (const char* name : {"jobs.csv", "rounds.csv", "functions.csv", "profile.html"})
    assert_true(std::filesystem::exists(scratch.path("out") / name));
  test::check_refusal(scratch, given + " --clock 50", "budget exceeded: visual odometry",
                      "1.200 s of 1.000 s");
  test::check_refusal(scratch, "profile nothing.tsv --target board --budget x.toml", "nothing.tsv", "");
}

// Two runs of a board: of the second VO's first round is twice as long, a function is new, another gone.
void test_side_by_side(void**) {
  const auto folder = [](const char* name, const char* jobs_rows, const char* functions_rows) {
    std::filesystem::create_directories(scratch.path(name));
    scratch.file(std::string(name) + "/jobs.csv",
                 "job,mean_cycles,longest_cycles,clock_mhz\n" + std::string(jobs_rows));
    scratch.file(std::string(name) + "/functions.csv",
                 "function,calls,self_cycles\n" + std::string(functions_rows));
    return scratch.path(name);
  };
  const auto a = folder("a", "\"VO\",100000000,200000000,100\n",
                        "\"f<..>\",2,6000000\n\"f<..>\",1,1000000\n\"old\",1,2000000\n\"same\",1,5\n");
  const auto b = folder("b", "\"VO\",100000000,400000000,100\n",
                        "\"f<..>\",9,10000000\n\"new\",1,500000\n\"same\",1,5\n");
  static std::string text;
  text = profile_diff_text({a, b}, 10);
  assert_true(text.find("4.0000   2.000      1.0000   1.000") != std::string::npos);
  const std::size_t f = text.find("f<..>"), old = text.find("old"), made = text.find("new");
  assert_true(f < old && old < made && made != std::string::npos);  // by what changed: 3, -2, 0.5 million
  assert_true(text.find("+3.00") != std::string::npos && text.find("-2.00") != std::string::npos);
  assert_true(text.find("same") == std::string::npos);
  text = profile_diff_text({a, a}, 10);
  assert_true(text.find("No function's calls or cycles changed") != std::string::npos);
  text = profile_diff_text({a, b, a}, 10);
  assert_true(text.find("Functions") == std::string::npos);
  const auto other = folder("other", "\"walk\",1,1,100\n", "\"f\",1,1\n");
  assert_refused(profile_diff_text({a, other}, 10), "no job 'VO'");
  test::check_refusal(scratch, "profile-diff '" + b.string() + "' nowhere", "nowhere", "jobs.csv");
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_reads_what_was_written),
      cmocka_unit_test(test_jobs_over_their_slices),
      cmocka_unit_test(test_budget_at_its_bound),
      cmocka_unit_test(test_cycles_of_an_operation),
      cmocka_unit_test(test_job_that_never_ran),
      cmocka_unit_test(test_tables),
      cmocka_unit_test(test_page_needs_nothing_else),
      cmocka_unit_test(test_in_a_browser),
      cmocka_unit_test(test_refuses_bad_profiles),
      cmocka_unit_test(test_refuses_bad_budgets),
      cmocka_unit_test(test_command),
      cmocka_unit_test(test_side_by_side),
  };
  return cmocka_run_group_tests(tests, setup, nullptr);
}
