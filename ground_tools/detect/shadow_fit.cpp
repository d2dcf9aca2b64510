#include "detect/shadow_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace cairn::ground {
namespace {

constexpr int kOne = 16;  ///< grey levels are counted in sixteenths
constexpr double kBodyWeight = 0.7;
constexpr double kRoundness = 0.25;   ///< of the prior that along = across
constexpr double kTallness = 0.06;    ///< of the prior on height
constexpr double kUsualHeight = 0.9;  ///< over the half width
constexpr int kCore = 3;
constexpr double kCentroid = 0.424413;  ///< of a half ellipse, 4 / (3 pi)
constexpr double kLeastDepth = 3.0;     ///< of a shadow, in standard deviations of the ground,
constexpr double kDeep = 0.4;           ///< or this share of the ground's level, however patched that is
constexpr double kMostSlope = 5.8;
constexpr double kFades = 0.5;        ///< of the most that a size explains: no larger size is tried then
constexpr double kMostAbsent = 0.15;  ///< of the surroundings: what is cut off may be anything
constexpr double kLeastHollow_px = 1.5;
constexpr double kMostTilt = 0.6;
constexpr int kWideGround = 36;  ///< samples each way from the spot
constexpr int kNearGround = 12;
constexpr double kNearMostAcross_px = 4.8;

int rows_for() { return static_cast<int>(2.2 * kFitMostAcross_px) + 2; }

/// Of numbers that fit an int: the library's are calls without SSE 4.1.
int floor_of(double x) {
  const int k = static_cast<int>(x);
  return k - (x < k ? 1 : 0);
}
int ceil_of(double x) { return -floor_of(-x); }

/// Grey between four pixels in 1/65536 levels, x and y in 1/65536 px; -1 where one of them is not there.
int between(const ImageU8& grey, const ImageU8& valid, std::int64_t x, std::int64_t y) {
  const int x0 = static_cast<int>(x >> 16);
  const int y0 = static_cast<int>(y >> 16);
  const int fx = static_cast<int>((x >> 8) & 255);
  const int fy = static_cast<int>((y >> 8) & 255);
  const auto has = [&](int px, int py) {
    return grey.contains(px, py) && (valid.data == nullptr || valid.row(py)[px] != 0);
  };
  if (!has(x0, y0) || !has(x0 + 1, y0) || !has(x0, y0 + 1) || !has(x0 + 1, y0 + 1)) return -1;
  const std::uint8_t* p = grey.row(y0) + x0;
  const std::uint8_t* q = grey.row(y0 + 1) + x0;
  return (256 - fy) * ((256 - fx) * p[0] + fx * p[1]) + fy * ((256 - fx) * q[0] + fx * q[1]);
}

/// The same where all four are there: (x, y) from this pixel.
inline int between(const std::uint8_t* grey, std::ptrdiff_t stride, int x, int y) {
  const int fx = (x >> 8) & 255;
  const int fy = (y >> 8) & 255;
  const std::uint8_t* p = grey + (y >> 16) * stride + (x >> 16);
  const std::uint8_t* q = p + stride;
  const int upper = 256 * p[0] + fx * (p[1] - p[0]);
  const int lower = 256 * q[0] + fx * (q[1] - q[0]);
  return 256 * upper + fy * (lower - upper);
}

/// The value of this rank, from 0, among those counted by grey level; within a level they lie evenly.
double quantile(const std::array<int, 256>& histogram, int rank) {
  int below = 0;
  for (int g = 0; g < 256; ++g) {
    const int here = histogram[static_cast<std::size_t>(g)];
    if (below + here > rank) return g + (rank - below + 0.5) / here;
    below += here;
  }
  return 255.0;
}

}  // namespace

int shadow_fit_reach_px(double tan_elevation) {
  const double slope = std::min(kMostSlope, 2.2 / tan_elevation);
  const double columns = kFitMostAcross_px * (1.6 + 1.35 * std::sqrt(1.0 + slope * slope)) + 2.0;
  const double rows = rows_for();
  return static_cast<int>(std::ceil(std::sqrt(columns * columns + rows * rows))) + 2;
}

ShadowFitter::ShadowFitter(const Vec2& away_from_sun, double tan_elevation)
    : sin_(away_from_sun.y()),
      cos_(away_from_sun.x()),
      tan_elevation_(tan_elevation),
      most_slope_(std::min(kMostSlope, 2.2 / tan_elevation)),
      half_rows_(rows_for()),
      half_columns_(
          static_cast<int>(kFitMostAcross_px * (1.6 + 1.35 * std::sqrt(1.0 + most_slope_ * most_slope_))) +
          2),
      cos16_(static_cast<int>(std::lround(cos_ * 65536.0))),
      sin16_(static_cast<int>(std::lround(sin_ * 65536.0))),
      pitch_(static_cast<std::size_t>(2 * half_columns_ + 2)),
      grey16_(static_cast<std::size_t>(2 * half_rows_ + 1) * pitch_),
      samples_(grey16_.size()),
      looked_(static_cast<std::size_t>(2 * half_rows_ + 1)),
      ready_(looked_.size()) {}

