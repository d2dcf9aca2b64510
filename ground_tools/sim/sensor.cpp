#include "sim/sensor.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/assert.hpp"
#include "sim/hash_random.hpp"

namespace cairn::ground::sim {
namespace {

using Kernel = std::vector<float>;  // of the centre and one side

Kernel gaussian(double sigma_px) {
  const int radius = static_cast<int>(std::ceil(3.0 * sigma_px));
  Kernel kernel(static_cast<std::size_t>(radius) + 1, 1.0F);
  double sum = 1.0;
  for (int i = 1; i <= radius; ++i) {
    const double weight = std::exp(-0.5 * i * i / (sigma_px * sigma_px));
    kernel[static_cast<std::size_t>(i)] = static_cast<float>(weight);
    sum += 2.0 * weight;
  }
  for (float& weight : kernel) weight /= static_cast<float>(sum);
  return kernel;
}

/// out += weight (a + b), one row.
void add_rows(const float* a, const float* b, float weight, int width, float* out) {
  for (int x = 0; x < width; ++x) out[x] += weight * (a[x] + b[x]);
}

/// Blurs rows. What is no radiance becomes 0 on the way.
void blur_along_rows(const FloatImage& in, const Kernel& kernel, FloatImage& out) {
  const int w = in.width;
  const int radius = static_cast<int>(kernel.size()) - 1;
  std::vector<float> padded(static_cast<std::size_t>(w + 2 * radius));
  float* const middle = padded.data() + radius;
  for (int y = 0; y < in.height; ++y) {
    const float* const from = in.pixels.data() + static_cast<std::ptrdiff_t>(y) * w;
    float* const to = out.pixels.data() + static_cast<std::ptrdiff_t>(y) * w;
    for (int x = 0; x < w; ++x) middle[x] = from[x] > 0.0F ? from[x] : 0.0F;
    std::fill(padded.data(), middle, middle[0]);
    std::fill(middle + w, middle + w + radius, middle[w - 1]);
    for (int x = 0; x < w; ++x) to[x] = kernel[0] * middle[x];
    for (int i = 1; i <= radius; ++i) {
      add_rows(middle - i, middle + i, kernel[static_cast<std::size_t>(i)], w, to);
    }
  }
}

void blur_along_columns(const FloatImage& in, const Kernel& kernel, FloatImage& out) {
  const int w = in.width;
  const int radius = static_cast<int>(kernel.size()) - 1;
  const auto row = [&in, w](int y) {
    return in.pixels.data() + static_cast<std::ptrdiff_t>(std::clamp(y, 0, in.height - 1)) * w;
  };
  for (int y = 0; y < in.height; ++y) {
    float* const to = out.pixels.data() + static_cast<std::ptrdiff_t>(y) * w;
    for (int x = 0; x < w; ++x) to[x] = kernel[0] * row(y)[x];
    for (int i = 1; i <= radius; ++i) {
      add_rows(row(y - i), row(y + i), kernel[static_cast<std::size_t>(i)], w, to);
    }
  }
}

/// Grains on the optics, out of focus: each takes up to 20 % of the radiance in a disc of 0.4 to 2 %
/// of the image's width.
void add_dust(int spots, std::uint64_t seed, Side side, FloatImage& image) {
  for (int n = 0; n < spots; ++n) {
    Draw draw(seed, Stream::kDust, static_cast<std::uint64_t>(side), static_cast<std::uint64_t>(n));
    const double u = draw.uniform(0.0, image.width - 1.0);
    const double v = draw.uniform(0.0, image.height - 1.0);
    const double radius = std::max(1.5, image.width * draw.uniform(0.004, 0.02));
    const double depth = draw.uniform(0.05, 0.2);
    const int x0 = std::max(0, static_cast<int>(std::ceil(u - radius)));
    const int x1 = std::min(image.width - 1, static_cast<int>(std::floor(u + radius)));
    const int y0 = std::max(0, static_cast<int>(std::ceil(v - radius)));
    const int y1 = std::min(image.height - 1, static_cast<int>(std::floor(v + radius)));
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        const double inside =
            std::max(0.0, 1.0 - ((x - u) * (x - u) + (y - v) * (y - v)) / (radius * radius));
        image.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                     static_cast<std::size_t>(x)] *= static_cast<float>(1.0 - depth * inside * inside);
      }
    }
  }
}

constexpr int kNormalBits = 12;
using NormalTable = std::array<float, std::size_t{1} << kNormalBits>;

