// The simulator's geometry against closed forms: plane and sphere, disparity, orthoimage and ground views;
// and the law of the rocks' sizes.
#include "sim/world.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "support/cmocka.hpp"
#include "support/sanitized.hpp"

using namespace cairn;
using namespace cairn::ground;
using namespace cairn::ground::sim;

namespace {

/// A small level site without rocks, fully textured, and a straight way across.
Scene level_scene() {
  Scene scene;
  scene.site.origin_x_m = 100.0;  // far from 0, as a map's coordinates are
  scene.site.origin_y_m = -50.0;
  scene.site.width_m = 8.0;
  scene.site.height_m = 8.0;
  scene.site.relief_rms_m = 0.0;
  scene.site.ripple_height_m = 0.0;
  scene.rocks.max_diameter_m = scene.rocks.min_diameter_m;
  scene.rocks.pebbles = 0.0;
  scene.traverse.kind = TraverseKind::kStraight;
  scene.traverse.length_m = 1.0;
  scene.traverse.margin_m = 1.0;
  return scene;
}

/// Built once: the ground's texture takes seconds.
const World& level_world() {
  static const World world(level_scene());
  return world;
}

/// Where the ray of pixel (u, v) meets the plane z = 0 of the map frame: its z in the camera.
double plane_depth(const View& view, double u, double v) {
  const Vec3 ray = view.T_map_cam.q * Vec3((u - view.cx_px) / view.fx_px, (v - view.cy_px) / view.fy_px, 1.0);
  return -view.T_map_cam.t.z() / ray.z();
}

float at(const FloatImage& image, int u, int v) {
  return image.pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) +
                      static_cast<std::size_t>(u)];
}

/// Cubic interpolation along a row (Catmull and Rom), and its derivative.
double along_row(const FloatImage& image, double u, int v, double* slope) {
  const int i = static_cast<int>(std::floor(u));
  const double t = u - i;
  const double a = static_cast<double>(at(image, i - 1, v));
  const double b = static_cast<double>(at(image, i, v));
  const double c = static_cast<double>(at(image, i + 1, v));
  const double d = static_cast<double>(at(image, i + 2, v));
  const double k3 = 0.5 * (-a + 3.0 * b - 3.0 * c + d);
  const double k2 = 0.5 * (2.0 * a - 5.0 * b + 4.0 * c - d);
  const double k1 = 0.5 * (c - a);
  *slope = (3.0 * k3 * t + 2.0 * k2) * t + k1;
  return ((k3 * t + k2) * t + k1) * t + b;
}

// ---- plane ------------------------------------------------------------------------------------------------

void test_plane_lies_where_projection_says(void**) {
  const World& world = level_world();
  const View view = left_view(world.scene().rig, world.T_map_rover(3));
  FloatImage radiance;
  FloatImage depth;
  world.render(view, world.scene().sun, radiance, &depth);
  for (int v = 0; v < view.height_px; v += 37) {
    for (int u = 0; u < view.width_px; u += 41) {
      const double expected = plane_depth(view, u, v);
      assert_near(static_cast<double>(at(depth, u, v)) / expected, 1.0, 2.0e-5);
      assert_true(at(radiance, u, v) > 0.0F);
    }
  }
}

/// The shift that is left between left patch and right image warped by the plane's disparity.
void test_disparity_on_a_plane(void**) {
  const World& world = level_world();
  const Rig& rig = world.scene().rig;
  FloatImage left;
  FloatImage right;
  const View view = left_view(rig, world.T_map_rover(3));
  world.render(view, world.scene().sun, left);
  world.render(right_view(rig, world.T_map_rover(3)), world.scene().sun, right);
  constexpr int kHalf = 24;
  double sum = 0.0;
  int patches = 0;
  for (int v = kHalf; v < view.height_px - kHalf; v += 2 * kHalf) {
    for (int u = 110; u < view.width_px - kHalf; u += 2 * kHalf) {
      double numerator = 0.0;
      double denominator = 0.0;
      for (int dv = -kHalf; dv <= kHalf; ++dv) {
        for (int du = -kHalf; du <= kHalf; ++du) {
          const double d = rig.fx_px * rig.baseline_m / plane_depth(view, u + du, v + dv);
          double slope = 0.0;
          const double other = along_row(right, u + du - d, v + dv, &slope);
          numerator += slope * (static_cast<double>(at(left, u + du, v + dv)) - other);
          denominator += slope * slope;
        }
      }
      const double shift = numerator / denominator;
      assert_near(shift, 0.0, 0.02);
      sum += shift;
      ++patches;
    }
  }
  assert_true(patches > 40);
  assert_near(sum / patches, 0.0, 0.003);
}

