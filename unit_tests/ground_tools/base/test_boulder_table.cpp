// Boulder tables: CSV out and in, and tables that cannot be read.
#include "base/boulder_table.hpp"

#include "ground_tools/scratch.hpp"

using namespace cairn;
using namespace cairn::ground;
using cairn::test::Scratch;

namespace {

const Scratch scratch;
std::vector<TableBoulder> table;

void test_csv_round_trip(void**) {
  static std::vector<TableBoulder> in;
  in = {{Vec2(12.34567, -3000123.4), 0.25, 0.0491, 0.31, 1.5}, {Vec2(-1.0, 2.0), 1.0, 0.7854, 0.0, 1.0}};
  table = read_csv(scratch.file("round.csv", to_csv(in)));
  assert_true(to_csv(in).find("0.785400,,1.00") != std::string::npos);  // unknown contrast
  assert_int_equal(table.size(), 2);
  for (std::size_t i = 0; i < 2; ++i) {
    assert_near((table[i].p_map_m - in[i].p_map_m).norm(), 0.0, 1e-4);
    assert_near(table[i].diameter_m, in[i].diameter_m, 1e-4);
    assert_near(table[i].area_m2, in[i].area_m2, 1e-6);
    assert_near(table[i].contrast, in[i].contrast, 1e-3);
    assert_near(table[i].elongation, in[i].elongation, 1e-2);
  }
}

// Craters are in the table, and no boulders.
void test_craters_stay_out(void**) {
  TableBoulder boulder, crater;
  boulder.diameter_m = 1.0;
  crater.diameter_m = 9.0;
  const std::string text = to_csv({boulder}, {crater, crater});
  assert_true(text.find(",boulder\n") != std::string::npos && text.find(",crater\n") != std::string::npos);
  table = read_csv(scratch.file("craters.csv", text));
  assert_int_equal(table.size(), 1);
  assert_near(table[0].diameter_m, 1.0, 0.0);
  table = read_csv(scratch.file(
      "craters.csv", "x,y,diameter,kind\n1,1,9,Crater\n2,2,9,\"CRATERS\"\n3,3,1,Boulder\n4,4,1,\n"));
  assert_int_equal(table.size(), 2);
}

void test_columns_by_name(void**) {
  table = read_csv(scratch.file(
      "named.csv", "id,name,diameter,y,x\r\n7,\"big one\",0.5, 2 ,1e1\r\n\r\n8,small,0.1,3,4\r\n"));
  assert_int_equal(table.size(), 2);
  assert_near(table[0].p_map_m.x(), 10.0, 0.0);
  assert_near(table[0].p_map_m.y(), 2.0, 0.0);
  assert_near(table[0].area_m2, 0.19635, 1e-5);
  assert_near(table[0].elongation, 1.0, 0.0);
  table = read_csv(scratch.path("named.csv"), 0.5);
  assert_int_equal(table.size(), 1);
}

/// As QGIS exports points: columns of coordinates in capitals, or well-known text.
void test_points_of_qgis(void**) {
  table = read_csv(scratch.file("xy.csv", "X,Y,fid,diameter_m,contrast\n1.5,-2,1,0.5,\n"));
  assert_near((table.at(0).p_map_m - Vec2(1.5, -2.0)).norm(), 0.0, 0.0);
  table = read_csv(
      scratch.file("wkt.csv", "WKT,fid,diameter_m\n\"POINT (1.5 -2)\",1,0.5\n\"POINT Z (3 4 5)\",2,0.5\n"));
  assert_near((table.at(0).p_map_m - Vec2(1.5, -2.0)).norm(), 0.0, 0.0);
  assert_near((table.at(1).p_map_m - Vec2(3.0, 4.0)).norm(), 0.0, 0.0);
  assert_refused(read_csv(scratch.file("wkt.csv", "WKT,diameter\nLINESTRING (1 2),1\n")), "is not a point");
}

void test_refusals(void**) {
  assert_refused(read_csv(scratch.path("absent.csv")), "absent.csv");
  assert_refused(read_csv(scratch.file("empty.csv", "")), "empty.csv: is empty");
  assert_refused(read_csv(scratch.file("column.csv", "x,z,diameter\n1,2,3\n")),
                 "column.csv: no column 'y_m' or 'y'");
  assert_refused(read_csv(scratch.file("short.csv", "x,y,diameter\n1,2,3\n1,2\n")),
                 "short.csv:3: 2 fields under 3");
  assert_refused(read_csv(scratch.file("word.csv", "x,y,diameter\n1,two,3\n")),
                 "word.csv:2: 'two' in column 'y'");
  assert_refused(read_csv(scratch.file("nan.csv", "x,y,diameter\nnan,2,3\n")), "is not a number");
  assert_refused(read_csv(scratch.file("inf.csv", "x,y,diameter\n1,1e999,3\n")), "is not a number");
  assert_refused(read_csv(scratch.file("zero.csv", "x,y,diameter\n1,2,0\n")), "zero.csv:2: the diameter");
  for (const char* text : {"x,y,diameter,confidence\n1,2,3,87\n", "x,y,diameter,confidence\n1,2,3,-0.1\n"})
    assert_refused(read_csv(scratch.file("sure.csv", text)), "sure.csv:2: a confidence");
}

void test_extent(void**) {
  table = {{Vec2(1.0, 5.0), 0.1}, {Vec2(-2.0, 9.0), 0.1}};
  const MapExtent e = extent_of(table);
  assert_near(e.min_x_m, -2.01, 1e-12);
  assert_near(e.max_x_m, 1.01, 1e-12);
  assert_near(e.min_y_m, 4.99, 1e-12);
  assert_near(e.max_y_m, 9.01, 1e-12);
  assert_true(e.contains(Vec2(0.0, 7.0), 1.0));
  assert_false(e.contains(Vec2(0.0, 7.0), 1.02));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_csv_round_trip),  cmocka_unit_test(test_craters_stay_out),
      cmocka_unit_test(test_columns_by_name), cmocka_unit_test(test_points_of_qgis),
      cmocka_unit_test(test_refusals),        cmocka_unit_test(test_extent),
  };
  return cmocka_run_group_tests_name("ground_tools/base/boulder_table", tests, nullptr, nullptr);
}
