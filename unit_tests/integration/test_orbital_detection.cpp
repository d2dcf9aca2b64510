// The paper's orbital detector on rendered orthoimages, against the true rocks: the figures that the project
// promises, all at the default parameters.
#include "ground_tools/raster_in_memory.hpp"
#include "map/score.hpp"
#include "support/cmocka.hpp"
#include "support/data.hpp"

using namespace cairn;
using namespace cairn::ground;
using test::Raster;
using test::read_orthoimage;

namespace {

MapScore score_of(const std::string& ortho, const std::string& truth) {
  static Raster raster;
  raster = read_orthoimage(ortho);
  const MapScore score = score_map(detect_boulders(raster, {}), read_csv(truth), extent_of(raster));
  print_message("%s: recall %.3f, precision %.3f, median error %.3f m\n", ortho.c_str(), score.recall(),
                score.precision(), score.median_error_m);
  return score;
}

void check_score(const MapScore& score) {
  assert_at_least(score.recall(), 0.78);
  assert_at_least(score.precision(), 0.70);
  assert_at_most(score.median_error_m, 0.09);
}

void test_sample(void**) {
  static const std::string sample = CAIRN_SOURCE_DIR "/unit_tests/integration/sample";
  check_score(score_of(sample + "/ortho_5mm.tif", sample + "/truth_rocks.csv"));
}

void test_whole_field(void**) {
  static std::string folder;
  folder = test::find_data("rendered_dev");
  SKIP_WITHOUT(folder, "rendered_dev");
  for (const char* ortho : {"ortho_5mm.tif", "ortho_10mm.tif", "ortho_20mm.tif", "ortho_10mm_sun2.tif"}) {
    check_score(score_of(folder + "/" + ortho, folder + "/truth_rocks.csv"));
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_sample), cmocka_unit_test(test_whole_field)};
  return cmocka_run_group_tests_name("integration/orbital_detection", tests, nullptr, nullptr);
}