// ---- spheres ----------------------------------------------------------------------------------------------

/// Half balls of bright stone on dark soil, the sun straight above.
struct Balls {
  Scene scene = level_scene();
  std::vector<Rock> rocks;

  Balls() {
    scene.site.albedo = 0.05;
    scene.sun.elevation_deg = scene.ortho_sun.elevation_deg = 90.0;
    const Pose3 T_map_rover = level_world().T_map_rover(3);
    for (const auto& [x, y, d] :
         {std::array{1.9, 0.1, 0.30}, std::array{1.3, -0.42, 0.2}, std::array{1.25, 0.35, 0.12}}) {
      Rock rock;
      const Vec3 p = T_map_rover * Vec3(x, y, 0.0);
      rock.p_map_m = Vec2(p.x(), p.y());
      rock.diameter_m = d;
      rock.height_m = 0.5 * d;
      rock.albedo = 0.6F;
      rocks.push_back(rock);
    }
  }
};

void test_sphere_lies_where_projection_says(void**) {
  const Balls balls;
  const World world(balls.scene, {make_ball(6)}, balls.rocks);
  const View view = left_view(world.scene().rig, world.T_map_rover(3));
  FloatImage radiance;
  FloatImage depth;
  world.render(view, world.scene().sun, radiance, &depth);
  int on_balls = 0;
  for (int v = 0; v < view.height_px; ++v) {
    for (int u = 0; u < view.width_px; ++u) {
      const Vec3 ray =
          view.T_map_cam.q * Vec3((u - view.cx_px) / view.fx_px, (v - view.cy_px) / view.fy_px, 1.0);
      double expected = plane_depth(view, u, v);
      bool rim = false;
      for (const Rock& rock : balls.rocks) {
        const Vec3 centre(rock.p_map_m.x(), rock.p_map_m.y(), 0.0);
        const Vec3 to = view.T_map_cam.t - centre;
        const double r = 0.5 * rock.diameter_m;
        const double b = ray.dot(to) / ray.squaredNorm();
        const double miss = (to - b * ray).norm();  // from the centre to the ray
        rim = rim || std::fabs(miss - r) < 0.004;
        if (miss >= r) continue;
        const double z = -b - std::sqrt(r * r - miss * miss) / ray.norm();
        if (z < expected) {
          expected = z;
          ++on_balls;
        }
      }
      if (!rim) assert_near(static_cast<double>(at(depth, u, v)), expected, 5.0e-4);
    }
  }
  assert_true(on_balls > 2000);
}

/// Centre and radius of the ball whose surface the points lie on: linear least squares.
Vec3 centre_of(const std::vector<Vec3>& points) {
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
  Eigen::Vector4d b = Eigen::Vector4d::Zero();
  const Vec3 origin = points.front();
  for (const Vec3& p : points) {
    const Vec3 q = p - origin;
    const Eigen::Vector4d row(2.0 * q.x(), 2.0 * q.y(), 2.0 * q.z(), 1.0);
    A += row * row.transpose();
    b += q.squaredNorm() * row;
  }
  const Eigen::Vector4d x = A.inverse() * b;
  return origin + x.head<3>();
}

