// The ranges of commanded numbers at their corners; each status reached; what is good passes unchanged.
#include "app/command_content.hpp"

#include <cmath>
#include <limits>

#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::app;

namespace {

using Limits = std::numeric_limits<double>;
constexpr double kBeyond = 1.0 + 1e-12;

Command start() {
  Command c;
  c.type = CommandType::kSetStart;
  c.pose = {quat_from_attitude({2.0, 0.1, -0.2}), Vec3(431200.25, -4.1e6, -2650.0)};
  c.number = {0.05, 0.01};
  return c;
}
Command prior() {
  Command c;
  c.type = CommandType::kMotionPrior;
  c.pose = {quat_exp(Vec3(0.01, -0.1, 0.02)), Vec3(0.1, 0.0, 0.04)};
  return c;
}
Command trim() {
  Command c;
  c.type = CommandType::kSetTrim;
  c.number = {1.02, -0.001};
  return c;
}

Command attitude() {
  Command c;
  c.type = CommandType::kAttitude;
  c.attitude = {{0.6, 0.0, 0.8}, 0.003, -2.0, 0.004};
  return c;
}

/// Number `i` of a pose: x, y, z, then the quaternion.
double& number(Pose3& pose, int i) { return i < 3 ? pose.t[i] : pose.q.coeffs()[i - 3]; }

template <typename Change>
void check(Command command, ContentStatus expected, Change change) {
  change(command);
  assert_status(judge_content(command), expected);
}

void test_what_is_good_passes_unchanged(void**) {
  for (const Command& good : {start(), prior(), trim(), attitude(), Command()}) {
    Command c = good;
    assert_status(judge_content(c), ContentStatus::kGood);
    assert_true(c.pose.t == good.pose.t);
    assert_true(c.pose.q.coeffs() == good.pose.q.coeffs());
    assert_true(c.number == good.number);
  }
}

void test_numbers_that_are_none(void**) {
  const double least = Limits::denorm_min();
  for (const double bad :
       {Limits::quiet_NaN(), Limits::infinity(), -Limits::infinity(), least, -least, Limits::min() * 0.5}) {
    const ContentStatus expected = std::isfinite(bad) ? ContentStatus::kSubnormal : ContentStatus::kNotFinite;
    for (int i = 0; i < 7; ++i) {
      check(start(), expected, [&](Command& c) { number(c.pose, i) = bad; });
      check(prior(), expected, [&](Command& c) { number(c.pose, i) = bad; });
    }
    for (int i = 0; i < 6; ++i) {
      check(attitude(), expected, [&](Command& c) {
        MeasuredAttitude& a = c.attitude;
        (i < 3 ? a.up_rover[i % 3] : i == 3 ? a.sigma_tilt_rad : i == 4 ? a.yaw_rad : a.sigma_yaw_rad) = bad;
      });
    }
    for (int i = 0; i < 2; ++i) {
      check(start(), expected, [&](Command& c) { c.number[i] = bad; });
      check(trim(), expected, [&](Command& c) { c.number[i] = bad; });
    }
  }
  for (const double zero : {0.0, -0.0, Limits::min()})
    check(start(), ContentStatus::kGood, [&](Command& c) { c.pose.t.z() = zero; });
}

void test_places(void**) {
  for (const double sign : {-1.0, 1.0}) {
    for (int i = 0; i < 3; ++i) {
      const double most = i < 2 ? kMaxStartPosition_m : kMaxStartHeight_m;
      const ContentStatus expected = i < 2 ? ContentStatus::kPosition : ContentStatus::kHeight;
      check(start(), ContentStatus::kGood, [&](Command& c) { c.pose.t[i] = sign * most; });
      check(start(), expected, [&](Command& c) { c.pose.t[i] = sign * most * kBeyond; });
      check(start(), expected, [&](Command& c) { c.pose.t[i] = sign * 1e200; });
    }
  }
}

/// Within a thousandth it is made a rotation, the same one; beyond it is refused.
void test_quaternions(void**) {
  for (const double length : {0.9991, 0.99999, 1.00001, 1.0009}) {
    Command c = start();
    c.pose.q.coeffs() *= length;
    assert_status(judge_content(c), ContentStatus::kGood);
    assert_true(is_valid(c.pose));
    assert_at_most((c.pose.q.coeffs() - start().pose.q.coeffs()).norm(), 1e-5);
  }
  for (const double length : {0.0, 1e-200, 0.9989, 1.0011, 3.0, 1e200}) {
    check(start(), ContentStatus::kQuaternion, [&](Command& c) { c.pose.q.coeffs() *= length; });
    check(prior(), ContentStatus::kQuaternion, [&](Command& c) { c.pose.q.coeffs() *= length; });
  }
}

void check_range(const Command& good, int i, const Range& range, ContentStatus beyond) {
  const double step = 1e-12 * (range.most - range.least);
  for (const double v : {range.least, 0.5 * (range.least + range.most), range.most})
    check(good, ContentStatus::kGood, [&](Command& c) { c.number[i] = v; });
  for (const double v : {range.least - step, range.most + step, 1e160, -1e160})
    check(good, beyond, [&](Command& c) { c.number[i] = v; });
}

void test_deviations_and_trims(void**) {
  check_range(start(), 0, kStartSigmaXy_m, ContentStatus::kSigmaXy);
  check_range(start(), 1, kStartSigmaYaw_rad, ContentStatus::kSigmaYaw);
  check_range(trim(), 0, kTrimScale, ContentStatus::kScale);
  check_range(trim(), 1, kTrimTurn_rad_per_m, ContentStatus::kTurn);
  for (const double v : {0.0, 1e-9, -0.05}) {
    check(start(), ContentStatus::kSigmaXy, [&](Command& c) { c.number[0] = v; });
    check(start(), ContentStatus::kSigmaYaw, [&](Command& c) { c.number[1] = v; });
  }
}

void test_steps(void**) {
  for (const double sign : {-1.0, 1.0}) {
    for (int i = 0; i < 3; ++i) {
      const auto step = [&](double m) {
        return [=](Command& c) {
          c.pose.t.setZero();
          c.pose.t[i] = sign * m;
        };
      };
      check(prior(), ContentStatus::kGood, step(kMaxPriorStep_m));
      check(prior(), ContentStatus::kStep, step(kMaxPriorStep_m * kBeyond));
      check(prior(), ContentStatus::kStep, step(1e200));
      const auto turn = [&](double rad) {
        return [=](Command& c) {
          Vec3 w_rad = Vec3(0.0, 0.0, 0.0);
          w_rad[i] = sign * rad;
          c.pose.q = quat_exp(w_rad);
        };
      };
      if (kMaxPriorRotation_rad >= kPi) continue;  // no rotation is larger
      check(prior(), ContentStatus::kGood, turn(kMaxPriorRotation_rad - 1e-6));
      check(prior(), ContentStatus::kRotation, turn(kMaxPriorRotation_rad + 1e-6));
      check(prior(), ContentStatus::kRotation, turn(kPi));
    }
  }
  // Each way is within, all three together are not.
  const double most = kMaxPriorStep_m;
  check(prior(), ContentStatus::kStep, [&](Command& c) { c.pose.t = Vec3(most, -most, most); });
}

/// Each part by itself; one that was not measured is not judged but for numbers that are none.
void test_attitudes(void**) {
  const auto sigma_range = [](double MeasuredAttitude::*sigma, ContentStatus beyond) {
    for (const double v : {kAttitudeSigma_rad.least, 0.01, kAttitudeSigma_rad.most, 0.0})
      check(attitude(), ContentStatus::kGood, [&](Command& c) { c.attitude.*sigma = v; });
    for (const double v :
         {kAttitudeSigma_rad.least / kBeyond, kAttitudeSigma_rad.most * kBeyond, -0.01, 1e200})
      check(attitude(), beyond, [&](Command& c) { c.attitude.*sigma = v; });
  };
  sigma_range(&MeasuredAttitude::sigma_tilt_rad, ContentStatus::kSigmaTilt);
  sigma_range(&MeasuredAttitude::sigma_yaw_rad, ContentStatus::kSigmaYaw);
  for (const double length : {0.9901, 1.0099})
    check(attitude(), ContentStatus::kGood, [&](Command& c) {
      for (double& v : c.attitude.up_rover) v *= length;
    });
  for (const double length : {0.0, 0.9899, 1.0101, 9.81, 1e200}) {
    const auto longer = [&](Command& c) {
      for (double& v : c.attitude.up_rover) v *= length;
    };
    check(attitude(), ContentStatus::kUp, longer);
    check(attitude(), ContentStatus::kGood, [&](Command& c) {
      longer(c);
      c.attitude.sigma_tilt_rad = 0.0;
    });
  }
  for (const double yaw : {-2.0 * kPi, 2.0 * kPi})
    check(attitude(), ContentStatus::kGood, [&](Command& c) { c.attitude.yaw_rad = yaw; });
  for (const double yaw : {-2.0 * kPi * kBeyond, 2.0 * kPi * kBeyond, 90.0}) {
    check(attitude(), ContentStatus::kHeading, [&](Command& c) { c.attitude.yaw_rad = yaw; });
    check(attitude(), ContentStatus::kGood, [&](Command& c) {
      c.attitude.yaw_rad = yaw;
      c.attitude.sigma_yaw_rad = 0.0;
    });
  }
  check(attitude(), ContentStatus::kNothing,
        [](Command& c) { c.attitude.sigma_tilt_rad = c.attitude.sigma_yaw_rad = 0.0; });
}

void test_pairs(void**) {
  for (const std::uint32_t last : {0U, 1U, 500U, 0x7FFFFFFFU, 0xFFFFFFFFU}) {
    assert_status(judge_pair(last + 1U, last), ContentStatus::kGood);
    assert_status(judge_pair(last + kMaxPairsAhead, last), ContentStatus::kGood);
    assert_status(judge_pair(last + kMaxPairsAhead + 1U, last), ContentStatus::kPairFar);
    assert_status(judge_pair(last + 0x7FFFFFFFU, last), ContentStatus::kPairFar);
    assert_status(judge_pair(last, last), ContentStatus::kPairGone);
    assert_status(judge_pair(last - 1U, last), ContentStatus::kPairGone);
    assert_status(judge_pair(last - 0x80000000U, last), ContentStatus::kPairGone);
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_what_is_good_passes_unchanged),
      cmocka_unit_test(test_numbers_that_are_none),
      cmocka_unit_test(test_places),
      cmocka_unit_test(test_quaternions),
      cmocka_unit_test(test_deviations_and_trims),
      cmocka_unit_test(test_steps),
      cmocka_unit_test(test_attitudes),
      cmocka_unit_test(test_pairs),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
