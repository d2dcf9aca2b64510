#include "features/patch_align.hpp"

#include <cmath>

namespace cairn {
namespace {

struct Window {
  float weight[kPatchSamples] = {};
};

/// (1 - (r/7.5)^2)^2 in each direction, scaled to sum 1: close to a Gaussian, and smooth at the rim.
constexpr Window make_window() {
  Window w;
  double sum = 0.0;
  double value[kPatchSamples] = {};
  for (int j = 0; j < kPatchSide; ++j) {
    for (int i = 0; i < kPatchSide; ++i) {
      const double x = (i - kPatchRadius) / 7.5;
      const double y = (j - kPatchRadius) / 7.5;
      const double f = (1.0 - x * x) * (1.0 - y * y);
      value[j * kPatchSide + i] = f * f;
      sum += f * f;
    }
  }
  for (int k = 0; k < kPatchSamples; ++k) w.weight[k] = static_cast<float>(value[k] / sum);
  return w;
}

constexpr Window kWindow = make_window();
constexpr float kMinEigen =
    400.0F;  // mean squared gradient in the weaker direction: 0.08 grey levels a pixel

/// Bilinear samples of the warped patch; false where one lies outside.
bool sample(const SmoothImage& image, float u, float v, const float (&warp)[4], float (&out)[kPatchSamples]) {
  constexpr auto r = static_cast<float>(kPatchRadius);
  constexpr float kRounding = 0.01F;  // the sums below may round beyond the reach: never onto the last column
  const float reach_u = r * (std::fabs(warp[0]) + std::fabs(warp[1])) + kRounding;
  const float reach_v = r * (std::fabs(warp[2]) + std::fabs(warp[3])) + kRounding;
  if (!(u - reach_u >= 0.0F && v - reach_v >= 0.0F && u + reach_u < static_cast<float>(image.width - 1) &&
        v + reach_v < static_cast<float>(image.height - 1))) {
    return false;
  }
  for (int j = 0; j < kPatchSide; ++j) {
    const auto dy = static_cast<float>(j - kPatchRadius);
    const float row_u = u + warp[1] * dy;
    const float row_v = v + warp[3] * dy;
    for (int i = 0; i < kPatchSide; ++i) {
      const auto dx = static_cast<float>(i - kPatchRadius);
      const float x = row_u + warp[0] * dx;
      const float y = row_v + warp[2] * dx;
      const int x0 = static_cast<int>(x);
      const int y0 = static_cast<int>(y);
      const float fx = x - static_cast<float>(x0);
      const float fy = y - static_cast<float>(y0);
      const std::uint16_t* p = image.data + static_cast<std::ptrdiff_t>(y0) * image.stride + x0;
      const std::uint16_t* q = p + image.stride;
      const float top = static_cast<float>(p[0]) + fx * static_cast<float>(p[1] - p[0]);
      const float bottom = static_cast<float>(q[0]) + fx * static_cast<float>(q[1] - q[0]);
      out[j * kPatchSide + i] = top + fy * (bottom - top);
    }
  }
  return true;
}

}  // namespace

AlignStatus cut_template(const SmoothImage& image, int iu, int iv, PatchTemplate& out) {
  constexpr int r = kPatchRadius;
  if (iu - r < 1 || iv - r < 1 || iu + r > image.width - 2 || iv + r > image.height - 2)
    return AlignStatus::kOutside;
  float mean = 0.0F;
  float uu = 0.0F;
  float uv = 0.0F;
  float vv = 0.0F;
  for (int j = 0; j < kPatchSide; ++j) {
    const std::uint16_t* p = image.data + static_cast<std::ptrdiff_t>(iv - r + j) * image.stride + (iu - r);
    for (int i = 0; i < kPatchSide; ++i) {
      const int k = j * kPatchSide + i;
      const float w = kWindow.weight[k];
      const float gu = 0.5F * static_cast<float>(p[i + 1] - p[i - 1]);
      const float gv = 0.5F * static_cast<float>(p[i + image.stride] - p[i - image.stride]);
      out.value[k] = static_cast<float>(p[i]);
      out.gu[k] = w * gu;
      out.gv[k] = w * gv;
      mean += w * out.value[k];
      uu += w * gu * gu;
      uv += w * gu * gv;
      vv += w * gv * gv;
    }
  }
  out.variance = 0.0F;
  for (int k = 0; k < kPatchSamples; ++k) {
    out.value[k] -= mean;
    out.variance += kWindow.weight[k] * out.value[k] * out.value[k];
  }
  const float half_trace = 0.5F * (uu + vv);
  const float det = uu * vv - uv * uv;
  const float root2 = half_trace * half_trace - det;
  const float weaker = half_trace - std::sqrt(root2 > 0.0F ? root2 : 0.0F);
  if (!(weaker >= kMinEigen)) return AlignStatus::kFlat;
  out.inverse_hessian[0] = vv / det;
  out.inverse_hessian[1] = -uv / det;
  out.inverse_hessian[2] = uu / det;
  return AlignStatus::kAligned;
}

Alignment align(const PatchTemplate& patch, const SmoothImage& target, float u, float v,
                const float (&warp)[4], const AlignParams& params) {
  Alignment result;
  const float u0 = u;
  const float v0 = v;
  float w[kPatchSamples];
  for (int iteration = 0; iteration < params.max_iterations; ++iteration) {
    if (!sample(target, u, v, warp, w)) return result;
    float mean = 0.0F;
    for (int k = 0; k < kPatchSamples; ++k) mean += kWindow.weight[k] * w[k];
    float cross = 0.0F;
    float variance = 0.0F;
    for (int k = 0; k < kPatchSamples; ++k) {
      w[k] -= mean;
      cross += kWindow.weight[k] * w[k] * patch.value[k];
      variance += kWindow.weight[k] * w[k] * w[k];
    }
    result.correlation = variance > 0.0F ? cross / std::sqrt(variance * patch.variance) : 0.0F;
    if (!(cross > 0.0F)) {
      result.status = AlignStatus::kDifferent;
      return result;
    }
    const float inverse_gain = patch.variance / cross;
    float bu = 0.0F;
    float bv = 0.0F;
    for (int k = 0; k < kPatchSamples; ++k) {
      const float e = w[k] * inverse_gain - patch.value[k];
      bu += patch.gu[k] * e;
      bv += patch.gv[k] * e;
    }
    const float du = patch.inverse_hessian[0] * bu + patch.inverse_hessian[1] * bv;
    const float dv = patch.inverse_hessian[1] * bu + patch.inverse_hessian[2] * bv;
    u -= warp[0] * du + warp[1] * dv;
    v -= warp[2] * du + warp[3] * dv;
    if (!(std::fabs(u - u0) <= params.max_shift_px && std::fabs(v - v0) <= params.max_shift_px)) break;
    if (std::fabs(du) < params.converged_px && std::fabs(dv) < params.converged_px) {
      result.u = u;
      result.v = v;
      result.status =
          result.correlation >= params.min_correlation ? AlignStatus::kAligned : AlignStatus::kDifferent;
      return result;
    }
  }
  result.status = AlignStatus::kNotConverged;
  return result;
}

}  // namespace cairn