void test_orthoimage_and_ground_agree(void**) {
  const Balls balls;
  const World world(balls.scene, {make_ball(6)}, balls.rocks);
  const View view = left_view(world.scene().rig, world.T_map_rover(3));
  FloatImage radiance;
  FloatImage depth;
  world.render(view, world.scene().sun, radiance, &depth);
  for (const Rock& rock : balls.rocks) {
    std::vector<Vec3> seen;
    for (int v = 0; v < view.height_px; ++v) {
      for (int u = 0; u < view.width_px; ++u) {
        const double z = static_cast<double>(at(depth, u, v));
        const Vec3 p =
            view.T_map_cam * Vec3((u - view.cx_px) / view.fx_px * z, (v - view.cy_px) / view.fy_px * z, z);
        const Vec2 off = Vec2(p.x(), p.y()) - rock.p_map_m;
        if (off.norm() < 0.6 * rock.diameter_m && p.z() > 0.01) seen.push_back(p);
      }
    }
    assert_true(seen.size() > 200);
    const Vec3 ground = centre_of(seen);

    constexpr double kPixel_m = 0.005;
    const double side_m = 1.4 * rock.diameter_m;
    const int side = static_cast<int>(side_m / kPixel_m);
    OrthoPart part{side, side, rock.p_map_m.x() - 0.513 * side_m, rock.p_map_m.y() + 0.487 * side_m,
                   kPixel_m};
    FloatImage ortho;
    world.render(part, world.scene().ortho_sun, ortho);
    Vec2 centroid(0.0, 0.0);
    double count = 0.0;
    for (int v = 0; v < side; ++v) {
      for (int u = 0; u < side; ++u) {
        if (at(ortho, u, v) < 0.09F) continue;  // soil is at 0.045, the rim of a ball in its own shade
        centroid += Vec2(part.x_m + (u + 0.5) * kPixel_m, part.y_m - (v + 0.5) * kPixel_m);
        count += 1.0;
      }
    }
    assert_true(count > 100.0);
    centroid /= count;
    assert_near((centroid - rock.p_map_m).norm(), 0.0, 0.0025);
    assert_near((centroid - Vec2(ground.x(), ground.y())).norm(), 0.0, 0.005);
  }
}

// ---- light ------------------------------------------------------------------------------------------------

/// A shadow falls away from the sun, as long as its height over tan(elevation).
void test_shadow_falls_away_from_the_sun(void**) {
  Balls balls;
  balls.scene.ortho_sun = {30.0, 90.0};  // from the east
  const World world(balls.scene, {make_ball(6)}, balls.rocks);
  const Rock& rock = balls.rocks[0];
  const double r = 0.5 * rock.diameter_m;
  const auto level = [&](double dx_m) {
    FloatImage pixel;
    world.render(OrthoPart{1, 1, rock.p_map_m.x() + dx_m, rock.p_map_m.y(), 0.004}, balls.scene.ortho_sun,
                 pixel);
    return pixel.pixels[0];
  };
  // The shadow of a half ball ends r / sin(elevation) from its centre.
  const double end = r / std::sin(30.0 * kRadPerDeg);
  const float open = level(1.6 * end);
  assert_true(level(-0.97 * end) < 0.6F * open);
  assert_true(level(-1.06 * end) > 0.6F * open);
  assert_true(level(1.06 * r) > 0.6F * open);
}

/// Level ground from above: Lambert's cosine, and Lommel and Seeliger's in / (in + out). Its grain is shaded,
/// hence some per cent.
void test_ground_scatters_as_told(void**) {
  Scene scene = level_scene();
  scene.light.sky = 0.0;
  const auto mean = [&](double elevation_deg, double backscatter) {
    scene.light.backscatter = backscatter;
    const World world(scene);
    FloatImage image;
    world.render(OrthoPart{50, 50, 103.0, -45.0, 0.04}, {elevation_deg, 90.0}, image);
    double sum = 0.0;
    for (const float pixel : image.pixels) sum += static_cast<double>(pixel) / 1.0e4;
    return sum;
  };
  for (const double elevation_deg : {20.0, 50.0}) {
    if (test::kSanitized) break;
    const double in = std::sin(elevation_deg * kRadPerDeg);
    assert_near(mean(elevation_deg, 1.0) / mean(elevation_deg, 0.0), 1.0 / (1.0 + in), 0.035);
  }
  assert_near(mean(20.0, 0.0) / mean(50.0, 0.0), 0.4465, 0.02);  // sin 20 / sin 50
}

