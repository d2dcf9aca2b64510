#include "sim/lattice_noise.hpp"

#include <array>
#include <cmath>

namespace cairn::ground::sim {
namespace {

/// Standard deviation that interpolation leaves of unit white noise, over both axes.
constexpr double kKept = 151.0 / 315.0;

std::array<float, 4> spline(double t) {
  const double s = 1.0 - t;
  return {
      static_cast<float>(s * s * s / 6.0), static_cast<float>((3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0),
      static_cast<float>((3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0), static_cast<float>(t * t * t / 6.0)};
}

struct Axis {
  std::int64_t first = 0;  ///< lattice index of the first of the four
  std::array<float, 4> weight{};
};

Axis locate(double x, double cell) {
  const double at = x / cell;
  const double floor = std::floor(at);
  return {static_cast<std::int64_t>(floor) - 1, spline(at - floor)};
}

}  // namespace

void add_noise(const NoiseOctave& octave, double x0, double y0, double spacing, std::size_t width,
               std::size_t height, std::vector<float>& field) {
  const double cell = 0.5 * octave.wavelength;
  std::vector<Axis> columns(width);
  for (std::size_t i = 0; i < width; ++i) columns[i] = locate(x0 + spacing * static_cast<double>(i), cell);
  const std::int64_t low = columns.front().first;
  const auto across = static_cast<std::size_t>(columns.back().first + 4 - low);
  const auto wrapped = [&](std::int64_t i) {
    const auto n = static_cast<std::int64_t>(octave.period);
    return static_cast<std::uint64_t>(n == 0 ? i : ((i % n) + n) % n);
  };
  const double gain = octave.deviation / kKept;
  const std::uint64_t seed = hash(octave.seed, octave.stream, octave.number);
  std::vector<std::vector<float>> rows(4, std::vector<float>(across));
  std::vector<float> blend(across);
  std::int64_t held = INT64_MIN;
  for (std::size_t j = 0; j < height; ++j) {
    const Axis row = locate(y0 + spacing * static_cast<double>(j), cell);
    if (row.first != held) {
      for (std::size_t k = 0; k < 4; ++k) {
        for (std::size_t i = 0; i < across; ++i) {
          rows[k][i] = static_cast<float>(gain * normal(seed, octave.stream,
                                                        wrapped(low + static_cast<std::int64_t>(i)),
                                                        wrapped(row.first + static_cast<std::int64_t>(k))));
        }
      }
      held = row.first;
    }
    for (std::size_t i = 0; i < across; ++i) {
      blend[i] = row.weight[0] * rows[0][i] + row.weight[1] * rows[1][i] + row.weight[2] * rows[2][i] +
                 row.weight[3] * rows[3][i];
    }
    float* out = field.data() + j * width;
    for (std::size_t i = 0; i < width; ++i) {
      const float* b = blend.data() + (columns[i].first - low);
      const std::array<float, 4>& w = columns[i].weight;
      out[i] += w[0] * b[0] + w[1] * b[1] + w[2] * b[2] + w[3] * b[3];
    }
  }
}

}  // namespace cairn::ground::sim
