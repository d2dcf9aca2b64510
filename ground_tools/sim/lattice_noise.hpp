/// Smooth noise on regular grids: white noise on a lattice, interpolated by cubic B-splines.
///
/// The B-spline keeps 151/315 of the variance per axis (mean over the phase), so the standard deviation is
/// known and no normalisation over the drawn field is needed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sim/hash_random.hpp"

namespace cairn::ground::sim {

struct NoiseOctave {
  std::uint64_t seed = 0;
  Stream stream = Stream::kRelief;
  std::uint64_t number = 0;  ///< of the octave in its stream
  double wavelength = 1.0;   ///< two lattice cells, in the unit of the grid's spacing
  double deviation = 1.0;    ///< standard deviation
  std::uint64_t period = 0;  ///< lattice cells after which it repeats; 0: never
};

/// Adds the octave to `field` (row-major, `width` x `height` samples at `spacing`, the first at (x0, y0)).
void add_noise(const NoiseOctave& octave, double x0, double y0, double spacing, std::size_t width,
               std::size_t height, std::vector<float>& field);

}  // namespace cairn::ground::sim
