/// CMocka for C++ tests, with what every test of this project needs.
///
/// A failed CMocka assertion leaves the test by longjmp: destructors do not run, so hold only trivially
/// destructible things (or statics) where an assertion can fail.
#pragma once

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

extern "C" {
#include <cmocka.h>
}

#include <cmath>
#include <initializer_list>

/// |actual - expected| <= tolerance, with the numbers in the message. Fails on NaN.
#define assert_near(actual, expected, tolerance)                                    \
  do {                                                                              \
    const double near_a_ = static_cast<double>(actual);                             \
    const double near_e_ = static_cast<double>(expected);                           \
    if (!(std::fabs(near_a_ - near_e_) <= static_cast<double>(tolerance))) {        \
      fail_msg("%s = %.17g, expected %.17g within %.3g", #actual, near_a_, near_e_, \
               static_cast<double>(tolerance));                                     \
    }                                                                               \
  } while (false)

/// actual <= bound, with the numbers in the message. Fails on NaN.
#define assert_at_most(actual, bound)                                                              \
  do {                                                                                             \
    const double most_a_ = static_cast<double>(actual);                                            \
    const double most_b_ = static_cast<double>(bound);                                             \
    if (!(most_a_ <= most_b_)) fail_msg("%s = %.17g, more than %.17g", #actual, most_a_, most_b_); \
  } while (false)

/// actual >= bound, with the numbers in the message. Fails on NaN.
#define assert_at_least(actual, bound)                                                                 \
  do {                                                                                                 \
    const double least_a_ = static_cast<double>(actual);                                               \
    const double least_b_ = static_cast<double>(bound);                                                \
    if (!(least_a_ >= least_b_)) fail_msg("%s = %.17g, less than %.17g", #actual, least_a_, least_b_); \
  } while (false)

/// Statuses are enum classes: compared as integers so that CMocka prints them.
#define assert_status(actual, expected) assert_int_equal(static_cast<int>(actual), static_cast<int>(expected))
