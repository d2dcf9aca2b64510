// Fits where boulders of few pixels stand (detect/shadow_place.hpp): least squares over what the detector
// finds on rendered fields (shadow_fields.hpp) whose rocks are known. Not a test: `make shadow-places`.
//
//   shadow_places FOLDER
//
// Renders what is not in FOLDER yet, fits, and prints how far entries lie towards the sun, as fitted, by
// today's numbers and by the new ones, on fields fitted to and on others, by the sun's elevation. 1 where the
// source holds other numbers. No seed here is one of bench_detect.cpp.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <mutex>
#include <vector>

#include "base/parallel.hpp"
#include "base/progress_line.hpp"
#include "core/eigen.hpp"
#include "detect/shadow_detector.hpp"
#include "detect/shadow_place.hpp"
#include "ground_tools/detect/shadow_fields.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

/// An entry at a rock.
struct Example {
  double tan_elevation = 0.0;
  double across_px = 0.0, along_px = 0.0, reach_px = 0.0;
  double towards_px = 0.0;  ///< the middle of its outline, from the rock
};
using Set = std::vector<Example>;

struct Seeds {
  test::FieldKind kind;
  std::uint64_t first, count;
};
// Ground on which boulders go on below what is found.
constexpr Seeds kFit[] = {{test::FieldKind::kCratered, 1000, 48},
                          {test::FieldKind::kCoarse, 2000, 24},
                          {test::FieldKind::kFresh, 6000, 20},
                          {test::FieldKind::kFar, 5000, 6}};
constexpr Seeds kHeldOut[] = {{test::FieldKind::kCratered, 1500, 8},
                              {test::FieldKind::kCoarse, 2500, 6},
                              {test::FieldKind::kFresh, 6500, 4},
                              {test::FieldKind::kFar, 5500, 2}};

Set entries_of(const test::Raster& raster, const Sun& sun, const std::vector<TableBoulder>& rocks) {
  const ShadowView view = shadow_view(sun, raster.geo);
  const ShadowParams params;
  const PixelRect all{0, 0, raster.width, raster.height};
  const ShadowCandidates found =
      shadow_candidates({all, raster.grey_view(), raster.valid_view()}, all, view, params);
  const Vec2 towards = view.towards_sun_px;
  Set set;
  for (const ShadowCandidate& c : strongest(found.boulders, view, params)) {
    const Vec2 p = raster.geo.to_map(c.u_px, c.v_px);
    const TableBoulder* nearest = nullptr;
    for (const TableBoulder& rock : rocks) {
      if (rock.diameter_m < 2.0 * view.pixel_m || !test::is_at(p, rock, view.pixel_m)) continue;
      if (nearest == nullptr || (rock.p_map_m - p).norm() < (nearest->p_map_m - p).norm()) nearest = &rock;
    }
    if (nearest == nullptr) continue;
    // Metres of the map to pixels: north is up, so v falls as y grows.
    const Vec2 off = p - nearest->p_map_m;
    const double towards_px = (off.x() * towards.x() - off.y() * towards.y()) / view.pixel_m;
    set.push_back({view.tan_elevation, c.across_px, c.along_px, c.reach_px, towards_px});
  }
  return set;
}

template <std::size_t kCount>
Set gathered(const Seeds (&seeds)[kCount], const std::filesystem::path& folder) {
  Set all;
  for (const Seeds& of : seeds) {
    std::vector<Set> fields(of.count);
    ProgressLine progress(fmt::format("{} fields", test::kFieldKinds[static_cast<int>(of.kind)]));
    std::mutex guard;
    std::uint64_t done = 0;
    sim::parallel_for(of.count, [&](std::size_t i) {
      const test::RenderedField field = test::render(test::shadow_field(of.kind, of.first + i), folder);
      for (std::size_t k = 0; k < field.images.size(); ++k) {
        const Set more = entries_of(field.images[k], field.suns[k], field.rocks);
        fields[i].insert(fields[i].end(), more.begin(), more.end());
      }
      const std::lock_guard lock(guard);
      progress.show(static_cast<double>(++done) / static_cast<double>(of.count));
    });
    for (const Set& field : fields) all.insert(all.end(), field.begin(), field.end());
  }
  return all;
}

/// As it is written.
double rounded(double x) { return std::stod(fmt::format("{:.3g}", x)); }

ShadowPlace fitted(const Set& set) {
  Mat3 A = Mat3::Zero();
  Vec3 b = Vec3::Zero();
  for (const Example& e : set) {
    if (shift_from_sun_px(e.across_px, e.along_px, e.reach_px, e.tan_elevation, {1.0, 0.0, 0.0}) == 0.0)
      continue;
    const ShadowPlace terms = place_terms(e.along_px, e.reach_px, e.tan_elevation);
    const Vec3 x(terms[0], terms[1], terms[2]);
    A += x * x.transpose();
    b += e.towards_px * x;
  }
  const Vec3 p = A.ldlt().solve(b);
  return {rounded(p[0]), rounded(p[1]), rounded(p[2])};
}

void print(const char* name, const Set& set, const ShadowPlace& made) {
  fmt::print(
      "{}\n  sun        outlines  of    entries  towards the sun, px: as fitted  today  new   rms: as fitted  new\n",
      name);
  constexpr double kSuns_deg[] = {0.0, 22.0, 32.0, 42.0, 90.0};
  for (const bool least : {true, false}) {
    for (std::size_t s = 0; s + 1 < 5; ++s) {
      double n = 0.0, raw = 0.0, now = 0.0, then = 0.0, raw2 = 0.0, then2 = 0.0;
      for (const Example& e : set) {
        const double elevation = std::atan(e.tan_elevation) / kRadPerDeg;
        const auto shift = [&](const ShadowPlace& p) {
          return shift_from_sun_px(e.across_px, e.along_px, e.reach_px, e.tan_elevation, p);
        };
        const bool is_least = shift({1.0, 0.0, 0.0}) != 0.0;
        if (elevation < kSuns_deg[s] || elevation >= kSuns_deg[s + 1] || is_least != least) continue;
        n += 1.0;
        raw += e.towards_px;
        now += e.towards_px - shift(kShadowPlace);
        const double left = e.towards_px - shift(made);
        then += left;
        raw2 += e.towards_px * e.towards_px;
        then2 += left * left;
      }
      if (n < 20.0) continue;
      fmt::print("  {:2.0f} to {:2.0f}   {:8} {:>10.0f} {:>30.2f} {:>6.2f} {:>5.2f} {:>13.2f} {:>5.2f}\n",
                 kSuns_deg[s], kSuns_deg[s + 1], least ? "least" : "wider", n, raw / n, now / n, then / n,
                 std::sqrt(raw2 / n), std::sqrt(then2 / n));
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "usage: shadow_places FOLDER\n");
    return 1;
  }
  const Set fit = gathered(kFit, argv[1]);
  const Set held_out = gathered(kHeldOut, argv[1]);
  const ShadowPlace made = fitted(fit);
  print("fitted to", fit, made);
  print("held out", held_out, made);
  fmt::print("kShadowPlace = {{{}, {}, {}}}\n", made[0], made[1], made[2]);
  double apart = 0.0;
  for (std::size_t i = 0; i < made.size(); ++i) apart = std::max(apart, std::fabs(made[i] - kShadowPlace[i]));
  if (apart <= 0.002) return 0;
  fmt::print(stderr, "detect/shadow_place.hpp holds other numbers\n");
  return 1;
}