/// Shows samples from (a, b) on, `step` from one to the next, in 1/65536 grey levels; -1 where there is none.
template <typename See>
inline void ShadowFitter::look_along(int a, int b, int step, int count, const See& see) const {
  int x = a * cos16_ - b * sin16_;
  int y = a * sin16_ + b * cos16_;
  const int across = step * cos16_;
  const int down = step * sin16_;
  if (whole_) {
    const ImageU8 grey = grey_;
    const std::uint8_t* const spot = grey.row(v_) + u_;
    for (int i = 0; i < count; ++i, x += across, y += down) see(between(spot, grey.stride, x, y));
  } else {
    for (int i = 0; i < count; ++i, x += across, y += down)
      see(between(grey_, valid_, (static_cast<std::int64_t>(u_) << 16) + x,
                  (static_cast<std::int64_t>(v_) << 16) + y));
  }
}

void ShadowFitter::look_at(const ImageU8& grey, const ImageU8& valid, int u, int v) {
  grey_ = grey;
  valid_ = valid;
  u_ = u;
  v_ = v;
  const int reach_x = (half_columns_ * std::abs(cos16_) + half_rows_ * std::abs(sin16_)) / 65536 + 2;
  const int reach_y = (half_columns_ * std::abs(sin16_) + half_rows_ * std::abs(cos16_)) / 65536 + 2;
  whole_ = u >= reach_x && u < grey.width - reach_x && v >= reach_y && v < grey.height - reach_y;
  // Most spots of an image with a no-data value have none of it about them, which is told far sooner than by
  // each sample's four pixels.
  if (valid.data != nullptr) {
    const auto width = static_cast<std::size_t>(2 * reach_x + 1);
    for (int y = v - reach_y; whole_ && y <= v + reach_y; ++y)
      whole_ = std::memchr(valid.row(y) + u - reach_x, 0, width) == nullptr;
  }
  std::fill(looked_.begin(), looked_.end(), 0);
}

bool ShadowFitter::begin(ShadowGround from) {
  std::fill(ready_.begin(), ready_.end(), 0);
  // A low sun's window is long, and the ground rises and falls in it: what is near tells the level. Every
  // other sample of every other row is enough for that.
  const bool wide = from == ShadowGround::kWide;
  most_across_ = wide ? kFitMostAcross_px : kNearMostAcross_px;
  const int ground_columns = std::min(half_columns_, wide ? kWideGround : kNearGround);
  const int ground_rows = wide ? half_rows_ : std::min(half_rows_, kNearGround);
  std::array<int, 256> histogram{};
  int count = 0;
  int missing = 0;
  for (int b = -ground_rows; b <= ground_rows; b += 2) {
    look_along(-ground_columns, b, 2, ground_columns + 1, [&](int value) {
      if (value < 0) {
        ++missing;
      } else {
        ++histogram[static_cast<std::size_t>(value >> 16)];
        ++count;
      }
    });
  }
  if (missing > 3 * count) return false;
  // the ground: what is most common; shadows and rocks are less than half of the window
  ground_ = quantile(histogram, count / 2);
  noise_ = std::max(0.5, (quantile(histogram, 3 * count / 4) - ground_) / 0.6745);
  depth_ = core_depth();
  return depth_ > kOne * std::max(1.0, std::min(kLeastDepth * noise_, kDeep * ground_));
}

/// Samples of a row, from its left end, that hold all as far as a: most fits need few of those to the right.
int ShadowFitter::samples_to(double a) const {
  constexpr int kStep = 16;
  const int most = 2 * half_columns_ + 1;
  const double least = std::min(std::max(a + half_columns_, 0.0) + 2.0, static_cast<double>(most));
  return std::min(most, (static_cast<int>(least) / kStep + 1) * kStep);
}

/// A row's grey levels, 1/16; -1 where there is no pixel.
const std::int16_t* ShadowFitter::row_grey(int row, int count) {
  const auto index = static_cast<std::size_t>(row + half_rows_);
  std::int16_t* const out = &grey16_[index * pitch_];
  int& looked = looked_[index];
  if (looked >= count) return out;
  std::int16_t* next = out + looked;
  look_along(looked - half_columns_, row, 1, count - looked,
             [&](int value) { *next++ = static_cast<std::int16_t>(value < 0 ? -1 : (value + 2048) >> 12); });
  looked = count;
  return out;
}

