#include "detect/sun_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/trig.hpp"
#include "detect/shadow_detector.hpp"

namespace cairn::ground {
namespace {

constexpr int kWindowPx = 512;
constexpr int kWindows = 3;     // a side
constexpr int kCandidates = 8;  // a side, where none of those is half full
constexpr double kHalf = 0.5;
constexpr double kLeastShare = 0.05;
constexpr int kLevels = 4;
constexpr int kLeastSidePx = 40;
constexpr double kLeastPixelM = 0.01;
constexpr int kAround = 12;  // half the side of the surroundings
constexpr int kReachPx = 9;  // where the lit body is looked for
constexpr int kRimPx = kAround + 2;
constexpr double kDark = 4.0;             // standard deviations of the ground's texture
constexpr double kClear = 0.2;            // of the spot's darkness
constexpr double kSure = 0.8;             // confidence of a boulder that is a witness
constexpr int kEnough = 150;              // boulders, both ways together
constexpr double kMostWitness_px = 64.0;  // larger ones take pixels from beyond the window

struct Level {
  int width = 0;
  int height = 0;
  std::vector<float> values;
  std::vector<double> sums;  ///< over the rectangle from the origin, a row and a column more than `values`

  float at(int x, int y) const {
    return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
  double& sum(int x, int y) {
    return sums[static_cast<std::size_t>(y) * static_cast<std::size_t>(width + 1) +
                static_cast<std::size_t>(x)];
  }
  double sum(int x, int y) const {
    return sums[static_cast<std::size_t>(y) * static_cast<std::size_t>(width + 1) +
                static_cast<std::size_t>(x)];
  }

  void add_up() {
    sums.assign(static_cast<std::size_t>(width + 1) * static_cast<std::size_t>(height + 1), 0.0);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x)
        sum(x + 1, y + 1) = static_cast<double>(at(x, y)) + sum(x, y + 1) + sum(x + 1, y) - sum(x, y);
    }
  }
  /// Mean of the square of side 2 `half` + 1, as far as it lies inside.
  double mean(int x, int y, int half) const {
    const int x0 = std::max(0, x - half);
    const int x1 = std::min(width, x + half + 1);
    const int y0 = std::max(0, y - half);
    const int y1 = std::min(height, y + half + 1);
    return (sum(x1, y1) - sum(x0, y1) - sum(x1, y0) + sum(x0, y0)) /
           (static_cast<double>(x1 - x0) * (y1 - y0));
  }
};

Level halved(const Level& fine) {
  Level level{fine.width / 2, fine.height / 2, {}, {}};
  for (int y = 0; y < level.height; ++y) {
    for (int x = 0; x < level.width; ++x) {
      level.values.push_back(0.25F * (fine.at(2 * x, 2 * y) + fine.at(2 * x + 1, 2 * y) +
                                      fine.at(2 * x, 2 * y + 1) + fine.at(2 * x + 1, 2 * y + 1)));
    }
  }
  return level;
}

/// The darkest of the 5 x 5 around it; of equals the last.
bool is_spot(const Level& level, int x, int y) {
  const double here = level.mean(x, y, 1);
  for (int j = -2; j <= 2; ++j) {
    for (int i = -2; i <= 2; ++i) {
      const double there = level.mean(x + i, y + j, 1);
      if (there < here || (there == here && (j > 0 || (j == 0 && i > 0)))) return false;
    }
  }
  return true;
}

/// How much the way from a place differs from the ground, mean over its pixels.
double unlike_ground(const Level& level, int x, int y, const Vec2& step, double around) {
  double sum = 0.0;
  for (int t = 2; t <= kReachPx; ++t) {
    sum += std::fabs(level.mean(static_cast<int>(std::lround(x + t * step.x())),
                                static_cast<int>(std::lround(y + t * step.y())), 1) -
                     around);
  }
  return sum / (kReachPx - 1);
}

void count_spots(Level& level, const Vec2& towards, SunCheck& check) {
  level.add_up();
  std::vector<double> texture;
  for (int y = 0; y < level.height; ++y) {
    for (int x = 0; x < level.width; ++x)
      texture.push_back(std::fabs(level.mean(x, y, 1) - level.mean(x, y, kAround)));
  }
  const auto middle = texture.begin() + static_cast<std::ptrdiff_t>(texture.size() / 2);
  std::nth_element(texture.begin(), middle, texture.end());
  const double clear = kDark * 1.4826 * *middle;
  for (int y = kRimPx; y < level.height - kRimPx; ++y) {
    for (int x = kRimPx; x < level.width - kRimPx; ++x) {
      const double around = level.mean(x, y, kAround);
      const double darkness = around - level.mean(x, y, 1);
      if (!(darkness > clear) || !(darkness > 0.0) || !is_spot(level, x, y)) continue;
      const double lit = unlike_ground(level, x, y, towards, around);
      const double other = unlike_ground(level, x, y, -towards, around);
      if (lit - other > kClear * darkness) ++check.towards;
      if (other - lit > kClear * darkness) ++check.away;
    }
  }
}

/// A window's values; those that are missing are the mean of the others.
struct Window {
  PixelBox box;
  std::vector<float> values;
  std::vector<std::uint8_t> valid;  ///< 255, or 0 where there is none

