// What speaks against VO: frozen pictures, and motion priors.
#include "localizer/vo_watch.hpp"

#include <cmath>

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

constexpr int kWidth = 64;
constexpr int kHeight = 48;
Random generator(1);

double gauss() {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) sum += generator.next() / 4294967296.0;
  return sum;
}

struct Picture {
  std::uint8_t pixels[kWidth * kHeight] = {};
  ImageU8 view() const { return packed_view(pixels, kWidth, kHeight); }
};
Picture pictures[3];

/// A scene with the noise of a camera: two grey levels.
void take(Picture& picture) {
  for (int i = 0; i < kWidth * kHeight; ++i)
    picture.pixels[i] = static_cast<std::uint8_t>(100 + i % 50 + generator.below(3));
}

void test_frozen_pictures(void**) {
  VoWatch watch;
  watch.init({});
  for (Picture& p : pictures) take(p);
  const ImageU8 a = pictures[0].view();
  const ImageU8 b = pictures[1].view();
  const ImageU8 c = pictures[2].view();
  const auto use = [&](const ImageU8& left, const ImageU8& right) {
    const WatchStatus status = watch.look(left, right);
    watch.used();
    return status;
  };
  assert_status(use(a, b), WatchStatus::kClear);
  assert_status(use(b, c), WatchStatus::kClear);
  assert_status(watch.look(b, c), WatchStatus::kFrozen);
  assert_status(use(b, c), WatchStatus::kFrozen);
  assert_status(watch.look(a, c), WatchStatus::kFrozen);  // one side is enough
  assert_status(watch.look(b, a), WatchStatus::kFrozen);
  assert_status(watch.look(c, a), WatchStatus::kClear);  // left and right are not compared
  watch.init({});
  assert_status(watch.look(b, c), WatchStatus::kClear);
}

/// A buffer that goes round: any of the last few pairs, and none farther back.
void test_old_pictures(void**) {
  static Picture row[VoWatch::kKept + 1][2];
  VoWatch watch;
  watch.init({});
  for (auto& pair : row) {
    take(pair[0]);
    take(pair[1]);
    assert_status(watch.look(pair[0].view(), pair[1].view()), WatchStatus::kClear);
    watch.used();
  }
  assert_status(watch.look(row[0][0].view(), row[0][1].view()), WatchStatus::kClear);
  for (int i = 1; i <= VoWatch::kKept; ++i)
    assert_status(watch.look(row[i][0].view(), row[i][1].view()), WatchStatus::kFrozen);
}

/// Against the last pair that VO used: one that it could not use may come again, whole.
void test_pairs_that_were_not_used(void**) {
  VoWatch watch;
  watch.init({});
  for (Picture& p : pictures) take(p);
  const ImageU8 a = pictures[0].view();
  const ImageU8 b = pictures[1].view();
  const ImageU8 c = pictures[2].view();
  assert_status(watch.look(a, b), WatchStatus::kClear);
  watch.used();
  assert_status(watch.look(ImageU8(), c), WatchStatus::kClear);
  assert_status(watch.look(b, c), WatchStatus::kClear);
  assert_status(watch.look(a, c), WatchStatus::kFrozen);  // over pairs not used, too
}

/// The sky may be white, the rover's deck black, as they were: news in any half of a picture are news.
void test_news_in_half_of_the_picture(void**) {
  const auto in_half = [](int half, int u, int v) {
    const bool first = half < 2 ? v < kHeight / 2 : u < kWidth / 2;
    return first == (half % 2 == 0);
  };
  for (int half = 0; half < 4; ++half) {  // upper, lower, left, right
    VoWatch watch;
    watch.init({});
    take(pictures[0]);
    assert_status(watch.look(pictures[0].view(), pictures[0].view()), WatchStatus::kClear);
    watch.used();
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u)
        pictures[0].pixels[v * kWidth + u] ^= static_cast<std::uint8_t>(in_half(half, u, v));
    }
    assert_status(watch.look(pictures[0].view(), pictures[0].view()), WatchStatus::kClear);
  }
}

/// A rover that stands takes pictures that differ by their noise.
void test_standing_is_not_frozen(void**) {
  VoWatch watch;
  watch.init({});
  for (int i = 0; i < 200; ++i) {
    take(pictures[0]);
    take(pictures[1]);
    assert_status(watch.look(pictures[0].view(), pictures[1].view()), WatchStatus::kClear);
    watch.used();
  }
}