/// Its samples, from a = -half_columns: darkness below the ground, none where there is no pixel.
inline const ShadowFitter::Sample* ShadowFitter::row_samples(int row, int count) {
  const auto index = static_cast<std::size_t>(row + half_rows_);
  if (ready_[index] < count) make_ready(row, count);
  return &samples_[index * pitch_];
}

void ShadowFitter::make_ready(int row, int count) {
  const auto index = static_cast<std::size_t>(row + half_rows_);
  Sample* const out = &samples_[index * pitch_];
  const std::int16_t* const grey = row_grey(row, count);
  const int level = static_cast<int>(std::lround(ground_ * kOne));
  int i = ready_[index];
  int before = i > 0 ? static_cast<int>(out[i].before) : 0;
  for (; i < count; ++i) {
    const int here = grey[i] < 0 ? 0 : level - grey[i];
    out[i] = {static_cast<double>(here), static_cast<double>(before)};
    before += here;
  }
  out[count] = {0.0, static_cast<double>(before)};
  ready_[index] = count;
}

/// The shadow's level: the darkest sample near the spot. Means of several are diluted where a boulder is few
/// pixels wide; the dark grows into the body then, and the body moves towards the sun.
double ShadowFitter::core_depth() {
  double depth = 0.0;
  for (int b = -kCore; b <= kCore; ++b) {
    const Sample* const d = row_samples(b, samples_to(kCore)) + half_columns_;
    for (int a = -kCore; a <= kCore; ++a) depth = std::max(depth, d[a].dark);
  }
  return depth;
}

/// Darkness summed over a row up to a; sample a covers a - 1/2 to a + 1/2.
struct ShadowFitter::RowSums {
  const Sample* s;
  double half;

  /// Where a lies, samples from the row's left end. Not std::max, whose branch keeps loops from vectors.
  static double at(double a, double half) {
    const double x = a + half + 0.5;
    const double y = x > 0.0 ? x : 0.0;
    return y < 2.0 * half + 1.0 ? y : 2.0 * half + 1.0;
  }
  double to(double a) const { return to_sample(at(a, half)); }
  /// The same within the row, which needs not be asked then.
  double to_inside(double a) const { return to_sample(a + half + 0.5); }
  double to_sample(double x) const {
    const int k = static_cast<int>(x);
    return s[k].before + (x - k) * s[k].dark;
  }
};

double ShadowFitter::part(int row, double from, double to) {
  const RowSums sums{row_samples(row, samples_to(std::max(from, to))), static_cast<double>(half_columns_)};
  return sums.to(to) - sums.to(from);
}

/// The rows that an outline of this middle and half width crosses, w of each, and the samples of the first.
/// They are made ready here, so that the loops over them call nothing.
struct ShadowFitter::Rows {
  int first, last;
  std::array<double, kMostRows> w;
  const Sample* samples;
  std::size_t pitch;

  std::size_t count() const { return static_cast<std::size_t>(std::max(0, last - first + 1)); }
  /// As RowSums::to() of each row, which has its own `a`: in two loops, the first of them of vectors.
  void sums_to(const double* a, double half, double* before) const {
    std::array<int, kMostRows> k;
    std::array<double, kMostRows> part;
    const std::size_t n = count();
    for (std::size_t i = 0; i < n; ++i) {
      const double x = RowSums::at(a[i], half);
      k[i] = static_cast<int>(x);
      part[i] = x - k[i];
    }
    const Sample* row = samples;
    for (std::size_t i = 0; i < n; ++i, row += pitch) before[i] = row[k[i]].before + part[i] * row[k[i]].dark;
  }
};

ShadowFitter::Rows ShadowFitter::rows(double b, double half_width, int every, double to) {
  Rows rows;
  rows.first = std::max(-half_rows_, ceil_of(b - half_width));
  rows.last = std::min(half_rows_, floor_of(b + half_width));
  const double scale = 1.0 / (half_width * half_width);
  for (int row = rows.first; row <= rows.last; ++row)
    rows.w[static_cast<std::size_t>(row - rows.first)] =
        std::sqrt(std::max(0.0, 1.0 - (row - b) * (row - b) * scale));
  see(rows, every, to);
  return rows;
}

/// Most trials find all of their rows ready, which is told without a branch a row.
void ShadowFitter::see(Rows& rows, int every, double to) {
  const auto index = static_cast<std::size_t>(rows.first + half_rows_);
  rows.samples = &samples_[index * pitch_];
  rows.pitch = pitch_;
  const int count = samples_to(to);
  const int* const ready = &ready_[index];
  int lacking = 0;
  for (std::size_t i = 0; i < rows.count(); ++i) lacking |= ready[i] < count ? 1 : 0;
  if (lacking == 0) return;
  for (int row = rows.first; row <= rows.last; row += every) row_samples(row, count);
}

