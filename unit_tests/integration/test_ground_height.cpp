// Height and tilt by the map's heights: ground that is known, seen from a pose that is a little wrong.
#include "localizer/ground_height.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cmap/cmap_file.hpp"
#include "core/big_endian.hpp"
#include "core/random.hpp"
#include "localizer/attitude_fusion.hpp"
#include "support/cmocka.hpp"
#include "support/sanitized.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

const MapExtent kExtent{-20.0, 480.0, 20.0, 520.0};
constexpr double kQuantum_m = 0.01;
constexpr std::uint32_t kSpacing = 50;
constexpr double kFocalBaseline = 47.3;  // of the mission's rig, px m

HeightGrid grid;
std::vector<std::uint8_t> bytes;
OrbitalMap map;
SurfacePoints points;
GroundHeightJob job;
Random generator(1);

double gauss() {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) sum += generator.next() / 4294967296.0;
  return sum;
}

/// Swells, and ripples that posts half a metre apart miss.
double ground_m(double x, double y) {
  return 2.0 + 0.3 * std::sin(0.4 * x + 0.1 * y) + 0.15 * std::cos(0.7 * y) +
         0.006 * std::sin(9.0 * x + 4.0 * y) * std::cos(8.0 * y);
}

/// What an elevation model is off by, `error_m` (1 sigma) that changes over some metres.
double model_error_m(double x, double y, double error_m) {
  return error_m * std::sqrt(2.0) * std::sin(0.21 * x + 0.13 * y + 0.4);
}

void make_map(double hole_from_m = 1e9, double error_m = 0.0, double told_m = 0.0) {
  std::vector<TableBoulder> boulders(400);
  for (TableBoulder& b : boulders) {
    b.p_map_m =
        Vec2(kExtent.min_x_m + 0.01 * generator.below(4000), kExtent.min_y_m + 0.01 * generator.below(4000));
    b.diameter_m = 0.2;
  }
  const CmapLayout cells = cells_of(kExtent, kQuantum_m);
  HeightSamples samples;
  samples.fine = 4;
  samples.columns = (posts_along(cells.extent_x, kSpacing) - 1U) * 4U + 1U;
  samples.rows = (posts_along(cells.extent_y, kSpacing) - 1U) * 4U + 1U;
  for (std::uint32_t v = 0; v < samples.rows; ++v) {
    for (std::uint32_t u = 0; u < samples.columns; ++u) {
      const double x = kExtent.min_x_m + 0.125 * u;
      samples.z_m.push_back(x > hole_from_m ? std::numeric_limits<double>::quiet_NaN()
                                            : ground_m(x, kExtent.min_y_m + 0.125 * v) +
                                                  model_error_m(x, kExtent.min_y_m + 0.125 * v, error_m));
    }
  }
  grid = fit_heights(samples, kSpacing, told_m > 0.0 ? told_m : std::max(0.005, error_m));
  CmapOptions options;
  options.heights = &grid;
  bytes = encode_cmap(boulders, kExtent, kQuantum_m, {}, options);
  const MapStatus status = validate_cmap(bytes, &map);
  assert_status(status, MapStatus::kUsable);
}

struct Trial {
  Pose3 T_map_rover;          ///< where the rover is
  Pose3 believed;             ///< and where it thinks it is
  Vec3 lacks{0.0, 0.0, 0.0};  ///< z, a_x, a_y
  double bias_px = 0.0;
  double boulders = 0.03;  ///< share of points on what no map has
};

/// What a rover sees of the ground before it, 0.7 m above it.
void look(const Trial& t) {
  points.clear();
  const Pose3 as_seen = t.believed * t.T_map_rover.inverse();
  const Vec3 eye = t.T_map_rover * Vec3(0.0, 0.0, 0.7);
  for (int i = 0; i < 1000; ++i) {
    const double range = 1.0 + 2.0 * generator.next() / 4294967296.0;
    const double side = 0.6 * (generator.next() / 2147483648.0 - 1.0);
    Vec3 p = t.T_map_rover * Vec3(range * std::cos(side), range * std::sin(side), 0.0);
    p.z() = ground_m(p.x(), p.y()) + (generator.next() / 4294967296.0 < t.boulders ? 0.08 : 0.0);
    const Vec3 ray = p - eye;
    const double depth = 0.9 * ray.norm();
    const double d_px = kFocalBaseline / depth;
    const double longer = d_px / (d_px + 0.25 * gauss() + t.bias_px);
    SurfacePoint s;
    s.p_site_m = as_seen * (eye + longer * ray);
    s.sigma_height_m = static_cast<float>(std::fabs(ray.z()) * 0.25 / d_px);
    points.append(s);
  }
}

