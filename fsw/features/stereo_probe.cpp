#include "features/stereo_probe.hpp"

#include <cmath>

namespace cairn {
namespace {

constexpr int kSide = 8;
constexpr int kHalf = kSide / 2;
constexpr int kWords = kSide * kSide / 2;  // of a window
constexpr double kMargin_px = 2.0;         // of the search range
constexpr std::uint32_t kSigns = 0x80008000U;
constexpr std::uint32_t kLargest = kSide * kSide * 255;  // no sum of differences is larger

std::uint32_t complement(std::uint32_t b) { return kSigns - b; }

/// Both halves, each below 2^15, of `b` its complement: a - b where it is positive, else 0.
/// |a - b| = 2 above(a, complement(b)) + b - a.
/// `signs`: kSigns, in a register.
std::uint32_t above(std::uint32_t a, std::uint32_t b_complement, std::uint32_t signs = kSigns) {
  const std::uint32_t difference = a + b_complement;
  const std::uint32_t sign = difference & signs;
  return difference & (sign - (sign >> 15U));
}

std::uint32_t both_halves(std::uint32_t word) { return (word >> 16U) + (word & 0xFFFFU); }

/// Of four words and complements.
inline std::uint32_t sum_of_four(const std::uint32_t* a, const std::uint32_t* b, std::uint32_t signs) {
  return above(a[0], b[0], signs) + above(a[1], b[1], signs) + above(a[2], b[2], signs) +
         above(a[3], b[3], signs);
}

/// |a - b|, of both halves.
std::uint32_t apart(std::uint32_t a, std::uint32_t b) { return 2 * above(a, complement(b)) + b - a; }

/// Is the sum of the differences of horizontal neighbours in a window at least so large? Where that of the
/// columns' sums is, so is that of the pixels.
bool has_texture(const std::uint32_t* columns, const std::uint32_t* window, int least) {
  std::uint32_t of_columns = 0;
  for (int k = 0; k + 1 < kSide; ++k) of_columns += apart(columns[k + 1], columns[k]);
  if (static_cast<int>(both_halves(of_columns)) >= least) return true;
  int sum = 0;
  for (int k = 0; k + 4 < kWords && sum < least; k += 4) {
    const std::uint32_t* here = window + k;
    std::uint32_t halves = 0;
    for (int j = 0; j < 4; ++j) halves += apart(here[j + 4], here[j]);
    sum += static_cast<int>(both_halves(halves));
  }
  return sum >= least;
}

}  // namespace

ProbeStatus StereoProbeJob::start(const StereoProbeParams& params, const ImageU8& left, const ImageU8& right,
                                  const Vec3& plane, int right_lower_px) {
  probes_.clear();
  const bool sizes = left.data != nullptr && right.data != nullptr && left.width == right.width &&
                     left.height == right.height && left.width >= 64 && left.height >= 64 &&
                     left.width <= cfg::kImageWidth && left.height <= cfg::kImageHeight &&
                     left.stride >= left.width && right.stride >= right.width;
  const bool ranges = params.min_disparity_px >= 1 && params.max_disparity_px > params.min_disparity_px &&
                      params.max_disparity_px < cfg::kImageWidth && params.below >= 0.0 &&
                      params.above >= 0.0;
  if (!sizes || !ranges || !std::isfinite(plane.squaredNorm())) return status_ = ProbeStatus::kBadInput;
  params_ = params;
  left_ = left;
  right_ = right;
  plane_ = plane;
  right_lower_px_ = right_lower_px;
  // Up to the double of the least sum: further than that there is little to dismiss.
  limit_q16_ = params.uniqueness >= 0.5 && params.uniqueness <= 1.0
                   ? static_cast<std::uint32_t>(65536.0 / params.uniqueness) + 1U
                   : 0U;
  boxes_ = around_ = nullptr;
  u_ = v_ = kHalf;
  chosen_ = false;
  prepared_ = 0;
  last_d_ = 0;
  return status_ = ProbeStatus::kRunning;
}

Progress StereoProbeJob::step(WorkBudget& budget) {
  while (status_ == ProbeStatus::kRunning) {
    if (!row_is_in_right()) {
      next_row();
      continue;
    }
    if (!chosen_) {
      if (!budget.take(row_ops(boxes_ == nullptr ? 0 : boxes_->size() + around_->size())))
        return Progress::kMore;
      choose_probes();
      continue;
    }
    while (prepared_ < 2) {
      if (!budget.take(band_ops(left_.width))) return Progress::kMore;
      if (prepared_++ == 0) {
        prepare<false>(left_, v_, left_band_);
      } else {
        prepare<true>(right_, v_ + right_lower_px_, right_band_);
      }
    }
    const Range range = search_range(u_, v_);
    const int steps = range.high - range.low + 1;
    if (!budget.take(probe_ops(steps))) return Progress::kMore;
    if (steps >= 4) budget.charge(probe(u_, v_, range));
    u_ += kSpacing;
    next_probe();
  }
  return Progress::kDone;
}

bool StereoProbeJob::row_is_in_right() const {
  const int v = v_ + right_lower_px_;
  return v >= kHalf && v + kHalf <= right_.height;
}

void StereoProbeJob::next_row() {
  u_ = kHalf;
  v_ += kSpacing;
  chosen_ = false;
  prepared_ = 0;
  if (v_ + kHalf > left_.height) status_ = ProbeStatus::kDone;
}

/// Where boxes begin less where they end: however many lie upon each other, each is looked at once.
void StereoProbeJob::count_boxes(const Boxes& boxes, std::int16_t (&edges)[kCells + 1]) const {
  for (std::int16_t& edge : edges) edge = 0;
  for (const PixelBounds& box : boxes) {
    if (v_ < box.v_min || v_ > box.v_max || box.u_max < kHalf) continue;
    const int first = box.u_min <= kHalf ? 0 : (box.u_min - kHalf + kSpacing - 1) / kSpacing;
    const int last = (box.u_max - kHalf) / kSpacing;
    if (first >= kCells || last < first) continue;
    ++edges[first];
    --edges[last < kCells ? last + 1 : kCells];
  }
}

void StereoProbeJob::choose_probes() {
  const int row = v_ / kSpacing;
  chosen_ = true;
  if (boxes_ == nullptr) {
    for (bool& wanted : wanted_) wanted = true;
  } else {
    std::int16_t within[kCells + 1];
    std::int16_t about[kCells + 1];
    count_boxes(*boxes_, within);
    count_boxes(*around_, about);
    int all = 0;
    int half = 0;
    for (int i = 0; i < kCells; ++i) {
      all += within[i];
      half += about[i];
      const bool quarter = row % 2 == 0 && i % 2 == 0;
      wanted_[i] = all > 0 || quarter || (half > 0 && (row + i) % 2 == 0);
    }
  }
  next_probe();
}

/// From u_ on.
void StereoProbeJob::next_probe() {
  while (u_ + kHalf <= left_.width && !wanted_[(u_ - kHalf) / kSpacing]) u_ += kSpacing;
  if (u_ + kHalf > left_.width) next_row();
}

template <bool kComplements>
void StereoProbeJob::prepare(const ImageU8& image, int v, Band& band) {
  const std::uint8_t* rows[kSide];
  for (int j = 0; j < kSide; ++j) rows[j] = image.row(v - kHalf + j);
  const auto stored = [](std::uint32_t word) { return kComplements ? complement(word) : word; };
  std::uint32_t* pairs = band.pairs;
  std::uint32_t before[3] = {};  // sums of the last columns
  for (int x = 0; x < image.width; ++x, pairs += kHalf) {
    const std::uint32_t p0 = std::uint32_t{rows[0][x]} << 16U | rows[4][x];
    const std::uint32_t p1 = std::uint32_t{rows[1][x]} << 16U | rows[5][x];
    const std::uint32_t p2 = std::uint32_t{rows[2][x]} << 16U | rows[6][x];
    const std::uint32_t p3 = std::uint32_t{rows[3][x]} << 16U | rows[7][x];
    const std::uint32_t sum = p0 + p1 + p2 + p3;
    if (x >= 3) band.quarters[x - 3] = before[0] + before[1] + before[2] + sum;
    before[0] = before[1];
    before[1] = before[2];
    before[2] = sum;
    band.columns[x] = stored(sum);
    pairs[0] = stored(p0);
    pairs[1] = stored(p1);
    pairs[2] = stored(p2);
    pairs[3] = stored(p3);
  }
}

StereoProbeJob::Range StereoProbeJob::search_range(int u, int v) const {
  const double d = plane_[0] * u + plane_[1] * v + plane_[2];
  double low = d * (1.0 - params_.below) - kMargin_px;
  double high = d * (1.0 + params_.above) + kMargin_px;
  const auto most =
      static_cast<double>(u - kHalf < params_.max_disparity_px ? u - kHalf : params_.max_disparity_px);
  // What is found short of ground beyond the end is farther than it, and lower: a hole that is none.
  if (!(d + kMargin_px <= most)) return {0, -1};
  if (!(low > params_.min_disparity_px)) low = params_.min_disparity_px;
  if (!(high < most)) high = most;
  if (!(high > low)) return {0, -1};
  const Range range = {static_cast<int>(low), static_cast<int>(high)};
  return {range.low, range.high - range.low < kMaxRange ? range.high : range.low + kMaxRange - 1};
}

/// No rival of the least sum is larger.
std::uint32_t StereoProbeJob::most_of_rivals(const Search& s, std::uint32_t least) const {
  return s.left_sum + (limit_q16_ == 0 ? kLargest : ((least - s.left_sum) * limit_q16_ >> 16U) + 1U);
}

/// Sum over half a window: four columns, from these two on.
std::uint32_t StereoProbeJob::half(int left_x, int x) const {
  const std::uint32_t* left = &left_band_.pairs[kHalf * left_x];
  const std::uint32_t* right = &right_band_.pairs[kHalf * x];
  const std::uint32_t signs = signs_;
  std::uint32_t sum = 0;
  for (int k = 0; k < kWords / 2; k += 4) sum += sum_of_four(left + k, right + k, signs);
  return both_halves(2 * sum + right_band_.quarters[x]);
}

/// Compares the windows at a disparity, half by half, until they are known to differ by more than `most`. The
/// halves differ by what their columns' sums do, and more.
void StereoProbeJob::compare(Search& s, Compared& at, std::uint32_t most) const {
  const int x = s.x - at.d;
  if (at.by == By::kQuarters) {
    const std::uint32_t* left = &left_band_.columns[s.x];
    const std::uint32_t* right = &right_band_.columns[x];
    const std::uint32_t* quarters = &right_band_.quarters[x];
    const std::uint32_t signs = signs_;
    at.second = both_halves(2 * sum_of_four(left + kHalf, right + kHalf, signs) + quarters[kHalf]);
    at.sum = both_halves(2 * sum_of_four(left, right, signs) + quarters[0]) + at.second;
    at.by = By::kColumns;
    s.cost += kSide;
    if (at.sum > most) return;
  }
  if (at.by == By::kColumns) {
    at.sum = half(s.x, x) + at.second;
    at.by = By::kHalf;
    s.cost += kWords / 2;
    if (at.sum > most) return;
  }
  at.sum += half(s.x + kHalf, x + kHalf) - at.second;
  at.by = By::kPixels;
  s.cost += kWords / 2;
}

/// Where the sum is least, of equal ones at the smallest disparity; and what may rival it.
StereoProbeJob::Compared StereoProbeJob::find_least(Search& s, const Range& range) const {
  const int begin = last_d_ < range.low ? range.low : last_d_ > range.high ? range.high : last_d_;
  Compared best = {begin, By::kQuarters, 0, 0};
  compare(s, best, UINT32_MAX);
  s.seen[0] = best;
  s.count = 1;
  const std::uint32_t left[2] = {left_band_.quarters[s.x], left_band_.quarters[s.x + kHalf]};
  const std::uint32_t* right = &right_band_.quarters[s.x - range.low];
  const std::uint32_t signs = signs_;
  std::uint32_t most = most_of_rivals(s, best.sum);
  for (int d = range.low; d <= range.high; ++d, --right) {
    const std::uint32_t least = both_halves(
        2 * (above(left[0], complement(right[0]), signs) + above(left[1], complement(right[kHalf]), signs)) +
        right[0] + right[kHalf]);
    if (least > most || d == begin) continue;
    Compared& at = s.seen[s.count++];
    at = {d, By::kQuarters, least, 0};
    if (least > best.sum) continue;
    compare(s, at, best.sum);
    if (at.sum > best.sum || (at.sum == best.sum && d > best.d)) continue;
    best = at;
    most = most_of_rivals(s, best.sum);
  }
  return best;
}

/// Returns the cost above that of looking at each disparity.
std::uint32_t StereoProbeJob::probe(int u, int v, const Range& range) {
  Search s;
  s.x = u - kHalf;
  if (!has_texture(&left_band_.columns[s.x], &left_band_.pairs[kHalf * s.x], params_.min_texture)) return 0;
  s.left_sum = both_halves(left_band_.quarters[s.x] + left_band_.quarters[s.x + kHalf]);
  s.cost = 0;
  const Compared best = find_least(s, range);
  last_d_ = best.d;
  StereoProbe found = {static_cast<std::int16_t>(u), static_cast<std::int16_t>(v), 0.0F};
  if (best.d != range.low && best.d != range.high && judge(s, best, found.d_px)) probes_.append(found);
  return s.cost;
}

/// False: the least sum has a rival.
bool StereoProbeJob::judge(Search& s, const Compared& best, float& d_px) const {
  const std::uint32_t most = most_of_rivals(s, best.sum);
  const auto least = static_cast<double>(best.sum - s.left_sum);
  Compared beside[2] = {{best.d - 1, By::kQuarters, 0, 0}, {best.d + 1, By::kQuarters, 0, 0}};
  for (int i = 0; i < s.count; ++i) {
    Compared& other = s.seen[i];
    if (other.sum > most) continue;
    if (other.d >= best.d - 2 && other.d <= best.d + 2) {
      if (other.d == best.d - 1) beside[0] = other;
      if (other.d == best.d + 1) beside[1] = other;
      continue;
    }
    if (other.by != By::kPixels) compare(s, other, most);
    if (other.sum <= most && least >= params_.uniqueness * static_cast<double>(other.sum - s.left_sum))
      return false;
  }
  for (Compared& side : beside) {
    if (side.by != By::kPixels) compare(s, side, UINT32_MAX);
  }
  const auto before = static_cast<float>(beside[0].sum);
  const auto after = static_cast<float>(beside[1].sum);
  const auto here = static_cast<float>(best.sum);
  const float steeper = before > after ? before - here : after - here;
  const float offset = steeper > 0.0F ? 0.5F * (before - after) / steeper : 0.0F;
  d_px = static_cast<float>(best.d) + offset;
  return true;
}

}  // namespace cairn