  /// Share of those that are there.
  double read(RasterReader& reader) {
    values.resize(box.pixels());
    valid.assign(box.pixels(), 255);
    std::vector<std::uint8_t> missing(box.pixels());
    if (!reader.read_values(box, values.data(), missing.data())) return 1.0;
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < missing.size(); ++i) {
      if (missing[i] != 0) continue;
      sum += static_cast<double>(values[i]);
      ++count;
    }
    if (count == 0) return 0.0;
    const auto mean = static_cast<float>(sum / static_cast<double>(count));
    for (std::size_t i = 0; i < missing.size(); ++i) {
      if (missing[i] == 0) continue;
      values[i] = mean;
      valid[i] = 0;
    }
    return static_cast<double>(count) / static_cast<double>(missing.size());
  }
  Level level() const { return {box.width(), box.height(), values, {}}; }
};

/// Its grey as the detector takes it: 8 bits as they are, else from the least value to the largest but for a
/// two-thousandth at each end.
std::vector<std::uint8_t> grey_of(const Window& window, PixelDepth depth) {
  float low = 0.0F;
  float high = 255.0F;
  if (depth != PixelDepth::kEight) {
    std::vector<float> sorted = window.values;
    std::sort(sorted.begin(), sorted.end());
    low = sorted[sorted.size() / 2000];
    high = std::max(sorted[sorted.size() - 1 - sorted.size() / 2000], std::nextafter(low, 1e30F));
  }
  std::vector<std::uint8_t> grey;
  for (const float value : window.values)
    grey.push_back(
        static_cast<std::uint8_t>(std::clamp((value - low) / (high - low) * 255.0F, 0.0F, 255.0F)));
  return grey;
}

ShadowFinds sure_finds(const Window& window, const std::vector<std::uint8_t>& grey, const ShadowView& view) {
  GreyTile tile;
  tile.rect = {window.box.x0, window.box.y0, window.box.width(), window.box.height()};
  tile.grey = packed_view<const std::uint8_t>(grey.data(), tile.rect.width, tile.rect.height);
  tile.valid = packed_view<const std::uint8_t>(window.valid.data(), tile.rect.width, tile.rect.height);
  ShadowParams params;
  params.max_diameter_px = kMostWitness_px;
  params.min_confidence = kSure;
  return detect_by_shadow(tile, tile.rect, view, params);
}

void count(const ShadowFinds& found, int& boulders, int& finds) {
  boulders += static_cast<int>(found.boulders.size());
  finds += static_cast<int>(found.boulders.size() + found.craters.size());
}