Trial trial_of(double z, double tilt, double bias_px = 0.0) {
  Trial t;
  t.lacks = Vec3(z * gauss(), tilt * gauss(), tilt * gauss());
  t.bias_px = bias_px * gauss();
  const double x = -15.0 + 30.0 * generator.next() / 4294967296.0;
  const double y = 485.0 + 30.0 * generator.next() / 4294967296.0;
  const double yaw = 6.28 * generator.next() / 4294967296.0;
  t.T_map_rover = {quat_exp(Vec3(0.03 * gauss(), 0.03 * gauss(), 0.0)) * quat_exp(Vec3(0.0, 0.0, yaw)),
                   Vec3(x, y, ground_m(x, y) + 0.05 * gauss())};
  t.believed = {quat_exp(Vec3(-t.lacks[1], -t.lacks[2], 0.0)) * t.T_map_rover.q,
                t.T_map_rover.t - Vec3(0.0, 0.0, t.lacks[0])};
  look(t);
  return t;
}

GroundHeightStatus run(const Trial& t, std::uint32_t ops = UINT32_MAX) {
  if (job.start({}, map, points, Pose3(), t.believed.t, 0.01) != GroundHeightStatus::kRunning)
    return job.status();
  for (;;) {
    WorkBudget budget(ops);
    if (job.step(budget) == Progress::kDone) return job.status();
    assert_at_most(budget.spent(), ops + GroundHeightJob::kRoundOps);
  }
}

/// Within three sigma as often as that says, each by itself and all three together; and good.
void test_what_is_told_is_so(void**) {
  make_map();
  double chi2 = 0.0;
  double squares[3] = {};
  int beyond = 0;
  constexpr int kTrials = test::kSanitized ? 60 : 1000;
  for (int i = 0; i < kTrials; ++i) {
    const Trial t = trial_of(0.1, 0.01, 0.1);
    assert_status(run(t), GroundHeightStatus::kFitted);
    const Vec3 off = job.result().offset - t.lacks;
    chi2 += off.dot(job.result().covariance.inverse() * off) / kTrials;
    for (int k = 0; k < 3; ++k) {
      squares[k] += off[k] * off[k] / kTrials;
      beyond += off[k] * off[k] > 9.0 * job.result().covariance(k, k) ? 1 : 0;
    }
  }
  if (test::kSanitized) return;  // too few to tell
  assert_at_most(chi2, 3.6);
  assert_at_least(chi2, 1.0);  // nor is it told worse than it is
  assert_at_most(beyond, 3 * kTrials / 100);
  assert_at_most(std::sqrt(squares[0]), 0.02);
  assert_at_most(std::sqrt(squares[1]), 0.006);
  assert_at_most(std::sqrt(squares[2]), 0.006);
}

void test_slices_do_not_matter(void**) {
  make_map();
  const Trial t = trial_of(0.1, 0.01);
  assert_status(run(t), GroundHeightStatus::kFitted);
  const GroundOffset whole = job.result();
  for (const std::uint32_t ops : {1U, 3000U}) {
    assert_status(run(t, ops), GroundHeightStatus::kFitted);
    for (int k = 0; k < 3; ++k) assert_true(job.result().offset[k] == whole.offset[k]);
    for (int k = 0; k < 9; ++k)
      assert_true(job.result().covariance(k / 3, k % 3) == whole.covariance(k / 3, k % 3));
  }
}

