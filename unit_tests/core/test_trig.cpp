// Own trigonometry against the host's libm.
#include "core/trig.hpp"
#include "support/cmocka.hpp"

namespace {

void test_sin_cos_against_libm(void**) {
  for (int i = -200000; i <= 200000; ++i) {
    const double x = i * 0.00507;
    const cairn::SinCos r = cairn::sin_cos(x);
    const double bound = 4e-16 + 1e-16 * std::fabs(x);
    assert_near(r.sin, std::sin(x), bound);
    assert_near(r.cos, std::cos(x), bound);
  }
}

void test_atan2_against_libm(void**) {
  for (int i = 0; i < 3600; ++i) {
    const double a = (i - 1800) * cairn::kPi / 1800.0 + 1e-7;
    for (const double r : {1e-9, 0.3, 1.0, 5e6}) {
      const double y = r * std::sin(a);
      const double x = r * std::cos(a);
      assert_near(cairn::atan2(y, x), std::atan2(y, x), 9e-16);  // an ulp each
    }
  }
  assert_near(cairn::atan2(0.0, 0.0), 0.0, 0.0);
  assert_near(cairn::atan2(0.0, -1.0), cairn::kPi, 0.0);
  assert_true(std::isnan(cairn::atan2(NAN, 1.0)));
}

void test_wrap_and_asin(void**) {
  for (int i = -50; i <= 50; ++i) {
    const double a = 0.37 * i;
    const double w = cairn::wrap_angle(a);
    assert_true(w > -cairn::kPi && w <= cairn::kPi);
    assert_near(std::sin(w), std::sin(a), 1e-13);
    assert_near(std::cos(w), std::cos(a), 1e-13);
  }
  for (int i = -10; i <= 10; ++i)
    assert_near(cairn::asin(0.1 * i), std::asin(std::fmax(-1.0, std::fmin(1.0, 0.1 * i))), 1e-15);
  assert_near(cairn::asin(2.0), 0.5 * cairn::kPi, 0.0);
  assert_near(cairn::sin_cos(NAN).cos, 1.0, 0.0);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_sin_cos_against_libm),
      cmocka_unit_test(test_atan2_against_libm),
      cmocka_unit_test(test_wrap_and_asin),
  };
  return cmocka_run_group_tests_name("core/trig", tests, nullptr, nullptr);
}
