#include "detect/shadow_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

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

/// The same where all four are there: (x, y) from pixel (u, v).
int between(const ImageU8& grey, int u, int v, std::int64_t x, std::int64_t y) {
  const int fx = static_cast<int>((x >> 8) & 255);
  const int fy = static_cast<int>((y >> 8) & 255);
  const std::uint8_t* p = grey.data + (v + (y >> 16)) * grey.stride + u + (x >> 16);
  const std::uint8_t* q = p + grey.stride;
  return (256 - fy) * ((256 - fx) * p[0] + fx * p[1]) + fy * ((256 - fx) * q[0] + fx * q[1]);
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
      cos16_(std::lround(cos_ * 65536.0)),
      sin16_(std::lround(sin_ * 65536.0)),
      samples_(static_cast<std::size_t>(2 * half_rows_ + 1) * (2 * half_columns_ + 1)),
      absent_(samples_.size()),
      sum_(static_cast<std::size_t>(2 * half_rows_ + 1) * (2 * half_columns_ + 2)),
      ready_(static_cast<std::size_t>(2 * half_rows_ + 1)) {}

/// Sample (a, b) in 1/65536 grey levels; -1 where it is not there.
int ShadowFitter::look(int a, int b) const {
  const std::int64_t x = a * cos16_ - b * sin16_;
  const std::int64_t y = a * sin16_ + b * cos16_;
  if (whole_) return between(grey_, u_, v_, x, y);
  return between(grey_, valid_, (static_cast<std::int64_t>(u_) << 16) + x,
                 (static_cast<std::int64_t>(v_) << 16) + y);
}

bool ShadowFitter::begin(const ImageU8& grey, const ImageU8& valid, int u, int v, ShadowGround from) {
  grey_ = grey;
  valid_ = valid;
  u_ = u;
  v_ = v;
  const std::int64_t reach_x = (half_columns_ * std::abs(cos16_) + half_rows_ * std::abs(sin16_)) / 65536 + 2;
  const std::int64_t reach_y = (half_columns_ * std::abs(sin16_) + half_rows_ * std::abs(cos16_)) / 65536 + 2;
  whole_ = valid.data == nullptr && u >= reach_x && u < grey.width - reach_x && v >= reach_y &&
           v < grey.height - reach_y;
  std::fill(ready_.begin(), ready_.end(), std::uint8_t{0});
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
    for (int a = -ground_columns; a <= ground_columns; a += 2) {
      const int value = look(a, b);
      if (value < 0) {
        ++missing;
      } else {
        ++histogram[static_cast<std::size_t>(std::min(255, value >> 16))];
        ++count;
      }
    }
  }
  if (missing > 3 * count) return false;
  // the ground: what is most common; shadows and rocks are less than half of the window
  ground_ = quantile(histogram, count / 2);
  noise_ = std::max(0.5, (quantile(histogram, 3 * count / 4) - ground_) / 0.6745);
  depth_ = core_depth();
  return depth_ > kOne * std::max(1.0, std::min(kLeastDepth * noise_, kDeep * ground_));
}

/// A row's samples, darkness below the ground, none where there is no pixel; and their sums.
void ShadowFitter::sample_row(int row) {
  const auto index = static_cast<std::size_t>(row + half_rows_);
  const auto pitch = static_cast<std::size_t>(2 * half_columns_ + 1);
  const int level = static_cast<int>(std::lround(ground_ * kOne));
  std::int32_t* d = &samples_[index * pitch];
  std::int32_t* sum = &sum_[index * (pitch + 1)];
  std::uint8_t* absent = &absent_[index * pitch];
  std::int32_t total = 0;
  for (int a = -half_columns_; a <= half_columns_; ++a) {
    const int value = look(a, row);
    *absent++ = value < 0 ? 1 : 0;
    *d = value < 0 ? 0 : level - ((value + 2048) >> 12);
    *sum++ = total;
    total += *d++;
  }
  *sum = total;
  ready_[index] = 1;
}

/// Darkness of the row's samples, from a = -half_columns.
const std::int32_t* ShadowFitter::row_samples(int row) {
  const auto index = static_cast<std::size_t>(row + half_rows_);
  if (ready_[index] == 0) sample_row(row);
  return &samples_[index * static_cast<std::size_t>(2 * half_columns_ + 1)];
}

/// The shadow's level: the darkest sample near the spot. Means of several are diluted where a boulder is few
/// pixels wide; the dark grows into the body then, and the body moves towards the sun.
double ShadowFitter::core_depth() {
  std::int32_t depth = 0;
  for (int b = -kCore; b <= kCore; ++b) {
    const std::int32_t* d = row_samples(b) + half_columns_;
    depth = std::max(depth, *std::max_element(d - kCore, d + kCore + 1));
  }
  return depth;
}

