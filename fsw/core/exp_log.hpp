/// Exponential and natural logarithm for flight code: own series, the same bits on every target. Only
/// + - * / and the bits of a double; build with -ffp-contract=off.
///
/// Accuracy, tested against libm over the whole range: at most 2 units in the last place each (ln near 1:
/// of the result, too).
#pragma once

namespace cairn {

/// e^x. Below -708.3 it is 0 (what would be subnormal is cut), above 709.7 infinity; NaN in, NaN out.
double exp(double x);

/// Natural logarithm of x > 0. 0 and subnormals give -infinity, negative numbers NaN; infinity itself.
double ln(double x);

}  // namespace cairn
