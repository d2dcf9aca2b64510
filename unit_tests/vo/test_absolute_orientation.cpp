// Absolute orientation: exact recovery, Eigen's closed form by singular values, and what does not
// fix a rotation.
#include "vo/absolute_orientation.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "support/cmocka.hpp"
#include "support/noise.hpp"

using namespace cairn;

namespace {

constexpr std::size_t kMost = 50;
Vec3 from[kMost];
Vec3 to[kMost];

Vec3 random_vector(Random& random, double size) {
  return {test::uniform(random, -size, size), test::uniform(random, -size, size),
          test::uniform(random, -size, size)};
}

Pose3 random_pose(Random& random, double angle_rad) {
  return {quat_exp(random_vector(random, 1.0).normalized() * angle_rad), random_vector(random, 5.0)};
}

double angle_between(const Quat& a, const Quat& b) { return quat_log(a.conjugate() * b).norm(); }

void test_exact_recovery(void**) {
  Random random(1);
  for (const double angle : {0.0, 1e-9, 0.01, 1.0, 3.1, kPi}) {
    for (const std::size_t count : {3U, 4U, 50U}) {
      const Pose3 truth = random_pose(random, angle);
      for (std::size_t i = 0; i < count; ++i) {
        from[i] = random_vector(random, 3.0);
        to[i] = truth * from[i];
      }
      Pose3 T;
      assert_status(absolute_orientation(from, to, count, T), OrientationStatus::kSolved);
      assert_at_most(angle_between(T.q, truth.q), 1e-12);
      assert_at_most((T.t - truth.t).norm(), 1e-11);
      assert_true(is_valid(T));
    }
  }
}

void test_equals_umeyama_on_noisy_points(void**) {
  Random random(2);
  for (int k = 0; k < 300; ++k) {
    const std::size_t count = 3 + random.below(20);
    const Pose3 truth = random_pose(random, test::uniform(random, 0.0, kPi));
    Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMost> a(3, count);
    Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMost> b(3, count);
    for (std::size_t i = 0; i < count; ++i) {
      from[i] = random_vector(random, 3.0);
      to[i] = truth * from[i] + 0.1 * Vec3(test::normal(random), test::normal(random), test::normal(random));
      a.col(static_cast<Eigen::Index>(i)) = from[i];
      b.col(static_cast<Eigen::Index>(i)) = to[i];
    }
    const Eigen::Matrix<double, 4, 4> expected = Eigen::umeyama(a, b, false);
    Pose3 T;
    assert_status(absolute_orientation(from, to, count, T), OrientationStatus::kSolved);
    assert_at_most((T.q.toRotationMatrix() - expected.topLeftCorner<3, 3>()).norm(), 1e-9);
    assert_at_most((T.t - expected.topRightCorner<3, 1>()).norm(), 1e-8);
  }
}

void test_a_plane_is_enough_and_never_mirrored(void**) {
  Random random(3);
  const Pose3 truth = random_pose(random, 2.0);
  for (std::size_t i = 0; i < 10; ++i) {
    from[i] = random_vector(random, 2.0);
    from[i].z() = 1.0;
    to[i] = truth * from[i];
  }
  Pose3 T;
  assert_status(absolute_orientation(from, to, 10, T), OrientationStatus::kSolved);
  assert_at_most(angle_between(T.q, truth.q), 1e-12);
  for (std::size_t i = 0; i < 10; ++i) {  // a mirror image of a body: the best rotation, not the mirror
    from[i] = random_vector(random, 2.0);
    to[i] = Vec3(from[i].x(), from[i].y(), -0.3 * from[i].z());
  }
  assert_status(absolute_orientation(from, to, 10, T), OrientationStatus::kSolved);
  assert_near(T.q.toRotationMatrix().determinant(), 1.0, 1e-12);
}

void test_too_few(void**) {
  Pose3 T;
  for (const std::size_t count : {0U, 1U, 2U}) {
    assert_status(absolute_orientation(from, to, count, T), OrientationStatus::kTooFewPoints);
  }
}

void test_degenerate(void**) {
  Random random(4);
  const Pose3 truth = random_pose(random, 1.0);
  Pose3 T;
  const Vec3 along = random_vector(random, 1.0).normalized();
  for (std::size_t i = 0; i < 8; ++i) {
    from[i] = Vec3(1.0, 2.0, 3.0) + along * static_cast<double>(i);
    to[i] = truth * from[i];
  }
  assert_status(absolute_orientation(from, to, 8, T), OrientationStatus::kDegenerate);  // on a line
  from[3] += Vec3(0.0, 0.01, 0.0);                                                      // a centimetre off it
  to[3] = truth * from[3];
  assert_status(absolute_orientation(from, to, 8, T), OrientationStatus::kSolved);
  assert_at_most(angle_between(T.q, truth.q), 1e-8);
  for (std::size_t i = 0; i < 8; ++i) from[i] = to[i] = Vec3(1.0, 1.0, 1.0);
  assert_status(absolute_orientation(from, to, 8, T), OrientationStatus::kDegenerate);  // in one place
  from[2].x() = NAN;
  assert_status(absolute_orientation(from, to, 8, T), OrientationStatus::kDegenerate);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_exact_recovery),
      cmocka_unit_test(test_equals_umeyama_on_noisy_points),
      cmocka_unit_test(test_a_plane_is_enough_and_never_mirrored),
      cmocka_unit_test(test_too_few),
      cmocka_unit_test(test_degenerate),
  };
  return cmocka_run_group_tests_name("absolute_orientation", tests, nullptr, nullptr);
}
