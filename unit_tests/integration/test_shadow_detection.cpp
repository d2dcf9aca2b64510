// The shadow-aware detector on rendered orthoimages under two suns, and on another simulator's lunar frames,
// against the true rocks: the figures that the project promises, at the default parameters.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "ground_tools/scratch.hpp"
#include "map/detector.hpp"
#include "map/score.hpp"
#include "map/shadow_detector.hpp"
#include "support/cmocka.hpp"
#include "support/data.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

Raster raster;
const test::Scratch scratch;
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

/// A boulder of the lunar frames, pixels, centres of pixels at integers. The annotation's (u, v) is 256 + s x
/// - r / 2 and 256 - s y - r / 2 with (x, y) of `boulder_cppi` in metres, s = 2.7741 px/m and r = s times the
/// size, exactly, in all frames: the first corner of a box of half the size about the boulder. So its place
/// is (u, v) + r / 2.
struct Annotated {
  Vec2 p_px;
  double radius_px;
};

constexpr double kNear_px = 5.0;
constexpr double kPixel_m = 0.366;

struct Tally {
  int rocks = 0, found = 0, entries = 0, right = 0;
};

void count(const std::vector<TableBoulder>& boulders, const std::vector<Annotated>& rocks, double frame_px,
           Tally& tally) {
  std::vector<Vec2> places;
  for (const TableBoulder& b : boulders) {
    places.emplace_back(b.p_map_m.x() / kPixel_m - 0.5, -b.p_map_m.y() / kPixel_m - 0.5);
  }
  for (const Annotated& a : rocks) {
    const double least = std::min(a.p_px.x(), a.p_px.y());
    const double most = std::max(a.p_px.x(), a.p_px.y());
    if (least < 0.0 || most > frame_px - 1.0 || a.radius_px < 3.0) continue;
    ++tally.rocks;
    tally.found += std::any_of(places.begin(), places.end(),
                               [&](const Vec2& p) { return (p - a.p_px).norm() <= kNear_px; });
  }
  for (const Vec2& p : places) {
    ++tally.entries;
    tally.right += std::any_of(rocks.begin(), rocks.end(),
                               [&](const Annotated& a) { return (p - a.p_px).norm() <= kNear_px; });
  }
}

/// The frames that no choice was made on: every other one of those there are. All show the same 28 boulders.
void test_lunar_frames(void**) {
  folder = test::find_data("pangu_boulders");
  SKIP_WITHOUT(folder, "pangu_boulders");
  const nlohmann::json annotation =
      nlohmann::json::parse(std::ifstream(folder + "/pixel_coords_c80ade7.json"));
  const Sun sun = parse_sun("18,55");  // by the shadows
  // the frames have no geo-reference
  const std::filesystem::path link = scratch.path("frame.png");
  scratch.file("frame.pgw", "0.366\n0\n0\n-0.366\n0.183\n-0.183\n");
  Tally tally;
  for (int frame = 4; frame < 400; frame += 8) {
    const std::string name = fmt::format("{}/frames/frame_{:05d}.png", folder, frame);
    std::filesystem::remove(link);
    std::filesystem::create_symlink(std::filesystem::absolute(name), link);
    raster = read_orthoimage(link);
    std::vector<Annotated> rocks;
    for (const nlohmann::json& a : annotation.at(std::to_string(frame))) {
      const double r = a[2];
      rocks.push_back({Vec2(a[0].get<double>() + 0.5 * r, a[1].get<double>() + 0.5 * r), r});
    }
    count(detect_boulders_by_shadow(raster, sun, ShadowParams{}), rocks, raster.width, tally);
  }
  const double recall = static_cast<double>(tally.found) / tally.rocks;
  const double precision = static_cast<double>(tally.right) / tally.entries;
  print_message("lunar frames: recall %.3f of %d, precision %.3f of %d\n", recall, tally.rocks, precision,
                tally.entries);
  assert_at_least(recall, 0.70);
  assert_at_least(precision, 0.70);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_sample), cmocka_unit_test(test_whole_field),
                              cmocka_unit_test(test_lunar_frames)};
  return cmocka_run_group_tests_name("integration/shadow_detection", tests, nullptr, nullptr);
}