/// Of the trials that are `t` but for their middles `a`, in order; over every n-th row.
template <std::size_t kCount>
std::array<ShadowFitter::Sums, kCount> ShadowFitter::sums(const Trial& t, const std::array<double, kCount>& a,
                                                          const Rows& rows, int every) const {
  const double tip = t.along * std::sqrt(1.0 + t.slope * t.slope);
  const bool inside = a.front() - t.along > -half_columns_ && a.back() + tip < half_columns_;
  return inside ? sums_of_rows<true>(t, a, rows, every) : sums_of_rows<false>(t, a, rows, every);
}

template <bool kInside, std::size_t kCount>
std::array<ShadowFitter::Sums, kCount> ShadowFitter::sums_of_rows(const Trial& t,
                                                                  const std::array<double, kCount>& a,
                                                                  const Rows& rows, int every) const {
  std::array<double, kCount> lit = {};
  std::array<double, kCount> dark = {};
  double lit_n = 0.0;
  double dark_n = 0.0;
  const double half = half_columns_;
  const double stretch = std::sqrt(1.0 + t.slope * t.slope);
  const double tip = t.along * stretch;
  const double terminator = t.along / stretch;
  for (std::size_t row = 0; row < rows.count(); row += static_cast<std::size_t>(every)) {
    const double w = rows.w[row];
    const RowSums sums{rows.samples + row * rows.pitch, half};
    const auto before = [&](double to) { return kInside ? sums.to_inside(to) : sums.to(to); };
    for (std::size_t i = 0; i < kCount; ++i) {
      const double before_dark = before(a[i] + terminator * w);
      lit[i] += before_dark - before(a[i] - t.along * w);
      dark[i] += before(a[i] + tip * w) - before_dark;
    }
    lit_n += (t.along + terminator) * w;
    dark_n += (tip - terminator) * w;
  }
  std::array<Sums, kCount> out;
  for (std::size_t i = 0; i < kCount; ++i) out[i] = {lit_n, lit[i], dark_n, dark[i]};
  return out;
}

double ShadowFitter::tip_of(const Trial& t) { return t.a + t.along * std::sqrt(1.0 + t.slope * t.slope); }

ShadowFitter::Sums ShadowFitter::sums(const Trial& t) {
  return sums<1>(t, {t.a}, rows(t.b, t.across, 1, tip_of(t)), 1)[0];
}

double ShadowFitter::prior(const Trial& t) const {
  const double round = std::log(t.along / t.across);
  const double tall = std::log(t.slope * tan_elevation_ * t.along / (kUsualHeight * t.across));
  const double area = t.across * t.across;
  return depth_ * depth_ * area * (kRoundness * round * round + kTallness * tall * tall);
}

double ShadowFitter::value(const Sums& s, double prior, int every) const {
  if (s.dark_n <= 0.2 || s.lit_n <= 0.2 || s.dark <= 0.0) return 0.0;
  const double lit = s.lit / s.lit_n;
  if (lit > 0.8 * depth_) return 0.0;  // one dark patch
  return every * (depth_ * (2.0 * s.dark - depth_ * s.dark_n) + kBodyWeight * s.lit * lit) - prior;
}

/// All places about the spot for an outline of this size; the most that one explains, and the best so far.
double ShadowFitter::try_places(double across, Trial& best, double& most) {
  constexpr int kPlaces = 5;  ///< each way
  constexpr double kHeights[] = {0.45, 0.8, 1.3, 2.0};
  const int every = across > 4.0 ? 2 : 1;
  const auto centroid = [](double stretch) { return kCentroid * (stretch + 1.0 / stretch); };
  const double longest = std::sqrt(1.0 + std::pow(std::min(kHeights[3] / tan_elevation_, most_slope_), 2.0));
  const double farthest = across * (longest - centroid(longest) + 0.6) + 1.0;
  std::array<Rows, kPlaces> rows_of;
  for (int j = 0; j < kPlaces; ++j)
    rows_of[static_cast<std::size_t>(j)] = rows(0.3 * (j - 2) * across, across, every, farthest);
  double most_here = 0.0;
  for (const double height : kHeights) {
    Trial t{0.0, 0.0, across, across, std::min(height / tan_elevation_, most_slope_)};
    const double stretch = std::sqrt(1.0 + t.slope * t.slope);
    const double middle = kCentroid * across * (stretch + 1.0 / stretch);  // the dark's centroid
    const double against = prior(t);
    std::array<double, kPlaces> a;
    for (int i = 0; i < kPlaces; ++i) a[static_cast<std::size_t>(i)] = -middle + 0.3 * (i - 2) * across;
    std::array<std::array<Sums, kPlaces>, kPlaces> found;
    for (std::size_t j = 0; j < kPlaces; ++j) found[j] = sums<kPlaces>(t, a, rows_of[j], every);
    for (std::size_t i = 0; i < kPlaces; ++i) {
      for (std::size_t j = 0; j < kPlaces; ++j) {
        const double v = value(found[j][i], against, every);
        most_here = std::max(most_here, v);
        if (!(v > most)) continue;
        most = v;
        t.a = a[i];
        t.b = 0.3 * (static_cast<int>(j) - 2) * across;
        best = t;
      }
    }
  }
  return most_here;
}

