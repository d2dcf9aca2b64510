// Tables of numbers, way-points and medians: what is read, and each refusal.
#include "base/number_table.hpp"

#include <cmath>

#include "base/statistics.hpp"
#include "base/waypoints.hpp"
#include "ground_tools/scratch.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

const test::Scratch scratch;

void test_numbers(void**) {
  assert_true(to_number<int>("-12") == -12 && to_number<double>("+2.5") == 2.5);
  for (const char* text : {"", "+", "+-1", "1 ", " 1", "1x", "99999999999"})
    assert_false(to_number<int>(text).has_value());
  assert_true(std::isinf(*to_number<double>("inf")));
  for (const char* text : {"inf", "nan", "1e999", "1,5"}) assert_false(to_finite(text).has_value());
}

void test_split(void**) {
  assert_true(split("a,,b", ',') == (std::vector<std::string_view>{"a", "", "b"}));
  assert_true(split("", ',') == std::vector<std::string_view>{""});
  assert_true(split(",", ',') == (std::vector<std::string_view>{"", ""}));
}

void test_csv_table(void**) {
  const CsvTable table(
      scratch.file("good.csv", "name, x ,\"y\"\r\n\n# a remark\nfirst stone,1,\"2\"\n3 nan 4\n,5,6"));
  assert_int_equal(table.size(), 3);
  assert_true(table.cut_off());
  assert_int_equal(table.line(0), 4);
  assert_true(table.word(0, table.column("name")) == "first stone");
  assert_true(table.word(2, 0).empty());
  assert_near(table.number(0, table.column({"y_m", "y"})), 2.0, 0.0);
  assert_near(table.number(2, table.column("x")), 5.0, 0.0);
  assert_true(std::isnan(table.any_number(1, 1)));
  assert_refused(table.number(1, 1), "good.csv:5: 'nan' in column 'x' is not a number; correct");
  assert_refused(table.any_number(0, 0), "good.csv:4: 'first stone' in column 'name'");
  assert_false(table.find({"z"}).has_value());
  assert_refused(table.column("z"), "no column 'z' in its first line (it has name, x, y); name it");
}

void test_csv_of_spreadsheets(void**) {
  const CsvTable german(
      scratch.file("german.csv", "\xEF\xBB\xBFX;y;\"name\"\r\n1,25;-2,5;\"a;b\"\r\n-3;4.5;c\r\n"));
  assert_int_equal(german.size(), 2);
  assert_near(german.number(0, german.column("x")), 1.25, 0.0);
  assert_near(german.number(0, german.column("Y")), -2.5, 0.0);
  assert_true(german.word(0, german.column("name")) == "a;b");
  assert_near(german.number(1, german.column("y")), 4.5, 0.0);
  const CsvTable quoted(scratch.file("quoted.csv", "x,y\n\"1,5\",\"2\"\n"));
  assert_near(quoted.number(0, 0), 1.5, 0.0);
  assert_refused(CsvTable(scratch.file("wide.csv", std::string("\xFF\xFEx\0", 4))), "UTF-8");
  assert_refused(read_number_rows(scratch.file("wide.txt", std::string("\xFE\xFF\0\x31", 4))), "UTF-8");
}

/// What else spreadsheets write: each of these is the row 1.5, 2.5, 0.5.
void test_csv_of_other_spreadsheets(void**) {
  for (const char* text :
       {"sep=;\r\nx;y;d\r\n1,5;2,5;0,5\r\n", "\"sep=,\"\nx,y,d\n1.5,2.5,0.5\n", "x;y;d\n1,5;2,5;0,5\n;;\n",
        "x,y,d\n\"\",\"\",\"\"\n1.5,2.5,0.5\n", "x\ty\td\n1,5\t2,5\t0,5\n", "x\ty\td\n1.5\t\t2.5\t0.5\n",
        "x;y;d;\"a, b, c, d\"\n1,5;2,5;0,5;z\n", "x,y,d,note\n1.5,2.5,0.5,\"a\nb, \"\"c\"\"\n\nd\"\n"}) {
    const CsvTable table(scratch.file("sheet.csv", text));
    assert_int_equal(table.size(), 1);
    for (std::size_t i = 0; i < 3; ++i)
      assert_near(table.number(0, i), i == 0 ? 1.5 : i == 1 ? 2.5 : 0.5, 0.0);
  }
  // Lines count on behind a line end in quotes; a quote within a word begins nothing.
  const CsvTable lines(scratch.file("lines.csv", "x,note\n1,\"a\nb\"\n2,5\" wide\n3,c\n"));
  assert_int_equal(lines.size(), 3);
  assert_int_equal(lines.line(1), 4);
  assert_true(lines.word(0, 1) == "a\nb");
}

