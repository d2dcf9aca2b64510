// The shadow-aware detector on drawn ground: half ellipsoids with the shadows that they cast, traced pixel by
// pixel, so that place, size and height are known.
#include "detect/shadow_detector.hpp"

#include <algorithm>
#include <cmath>

#include "base/tool_error.hpp"
#include "core/random.hpp"
#include "core/trig.hpp"
#include "detect/shadow_fit.hpp"
#include "ground_tools/detect/drawn_gullies.hpp"
#include "ground_tools/raster_in_memory.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;
using test::Raster;

namespace {

Raster raster;
std::vector<TableBoulder> found;
std::vector<ShadowBoulder> whole, pieces;
std::vector<ShadowCrater> craters, crater_pieces;

struct Rock {
  Vec2 p_map_m;
  double along_m, height_m, diameter_m;
  int shade;  ///< of its lit side, grey levels above the ground
};
std::vector<Rock> rocks;

constexpr int kGround = 150;
constexpr int kShadow = 60;

/// Square, `side_px` wide, with noise of about `sigma` grey levels.
void draw_ground(double pixel_m, int side_px, int sigma) {
  Random random(5);
  raster = Raster();
  raster.width = raster.height = side_px;
  const double geo[6] = {200.0, pixel_m, 0.0, 90.0, 0.0, -pixel_m};
  std::copy(geo, geo + 6, raster.geo.c);
  raster.grey.resize(static_cast<std::size_t>(side_px) * side_px);
  for (std::uint8_t& g : raster.grey) {
    int noise = 0;
    for (int i = 0; i < 3; ++i)
      noise += static_cast<int>(random.below(2 * static_cast<unsigned>(sigma) + 1)) - sigma;
    g = static_cast<std::uint8_t>(kGround + noise);
  }
}

/// What the ray from above meets at (x, y) metres from the rock's centre: 0 ground in the light, 1 the lit
/// rock, 2 shadow. By marching towards the sun, not by the detector's formula.
int seen(const Rock& rock, const Sun& sun, double x, double y) {
  const double cot = 1.0 / std::tan(sun.elevation_rad);
  const double east = std::sin(sun.azimuth_rad);
  const double north = std::cos(sun.azimuth_rad);
  const double radius = 0.5 * rock.diameter_m;
  const double flat = 1.0 - (x * x + y * y) / (radius * radius);
  const double z = flat > 0.0 ? rock.height_m * std::sqrt(flat) : 0.0;
  const double step = 0.04 * radius;
  for (double s = step; s < rock.height_m * cot + 2.0 * radius; s += step) {
    const double px = x + s * east;
    const double py = y + s * north;
    const double pz = z + s / cot;
    const double inside = (px * px + py * py) / (radius * radius) + pz * pz / (rock.height_m * rock.height_m);
    if (inside < 0.999) return 2;
  }
  return flat > 0.0 ? 1 : 0;
}

void draw_rock(const Rock& rock, const Sun& sun) {
  const double pixel_m = raster.geo.pixel_m();
  const double reach_m = 0.6 * rock.diameter_m + rock.height_m / std::tan(sun.elevation_rad);
  for (int y = 0; y < raster.height; ++y) {
    for (int x = 0; x < raster.width; ++x) {
      const Vec2 d = raster.geo.to_map(x, y) - rock.p_map_m;
      if (d.norm() > reach_m) continue;
      int sum = 0;
      int noise = 0;
      std::uint8_t& pixel = raster.grey[static_cast<std::size_t>(y) * raster.width + x];
      noise = pixel - kGround;
      for (int i = 0; i < 9; ++i) {
        const int what =
            seen(rock, sun, d.x() + (i % 3 - 1) * pixel_m / 3, d.y() + (i / 3 - 1) * pixel_m / 3);
        sum += what == 0 ? kGround : what == 1 ? kGround + rock.shade : kShadow;
      }
      pixel = static_cast<std::uint8_t>(std::clamp(sum / 9 + noise, 0, 255));
    }
  }
}

void draw_field(double pixel_m, const Sun& sun, int sigma) {
  draw_ground(pixel_m, 420, sigma);
  rocks.clear();
  const double d_px[] = {9.0, 12.0, 20.0, 34.0, 60.0};
  const double tall[] = {0.35, 0.5, 0.65, 0.45, 0.5};
  const int shade[] = {30, -30, 15, 40, -20};
  const double u[] = {60.0, 150.3, 80.7, 320.2, 210.5};
  const double v[] = {70.0, 60.4, 180.6, 110.1, 300.9};
  for (int i = 0; i < 5; ++i) {
    Rock rock{};
    rock.p_map_m = raster.geo.to_map(u[i], v[i]);
    rock.diameter_m = d_px[i] * pixel_m;
    rock.height_m = tall[i] * rock.diameter_m;
    rock.shade = shade[i];
    rocks.push_back(rock);
    draw_rock(rock, sun);
  }
}

ShadowParams any_size() {
  ShadowParams params;
  params.min_diameter_m = 0.0;
  params.max_diameter_m = 1000.0;
  return params;
}

void test_place_size_and_height(void**) {
  for (const char* text : {"45,135", "55,250", "30,20", "38,300"}) {
    const Sun sun = parse_sun(text);
    for (const double pixel_m : {0.01, 0.25}) {
      draw_field(pixel_m, sun, 2);
      found = detect_boulders_by_shadow(raster, sun, any_size());
      for (const Rock& rock : rocks) {
        const auto near = std::find_if(found.begin(), found.end(), [&](const TableBoulder& b) {
          return (b.p_map_m - rock.p_map_m).norm() < 0.35 * rock.diameter_m;
        });
        if (near == found.end())
          print_message("sun %s, pixel %g: no rock of %g m\n", text, pixel_m, rock.diameter_m);
        assert_true(near != found.end());
        assert_near((near->p_map_m - rock.p_map_m).norm(), 0.0, pixel_m + 0.20 * rock.diameter_m);
        assert_near(near->diameter_m, rock.diameter_m, 1.5 * pixel_m + 0.20 * rock.diameter_m);
        assert_near(near->height_m, rock.height_m, pixel_m + 0.25 * rock.height_m);
        assert_in_range(1000 * near->confidence, 400, 1000);
      }
      assert_in_range(found.size(), 5, 7);
    }
  }
}

bool same(const ShadowBoulder& a, const ShadowBoulder& b) {
  return a.u_px == b.u_px && a.v_px == b.v_px && a.diameter_px == b.diameter_px &&
         a.elongation == b.elongation && a.contrast == b.contrast && a.height_px == b.height_px &&
         a.confidence == b.confidence;
}

/// A bowl: Lambert's shading of a paraboloid, and its rim's shadow, which ends at the far arc moved sunwards.
void draw_bowl(double u, double v, double radius_px, double depth_over_width, const Sun& sun) {
  const double tan_e = std::tan(sun.elevation_rad);
  const Vec2 away = -sun_direction_px(sun, raster.geo);
  const double moved = radius_px * tan_e / (2.0 * depth_over_width);
  for (int y = 0; y < raster.height; ++y) {
    for (int x = 0; x < raster.width; ++x) {
      const Vec2 d(x - u, y - v);
      if (d.norm() >= radius_px) continue;
      const double a = d.dot(away);
      const double half_chord = std::sqrt(radius_px * radius_px - (d - a * away).squaredNorm());
      const double shading = 1.0 + 4.0 * depth_over_width * a / radius_px / tan_e;
      std::uint8_t& pixel = raster.grey[static_cast<std::size_t>(y) * raster.width + x];
      const double grey = a < half_chord - moved ? 0.2 * kGround : kGround * std::max(0.2, shading);
      pixel = static_cast<std::uint8_t>(std::clamp(grey + pixel - kGround, 0.0, 255.0));
    }
  }
}

/// In an order that tiles have no part in.
void put_in_order(std::vector<ShadowCrater>& some) {
  std::sort(some.begin(), some.end(), [](const ShadowCrater& a, const ShadowCrater& b) {
    return a.v_px != b.v_px ? a.v_px < b.v_px : a.u_px < b.u_px;
  });
}

bool same(const ShadowCrater& a, const ShadowCrater& b) {
  return a.u_px == b.u_px && a.v_px == b.v_px && a.diameter_px == b.diameter_px && a.contrast == b.contrast &&
         a.confidence == b.confidence;
}

/// Rocks of 5 to 44 px, anywhere in `side_px`.
void draw_scattered(Random& random, int count, std::uint32_t side_px, const Sun& sun) {
  for (int i = 0; i < count; ++i) {
    Rock rock{};
    rock.p_map_m = raster.geo.to_map(random.below(side_px), random.below(side_px));
    rock.diameter_m = 0.01 * (5.0 + random.below(100) * random.below(100) * 0.004);
    rock.height_m = rock.diameter_m * (0.3 + 0.004 * random.below(100));
    rock.shade = static_cast<int>(random.below(80)) - 40;
    draw_rock(rock, sun);
  }
}

// Cores of random sizes, each with no more pixels than shadow_reach_px asks for.
void test_tiles_do_not_matter(void**) {
  const Sun sun = parse_sun("40,200");
  draw_ground(0.01, 600, 3);
  for (int i = 0; i < 16; ++i) draw_bowl(75.0 + 150.0 * (i % 4), 75.0 + 150.0 * (i / 4), 5.0 + i, 0.15, sun);
  Random random(77);
  draw_scattered(random, 90, 600, sun);
  raster.valid.assign(raster.grey.size(), 255);
  for (int y = 300; y < 420; ++y)
    for (int x = 200; x < 330; ++x) raster.valid[static_cast<std::size_t>(y) * 600 + x] = 0;
  ShadowParams params = any_size();
  params.min_confidence = 0.05;
  params.max_diameter_px = 28.0;
  const ShadowView view = shadow_view(sun, raster.geo);
  const int reach = shadow_reach_px(view, params);
  assert_in_range(reach, 20, 400);
  const PixelRect all{0, 0, 600, 600};
  ShadowFinds finds = detect_by_shadow({all, raster.grey_view(), raster.valid_view()}, all, view, params);
  whole = finds.boulders;
  craters = finds.craters;
  put_in_order(craters);
  assert_true(craters.size() > 5);
  assert_true(whole.size() > 40);
  const auto by_place = [](const ShadowBoulder& a, const ShadowBoulder& b) {
    return a.v_px != b.v_px ? a.v_px < b.v_px : a.u_px < b.u_px;
  };
  std::sort(whole.begin(), whole.end(), by_place);
  for (int trial = 0; trial < 3; ++trial) {
    const int side = 97 + static_cast<int>(random.below(300));
    pieces.clear();
    crater_pieces.clear();
    for (int y0 = 0; y0 < 600; y0 += side) {
      for (int x0 = 0; x0 < 600; x0 += side) {
        const PixelRect core{x0, y0, std::min(side, 600 - x0), std::min(side, 600 - y0)};
        GreyTile tile;
        tile.rect.x0 = std::max(0, x0 - reach);
        tile.rect.y0 = std::max(0, y0 - reach);
        tile.rect.width = std::min(600, x0 + core.width + reach) - tile.rect.x0;
        tile.rect.height = std::min(600, y0 + core.height + reach) - tile.rect.y0;
        const std::size_t first = static_cast<std::size_t>(tile.rect.y0) * 600 + tile.rect.x0;
        tile.grey = {raster.grey.data() + first, tile.rect.width, tile.rect.height, 600};
        tile.valid = {raster.valid.data() + first, tile.rect.width, tile.rect.height, 600};
        finds = detect_by_shadow(tile, core, view, params);
        pieces.insert(pieces.end(), finds.boulders.begin(), finds.boulders.end());
        crater_pieces.insert(crater_pieces.end(), finds.craters.begin(), finds.craters.end());
      }
    }
    std::sort(pieces.begin(), pieces.end(), by_place);
    assert_int_equal(pieces.size(), whole.size());
    for (std::size_t i = 0; i < whole.size(); ++i) assert_true(same(whole[i], pieces[i]));
    put_in_order(crater_pieces);
    assert_int_equal(crater_pieces.size(), craters.size());
    for (std::size_t i = 0; i < craters.size(); ++i) assert_true(same(craters[i], crater_pieces[i]));
  }
}

/// A pixel without data counts where it is in the way, and nowhere else: an image that has one finds the same
/// boulders elsewhere, to the bit.
void test_a_hole_elsewhere_changes_nothing(void**) {
  const Sun sun = parse_sun("40,200");
  draw_ground(0.01, 700, 3);
  Random random(78);
  draw_scattered(random, 100, 700, sun);
  const ShadowView view = shadow_view(sun, raster.geo);
  ShadowParams params = any_size();
  params.max_diameter_px = 28.0;
  const int reach = shadow_reach_px(view, params);
  const PixelRect all{0, 0, raster.width, raster.height};
  raster.valid.clear();
  whole = detect_boulders_by_shadow({all, raster.grey_view(), raster.valid_view()}, all, view, params);
  raster.valid.assign(raster.grey.size(), 255);
  raster.valid[0] = 0;
  pieces = detect_boulders_by_shadow({all, raster.grey_view(), raster.valid_view()}, all, view, params);
  const auto near = [reach](const ShadowBoulder& b) { return b.u_px <= reach && b.v_px <= reach; };
  whole.erase(std::remove_if(whole.begin(), whole.end(), near), whole.end());
  pieces.erase(std::remove_if(pieces.begin(), pieces.end(), near), pieces.end());
  assert_true(whole.size() > 20);
  assert_int_equal(pieces.size(), whole.size());
  for (std::size_t i = 0; i < whole.size(); ++i) assert_true(same(whole[i], pieces[i]));
}

// What is no boulder: bare ground, a step of brightness, ripples across and along the sun, a dark disc.
void test_what_is_no_boulder(void**) {
  const Sun sun = parse_sun("45,90");
  draw_ground(0.01, 400, 4);
  assert_int_equal(detect_boulders_by_shadow(raster, sun, any_size()).size(), 0);
  for (int y = 0; y < 400; ++y)
    for (int x = 200; x < 400; ++x) raster.grey[static_cast<std::size_t>(y) * 400 + x] -= 60;
  assert_int_equal(detect_boulders_by_shadow(raster, sun, any_size()).size(), 0);
  for (const bool across : {true, false}) {
    draw_ground(0.01, 400, 3);
    for (int y = 0; y < 400; ++y)
      for (int x = 0; x < 400; ++x)
        raster.grey[static_cast<std::size_t>(y) * 400 + x] +=
            static_cast<int>(25.0 * std::sin((across ? x : y) * 0.3));
    assert_true(detect_boulders_by_shadow(raster, sun, any_size()).size() <= 2);
  }
}

// Fresh and worn hollows, none of which is a boulder, among boulders that are all found.
void test_hollows_among_boulders(void**) {
  for (const char* text : {"20,290", "35,120", "45,10"}) {
    const Sun sun = parse_sun(text);
    for (const bool boulders : {false, true}) {
      draw_ground(0.3, 420, 2);
      for (int i = 0; i < 25; ++i)
        draw_bowl(45.0 + 82.0 * (i % 5), 45.0 + 82.0 * (i / 5), 4.0 + 1.3 * (i % 7), 0.08 + 0.03 * (i % 5),
                  sun);
      rocks.clear();
      for (int i = 0; boulders && i < 16; ++i) {
        Rock rock{};
        rock.p_map_m = raster.geo.to_map(86.3 + 82.0 * (i % 4), 86.1 + 82.0 * (i / 4));
        rock.diameter_m = 0.3 * (5.0 + i % 6);
        rock.height_m = 0.5 * rock.diameter_m;
        rock.shade = 60;
        rocks.push_back(rock);
        draw_rock(rock, sun);
      }
      found = detect_boulders_by_shadow(raster, sun, any_size());
      for (const Rock& rock : rocks) {
        assert_true(std::any_of(found.begin(), found.end(), [&](const TableBoulder& b) {
          return (b.p_map_m - rock.p_map_m).norm() < 0.35 * rock.diameter_m;
        }));
      }
      const PixelRect all{0, 0, 420, 420};
      craters = detect_by_shadow({all, raster.grey_view(), {}}, all, shadow_view(sun, raster.geo), any_size())
                    .craters;
      int right = 0;
      for (int i = 0; i < 25; ++i) {
        const double radius_px = 4.0 + 1.3 * (i % 7);
        right += std::any_of(craters.begin(), craters.end(), [&](const ShadowCrater& c) {
          return std::hypot(c.u_px - 45.0 - 82.0 * (i % 5), c.v_px - 45.0 - 82.0 * (i / 5)) <
                     0.3 * radius_px &&
                 std::fabs(0.5 * c.diameter_px - radius_px) < 0.3 * radius_px;
        });
      }
      print_message("sun %s: %zu entries, %zu boulders; %d of 25 craters, %zu in all\n", text, found.size(),
                    rocks.size(), right, craters.size());
      assert_true(found.size() <= rocks.size() + 1);
      assert_in_range(right, 22, 25);
      assert_in_range(craters.size(), 22, 30);
    }
  }
}

bool same(const HollowFit& a, const HollowFit& b) {
  return a.du_px == b.du_px && a.dv_px == b.dv_px && a.radius_px == b.radius_px && a.explained == b.explained;
}
bool same(const ShadowFit& a, const ShadowFit& b) {
  return a.found == b.found && a.du_px == b.du_px && a.dv_px == b.dv_px && a.reach_px == b.reach_px &&
         a.explained == b.explained && a.clutter == b.clutter && a.beside == b.beside &&
         a.spread == b.spread && a.absent == b.absent && a.picture == b.picture &&
         same(a.beyond_rim, b.beyond_rim) && same(a.far_wall, b.far_wall);
}

/// Whatever was fitted at the spot, or elsewhere, before; and what is wider than asked for is not found.
void test_a_fit_stands_alone(void**) {
  for (const char* text : {"45,135", "30,20", "14,250"}) {
    const Sun sun = parse_sun(text);
    draw_field(0.1, sun, 4);
    const ShadowView view = shadow_view(sun, raster.geo);
    const PixelRect all{0, 0, raster.width, raster.height};
    const GreyTile tile{all, raster.grey_view(), {}};
    const auto fitter = [&] { return ShadowFitter(-view.towards_sun_px, view.tan_elevation); };
    ShadowFitter used = fitter();
    int found_fits = 0;
    for (const Spot& spot : dark_spots(tile, all, ShadowParams{}.seed_contrast)) {
      const auto look = [&](ShadowFitter& at) { at.look_at(tile.grey, tile.valid, spot.x, spot.y); };
      const auto wide = [&](ShadowFitter& at, double most) { return at.fit(2.0, most, ShadowGround::kWide); };
      ShadowFitter fresh = fitter();
      look(fresh);
      const ShadowFit alone = wide(fresh, kFitMostAcross_px);
      look(used);
      used.fit(2.0, kFitMostAcross_px, ShadowGround::kNear);
      assert_true(same(wide(used, kFitMostAcross_px), alone));
      if (!alone.found) continue;
      ++found_fits;
      assert_true(same(wide(used, alone.across_px), alone));
      assert_false(wide(used, 0.999 * alone.across_px).found);
    }
    assert_true(found_fits >= 5);
  }
}

void test_odd_images(void**) {
  const Sun sun = parse_sun("45,90");
  for (const int side : {1, 2, 3, 7, 16, 33}) {
    draw_ground(0.01, side, 3);
    (void)detect_boulders_by_shadow(raster, sun, any_size());
    raster.valid.assign(raster.grey.size(), 0);
    assert_int_equal(detect_boulders_by_shadow(raster, sun, any_size()).size(), 0);
  }
  draw_field(0.01, sun, 2);
  for (const char* text : {"1,0", "90,0", "89.9,45"})
    (void)detect_boulders_by_shadow(raster, parse_sun(text), any_size());
}

void test_ranges(void**) {
  check(ShadowParams{});
  const auto refused = [](auto change) {
    ShadowParams params;
    change(params);
    try {
      check(params);
    } catch (const ToolError&) {
      return true;
    }
    return false;
  };
  assert_true(refused([](ShadowParams& p) { p.min_diameter_m = -0.1; }));
  assert_true(refused([](ShadowParams& p) { p.min_diameter_px = 2.0; }));
  assert_true(refused([](ShadowParams& p) { p.max_diameter_m = 0.0; }));
  assert_true(refused([](ShadowParams& p) { p.max_diameter_px = 5000.0; }));
  assert_true(refused([](ShadowParams& p) { p.seed_contrast = 0.0; }));
  assert_true(refused([](ShadowParams& p) { p.min_confidence = 1.5; }));
  assert_true(refused([](ShadowParams& p) { p.min_confidence = std::nan(""); }));
  assert_true(to_text(ShadowParams{}, parse_sun("45,135")).find("method=shadow sun=45,135 ") == 0);
}

/// Gullies, scarps and ridges, from seeds that nothing was fitted to: a boulder or two a hectare, and hardly
/// one of them for sure.
void test_gullies_are_no_boulders(void**) {
  constexpr int kFields = 16;
  int entries = 0;
  int sure = 0;
  int large = 0;
  for (std::uint64_t seed = 12000; seed < 12000 + kFields; ++seed) {
    const test::RenderedField field = test::DrawnGullies(seed).rendered();
    for (const TableBoulder& b : detect_boulders_by_shadow(field.images[0], field.suns[0], ShadowParams{})) {
      ++entries;
      sure += b.confidence >= 0.9 ? 1 : 0;
      large += b.confidence >= 0.9 && b.diameter_m > 3.0 ? 1 : 0;
    }
  }
  print_message("%d fields of a hectare: %d entries, %d of them at 0.9 and more, %d of these large\n",
                kFields, entries, sure, large);
  assert_at_most(entries, 2 * kFields);
  assert_at_most(sure, kFields / 4);
  assert_at_most(large, kFields / 8);
}

/// Mean in 1/16 levels of what is there within `radius` of a pixel; -1 where nothing is.
int plain_mean16(const GreyTile& tile, int u, int v, int radius) {
  int sum = 0;
  int count = 0;
  for (int y = std::max(0, v - radius); y <= std::min(tile.grey.height - 1, v + radius); ++y) {
    for (int x = std::max(0, u - radius); x <= std::min(tile.grey.width - 1, u + radius); ++x) {
      if (tile.valid.data != nullptr && tile.valid.row(y)[x] == 0) continue;
      sum += tile.grey.row(y)[x];
      ++count;
    }
  }
  return count > 0 ? 16 * sum / count : -1;
}
int plain_darkness(const GreyTile& tile, const PixelRect& where, int x, int y) {
  if (x < 0 || y < 0 || x >= where.width || y >= where.height) return 0;
  const int spot = plain_mean16(tile, where.x0 + x, where.y0 + y, 1);
  const int ground = plain_mean16(tile, where.x0 + x, where.y0 + y, 8);
  const bool dark = spot >= 0 && spot + ground * 26 / 256 < ground && spot + 48 < ground;  // 0.1 of 256
  return dark ? ground - spot : 0;
}
bool is_plain_spot(const GreyTile& tile, const PixelRect& where, int x, int y) {
  const int here = plain_darkness(tile, where, x, y);
  for (int v = -2; v <= 2; ++v) {
    for (int u = -2; u <= 2; ++u) {
      const int other = plain_darkness(tile, where, x + u, y + v);
      const bool earlier = v < 0 || (v == 0 && u < 0);
      if (other > here || (earlier && other == here)) return false;
    }
  }
  return here > 0;
}

/// Images narrower than a box and wider, with gaps and without, looked at wholly and in part.
void test_spots_are_those_of_plain_means(void**) {
  Random random(11);
  int spots = 0;
  for (const int side : {3, 16, 17, 18, 45}) {
    std::vector<std::uint8_t> grey(static_cast<std::size_t>(side * (side + 2)));
    std::vector<std::uint8_t> valid(grey.size(), 255);
    for (std::uint8_t& g : grey) g = static_cast<std::uint8_t>(random.below(256));
    for (int i = 0; i < side * side / 9; ++i)
      valid[random.below(static_cast<std::uint32_t>(grey.size()))] = 0;
    GreyTile tile;
    tile.rect = {0, 0, side, side + 2};
    tile.grey = packed_view<const std::uint8_t>(grey.data(), side, side + 2);
    for (const bool gaps : {false, true}) {
      if (gaps) tile.valid = packed_view<const std::uint8_t>(valid.data(), side, side + 2);
      for (const PixelRect& where : {tile.rect, PixelRect{1, 2, side - 2, side - 1}}) {
        std::vector<Spot> plain;
        for (int y = 0; y < where.height; ++y)
          for (int x = 0; x < where.width; ++x)
            if (is_plain_spot(tile, where, x, y)) plain.push_back({where.x0 + x, where.y0 + y});
        const std::vector<Spot> found_spots = dark_spots(tile, where, 0.1);
        const auto same = [](const Spot& a, const Spot& b) { return a.x == b.x && a.y == b.y; };
        assert_int_equal(plain.size(), found_spots.size());
        assert_true(std::equal(plain.begin(), plain.end(), found_spots.begin(), same));
        spots += static_cast<int>(plain.size());
      }
    }
  }
  assert_true(spots > 200);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_place_size_and_height),
                              cmocka_unit_test(test_tiles_do_not_matter),
                              cmocka_unit_test(test_a_hole_elsewhere_changes_nothing),
                              cmocka_unit_test(test_what_is_no_boulder),
                              cmocka_unit_test(test_hollows_among_boulders),
                              cmocka_unit_test(test_gullies_are_no_boulders),
                              cmocka_unit_test(test_a_fit_stands_alone),
                              cmocka_unit_test(test_odd_images),
                              cmocka_unit_test(test_spots_are_those_of_plain_means),
                              cmocka_unit_test(test_ranges)};
  return cmocka_run_group_tests_name("ground_tools/detect/shadow_detector", tests, nullptr, nullptr);
}