void ShadowFitter::search(double least_across_px, Trial& best, double& most) {
  most = 0.0;
  best = {0.0, 0.0, 0.0, 0.0, 0.0};
  for (double across = least_across_px; across < most_across_ * 0.95; across *= 1.35) {
    if (try_places(across, best, most) < kFades * most) break;  // larger ones explain less and less
  }
  if (most <= 0.0) return;
  most = value(sums(best), prior(best), 1);
  for (double step = 0.16; step > 0.012; step *= 0.5) improve(step, least_across_px, best, most);
}

/// Each way of moving, both ways, up to three times while it helps; four rounds, or until none has helped.
void ShadowFitter::improve(double step, double least_across_px, Trial& best, double& most) {
  constexpr int kMoves = 2 * kWays;
  int idle = 0;  // moves of the best as it is that did not help
  for (int move = 0; move < 4 * kMoves && idle < kMoves; ++move) {
    const double by = move % 2 == 0 ? -step : step;
    for (int again = 0; again < 3; ++again) {
      const Trial t = moved(best, move % kMoves / 2, by);
      const double v = allowed(t, least_across_px) ? value(sums(t), prior(t), 1) : most;
      if (!(v > most)) {
        ++idle;
        break;
      }
      idle = 0;
      most = v;
      best = t;
    }
  }
}

ShadowFitter::Trial ShadowFitter::moved(Trial t, int way, double by) {
  if (way == 0) t.a += by * t.across;
  if (way == 1) t.b += by * t.across;
  if (way == 2) t.across *= 1.0 + by;
  if (way == 3) {  // the shadow's end stays
    const double tip = t.a + t.along * std::sqrt(1.0 + t.slope * t.slope);
    t.along *= 1.0 + by;
    const double q = (tip - t.a) / t.along;
    t.slope = std::sqrt(std::max(0.01, q * q - 1.0));
  }
  if (way == 4) t.slope *= 1.0 + 1.5 * by;
  if (way == 5 || way == 6) {  // larger, the shadow's middle or the terminator staying
    const double stretch = std::sqrt(1.0 + t.slope * t.slope);
    const double fixed = way == 5 ? kCentroid * (stretch + 1.0 / stretch) : 1.0 / stretch;
    t.a -= by * t.along * fixed;
    t.along *= 1.0 + by;
    t.across *= 1.0 + by;
  }
  return t;
}

bool ShadowFitter::allowed(const Trial& t, double least_across_px) const {
  return !(t.across < least_across_px || t.across > most_across_ || t.slope > most_slope_ || t.slope < 0.1 ||
           std::fabs(t.a) > half_columns_ || std::fabs(t.b) > kFitMostAcross_px || t.along > 1.8 * t.across ||
           t.along < 0.55 * t.across);
}

void ShadowFitter::measure(const Trial& t, ShadowFit& fit) {
  const double stretch = std::sqrt(1.0 + t.slope * t.slope);
  const double tip = t.along * stretch;
  const double terminator = t.along / stretch;
  const double rim = 0.35 * t.across + 1.0;
  const double scale = 1.0 / (t.across * t.across);
  const double contrast = kOne * (fit.ground - fit.dark);
  double beyond = 0.0, before = 0.0, before_n = 0.0, left = 0.0, right = 0.0, dark_side = 0.0, lit_side = 0.0,
         near_n = 0.0, square = 0.0, square_n = 0.0, mean = 0.0;
  const int first = std::max(-half_rows_, ceil_of(t.b - t.across));
  const int last = std::min(half_rows_, floor_of(t.b + t.across));
  for (int row = first; row <= last; ++row) {
    const double w = std::sqrt(std::max(0.0, 1.0 - (row - t.b) * (row - t.b) * scale));
    const double a0 = t.a - t.along * w;
    const double a1 = t.a + terminator * w;
    const double a2 = t.a + tip * w;
    before += part(row, a0 - 0.5 - rim, a0 - 0.5);
    beyond += part(row, a2 + 0.5, a2 + 0.5 + rim);
    before_n += rim;
    const double near = std::min(0.5 * (a2 - a1), 0.4 * t.across);
    dark_side += part(row, a1, a1 + near);
    lit_side += part(row, a1 - near, a1);
    near_n += near;
    for (int a = ceil_of(a1); a <= floor_of(a2); ++a) {
      if (a < -half_columns_ || a > half_columns_) continue;
      const double d = row_samples(row, samples_to(a2))[a + half_columns_].dark;
      square += d * d;
      mean += d;
      square_n += 1.0;
    }
  }
  const int flank = std::max(1, static_cast<int>(std::lround(rim)));
  for (int i = 1; i <= flank; ++i) {
    const double from = t.a + 0.5 * terminator;
    const double to = t.a + 0.8 * tip;
    left += part(std::max(-half_rows_, first - i), from, to);
    right += part(std::min(half_rows_, last + i), from, to);
  }
  const double flank_n = flank * (0.8 * tip - 0.5 * terminator);
  fit.beyond = beyond / before_n / contrast;
  fit.before = before / before_n / contrast;
  fit.beside = std::max(left, right) / flank_n / contrast;
  fit.step = near_n > 0.0 ? (dark_side - lit_side) / near_n / contrast : 0.0;
  if (square_n > 1.0) {
    mean /= square_n;
    fit.spread = std::sqrt(std::max(0.0, square / square_n - mean * mean)) / contrast;
  }
}