/// Normal deviates of equal probability; the sum of two, drawn apart, has variance 1 and is smooth.
NormalTable make_normals() {
  NormalTable table{};
  const int half = static_cast<int>(table.size()) / 2;
  double square = 0.0;
  for (int i = 0; i < half; ++i) {
    const double tail = (half - i - 0.5) / static_cast<double>(table.size());  // above the deviate
    double low = 0.0;
    double high = 8.0;
    for (int n = 0; n < 60; ++n) {
      const double z = 0.5 * (low + high);
      (0.5 * std::erfc(z * 0.7071067811865476) > tail ? low : high) = z;
    }
    table[static_cast<std::size_t>(half + i)] = static_cast<float>(low);
    table[static_cast<std::size_t>(half - 1 - i)] = static_cast<float>(-low);
    square += 2.0 * low * low;
  }
  const double scale = std::sqrt(0.5 * static_cast<double>(table.size()) / square);
  for (float& z : table) z *= static_cast<float>(scale);
  return table;
}

struct Transfer {
  float dn2_per_radiance;  ///< DN^2 in the image's centre
  float vignetting_per_px2;
  float noise_dn;
};

/// One row: vignetting, square root, noise, rounding. The noise of a row is a SplitMix64 sequence.
void digitise_row(const float* radiance, int width, int y, int height, const Transfer& how,
                  std::uint64_t row_key, std::uint8_t* out) {
  static const NormalTable normals = make_normals();
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kNormalBits) - 1;
  const float cx = 0.5F * static_cast<float>(width - 1);
  const float dy = static_cast<float>(y) - 0.5F * static_cast<float>(height - 1);
  for (int x = 0; x < width; ++x) {
    const float dx = static_cast<float>(x) - cx;
    const float seen = 1.0F - how.vignetting_per_px2 * (dx * dx + dy * dy);
    const std::uint64_t bits = mix(row_key + static_cast<std::uint64_t>(x + 1) * 0x9E3779B97F4A7C15ULL);
    const float z = normals[bits & kMask] + normals[(bits >> 32U) & kMask];
    const float dn = std::sqrt(radiance[x] * seen * how.dn2_per_radiance) + how.noise_dn * z;
    out[x] = static_cast<std::uint8_t>(std::min(255.0F, std::max(0.0F, dn)) + 0.5F);
  }
}

}  // namespace

double exposure_gain(const Camera& camera, std::uint64_t seed, int frame) {
  for (int n = camera.exposure_step_probability > 0.0 ? frame : -1; n >= 0; --n) {
    Draw draw(seed, Stream::kExposure, static_cast<std::uint64_t>(n));
    if (draw.uniform() < camera.exposure_step_probability) {
      return 1.0 + draw.uniform(-camera.exposure_step_size, camera.exposure_step_size);
    }
  }
  return 1.0;
}

void expose(const FloatImage& radiance, const Camera& camera, std::uint64_t seed, int frame, Side side,
            Image& out) {
  const int w = radiance.width;
  const int h = radiance.height;
  CAIRN_ASSERT(w > 0 && h > 0 && frame >= 0);
  CAIRN_ASSERT(radiance.pixels.size() == static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
  const Kernel kernel = gaussian(camera.blur_px);
  FloatImage rows{w, h, std::vector<float>(radiance.pixels.size())};
  FloatImage image{w, h, std::vector<float>(radiance.pixels.size())};
  blur_along_rows(radiance, kernel, rows);
  blur_along_columns(rows, kernel, image);
  add_dust(camera.dust_spots, seed, side, image);

  const double corner_px2 = 0.25 * ((w - 1.0) * (w - 1.0) + (h - 1.0) * (h - 1.0));
  const Transfer how{
      static_cast<float>(exposure_gain(camera, seed, frame) * 255.0 * 255.0 / camera.white_radiance),
      static_cast<float>(camera.vignetting / std::max(corner_px2, 1.0)), static_cast<float>(camera.noise_dn)};
  const std::uint64_t key =
      hash(seed, Stream::kNoise, static_cast<std::uint64_t>(frame), static_cast<std::uint64_t>(side));
  out.width = w;
  out.height = h;
  out.pixels.resize(radiance.pixels.size());
  for (int y = 0; y < h; ++y) {
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(y) * w;
    digitise_row(image.pixels.data() + at, w, y, h, how, chain(key, static_cast<std::uint64_t>(y)),
                 out.pixels.data() + at);
  }
}

}  // namespace cairn::ground::sim