/// No heights, none there, damaged ones, few points, off the map.
void test_nothing_to_go_by(void**) {
  make_map();
  Trial t = trial_of(0.0, 0.0);
  t.believed.t.x() += 200.0;
  for (SurfacePoint& p : points) p.p_site_m.x() += 200.0;
  assert_status(run(t), GroundHeightStatus::kNoHeights);
  t = trial_of(0.0, 0.0);
  for (std::size_t i = be::get_u16(bytes.data() + cmap::kHeadBytesAt) + 400U; i < bytes.size(); i += 50)
    bytes[i] ^= 1U;
  assert_status(run(t), GroundHeightStatus::kNoHeights);
  make_map(-19.0);
  t = trial_of(0.0, 0.0);
  assert_status(run(t), GroundHeightStatus::kNoHeights);
  make_map();
  points.clear();
  assert_status(run(t), GroundHeightStatus::kNoHeights);
  map = OrbitalMap();
  look(t);
  assert_status(run(t), GroundHeightStatus::kNoHeights);
}

/// A map whose heights are all off: z goes there and nothing else, and what is far off is refused.
void test_a_map_that_is_off(void**) {
  for (const double off_m : {0.0, -0.8, 2.0, 40.0}) {
    make_map();
    AttitudeFusion fusion;
    fusion.init({});
    const TiltStep step{Vec2(0.05, 0.03), 0.5, Mat3::Zero()};
    for (int i = 0; i < 60; ++i) fusion.propagate(step);
    Trial t = trial_of(0.0, 0.0);
    t.believed.t.z() += off_m;
    for (SurfacePoint& p : points) p.p_site_m.z() += off_m;
    assert_status(run(t), GroundHeightStatus::kFitted);
    const TiltResult r = fusion.ground(job.result().offset, job.result().covariance, job.result().least);
    assert_status(r.status, off_m > 10.0 ? AttitudeStatus::kInconsistent : AttitudeStatus::kFused);
    if (r.status != AttitudeStatus::kFused) continue;
    assert_near(r.z_m, -off_m, 0.03);
    assert_near(r.turn_map.norm(), 0.0, 0.01);
  }
}

/// A map whose heights swell where the ground does not, by as much as its head says: the pose goes along, and
/// its sigmas say so.
void test_a_map_with_errors_of_its_own(void**) {
  for (const double error_m : {0.05, 0.2}) {
    make_map(1e9, error_m);
    int beyond = 0;
    for (int i = 0; i < (test::kSanitized ? 10 : 300); ++i) {
      AttitudeFusion fusion;
      fusion.init({});
      for (int k = 0; k < 60; ++k) fusion.propagate({Vec2(0.05, 0.03), 0.5, Mat3::Zero()});
      const Trial t = trial_of(0.1, 0.003);
      assert_status(run(t), GroundHeightStatus::kFitted);
      const TiltResult r = fusion.ground(job.result().offset, job.result().covariance, job.result().least);
      if (r.status != AttitudeStatus::kFused) continue;
      beyond += std::fabs(t.lacks[0] - r.z_m) > 3.0 * fusion.sigma_z_m() ? 1 : 0;
      const double tilt = std::hypot(t.lacks[1] - r.turn_map.x(), t.lacks[2] - r.turn_map.y());
      beyond += tilt > 3.5 * fusion.sigma_tilt_rad() ? 1 : 0;
    }
    print_message("heights off by %.2f m: %d of 600 beyond 3 sigma\n", error_m, beyond);
    assert_at_most(beyond, 6);
  }
}

