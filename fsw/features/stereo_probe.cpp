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
std::uint32_t above(std::uint32_t a, std::uint32_t b_complement) {
  const std::uint32_t difference = a + b_complement;
  const std::uint32_t sign = difference & kSigns;
  return difference & (sign - (sign >> 15U));
}

std::uint32_t both_halves(std::uint32_t word) { return (word >> 16U) + (word & 0xFFFFU); }

/// Of words and complements.
std::uint32_t sum_above(const std::uint32_t* a, const std::uint32_t* b, int words) {
  std::uint32_t sum = 0;
  for (int k = 0; k < words; k += 4) {
    sum += above(a[k], b[k]) + above(a[k + 1], b[k + 1]);
    sum += above(a[k + 2], b[k + 2]) + above(a[k + 3], b[k + 3]);
  }
  return sum;
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
  boxes_ = nullptr;
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
      if (!budget.take(row_ops(boxes_ == nullptr ? 0 : boxes_->size()))) return Progress::kMore;
      choose_probes();
      continue;
    }
    while (prepared_ < 2) {
      if (!budget.take(band_ops(left_.width))) return Progress::kMore;
      const bool right = prepared_++ == 1;
      prepare(right ? right_ : left_, right ? v_ + right_lower_px_ : v_, right ? right_band_ : left_band_,
              right);
      if (right) sum_windows();
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

void StereoProbeJob::choose_probes() {
  const bool sparse = v_ / kSpacing % 2 == 0;
  chosen_ = true;
  // Where boxes begin less where they end: however many lie upon each other, each is looked at once.
  std::int16_t edges[kCells + 1] = {};
  if (boxes_ != nullptr) {
    for (const PixelBounds& box : *boxes_) {
      if (v_ < box.v_min || v_ > box.v_max || box.u_max < kHalf) continue;
      const int first = box.u_min <= kHalf ? 0 : (box.u_min - kHalf + kSpacing - 1) / kSpacing;
      const int last = (box.u_max - kHalf) / kSpacing;
      if (first >= kCells || last < first) continue;
      ++edges[first];
      --edges[last < kCells ? last + 1 : kCells];
    }
  }
  int covered = boxes_ == nullptr ? 1 : 0;
  for (int i = 0; i < kCells; ++i) {
    covered += edges[i];
    wanted_[i] = covered > 0 || (sparse && i % 2 == 0);
  }
  next_probe();
}

/// From u_ on.
void StereoProbeJob::next_probe() {
  while (u_ + kHalf <= left_.width && !wanted_[(u_ - kHalf) / kSpacing]) u_ += kSpacing;
  if (u_ + kHalf > left_.width) next_row();
}

void StereoProbeJob::prepare(const ImageU8& image, int v, Band& band, bool complements) {
  const std::uint8_t* rows[kSide];
  for (int j = 0; j < kSide; ++j) rows[j] = image.row(v - kHalf + j);
  const std::uint32_t flip = complements ? ~0U : 0U;  // (a ^ flip) + base is a, or its complement
  const std::uint32_t base = complements ? kSigns + 1U : 0U;
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
    band.columns[x] = (sum ^ flip) + base;
    pairs[0] = (p0 ^ flip) + base;
    pairs[1] = (p1 ^ flip) + base;
    pairs[2] = (p2 ^ flip) + base;
    pairs[3] = (p3 ^ flip) + base;
  }
}

