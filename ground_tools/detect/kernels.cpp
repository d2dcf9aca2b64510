#include "detect/kernels.hpp"

#include <algorithm>
#include <cstring>

#include "core/assert.hpp"

namespace cairn::ground {
namespace {

constexpr int kRowsAPart = 64;

int in_chunks(int rows) { return (rows + kRowsAPart - 1) / kRowsAPart * kRowsAPart; }

}  // namespace

int otsu_threshold(const Histogram& histogram) {
  double total = 0.0;
  double weighted = 0.0;
  int best = 0;
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    total += static_cast<double>(histogram[i]);
    weighted += static_cast<double>(histogram[i]) * static_cast<double>(i);
    if (histogram[i] != 0) best = static_cast<int>(i);
  }
  double best_between = 0.0;
  double dark_count = 0.0;
  double dark_sum = 0.0;
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    if (histogram[i] == 0) continue;  // splits as the bin before
    dark_count += static_cast<double>(histogram[i]);
    dark_sum += static_cast<double>(histogram[i]) * static_cast<double>(i);
    const double bright_count = total - dark_count;
    if (bright_count == 0.0) break;
    const double apart = (weighted - dark_sum) / bright_count - dark_sum / dark_count;
    const double between = (dark_count / total) * (bright_count / total) * apart * apart;
    if (between > best_between) {
      best_between = between;
      best = static_cast<int>(i);
    }
  }
  return best;
}

RowWindow::RowWindow(RasterReader& reader, const GreyRange& range, const PixelBox& box, int rows_kept,
                     bool all_valid)
    : reader_(reader),
      range_(range),
      box_(box),
      all_valid_(all_valid),
      rows_(std::min(in_chunks(rows_kept) + kRowsAPart, in_chunks(box.height()))),
      next_row_(box.y0),
      width_(static_cast<std::size_t>(box.width())) {
  const auto pixels = static_cast<std::size_t>(rows_) * width_;
  grey_.resize(pixels);
  if (!all_valid) missing_.resize(pixels);
  has_missing_.resize(static_cast<std::size_t>(rows_));
}

void RowWindow::read_to(int y) {
  CAIRN_ASSERT(y >= box_.y0 && y < box_.y1);
  while (next_row_ <= y) {
    const PixelBox part{box_.x0, next_row_, box_.x1, std::min(next_row_ + kRowsAPart, box_.y1)};
    const std::size_t first = slot(next_row_);
    std::uint8_t* const flags = all_valid_ ? nullptr : &missing_[first * width_];
    const bool any = reader_.read(part, range_, &grey_[first * width_], flags, box_.width());
    for (std::size_t i = 0; i < static_cast<std::size_t>(part.height()); ++i) {
      const bool gone =
          any && !all_valid_ && std::memchr(&missing_[(first + i) * width_], 1, width_) != nullptr;
      has_missing_[first + i] = gone ? 1 : 0;
    }
    next_row_ = part.y1;
  }
}

const std::uint8_t* RowWindow::grey(int y) {
  read_to(y);
  return &grey_[slot(y) * width_];
}

const std::uint8_t* RowWindow::missing(int y) {
  read_to(y);
  return has_missing_[slot(y)] != 0 ? &missing_[slot(y) * width_] : nullptr;
}

DifferenceRows::DifferenceRows(RowWindow& rows, const PixelBox& box, const PixelBox& image, int radius)
    : rows_(rows),
      box_(box),
      image_(image),
      radius_(radius),
      y_(box.y0),
      top_(std::max(box.y0 - radius, image.y0)),
      bottom_(top_) {
  CAIRN_ASSERT(radius >= 0 && radius <= kMostRadiusPx);
  const PixelBox from = box.grown(radius, image);
  CAIRN_ASSERT(from.x0 == rows.box().x0 && from.x1 == rows.box().x1);
  const auto width = static_cast<std::size_t>(box.width());
  const auto wide = static_cast<std::size_t>(from.width());
  sums_.resize(wide);
  gone_.resize(wide);
  prefix_.resize(width + 2 * static_cast<std::size_t>(radius) + 1);
  gone_prefix_.resize(prefix_.size());
  half_.resize(width);
  inverse_.resize(width);
  mean_.resize(width);
  for (int x = box.x0; x < box.x1; ++x)
    columns_.push_back(std::min(x + radius + 1, image.x1) - std::max(x - radius, image.x0));
}

