/// The small arithmetic that formulas are written with.
#pragma once

namespace cairn {

constexpr double square(double v) { return v * v; }
constexpr double positive(double v) { return v > 0.0 ? v : 0.0; }  ///< or 0

/// v, no further from zero than `limit` (at least 0).
constexpr double clamped(double v, double limit) { return v > limit ? limit : (v < -limit ? -limit : v); }

/// Whether low <= v <= high; false where one is NaN.
constexpr bool in_range(double v, double low, double high) { return v >= low && v <= high; }

}  // namespace cairn