// ---- rocks ------------------------------------------------------------------------------------------------

/// Sizes against Golombek and Rapp: Kolmogorov and Smirnov's test at 1 %, the number against Poisson's, and
/// the ground covered against F(D) = k exp(-q D) - F(max).
void test_sizes_follow_the_law(void**) {
  for (const double k : {0.02, 0.07, 0.3}) {
    if (test::kSanitized && k > 0.02) break;
    Scene scene;
    scene.seed = 77;
    scene.site.width_m = scene.site.height_m = 60.0;
    scene.site.relief_rms_m = 0.0;
    scene.site.ripple_height_m = 0.0;
    scene.rocks.k = k;
    scene.rocks.pebbles = 0.0;
    scene.rocks.clear_path = false;
    scene.traverse.kind = TraverseKind::kStraight;
    scene.traverse.length_m = 1.0;
    const Terrain terrain(scene);
    const std::vector<RockShape> shapes = make_shapes(scene);
    const std::vector<Rock> rocks = place_rocks(scene, terrain, shapes, plan(scene));
    const double low = scene.rocks.min_diameter_m;
    const double high = scene.rocks.max_diameter_m;
    const double q = 1.79 + 0.152 / k;
    // The law by brute force: midpoint rule in D.
    const auto count_above = [&](double d) {
      double sum = 0.0;
      constexpr int kSteps = 20000;
      const double h = (high - d) / kSteps;
      for (int i = 0; i < kSteps; ++i) {
        const double x = d + (i + 0.5) * h;
        sum += h * k * q * std::exp(-q * x) / (0.25 * 3.14159265358979 * x * x);
      }
      return sum * 3600.0;
    };
    const double expected = count_above(low);
    const auto n = static_cast<double>(rocks.size());
    assert_near(n, expected, 4.0 * std::sqrt(expected));
    double worst = 0.0;
    for (std::size_t i = 0; i < rocks.size(); i += rocks.size() / 60) {
      const double share = count_above(rocks[i].diameter_m) / expected;  // larger ones, as sorted
      worst = std::max(worst, std::fabs(share - (static_cast<double>(i) + 0.5) / n));
    }
    assert_at_most(worst * std::sqrt(n), 1.63);
    for (const double d : {0.05, 0.1, 0.3}) {
      double covered = 0.0;
      double squares = 0.0;
      for (const Rock& rock : rocks) {
        const double area = 0.25 * 3.14159265358979 * rock.diameter_m * rock.diameter_m;
        if (rock.diameter_m >= d) {
          covered += area;
          squares += area * area;
        }
      }
      const double law = 3600.0 * k * (std::exp(-q * d) - std::exp(-q * high));
      assert_near(covered, law, 4.0 * std::sqrt(squares));
    }
  }
}

