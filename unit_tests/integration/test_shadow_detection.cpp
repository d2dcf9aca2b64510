// The shadow-aware detector on rendered orthoimages under two suns, and on another simulator's lunar frames,
// against the true rocks: the figures that the project promises, at the default parameters.
#include <algorithm>
#include <cmath>

#include "map/detector.hpp"
#include "map/score.hpp"
#include "map/shadow_detector.hpp"
#include "support/cmocka.hpp"
#include "support/data.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

Raster raster;
std::vector<TableBoulder> truth;
std::string folder;

void check_image(const std::string& ortho, const std::string& rocks, const char* sun_text, double least) {
  raster = read_orthoimage(ortho);
  truth = read_csv(rocks);
  const Sun sun = parse_sun(sun_text);
  const MapScore score =
      score_map(detect_boulders_by_shadow(raster, sun, ShadowParams{}), truth, extent_of(raster));
  const double towards_m = sunward_shift_m(score, sun);
  print_message("%s: recall %.3f, precision %.3f, median error %.3f m, towards the sun %+.4f m\n",
                ortho.c_str(), score.recall(), score.precision(), score.median_error_m, towards_m);
  assert_at_least(score.recall(), least);
  assert_at_least(score.precision(), least);
  assert_at_most(score.median_error_m, 0.03);
  assert_at_most(std::fabs(towards_m), std::max(0.25 * raster.geo.pixel_m(), 0.015));
}

void test_sample(void**) {
  static const std::string sample = CAIRN_SOURCE_DIR "/unit_tests/integration/sample";
  check_image(sample + "/ortho_5mm.tif", sample + "/truth_rocks.csv", "45,135", 0.85);
}

void test_whole_field(void**) {
  folder = test::find_data("rendered_dev");
  SKIP_WITHOUT(folder, "rendered_dev");
  const std::string rocks = folder + "/truth_rocks.csv";
  check_image(folder + "/ortho_5mm.tif", rocks, "45,135", 0.90);
  check_image(folder + "/ortho_10mm.tif", rocks, "45,135", 0.90);
  check_image(folder + "/ortho_20mm.tif", rocks, "45,135", 0.85);
  check_image(folder + "/ortho_10mm_sun2.tif", rocks, "55,250", 0.90);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_sample), cmocka_unit_test(test_whole_field)};
  return cmocka_run_group_tests_name("integration/shadow_detection", tests, nullptr, nullptr);
}