struct Count {
  int boulders = 0;
  int finds = 0;
};

/// Windows all over the image, at most `most` a side.
std::vector<PixelBox> windows_of(const RasterFacts& facts, int most) {
  const auto count = [&](int side) { return std::min(most, (side + kWindowPx - 1) / kWindowPx); };
  const auto place = [](int i, int n, int side) {
    return n <= 1 ? 0
                  : static_cast<int>(static_cast<std::int64_t>(std::max(0, side - kWindowPx)) * i / (n - 1));
  };
  const int across = count(facts.width);
  const int down = count(facts.height);
  std::vector<PixelBox> boxes;
  for (int j = 0; j < down; ++j) {
    for (int i = 0; i < across; ++i) {
      PixelBox box{place(i, across, facts.width), place(j, down, facts.height), 0, 0};
      box.x1 = std::min(box.x0 + kWindowPx, facts.width);
      box.y1 = std::min(box.y0 + kWindowPx, facts.height);
      boxes.push_back(box);
    }
  }
  return boxes;
}

struct Windows {
  std::vector<Window> windows;
  bool sparse = false;  ///< most of each is missing: spots there may be its rims
};

/// Those that are half full and more; where none is, of a strip or in a wide collar, the fullest of many.
Windows windows_with_data(RasterReader& reader, const RasterFacts& facts, int most) {
  Windows kept;
  for (const PixelBox& box : windows_of(facts, most)) {
    Window window{box, {}, {}};
    if (window.read(reader) >= kHalf) kept.windows.push_back(std::move(window));
  }
  if (!kept.windows.empty()) return kept;
  kept.sparse = true;
  std::vector<std::pair<double, PixelBox>> candidates;
  for (const PixelBox& box : windows_of(facts, kCandidates)) {
    const double share = Window{box, {}, {}}.read(reader);
    if (share >= kLeastShare) candidates.emplace_back(share, box);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  candidates.resize(std::min(candidates.size(), static_cast<std::size_t>(most * most)));
  for (const auto& [share, box] : candidates) {
    kept.windows.push_back({box, {}, {}});
    kept.windows.back().read(reader);
  }
  return kept;
}

/// Whether there are clearly more of `these`.
bool clearly_more(int these, int those) {
  return these - those > 2.5 * std::sqrt(static_cast<double>(these + those + 1)) && these > 1.5 * those;
}

}  // namespace

bool SunCheck::hollows_are_reversed() const {
  const double more = opposite_finds - finds;
  return 20 * opposite < opposite_finds && 4 * opposite_finds > 5 * finds &&
         more > 4.0 * std::sqrt(static_cast<double>(finds + opposite_finds));
}

bool SunCheck::looks_reversed() const {
  if (hollows_are_reversed()) return true;
  const double more = finds - opposite_finds;
  if (10 * finds > 11 * opposite_finds && more > 1.5 * std::sqrt(static_cast<double>(finds + opposite_finds)))
    return false;
  if (clearly_more(opposite, boulders)) return true;
  return clearly_more(away, towards) && !clearly_more(boulders, opposite);
}

SunCheck check_sun(RasterReader& reader, const RasterFacts& facts, const Sun& sun) {
  SunCheck check;
  const Vec2 towards = sun_direction_px(sun, facts.geo);
  const Sun turned{sun.elevation_rad, sun.azimuth_rad + kPi};
  const Windows looked_at = windows_with_data(reader, facts, kWindows);
  for (const Window& window : looked_at.windows) {
    if (check.boulders + check.opposite < kEnough) {
      const std::vector<std::uint8_t> grey = grey_of(window, facts.depth);
      count(sure_finds(window, grey, shadow_view(sun, facts.geo)), check.boulders, check.finds);
      count(sure_finds(window, grey, shadow_view(turned, facts.geo)), check.opposite, check.opposite_finds);
    }
    if (looked_at.sparse) continue;
    Level level = window.level();
    double pixel_m = facts.geo.pixel_m();
    for (; pixel_m < kLeastPixelM && level.width >= 2 * kLeastSidePx; pixel_m *= 2.0) level = halved(level);
    for (int k = 0; k < kLevels && std::min(level.width, level.height) >= kLeastSidePx; ++k) {
      count_spots(level, towards, check);
      level = halved(level);
    }
  }
  return check;
}