void ShadowFitter::measure_around(const Trial& t, ShadowFit& fit) {
  const double stretch = std::sqrt(1.0 + t.slope * t.slope);
  const double tip = t.along * stretch;
  const double contrast = kOne * (fit.ground - fit.dark);
  const double terminator = t.along / stretch;
  const int first = std::max(-half_rows_, ceil_of(t.b - t.across));
  const int last = std::min(half_rows_, floor_of(t.b + t.across));
  const int flank = std::max(1, static_cast<int>(std::lround(0.5 * t.across)));
  double left = 0.0, right = 0.0, left_lit = 0.0, right_lit = 0.0;
  for (int i = 2; i < 2 + flank; ++i) {
    const int up = std::max(-half_rows_, first - i);
    const int down = std::min(half_rows_, last + i);
    left += part(up, t.a + 0.5 * terminator, t.a + 0.8 * tip);
    right += part(down, t.a + 0.5 * terminator, t.a + 0.8 * tip);
    left_lit -= part(up, t.a - t.along, t.a + 0.5 * terminator);
    right_lit -= part(down, t.a - t.along, t.a + 0.5 * terminator);
  }
  fit.band = std::min(left, right) / (flank * (0.8 * tip - 0.5 * terminator)) / contrast;
  fit.ridge = std::max(left_lit, right_lit) / (flank * (t.along + 0.5 * terminator)) / contrast;

  const double wide = t.across + 1.0;
  const double scale = 1.0 / (wide * wide);
  const int top = std::max(-half_rows_, ceil_of(t.b - 2.2 * t.across - 1.0));
  const int bottom = std::min(half_rows_, floor_of(t.b + 2.2 * t.across + 1.0));
  const int from = std::max(-half_columns_, ceil_of(t.a - 2.2 * t.along - 1.0));
  const int to = std::min(half_columns_, floor_of(t.a + tip + 1.5 * t.along + 1.0));
  double square = 0.0;
  int n = 0;
  int absent = 0;
  for (int row = top; row <= bottom; ++row) {
    const double inside = 1.0 - (row - t.b) * (row - t.b) * scale;
    const double w = inside > 0.0 ? std::sqrt(inside) : 0.0;
    const double a0 = t.a - (t.along + 1.0) * w;
    const double a2 = t.a + (tip + 1.0) * w;
    const Sample* const d = row_samples(row, samples_to(to)) + half_columns_;
    const std::int16_t* const grey = row_grey(row, samples_to(to)) + half_columns_;
    for (int a = from; a <= to; ++a) {
      absent += grey[a] < 0 ? 1 : 0;
      if (inside > 0.0 && a >= a0 && a <= a2) continue;
      square += d[a].dark * d[a].dark;
      ++n;
    }
  }
  if (n > 0) fit.clutter = std::sqrt(square / n) / contrast;
  fit.absent = static_cast<double>(absent) / ((bottom - top + 1) * (to - from + 1));
}

/// Two rows and how far between them.
struct ShadowFitter::Between {
  const Sample* d;
  const Sample* e;
  double f;

  /// Darkness between four samples.
  double at(int column, double fa) const {
    return (1.0 - f) * ((1.0 - fa) * d[column].dark + fa * d[column + 1].dark) +
           f * ((1.0 - fa) * e[column].dark + fa * e[column + 1].dark);
  }
};

ShadowFitter::Between ShadowFitter::between_rows(double b, double to) {
  const double b_in = std::clamp(b, -static_cast<double>(half_rows_), half_rows_ - 1.0);
  const int row = floor_of(b_in);
  const int count = samples_to(to);
  return {row_samples(row, count) + half_columns_, row_samples(row + 1, count) + half_columns_, b_in - row};
}

