#include "detect/shadow_detector.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/tool_error.hpp"
#include "core/trig.hpp"
#include "detect/shadow_fit.hpp"

namespace cairn::ground {
namespace {

/// Half widths across the sun that are a level's own: beyond, the next serves better; below, the one before.
constexpr double kMostOwn_px = 7.5;
constexpr double kLeastAcross_px = 3.2;
constexpr int kNearRadius = 1;  ///< of the mean that is a spot
constexpr int kFarRadius = 8;   ///< of the mean around it
constexpr int kMaximumRadius = 2;
constexpr int kRounds = 3;  ///< of beating what overlaps
constexpr int kLeastStep_dn = 3;

/// One level of the pyramid: pixels of a rectangle on its own grid.
struct Level {
  PixelRect rect;
  std::vector<std::uint8_t> grey;
  std::vector<std::uint8_t> valid;
  int shift = 0;
  ImageU8 grey_view() const { return packed_view(grey.data(), rect.width, rect.height); }
  ImageU8 valid_view() const {
    return valid.empty() ? ImageU8{} : packed_view(valid.data(), rect.width, rect.height);
  }
};

int half_up(int x) { return (x + 1) >> 1; }

/// Means of 2 x 2, of those that are valid; blocks that reach over the rim are left out.
Level halved(const ImageU8& grey, const ImageU8& valid, const PixelRect& from, int shift) {
  Level to;
  to.shift = shift;
  to.rect.x0 = half_up(from.x0);
  to.rect.y0 = half_up(from.y0);
  to.rect.width = std::max(0, ((from.x0 + from.width) >> 1) - to.rect.x0);
  to.rect.height = std::max(0, ((from.y0 + from.height) >> 1) - to.rect.y0);
  const auto size = static_cast<std::size_t>(to.rect.width) * static_cast<std::size_t>(to.rect.height);
  to.grey.resize(size);
  if (valid.data != nullptr) to.valid.resize(size);
  for (int y = 0; y < to.rect.height; ++y) {
    const int y2 = 2 * (to.rect.y0 + y) - from.y0;
    const std::uint8_t* a = grey.row(y2) + (2 * to.rect.x0 - from.x0);
    const std::uint8_t* b = grey.row(y2 + 1) + (2 * to.rect.x0 - from.x0);
    std::uint8_t* out = to.grey.data() + static_cast<std::size_t>(y) * to.rect.width;
    if (valid.data == nullptr) {
      for (int x = 0; x < to.rect.width; ++x)
        out[x] = static_cast<std::uint8_t>((a[2 * x] + a[2 * x + 1] + b[2 * x] + b[2 * x + 1] + 2) >> 2);
      continue;
    }
    const std::uint8_t* va = valid.row(y2) + (2 * to.rect.x0 - from.x0);
    const std::uint8_t* vb = valid.row(y2 + 1) + (2 * to.rect.x0 - from.x0);
    std::uint8_t* vout = to.valid.data() + static_cast<std::size_t>(y) * to.rect.width;
    for (int x = 0; x < to.rect.width; ++x) {
      int n = 0;
      int sum = 0;
      const auto add = [&](int g, int v) {
        if (v == 0) return;
        ++n;
        sum += g;
      };
      add(a[2 * x], va[2 * x]);
      add(a[2 * x + 1], va[2 * x + 1]);
      add(b[2 * x], vb[2 * x]);
      add(b[2 * x + 1], vb[2 * x + 1]);
      vout[x] = n > 0 ? 255 : 0;
      out[x] = static_cast<std::uint8_t>(n > 0 ? (sum + n / 2) / n : 0);
    }
  }
  return to;
}

struct Spot {
  int x, y;
};

/// Sums over boxes of valid pixels, and how many they are.
class BoxSums {
 public:
  BoxSums(const ImageU8& grey, const ImageU8& valid)
      : width_(grey.width), height_(grey.height), all_valid_(valid.data == nullptr) {
    const std::size_t pitch = static_cast<std::size_t>(width_) + 1;
    sum_.assign(pitch * (static_cast<std::size_t>(height_) + 1), 0);
    if (!all_valid_) count_.assign(sum_.size(), 0);
    for (int y = 0; y < height_; ++y) {
      const std::uint8_t* g = grey.row(y);
      const std::uint32_t* above = &sum_[static_cast<std::size_t>(y) * pitch];
      std::uint32_t* here = &sum_[static_cast<std::size_t>(y + 1) * pitch];
      std::uint32_t total = 0;
      if (all_valid_) {
        for (int x = 0; x < width_; ++x) {
          total += g[x];
          here[x + 1] = above[x + 1] + total;
        }
        continue;
      }
      const std::uint8_t* v = valid.row(y);
      const std::uint32_t* count_above = &count_[static_cast<std::size_t>(y) * pitch];
      std::uint32_t* count_here = &count_[static_cast<std::size_t>(y + 1) * pitch];
      std::uint32_t n = 0;
      for (int x = 0; x < width_; ++x) {
        if (v[x] != 0) {
          total += g[x];
          ++n;
        }
        here[x + 1] = above[x + 1] + total;
        count_here[x + 1] = count_above[x + 1] + n;
      }
    }
  }
  /// Box around (x, y), cut at the rim. Differences are right although sums wrap.
  void box(int x, int y, int radius, std::uint32_t& sum, std::uint32_t& count) const {
    const int x0 = std::max(0, x - radius);
    const int y0 = std::max(0, y - radius);
    const int x1 = std::min(width_, x + radius + 1);
    const int y1 = std::min(height_, y + radius + 1);
    const std::size_t pitch = static_cast<std::size_t>(width_) + 1;
    const auto at = [&](const std::vector<std::uint32_t>& s) {
      return s[y1 * pitch + x1] - s[y0 * pitch + x1] - s[y1 * pitch + x0] + s[y0 * pitch + x0];
    };
    sum = at(sum_);
    count = all_valid_ ? static_cast<std::uint32_t>((x1 - x0) * (y1 - y0)) : at(count_);
  }