/// Darkness summed over a row up to a; sample a covers a - 1/2 to a + 1/2.
struct ShadowFitter::RowSums {
  const std::int32_t* s;
  double half;
  int most;

  double to(double a) const {
    const double x = std::clamp(a + half + 0.5, 0.0, 2.0 * half + 1.0);
    const int k = std::min(static_cast<int>(x), most);
    return s[k] + (x - k) * (s[k + 1] - s[k]);
  }
};

inline ShadowFitter::RowSums ShadowFitter::row_sums(int row) {
  const auto index = static_cast<std::size_t>(row + half_rows_);
  if (ready_[index] == 0) sample_row(row);
  return {&sum_[index * static_cast<std::size_t>(2 * half_columns_ + 2)], static_cast<double>(half_columns_),
          2 * half_columns_};
}

double ShadowFitter::part(int row, double from, double to) {
  const RowSums sums = row_sums(row);
  return sums.to(to) - sums.to(from);
}

ShadowFitter::Sums ShadowFitter::sums(const Trial& t, int every) {
  Sums out{0.0, 0.0, 0.0, 0.0};
  const double stretch = std::sqrt(1.0 + t.slope * t.slope);
  const double tip = t.along * stretch;
  const double terminator = t.along / stretch;
  const int first = std::max(-half_rows_, static_cast<int>(std::ceil(t.b - t.across)));
  const int last = std::min(half_rows_, static_cast<int>(std::floor(t.b + t.across)));
  const double scale = 1.0 / (t.across * t.across);
  for (int row = first; row <= last; row += every) {
    const double w = std::sqrt(std::max(0.0, 1.0 - (row - t.b) * (row - t.b) * scale));
    const double a1 = t.a + terminator * w;
    const double a2 = t.a + tip * w;
    const RowSums sums = row_sums(row);
    const double before_dark = sums.to(a1);
    out.lit += before_dark - sums.to(t.a - t.along * w);
    out.dark += sums.to(a2) - before_dark;
    out.lit_n += (t.along + terminator) * w;
    out.dark_n += (tip - terminator) * w;
  }
  return out;
}

double ShadowFitter::value(const Trial& t, int every) {
  const Sums s = sums(t, every);
  if (s.dark_n <= 0.2 || s.lit_n <= 0.2 || s.dark <= 0.0) return 0.0;
  const double lit = s.lit / s.lit_n;
  if (lit > 0.8 * depth_) return 0.0;  // one dark patch
  const double round = std::log(t.along / t.across);
  const double tall = std::log(t.slope * tan_elevation_ * t.along / (kUsualHeight * t.across));
  const double area = t.across * t.across;
  return every * (depth_ * (2.0 * s.dark - depth_ * s.dark_n) + kBodyWeight * s.lit * lit) -
         depth_ * depth_ * area * (kRoundness * round * round + kTallness * tall * tall);
}

bool ShadowFitter::consider(const Trial& t, int every, Trial& best, double& most) {
  double here = 0.0;
  return consider(t, every, best, most, here);
}

bool ShadowFitter::consider(const Trial& t, int every, Trial& best, double& most, double& most_here) {
  const double v = value(t, every);
  most_here = std::max(most_here, v);
  if (!(v > most)) return false;
  most = v;
  best = t;
  return true;
}

void ShadowFitter::search(double least_across_px, Trial& best, double& most) {
  most = 0.0;
  best = {0.0, 0.0, 0.0, 0.0, 0.0};
  for (double across = least_across_px; across < most_across_ * 0.95; across *= 1.35) {
    double most_here = 0.0;
    for (const double height : {0.45, 0.8, 1.3, 2.0}) {
      const double slope = std::min(height / tan_elevation_, most_slope_);
      const double stretch = std::sqrt(1.0 + slope * slope);
      const double middle = kCentroid * across * (stretch + 1.0 / stretch);  // the dark's centroid
      for (int i = -2; i <= 2; ++i) {
        for (int j = -2; j <= 2; ++j) {
          const Trial t{-middle + 0.3 * i * across, 0.3 * j * across, across, across, slope};
          consider(t, across > 4.0 ? 2 : 1, best, most, most_here);
        }
      }
    }
    if (most_here < kFades * most) break;  // larger ones explain less and less
  }
  if (most <= 0.0) return;
  most = value(best, 1);
  for (double step = 0.16; step > 0.012; step *= 0.5) {
    for (int round = 0; round < 4 && improve(step, least_across_px, best, most); ++round) {
    }
  }
}

