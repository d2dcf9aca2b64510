// Loops over rows, without branches and without overlap, so that the compiler makes vectors of them (the
// Makefile compiles this file with -O3).
#include "detect/kernels.hpp"

namespace cairn::ground::rows {

namespace {
using U8 = std::uint8_t;
using U32 = std::uint32_t;
using I32 = std::int32_t;
}  // namespace

void add(U32* __restrict sums, const U8* __restrict row, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) sums[i] += row[i];
}
void subtract(U32* __restrict sums, const U8* __restrict row, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) sums[i] -= row[i];
}
void slide(U32* __restrict sums, const U8* __restrict enters, const U8* __restrict leaves, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i)
    sums[i] += static_cast<U32>(static_cast<I32>(enters[i]) - static_cast<I32>(leaves[i]));
}

void prefix(const U32* __restrict sums, U32* __restrict prefix, std::size_t n) {
  U32 sum = prefix[0];
  for (std::size_t i = 0; i < n; ++i) {
    sum += sums[i];
    prefix[i + 1] = sum;
  }
}

// Exact: the sum plus half the count plus a half, over the count, is at least half of one count away from the
// next whole number, which is 2^-24 or more; the error of the product is below 2^-43.
void means(const U32* __restrict prefix, std::size_t span, const double* __restrict half,
           const double* __restrict inverse, U8* __restrict mean, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    const double sum = static_cast<I32>(prefix[i + span] - prefix[i]);
    mean[i] = static_cast<U8>(static_cast<I32>((sum + half[i]) * inverse[i]));
  }
}
void means_of_valid(const U32* __restrict prefix, const U32* __restrict gone_prefix, std::size_t span,
                    const I32* __restrict columns, I32 rows, U8* __restrict mean, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    const I32 left = columns[i] * rows - static_cast<I32>(gone_prefix[i + span] - gone_prefix[i]);
    const I32 count = left > 0 ? left : 1;
    const double sum = static_cast<I32>(prefix[i + span] - prefix[i]) + (count >> 1);
    mean[i] = static_cast<U8>(static_cast<I32>((sum + 0.5) / count));
  }
}

void differences(const U8* __restrict grey, const U8* __restrict mean, U8* __restrict out, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    auto d = static_cast<std::int16_t>(grey[i] - mean[i] + 128);
    d = d < 0 ? std::int16_t{0} : d;
    d = d > 255 ? std::int16_t{255} : d;
    out[i] = static_cast<U8>(d);
  }
}
void put_level(const U8* __restrict missing, U8* __restrict out, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) out[i] = missing[i] != 0 ? U8{128} : out[i];
}

void darker(const U8* __restrict difference, const U8* __restrict level, U8* __restrict out, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) out[i] = difference[i] < level[i] ? 1 : 0;
}

void levels(I32 first, I32 second, const std::int16_t* __restrict share, U8* __restrict level,
            std::size_t n) {
  const I32 step = second - first;
  for (std::size_t i = 0; i < n; ++i)
    level[i] = static_cast<U8>(128 - ((first * 1024 + step * share[i]) >> 22));
}

void add_bytes(U8* __restrict counts, const U8* __restrict row, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) counts[i] = static_cast<U8>(counts[i] + row[i]);
}
void subtract_bytes(U8* __restrict counts, const U8* __restrict row, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) counts[i] = static_cast<U8>(counts[i] - row[i]);
}

namespace {

/// The sum of Side neighbours from sums of 1, 2, 4 and 8: at most 225, one byte.
template <int Side>
void majority_of(const U8* __restrict one, const U8* __restrict two, const U8* __restrict four,
                 const U8* __restrict eight, U8* __restrict out, std::size_t n) {
  constexpr int kAfterEight = (Side & 8) != 0 ? 8 : 0;
  constexpr int kAfterFour = kAfterEight + ((Side & 4) != 0 ? 4 : 0);
  constexpr int kAfterTwo = kAfterFour + ((Side & 2) != 0 ? 2 : 0);
  for (std::size_t i = 0; i < n; ++i) {
    auto sum = static_cast<U8>(one[i + kAfterTwo]);
    if constexpr ((Side & 8) != 0) sum = static_cast<U8>(sum + eight[i]);
    if constexpr ((Side & 4) != 0) sum = static_cast<U8>(sum + four[i + kAfterEight]);
    if constexpr ((Side & 2) != 0) sum = static_cast<U8>(sum + two[i + kAfterFour]);
    out[i] = sum > Side * Side / 2 ? 1 : 0;
  }
}

void pairs(const U8* __restrict from, std::size_t apart, U8* __restrict to, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) to[i] = static_cast<U8>(from[i] + from[i + apart]);
}

}  // namespace

void majority(const U8* counts, int side, U8* two, U8* four, U8* eight, U8* out, std::size_t n) {
  const std::size_t all = n + static_cast<std::size_t>(side) - 1;  // counts that there are
  if (side >= 2) pairs(counts, 1, two, all - 1);
  if (side >= 4) pairs(two, 2, four, all - 3);
  if (side >= 8) pairs(four, 4, eight, all - 7);
  switch (side) {
    case 1: return majority_of<1>(counts, two, four, eight, out, n);
    case 3: return majority_of<3>(counts, two, four, eight, out, n);
    case 5: return majority_of<5>(counts, two, four, eight, out, n);
    case 7: return majority_of<7>(counts, two, four, eight, out, n);
    case 9: return majority_of<9>(counts, two, four, eight, out, n);
    case 11: return majority_of<11>(counts, two, four, eight, out, n);
    case 13: return majority_of<13>(counts, two, four, eight, out, n);
    default: return majority_of<15>(counts, two, four, eight, out, n);
  }
}

}  // namespace cairn::ground::rows
