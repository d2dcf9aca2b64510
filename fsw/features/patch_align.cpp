#include "features/patch_align.hpp"

#include <cmath>

namespace cairn {
namespace {

constexpr int kHalves = 2;
constexpr int kWeightBits = 13;
constexpr int kSampleBits = 14;  // grey levels x 64: three sums of them fit 32 bits

/// Column of a row's first sample of a half, and the one behind its last.
constexpr int first_of(int j, int half) {
  const int rim = kPatchRadius - kPatchHalfWidth[j];
  return rim + (rim + j + half) % 2;
}
constexpr int end_of(int j) { return kPatchRadius + kPatchHalfWidth[j] + 1; }

constexpr int samples_of(int half) {
  int n = 0;
  for (int j = 0; j < kPatchSide; ++j) n += (end_of(j) - first_of(j, half) + 1) / 2;
  return n;
}
constexpr int kSamplesOf[kHalves] = {samples_of(0), samples_of(1)};
static_assert(kSamplesOf[0] + kSamplesOf[1] == kPatchSamples, "each sample is in one half");

/// 1 - r^2/45: the rim still counts. Half by half, row by row; each half sums to 2^12.
struct Window {
  std::int32_t weight[kPatchSamples] = {};
};

constexpr Window make_window() {
  Window w;
  for (int half = 0, k = 0; half < kHalves; ++half) {
    double value[kPatchSamples] = {};
    double sum = 0.0;
    const int first = k;
    for (int j = 0; j < kPatchSide; ++j) {
      for (int i = first_of(j, half); i < end_of(j); i += 2, ++k) {
        const int x = i - kPatchRadius;
        const int y = j - kPatchRadius;
        value[k] = 1.0 - (x * x + y * y) / 45.0;
        sum += value[k];
      }
    }
    std::int32_t total = 0;
    for (int n = first; n < k; ++n) {
      w.weight[n] = static_cast<std::int32_t>((1 << (kWeightBits - 1)) * value[n] / sum + 0.5);
      total += w.weight[n];
    }
    w.weight[first + (k - first) / 2] += (1 << (kWeightBits - 1)) - total;  // at the patch's centre
  }
  return w;
}

constexpr Window kWindow = make_window();
// Mean squared gradient in the weaker direction: 0.08 grey levels a pixel.
constexpr float kMinEigen = 400.0F;

/// The template's samples as integers, half by half: values above that of the centre,
/// and differences across two pixels.
struct Cut {
  std::int32_t value[kPatchSamples];
  std::int32_t gu[kPatchSamples];
  std::int32_t gv[kPatchSamples];
};

/// Weighted sums of one half of a cut, and all bits of all magnitudes.
struct CutSums {
  std::int32_t value[kHalves] = {};
  std::int32_t gu[kHalves] = {};
  std::int32_t gv[kHalves] = {};
  std::uint32_t value_bits = 0;
  std::uint32_t gu_bits = 0;
  std::uint32_t gv_bits = 0;
};

std::uint32_t bits_of(std::int32_t v) {
  return static_cast<std::uint32_t>(v ^ -static_cast<std::int32_t>(v < 0));
}

void cut_samples(const SmoothImage& image, int iu, int iv, Cut& cut, CutSums& sums) {
  const std::int32_t origin = image.row(iv)[iu];
  for (int half = 0, k = 0; half < kHalves; ++half) {
    std::int32_t value = 0;
    std::int32_t gu = 0;
    std::int32_t gv = 0;
    for (int j = 0; j < kPatchSide; ++j) {
      const std::uint16_t* p = image.row(iv - kPatchRadius + j) + (iu - kPatchRadius);
      const std::uint16_t* above = p - image.stride;
      const std::uint16_t* below = p + image.stride;
      for (int i = first_of(j, half); i < end_of(j); i += 2, ++k) {
        const std::int32_t w = kWindow.weight[k];
        const std::int32_t x = p[i] - origin;
        const std::int32_t xu = p[i + 1] - p[i - 1];
        const std::int32_t xv = below[i] - above[i];
        cut.value[k] = x;
        cut.gu[k] = xu;
        cut.gv[k] = xv;
        value += w * x;
        gu += w * xu;
        gv += w * xv;
        sums.value_bits |= bits_of(x);
        sums.gu_bits |= bits_of(xu);
        sums.gv_bits |= bits_of(xv);
      }
    }
    sums.value[half] = value;
    sums.gu[half] = gu;
    sums.gv[half] = gv;
  }
}

/// Shift by which weighted samples, once their mean is off, become weights whose magnitudes sum
/// to at most 2^16.
int shift_for(std::uint32_t any) {
  int bits = 1;
  while ((any >> bits) != 0) ++bits;
  return bits > 2 ? bits - 2 : 0;
}

/// Sums over one half of a template, which add up to those of the whole.
struct Sums {
  std::int32_t gain = 0;
  std::int32_t u = 0;
  std::int32_t v = 0;
  std::int32_t uu = 0;
  std::int32_t uv = 0;
  std::int32_t vu = 0;
  std::int32_t vv = 0;

