#include "features/sift_descriptor.hpp"

#include <cmath>

namespace cairn {
namespace {

constexpr int kCells = 4;
constexpr int kBins = 8;
constexpr int kSide = (kCells + 1) * kCellPx - 1;  // samples a side: those within 2.5 cells of the keypoint
constexpr int kFirst = -(kSide / 2);               // offset of the first sample from the keypoint

/// Where a sample's row or column falls among the cells: the lower cell (0 = the virtual one before the
/// first), the share of the upper one, and the Gaussian window.
struct SampleWeights {
  int cell[kSide] = {};
  float upper[kSide] = {};
  float window[kSide] = {};
};

constexpr double exp_series(double x) {  // exp(x) for -2 <= x <= 0
  double e = 1.0;
  double term = 1.0;
  for (int n = 1; n < 25; ++n) {
    term *= x / n;
    e += term;
  }
  return e;
}

constexpr SampleWeights make_weights() {
  SampleWeights w;
  for (int i = 0; i < kSide; ++i) {
    const double offset = static_cast<double>(kFirst + i) / kCellPx;  // in cells, from the keypoint
    const double bin = offset + 0.5 * kCells - 0.5 + 1.0;  // padded by one virtual cell: never negative
    w.cell[i] = static_cast<int>(bin);
    w.upper[i] = static_cast<float>(bin - w.cell[i]);
    w.window[i] = static_cast<float>(exp_series(-offset * offset / (2.0 * 0.25 * kCells * kCells)));
  }
  return w;
}

constexpr SampleWeights kWeights = make_weights();

/// Votes of one row of samples, before they are spread over two rows of cells.
using RowHistogram = float[kCells + 2][kBins];

void vote_row(const SmoothImage& image, int iu, int y, RowHistogram& row) {
  float magnitude[kSide];
  float bin[kSide];
  const std::uint16_t* above = image.row(y - 1) + iu + kFirst;
  const std::uint16_t* here = image.row(y) + iu + kFirst;
  const std::uint16_t* below = image.row(y + 1) + iu + kFirst;
  for (int i = 0; i < kSide; ++i) {
    const auto gx = static_cast<float>(here[i + 1] - here[i - 1]);
    const auto gy = static_cast<float>(below[i] - above[i]);
    const float ax = std::fabs(gx);
    const float ay = std::fabs(gy);
    const float large = ax > ay ? ax : ay;
    const float small = ax > ay ? ay : ax;
    const float t = small / (large + 1.0e-6F);
    const float t2 = t * t;
    magnitude[i] = large * (1.0F + t2 * (0.4714F - 0.0572F * t2)) * kWeights.window[i];
    float octant = t * (1.3476F - 0.3476F * t);  // angle / (pi / 4), 0 to 1
    octant = ay > ax ? 2.0F - octant : octant;
    octant = gx < 0.0F ? 4.0F - octant : octant;
    bin[i] = gy < 0.0F ? 8.0F - octant : octant;
  }
  for (int i = 0; i < kSide; ++i) {
    const int b0 = static_cast<int>(bin[i]);
    const float f = bin[i] - static_cast<float>(b0);
    const float high = magnitude[i] * f;
    const float low = magnitude[i] - high;
    float* left = row[kWeights.cell[i]];
    float* right = row[kWeights.cell[i] + 1];
    const float share = kWeights.upper[i];
    const int b = b0 & 7;
    const int b1 = (b0 + 1) & 7;
    left[b] += low * (1.0F - share);
    left[b1] += high * (1.0F - share);
    right[b] += low * share;
    right[b1] += high * share;
  }
}

Descriptor quantise(const float (&h)[kDescriptorSize]) {
  Descriptor out;
  float norm2 = 0.0F;
  for (const float v : h) norm2 += v * v;
  if (!(norm2 > 0.0F)) return out;
  const float cut = 0.2F * std::sqrt(norm2);
  float cut_norm2 = 0.0F;
  for (const float v : h) {
    const float c = v < cut ? v : cut;
    cut_norm2 += c * c;
  }
  const float scale = 512.0F / std::sqrt(cut_norm2);
  for (int i = 0; i < kDescriptorSize; ++i) {
    const float c = (h[i] < cut ? h[i] : cut) * scale + 0.5F;
    out.bin[i] = static_cast<std::uint8_t>(c < 255.0F ? c : 255.0F);
  }
  return out;
}

struct Reciprocals {
  std::uint32_t value[511] = {};
};

constexpr Reciprocals make_reciprocals() {
  Reciprocals r;
  for (std::uint32_t i = 1; i < 511; ++i) r.value[i] = ((1U << 16U) + i / 2U) / i;
  return r;
}

constexpr Reciprocals kReciprocal = make_reciprocals();

}  // namespace

Descriptor describe(const SmoothImage& image, int iu, int iv) {
  CAIRN_ASSERT(iu >= kDescriptorMargin && iv >= kDescriptorMargin && iu < image.width - kDescriptorMargin &&
               iv < image.height - kDescriptorMargin);
  float cells[kCells + 2][kCells + 2][kBins] = {};
  for (int j = 0; j < kSide; ++j) {
    RowHistogram row = {};
    vote_row(image, iu, iv + kFirst + j, row);
    const float upper = kWeights.upper[j] * kWeights.window[j];
    const float lower = kWeights.window[j] - upper;
    float* to_lower = &cells[kWeights.cell[j]][0][0];
    float* to_upper = &cells[kWeights.cell[j] + 1][0][0];
    const float* from = &row[0][0];
    for (int k = 0; k < (kCells + 2) * kBins; ++k) {
      to_lower[k] += from[k] * lower;
      to_upper[k] += from[k] * upper;
    }
  }
  float h[kDescriptorSize];
  for (int j = 0; j < kCells; ++j) {
    for (int i = 0; i < kCells; ++i) {
      for (int b = 0; b < kBins; ++b) h[(j * kCells + i) * kBins + b] = cells[j + 1][i + 1][b];
    }
  }
  return quantise(h);
}

std::uint32_t chi_squared(const Descriptor& a, const Descriptor& b, std::uint32_t stop) {
  std::uint32_t sum = 0;
  for (int i = 0; i < kDescriptorSize; i += 16) {
    for (int k = i; k < i + 16; ++k) {
      const int d = static_cast<int>(a.bin[k]) - static_cast<int>(b.bin[k]);
      // d^2 / s <= 255, so d^2 * 2^16 / s stays below 2^24.
      sum += (static_cast<std::uint32_t>(d * d) * kReciprocal.value[a.bin[k] + b.bin[k]]) >> 8U;
    }
    if (sum >= stop) return sum;
  }
  return sum;
}

}  // namespace cairn
