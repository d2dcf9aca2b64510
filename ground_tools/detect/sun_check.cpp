#include "detect/sun_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <future>
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

/// From the least value to the largest, but for a two-thousandth at each end; 8 bits are grey already.
GreyRange range_of(RasterReader& reader, const PixelBox& box, PixelDepth depth) {
  GreyRange range;
  if (depth == PixelDepth::kEight) return range;
  std::vector<float> values(box.pixels());
  std::vector<std::uint8_t> kinds(box.pixels());
  std::vector<float> sorted;
  const bool any = reader.read_values(box, values.data(), kinds.data());
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!any || kinds[i] == 0) sorted.push_back(values[i]);
  if (sorted.empty()) return range;
  std::sort(sorted.begin(), sorted.end());
  range.low = sorted[sorted.size() / 2000];
  range.high = std::max(sorted[sorted.size() - 1 - sorted.size() / 2000], std::nextafter(range.low, 1e30F));
  return range;
}

/// A window as the detector takes it: what is darker or brighter than the file can tell is black or white.
struct Window {
  PixelBox box;
  std::vector<std::uint8_t> grey;
  std::vector<std::uint8_t> valid;  ///< 255, or 0 where there is none

  /// Share of the pixels that are there.
  double read(RasterReader& reader, PixelDepth depth) {
    grey.resize(box.pixels());
    valid.assign(box.pixels(), 255);
    std::vector<std::uint8_t> missing(box.pixels());
    if (!reader.read(box, range_of(reader, box, depth), grey.data(), missing.data(), box.width())) return 1.0;
    for (std::size_t i = 0; i < missing.size(); ++i)
      if (missing[i] != 0) valid[i] = 0;
    const auto gone = std::count_if(missing.begin(), missing.end(), [](std::uint8_t m) { return m != 0; });
    return 1.0 - static_cast<double>(gone) / static_cast<double>(missing.size());
  }
  GreyTile tile() const {
    GreyTile tile;
    tile.rect = {box.x0, box.y0, box.width(), box.height()};
    tile.grey = packed_view<const std::uint8_t>(grey.data(), tile.rect.width, tile.rect.height);
    tile.valid = packed_view<const std::uint8_t>(valid.data(), tile.rect.width, tile.rect.height);
    return tile;
  }
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

/// Those that are half full and more; where none is, of a strip or in a wide collar, the fullest of many.
std::vector<Window> windows_with_data(RasterReader& reader, const RasterFacts& facts, int most) {
  std::vector<Window> kept;
  for (const PixelBox& box : windows_of(facts, most)) {
    Window window{box, {}, {}};
    if (window.read(reader, facts.depth) >= kHalf) kept.push_back(std::move(window));
  }
  if (!kept.empty()) return kept;
  std::vector<std::pair<double, PixelBox>> candidates;
  for (const PixelBox& box : windows_of(facts, kCandidates)) {
    const double share = Window{box, {}, {}}.read(reader, facts.depth);
    if (share >= kLeastShare) candidates.emplace_back(share, box);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  candidates.resize(std::min(candidates.size(), static_cast<std::size_t>(most * most)));
  for (const auto& [share, box] : candidates) {
    kept.push_back({box, {}, {}});
    kept.back().read(reader, facts.depth);
  }
  return kept;
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

double elevation_by_finds(const std::vector<Window>& windows, const GeoTransform& geo, double azimuth_rad,
                          double otherwise_rad) {
  std::size_t most = 0;
  for (const double degrees : {15.0, 22.0, 30.0, 40.0, 55.0}) {
    std::size_t finds = 0;
    for (const Window& window : windows)
      finds += sure_finds(window.tile(), shadow_view({degrees * kRadPerDeg, azimuth_rad}, geo));
    if (finds <= most) continue;
    most = finds;
    otherwise_rad = degrees * kRadPerDeg;
  }
  return otherwise_rad;
}

}  // namespace

bool SunCheck::looks_reversed() const { return is_clear(margin(opposite, told)); }

SunCheck check_sun(RasterReader& reader, const RasterFacts& facts, const Sun& sun, int threads) {
  SunCheck check;
  const Sun turned{sun.elevation_rad, sun.azimuth_rad + kPi};
  for (const Window& window : windows_with_data(reader, facts, kWindows)) {
    if (check.told.fits + check.opposite.fits > kEnoughFits) break;
    const auto add = [&](const Sun& by, SunEvidence& to) {
      add_evidence(window.tile(), shadow_view(by, facts.geo), to);
    };
    const auto when = threads != 1 ? std::launch::async : std::launch::deferred;
    std::future<void> opposite = std::async(when, [&] { add(turned, check.opposite); });
    add(sun, check.told);
    opposite.get();
  }
  return check;
}

bool SunGuess::is_sure() const { return best.fits >= kLeastFits && is_clear(margin(best, rival)); }

SunGuess guess_sun(RasterReader& reader, const RasterFacts& facts, double elevation_rad) {
  constexpr double kUsual = 30.0 * kRadPerDeg;
  const std::vector<Window> windows = windows_with_data(reader, facts, kGuessWindows);
  SunGuess guess;
  guess.sun.elevation_rad = elevation_rad > 0.0 ? elevation_rad : kUsual;
  Directions all;
  for (int i = 0; i < kAzimuths; ++i) {
    for (const Window& window : windows)
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
