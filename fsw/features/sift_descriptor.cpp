#include "features/sift_descriptor.hpp"

#include <cmath>
#include <utility>

namespace cairn {
namespace {

constexpr int kCells = 4;
constexpr int kBins = 8;
constexpr int kSpan = (kCells + 1) * kCellPx - 1;  // samples a side: within 2.5 cells of the keypoint
constexpr int kFirst = -(kSpan / 2);               // offset of the first sample from the keypoint
static_assert(kCellPx == 4, "shares of a cell are quarters");

/// Votes of one row of cells, or of one row of samples: 4 cells x 8 orientations.
using RowHistogram = std::uint32_t[kCells * kBins];

/// What a sample votes for: an axis and a diagonal (bins 0 to 7), and how much each gets.
struct Vote {
  std::uint32_t axis;
  std::uint32_t diagonal;
  std::uint32_t to_axis;
  std::uint32_t to_diagonal;
};

[[gnu::always_inline]] inline Vote vote_of(std::int32_t gx, std::int32_t gy) {
  const std::int32_t left = -static_cast<std::int32_t>(gx < 0);  // all ones where negative
  const std::int32_t up = -static_cast<std::int32_t>(gy < 0);
  const auto ax = static_cast<std::uint32_t>((gx ^ left) - left);
  const auto ay = static_cast<std::uint32_t>((gy ^ up) - up);
  Vote v;
  v.diagonal = static_cast<std::uint32_t>(((1 + (left & 2)) ^ up) - up) & 7U;
  std::uint32_t small;
  if (ax >= ay) {
    small = ay;
    v.to_axis = ax - ay;
    v.axis = static_cast<std::uint32_t>(left & 4);
  } else {
    small = ax;
    v.to_axis = ay - ax;
    v.axis = static_cast<std::uint32_t>(2 + (up & 4));
  }
  v.to_diagonal = small + (small >> 2U) + (small >> 3U);
  return v;
}

/// Column `kColumn` of the samples: to the cell before it and the one behind it, in quarters. Cells beyond
/// the descriptor get nothing.
template <int kColumn>
inline void vote(const std::uint16_t* above, const std::uint16_t* here, const std::uint16_t* below,
                 RowHistogram& row) {
  constexpr int kBefore = (kColumn + 1) / kCellPx - 1;
  constexpr std::uint32_t kShare = (kColumn + 1) % kCellPx;
  const Vote v = vote_of(here[kColumn + 1] - here[kColumn - 1], below[kColumn] - above[kColumn]);
  if constexpr (kBefore >= 0) {
    std::uint32_t* bins = row + kBefore * kBins;
    bins[v.axis] += (kCellPx - kShare) * v.to_axis;
    bins[v.diagonal] += (kCellPx - kShare) * v.to_diagonal;
  }
  if constexpr (kBefore + 1 < kCells && kShare > 0) {
    std::uint32_t* bins = row + (kBefore + 1) * kBins;
    bins[v.axis] += kShare * v.to_axis;
    bins[v.diagonal] += kShare * v.to_diagonal;
  }
}

/// Every other sample of a row, from `kFirstColumn` on.
template <int kFirstColumn, int... kPairs>
inline void vote_row(const SmoothImage& image, int u, int v, RowHistogram& row,
                     std::integer_sequence<int, kPairs...>) {
  const std::uint16_t* here = image.row(v) + u;
  const std::uint16_t* above = here - image.stride;
  const std::uint16_t* below = here + image.stride;
  (vote<kFirstColumn + 2 * kPairs>(above, here, below, row), ...);
}

/// The Gaussian window at the cells' centres, 1.5 and 0.5 cells from the keypoint, in 1/64.
constexpr std::uint32_t kCellWeight[kCells] = {48, 62, 62, 48};

/// Normalised to length 512, cut at 0.2 of it, normalised again.
Descriptor quantise(std::uint32_t (&h)[kDescriptorSize]) {
  Descriptor out;
  std::uint32_t any = 0;
  for (const std::uint32_t v : h) any |= v;
  if (any == 0) return out;
  // To 12 bits: squares then add up in 32. Fewer bits than 12 become 12, so that weak texture loses nothing.
  int down = 0;
  int up = 0;
  while ((any >> down) >= 4096U) ++down;
  while ((any << up) < 2048U) ++up;
  std::uint32_t norm2 = 0;
  for (std::uint32_t& v : h) {
    v = (v >> down) << up;
    norm2 += v * v;
  }
  const auto cut = static_cast<std::uint32_t>(0.2F * std::sqrt(static_cast<float>(norm2)) + 0.5F);
  std::uint32_t cut_norm2 = 0;
  for (std::uint32_t& v : h) {
    if (v > cut) v = cut;
    cut_norm2 += v * v;
  }
  // v / |v| <= 1: the product stays below 2^26.
  const auto scale =
      static_cast<std::uint32_t>(512.0F * 65536.0F / std::sqrt(static_cast<float>(cut_norm2)) + 0.5F);
  for (int i = 0; i < kDescriptorSize; ++i) {
    const std::uint32_t c = (h[i] * scale + 32768U) >> 16U;
    out.bin[i] = static_cast<std::uint8_t>(c < 255U ? c : 255U);
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

/// The window makes the inner cells heaviest: distances that stop early stop there.
constexpr std::uint8_t kCentreFirst[kCells * kCells] = {5, 6, 9, 10, 1, 2, 4, 7, 8, 11, 13, 14, 0, 3, 12, 15};

}  // namespace

Descriptor describe(const SmoothImage& image, int iu, int iv) {
  CAIRN_ASSERT(iu >= kDescriptorMargin && iv >= kDescriptorMargin && iu < image.width - kDescriptorMargin &&
               iv < image.height - kDescriptorMargin);
  std::uint32_t h[kDescriptorSize];
  RowHistogram lower;  // what the rows since the last row of cells give the next one
  const auto even = std::make_integer_sequence<int, kSpan / 2 + 1>();
  const auto odd = std::make_integer_sequence<int, kSpan / 2>();
  for (int j = -1; j < kSpan;) {
    // Four rows whose shares of the cells above them are 4, 3, 2, 1 quarters, and of those below 0, 1, 2, 3:
    // the running sums of the rows add up to the first.
    RowHistogram sum;
    RowHistogram upper;
    for (int i = 0; i < kCells * kBins; ++i) sum[i] = 0;
    if (j >= 0) vote_row<1>(image, iu + kFirst, iv + kFirst + j, sum, odd);
    for (int i = 0; i < kCells * kBins; ++i) upper[i] = sum[i];
    for (int k = 1; k < kCellPx; ++k) {
      const int v = iv + kFirst + j + k;
      if (k == 2) {
        vote_row<1>(image, iu + kFirst, v, sum, odd);
      } else {
        vote_row<0>(image, iu + kFirst, v, sum, even);
      }
      for (int i = 0; i < kCells * kBins; ++i) upper[i] += sum[i];
    }
    j += kCellPx;
    const int cell = j / kCellPx - 1;  // above these rows
    for (int i = 0; i < kCells * kBins; ++i) {
      if (cell >= 0) h[cell * kCells * kBins + i] = lower[i] + upper[i];
      lower[i] = kCellPx * sum[i] - upper[i];
    }
  }
  for (int j = 0; j < kCells; ++j) {
    for (int i = 0; i < kCells; ++i) {
      const std::uint32_t w = kCellWeight[j] * kCellWeight[i] / kCellPx;
      for (int b = 0; b < kBins; ++b) {
        std::uint32_t& v = h[(j * kCells + i) * kBins + b];
        v = (v >> 12U) * w + (((v & 0xFFFU) * w) >> 12U);
      }
    }
  }
  return quantise(h);
}

std::uint32_t chi_squared(const Descriptor& a, const Descriptor& b, std::uint32_t stop) {
  static_assert(kBins == 8, "told out below");
  std::uint32_t sum = 0;
  for (const std::uint8_t cell : kCentreFirst) {
    const std::uint8_t* pa = a.bin + cell * kBins;
    const std::uint8_t* pb = b.bin + cell * kBins;
    const auto at = [pa, pb](int k) {
      const int d = static_cast<int>(pa[k]) - static_cast<int>(pb[k]);
      // d^2 / s <= 255, so d^2 * 2^16 / s stays below 2^24.
      return (static_cast<std::uint32_t>(d * d) * kReciprocal.value[pa[k] + pb[k]]) >> 8U;
    };
    sum += at(0) + at(1) + at(2) + at(3) + at(4) + at(5) + at(6) + at(7);
    if (sum >= stop) return sum;
  }
  return sum;
}

}  // namespace cairn
