#include "core/trig.hpp"

#include <cmath>

namespace cairn {
namespace {

constexpr double kHalfPiHigh = 1.57079632679489655800e+00;  // pi/2 rounded to double
constexpr double kHalfPiLow = 6.12323399573676603587e-17;   // pi/2 - kHalfPiHigh
constexpr double kMaxAngle = 1.0e6;

/// Taylor series on |x| <= pi/4: the first term left out is below 1e-19.
double sin_kernel(double x) {
  const double x2 = x * x;
  double s = 1.0 / 355687428096000.0;
  s = -1.0 / 1307674368000.0 + x2 * s;
  s = 1.0 / 6227020800.0 + x2 * s;
  s = -1.0 / 39916800.0 + x2 * s;
  s = 1.0 / 362880.0 + x2 * s;
  s = -1.0 / 5040.0 + x2 * s;
  s = 1.0 / 120.0 + x2 * s;
  s = -1.0 / 6.0 + x2 * s;
  return x + x * (x2 * s);
}

double cos_kernel(double x) {
  const double x2 = x * x;
  double c = 1.0 / 20922789888000.0;
  c = -1.0 / 87178291200.0 + x2 * c;
  c = 1.0 / 479001600.0 + x2 * c;
  c = -1.0 / 3628800.0 + x2 * c;
  c = 1.0 / 40320.0 + x2 * c;
  c = -1.0 / 720.0 + x2 * c;
  c = 1.0 / 24.0 + x2 * c;
  c = -0.5 + x2 * c;
  return 1.0 + x2 * c;
}

/// atan on |x| <= tan(pi/12): the first term left out is below 1e-18.
double atan_kernel(double x) {
  const double x2 = x * x;
  double a = x2 * (-1.0 / 27.0);
  a = x2 * (1.0 / 25.0 + a);
  a = x2 * (-1.0 / 23.0 + a);
  a = x2 * (1.0 / 21.0 + a);
  a = x2 * (-1.0 / 19.0 + a);
  a = x2 * (1.0 / 17.0 + a);
  a = x2 * (-1.0 / 15.0 + a);
  a = x2 * (1.0 / 13.0 + a);
  a = x2 * (-1.0 / 11.0 + a);
  a = x2 * (1.0 / 9.0 + a);
  a = x2 * (-1.0 / 7.0 + a);
  a = x2 * (1.0 / 5.0 + a);
  a = x2 * (-1.0 / 3.0 + a);
  return x + x * a;
}

/// atan on 0 <= x <= 1.
double atan_unit(double x) {
  constexpr double kTanPi12 = 0.26794919243112270647;
  constexpr double kSqrt3 = 1.73205080756887729353;
  if (x <= kTanPi12) return atan_kernel(x);
  return kPi / 6.0 + atan_kernel((x * kSqrt3 - 1.0) / (x + kSqrt3));
}

}  // namespace

SinCos sin_cos(double angle_rad) {
  if (!(std::fabs(angle_rad) <= kMaxAngle)) return {0.0, 1.0};
  const double turns = angle_rad / kHalfPiHigh;
  const long quarter = static_cast<long>(turns + (turns >= 0.0 ? 0.5 : -0.5));
  const auto k = static_cast<double>(quarter);
  // kHalfPiHigh split once more, so that k * high part is exact for every quarter in range.
  constexpr double kHigh = 1.5707963267341256;     // upper 33 bits of pi/2
  constexpr double kMiddle = kHalfPiHigh - kHigh;  // exact
  const double r = ((angle_rad - k * kHigh) - k * kMiddle) - k * kHalfPiLow;
  const double s = sin_kernel(r);
  const double c = cos_kernel(r);
  switch (quarter & 3L) {
    case 0: return {s, c};
    case 1: return {c, -s};
    case 2: return {-s, -c};
    default: return {-c, s};
  }
}

double atan2(double y, double x) {
  if (!(x == x) || !(y == y)) return x + y;
  const double ax = std::fabs(x);
  const double ay = std::fabs(y);
  if (ax == 0.0 && ay == 0.0) return 0.0;
  double angle = ay <= ax ? atan_unit(ay / ax) : kHalfPiHigh - atan_unit(ax / ay);
  if (x < 0.0) angle = kPi - angle;
  return y < 0.0 ? -angle : angle;
}

double asin(double x) {
  if (x >= 1.0) return kHalfPiHigh;
  if (x <= -1.0) return -kHalfPiHigh;
  return atan2(x, std::sqrt((1.0 - x) * (1.0 + x)));
}

double wrap_angle(double angle_rad) {
  if (std::fabs(angle_rad) < 3.0) return angle_rad;  // the usual case, without a division
  if (!(std::fabs(angle_rad) <= kMaxAngle)) return angle_rad;
  const double turns = angle_rad / (2.0 * kPi);
  const long whole = static_cast<long>(turns + (turns >= 0.0 ? 0.5 : -0.5));
  double wrapped = angle_rad - static_cast<double>(whole) * (2.0 * kPi);
  if (wrapped > kPi) wrapped -= 2.0 * kPi;
  if (wrapped <= -kPi) wrapped += 2.0 * kPi;
  return wrapped;
}

}  // namespace cairn
