#include "features/extractor.hpp"

#include <cmath>

#include "features/sift_descriptor.hpp"

namespace cairn {
namespace {

constexpr int kContrast = 154;  // 0.6 grey levels in units of 1/256: below it is noise of an 8-bit image
constexpr int kMargin = kDescriptorMargin;

/// Curvatures of the difference at a pixel.
struct Hessian {
  int xx, yy, xy4;  // xy4: four times the mixed derivative
};

Hessian hessian(const std::int16_t* a, const std::int16_t* h, const std::int16_t* b) {
  return {h[1] + h[-1] - 2 * h[0], a[0] + b[0] - 2 * h[0], (b[1] - b[-1]) - (a[1] - a[-1])};
}

/// Lowe's edge test with r = 10: trace^2 / det < (r + 1)^2 / r, det > 0.
bool is_edge(const Hessian& d) {
  const std::int64_t trace = d.xx + d.yy;
  const std::int64_t det16 =
      16 * static_cast<std::int64_t>(d.xx) * d.yy - static_cast<std::int64_t>(d.xy4) * d.xy4;
  return det16 <= 0 || trace * trace * 10 * 16 >= 121 * det16;
}

/// Beyond the rows above and below, too; of equal ones the first. The nearest two decide most.
bool is_maximum(const std::int16_t* a, const std::int16_t* b, int c) {
  return c > a[0] && c >= b[0] && c > a[-1] && c > a[1] && c >= b[-1] && c >= b[1];
}

bool is_minimum(const std::int16_t* a, const std::int16_t* b, int c) {
  return c < a[0] && c <= b[0] && c < a[-1] && c < a[1] && c <= b[-1] && c <= b[1];
}

int strength(const Feature& f) { return f.response < 0 ? -f.response : f.response; }

/// Vertex of the quadratic through the 3 x 3 neighbourhood; the offset is cut at half a pixel.
void refine(const std::int16_t* a, const std::int16_t* h, const std::int16_t* b, const Hessian& d,
            Feature& f) {
  const double gx = 0.5 * (h[1] - h[-1]);
  const double gy = 0.5 * (b[0] - a[0]);
  const double xy = 0.25 * d.xy4;
  const double det = static_cast<double>(d.xx) * d.yy - xy * xy;
  const double du = -(d.yy * gx - xy * gy) / det;
  const double dv = -(d.xx * gy - xy * gx) / det;
  const auto cut = [](double v) { return v > 0.5 ? 0.5 : (v < -0.5 ? -0.5 : v); };
  f.u = static_cast<float>(f.iu + cut(du));
  f.v = static_cast<float>(f.iv + cut(dv));
}

}  // namespace

ExtractStatus FeatureExtractor::start(const ImageU8& image, bool halved, bool describe) {
  set_.features.clear();
  set_.descriptors.clear();
  set_.height = 0;
  const int least = halved ? 2 * kLeastSide : kLeastSide;
  if (image.data == nullptr || image.width < least || image.height < least ||
      image.width > cfg::kImageWidth || image.height > cfg::kImageHeight || image.stride < image.width) {
    image_width_ = width_ = height_ = 0;
    return status_ = ExtractStatus::kBadImage;
  }
  image_width_ = image.width;
  width_ = halved ? image.width / 2 : image.width;
  height_ = halved ? image.height / 2 : image.height;
  row_ = 0;
  described_ = 0;
  describe_ = describe;
  selected_ = false;
  for (Cell& cell : cells_) {
    cell.count = 0;
    cell.least = kContrast;
  }
  scales_.start(image, halved);
  return status_ = ExtractStatus::kRunning;
}

Progress FeatureExtractor::step(WorkBudget& budget) {
  if (status_ != ExtractStatus::kRunning) return Progress::kDone;
  while (row_ < height_) {
    if (!budget.take(row_ops(image_width_))) return Progress::kMore;
    do_row(row_++);
  }
  if (!selected_) {
    if (!budget.take(select_ops())) return Progress::kMore;
    select();
    selected_ = true;
  }
  while (describe_ && described_ < set_.features.size()) {
    if (!budget.take(kDescriptorOps)) return Progress::kMore;
    describe(described_++);
  }
  status_ = set_.features.size() < kMinFeatures ? ExtractStatus::kFewFeatures : ExtractStatus::kFeatures;
  return Progress::kDone;
}

void FeatureExtractor::describe(std::size_t i) {
  Feature& f = set_.features[i];
  if (f.described) return;
  set_.descriptors[i] = cairn::describe(smooth(), f.iu, f.iv);
  f.described = true;
}

void FeatureExtractor::do_row(int y) {
  const int middle = y - ScaleRows::kDelay - 1;
  scales_.next(smooth_ + static_cast<std::size_t>(y) * static_cast<std::size_t>(width_),
               dog_[(y + 3 - ScaleRows::kDelay % 3) % 3]);
  if (middle >= kMargin && middle < height_ - kMargin) find_extrema(middle);
}

/// Only what is beyond both pixels beside it in the row is looked at. What is no
/// stronger than the last of a full cell is dismissed: most of a textured image.
void FeatureExtractor::find_extrema(int y) {
  const std::int16_t* a = dog_[(y - 1) % 3];
  const std::int16_t* h = dog_[y % 3];
  const std::int16_t* b = dog_[(y + 1) % 3];
  Cell* cells = cells_ + (y / kCell) * kCellsX;
  const int end = width_ - kMargin;
  int before = h[kMargin - 1];
  int c = h[kMargin];
  for (int x = kMargin; x < end; ++x) {
    const int next = h[x + 1];
    if (c > before) {
      if (c >= next && c >= cells[x / kCell].least && is_maximum(a + x, b + x, c)) take(x, y, a, h, b);
    } else if (c < before) {
      if (c <= next && -c >= cells[x / kCell].least && is_minimum(a + x, b + x, c)) take(x, y, a, h, b);
    }
    before = c;
    c = next;
  }
}

void FeatureExtractor::take(int x, int y, const std::int16_t* a, const std::int16_t* h,
                            const std::int16_t* b) {
  a += x;
  h += x;
  b += x;
  const Hessian d = hessian(a, h, b);
  if (is_edge(d)) return;
  Feature f;
  f.iu = static_cast<std::int16_t>(x);
  f.iv = static_cast<std::int16_t>(y);
  f.response = h[0];
  f.described = false;
  refine(a, h, b, d, f);
  keep(f, cells_[(y / kCell) * kCellsX + x / kCell]);
}

void FeatureExtractor::keep(const Feature& feature, Cell& cell) {
  int place = cell.count;
  while (place > 0 && strength(cell.at(place - 1)) < strength(feature)) --place;
  const int slot = cell.count < kPerCell ? cell.count++ : cell.rank[kPerCell - 1];
  for (int i = cell.count - 1; i > place; --i) cell.rank[i] = cell.rank[i - 1];
  cell.rank[place] = static_cast<std::uint8_t>(slot);
  cell.feature[slot] = feature;
  if (cell.count == kPerCell) cell.least = strength(cell.at(kPerCell - 1)) + 1;
}

void FeatureExtractor::select() {
  // Whole ranks first; of the rank that no longer fits, cells are taken at an even stride.
  std::size_t count_of_rank[kPerCell] = {};
  for (const Cell& cell : cells_) {
    for (int r = 0; r < cell.count; ++r) ++count_of_rank[r];
  }
  int whole = 0;
  std::size_t total = 0;
  while (whole < kPerCell && total + count_of_rank[whole] <= cfg::kMaxFeatures)
    total += count_of_rank[whole++];
  const std::size_t room = cfg::kMaxFeatures - total;
  const std::size_t candidates = whole < kPerCell ? count_of_rank[whole] : 0;

  // Counting sort into scan order: rows, then columns within a row (cells run left to right,
  // so only a row mixes).
  std::uint16_t per_row[cfg::kImageHeight + 1] = {};
  std::size_t seen = 0;
  for (Cell& cell : cells_) {
    int take = cell.count < whole ? cell.count : whole;
    if (cell.count > whole && candidates > 0) {
      if ((seen + 1) * room / candidates > seen * room / candidates) ++take;
      ++seen;
    }
    cell.count = take;
    for (int i = 0; i < take; ++i) ++per_row[cell.at(i).iv];
  }
  set_.height = height_;
  set_.row_begin[0] = 0;
  for (int y = 0; y < height_; ++y) {
    set_.row_begin[y + 1] = static_cast<std::uint16_t>(set_.row_begin[y] + per_row[y]);
  }
  set_.features.resize(set_.row_begin[height_]);
  set_.descriptors.resize(set_.row_begin[height_]);
  std::uint16_t next[cfg::kImageHeight];
  for (int y = 0; y < height_; ++y) next[y] = set_.row_begin[y];
  for (const Cell& cell : cells_) {
    for (int i = 0; i < cell.count; ++i) {
      const Feature& f = cell.at(i);
      std::size_t place = next[f.iv]++;
      while (place > set_.row_begin[f.iv] && set_.features[place - 1].iu > f.iu) {
        set_.features[place] = set_.features[place - 1];
        --place;
      }
      set_.features[place] = f;
    }
  }
}

}  // namespace cairn