void ShadowFitter::picture(const Trial& t, ShadowFit& fit) {
  constexpr int kEach = 3;  // samples of a cell, each way
  const double stretch = std::sqrt(1.0 + t.slope * t.slope);
  const double body = t.along / stretch + t.along;
  const double shadow = t.along * stretch - t.along / stretch;
  const double along[kCellsAlong] = {0.6 * t.along, 0.6 * t.along, body / 3.0,   body / 3.0,
                                     body / 3.0,    shadow / 3.0,  shadow / 3.0, shadow / 3.0,
                                     0.6 * t.along, 0.6 * t.along};
  constexpr double kAcross[kCellsAcross + 1] = {0.0, 0.4, 0.9, 1.5, 2.3};
  const double contrast = kOne * (fit.ground - fit.dark);
  const double end = tip_of(t) + 1.2 * t.along + 1.0;
  std::array<Between, 2 * kEach * kCellsAcross> rows;
  for (std::size_t i = 0; i < kCellsAcross; ++i) {
    for (int n = 0; n < kEach; ++n) {
      const double b = t.across * (kAcross[i] + (n + 0.5) / kEach * (kAcross[i + 1] - kAcross[i]));
      const std::size_t k = 2 * (i * kEach + static_cast<std::size_t>(n));
      rows[k] = between_rows(t.b - b, end);
      rows[k + 1] = between_rows(t.b + b, end);
    }
  }
  double from = t.a - 2.2 * t.along;
  double* cell = fit.picture.data();
  for (const double length : along) {
    std::array<double, 2 * kCellsAcross> sides = {};
    for (int m = 0; m < kEach; ++m) {
      const double a = std::clamp(from + (m + 0.5) / kEach * length, -static_cast<double>(half_columns_),
                                  half_columns_ - 1.0);
      const int column = floor_of(a);
      for (std::size_t k = 0; k < rows.size(); ++k)
        sides[k / (2 * kEach) * 2 + k % 2] += rows[k].at(column, a - column);
    }
    for (double& s : sides) s = std::clamp(s / (kEach * kEach * contrast), -3.0, 2.0);
    for (std::size_t i = 0; i < sides.size(); i += 2) {
      *cell++ = std::min(sides[i], sides[i + 1]);
      *cell++ = std::max(sides[i], sides[i + 1]);
    }
    from += length;
  }
}

/// A hollow's disc, row by row: sums to where it begins and ends. Moves of its edge alone leave it as it is.
struct ShadowFitter::Disc {
  double a, b, radius;
  Rows rows;
  std::array<double, kMostRows> from, to, before_from, before_to;
};

void ShadowFitter::put(const Hollow& h, Disc& disc) {
  disc.a = h.a;
  disc.b = h.b;
  disc.radius = h.radius;
  disc.rows = rows(h.b, h.radius, 1, h.a + h.radius);
  for (std::size_t i = 0; i < disc.rows.count(); ++i) {
    disc.from[i] = h.a - h.radius * disc.rows.w[i];
    disc.to[i] = h.a + h.radius * disc.rows.w[i];
  }
  const double half = half_columns_;
  disc.rows.sums_to(disc.from.data(), half, disc.before_from.data());
  disc.rows.sums_to(disc.to.data(), half, disc.before_to.data());
}

ShadowFitter::Sums ShadowFitter::sums(const Hollow& h, const Disc& disc) const {
  double lit = 0.0;
  double dark = 0.0;
  double lit_n = 0.0;
  double dark_n = 0.0;
  std::array<double, kMostRows> edge, before_edge;
  const std::size_t n = disc.rows.count();
  for (std::size_t i = 0; i < n; ++i) {
    const double off = disc.rows.first + static_cast<int>(i) - h.b;
    const double e = h.a + h.radius * (h.arc * disc.rows.w[i] - h.shift) + h.tilt * off;
    const double f = e > disc.from[i] ? e : disc.from[i];
    edge[i] = f < disc.to[i] ? f : disc.to[i];
  }
  disc.rows.sums_to(edge.data(), half_columns_, before_edge.data());
  for (std::size_t i = 0; i < n; ++i) {
    dark += before_edge[i] - disc.before_from[i];
    lit += disc.before_to[i] - before_edge[i];
    dark_n += edge[i] - disc.from[i];
    lit_n += disc.to[i] - edge[i];
  }
  return {lit_n, lit, dark_n, dark};
}

double ShadowFitter::value(const Sums& s) {
  if (s.dark <= 0.0 || s.lit >= 0.0) return 0.0;
  return s.dark * s.dark / s.dark_n + s.lit * s.lit / s.lit_n;
}

