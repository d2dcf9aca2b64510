/// Trigonometry for flight code: own polynomials, the same bits on every target (libm's differ, and Debian's
/// PowerPC libm holds instructions that a 750 lacks). Only + - * / and sqrt; build with -ffp-contract=off.
///
/// Accuracy, tested against libm over the ranges given: absolute error at most 4e-16 for sin and cos with
/// |x| <= 1000 rad plus 1e-16 per radian of the argument, 5e-16 for atan2.
#pragma once

namespace cairn {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kRadPerDeg = kPi / 180.0;
inline constexpr double kDegPerRad = 180.0 / kPi;

struct SinCos {
  double sin;
  double cos;
};

/// Sine and cosine of `angle_rad`; finite and |angle_rad| <= 1e6, else {0, 1}.
SinCos sin_cos(double angle_rad);

/// Angle of (x, y) in (-pi, pi]; atan2(0, 0) = 0; NaN in, NaN out.
double atan2(double y, double x);

/// asin for -1 <= x <= 1 (clamped outside), by atan2.
double asin(double x);

/// The same angle in (-pi, pi]; finite and |angle_rad| <= 1e6.
double wrap_angle(double angle_rad);

}  // namespace cairn