 private:
  int width_;
  int height_;
  bool all_valid_;
  std::vector<std::uint32_t> sum_;
  std::vector<std::uint32_t> count_;
};

/// Darkness of spots below their surroundings in 1/16 grey levels; 0 where it is less than asked for.
std::vector<std::uint16_t> darkness(const ImageU8& grey, const ImageU8& valid, const PixelRect& where,
                                    double seed_contrast) {
  const BoxSums sums(grey, valid);
  const auto share = static_cast<std::uint32_t>(std::lround(seed_contrast * 256.0));
  std::vector<std::uint16_t> dark(static_cast<std::size_t>(where.width) * where.height, 0);
  for (int y = 0; y < where.height; ++y) {
    for (int x = 0; x < where.width; ++x) {
      std::uint32_t near = 0, near_n = 0, far = 0, far_n = 0;
      sums.box(where.x0 + x, where.y0 + y, kNearRadius, near, near_n);
      if (near_n == 0) continue;
      sums.box(where.x0 + x, where.y0 + y, kFarRadius, far, far_n);
      const std::uint32_t ground = 16 * far / far_n;
      const std::uint32_t spot = 16 * near / near_n;
      if (spot + ground * share / 256 >= ground || spot + 16 * kLeastStep_dn >= ground) continue;
      dark[static_cast<std::size_t>(y) * where.width + x] = static_cast<std::uint16_t>(ground - spot);
    }
  }
  return dark;
}

/// Maxima over 5 x 5; of equals, the first by row and column.
std::vector<Spot> maxima(const std::vector<std::uint16_t>& dark, const PixelRect& where) {
  std::vector<Spot> spots;
  for (int y = 0; y < where.height; ++y) {
    for (int x = 0; x < where.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * where.width + x;
      if (dark[i] == 0) continue;
      bool highest = true;
      for (int dy = -kMaximumRadius; highest && dy <= kMaximumRadius; ++dy) {
        for (int dx = -kMaximumRadius; highest && dx <= kMaximumRadius; ++dx) {
          if ((dx == 0 && dy == 0) || x + dx < 0 || y + dy < 0 || x + dx >= where.width ||
              y + dy >= where.height)
            continue;
          const std::uint16_t other = dark[i + static_cast<std::ptrdiff_t>(dy) * where.width + dx];
          const bool earlier = dy < 0 || (dy == 0 && dx < 0);
          highest = earlier ? other < dark[i] : other <= dark[i];
        }
      }
      if (highest) spots.push_back({where.x0 + x, where.y0 + y});
    }
  }
  return spots;
}

/// A fit in pixels of the image.
struct Candidate {
  double u, v, across, along, reach;
  double explained;
  double confidence;
  double contrast;
};

/// Standard order that does not depend on tiles.
bool before(const Candidate& a, const Candidate& b) {
  if (a.v != b.v) return a.v < b.v;
  if (a.u != b.u) return a.u < b.u;
  if (a.explained != b.explained) return a.explained > b.explained;
  return a.across < b.across;
}
bool stronger(const Candidate& a, const Candidate& b) {
  const double x = std::sqrt(a.confidence) * a.explained;
  const double y = std::sqrt(b.confidence) * b.explained;
  return x != y ? x > y : before(a, b);
}

double size_of(const Candidate& c) { return std::sqrt(c.across * c.along); }

bool overlap(const Candidate& a, const Candidate& b) {
  const double du = a.u - b.u;
  const double dv = a.v - b.v;
  const double near = 0.8 * std::max(size_of(a), size_of(b));
  return du * du + dv * dv < near * near;
}

constexpr std::size_t kFeatures = 18;
using Features = std::array<double, kFeatures>;

/// What a fit looks like, for the confidence.
Features features_of(const ShadowFit& f, double tan_elevation) {
  const double contrast = f.ground - f.dark;
  const double x = std::log(contrast / f.noise);
  const double beside = std::clamp(f.beside, -0.5, 1.0);
  const double beyond = std::clamp(f.beyond, -0.5, 1.0);
  const double before = std::clamp(f.before, -1.0, 1.0);
  const double lit = std::clamp((f.lit - f.ground) / contrast, -1.0, 2.0);
  const double round = std::log(f.along_px / f.across_px);
  const double step = std::clamp(f.step, 0.0, 2.5);
  const double spread = std::min(f.spread, 1.0);
  const double reach = std::log(f.reach_px / f.along_px);
  // The lower the sun, the brighter what faces it.
  const double lower = std::min(1.0 / tan_elevation, 4.0) - 1.0;
  const double size = std::log(f.across_px);
  return {1.0,  x,         x * x,       beside,        beyond, before, before * before,
          lit,  lit * lit, round,       round * round, step,   spread, reach,
          size, size * x,  lit * lower, before * lower};
}

/// Logistic regression on fits in rendered fields: 5, 10, 20 mm and 25 cm pixels under four suns.
constexpr Features kWeights = {-1.170, 1.861,  0.308,  -2.336, 0.478, 0.113,  -0.939, 1.910, 0.562,
                               -2.464, -4.082, -0.594, -6.085, 0.203, -0.051, 0.408,  0.283, 0.777};

/// Below some 27 degrees every rise and hollow of the ground shades itself, and what looks like a boulder is
/// one more seldom: odds against it, per unit of 1 / tan e above kShadingGround. Chosen on the even frames of
/// a lunar surface at 18 degrees.
constexpr double kOddsOfLowSun = 1.3;
constexpr double kShadingGround = 2.0;

double confidence_of(const Features& features, double tan_elevation) {
  double z = -kOddsOfLowSun * std::clamp(1.0 / tan_elevation - kShadingGround, 0.0, 3.0);
  for (std::size_t i = 0; i < kFeatures; ++i) z += kWeights[i] * features[i];
  return 1.0 / (1.0 + std::exp(-z));
}

int levels_for(const ShadowParams& params, double pixel_m) {
  const double most = 0.5 * std::min(params.max_diameter_px, params.max_diameter_m / pixel_m);
  int levels = 1;
  while (levels < 8 && kMostOwn_px * (1 << (levels - 1)) < most) ++levels;
  return levels;
}

/// How far a candidate lies from the spot that it was fitted at, and one candidate from another that it
/// overlaps, in pixels of a level.
int wander_px(double tan_elevation) { return shadow_fit_reach_px(tan_elevation); }
constexpr double kMostSize_px = 1.35 * kFitMostAcross_px;

}  // namespace

void check(const ShadowParams& params) {
  check_range("--min-diameter", params.min_diameter_m, 0.0, 1e3);
  check_range("--max-diameter", params.max_diameter_m, 1e-3, 1e4);
  check_range("least diameter in pixels", params.min_diameter_px, 3.0, 100.0);
  check_range("largest diameter in pixels", params.max_diameter_px, 16.0, 1024.0);
  check_range("--seed-contrast", params.seed_contrast, 0.01, 0.9);
  check_range("--min-confidence", params.min_confidence, 0.0, 1.0);
}

std::string to_text(const ShadowParams& params, const Sun& sun) {
  return fmt::format(
      "method=shadow sun={} min_diameter_m={} min_diameter_px={} max_diameter_m={} max_diameter_px={} "
      "seed_contrast={} min_confidence={}",
      to_text(sun), params.min_diameter_m, params.min_diameter_px, params.max_diameter_m,
      params.max_diameter_px, params.seed_contrast, params.min_confidence);
}

ShadowView shadow_view(const Sun& sun, const GeoTransform& geo) {
  const SinCos e = sin_cos(sun.elevation_rad);
  return {sun_direction_px(sun, geo), std::min(100.0, e.sin / std::max(1e-9, e.cos)), geo.pixel_m()};
}

int shadow_reach_px(const ShadowView& view, const ShadowParams& params) {
  const int scale = 1 << (levels_for(params, view.pixel_m) - 1);
  const int fit = wander_px(view.tan_elevation) + kFarRadius + kMaximumRadius + 6;
  const auto chain = static_cast<int>(std::ceil(kRounds * 0.8 * kMostSize_px));
  return scale * (2 * fit + chain) + 2 * scale;
}

std::vector<ShadowBoulder> detect_boulders_by_shadow(const GreyTile& tile, const PixelRect& core,
                                                     const ShadowView& view, const ShadowParams& params) {
  const Vec2 away = -view.towards_sun_px;
  ShadowFitter fitter(away, view.tan_elevation);
  const int levels = levels_for(params, view.pixel_m);
  const double least_px = std::max(params.min_diameter_px, params.min_diameter_m / view.pixel_m);
  const int chain = static_cast<int>(std::ceil(kRounds * 0.8 * kMostSize_px)) << (levels - 1);
  std::vector<Candidate> candidates;
  Level level;
  for (int shift = 0; shift < levels; ++shift) {
    if (shift > 0) {
      level = shift == 1 ? halved(tile.grey, tile.valid, tile.rect, 1)
                         : halved(level.grey_view(), level.valid_view(), level.rect, shift);
    }
    const PixelRect& rect = shift == 0 ? tile.rect : level.rect;
    const ImageU8 grey = shift == 0 ? tile.grey : level.grey_view();
    const ImageU8 valid = shift == 0 ? tile.valid : level.valid_view();
    // spots near enough to the core to matter
    const int margin = (chain >> shift) + wander_px(view.tan_elevation) + kMaximumRadius + 4;
    const int x0 = std::max(rect.x0, (core.x0 >> shift) - margin);
    const int y0 = std::max(rect.y0, (core.y0 >> shift) - margin);
    const int x1 = std::min(rect.x0 + rect.width, ((core.x0 + core.width) >> shift) + margin + 1);
    const int y1 = std::min(rect.y0 + rect.height, ((core.y0 + core.height) >> shift) + margin + 1);
    if (x1 <= x0 || y1 <= y0) continue;
    const double scale = 1 << shift;
    const double offset = 0.5 * (scale - 1.0);
    const double least = shift == 0 ? std::max(2.0, 0.5 * least_px * 0.8) : kLeastAcross_px;
    const double wanted = 0.4 * least_px / scale;  // half widths, with some slack
    if (wanted >= kMostOwn_px || (wanted >= 2.0 * kLeastAcross_px && shift + 1 < levels))
      continue;  // the next level's
    const PixelRect where{x0 - rect.x0, y0 - rect.y0, x1 - x0, y1 - y0};
    for (const Spot& spot : maxima(darkness(grey, valid, where, params.seed_contrast), where)) {
      const ShadowFit f = fitter.fit(grey, valid, spot.x, spot.y, least);
      if (!f.found) continue;
      if (f.across_px > kMostOwn_px && shift + 1 < levels) continue;  // the next level's
      Candidate c;
      c.u = (spot.x + rect.x0 + f.du_px) * scale + offset;
      c.v = (spot.y + rect.y0 + f.dv_px) * scale + offset;
      c.across = f.across_px * scale;
      c.along = f.along_px * scale;
      c.reach = f.reach_px * scale;
      c.explained = f.explained * scale * scale;
      c.contrast = (f.ground - f.dark) / 255.0;
      const Features features = features_of(f, view.tan_elevation);
      c.confidence = confidence_of(features, view.tan_elevation);
      if (c.confidence < params.min_confidence) continue;
      candidates.push_back(c);
    }
  }

  // Of those that overlap, the strongest stays.
  std::sort(candidates.begin(), candidates.end(), before);
  candidates.erase(
      std::unique(candidates.begin(), candidates.end(),
                  [](const Candidate& a, const Candidate& b) { return !before(a, b) && !before(b, a); }),
      candidates.end());
  enum class State : std::uint8_t { kOpen, kKept, kBeaten };
  std::vector<State> state(candidates.size(), State::kOpen);
  const double widest = 0.8 * kMostSize_px * (1 << (levels - 1));
  const auto neighbours = [&](std::size_t i, const auto& visit) {
    for (std::size_t j = i; j-- > 0 && candidates[j].v > candidates[i].v - widest;) visit(j);
    for (std::size_t j = i + 1; j < candidates.size() && candidates[j].v < candidates[i].v + widest; ++j)
      visit(j);
  };
  for (int round = 0; round < kRounds; ++round) {
    std::vector<State> next = state;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (state[i] != State::kOpen) continue;
      bool best = true;
      bool beaten = false;
      neighbours(i, [&](std::size_t j) {
        if (beaten || state[j] == State::kBeaten || !overlap(candidates[i], candidates[j])) return;
        if (state[j] == State::kKept) beaten = true;
        if (stronger(candidates[j], candidates[i])) best = false;
      });
      next[i] = beaten ? State::kBeaten : best ? State::kKept : State::kOpen;
    }
    state = next;
  }