bool SunGuess::is_sure() const {
  const int these = finds_are_alike() ? boulders : finds;
  const int those = finds_are_alike() ? rival_boulders : rival;
  return these >= 20 && 3 * these > 4 * those &&
         these - those > 2.5 * std::sqrt(static_cast<double>(these + those));
}

SunGuess guess_sun(RasterReader& reader, const RasterFacts& facts, double elevation_rad) {
  constexpr int kAzimuths = 12;
  constexpr double kStep = 2.0 * kPi / kAzimuths;
  constexpr double kUsual = 30.0 * kRadPerDeg;
  std::vector<std::pair<Window, std::vector<std::uint8_t>>> windows;
  for (Window& window : windows_with_data(reader, facts, 2).windows) {
    std::vector<std::uint8_t> grey = grey_of(window, facts.depth);
    windows.emplace_back(std::move(window), std::move(grey));
  }
  const auto count_with = [&](double elevation, double azimuth) {
    Count seen;
    for (const auto& [window, grey] : windows)
      count(sure_finds(window, grey, shadow_view({elevation, azimuth}, facts.geo)), seen.boulders,
            seen.finds);
    return seen;
  };
  SunGuess guess;
  guess.sun.elevation_rad = elevation_rad > 0.0 ? elevation_rad : kUsual;
  std::array<Count, kAzimuths> counts;
  for (int i = 0; i < kAzimuths; ++i)
    counts[static_cast<std::size_t>(i)] = count_with(guess.sun.elevation_rad, i * kStep);
  const auto at = [&](int i) { return counts[static_cast<std::size_t>((i + kAzimuths) % kAzimuths)]; };
  const auto take = [&](int i) {
    guess.finds = at(i).finds;
    guess.boulders = at(i).boulders;
    guess.opposite = at(i + kAzimuths / 2).finds;
    guess.opposite_boulders = at(i + kAzimuths / 2).boulders;
    guess.rival = guess.rival_boulders = 0;
    for (int k = kAzimuths / 3; k <= 2 * kAzimuths / 3; ++k) {
      guess.rival = std::max(guess.rival, at(i + k).finds);
      guess.rival_boulders = std::max(guess.rival_boulders, at(i + k).boulders);
    }
  };
  int best = 0;
  for (int i = 1; i < kAzimuths; ++i)
    if (at(i).finds > at(best).finds) best = i;
  take(best);
  if (guess.finds_are_alike() && guess.opposite_boulders > guess.boulders) {
    best = (best + kAzimuths / 2) % kAzimuths;
    take(best);
  }
  // the vertex of the parabola through the best and its neighbours
  const double before = at(best - 1).finds;
  const double after = at(best + 1).finds;
  const double bend = before - 2.0 * guess.finds + after;
  const double shift = bend < 0.0 ? 0.5 * (before - after) / bend : 0.0;
  const double azimuth = (best + std::clamp(shift, -0.5, 0.5)) * kStep;
  guess.sun.azimuth_rad = azimuth < 0.0 ? azimuth + 2.0 * kPi : azimuth;
  if (elevation_rad > 0.0) return guess;
  int most = 0;
  for (const double degrees : {15.0, 22.0, 30.0, 40.0, 55.0}) {
    const int finds = count_with(degrees * kRadPerDeg, guess.sun.azimuth_rad).finds;
    if (finds <= most) continue;
    most = finds;
    guess.sun.elevation_rad = degrees * kRadPerDeg;
  }
  return guess;
}

}  // namespace cairn::ground
