#include "detect/shadow_detector.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/tool_error.hpp"
#include "core/trig.hpp"
#include "detect/shadow_fit.hpp"

namespace cairn::ground {
namespace {

/// Half widths across the sun that are a level's own: beyond, the next serves better; below, the one before.
constexpr double kMostOwn_px = 7.5;
constexpr double kLeastAcross_px = 3.2;
constexpr double kLeastOutline_px = 2.0;  ///< half width across the sun, on the image itself
constexpr int kRounds = 3;                ///< of beating what overlaps
constexpr double kMostBoulder_px = 1.35 * kFitMostAcross_px;
constexpr double kMostSize_px = std::max(kMostBoulder_px, kMostHollow_px);
constexpr double kRim = 1.1;  ///< half widths from a boulder's middle: what lies within may be a part of it
constexpr double kLeastCrater_px = 5.0;  ///< across
constexpr double kLeastBalance = 0.2;    ///< of its walls
constexpr double kCraterWins = 1.0;      ///< over the boulder, in what both explain

using Candidate = ShadowCandidate;

/// Standard order that does not depend on tiles.
bool before(const Candidate& a, const Candidate& b) {
  if (a.v_px != b.v_px) return a.v_px < b.v_px;
  if (a.u_px != b.u_px) return a.u_px < b.u_px;
  if (a.explained != b.explained) return a.explained > b.explained;
  if (a.across_px != b.across_px) return a.across_px < b.across_px;
  return a.confidence > b.confidence;  // the same outline on two levels of the ground
}
bool stronger(const Candidate& a, const Candidate& b) {
  const double x = std::sqrt(a.confidence) * a.explained;
  const double y = std::sqrt(b.confidence) * b.explained;
  return x != y ? x > y : before(a, b);
}

double size_of(const Candidate& c) { return std::sqrt(c.across_px * c.along_px); }

bool overlap(const Candidate& a, const Candidate& b) {
  const double du = a.u_px - b.u_px;
  const double dv = a.v_px - b.v_px;
  const double near = 0.8 * std::max(size_of(a), size_of(b));
  return du * du + dv * dv < near * near;
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

/// How far beating reaches: pixels of the image from a candidate to the last one that has a say in its fate.
int chain_px(int levels) {
  const double most = std::max(kRounds * 0.8 * kMostSize_px, (kRounds * 0.8 + kRim) * kMostBoulder_px);
  return static_cast<int>(std::ceil(most)) << (levels - 1);
}

double least_diameter_px(const ShadowView& view, const ShadowParams& params) {
  return std::max(params.min_diameter_px, params.min_diameter_m / view.pixel_m);
}

/// Where spots of a level may matter to the core, pixels of its views; without width or height: nowhere.
PixelRect looked_at(const PyramidLevel& level, const PixelRect& core, int chain, double tan_elevation) {
  const PixelRect& rect = level.tile.rect;
  const int shift = level.shift;
  const int margin = (chain >> shift) + wander_px(tan_elevation) + 6;
  const int x0 = std::max(rect.x0, (core.x0 >> shift) - margin);
  const int y0 = std::max(rect.y0, (core.y0 >> shift) - margin);
  const int x1 = std::min(rect.x0 + rect.width, ((core.x0 + core.width) >> shift) + margin + 1);
  const int y1 = std::min(rect.y0 + rect.height, ((core.y0 + core.height) >> shift) + margin + 1);
  return {x0 - rect.x0, y0 - rect.y0, x1 - x0, y1 - y0};
}

Candidate candidate_of(const ShadowFit& f, const ShadowFeatures& features, double confidence,
                       ShadowGround ground, const Spot& spot, const PyramidLevel& level) {
  const double scale = 1 << level.shift;
  const double offset = 0.5 * (scale - 1.0);
  Candidate c{};
  c.u_px = (spot.x + level.tile.rect.x0 + f.du_px) * scale + offset;
  c.v_px = (spot.y + level.tile.rect.y0 + f.dv_px) * scale + offset;
  c.across_px = f.across_px * scale;
  c.along_px = f.along_px * scale;
  c.reach_px = f.reach_px * scale;
  c.explained = f.explained * scale * scale;
  c.near_ground = ground == ShadowGround::kNear;
  c.contrast = (f.ground - f.dark) / 255.0;
  const ShadowBody body = shadow_body(features, size_of(c));
  c.towards_sun_px = body.towards_sun * size_of(c);
  c.diameter_px = body.size * 2.0 * size_of(c);
  c.confidence = confidence;
  return c;
}

/// The hollow whose dark wall was seen at the spot, where it wins.
std::optional<Candidate> hollow_of(const ShadowFit& f, double confidence, const Spot& spot,
                                   const PyramidLevel& level) {
  const HollowFit& h = f.beyond_rim;
  if (confidence >= 0.5 || h.explained < kCraterWins * f.pair ||
      std::min(h.dark, h.lit) < kLeastBalance * std::max(h.dark, h.lit) ||
      2.0 * h.radius_px < kLeastCrater_px)
    return std::nullopt;
  const double scale = 1 << level.shift;
  const double offset = 0.5 * (scale - 1.0);
  Candidate c{};
  c.u_px = (spot.x + level.tile.rect.x0 + h.du_px) * scale + offset;
  c.v_px = (spot.y + level.tile.rect.y0 + h.dv_px) * scale + offset;
  c.across_px = c.along_px = c.reach_px = h.radius_px * scale;
  c.towards_sun_px = 0.0;
  c.diameter_px = 2.0 * c.across_px;
  c.near_ground = false;
  c.explained = h.explained * scale * scale;
  c.contrast = h.dark / 255.0;
  c.confidence = 1.0 - confidence;
  return c;
}

/// In standard order, each once.
void put_in_order(std::vector<Candidate>& candidates) {
  std::sort(candidates.begin(), candidates.end(), before);
  const auto same = [](const Candidate& a, const Candidate& b) { return !before(a, b) && !before(b, a); };
  candidates.erase(std::unique(candidates.begin(), candidates.end(), same), candidates.end());
}

ShadowBoulder boulder_of(const Candidate& c, const ShadowView& view) {
  ShadowBoulder b;
  b.u_px = c.u_px - c.towards_sun_px * view.towards_sun_px.x();
  b.v_px = c.v_px - c.towards_sun_px * view.towards_sun_px.y();
  b.diameter_px = c.diameter_px;
  b.elongation = std::max(c.across_px, c.along_px) / std::min(c.across_px, c.along_px);
  b.contrast = c.contrast;
  b.height_px =
      std::sqrt(std::max(0.0, c.reach_px * c.reach_px - c.along_px * c.along_px)) * view.tan_elevation;
  b.confidence = c.confidence;
  return b;
}

}  // namespace

ShadowParams ShadowParams::with_boulders_of(double diameter_m, double pixel_m) const {
  ShadowParams params = *this;
  params.min_diameter_m = std::min(min_diameter_m, diameter_m);
  params.min_diameter_px = std::min(min_diameter_px, std::max(kLeastDiameter_px, diameter_m / pixel_m));
  return params;
}

void check(const ShadowParams& params) {
  check_range("--min-diameter", params.min_diameter_m, 0.0, 1e3);
  check_range("--max-diameter", params.max_diameter_m, 1e-3, 1e4);
  check_range("least diameter in pixels", params.min_diameter_px, kLeastDiameter_px, 100.0);
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
  const int levels = levels_for(params, view.pixel_m);
  const int fit = wander_px(view.tan_elevation) + kSpotReach_px + 6;
  return ((2 * fit + 2) << (levels - 1)) + chain_px(levels);
}

ShadowCandidates shadow_candidates(const GreyTile& tile, const PixelRect& core, const ShadowView& view,
                                   const ShadowParams& params, std::vector<ShadowFeatures>* features) {
  ShadowFitter fitter(-view.towards_sun_px, view.tan_elevation);
  const int levels = levels_for(params, view.pixel_m);
  const double least_px = least_diameter_px(view, params);
  ShadowCandidates candidates;
  PyramidLevel level;
  level.tile = tile;
  for (int shift = 0; shift < levels; ++shift) {
    if (shift > 0) level = halved(level);
    const PixelRect where = looked_at(level, core, chain_px(levels), view.tan_elevation);
    if (where.width <= 0 || where.height <= 0) continue;
    const bool last = shift + 1 == levels;
    const double wanted = 0.4 * least_px / (1 << shift);  // half widths, with some slack
    if (wanted >= kMostOwn_px || (wanted >= 2.0 * kLeastAcross_px && !last)) continue;  // the next level's
    const double least = shift == 0 ? std::max(kLeastOutline_px, 0.5 * least_px * 0.8) : kLeastAcross_px;
    for (const Spot& spot : dark_spots(level.tile, where, params.seed_contrast)) {
      fitter.look_at(level.tile.grey, level.tile.valid, spot.x, spot.y);
      double most = 0.0;
      const auto fitted = [&](ShadowGround ground) {
        const ShadowFit f = fitter.fit(least, last ? kFitMostAcross_px : kMostOwn_px, ground);
        if (!f.found) return f;
        const ShadowFeatures of_fit = shadow_features(f, view.tan_elevation);
        const double confidence = shadow_confidence(of_fit);
        if (confidence >= params.min_confidence) {
          Candidate c = candidate_of(f, of_fit, confidence, ground, spot, level);
          if (features != nullptr) {
            c.fit = features->size();
            features->push_back(of_fit);
          }
          candidates.boulders.push_back(c);
        }
        most = std::max(most, confidence);
        return f;
      };
      if (least < kLeastAcross_px) fitted(ShadowGround::kNear);
      const ShadowFit f = fitted(ShadowGround::kWide);
      if (!f.found) continue;
      if (const auto hollow = hollow_of(f, most, spot, level)) candidates.hollows.push_back(*hollow);
    }
  }
  put_in_order(candidates.boulders);
  put_in_order(candidates.hollows);
  return candidates;
}

std::vector<ShadowCandidate> strongest(const std::vector<ShadowCandidate>& candidates, const ShadowView& view,
                                       const ShadowParams& params) {
  const double widest_px =
      std::max(0.8 * kMostSize_px, kRim * kMostBoulder_px) * (1 << (levels_for(params, view.pixel_m) - 1));
  enum class State : std::uint8_t { kOpen, kKept, kBeaten };
  std::vector<State> state(candidates.size(), State::kOpen);
  const auto neighbours = [&](std::size_t i, const auto& visit) {
    const double v = candidates[i].v_px;
    for (std::size_t j = i; j-- > 0 && candidates[j].v_px > v - widest_px;) visit(j);
    for (std::size_t j = i + 1; j < candidates.size() && candidates[j].v_px < v + widest_px; ++j) visit(j);
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
  const auto is_part = [&](std::size_t i) {
    const Candidate& c = candidates[i];
    bool part = false;
    neighbours(i, [&](std::size_t j) {
      const Candidate& whole = candidates[j];
      const double within = kRim * size_of(whole);
      const double du = whole.u_px - c.u_px;
      const double dv = whole.v_px - c.v_px;
      part = part || (state[j] == State::kKept && !whole.near_ground && whole.confidence >= c.confidence &&
                      du * du + dv * dv < within * within);
    });
    return part;
  };
  std::vector<Candidate> kept;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (state[i] == State::kKept && !(candidates[i].near_ground && is_part(i))) kept.push_back(candidates[i]);
  }
  return kept;
}

ShadowFinds detect_by_shadow(const GreyTile& tile, const PixelRect& core, const ShadowView& view,
                             const ShadowParams& params) {
  const double least_px = least_diameter_px(view, params);
  const ShadowCandidates candidates = shadow_candidates(tile, core, view, params);
  const auto in_core = [&](const Candidate& c) {
    return core.contains(static_cast<int>(std::floor(c.u_px + 0.5)),
                         static_cast<int>(std::floor(c.v_px + 0.5)));
  };
  ShadowFinds finds;
  for (const Candidate& c : strongest(candidates.boulders, view, params)) {
    const ShadowBoulder b = boulder_of(c, view);
    const bool in_range = b.diameter_px >= least_px && b.diameter_px * view.pixel_m <= params.max_diameter_m;
    if (in_core(c) && in_range) finds.boulders.push_back(b);
  }
  for (const Candidate& c : strongest(candidates.hollows, view, params)) {
    if (in_core(c)) finds.craters.push_back({c.u_px, c.v_px, 2.0 * c.across_px, c.contrast, c.confidence});
  }
  return finds;
}

std::vector<ShadowBoulder> detect_boulders_by_shadow(const GreyTile& tile, const PixelRect& core,
                                                     const ShadowView& view, const ShadowParams& params) {
  return detect_by_shadow(tile, core, view, params).boulders;
}

TableBoulder table_crater(const ShadowCrater& crater, const GeoTransform& geo) {
  TableBoulder b;
  b.p_map_m = geo.to_map(crater.u_px, crater.v_px);
  b.diameter_m = crater.diameter_px * geo.pixel_m();
  b.area_m2 = 0.25 * kPi * b.diameter_m * b.diameter_m;
  b.contrast = crater.contrast;
  b.confidence = crater.confidence;
  return b;
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