void test_missing_pictures(void**) {
  VoWatch watch;
  watch.init({});
  for (int i = 0; i < 3; ++i) {
    assert_status(watch.look(ImageU8(), ImageU8()), WatchStatus::kClear);
    watch.used();
  }
}

Pose3 step_of(double x, double y, double yaw) {
  Pose3 step = lift({x, y, yaw});
  step.q = quat_from_attitude({yaw, 0.02, -0.01});
  return step;
}

void test_true_priors_pass(void**) {
  const WatchParams p;
  VoWatch watch;
  watch.init(p);
  const Mat3 V = Vec3(9e-10, 9e-10, 9e-10).asDiagonal();
  int refused = 0;
  for (int i = 0; i < 100000; ++i) {
    const double length = 0.06 + 0.02 * gauss();
    const double turn = 0.02 * gauss();
    const double s = p.watch_sigma_m + p.prior_share * std::fabs(length);
    const double w = p.watch_sigma_rad + p.prior_share * std::fabs(turn);
    const Pose3 prior = step_of(length, 0.0, turn);
    const Pose3 vo = step_of(length + s * gauss(), s * gauss(), turn + w * gauss());
    if (watch.compare(vo, V, prior) != WatchStatus::kClear) ++refused;
  }
  assert_at_most(refused, 5);
}

void test_what_contradicts(void**) {
  const WatchParams p;
  VoWatch watch;
  watch.init(p);
  const Mat3 V = Vec3(9e-10, 9e-10, 9e-10).asDiagonal();
  const Pose3 drives = step_of(0.06, 0.0, 0.0);
  const Pose3 stands;
  assert_status(watch.compare(drives, V, drives), WatchStatus::kClear);
  assert_status(watch.compare(stands, V, stands), WatchStatus::kClear);
  assert_status(watch.compare(stands, V, drives), WatchStatus::kContradicted);  // frozen, or stuck
  assert_status(watch.compare(drives, V, stands), WatchStatus::kContradicted);
  assert_status(watch.compare(step_of(-0.06, 0.0, 0.0), V, drives), WatchStatus::kContradicted);
  assert_status(watch.compare(step_of(0.0, 0.06, 0.0), V, drives), WatchStatus::kContradicted);
  assert_status(watch.compare(step_of(0.06, 0.0, 0.1), V, drives), WatchStatus::kContradicted);
  // Just within, just beyond, on each axis.
  const double s = p.watch_sigma_m + p.prior_share * 0.06;
  const double w = p.watch_sigma_rad + p.prior_share * quat_log(drives.q).norm();
  const double edge = std::sqrt(p.gate_chi2);
  for (const double k : {0.99, 1.01}) {
    const WatchStatus want = k < 1.0 ? WatchStatus::kClear : WatchStatus::kContradicted;
    assert_status(watch.compare(drives * lift({k * edge * s, 0.0, 0.0}), V, drives), want);
    assert_status(watch.compare(drives * lift({0.0, k * edge * s, 0.0}), V, drives), want);
    assert_status(watch.compare(drives * lift({0.0, 0.0, k * edge * w}), V, drives), want);
  }
  // The same with VO's own uncertainty, a standard deviation of 0.1 m and 0.1 rad.
  const Mat3 unsure = Vec3(0.01, 0.01, 0.01).asDiagonal();
  const double own = 0.1 * p.vo_sigma_factor;
  for (const double k : {0.99, 1.01}) {
    const WatchStatus want = k < 1.0 ? WatchStatus::kClear : WatchStatus::kContradicted;
    const double m = k * edge * std::sqrt(s * s + own * own);
    const double rad = k * edge * std::sqrt(w * w + own * own);
    assert_status(watch.compare(drives * lift({m, 0.0, 0.0}), unsure, drives), want);
    assert_status(watch.compare(drives * lift({0.0, 0.0, rad}), unsure, drives), want);
  }
  // A VO that says itself that it is unsure contradicts nobody.
  assert_status(watch.compare(stands, Mat3(Vec3(1e-2, 1e-2, 1e-2).asDiagonal()), drives),
                WatchStatus::kClear);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_old_pictures),
      cmocka_unit_test(test_frozen_pictures),
      cmocka_unit_test(test_pairs_that_were_not_used),
      cmocka_unit_test(test_news_in_half_of_the_picture),
      cmocka_unit_test(test_standing_is_not_frozen),
      cmocka_unit_test(test_missing_pictures),
      cmocka_unit_test(test_true_priors_pass),
      cmocka_unit_test(test_what_contradicts),
  };
  return cmocka_run_group_tests_name("localizer/vo_watch", tests, nullptr, nullptr);
}