/// The same where the head does not say so: ground that contradicts ground makes the sigmas grow.
void test_a_map_that_contradicts_itself(void**) {
  int worst = 0;
  for (const double error_m : {0.03, 0.1, 0.3}) {
    make_map(1e9, error_m, 0.005);
    int beyond = 0, told = 0, taken = 0;
    constexpr int kDrives = test::kSanitized ? 2 : 100, kFixes = 20;
    for (int drive = 0; drive < kDrives; ++drive) {
      AttitudeFusion fusion;
      fusion.init({});
      Vec3 lacks(0.0, 0.0, 0.0);
      for (int fix = 0; fix < kFixes; ++fix) {
        for (int k = 0; k < 30; ++k) fusion.propagate({Vec2(0.05, 0.03), 0.5, Mat3::Zero()});
        Trial t = trial_of(0.0, 0.0);
        t.lacks = lacks;
        t.believed = {quat_exp(Vec3(-lacks[1], -lacks[2], 0.0)) * t.T_map_rover.q,
                      t.T_map_rover.t - Vec3(0.0, 0.0, lacks[0])};
        look(t);
        assert_status(run(t), GroundHeightStatus::kFitted);
        const TiltResult r = fusion.ground(job.result().offset, job.result().covariance, job.result().least);
        if (r.status == AttitudeStatus::kFused) lacks -= Vec3(r.z_m, r.turn_map.x(), r.turn_map.y());
        taken += r.status == AttitudeStatus::kFused ? 1 : 0;
        if (fix < kFixes / 2) continue;  // by then it has shown
        told += 2;
        beyond += std::fabs(lacks[0]) > 3.0 * fusion.sigma_z_m() ? 1 : 0;
        beyond += std::hypot(lacks[1], lacks[2]) > 3.5 * fusion.sigma_tilt_rad() ? 1 : 0;
      }
    }
    print_message("heights off by %.2f m untold: %d of %d beyond 3 sigma, %d of %d taken\n", error_m, beyond,
                  told, taken, kDrives * kFixes);
    worst = std::max(worst, beyond);
  }
  assert_at_most(worst, 40);  // of 2000
}

/// Drives with a drift that the filter does not know: after ten fixes the pose is the map's, within 3 sigma.
void test_a_drive(void**) {
  make_map();
  int beyond = 0;
  for (int drive = 0; drive < (test::kSanitized ? 5 : 100); ++drive) {
    AttitudeFusion fusion;
    fusion.init({});
    Vec3 lacks(0.3 * gauss(), 0.0035 * gauss(), 0.0035 * gauss());
    const Vec2 drift(0.0004 * gauss(), 0.0004 * gauss());
    for (int fix = 0; fix < 10; ++fix) {
      Trial t = trial_of(0.0, 0.0);
      const double yaw = planar(t.T_map_rover).yaw_rad;
      for (int i = 0; i < 30; ++i) {
        const Vec2 d = 0.06 * Vec2(std::cos(yaw), std::sin(yaw));
        lacks[0] += lacks[1] * d.y() - lacks[2] * d.x();
        const Vec2 turn = (drift - Vec2(fusion.roll_rad_per_m(), fusion.pitch_rad_per_m())) * 0.06;
        lacks[1] += std::cos(yaw) * turn.x() - std::sin(yaw) * turn.y();
        lacks[2] += std::sin(yaw) * turn.x() + std::cos(yaw) * turn.y();
        fusion.propagate({d, yaw, Mat3::Zero()});
      }
      t.lacks = lacks;
      t.bias_px = 0.0;
      t.believed = {quat_exp(Vec3(-lacks[1], -lacks[2], 0.0)) * t.T_map_rover.q,
                    t.T_map_rover.t - Vec3(0.0, 0.0, lacks[0])};
      look(t);
      assert_status(run(t), GroundHeightStatus::kFitted);
      const TiltResult r = fusion.ground(job.result().offset, job.result().covariance, job.result().least);
      assert_status(r.status, AttitudeStatus::kFused);
      lacks -= Vec3(r.z_m, r.turn_map.x(), r.turn_map.y());
    }
    beyond += std::fabs(lacks[0]) > 3.0 * fusion.sigma_z_m() ? 1 : 0;
    beyond += std::hypot(lacks[1], lacks[2]) > 3.5 * fusion.sigma_tilt_rad() ? 1 : 0;
    assert_at_least(fusion.sigma_z_m(), 0.00499);
    assert_at_most(std::fabs(lacks[0]), 0.05);
    assert_at_most(std::hypot(lacks[1], lacks[2]), 0.01);
  }
  assert_at_most(beyond, 3);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_what_is_told_is_so),
      cmocka_unit_test(test_slices_do_not_matter),
      cmocka_unit_test(test_nothing_to_go_by),
      cmocka_unit_test(test_a_map_that_is_off),
      cmocka_unit_test(test_a_map_with_errors_of_its_own),
      cmocka_unit_test(test_a_map_that_contradicts_itself),
      cmocka_unit_test(test_a_drive),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
