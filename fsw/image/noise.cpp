#include "image/noise.hpp"

#include <cmath>

namespace cairn {
namespace {

constexpr int kSide = 6;          // pixels of a sample: 3 x 3 sums of 2 x 2
constexpr int kFewest = 100;      // samples that tell
constexpr double kSigma = 4.047;  // median magnitude of the mask's answer to white noise of 1

/// Magnitude of the mask's answer.
int mask(int a, int b, int c, int d, int e, int f, int g, int h, int i) {
  const int v = a - 2 * b + c - 2 * (d - 2 * e + f) + g - 2 * h + i;
  return v < 0 ? -v : v;
}

}  // namespace

double NoiseJob::Histogram::median(int count) const {
  int below = 0;
  int k = 0;
  while (2 * (below + bin[k]) < count) below += bin[k++];
  return k + (0.5 * count - below) / bin[k] - 0.5;  // evenly within the bin
}

void NoiseJob::start(const ImageU8& left, const ImageU8& right) {
  images_[0] = left;
  images_[1] = right;
  side_ = y_ = count_ = 0;
  fine_ = coarse_ = {};
  squares_ = noise_ = 0.0;
}

Progress NoiseJob::step(WorkBudget& budget) {
  while (side_ < 2) {
    const ImageU8& image = images_[side_];
    if (y_ + kSide <= image.height) {
      if (!budget.take(kRowOps)) return Progress::kMore;
      take_row(image);
      y_ += kStepRows;
      continue;
    }
    end_image();
    y_ = count_ = 0;
    fine_ = coarse_ = {};
    ++side_;
    if (side_ == 2) noise_ = std::sqrt(squares_ > 0.0 ? squares_ * (0.5 * 4.0 / 3.0) : 0.0);
  }
  return Progress::kDone;
}

void NoiseJob::take_row(const ImageU8& image) {
  const auto answer = [](Histogram& histogram, int value) { ++histogram.bin[value < kMost ? value : kMost]; };
  for (int x = 0; x + kSide <= image.width; x += kStepColumns) {
    const std::uint8_t* row[kSide];
    for (int j = 0; j < kSide; ++j) row[j] = image.row(y_ + j) + x;
    const int centre = row[2][2];
    if (centre == 0 || centre == 255) continue;
    int s[9];
    for (int k = 0; k < 9; ++k) {
      const int u = 2 * (k % 3);
      const int v = 2 * (k / 3);
      s[k] = row[v][u] + row[v][u + 1] + row[v + 1][u] + row[v + 1][u + 1];
    }
    answer(fine_, mask(row[1][1], row[1][2], row[1][3], row[2][1], centre, row[2][3], row[3][1], row[3][2],
                       row[3][3]));
    answer(coarse_, (mask(s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8]) + 2) / 4);
    ++count_;
  }
}

void NoiseJob::end_image() {
  if (count_ < kFewest) return;
  const double fine = fine_.median(count_) / kSigma;
  const double coarse = coarse_.median(count_) / kSigma;
  squares_ += fine * fine - coarse * coarse;
}

}  // namespace cairn