void StereoProbeJob::sum_windows() {
  const std::uint32_t* quarters = right_band_.quarters;
  for (int x = 0; x + kSide <= right_.width; ++x)
    right_windows_[x] = static_cast<std::uint16_t>(both_halves(quarters[x] + quarters[x + kHalf]));
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

/// No rival of `least` (see judge) is larger.
std::uint32_t StereoProbeJob::limit_above(std::uint32_t least) const {
  return limit_q16_ == 0 ? kLargest : (least * limit_q16_ >> 16U) + 1U;
}

/// Looks at the disparities from one to another, both inside.
void StereoProbeJob::scan(Search& s, int from_d, int to_d, int by) const {
  const std::uint32_t left[2] = {left_band_.quarters[s.x], left_band_.quarters[s.x + kHalf]};
  const std::uint32_t* right = &right_band_.quarters[s.x - from_d];
  const std::uint16_t* window = &right_windows_[s.x - from_d];
  std::uint32_t most = s.limit + s.left_sum;
  for (int d = from_d; d != to_d + by; d += by, right -= by, window -= by) {
    // -limit <= left_sum - *window <= limit, in one comparison.
    if (most - *window > 2U * s.limit) continue;
    const std::uint32_t quarters =
        2 * (above(left[0], complement(right[0])) + above(left[1], complement(right[kHalf]))) + right[0] +
        right[kHalf];
    if (both_halves(quarters) > most) continue;
    compare(s, d);
    most = s.limit + s.left_sum;
  }
}

/// Compares the windows at disparity `d`, unless their columns tell that it cannot matter.
void StereoProbeJob::compare(Search& s, int d) const {
  const std::uint32_t* right = &right_band_.columns[s.x - d];
  const std::uint32_t columns = 2 * sum_above(&left_band_.columns[s.x], right, kSide) +
                                right_band_.quarters[s.x - d] + right_band_.quarters[s.x + kHalf - d];
  s.cost += kSide;
  if (both_halves(columns) > s.limit + s.left_sum) return;
  const Compared now = {d, difference(s, d)};
  s.cost += kWords;
  s.compared[s.count++] = now;
  if (now.sum > s.best.sum || (now.sum == s.best.sum && d > s.best.d)) return;
  s.best = now;
  s.limit = limit_above(now.sum);
}

/// Sum of absolute differences of the windows at disparity `d`.
std::uint32_t StereoProbeJob::difference(const Search& s, int d) const {
  const int x = s.x - d;
  return both_halves(2 * sum_above(&left_band_.pairs[4 * s.x], &right_band_.pairs[4 * x], kWords) +
                     right_band_.quarters[x] + right_band_.quarters[x + kHalf]) -
         s.left_sum;
}

/// Returns the cost above that of looking at each disparity.
std::uint32_t StereoProbeJob::probe(int u, int v, const Range& range) {
  Search s;
  s.x = u - kHalf;
  if (!has_texture(&left_band_.columns[s.x], &left_band_.pairs[4 * s.x], params_.min_texture)) return 0;
  s.left_sum = both_halves(left_band_.quarters[s.x] + left_band_.quarters[s.x + kHalf]);
  s.best = {0, UINT32_MAX};
  s.limit = kLargest;
  s.cost = 0;
  s.count = 0;
  int first = last_d_ < range.low ? range.low : last_d_;
  if (first > range.high) first = range.high;
  scan(s, first, range.high, 1);
  scan(s, first - 1, range.low, -1);
  last_d_ = s.best.d;
  StereoProbe found = {static_cast<std::int16_t>(u), static_cast<std::int16_t>(v), 0.0F};
  if (judge(s, range, found.d_px)) {
    probes_.append(found);
  }
  return s.cost;
}

/// False: the best disparity lies at an end of the range or has a rival.
bool StereoProbeJob::judge(const Search& s, const Range& range, float& d_px) const {
  const int best = s.best.d;
  if (best == range.low || best == range.high) return false;
  std::uint32_t rival = UINT32_MAX;
  std::uint32_t beside[2] = {UINT32_MAX, UINT32_MAX};
  for (int i = 0; i < s.count; ++i) {
    const Compared& other = s.compared[i];
    const bool apart = other.d < best - 2 || other.d > best + 2;
    if (apart && other.sum < rival) rival = other.sum;
    if (other.d == best - 1) beside[0] = other.sum;
    if (other.d == best + 1) beside[1] = other.sum;
  }
  if (rival != UINT32_MAX &&
      static_cast<double>(s.best.sum) >= params_.uniqueness * static_cast<double>(rival)) {
    return false;
  }
  for (int side = 0; side < 2; ++side) {
    if (beside[side] != UINT32_MAX) continue;
    beside[side] = difference(s, side == 0 ? best - 1 : best + 1);
  }
  const auto before = static_cast<float>(beside[0]);
  const auto after = static_cast<float>(beside[1]);
  const auto least = static_cast<float>(s.best.sum);
  const float steeper = before > after ? before - least : after - least;
  const float offset = steeper > 0.0F ? 0.5F * (before - after) / steeper : 0.0F;
  d_px = static_cast<float>(best) + offset;
  return true;
}

}  // namespace cairn
