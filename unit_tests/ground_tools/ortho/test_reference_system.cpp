// Reference systems as short texts.
#include "ortho/reference_system.hpp"

#include <ogr_spatialref.h>

#include "ground_tools/scratch.hpp"

using namespace cairn::ground;

namespace {

std::string text;

std::string text_of(const char* input) {
  OGRSpatialReference system;
  assert_int_equal(system.SetFromUserInput(input), OGRERR_NONE);
  return reference_text(&system);
}

// As GDAL reads it from a HiRISE product.
const char* const kHiriseWkt =
    "PROJCS[\"Equirectangular Mars\",GEOGCS[\"GCS_Mars\",DATUM[\"D_Mars\",SPHEROID[\"Mars_localRadius\","
    "3388546.86869391,0]],PRIMEM[\"Reference_Meridian\",0],UNIT[\"degree\",0.0174532925199433]],"
    "PROJECTION[\"Equirectangular\"],PARAMETER[\"standard_parallel_1\",-38.071984777395],"
    "PARAMETER[\"central_meridian\",224.02263789406],PARAMETER[\"false_easting\",0],"
    "PARAMETER[\"false_northing\",0],UNIT[\"metre\",1]]";

void test_numbers(void**) {
  assert_string_equal(text_of("EPSG:32633").c_str(), "EPSG:32633");
  assert_string_equal(text_of("IAU_2015:49910").c_str(), "IAU_2015:49910");
  // The height system is no matter of a map's.
  assert_string_equal(text_of("EPSG:32633+5773").c_str(), "EPSG:32633");
}

/// What has no number is told by PROJ's words, short enough for the head of a map, and nothing is lost.
void test_mars_without_a_number(void**) {
  text = text_of(kHiriseWkt);
  assert_string_equal(text.c_str(),
                      "+proj=eqc +lat_ts=-38.071984777395 +lon_0=224.02263789406 +R=3388546.86869391");
  OGRSpatialReference original;
  original.SetFromUserInput(kHiriseWkt);
  original.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  OGRSpatialReference again = reference_of(text, "test");
  assert_near(again.GetSemiMajor(), original.GetSemiMajor(), 0.0);
  for (const char* parameter : {SRS_PP_STANDARD_PARALLEL_1, SRS_PP_CENTRAL_MERIDIAN, SRS_PP_FALSE_EASTING})
    assert_near(again.GetProjParm(parameter), original.GetProjParm(parameter), 1e-12);
  assert_true(same_reference(text, kHiriseWkt));
  // A pole: what is no default must stay.
  text = text_of("+proj=stere +lat_0=-90 +lon_0=12.5 +k=0.994 +x_0=2000000 +y_0=0 +a=3396190 +b=3376200");
  assert_string_equal(text.c_str(),
                      "+proj=stere +lat_0=-90 +lon_0=12.5 +k=0.994 +x_0=2000000 +a=3396190 +b=3376200");
}

void test_local(void**) {
  assert_string_equal(reference_text(nullptr).c_str(), "local");
  assert_string_equal(text_of("LOCAL_CS[\"rover site\",UNIT[\"metre\",1]]").c_str(), "local:rover site");
  assert_string_equal(text_of("LOCAL_CS[\"r\xC3\xB6ver\",UNIT[\"metre\",1]]").c_str(), "local:r??ver");
  const OGRSpatialReference system = reference_of("local:rover site", "test");
  assert_true(system.IsLocal());
  assert_string_equal(reference_text(&system).c_str(), "local:rover site");
}

void test_same(void**) {
  assert_true(same_reference("local", "local"));
  assert_true(same_reference("local", ""));
  assert_false(same_reference("local", "local:a"));
  assert_false(same_reference("local:a", "local:b"));
  assert_false(same_reference("local", "EPSG:32633"));
  assert_true(same_reference("EPSG:32633", "+proj=utm +zone=33 +datum=WGS84"));
  assert_false(same_reference("EPSG:32633", "EPSG:32634"));
  assert_false(
      same_reference(kHiriseWkt, "+proj=eqc +lat_ts=-38.071984777395 +lon_0=224.02263789406 +R=3396190"));
  assert_true(same_reference("+proj=stere +lat_0=90 +a=3396190 +b=3376200",
                             "+proj=stere +lat_0=90 +lat_ts=90 +a=3396190 +rf=169.894447223612"));
  assert_false(same_reference("+proj=stere +lat_0=90 +a=3396190 +b=3376200",
                              "+proj=stere +lat_0=90 +lat_ts=89 +a=3396190 +b=3376200"));
  assert_true(same_reference("nonsense", "nonsense"));
  assert_false(same_reference("nonsense", "EPSG:32633"));
}

void test_refusals(void**) {
  assert_refused(reference_of("+proj=nonsense", "site.cmap"),
                 "site.cmap: its reference system '+proj=nonsense'");
  assert_refused(reference_of("EPSG:99999999", "site.cmap"), "site.cmap");
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_numbers),  cmocka_unit_test(test_mars_without_a_number),
      cmocka_unit_test(test_local),    cmocka_unit_test(test_same),
      cmocka_unit_test(test_refusals),
  };
  return cmocka_run_group_tests_name("ground_tools/ortho/reference_system", tests, nullptr, nullptr);
}
