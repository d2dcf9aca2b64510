/// Medians and shares with their 95 % confidence intervals.
#pragma once

#include <cstddef>
#include <vector>

namespace cairn::ground {

struct Interval {
  double low = 0.0;
  double high = 0.0;
};

/// A share of `n` independent cases after Wilson (JASA 22, 1927): it stays in 0 .. 1 and has a length where
/// no case or every case counts. n = 0: 0 .. 1. Asks for hits <= n.
Interval wilson(std::size_t hits, std::size_t n);

/// The middle value, or the mean of the two in the middle; NaN of none. Values must not be NaN.
double median(std::vector<double> values);

struct Median {
  double value = 0.0;
  Interval interval;
  std::size_t n = 0;
};

/// The median, and between which order statistics that of the population lies: no assumption on how values
/// are spread (David and Nagaraja, Order Statistics, 7.1). The interval holds it with 95 % or more; of fewer
/// than 6 values it is their range, which holds it with 1 - 2^(1 - n). NaNs are left out;
/// without a value all is NaN.
Median median_of(std::vector<double> values);

}  // namespace cairn::ground
