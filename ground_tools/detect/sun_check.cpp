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
constexpr int kWindows = 3;  // a side
constexpr int kGuessWindows = 2;
constexpr int kCandidates = 8;  // a side, where none of those is half full
constexpr double kHalf = 0.5;
constexpr double kLeastShare = 0.05;
constexpr int kEnoughFits = 6000;  // both ways together
constexpr int kLeastFits = 50;
constexpr double kClearEach = 0.06;
constexpr double kClearTogether = 5.0;
constexpr double kSure = 0.8;  // confidence of a find that tells the elevation

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

/// Those that are half full and more; where none is, of a strip or in a wide collar, the fullest of many.
std::vector<Window> windows_with_data(RasterReader& reader, const RasterFacts& facts, int most) {
  std::vector<Window> kept;
  for (const PixelBox& box : windows_of(facts, most)) {
    Window window{box, {}, {}};
    if (window.read(reader) >= kHalf) kept.push_back(std::move(window));
  }
  if (!kept.empty()) return kept;
  std::vector<std::pair<double, PixelBox>> candidates;
  for (const PixelBox& box : windows_of(facts, kCandidates)) {
    const double share = Window{box, {}, {}}.read(reader);
    if (share >= kLeastShare) candidates.emplace_back(share, box);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  candidates.resize(std::min(candidates.size(), static_cast<std::size_t>(most * most)));
  for (const auto& [share, box] : candidates) {
    kept.push_back({box, {}, {}});
    kept.back().read(reader);
  }
  return kept;
}

/// A window as the detector takes it.
struct GreyWindow {
  Window window;
  std::vector<std::uint8_t> grey;

  GreyTile tile() const {
    GreyTile tile;
    tile.rect = {window.box.x0, window.box.y0, window.box.width(), window.box.height()};
    tile.grey = packed_view<const std::uint8_t>(grey.data(), tile.rect.width, tile.rect.height);
    tile.valid = packed_view<const std::uint8_t>(window.valid.data(), tile.rect.width, tile.rect.height);
    return tile;
  }
};

std::vector<GreyWindow> grey_windows(RasterReader& reader, const RasterFacts& facts, int most) {
  std::vector<GreyWindow> windows;
  for (Window& window : windows_with_data(reader, facts, most)) {
    std::vector<std::uint8_t> grey = grey_of(window, facts.depth);
    windows.push_back({std::move(window), std::move(grey)});
  }
  return windows;
}

/// Beyond what scarps and gullies, of which neither direction is told, came to (`make sun-weights`).
bool is_clear(const SunMargin& margin) {
  return margin.each > kClearEach && margin.together > kClearTogether;
}

constexpr int kAzimuths = 12;
constexpr double kStep = 2.0 * kPi / kAzimuths;
using Directions = std::array<SunEvidence, kAzimuths>;

SunEvidence& at(Directions& all, int i) { return all[static_cast<std::size_t>((i + kAzimuths) % kAzimuths)]; }

/// The vertex of the parabola through the best and its neighbours.
double azimuth_about(Directions& all, int best) {
  const double before = at(all, best - 1).mean();
  const double after = at(all, best + 1).mean();
  const double bend = before - 2.0 * at(all, best).mean() + after;
  const double shift = bend < 0.0 ? 0.5 * (before - after) / bend : 0.0;
  const double azimuth = (best + std::clamp(shift, -0.5, 0.5)) * kStep;
  return azimuth < 0.0 ? azimuth + 2.0 * kPi : azimuth;
}

/// Boulders and hollows that the detector is sure of.
std::size_t sure_finds(const GreyTile& tile, const ShadowView& view) {
  ShadowParams params;
  params.max_diameter_px = kMostWitness_px;
  params.min_confidence = kSure;
  const ShadowFinds found = detect_by_shadow(tile, tile.rect, view, params);
  return found.boulders.size() + found.craters.size();
}

double elevation_by_finds(const std::vector<GreyWindow>& windows, const GeoTransform& geo, double azimuth_rad,
                          double otherwise_rad) {
  std::size_t most = 0;
  for (const double degrees : {15.0, 22.0, 30.0, 40.0, 55.0}) {
    std::size_t finds = 0;
    for (const GreyWindow& window : windows)
      finds += sure_finds(window.tile(), shadow_view({degrees * kRadPerDeg, azimuth_rad}, geo));
    if (finds <= most) continue;
    most = finds;
    otherwise_rad = degrees * kRadPerDeg;
  }
  return otherwise_rad;
}

}  // namespace

bool SunCheck::looks_reversed() const { return is_clear(margin(opposite, told)); }

SunCheck check_sun(RasterReader& reader, const RasterFacts& facts, const Sun& sun) {
  SunCheck check;
  const Sun turned{sun.elevation_rad, sun.azimuth_rad + kPi};
  for (const GreyWindow& window : grey_windows(reader, facts, kWindows)) {
    if (check.told.fits + check.opposite.fits > kEnoughFits) break;
    add_evidence(window.tile(), shadow_view(sun, facts.geo), check.told);
    add_evidence(window.tile(), shadow_view(turned, facts.geo), check.opposite);
  }
  return check;
}

bool SunGuess::is_sure() const { return best.fits >= kLeastFits && is_clear(margin(best, rival)); }

SunGuess guess_sun(RasterReader& reader, const RasterFacts& facts, double elevation_rad) {
  constexpr double kUsual = 30.0 * kRadPerDeg;
  const std::vector<GreyWindow> windows = grey_windows(reader, facts, kGuessWindows);
  SunGuess guess;
  guess.sun.elevation_rad = elevation_rad > 0.0 ? elevation_rad : kUsual;
  Directions all;
  for (int i = 0; i < kAzimuths; ++i) {
    for (const GreyWindow& window : windows)
      add_evidence(window.tile(), shadow_view({guess.sun.elevation_rad, i * kStep}, facts.geo), at(all, i));
  }
  int best = 0;
  for (int i = 1; i < kAzimuths; ++i)
    if (at(all, i).mean() > at(all, best).mean()) best = i;
  guess.best = at(all, best);
  guess.opposite = guess.rival = at(all, best + kAzimuths / 2);
  for (int k = kAzimuths / 4; k <= 3 * kAzimuths / 4; ++k)
    if (at(all, best + k).mean() > guess.rival.mean()) guess.rival = at(all, best + k);
  guess.sun.azimuth_rad = azimuth_about(all, best);
  if (elevation_rad <= 0.0)
    guess.sun.elevation_rad = elevation_by_finds(windows, facts.geo, guess.sun.azimuth_rad, kUsual);
  return guess;
}

}  // namespace cairn::ground