  std::vector<ShadowBoulder> boulders;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Candidate& c = candidates[i];
    if (state[i] != State::kKept || c.confidence < params.min_confidence) continue;
    if (!core.contains(static_cast<int>(std::floor(c.u + 0.5)), static_cast<int>(std::floor(c.v + 0.5))))
      continue;
    ShadowBoulder b;
    b.u_px = c.u;
    b.v_px = c.v;
    b.diameter_px = 2.0 * size_of(c);
    if (b.diameter_px < least_px || b.diameter_px * view.pixel_m > params.max_diameter_m) continue;
    b.elongation = std::max(c.across, c.along) / std::min(c.across, c.along);
    b.contrast = c.contrast;
    b.height_px = std::sqrt(std::max(0.0, c.reach * c.reach - c.along * c.along)) * view.tan_elevation;
    b.confidence = c.confidence;
    boulders.push_back(b);
  }
  return boulders;
}

TableBoulder table_boulder(const ShadowBoulder& boulder, const GeoTransform& geo) {
  TableBoulder b;
  const double pixel_m = geo.pixel_m();
  b.p_map_m = geo.to_map(boulder.u_px, boulder.v_px);
  b.diameter_m = boulder.diameter_px * pixel_m;
  b.area_m2 = 0.25 * kPi * b.diameter_m * b.diameter_m;
  b.contrast = boulder.contrast;
  b.elongation = boulder.elongation;
  b.height_m = boulder.height_px * pixel_m;
  b.confidence = boulder.confidence;
  return b;
}

}  // namespace cairn::ground
