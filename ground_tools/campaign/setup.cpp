#include "campaign/setup.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/tool_error.hpp"
#include "core/trig.hpp"
#include "mission_cfg.hpp"
#include "sim/hash_random.hpp"
#include "sim/traverse.hpp"

namespace cairn::ground {
namespace {

using sim::TraverseKind;

constexpr TraverseKind kKinds[] = {
    TraverseKind::kS,         TraverseKind::kStraight,  TraverseKind::kArc,      TraverseKind::kZigzag,
    TraverseKind::kStopAndGo, TraverseKind::kPointTurn, TraverseKind::kWaypoints};
constexpr double kLength_m = 20.0;

/// Numbers one after the other, in steps that read well in a file.
class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : draw_(seed, sim::Stream::kCampaign) {}

  double in(double low, double high) { return std::round(draw_.uniform(low, high) * 1.0e4) / 1.0e4; }
  int whole(int low, int high) {
    return std::min(high, low + static_cast<int>(draw_.uniform() * (high - low + 1)));
  }
  double either_sign(double low, double high) {
    const double value = in(low, high);
    return draw_.uniform() < 0.5 ? -value : value;
  }

 private:
  sim::Draw draw_;
};

void draw_ground(Numbers& n, Abundance abundance, sim::Scene& s) {
  s.site.relief_rms_m = n.in(0.05, 0.4);
  s.site.relief_wavelength_m = n.in(20.0, 40.0);
  s.site.ripple_height_m = n.in(0.0, 0.025);
  s.site.ripple_wavelength_m = n.in(0.25, 0.6);
  s.site.ripple_azimuth_deg = n.in(0.0, 180.0);
  s.site.texture_contrast = n.in(0.04, 0.12);
  s.site.patch_contrast = n.in(0.05, 0.25);
  s.site.patch_size_m = n.in(1.0, 4.0);
  s.rocks.k = abundance == Abundance::kSparse ? n.in(0.02, 0.032) : n.in(0.03, 0.15);
  s.rocks.burial = n.in(0.15, 0.5);
  s.rocks.albedo_spread = n.in(0.2, 0.6);
}

void draw_light_and_camera(Numbers& n, sim::Scene& s) {
  for (sim::Sun* sun : {&s.sun, &s.ortho_sun}) {
    sun->elevation_deg = n.in(25.0, 65.0);
    sun->azimuth_deg = n.in(0.0, 360.0);
  }
  s.camera.noise_dn = n.in(1.0, 4.0);
  s.camera.exposure_step_probability = n.in(0.0, 0.05);
  s.camera.dust_spots = n.whole(0, 10);
}

/// Three legs with turns to either side, their middle at the origin.
std::vector<Vec2> draw_waypoints(Numbers& n, double heading_deg) {
  std::vector<Vec2> points{Vec2(0.0, 0.0)};
  Vec2 low = points[0];
  Vec2 high = points[0];
  for (int leg = 0; leg < 3; ++leg) {
    const SinCos to = sin_cos(heading_deg * kRadPerDeg);
    points.push_back(points.back() + n.in(0.75, 1.25) * kLength_m / 3.0 * Vec2(to.cos, to.sin));
    low = low.cwiseMin(points.back());
    high = high.cwiseMax(points.back());
    heading_deg += n.either_sign(20.0, 90.0);
  }
  for (Vec2& p : points) p -= 0.5 * (low + high);
  return points;
}

void draw_traverse(Numbers& n, sim::Traverse& t) {
  t.length_m = kLength_m;
  const double heading_deg = n.in(-180.0, 180.0);
  t.slip = n.in(0.0, 0.1);
  t.slip_sideways = n.in(0.0, 0.05);
  switch (t.kind) {
    case TraverseKind::kS:
    case TraverseKind::kStopAndGo: t.radius_m = n.either_sign(4.0, 10.0); break;
    case TraverseKind::kArc: t.radius_m = n.either_sign(8.0, 25.0); break;
    case TraverseKind::kZigzag:
      t.leg_m = n.in(4.0, 7.0);
      t.zigzag_deg = n.in(20.0, 45.0);
      break;
    case TraverseKind::kPointTurn: t.turn_deg = n.either_sign(45.0, 180.0); break;
    case TraverseKind::kWaypoints: t.waypoints_map_m = draw_waypoints(n, heading_deg); return;
    case TraverseKind::kStraight: break;
  }
  if (t.kind == TraverseKind::kStopAndGo) {
    t.stop_every_m = n.in(4.0, 8.0);
    t.stop_frames = n.whole(5, 10);
  }
  t.start_heading_deg = heading_deg;
}

/// The site around the origin; a centred way is centred there, whatever the size.
void fit_site(sim::Scene& s) {
  const auto place = [&s](double half_x_m, double half_y_m) {
    s.site.origin_x_m = -half_x_m;
    s.site.origin_y_m = -half_y_m;
    s.site.width_m = 2.0 * half_x_m;
    s.site.height_m = 2.0 * half_y_m;
  };
  place(14.0, 14.0);
  double far_x_m = 0.0;
  double far_y_m = 0.0;
  for (const sim::PathPoint& p : sim::plan(s)) {
    far_x_m = std::max(far_x_m, std::fabs(p.x_m));
    far_y_m = std::max(far_y_m, std::fabs(p.y_m));
  }
  const auto half = [&s](double far_m) { return std::ceil(10.0 * (far_m + s.traverse.margin_m)) / 10.0; };
  place(half(far_x_m), half(far_y_m));
}

}  // namespace

Setup draw_setup(std::uint64_t seed, Abundance abundance) {
  const std::string rig = cfg::kMission.name;
  if (rig != "paper" && rig != "mast") {
    throw ToolError("campaign: the simulator has no rig for mission '{}'; build with MISSION=paper or mast",
                    rig);
  }
  Setup setup;
  setup.seed = seed;
  setup.scene = sim::load_scene({}, {"rig.name=" + rig});
  setup.scene.seed = seed;
  Numbers n(seed);
  draw_ground(n, abundance, setup.scene);
  draw_light_and_camera(n, setup.scene);
  setup.worse_scale = n.in(0.97, 1.03);
  setup.worse_yaw_deg_per_m = n.in(-0.1, 0.1);
  setup.map_pixel_m = kMapPixels_m[seed % kMapPixels_m.size()];
  setup.scene.traverse.kind = kKinds[seed % std::size(kKinds)];
  draw_traverse(n, setup.scene.traverse);
  fit_site(setup.scene);
  return setup;
}

}  // namespace cairn::ground