/// Each way of moving, both ways, up to three times while it helps.
bool ShadowFitter::improve(double step, double least_across_px, Trial& best, double& most) {
  bool better = false;
  for (int way = 0; way < kWays; ++way) {
    for (const double sign : {-1.0, 1.0}) {
      for (int again = 0; again < 3; ++again) {
        const Trial t = moved(best, way, sign * step);
        if (!allowed(t, least_across_px) || !consider(t, 1, best, most)) break;
        better = true;
      }
    }
  }
  return better;
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
  const int first = std::max(-half_rows_, static_cast<int>(std::ceil(t.b - t.across)));
  const int last = std::min(half_rows_, static_cast<int>(std::floor(t.b + t.across)));
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
    for (int a = static_cast<int>(std::ceil(a1)); a <= static_cast<int>(std::floor(a2)); ++a) {
      if (a < -half_columns_ || a > half_columns_) continue;
      const double d = row_samples(row)[a + half_columns_];
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
  const int first = std::max(-half_rows_, static_cast<int>(std::ceil(t.b - t.across)));
  const int last = std::min(half_rows_, static_cast<int>(std::floor(t.b + t.across)));
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
  const int top = std::max(-half_rows_, static_cast<int>(std::ceil(t.b - 2.2 * t.across - 1.0)));
  const int bottom = std::min(half_rows_, static_cast<int>(std::floor(t.b + 2.2 * t.across + 1.0)));
  const int from = std::max(-half_columns_, static_cast<int>(std::ceil(t.a - 2.2 * t.along - 1.0)));
  const int to = std::min(half_columns_, static_cast<int>(std::floor(t.a + tip + 1.5 * t.along + 1.0)));
  double square = 0.0;
  int n = 0;
  int absent = 0;
  for (int row = top; row <= bottom; ++row) {
    const double inside = 1.0 - (row - t.b) * (row - t.b) * scale;
    const double w = inside > 0.0 ? std::sqrt(inside) : 0.0;
    const double a0 = t.a - (t.along + 1.0) * w;
    const double a2 = t.a + (tip + 1.0) * w;
    const std::int32_t* d = row_samples(row) + half_columns_;
    const std::uint8_t* missing =
        &absent_[static_cast<std::size_t>(row + half_rows_) * (2 * half_columns_ + 1) +
                 static_cast<std::size_t>(half_columns_)];
    for (int a = from; a <= to; ++a) {
      absent += missing[a];
      if (inside > 0.0 && a >= a0 && a <= a2) continue;
      square += static_cast<double>(d[a]) * d[a];
      ++n;
    }
  }
  if (n > 0) fit.clutter = std::sqrt(square / n) / contrast;
  fit.absent = static_cast<double>(absent) / ((bottom - top + 1) * (to - from + 1));
}

double ShadowFitter::darkness(double a, double b) {
  const double a_in = std::clamp(a, -static_cast<double>(half_columns_), half_columns_ - 1.0);
  const double b_in = std::clamp(b, -static_cast<double>(half_rows_), half_rows_ - 1.0);
  const int column = static_cast<int>(std::floor(a_in));
  const int row = static_cast<int>(std::floor(b_in));
  const double fa = a_in - column;
  const double fb = b_in - row;
  const std::int32_t* d = row_samples(row) + half_columns_ + column;
  const std::int32_t* e = row_samples(row + 1) + half_columns_ + column;
  return (1.0 - fb) * ((1.0 - fa) * d[0] + fa * d[1]) + fb * ((1.0 - fa) * e[0] + fa * e[1]);
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
  double from = t.a - 2.2 * t.along;
  double* cell = fit.picture.data();
  for (const double length : along) {
    for (std::size_t i = 0; i < kCellsAcross; ++i) {
      double side[2] = {0.0, 0.0};
      for (int m = 0; m < kEach; ++m) {
        const double a = from + (m + 0.5) / kEach * length;
        for (int n = 0; n < kEach; ++n) {
          const double b = t.across * (kAcross[i] + (n + 0.5) / kEach * (kAcross[i + 1] - kAcross[i]));
          side[0] += darkness(a, t.b - b);
          side[1] += darkness(a, t.b + b);
        }
      }
      for (double& s : side) s = std::clamp(s / (kEach * kEach * contrast), -3.0, 2.0);
      *cell++ = std::min(side[0], side[1]);
      *cell++ = std::max(side[0], side[1]);
    }
    from += length;
  }
}

ShadowFitter::Sums ShadowFitter::sums(const Hollow& h) {
  Sums out{0.0, 0.0, 0.0, 0.0};
  const int first = std::max(-half_rows_, static_cast<int>(std::ceil(h.b - h.radius)));
  const int last = std::min(half_rows_, static_cast<int>(std::floor(h.b + h.radius)));
  const double scale = 1.0 / (h.radius * h.radius);
  for (int row = first; row <= last; ++row) {
    const double w = std::sqrt(std::max(0.0, 1.0 - (row - h.b) * (row - h.b) * scale));
    const double a0 = h.a - h.radius * w;
    const double a2 = h.a + h.radius * w;
    const double edge = h.a + h.radius * (h.arc * w - h.shift) + h.tilt * (row - h.b);
    const double a1 = std::clamp(edge, a0, a2);
    const RowSums sums = row_sums(row);
    const double before_lit = sums.to(a1);
    out.dark += before_lit - sums.to(a0);
    out.lit += sums.to(a2) - before_lit;
    out.dark_n += a1 - a0;
    out.lit_n += a2 - a1;
  }
  return out;
}

double ShadowFitter::value(const Hollow& h) {
  const Sums s = sums(h);
  if (s.dark <= 0.0 || s.lit >= 0.0) return 0.0;
  return s.dark * s.dark / s.dark_n + s.lit * s.lit / s.lit_n;
}

/// `dark`: [from, to) along row b is the hollow's dark wall; else its bright one.
HollowFit ShadowFitter::hollow(bool dark, double from, double to, double b) {
  static constexpr double kShapes[][2] = {{0.0, 0.25}, {0.0, -0.1}, {1.0, 0.7}, {1.0, 1.1}};  // arc, shift
  Hollow best{};
  double most = 0.0;
  const auto consider = [&](const Hollow& h) {
    if (h.radius < kLeastHollow_px || h.radius > kMostHollow_px || std::fabs(h.b) > half_rows_ ||
        h.arc - h.shift > 0.8 || h.arc - h.shift < -0.8 || std::fabs(h.tilt) > kMostTilt ||
        std::fabs(h.a) > half_columns_)
      return false;
    const double v = value(h);
    if (!(v > most)) return false;
    most = v;
    best = h;
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
  for (double step = 0.12; most > 0.0 && step > 0.02; step *= 0.5) {
    for (int round = 0; round < 3; ++round) {
      bool better = false;
      for (const double by : {-step, step}) {
        const auto move = [&](double a, double b_by, double size, double shift, double tilt) {
          Hollow h = best;
          h.a += a * h.radius;
          h.b += b_by * h.radius;
          h.radius *= 1.0 + size;
          h.shift += shift;
          h.tilt += tilt;
          better = consider(h) || better;
        };
        move(by, 0.0, 0.0, 0.0, 0.0);
        move(0.0, by, 0.0, 0.0, 0.0);
        move(0.0, 0.0, by, 0.0, 0.0);
        move(0.0, 0.0, 0.0, by, 0.0);
        move(0.0, 0.0, 0.0, 0.0, by);
        move(-by, 0.0, by, 0.0, 0.0);
        move(by, 0.0, by, 0.0, 0.0);
      }
      if (!better) break;
    }
  }
  HollowFit fit;
  if (most <= 0.0) return fit;
  const Sums s = sums(best);
  fit.du_px = best.a * cos_ - best.b * sin_;
  fit.dv_px = best.a * sin_ + best.b * cos_;
  fit.radius_px = best.radius;
  fit.explained = most / (kOne * kOne);
  fit.dark = s.dark / s.dark_n / kOne;
  fit.lit = -s.lit / s.lit_n / kOne;
  return fit;
}

ShadowFit ShadowFitter::fit(const ImageU8& grey, const ImageU8& valid, int u, int v, double least_across_px,
                            ShadowGround from) {
  ShadowFit fit;
  if (!begin(grey, valid, u, v, from)) return fit;
  Trial best{};
  double most = 0.0;
  search(least_across_px, best, most);
  if (most <= 0.0) return fit;
  const Sums s = sums(best, 1);
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
  picture(best, fit);
  const double pair = s.dark * s.dark / s.dark_n + (s.lit < 0.0 ? s.lit * s.lit / s.lit_n : 0.0);
  fit.pair = pair / (kOne * kOne);
  const double stretch = std::sqrt(1.0 + best.slope * best.slope);
  const double terminator = best.a + best.along / stretch;
  fit.beyond_rim = hollow(true, terminator, best.a + best.along * stretch, best.b);
  fit.far_wall = hollow(false, best.a - best.along, terminator, best.b);
  fit.found = fit.absent < kMostAbsent;
  return fit;
}

}  // namespace cairn::ground