/// The outline of a shape has the area of the disc of its diameter, and its centroid over the origin.
void test_shapes_are_of_diameter_one(void**) {
  Scene scene;
  for (const RockShape& shape : make_shapes(scene)) {
    constexpr int kCells = 200;
    std::vector<std::uint8_t> covered(kCells * kCells, 0);
    const auto cell = [](float x) { return static_cast<int>(std::floor((x + 1.0F) * 0.5F * kCells)); };
    for (const auto& t : shape.triangles) {
      const Vec3f& a = shape.points[t[0]];
      const Vec3f& b = shape.points[t[1]];
      const Vec3f& c = shape.points[t[2]];
      if (std::min({a.z(), b.z(), c.z()}) < 0.0F) continue;
      for (int j = cell(std::min({a.y(), b.y(), c.y()})); j <= cell(std::max({a.y(), b.y(), c.y()})); ++j) {
        for (int i = cell(std::min({a.x(), b.x(), c.x()})); i <= cell(std::max({a.x(), b.x(), c.x()})); ++i) {
          const float x = (static_cast<float>(i) + 0.5F) * 2.0F / kCells - 1.0F;
          const float y = (static_cast<float>(j) + 0.5F) * 2.0F / kCells - 1.0F;
          const auto side = [&](const Vec3f& p, const Vec3f& o) {
            return (o.x() - p.x()) * (y - p.y()) - (o.y() - p.y()) * (x - p.x());
          };
          const bool left = side(a, b) >= 0.0F && side(b, c) >= 0.0F && side(c, a) >= 0.0F;
          const bool right = side(a, b) <= 0.0F && side(b, c) <= 0.0F && side(c, a) <= 0.0F;
          if (left || right) covered[static_cast<std::size_t>(j * kCells + i)] = 1;
        }
      }
    }
    double area = 0.0;
    double x = 0.0;
    double y = 0.0;
    for (int j = 0; j < kCells; ++j) {
      for (int i = 0; i < kCells; ++i) {
        if (covered[static_cast<std::size_t>(j * kCells + i)] == 0) continue;
        area += 4.0 / (kCells * kCells);
        x += (i + 0.5) * 2.0 / kCells - 1.0;
        y += (j + 0.5) * 2.0 / kCells - 1.0;
      }
    }
    const double count = area * kCells * kCells / 4.0;
    assert_near(area, 0.785, 0.06);  // hollows of the outline count into its hull
    assert_near(x / count, 0.0, 0.03);
    assert_near(y / count, 0.0, 0.03);
    assert_true(shape.top > 0.15 && shape.top < 1.0);
  }
}

void test_the_path_is_clear(void**) {
  Scene scene;
  scene.site.width_m = scene.site.height_m = 30.0;
  scene.rocks.k = 0.3;
  scene.rocks.pebbles = 0.0;
  scene.traverse.length_m = 20.0;
  const World world(scene);
  for (const Rock& rock : world.rocks()) {
    if (rock.height_m <= scene.rocks.clear_height_m) continue;
    for (const PathPoint& p : world.path())
      assert_true((Vec2(p.x_m, p.y_m) - rock.p_map_m).norm() >=
                  scene.rocks.clear_distance_m + 0.5 * rock.diameter_m);
  }
  scene.rocks.clear_path = false;
  assert_true(World(scene).rocks().size() > world.rocks().size());
}

// ---- the same from the same seed --------------------------------------------------------------------------

void test_same_seed_same_world(void**) {
  Scene scene;
  scene.site.width_m = scene.site.height_m = 12.0;
  scene.traverse.kind = TraverseKind::kStraight;
  scene.traverse.length_m = 1.0;
  const auto look = [](const Scene& of, int threads) {
    const World world(of);
    std::vector<FloatImage> images(2);
    const auto one = [&](std::size_t i) {
      world.render(left_view(of.rig, world.T_map_rover(3 * i)), of.sun, images[i]);
    };
    if (threads > 1) {
      parallel_for(images.size(), one);
    } else {
      for (std::size_t i = images.size(); i-- > 0;) one(i);
    }
    return images;
  };
  const std::vector<FloatImage> once = look(scene, 2);
  const std::vector<FloatImage> again = look(scene, 1);
  for (std::size_t i = 0; i < once.size(); ++i) assert_true(once[i].pixels == again[i].pixels);
  scene.seed = 2;
  assert_true(look(scene, 1)[0].pixels != once[0].pixels);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_plane_lies_where_projection_says),
      cmocka_unit_test(test_disparity_on_a_plane),
      cmocka_unit_test(test_sphere_lies_where_projection_says),
      cmocka_unit_test(test_orthoimage_and_ground_agree),
      cmocka_unit_test(test_shadow_falls_away_from_the_sun),
      cmocka_unit_test(test_ground_scatters_as_told),
      cmocka_unit_test(test_sizes_follow_the_law),
      cmocka_unit_test(test_shapes_are_of_diameter_one),
      cmocka_unit_test(test_the_path_is_clear),
      cmocka_unit_test(test_same_seed_same_world),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
