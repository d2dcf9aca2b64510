#include "bench/lost_rover.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "cmap/cmap_file.hpp"
#include "localizer/landmarks.hpp"

namespace cairn::bench {
namespace {

constexpr double kQuantum_m = 0.002;

/// In axes of the way.
bool is_seen(const LostCase& lost, const Vec2& p) {
  if (lost.half_band_m == 0.0) return p.norm() <= lost.radius_m;
  return std::fabs(p.x()) <= lost.radius_m && std::fabs(p.y()) <= lost.half_band_m;
}

Vec2 seen_at_random(const LostCase& lost, Rng& rng) {
  if (lost.half_band_m > 0.0)
    return {uniform(rng, -lost.radius_m, lost.radius_m), uniform(rng, -lost.half_band_m, lost.half_band_m)};
  const double r = lost.radius_m * std::sqrt(uniform(rng, 0.0, 1.0));
  const double a = uniform(rng, -kPi, kPi);
  return {r * std::cos(a), r * std::sin(a)};
}

/// As odometry has it.
Vec2 drifted(const LostCase& lost, const Vec2& p) {
  const double turned = lost.bend_per_m * p.x();
  const Vec2 bent(p.x() - turned * p.y(), p.y() + 0.5 * turned * p.x());
  return lost.scale * bent;
}

float diameter(Rng& rng) {
  return static_cast<float>(0.1 * std::min(20.0, std::pow(uniform(rng, 1e-9, 1.0), -0.5)));
}

}  // namespace

void EncodedMap::encode(const std::vector<MapBoulder>& boulders, const Vec2& low_m, const Vec2& high_m) {
  std::vector<ground::TableBoulder> table;
  for (const MapBoulder& b : boulders) {
    ground::TableBoulder t;
    t.p_map_m = b.p_map_m;
    t.diameter_m = static_cast<double>(b.diameter_m);
    table.push_back(t);
  }
  bytes_ = ground::encode_cmap(table, {low_m.x(), low_m.y(), high_m.x(), high_m.y()}, kQuantum_m, {});
  MapValidation validation;
  (void)validation.start(bytes_.data(), bytes_.size());
  WorkBudget all = WorkBudget::unlimited();
  (void)validation.step(all);
  map_ = validation.result();
  if (validation.status() != MapStatus::kUsable) {
    std::fprintf(stderr, "bench_fix: the map does not hold\n");
    std::exit(1);
  }
}

void LostRover::lay_map(const LostCase& lost, std::uint64_t seed) {
  if (laid_ == seed && !boulders_.empty()) return;
  laid_ = seed;
  Rng rng(seed);
  boulders_.clear();
  for (int i = 0; i < lost.boulders; ++i) {
    MapBoulder b;
    b.p_map_m = Vec2(uniform(rng, 0.0, lost.side_m), uniform(rng, 0.0, lost.side_m));
    if (lost.size_noise > 0.0) b.diameter_m = diameter(rng);
    boulders_.push_back(b);
  }
  encoded_.encode(boulders_, Vec2(0.0, 0.0), Vec2(lost.side_m, lost.side_m));
}

LostResult LostRover::look(const LostCase& lost, std::uint64_t seed, int number) {
  lay_map(lost, seed + 1000U * static_cast<std::uint64_t>(number / kTrialsOfAMap));
  Rng rng(seed + 7919U * static_cast<std::uint64_t>(number) + 13U);
  rng.discard(8);
  const Pose2 truth{uniform(rng, lost.radius_m, lost.side_m - lost.radius_m),
                    uniform(rng, lost.radius_m, lost.side_m - lost.radius_m), uniform(rng, -kPi, kPi)};
  const Vec2 centre = truth.translation();
  const Pose2 T_site_map = truth.inverse();
  std::vector<MapBoulder> near;
  for (const MapBoulder& b : boulders_) {
    if (is_seen(lost, T_site_map * b.p_map_m)) near.push_back(b);
  }
  std::shuffle(near.begin(), near.end(), rng);
  // Where there are not as many, those that there are.
  near.resize(std::min(near.size(), static_cast<std::size_t>(lost.truths)));
  for (MapBoulder& b : near)
    b.p_map_m = drifted(lost, T_site_map * b.p_map_m) + lost.noise_m * Vec2(gauss(rng), gauss(rng));
  for (int i = 0; i < lost.others; ++i) {
    MapBoulder b;
    b.p_map_m = seen_at_random(lost, rng);
    b.diameter_m = diameter(rng);
    near.push_back(b);
  }
  std::shuffle(near.begin(), near.end(), rng);
  LocalMap local;
  for (const MapBoulder& b : near) {
    LocalBoulder seen;
    seen.p_site_m = b.p_map_m;
    seen.id = static_cast<std::uint32_t>(local.size());
    seen.sightings = 5;
    if (lost.size_noise > 0.0)
      seen.diameter_m = b.diameter_m * static_cast<float>(std::exp(lost.size_noise * gauss(rng)));
    (void)local.push_back(seen);
  }
  MapFixParams params;
  if (lost.size_noise > 0.0) params.search.evidence.size_sigma = 1.2 * lost.size_noise;
  if (lost.pixel_m > 0.0)  // as Localizer::start_stage has it
    params.search.evidence.sigma_pair_m = params.lost.sigma_pair_m =
        LandmarkParams().pixel_share * lost.pixel_m;
  LostResult out;
  WorkBudget all = WorkBudget::unlimited();
  const Pose2 nowhere{0.5 * lost.side_m, 0.5 * lost.side_m, 0.0};
  if (fix_.start_lost(params, encoded_.map(), local, nowhere, Vec2(0.0, 0.0), SearchRegion()) ==
      MapFixStatus::kRunning)
    (void)fix_.step(all);
  out.ops = all.spent();
  out.accepted = fix_.status() == MapFixStatus::kAccepted;
  out.error_m = (fix_.result().T_map_site.translation() - centre).norm();
  out.sigma_m = std::sqrt(fix_.result().covariance.topLeftCorner<2, 2>().trace());
  return out;
}

}  // namespace cairn::bench
