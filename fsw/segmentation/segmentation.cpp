#include "segmentation/segmentation.hpp"

#include <cmath>

#include "core/assert.hpp"

namespace cairn {
namespace {

constexpr double kMostGain = 4.0;  // beyond it noise of a grey level makes regions

bool is_valid(const SegmentationParams& p) {
  return (p.scale_divisor == 1 || p.scale_divisor == 2) && p.connect_grey >= 0 && p.connect_grey <= 255 &&
         p.merge_grey >= 0 && p.merge_grey <= 255 && p.min_area_px >= 0 && p.max_area_fraction > 0.0 &&
         p.max_area_fraction <= 1.0 && p.min_contrast_grey >= 0 && p.min_contrast_grey <= 255 &&
         p.least_deviation_grey >= 0 && p.least_deviation_grey <= 255 && p.max_labels >= 1 &&
         p.max_labels <= static_cast<int>(cfg::kMaxLabels);
}

bool is_valid(const ImageU8& image, int divisor) {
  return image.data != nullptr && image.width >= divisor && image.height >= divisor &&
         image.width <= cfg::kImageWidth && image.height <= cfg::kImageHeight &&
         image.stride >= image.width &&
         static_cast<std::size_t>(image.width / divisor) * static_cast<std::size_t>(image.height / divisor) <=
             cfg::kWorkingPixels;
}

}  // namespace

std::uint8_t LabelView::label_at(double u_px, double v_px) const {
  const bool inside = u_px >= -0.5 && v_px >= -0.5 && u_px < divisor * image.width - 0.5 &&
                      v_px < divisor * image.height - 0.5;  // false for NaN
  if (!inside) return 0;
  const int shift = divisor - 1;  // of 1 or 2
  return image.at(static_cast<int>(u_px + 0.5) >> shift, static_cast<int>(v_px + 0.5) >> shift);
}

SegmentationStatus SegmentationJob::start(const SegmentationParams& params, const ImageU8& image) {
  regions_.clear();
  dropped_ = 0;
  status_ = SegmentationStatus::kBadInput;
  if (!is_valid(params) || !is_valid(image, params.scale_divisor)) return status_;
  params_ = params;
  image_ = image;
  tolerance_grey_ = params.connect_grey;
  width_ = image.width / params.scale_divisor;
  height_ = image.height / params.scale_divisor;
  cursor_ = 0;
  sum_grey_ = 0;
  sum_grey2_ = 0;
  gain_q8_ = 256;
  phase_ = params.scale_divisor == 1 ? Phase::kFilter : Phase::kHalve;
  const MeanShiftParams filter{params.spatial_radius_px, params.range_radius_grey, params.max_iterations,
                               params.convergence, params.each_second};
  const ImageU8 half = packed_view<const std::uint8_t>(half_, width_, height_);
  const MeanShiftStatus started =
      filter_.start(filter, params.scale_divisor == 1 ? image : half, packed_view(plane_, width_, height_));
  if (started == MeanShiftStatus::kRunning) status_ = SegmentationStatus::kRunning;
  return status_;
}

Progress SegmentationJob::step(WorkBudget& budget) {
  while (status_ == SegmentationStatus::kRunning) {
    if (phase_ == Phase::kFilter) {
      if (filter_.step(budget) == Progress::kMore) return Progress::kMore;
      begin_connect();
    } else if (phase_ == Phase::kMerge) {
      if (merge_.step(budget) == Progress::kMore) return Progress::kMore;
      phase_ = Phase::kOutline;
    } else {
      if (!budget.take(unit_cost())) return Progress::kMore;
      do_unit();
    }
  }
  return Progress::kDone;
}

LabelView SegmentationJob::labels() const {
  if (status_ != SegmentationStatus::kDone) return {};
  return {packed_view<const std::uint8_t>(plane_, width_, height_), params_.scale_divisor};
}

std::uint32_t SegmentationJob::unit_cost() const {
  if (phase_ == Phase::kSelect) return select_ops(params_.max_labels);
  return row_ops(width_);
}

void SegmentationJob::do_unit() {
  switch (phase_) {
    case Phase::kHalve: halve_row(cursor_); break;
    case Phase::kStretch: stretch_row(cursor_); break;
    case Phase::kConnect: connect_next_row(); return;
    case Phase::kOutline: outline_row(cursor_); break;
    case Phase::kSelect: select_next(); return;
    case Phase::kPaint: paint_row(cursor_); break;
    case Phase::kFilter:
    case Phase::kMerge: CAIRN_ASSERT(false);
  }
  if (++cursor_ < height_) return;
  cursor_ = 0;
  switch (phase_) {
    case Phase::kHalve: end_halving(); break;
    case Phase::kStretch: phase_ = Phase::kFilter; break;
    case Phase::kOutline:
      selected_.clear();
      phase_ = Phase::kSelect;
      break;
    default: finish(); break;
  }
}

void SegmentationJob::halve_row(int y) {
  const std::uint8_t* upper = image_.row(2 * y);
  const std::uint8_t* lower = image_.row(2 * y + 1);
  std::uint8_t* out = &half_[y * width_];
  std::uint32_t row_sum = 0;
  std::uint32_t row_sum2 = 0;
  for (int x = 0; x < width_; ++x) {
    const int sum = upper[2 * x] + upper[2 * x + 1] + lower[2 * x] + lower[2 * x + 1];
    const auto mean = static_cast<std::uint32_t>((sum + 2) / 4);
    out[x] = static_cast<std::uint8_t>(mean);
    row_sum += mean;
    row_sum2 += mean * mean;
  }
  sum_grey_ += row_sum;
  sum_grey2_ += row_sum2;
}

void SegmentationJob::end_halving() {
  const auto pixels = static_cast<double>(width_ * height_);
  const double mean = sum_grey_ / pixels;
  const double variance = static_cast<double>(sum_grey2_) / pixels - mean * mean;
  const double least = params_.least_deviation_grey;
  phase_ = variance < least * least ? Phase::kStretch : Phase::kFilter;
  if (phase_ == Phase::kFilter) return;
  const double most = least / kMostGain;
  gain_q8_ =
      static_cast<std::int32_t>(256.0 * (variance > most * most ? least / std::sqrt(variance) : kMostGain));
}

/// About the mean, which goes to the middle of the scale.
void SegmentationJob::stretch_row(int y) {
  const auto mean = static_cast<std::int32_t>(sum_grey_ / static_cast<std::uint32_t>(width_ * height_));
  for (std::uint8_t* p = &half_[y * width_]; p != &half_[(y + 1) * width_]; ++p) {
    const std::int32_t grey = ((*p - mean) * gain_q8_ >> 8) + 128;
    *p = static_cast<std::uint8_t>(grey < 0 ? 0 : grey > 255 ? 255 : grey);
  }
}

void SegmentationJob::begin_connect() {
  map_.clear(width_, height_);
  cursor_ = 0;
  phase_ = Phase::kConnect;
}

void SegmentationJob::connect_next_row() {
  const int before = map_.numbers();
  const ImageU8 filtered = packed_view<const std::uint8_t>(plane_, width_, height_);
  if (!map_.connect_row(filtered, cursor_, tolerance_grey_)) {
    out_of_numbers();
    return;
  }
  for (int i = before; i < map_.numbers(); ++i) {
    label_of_[i] = 0;
    outline_[i] = 0;
    steps_grey_[i] = 0;
  }
  if (++cursor_ == height_) begin_merge();
}

/// Strong gravel under a low sun asks for a wider tolerance; what needs more than merging allows is noise.
void SegmentationJob::out_of_numbers() {
  if (tolerance_grey_ >= params_.merge_grey) {
    status_ = SegmentationStatus::kTooManyRegions;
    return;
  }
  tolerance_grey_ = 2 * tolerance_grey_ + 1;
  if (tolerance_grey_ > params_.merge_grey) tolerance_grey_ = params_.merge_grey;
  begin_connect();
}

void SegmentationJob::begin_merge() {
  const int pixel_area = params_.scale_divisor * params_.scale_divisor;
  const int min_area = params_.min_area_px / pixel_area + (params_.min_area_px % pixel_area != 0 ? 1 : 0);
  // What a wider tolerance has joined already, no lower level need join.
  const int first_level_grey = tolerance_grey_ > params_.connect_grey ? tolerance_grey_ : 0;
  const RegionMergeStatus started = merge_.start({params_.merge_grey, min_area, first_level_grey}, map_);
  CAIRN_ASSERT(started == RegionMergeStatus::kRunning);
  cursor_ = 0;
  phase_ = Phase::kMerge;
}

void SegmentationJob::outline_row(int y) {
  const std::uint16_t* row = map_.row(y);
  const std::uint16_t* below = y + 1 < height_ ? map_.row(y + 1) : row;
  for (int x = 0; x + 1 < width_; ++x) {
    if (row[x] != row[x + 1]) step_across(row[x], row[x + 1]);
  }
  for (int x = 0; x < width_; ++x) {
    if (row[x] != below[x]) step_across(row[x], below[x]);
  }
}

/// Not inline: one pixel in nine has another beside it, and all would pay for the addresses.
[[gnu::noinline]] void SegmentationJob::step_across(std::uint16_t a, std::uint16_t b) {
  const int difference_q8 = map_.mean_q8(a) - map_.mean_q8(b);
  const auto step_grey =
      static_cast<std::uint32_t>(((difference_q8 < 0 ? -difference_q8 : difference_q8) + 128) / 256);
  outline_[a] += 1;
  outline_[b] += 1;
  steps_grey_[a] += step_grey;
  steps_grey_[b] += step_grey;
}

/// Goes on to the next candidate, but no further than kRun numbers: one insertion a unit.
void SegmentationJob::select_next() {
  const int numbers = map_.numbers();
  const int end = numbers - cursor_ < kRun ? numbers : cursor_ + kRun;
  while (cursor_ < end) {
    const auto number = static_cast<std::uint16_t>(cursor_++);
    if (!is_candidate(number)) continue;
    insert(number);
    break;
  }
  if (cursor_ == numbers) begin_paint();
}

bool SegmentationJob::is_candidate(std::uint16_t number) const {
  if (!map_.is_root(number)) return false;
  const auto image_area = static_cast<double>(width_ * height_);
  const std::uint32_t area = map_.area_px(number);
  if (static_cast<double>(area) > params_.max_area_fraction * image_area) return false;
  if (area * static_cast<std::uint32_t>(params_.scale_divisor * params_.scale_divisor) <
      static_cast<std::uint32_t>(params_.min_area_px)) {
    return false;
  }
  return steps_grey_[number] >= static_cast<std::uint32_t>(params_.min_contrast_grey) * outline_[number];
}

/// How much a region stands out: contrast times area.
std::uint64_t SegmentationJob::weight(std::uint16_t number) const {
  return outline_[number] == 0 ? 0
                               : std::uint64_t{steps_grey_[number]} * map_.area_px(number) / outline_[number];
}

/// Keeps `selected_` sorted: the heaviest first, equal ones by number. Weights are kept as well: without a
/// divider of 64 bits, a quotient takes hundreds of instructions.
void SegmentationJob::insert(std::uint16_t number) {
  const std::uint64_t own = weight(number);
  std::size_t place = selected_.size();
  while (place > 0 && weights_[place - 1] < own) --place;
  const auto room = static_cast<std::size_t>(params_.max_labels);
  if (selected_.size() == room) {
    ++dropped_;
    if (place == room) return;
  } else {
    selected_.resize(selected_.size() + 1);
  }
  for (std::size_t i = selected_.size() - 1; i > place; --i) {
    selected_[i] = selected_[i - 1];
    weights_[i] = weights_[i - 1];
  }
  selected_[place] = number;
  weights_[place] = own;
}

void SegmentationJob::begin_paint() {
  cursor_ = 0;
  phase_ = Phase::kPaint;
  if (selected_.empty()) {
    status_ = SegmentationStatus::kNoRegions;
    return;
  }
  sums_.clear();
  sums_.resize(selected_.size());
  for (std::size_t i = 0; i < selected_.size(); ++i) {
    label_of_[selected_[i]] = static_cast<std::uint8_t>(i + 1);
    sums_[i] = {0, 0, width_, -1, height_, -1, 0};
  }
}

void SegmentationJob::paint_row(int y) {
  const std::uint16_t* row = map_.row(y);
  std::uint8_t* out = &plane_[y * width_];
  const int border_above_below = (y == 0 ? 1 : 0) + (y == height_ - 1 ? 1 : 0);
  for (int x = 0; x < width_; ++x) {
    out[x] = label_of_[row[x]];
    if (out[x] == 0) continue;
    Sums& sums = sums_[out[x] - 1U];
    sums.x += static_cast<std::uint32_t>(x);
    sums.y += static_cast<std::uint32_t>(y);
    if (x < sums.x_min) sums.x_min = x;
    if (x > sums.x_max) sums.x_max = x;
    if (y < sums.y_min) sums.y_min = y;
    if (y > sums.y_max) sums.y_max = y;
    sums.border += border_above_below + (x == 0 ? 1 : 0) + (x == width_ - 1 ? 1 : 0);
  }
}

void SegmentationJob::finish() {
  const int divisor = params_.scale_divisor;
  // A working pixel's centre lies between the centres of the pixels that it was made of.
  const double offset = 0.5 * (divisor - 1);
  for (std::size_t i = 0; i < selected_.size(); ++i) {
    const std::uint16_t number = selected_[i];
    const Sums& sums = sums_[i];
    const auto area = static_cast<double>(map_.area_px(number));
    Region region;
    region.label = static_cast<std::uint8_t>(i + 1);
    region.area_px = static_cast<int>(map_.area_px(number)) * divisor * divisor;
    region.mean_grey = static_cast<float>(map_.mean_q8(number)) / 256.0F;
    region.outline_px = static_cast<int>(outline_[number]) * divisor;
    if (outline_[number] > 0) {
      region.contrast_grey = static_cast<float>(steps_grey_[number]) / static_cast<float>(outline_[number]);
    }
    region.centroid_u_px = static_cast<float>(divisor * (static_cast<double>(sums.x) / area) + offset);
    region.centroid_v_px = static_cast<float>(divisor * (static_cast<double>(sums.y) / area) + offset);
    region.u_min_px = sums.x_min * divisor;
    region.u_max_px = sums.x_max * divisor + divisor - 1;
    region.v_min_px = sums.y_min * divisor;
    region.v_max_px = sums.y_max * divisor + divisor - 1;
    region.border_px = sums.border * divisor;
    regions_.append(region);
  }
  status_ = SegmentationStatus::kDone;
}

}  // namespace cairn
