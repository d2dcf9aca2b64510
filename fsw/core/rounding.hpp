/// Rounding without a call into a mathematical library, which not every target links.
#pragma once

namespace cairn {

/// The nearest whole number, halves up: floor(x + 0.5). |x| below 2^31.
inline int rounded(double x) {
  const double up = x + 0.5;
  const int whole = static_cast<int>(up);  // towards zero
  return whole - (up < whole ? 1 : 0);
}

}  // namespace cairn