  void add(std::int32_t w_gain, std::int32_t w_u, std::int32_t w_v, std::int32_t value, std::int32_t du,
           std::int32_t dv) {
    gain += w_gain * value;
    u += w_u * value;
    v += w_v * value;
    uu += w_u * du;
    uv += w_u * dv;
    vu += w_v * du;
    vv += w_v * dv;
  }
};

void weigh_half(const Cut& cut, const CutSums& means, int half, const int (&shift)[3],
                PatchTemplate::Weights* out, Sums& sums) {
  const int first = half == 0 ? 0 : kSamplesOf[0];
  const int end = first + kSamplesOf[half];
  const std::int32_t mean = means.value[half] >> (kWeightBits - 1);
  const std::int32_t mean_u = means.gu[half] >> (kWeightBits - 1);
  const std::int32_t mean_v = means.gv[half] >> (kWeightBits - 1);
  const std::int32_t round[3] = {(1 << shift[0]) >> 1, (1 << shift[1]) >> 1, (1 << shift[2]) >> 1};
  std::int32_t over = 0;
  std::int32_t over_u = 0;
  std::int32_t over_v = 0;
  Sums s = sums;
  for (int k = first; k < end; ++k) {
    const std::int32_t w = kWindow.weight[k];
    const std::int32_t x = cut.value[k] - mean;
    const std::int32_t xu = cut.gu[k] - mean_u;
    const std::int32_t xv = cut.gv[k] - mean_v;
    const std::int32_t c = (w * x + round[0]) >> shift[0];
    const std::int32_t cu = (w * xu + round[1]) >> shift[1];
    const std::int32_t cv = (w * xv + round[2]) >> shift[2];
    out[k] = {static_cast<std::int16_t>(c), static_cast<std::int16_t>(cu), static_cast<std::int16_t>(cv)};
    over += c;
    over_u += cu;
    over_v += cv;
    s.add(c, cu, cv, x >> 2, xu >> 2, xv >> 2);
  }
  // What rounding leaves of the sums goes to the middle: an offset of brightness then drops out exactly.
  const int k = first + kSamplesOf[half] / 2;
  s.add(-over, -over_u, -over_v, (cut.value[k] - mean) >> 2, (cut.gu[k] - mean_u) >> 2,
        (cut.gv[k] - mean_v) >> 2);
  out[k].gain = static_cast<std::int16_t>(out[k].gain - over);
  out[k].u = static_cast<std::int16_t>(out[k].u - over_u);
  out[k].v = static_cast<std::int16_t>(out[k].v - over_v);
  sums = s;
}

/// Gradients of `s` are differences across two pixels: twice the gradient.
PatchTemplate::Solution solve(const Sums& s) {
  const float uu = 0.5F * static_cast<float>(s.uu);
  const float uv = 0.5F * static_cast<float>(s.uv);
  const float vu = 0.5F * static_cast<float>(s.vu);
  const float vv = 0.5F * static_cast<float>(s.vv);
  const float inverse = 1.0F / (uu * vv - uv * vu);
  return {static_cast<float>(s.gain),
          static_cast<float>(s.u),
          static_cast<float>(s.v),
          vv * inverse,
          -uv * inverse,
          -vu * inverse,
          uu * inverse};
}

float power_of_two(int n) { return static_cast<float>(1U << n); }

/// Where the patch's samples lie in the target, in 1/65536 px.
struct Grid {
  std::int32_t x, y;            // first sample
  std::int32_t xi, yi, xj, yj;  // steps along a row and down a column
};

std::int32_t fixed(float v) { return static_cast<std::int32_t>(v * 65536.0F); }

/// False where a sample lies outside.
bool grid_at(const SmoothImage& image, float u, float v, const float (&warp)[4], Grid& g) {
  constexpr auto r = static_cast<float>(kPatchRadius);
  constexpr float kRounding = 0.01F;  // the sums below may round beyond the reach: never onto the last column
  const float reach_u = r * (std::fabs(warp[0]) + std::fabs(warp[1])) + kRounding;
  const float reach_v = r * (std::fabs(warp[2]) + std::fabs(warp[3])) + kRounding;
  if (!(u - reach_u >= 0.0F && v - reach_v >= 0.0F && u + reach_u < static_cast<float>(image.width - 1) &&
        v + reach_v < static_cast<float>(image.height - 1))) {
    return false;
  }
  g.xi = fixed(warp[0]);
  g.xj = fixed(warp[1]);
  g.yi = fixed(warp[2]);
  g.yj = fixed(warp[3]);
  g.x = fixed(u) - kPatchRadius * (g.xi + g.xj);
  g.y = fixed(v) - kPatchRadius * (g.yi + g.yj);
  return true;
}

struct TargetSums {
  std::int32_t gain = 0;
  std::int32_t u = 0;
  std::int32_t v = 0;
};

/// Bilinear samples of one half, and their sums.
void sample(const SmoothImage& image, const Grid& g, int half, const PatchTemplate::Weights* weights,
            std::int32_t* out, TargetSums& sums) {
  TargetSums s = sums;
  for (int j = 0; j < kPatchSide; ++j) {
    const int first = first_of(j, half);
    const int end = end_of(j);
    std::int32_t x = g.x + j * g.xj + first * g.xi;
    std::int32_t y = g.y + j * g.yj + first * g.yi;
    for (int i = first; i < end; i += 2) {
      const std::uint16_t* p = image.data + (y >> 16) * image.stride + (x >> 16);
      const std::uint16_t* q = p + image.stride;
      const std::int32_t fx = (x >> 2) & 0x3FFF;
      const std::int32_t fy = (y >> 2) & 0x3FFF;
      const std::int32_t top = p[0] + (((p[1] - p[0]) * fx) >> 14);
      const std::int32_t bottom = q[0] + (((q[1] - q[0]) * fx) >> 14);
      const std::int32_t value = (top + (((bottom - top) * fy) >> 14)) >> (16 - kSampleBits);
      s.gain += weights->gain * value;
      s.u += weights->u * value;
      s.v += weights->v * value;
      ++weights;
      *out++ = value;
      x += 2 * g.xi;
      y += 2 * g.yi;
    }
  }
  sums = s;
}

/// Weighted mean square of the samples about their means, half by half.
float variance_of(const std::int32_t* samples) {
  float variance = 0.0F;
  for (int half = 0, k = 0; half < kHalves; ++half) {
    const std::int32_t origin = samples[k];
    std::int32_t sum = 0;
    float sum2 = 0.0F;
    for (const int end = k + kSamplesOf[half]; k < end; ++k) {
      const std::int32_t d = samples[k] - origin;
      const std::int32_t weighted = kWindow.weight[k] * d;
      sum += weighted;
      sum2 += static_cast<float>(weighted) * static_cast<float>(d);
    }
    const float mean = static_cast<float>(sum) / power_of_two(kWeightBits - 1);
    variance += sum2 / power_of_two(kWeightBits) - 0.5F * mean * mean;
  }
  return variance;
}

}  // namespace

AlignStatus cut_template(const SmoothImage& image, int iu, int iv, PatchTemplate& out) {
  constexpr int r = kPatchRadius;
  if (iu - r < 1 || iv - r < 1 || iu + r > image.width - 2 || iv + r > image.height - 2)
    return AlignStatus::kOutside;
  Cut cut;
  CutSums means;
  cut_samples(image, iu, iv, cut, means);
  const int shift[3] = {shift_for(means.value_bits), shift_for(means.gu_bits), shift_for(means.gv_bits)};
  Sums sums;
  weigh_half(cut, means, 0, shift, out.weights, sums);
  out.half = solve(sums);
  weigh_half(cut, means, 1, shift, out.weights, sums);
  out.whole = solve(sums);

  // Back to mean squares of gradients in 1/256 grey levels.
  const float uu = static_cast<float>(sums.uu) * power_of_two(shift[1]) / power_of_two(kWeightBits);
  const float uv = static_cast<float>(sums.uv) * power_of_two(shift[1]) / power_of_two(kWeightBits);
  const float vv = static_cast<float>(sums.vv) * power_of_two(shift[2]) / power_of_two(kWeightBits);
  const float half_trace = 0.5F * (uu + vv);
  const float det = uu * vv - uv * uv;
  const float root2 = half_trace * half_trace - det;
  const float weaker = half_trace - std::sqrt(root2 > 0.0F ? root2 : 0.0F);
  if (!(weaker >= kMinEigen)) return AlignStatus::kFlat;
  out.variance = 0.25F * static_cast<float>(sums.gain) * power_of_two(shift[0]) / power_of_two(kWeightBits);
  return AlignStatus::kAligned;
}

Alignment align(const PatchTemplate& patch, const SmoothImage& target, float u, float v,
                const float (&warp)[4], const AlignParams& params) {
  constexpr float kCoarse = 0.2F;  // half of the samples does until a step is shorter than this
  Alignment result;
  const float u0 = u;
  const float v0 = v;
  std::int32_t samples[kPatchSamples];
  bool whole = false;
  for (int iteration = 0; iteration < params.max_iterations; ++iteration) {
    Grid grid;
    if (!grid_at(target, u, v, warp, grid)) return result;
    TargetSums sums;
    sample(target, grid, 0, patch.weights, samples, sums);
    if (whole) sample(target, grid, 1, patch.weights + kSamplesOf[0], samples + kSamplesOf[0], sums);
    const PatchTemplate::Solution& s = whole ? patch.whole : patch.half;
    if (sums.gain <= 0) {
      result.status = AlignStatus::kDifferent;
      return result;
    }
    const float inverse_gain = s.gain / static_cast<float>(sums.gain);
    const float bu = static_cast<float>(sums.u) * inverse_gain - s.u;
    const float bv = static_cast<float>(sums.v) * inverse_gain - s.v;
    const float du = s.uu * bu + s.uv * bv;
    const float dv = s.vu * bu + s.vv * bv;
    u -= warp[0] * du + warp[1] * dv;
    v -= warp[2] * du + warp[3] * dv;
    if (!(std::fabs(u - u0) <= params.max_shift_px && std::fabs(v - v0) <= params.max_shift_px)) break;
    if (whole && std::fabs(du) < params.converged_px && std::fabs(dv) < params.converged_px) {
      const float variance = variance_of(samples);
      result.correlation = variance > 0.0F ? std::sqrt(patch.variance / variance) / inverse_gain : 0.0F;
      result.u = u;
      result.v = v;
      result.status =
          result.correlation >= params.min_correlation ? AlignStatus::kAligned : AlignStatus::kDifferent;
      return result;
    }
    whole = whole || (std::fabs(du) < kCoarse && std::fabs(dv) < kCoarse);
  }
  result.status = AlignStatus::kNotConverged;
  return result;
}

}  // namespace cairn