/// `dark`: [from, to) along row b is the hollow's dark wall; else its bright one.
HollowFit ShadowFitter::hollow(bool dark, double from, double to, double b) {
  static constexpr double kShapes[][2] = {{0.0, 0.25}, {0.0, -0.1}, {1.0, 0.7}, {1.0, 1.1}};  // arc, shift
  Hollow best{};
  std::array<Disc, 2> discs;
  Disc* of_best = &discs[0];
  Disc* of_trial = &discs[1];
  of_best->radius = 0.0;
  double most = 0.0;
  const auto consider = [&](const Hollow& h) {
    if (h.radius < kLeastHollow_px || h.radius > kMostHollow_px || std::fabs(h.b) > half_rows_ ||
        h.arc - h.shift > 0.8 || h.arc - h.shift < -0.8 || std::fabs(h.tilt) > kMostTilt ||
        std::fabs(h.a) > half_columns_)
      return false;
    const bool same = h.a == of_best->a && h.b == of_best->b && h.radius == of_best->radius;
    if (!same) put(h, *of_trial);
    const double v = value(sums(h, same ? *of_best : *of_trial));
    if (!(v > most)) return false;
    most = v;
    best = h;
    if (!same) std::swap(of_best, of_trial);
    return true;
  };
  for (const auto& shape : kShapes) {
    const double edge = shape[0] - shape[1];  // of the dark, radii from the centre
    for (double size = 0.8; size < 1.6; size *= 1.35) {
      const double radius = size * (to - from) / (dark ? 1.0 + edge : 1.0 - edge);
      const double a = dark ? from + radius : to - radius;
      for (const double tilt : {-0.4, 0.0, 0.4})
        consider({a, b + (dark ? -0.7 : 0.7) * tilt * radius, radius, shape[0], shape[1], tilt});
    }
  }
  static constexpr double kMoves[][5] = {{1, 0, 0, 0, 0}, {0, 1, 0, 0, 0},  {0, 0, 1, 0, 0}, {0, 0, 0, 1, 0},
                                         {0, 0, 0, 0, 1}, {-1, 0, 1, 0, 0}, {1, 0, 1, 0, 0}};
  constexpr int kBoth = 2 * static_cast<int>(std::size(kMoves));
  for (double step = 0.12; most > 0.0 && step > 0.02; step *= 0.5) {
    int idle = 0;  // moves of the best as it is that did not help
    for (int move = 0; move < 3 * kBoth && idle < kBoth; ++move) {
      const double by = move % kBoth < kBoth / 2 ? -step : step;
      const auto& way = kMoves[move % (kBoth / 2)];
      Hollow h = best;
      h.a += by * way[0] * h.radius;
      h.b += by * way[1] * h.radius;
      h.radius *= 1.0 + by * way[2];
      h.shift += by * way[3];
      h.tilt += by * way[4];
      idle = consider(h) ? 0 : idle + 1;
    }
  }
  HollowFit fit;
  if (most <= 0.0) return fit;
  const Sums s = sums(best, *of_best);
  fit.du_px = best.a * cos_ - best.b * sin_;
  fit.dv_px = best.a * sin_ + best.b * cos_;
  fit.radius_px = best.radius;
  fit.explained = most / (kOne * kOne);
  fit.dark = s.dark / s.dark_n / kOne;
  fit.lit = -s.lit / s.lit_n / kOne;
  return fit;
}

ShadowFit ShadowFitter::fit(double least_across_px, double most_across_px, ShadowGround from) {
  ShadowFit fit;
  if (!begin(from)) return fit;
  Trial best{};
  double most = 0.0;
  search(least_across_px, best, most);
  if (most <= 0.0 || best.across > most_across_px) return fit;
  const Sums s = sums(best);
  fit.du_px = best.a * cos_ - best.b * sin_;
  fit.dv_px = best.a * sin_ + best.b * cos_;
  fit.across_px = best.across;
  fit.along_px = best.along;
  fit.reach_px = best.along * std::sqrt(1.0 + best.slope * best.slope);
  fit.ground = ground_;
  fit.noise = noise_;
  fit.dark = ground_ - s.dark / s.dark_n / kOne;
  fit.lit = ground_ - s.lit / s.lit_n / kOne;
  fit.explained = most / (kOne * kOne);
  measure(best, fit);
  measure_around(best, fit);
  fit.found = fit.absent < kMostAbsent;
  if (!fit.found) return fit;
  picture(best, fit);
  const double pair = s.dark * s.dark / s.dark_n + (s.lit < 0.0 ? s.lit * s.lit / s.lit_n : 0.0);
  fit.pair = pair / (kOne * kOne);
  const double stretch = std::sqrt(1.0 + best.slope * best.slope);
  const double terminator = best.a + best.along / stretch;
  fit.beyond_rim = hollow(true, terminator, best.a + best.along * stretch, best.b);
  fit.far_wall = hollow(false, best.a - best.along, terminator, best.b);
  return fit;
}

}  // namespace cairn::ground