void DifferenceRows::slide_to(int y) {
  const int top = std::max(y - radius_, image_.y0);
  const int bottom = std::min(y + radius_ + 1, image_.y1);
  const std::size_t n = sums_.size();
  if (bottom == bottom_ + 1 && top == top_ + 1) {
    const std::uint8_t* const enters = rows_.grey(bottom_);
    rows::slide(sums_.data(), enters, rows_.grey(top_), n);
  } else {
    for (int i = bottom_; i < bottom; ++i) rows::add(sums_.data(), rows_.grey(i), n);
    for (int i = top_; i < top; ++i) rows::subtract(sums_.data(), rows_.grey(i), n);
  }
  for (; bottom_ < bottom; ++bottom_) {
    const std::uint8_t* const gone = rows_.missing(bottom_);
    if (gone == nullptr) continue;
    rows::add(gone_.data(), gone, n);
    ++gone_rows_;
  }
  for (; top_ < top; ++top_) {
    const std::uint8_t* const gone = rows_.missing(top_);
    if (gone == nullptr) continue;
    rows::subtract(gone_.data(), gone, n);
    --gone_rows_;
  }
}

void DifferenceRows::full_counts(int rows) {
  if (rows == counted_) return;
  counted_ = rows;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const std::int32_t count = columns_[i] * rows;
    half_[i] = static_cast<double>(count / 2) + 0.5;
    inverse_[i] = 1.0 / static_cast<double>(count);
  }
}

void DifferenceRows::means(int y) {
  slide_to(y);
  const auto left = static_cast<std::size_t>(std::max(0, image_.x0 - (box_.x0 - radius_)));
  const std::size_t end = left + sums_.size();
  rows::prefix(sums_.data(), &prefix_[left], sums_.size());
  std::fill(prefix_.begin() + static_cast<std::ptrdiff_t>(end) + 1, prefix_.end(), prefix_[end]);
  const std::size_t span = 2 * static_cast<std::size_t>(radius_) + 1;
  const int rows = bottom_ - top_;
  if (gone_rows_ == 0) {
    full_counts(rows);
    rows::means(prefix_.data(), span, half_.data(), inverse_.data(), mean_.data(), mean_.size());
    return;
  }
  rows::prefix(gone_.data(), &gone_prefix_[left], gone_.size());
  std::fill(gone_prefix_.begin() + static_cast<std::ptrdiff_t>(end) + 1, gone_prefix_.end(),
            gone_prefix_[end]);
  rows::means_of_valid(prefix_.data(), gone_prefix_.data(), span, columns_.data(), rows, mean_.data(),
                       mean_.size());
}

void DifferenceRows::next(std::uint8_t* out) {
  means(y_);
  const auto inset = static_cast<std::size_t>(box_.x0 - rows_.box().x0);
  rows::differences(rows_.grey(y_) + inset, mean_.data(), out, mean_.size());
  ++y_;
  const std::uint8_t* const gone = missing_of_last();
  if (gone != nullptr) rows::put_level(gone, out, mean_.size());
}

const std::uint8_t* DifferenceRows::missing_of_last() {
  const std::uint8_t* const gone = rows_.missing(y_ - 1);
  return gone == nullptr ? nullptr : gone + (box_.x0 - rows_.box().x0);
}

MedianRows::MedianRows(const PixelBox& box, const PixelBox& image, int radius)
    : box_(box),
      from_(box.grown(radius, image)),
      radius_(radius),
      next_in_(from_.y0),
      next_out_(box.y0),
      width_(static_cast<std::size_t>(box.width() + 2 * radius)) {
  CAIRN_ASSERT(radius >= 0 && radius <= kMostRadius);
  ring_.resize(width_ * (2 * static_cast<std::size_t>(radius) + 2));
  counts_.resize(width_);
  for (auto& each : partial_) each.resize(width_);
}

const std::uint8_t* MedianRows::row(int y) const {
  const int inside = std::clamp(y, from_.y0, from_.y1 - 1);
  return &ring_[static_cast<std::size_t>((inside - from_.y0) % (2 * radius_ + 2)) * width_];
}

void MedianRows::push(const std::uint8_t* row_in) {
  auto* const to = const_cast<std::uint8_t*>(row(next_in_));
  const auto left = static_cast<std::size_t>(from_.x0 - (box_.x0 - radius_));
  const auto wide = static_cast<std::size_t>(from_.width());
  std::memset(to, row_in[0], left);
  std::memcpy(to + left, row_in, wide);
  std::memset(to + left + wide, row_in[wide - 1], width_ - left - wide);
  ++next_in_;
}

bool MedianRows::ready() const {
  return next_out_ < box_.y1 && next_in_ > std::min(next_out_ + radius_, from_.y1 - 1);
}

void MedianRows::pop(std::uint8_t* out) {
  CAIRN_ASSERT(ready());
  if (!filled_) {
    for (int i = -radius_; i <= radius_; ++i) rows::add_bytes(counts_.data(), row(next_out_ + i), width_);
    filled_ = true;
  } else {
    rows::add_bytes(counts_.data(), row(next_out_ + radius_), width_);
    rows::subtract_bytes(counts_.data(), row(next_out_ - radius_ - 1), width_);
  }
  rows::majority(counts_.data(), 2 * radius_ + 1, partial_[0].data(), partial_[1].data(), partial_[2].data(),
                 out, static_cast<std::size_t>(box_.width()));
  ++next_out_;
}

}  // namespace cairn::ground
