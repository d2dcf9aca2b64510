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

/// What is known of a disparity's sum (of absolute differences, and of the left window's grey values), in a
/// word: the sum above the disparity, so that the least word is of the least sum, at its smallest disparity;
/// and a lowest bit where the sum may be larger.
std::uint32_t exactly(std::uint32_t sum, int d) { return sum << 16U | static_cast<std::uint32_t>(d) << 1U; }
std::uint32_t at_least(std::uint32_t sum, int d) { return exactly(sum, d) | 1U; }
bool is_exact(std::uint32_t seen) { return (seen & 1U) == 0; }
std::uint32_t sum_of(std::uint32_t seen) { return seen >> 16U; }
int disparity_of(std::uint32_t seen) { return static_cast<int>(seen & 0xFFFFU) >> 1; }
static_assert(2 * kLargest < 1U << 16U && cfg::kImageWidth < 1 << 15);

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
  planned_ops_ = UINT32_MAX;
  spent_ops_ = probe_ops_ = probe_weight_ = 0;
  rows_ = wanted_probes_ = thinned_rows_ = 0;
  return status_ = ProbeStatus::kRunning;
}

Progress StereoProbeJob::step(WorkBudget& budget) {
  while (status_ == ProbeStatus::kRunning) {
    if (!row_is_in_right()) {
      next_row();
      continue;
    }
    if (!chosen_) {
      const std::uint32_t cost = row_ops(boxes_ == nullptr ? 0 : boxes_->size() + around_->size());
      if (!budget.take(cost)) return Progress::kMore;
      spent_ops_ += cost;
      choose_probes();
      continue;
    }
    while (prepared_ < 2) {
      if (!budget.take(band_ops(left_.width))) return Progress::kMore;
      spent_ops_ += band_ops(left_.width);
      if (prepared_++ == 0) {
        prepare<false>(left_, v_, left_band_);
      } else {
        prepare<true>(right_, v_ + right_lower_px_, right_band_);
      }
    }
    const Range range = search_range(u_, v_);
    const int steps = range.high - range.low + 1;
    if (!budget.take(probe_ops(steps))) return Progress::kMore;
    const std::uint32_t more = steps >= 4 ? probe(u_, v_, range) : 0;
    budget.charge(more);
    const std::uint32_t least = probe_ops(steps);
    spent_ops_ += least + more;
    probe_ops_ += least + more;
    probe_weight_ += least;
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

/// Of one on the row's middle: what it costs where nothing is compared.
double StereoProbeJob::weight_of_probe(int v) const {
  const Range range = search_range(left_.width / 2, v);
  return probe_ops(range.high - range.low + 1);
}

/// Each how manieth of this row's probes there is room for: 1, 2 or 4. What those before took for their
/// weight, those below will; and the next step is never so large that the rest can't make up for it.
int StereoProbeJob::thinning(int wanted) {
  ++rows_;
  wanted_probes_ += wanted;
  if (probe_weight_ == 0 || planned_ops_ == UINT32_MAX) return 1;
  const double rate = static_cast<double>(probe_ops_) / probe_weight_;
  const int below = (left_.height - kHalf - v_) / kSpacing;
  const double here = rate * wanted * weight_of_probe(v_);
  const double rest =
      rate * wanted_probes_ / rows_ * below * weight_of_probe(v_ + (below + 1) / 2 * kSpacing);
  const double bands = 2.0 * (below + 1) * band_ops(left_.width);
  const double left = static_cast<double>(planned_ops_) - spent_ops_ - bands;
  if (here + 0.5 * rest <= left) return 1;
  ++thinned_rows_;
  return 0.5 * here + 0.25 * rest <= left ? 2 : 4;
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
  int wanted = 0;
  for (const bool is_wanted : wanted_) wanted += is_wanted ? 1 : 0;
  const int each = thinning(wanted);
  for (int i = 0; i < kCells && each > 1; ++i)
    wanted_[i] = wanted_[i] && (each == 2 ? (row + i) % 2 == 0 : row % 2 == 0 && i % 2 == 0);
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
  const int width = image.width;
  for (int x = 0; x < width; ++x, pairs += kHalf) {
    std::uint32_t sum = 0;
    for (int j = 0; j < kHalf; ++j) {  // not all at once: a write buffer holds one word
      const std::uint32_t pair = std::uint32_t{rows[j][x]} << 16U | rows[j + kHalf][x];
      pairs[j] = stored(pair);
      sum += pair;
    }
    band.columns[x] = stored(sum);
    if (x >= 3) band.quarters[x - 3] = before[0] + before[1] + before[2] + sum;
    before[0] = before[1];
    before[1] = before[2];
    before[2] = sum;
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

/// Sum over half a window: four columns, from these two on; or over two of them, where that is above `most`.
/// (All four at once need more registers than there are.)
std::uint32_t StereoProbeJob::half(int left_x, int x, std::uint32_t most) const {
  const std::uint32_t* left = &left_band_.pairs[kHalf * left_x];
  const std::uint32_t* right = &right_band_.pairs[kHalf * x];
  const std::uint32_t signs = signs_;
  const auto two_columns = [&](int k) {
    return 2 * (sum_of_four(left + k, right + k, signs) + sum_of_four(left + k + 4, right + k + 4, signs));
  };
  std::uint32_t sum = right_band_.quarters[x] + two_columns(0);
  if (both_halves(sum) > most) return both_halves(sum);
  sum += two_columns(kWords / 4);
  return both_halves(sum);
}

/// Compares the windows at a disparity until their columns' sums are known to differ by more than
/// `by_columns`, or their pixels by more than `most`. The pixels differ by what the sums do, and more.
StereoProbeJob::Seen StereoProbeJob::compare(Search& s, int d, std::uint32_t by_columns,
                                             std::uint32_t most) const {
  const int x = s.x - d;
  const std::uint32_t* left = &left_band_.columns[s.x];
  const std::uint32_t* right = &right_band_.columns[x];
  const std::uint32_t* quarters = &right_band_.quarters[x];
  const std::uint32_t second =
      both_halves(2 * sum_of_four(left + kHalf, right + kHalf, signs_) + quarters[kHalf]);
  const std::uint32_t columns = both_halves(2 * sum_of_four(left, right, signs_) + quarters[0]) + second;
  s.cost += kSide;
  if (columns > by_columns) return at_least(columns, d);
  const std::uint32_t first = half(s.x, x, most - second);
  s.cost += kWords / 2;
  if (first + second > most) return at_least(first + second, d);
  const std::uint32_t sum = first + half(s.x + kHalf, x + kHalf, most - first);
  s.cost += kWords / 2;
  return sum > most ? at_least(sum, d) : exactly(sum, d);
}

/// Where the sum is least, of equal ones at the smallest disparity; and what may rival it.
StereoProbeJob::Seen StereoProbeJob::find_least(Search& s, const Range& range) const {
  const int begin = last_d_ < range.low ? range.low : last_d_ > range.high ? range.high : last_d_;
  Seen best = compare(s, begin, UINT32_MAX, UINT32_MAX);
  Seen* seen = s.seen;
  *seen++ = best;
  const std::uint32_t left[2] = {left_band_.quarters[s.x], left_band_.quarters[s.x + kHalf]};
  const std::uint32_t* right = &right_band_.quarters[s.x - range.low];
  const std::uint32_t signs = signs_;
  std::uint32_t most = most_of_rivals(s, sum_of(best));
  for (int d = range.low; d <= range.high; ++d, --right) {
    const std::uint32_t least = both_halves(
        2 * (above(left[0], complement(right[0]), signs) + above(left[1], complement(right[kHalf]), signs)) +
        right[0] + right[kHalf]);
    if (least > most || d == begin) continue;
    Seen at = at_least(least, d);
    if (least <= sum_of(best)) at = compare(s, d, sum_of(best), most);
    *seen++ = at;
    if (at > best) continue;
    best = at;
    most = most_of_rivals(s, sum_of(best));
  }
  s.end = seen;
  return best;
}

/// Returns the cost above that of looking at each disparity.
std::uint32_t StereoProbeJob::probe(int u, int v, const Range& range) {
  Search s;
  s.x = u - kHalf;
  if (!has_texture(&left_band_.columns[s.x], &left_band_.pairs[kHalf * s.x], params_.min_texture)) return 0;
  s.left_sum = both_halves(left_band_.quarters[s.x] + left_band_.quarters[s.x + kHalf]);
  s.cost = 0;
  const Seen best = find_least(s, range);
  const int d = disparity_of(best);
  last_d_ = d;
  StereoProbe found = {static_cast<std::int16_t>(u), static_cast<std::int16_t>(v), 0.0F};
  if (d != range.low && d != range.high && judge(s, best, found.d_px)) probes_.append(found);
  return s.cost;
}

/// False: the least sum has a rival.
bool StereoProbeJob::judge(Search& s, Seen best, float& d_px) const {
  const std::uint32_t most = most_of_rivals(s, sum_of(best));
  const int d = disparity_of(best);
  const auto least = static_cast<double>(sum_of(best) - s.left_sum);
  Seen beside[2] = {at_least(0, d - 1), at_least(0, d + 1)};
  for (const Seen* other = s.seen; other != s.end; ++other) {
    if (sum_of(*other) > most) continue;
    const int away = disparity_of(*other) - d;
    if (away >= -2 && away <= 2) {
      if (away == -1) beside[0] = *other;
      if (away == 1) beside[1] = *other;
      continue;
    }
    const Seen at = is_exact(*other) ? *other : compare(s, disparity_of(*other), most, most);
    if (sum_of(at) <= most && least >= params_.uniqueness * static_cast<double>(sum_of(at) - s.left_sum))
      return false;
  }
  float sums[2];
  for (int i = 0; i < 2; ++i) {
    const Seen at =
        is_exact(beside[i]) ? beside[i] : compare(s, disparity_of(beside[i]), UINT32_MAX, UINT32_MAX);
    sums[i] = static_cast<float>(sum_of(at));
  }
  const auto here = static_cast<float>(sum_of(best));
  const float steeper = sums[0] > sums[1] ? sums[0] - here : sums[1] - here;
  const float offset = steeper > 0.0F ? 0.5F * (sums[0] - sums[1]) / steeper : 0.0F;
  d_px = static_cast<float>(d) + offset;
  return true;
}

}  // namespace cairn
