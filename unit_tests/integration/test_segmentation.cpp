// Segmentation of rendered Mars-like scenes: how many of the true rocks are covered by regions that fit them.
#include "segmentation/segmentation.hpp"

#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "geometry/stereo_rig.hpp"
#include "support/cmocka.hpp"
#include "support/data.hpp"
#include "support/image_file.hpp"

using namespace cairn;

namespace {

struct Rock {
  Vec3 p_map_m = Vec3(0.0, 0.0, 0.0);  // half way up
  double diameter_m = 0.0;
};

/// A rock as the image shows it.
struct Outline {
  double u_px;
  double v_px;
  double width_px;
};

struct Score {
  int rocks = 0;
  int covered = 0;
  int rock_regions = 0;
  double spill = 0.0;  // sum over those regions of the share that lies off the rock
  int regions = 0;
  int frames = 0;
};

std::vector<Rock> rocks;
std::vector<Pose3> T_map_cam;
std::uint8_t pixels[cfg::kImagePixels];
SegmentationJob job;

void read_truth(const std::string& folder) {
  std::string line;
  std::ifstream table(folder + "/truth_rocks.csv");
  std::getline(table, line);
  while (std::getline(table, line)) {
    double id, x, y, z_ground, diameter, height;
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf,%lf,%lf", &id, &x, &y, &z_ground, &diameter, &height) != 6)
      continue;
    rocks.push_back({Vec3(x, y, z_ground + 0.5 * height), diameter});
  }
  std::ifstream poses(folder + "/truth_left_camera.tum");
  while (std::getline(poses, line)) {
    std::istringstream fields(line);
    double frame, tx, ty, tz, qx, qy, qz, qw;
    if (!(fields >> frame >> tx >> ty >> tz >> qx >> qy >> qz >> qw)) continue;
    T_map_cam.push_back({Quat(qw, qx, qy, qz), Vec3(tx, ty, tz)});
  }
}

/// Rocks of 0.10 m and more, wholly in view, within 2.5 m over ground.
std::vector<Outline> visible_rocks(const Pose3& pose) {
  StereoRig rig;
  rig.fx_px = cfg::kMission.fx_px;
  rig.fy_px = cfg::kMission.fy_px;
  rig.cx_px = cfg::kMission.cx_px;
  rig.cy_px = cfg::kMission.cy_px;
  rig.baseline_m = cfg::kMission.baseline_m;
  std::vector<Outline> seen;
  for (const Rock& rock : rocks) {
    const Vec3 p_cam_m = pose.inverse() * rock.p_map_m;
    const Vec3 away_m = rock.p_map_m - pose.t;
    if (rock.diameter_m < 0.10 || p_cam_m.z() < 0.2 || std::hypot(away_m.x(), away_m.y()) > 2.5) continue;
    const StereoPixel at = project(rig, p_cam_m);
    const double width = rock.diameter_m * rig.fx_px / p_cam_m.z();
    if (at.u_left < width / 2 || at.u_left > cfg::kImageWidth - width / 2) continue;
    if (at.v_left < width / 2 || at.v_left > cfg::kImageHeight - width / 2) continue;
    seen.push_back({at.u_left, at.v_left, width});
  }
  return seen;
}

/// No more than twice as wide and high as the rock.
bool fits(std::uint8_t label, const Outline& rock) {
  if (label == 0) return false;
  const Region& region = job.regions()[label - 1U];
  const double limit = 2.0 * rock.width_px + 6.0;
  return region.u_max_px - region.u_min_px < limit && region.v_max_px - region.v_min_px < limit;
}

double share_off_rock(const Region& region, const Outline& rock) {
  int all = 0;
  int off = 0;
  for (int v = region.v_min_px; v <= region.v_max_px; ++v) {
    for (int u = region.u_min_px; u <= region.u_max_px; ++u) {
      if (job.labels().label_at(u, v) != region.label) continue;
      ++all;
      off += std::hypot(u - rock.u_px, v - rock.v_px) > 0.75 * rock.width_px ? 1 : 0;
    }
  }
  return static_cast<double>(off) / all;
}

/// Covered: at least a quarter of the places sampled over the middle of the rock lie in regions that fit it.
/// A lit face may well be of the same grey as the ground.
void score_rock(const Outline& rock, Score& score) {
  int hits[256] = {};
  int samples = 0;
  int covered = 0;
  for (int i = -3; i <= 3; ++i) {
    for (int j = -3; j <= 3; ++j) {
      if (i * i + j * j > 10) continue;
      const std::uint8_t label =
          job.labels().label_at(rock.u_px + 0.12 * i * rock.width_px, rock.v_px + 0.11 * j * rock.width_px);
      ++samples;
      if (!fits(label, rock)) continue;
      ++covered;
      ++hits[label];
    }
  }
  ++score.rocks;
  score.covered += 4 * covered >= samples ? 1 : 0;
  for (const Region& region : job.regions()) {
    if (hits[region.label] < 3) continue;
    ++score.rock_regions;
    score.spill += share_off_rock(region, rock);
  }
}

void test_rocks_are_covered(void**) {
  const std::string folder = test::find_data("rendered_dev");
  SKIP_WITHOUT(folder, "rendered_dev");
  read_truth(folder);
  assert_true(rocks.size() > 3000 && T_map_cam.size() == 417);
  static Score score;
  for (std::size_t frame = 0; frame < T_map_cam.size(); frame += 6) {
    char name[32];
    std::snprintf(name, sizeof name, "/left/%06d.jpg", static_cast<int>(frame));
    const MutableImageU8 image = test::read_image(folder + name, pixels, sizeof pixels);
    assert_non_null(image.data);
    assert_status(job.start({}, {image.data, image.width, image.height, image.stride}),
                  SegmentationStatus::kRunning);
    WorkBudget budget = WorkBudget::unlimited();
    assert_status(job.step(budget), Progress::kDone);
    assert_status(job.status(), SegmentationStatus::kDone);
    score.regions += static_cast<int>(job.regions().size());
    ++score.frames;
    for (const Outline& rock : visible_rocks(T_map_cam[frame])) score_rock(rock, score);
  }
  const double recall = static_cast<double>(score.covered) / score.rocks;
  const double spill = score.spill / score.rock_regions;
  print_message("%d rocks in %d frames: recall %.3f, spill %.3f, %.1f regions a frame\n", score.rocks,
                score.frames, recall, spill, static_cast<double>(score.regions) / score.frames);
  assert_at_least(score.rocks, 150);
  assert_at_least(recall, 0.95);
  assert_at_most(spill, 0.04);
}

// A 12-bit image of a hazy, nearly rock-free plain, its grey levels companded by a square root as
// flight cameras do.
void test_navcam_image_gives_few_regions(void**) {
  const char* relative = "mer_navcam/1N491020519ILFCNY9P0706L0M1.IMG";
  const std::string path = test::find_data(relative);
  SKIP_WITHOUT(path, relative);
  static std::uint8_t whole[1024 * 1024];
  const MutableImageU8 image = test::read_image(path, whole, sizeof whole, 4);
  assert_non_null(image.data);
  for (std::uint8_t& pixel : whole) pixel = static_cast<std::uint8_t>(std::sqrt(255.0 * pixel));
  // The dark rock near the lower right corner is at (935, 880).
  const ImageU8 part{whole + 640 * 1024 + 512, 500, 384, 1024};
  assert_status(job.start({}, part), SegmentationStatus::kRunning);
  WorkBudget budget = WorkBudget::unlimited();
  assert_status(job.step(budget), Progress::kDone);
  assert_status(job.status(), SegmentationStatus::kDone);
  assert_at_most(job.regions().size(), 10);
  assert_int_not_equal(job.labels().label_at(935 - 512, 879 - 640), 0);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_rocks_are_covered),
      cmocka_unit_test(test_navcam_image_gives_few_regions),
  };
  return cmocka_run_group_tests_name("integration/segmentation", tests, nullptr, nullptr);
}
