// The shadow-aware detector on rendered orthoimages under two suns, and on another simulator's lunar frames,
// against the true rocks: the figures that the project promises, at the default parameters.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "detect/detector.hpp"
#include "detect/shadow_detector.hpp"
#include "ground_tools/raster_in_memory.hpp"
#include "ground_tools/scratch.hpp"
#include "map/score.hpp"
#include "support/cmocka.hpp"
#include "support/data.hpp"

using namespace cairn;
using namespace cairn::ground;
using test::Raster;
using test::read_orthoimage;

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

/// A boulder of the lunar frames, pixels, centres of pixels at integers. The annotation's (u, v) is
///   u = 256 + s x - r / 2,   v = 256 - s y - r / 2
/// with (x, y) of `boulder_cppi` in metres, s = 2.7741 px/m and r = s times the size, exactly, in all frames:
/// the first corner of a box of half the size about the boulder. So its place is (u, v) + r / 2.
struct Annotated {
  Vec2 p_px;
  double radius_px;
};

constexpr double kNear_px = 5.0;
constexpr double kPixel_m = 0.366;

/// By annotated radius: 3 to 5, 5 to 8, 8 pixels and more.
constexpr double kRadius_px[] = {3.0, 5.0, 8.0};

struct Tally {
  int rocks = 0, found = 0, entries = 0, right = 0;
  int rocks_of[3] = {}, found_of[3] = {};

  double recall() const { return static_cast<double>(found) / rocks; }
  double precision() const { return static_cast<double>(right) / entries; }
  void print(const char* what) const {
    print_message(
        "%s: recall %.3f of %d, precision %.3f of %d; radius 3 to 5 px %d of %d, 5 to 8 %d of %d, more %d of "
        "%d\n",
        what, recall(), rocks, precision(), entries, found_of[0], rocks_of[0], found_of[1], rocks_of[1],
        found_of[2], rocks_of[2]);
  }
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
    const bool found = std::any_of(places.begin(), places.end(),
                                   [&](const Vec2& p) { return (p - a.p_px).norm() <= kNear_px; });
    const int radius = a.radius_px < kRadius_px[1] ? 0 : a.radius_px < kRadius_px[2] ? 1 : 2;
    ++tally.rocks;
    ++tally.rocks_of[radius];
    tally.found += found;
    tally.found_of[radius] += found;
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
  Tally raw;
  for (int frame = 4; frame < 400; frame += 8) {
    const std::string name = fmt::format("{}/frames/frame_{:05d}.png", folder, frame);
    std::filesystem::remove(link);
    std::filesystem::create_symlink(std::filesystem::absolute(name), link);
    raster = read_orthoimage(link);
    std::vector<Annotated> rocks;
    std::vector<Annotated> as_they_come;
    for (const nlohmann::json& a : annotation.at(std::to_string(frame))) {
      const Vec2 p(a[0].get<double>(), a[1].get<double>());
      const double r = a[2];
      as_they_come.push_back({p, r});
      rocks.push_back({p + Vec2(0.5 * r, 0.5 * r), r});
    }
    const std::vector<TableBoulder> found = detect_boulders_by_shadow(raster, sun, ShadowParams{});
    count(found, rocks, raster.width, tally);
    count(found, as_they_come, raster.width, raw);
  }
  tally.print("lunar frames, annotation moved by half its radius");
  raw.print("lunar frames, annotation as it comes");
  assert_at_least(tally.recall(), 0.70);
  assert_at_least(tally.precision(), 0.70);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_sample), cmocka_unit_test(test_whole_field),
                              cmocka_unit_test(test_lunar_frames)};
  return cmocka_run_group_tests_name("integration/shadow_detection", tests, nullptr, nullptr);
}