/// A mark between thousands is never the decimal mark in silence.
void test_thousands(void**) {
  for (const char* text :
       {"x,y\n\"500,123\",0.5\n", "x,y\n\"500,123\",7\n", "x;y\n1.234;0,5\n", "x;y\n1,234;0.5\n"})
    assert_refused(CsvTable(scratch.file("thousands.csv", text)).number(0, 0), "thousands.csv:2: ");
  for (const char* text :
       {"x;y\n500,123;7\n", "x;y\n500,123;0,5\n", "x,y\n500.123,7\n", "x,y\n\"500,123\",\"0,5\"\n"})
    assert_near(CsvTable(scratch.file("fraction.csv", text)).number(0, 0), 500.123, 0.0);
  assert_near(CsvTable(scratch.file("fraction.csv", "x;y\n-0,123;0.5\n")).number(0, 0), -0.123, 0.0);
  assert_near(*to_table_number(" 1,35 "), 1.35, 0.0);
  assert_false(to_table_number("1.234,5").has_value());
}

void test_csv_refusals(void**) {
  assert_refused(CsvTable(scratch.path("absent.csv")), "absent.csv");
  assert_refused(CsvTable(scratch.file("bad.csv", "\n# nothing\n")), "bad.csv: is empty");
  assert_refused(CsvTable(scratch.file("bad.csv", "x,y\n1,2\n1,2,3\n")), "bad.csv:3: 3 fields under 2");
  assert_refused(CsvTable(scratch.file("bad.csv", "x,y\n1\n"), "run again"), "column names; run again");
}

void test_waypoints(void**) {
  static std::vector<Vec2> read;
  read = read_waypoints(scratch.file("path.csv", "name,y,x\n# a remark\na,-480,1010\nb,-470,1050\n"));
  assert_int_equal(read.size(), 2);
  assert_near((read[1] - Vec2(1050, -470)).norm(), 0.0, 0.0);
  assert_int_equal(read_waypoints(scratch.file("path.csv", "x_m,y_m\n1,2\n3,4\n")).size(), 2);
}

void test_waypoint_refusals(void**) {
  const MapExtent extent{0.0, 0.0, 30.0, 20.0};
  const auto refused = [](const char* text, const char* word) {
    static std::filesystem::path file;
    file = scratch.file("bad.csv", text);
    assert_refused(read_waypoints(file), word);
    assert_refused(read_waypoints(file), "bad.csv");
  };
  refused("", "empty");
  refused("x,y\n", "has 0 way-points");
  refused("x,y\n1,1\n", "has 1 way-point;");
  refused("1,1\n2,2\n", "no column 'x_m' or 'x'");
  refused("x,z\n1,1\n2,2\n", "no column 'y_m' or 'y'");
  refused("x,y\n1,1\n2,north\n", ":3: 'north' in column 'y' is not a number");
  refused("x,y\n1,1\n2,nan\n", ":3:");
  refused("x,y\n1,1\n2\n", ":3:");
  refused("x,y\n1,1\n1,1\n", "way-points 1 and 2 are the same");
  refused("x,y\n15.00006,45.1505\n15.0003,45.1506\n", "are they degrees?");
  assert_refused(read_waypoints(scratch.path("not_there.csv")), "not_there.csv");
  assert_refused((check_waypoints({Vec2(1.0, 1.0), Vec2(31.0, 2.0)}, extent, "site.cmap"), 0),
                 "way-point 2 at (31.000, 2.000) lies outside site.cmap");
}

void test_median(void**) {
  assert_near(median({3.0, 1.0, 2.0}), 2.0, 0.0);
  assert_near(median({4.0, 1.0, 3.0, 2.0}), 2.5, 0.0);
  assert_near(median({7.0}), 7.0, 0.0);
  assert_true(std::isnan(median({})));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_numbers),
      cmocka_unit_test(test_split),
      cmocka_unit_test(test_csv_table),
      cmocka_unit_test(test_csv_of_spreadsheets),
      cmocka_unit_test(test_csv_of_other_spreadsheets),
      cmocka_unit_test(test_thousands),
      cmocka_unit_test(test_csv_refusals),
      cmocka_unit_test(test_waypoints),
      cmocka_unit_test(test_waypoint_refusals),
      cmocka_unit_test(test_median),
  };
  return cmocka_run_group_tests_name("ground_tools/base/number_table", tests, nullptr, nullptr);
}
