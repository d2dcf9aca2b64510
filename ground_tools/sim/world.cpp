#include "sim/world.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/parallel.hpp"
#include "base/tool_error.hpp"
#include "sim/texture.hpp"

namespace cairn::ground::sim {
namespace {

// Light, in the unit in which Camera::white_radiance stands. Chosen so that soil of albedo 0.25 under a sun
// 45 degrees high comes to 0.16, and its shadows to a seventh of that.
constexpr float kSun = 0.80F;
constexpr float kSunDiscRad = 0.00305F;  ///< radius on Mars
constexpr float kRockTexture_m = 0.6F;   ///< rocks are grained finer than soil
constexpr float kRockContrast = 0.9F;
constexpr float kShadowOffset_m = 5.0e-4F;
constexpr unsigned kGroundId = 0;  ///< rock i is i + 1

constexpr int kSamples = 4;  ///< a pixel; two pixels are a packet of eight rays
constexpr float kPlaceU[kSamples] = {-0.125F, 0.375F, 0.125F, -0.375F};
constexpr float kPlaceV[kSamples] = {-0.375F, -0.125F, 0.375F, 0.125F};
/// Places on the sun's disc, in radii.
constexpr float kDiscA[kSamples] = {-0.6F, 0.25F, 0.6F, -0.25F};
constexpr float kDiscB[kSamples] = {-0.25F, -0.6F, 0.25F, 0.6F};

struct Light {
  Vec3f to_sun;
  Vec3f disc[kSamples];  ///< towards the places on it
  float ground_irradiance;
  float sky;
  float backscatter;
};

Light light_of(const Sun& sun, const Lighting& lighting) {
  Light light;
  const Vec3 s = sun_direction(sun);
  const Vec3 aside =
      (std::fabs(s.z()) < 0.99 ? s.cross(Vec3(0.0, 0.0, 1.0)) : Vec3(1.0, 0.0, 0.0)).normalized();
  const Vec3 up = aside.cross(s);
  light.to_sun = s.cast<float>();
  for (int i = 0; i < kSamples; ++i)
    light.disc[i] = (s + static_cast<double>(kSunDiscRad) *
                             (static_cast<double>(kDiscA[i]) * aside + static_cast<double>(kDiscB[i]) * up))
                        .normalized()
                        .cast<float>();
  light.sky = static_cast<float>(lighting.sky);
  light.backscatter = static_cast<float>(lighting.backscatter);
  light.ground_irradiance = kSun * std::max(0.0F, light.to_sun.z()) + light.sky;
  return light;
}

RTCScene shape_scene(RTCDevice device, const RockShape& shape) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), shape.points.size()));
  for (std::size_t i = 0; i < shape.points.size(); ++i)
    for (int k = 0; k < 3; ++k) points[3 * i + static_cast<std::size_t>(k)] = shape.points[i][k];
  auto* triangles = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), shape.triangles.size()));
  for (std::size_t i = 0; i < shape.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) triangles[3 * i + k] = shape.triangles[i][k];
  rtcCommitGeometry(geometry);
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  return scene;
}

RTCGeometry ground_geometry(RTCDevice device, const Terrain& terrain) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_GRID);
  auto* points =
      static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                  3 * sizeof(float), terrain.columns() * terrain.rows()));
  parallel_for(terrain.rows(), [&](std::size_t j) {
    for (std::size_t i = 0; i < terrain.columns(); ++i) {
      float* p = points + 3 * (j * terrain.columns() + i);
      p[0] = static_cast<float>(terrain.origin_x_m() + Terrain::kSpacing_m * static_cast<double>(i));
      p[1] = static_cast<float>(terrain.origin_y_m() + Terrain::kSpacing_m * static_cast<double>(j));
      p[2] = terrain.at(i, j);
    }
  });
  // Embree's grids have at most 32767 points a side: larger sites are several, which share their edges.
  constexpr std::size_t kSide = 1024;
  const std::size_t across = (terrain.columns() - 2) / kSide + 1;
  const std::size_t down = (terrain.rows() - 2) / kSide + 1;
  auto* grids = static_cast<RTCGrid*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, sizeof(RTCGrid), across * down));
  for (std::size_t k = 0; k < across * down; ++k) {
    const std::size_t i = k % across * kSide;
    const std::size_t j = k / across * kSide;
    grids[k].startVertexID = static_cast<unsigned>(j * terrain.columns() + i);
    grids[k].stride = static_cast<unsigned>(terrain.columns());
    grids[k].width = static_cast<std::uint16_t>(std::min(kSide + 1, terrain.columns() - i));
    grids[k].height = static_cast<std::uint16_t>(std::min(kSide + 1, terrain.rows() - j));
  }
  rtcCommitGeometry(geometry);
  return geometry;
}

/// Share of the sky that rocks and terrain leave open, over the terrain's grid: horizons in eight directions,
/// to a distance of 0.85 m.
std::vector<std::uint8_t> open_sky(const Terrain& terrain, const std::vector<Rock>& rocks) {
  const std::size_t columns = terrain.columns();
  const std::size_t rows = terrain.rows();
  std::vector<float> top(columns * rows);
  for (std::size_t j = 0; j < rows; ++j)
    for (std::size_t i = 0; i < columns; ++i) top[j * columns + i] = terrain.at(i, j);
  const double spacing = Terrain::kSpacing_m;
  const auto clamped = [](double i, std::size_t n) {
    return static_cast<std::size_t>(std::clamp(i, 0.0, static_cast<double>(n - 1)));
  };
  for (const Rock& rock : rocks) {
    if (rock.diameter_m < 0.04) break;  // the largest come first
    const double x = (rock.p_map_m.x() - terrain.origin_x_m()) / spacing;
    const double y = (rock.p_map_m.y() - terrain.origin_y_m()) / spacing;
    const double r = 0.5 * rock.diameter_m / spacing;
    for (std::size_t j = clamped(std::ceil(y - r), rows); j <= clamped(std::floor(y + r), rows); ++j) {
      for (std::size_t i = clamped(std::ceil(x - r), columns); i <= clamped(std::floor(x + r), columns);
           ++i) {
        const double u = (static_cast<double>(i) - x) / r;
        const double v = (static_cast<double>(j) - y) / r;
        if (u * u + v * v > 1.0) continue;
        const double z = rock.z_ground_map_m + rock.height_m * std::sqrt(1.0 - u * u - v * v);
        top[j * columns + i] = std::max(top[j * columns + i], static_cast<float>(z));
      }
    }
  }
  std::vector<std::uint8_t> open(columns * rows);
  constexpr int kSteps[] = {1, 2, 3, 5, 8, 13, 21, 34};
  parallel_for(rows, [&](std::size_t j) {
    for (std::size_t i = 0; i < columns; ++i) {
      const float z = terrain.at(i, j);
      float sum = 0.0F;
      for (int d = 0; d < 8; ++d) {
        const int dx = (d == 0 || d == 1 || d == 7) - (d == 3 || d == 4 || d == 5);
        const int dy = (d >= 1 && d <= 3) - (d >= 5);
        float steepest = 0.0F;
        for (const int step : kSteps) {
          const auto a = static_cast<std::ptrdiff_t>(i) + dx * step;
          const auto b = static_cast<std::ptrdiff_t>(j) + dy * step;
          if (a < 0 || b < 0 || a >= static_cast<std::ptrdiff_t>(columns) ||
              b >= static_cast<std::ptrdiff_t>(rows))
            break;
          const float rise = top[static_cast<std::size_t>(b) * columns + static_cast<std::size_t>(a)] - z;
          const float way =
              static_cast<float>(spacing) * static_cast<float>(step) * (dx != 0 && dy != 0 ? 1.4142F : 1.0F);
          steepest = std::max(steepest, rise / way);
        }
        sum += 1.0F / (1.0F + steepest * steepest);  // cos^2 of the horizon's elevation
      }
      open[j * columns + i] = static_cast<std::uint8_t>(std::lround(sum / 8.0F * 255.0F));
    }
  });
  return open;
}

Pose3 camera(const Rig& rig, const Pose3& T_map_rover, double along_baseline_m) {
  Pose3 T_map_cam = T_map_rover * stereo_rig(rig).T_rover_cam;
  T_map_cam.t += T_map_cam.q * Vec3(along_baseline_m, 0.0, 0.0);
  return T_map_cam;
}

View view_of(const Rig& rig, const Pose3& T_map_cam) {
  return {rig.width_px, rig.height_px, rig.fx_px, rig.fy_px, rig.cx_px, rig.cy_px, T_map_cam};
}

}  // namespace

View left_view(const Rig& rig, const Pose3& T_map_rover) {
  return view_of(rig, camera(rig, T_map_rover, 0.0));
}
View right_view(const Rig& rig, const Pose3& T_map_rover) {
  return view_of(rig, camera(rig, T_map_rover, rig.baseline_m));
}

struct World::Body {
  /// How an instance of a unit shape stands.
  struct Placement {
    float c, s, scale;
    Vec3f at;

    explicit Placement(const Rock& rock)
        : c(static_cast<float>(std::cos(rock.yaw_rad))),
          s(static_cast<float>(std::sin(rock.yaw_rad))),
          scale(static_cast<float>(rock.diameter_m)),
          at(static_cast<float>(rock.p_map_m.x()), static_cast<float>(rock.p_map_m.y()),
             static_cast<float>(rock.z_foot_map_m)) {}

    Vec3f to_local(const Vec3f& p) const {
      const Vec3f q = (p - at) / scale;
      return {c * q.x() + s * q.y(), -s * q.x() + c * q.y(), q.z()};
    }
    Vec3f turn(const Vec3f& n) const { return {c * n.x() - s * n.y(), s * n.x() + c * n.y(), n.z()}; }
  };

  using MakeRocks = std::function<std::vector<Rock>(const Terrain&, const std::vector<RockShape>&)>;
  Body(const Scene& scene, std::vector<RockShape> with_shapes, const MakeRocks& make_rocks)
      : terrain(scene),
        texture(scene.seed),
        shapes(std::move(with_shapes)),
        rocks(make_rocks(terrain, shapes)),
        open(open_sky(terrain, rocks)),
        texture_contrast(static_cast<float>(scene.site.texture_contrast)),
        ground_albedo(static_cast<float>(scene.site.albedo)) {
    for (const Rock& rock : rocks) {
      if (rock.shape >= shapes.size())
        throw ToolError("sim: a rock of shape {}, and there are {}", rock.shape, shapes.size());
    }
    device = rtcNewDevice(nullptr);
    if (device == nullptr) throw ToolError("sim: the ray tracer (Embree) does not start on this machine");
    top = rtcNewScene(device);
    rtcSetSceneFlags(top, RTC_SCENE_FLAG_ROBUST);  // no ray slips through between two triangles
    RTCGeometry ground = ground_geometry(device, terrain);
    rtcAttachGeometryByID(top, ground, kGroundId);
    rtcReleaseGeometry(ground);
    for (const RockShape& shape : shapes) shape_scenes.push_back(shape_scene(device, shape));
    placements.reserve(rocks.size());
    for (std::size_t i = 0; i < rocks.size(); ++i) {
      const Placement p(rocks[i]);
      placements.push_back(p);
      RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
      rtcSetGeometryInstancedScene(instance, shape_scenes[rocks[i].shape]);
      const float columns[12] = {
          p.scale * p.c, p.scale * p.s, 0,        -p.scale * p.s, p.scale * p.c, 0, 0, 0,
          p.scale,       p.at.x(),      p.at.y(), p.at.z()};
      rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
      rtcCommitGeometry(instance);
      rtcAttachGeometryByID(top, instance, static_cast<unsigned>(i + 1));
      rtcReleaseGeometry(instance);
    }
    rtcCommitScene(top);
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE)
      throw ToolError(
          "sim: the ray tracer (Embree) could not take the scene: not enough memory; make the site smaller");
  }
  ~Body() {
    if (device == nullptr) return;
    rtcReleaseScene(top);
    for (RTCScene scene : shape_scenes) rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Body(const Body&) = delete;
  Body& operator=(const Body&) = delete;

  void trace(RTCRayHit8& packet, const int* valid, const Light& light, const float* footprint,
             float* radiance) const;

  Terrain terrain;
  Texture texture;
  std::vector<RockShape> shapes;
  std::vector<Rock> rocks;
  std::vector<std::uint8_t> open;
  float texture_contrast;
  float ground_albedo;
  std::vector<Placement> placements;
  RTCDevice device = nullptr;
  RTCScene top = nullptr;
  std::vector<RTCScene> shape_scenes;

 private:
  struct Surface {
    Vec3f p;
    Vec3f n;       ///< with the texture's lumps
    Vec3f n_mesh;  ///< of the mesh
    float albedo;
    float open;
  };
  Surface ground_at(const Vec3f& p, float footprint) const;
  Surface rock_at(std::size_t index, unsigned triangle, float u, float v, const Vec3f& p,
                  float footprint) const;
  float open_at(const Vec3f& p) const;
};

float World::Body::open_at(const Vec3f& p) const {
  const float scale = static_cast<float>(1.0 / Terrain::kSpacing_m);
  const float x = std::clamp((p.x() - static_cast<float>(terrain.origin_x_m())) * scale, 0.0F,
                             static_cast<float>(terrain.columns() - 1) - 1e-3F);
  const float y = std::clamp((p.y() - static_cast<float>(terrain.origin_y_m())) * scale, 0.0F,
                             static_cast<float>(terrain.rows() - 1) - 1e-3F);
  const auto i = static_cast<std::size_t>(x);
  const auto j = static_cast<std::size_t>(y);
  const float u = x - static_cast<float>(i);
  const float v = y - static_cast<float>(j);
  const std::uint8_t* low = open.data() + j * terrain.columns() + i;
  const std::uint8_t* high = low + terrain.columns();
  return ((1.0F - v) * ((1.0F - u) * static_cast<float>(low[0]) + u * static_cast<float>(low[1])) +
          v * ((1.0F - u) * static_cast<float>(high[0]) + u * static_cast<float>(high[1]))) /
         255.0F;
}

World::Body::Surface World::Body::ground_at(const Vec3f& p, float footprint) const {
  float sx = 0.0F;
  float sy = 0.0F;
  terrain.slope(p.x(), p.y(), sx, sy);
  const Grain grain = texture.at(p.x(), p.y(), footprint);
  const float rough = terrain.roughness(p.x(), p.y());
  Surface s;
  s.p = p;
  s.n_mesh = Vec3f(-sx, -sy, 1.0F).normalized();
  s.n = Vec3f(-sx - rough * grain.slope_x, -sy - rough * grain.slope_y, 1.0F).normalized();
  s.albedo = terrain.albedo(p.x(), p.y()) * std::max(0.1F, 1.0F + rough * texture_contrast * grain.albedo);
  s.open = open_at(p);
  return s;
}

World::Body::Surface World::Body::rock_at(std::size_t index, unsigned triangle, float u, float v,
                                          const Vec3f& p, float footprint) const {
  const Rock& rock = rocks[index];
  const RockShape& shape = shapes[rock.shape];
  const Placement& place = placements[index];
  const auto& t = shape.triangles[triangle];
  const Vec3f n_local =
      ((1.0F - u - v) * shape.normals[t[0]] + u * shape.normals[t[1]] + v * shape.normals[t[2]]).normalized();
  // The texture is laid on along the axis that the face looks to most; each rock has its own piece of it.
  const Vec3f q = place.scale / kRockTexture_m * place.to_local(p) +
                  static_cast<float>(index % 997) * Vec3f(0.37F, 0.61F, 0.83F);
  const Vec3f a = n_local.cwiseAbs();
  Surface s;
  s.p = p;
  s.n_mesh = place.turn(n_local);
  Vec3f bump(0.0F, 0.0F, 0.0F);
  Grain grain;
  if (a.z() >= a.x() && a.z() >= a.y()) {
    grain = texture.at(q.x(), q.y(), footprint / kRockTexture_m);
    bump = Vec3f(grain.slope_x, grain.slope_y, 0.0F);
  } else if (a.x() >= a.y()) {
    grain = texture.at(q.y(), q.z(), footprint / kRockTexture_m);
    bump = Vec3f(0.0F, grain.slope_x, grain.slope_y);
  } else {
    grain = texture.at(q.z(), q.x(), footprint / kRockTexture_m);
    bump = Vec3f(grain.slope_y, 0.0F, grain.slope_x);
  }
  s.n = (s.n_mesh - 0.7F * place.turn(bump)).normalized();
  s.albedo = rock.albedo * std::max(0.1F, 1.0F + kRockContrast * texture_contrast * grain.albedo);
  s.open = 1.0F;
  return s;
}

/// Of light that comes in at cosine `in` from the normal, what goes back along the ray.
float scattered(float in, const Vec3f& n, const RTCRayHit8& packet, int k, float backscatter) {
  if (backscatter <= 0.0F) return in;
  const Vec3f from(-packet.ray.dir_x[k], -packet.ray.dir_y[k], -packet.ray.dir_z[k]);
  const float out = std::max(0.0F, n.dot(from) / from.norm());
  return (1.0F - backscatter) * in + backscatter * in / std::max(0.05F, in + out);
}

void World::Body::trace(RTCRayHit8& packet, const int* valid, const Light& light, const float* footprint,
                        float* radiance) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect8(valid, top, &context, &packet);
  Surface surface[8];
  alignas(32) RTCRay8 shadow{};
  alignas(32) int lit[8];
  for (int k = 0; k < 8; ++k) {
    radiance[k] = 0.0F;
    lit[k] = 0;
    shadow.tfar[k] = -1.0F;
    if (valid[k] == 0 || packet.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID) continue;
    const Vec3f direction(packet.ray.dir_x[k], packet.ray.dir_y[k], packet.ray.dir_z[k]);
    const Vec3f p =
        Vec3f(packet.ray.org_x[k], packet.ray.org_y[k], packet.ray.org_z[k]) + packet.ray.tfar[k] * direction;
    // Seen at a slant, a sample covers more ground.
    const float slant = std::max(0.05F, std::fabs(direction.z()) / direction.norm());
    const float size = (footprint[k] * packet.ray.tfar[k] + footprint[k + 8]) / std::sqrt(slant);
    const unsigned instance = packet.hit.instID[0][k];
    surface[k] = instance == RTC_INVALID_GEOMETRY_ID
                     ? ground_at(p, size)
                     : rock_at(instance - 1, packet.hit.primID[k], packet.hit.u[k], packet.hit.v[k], p, size);
    const Vec3f& sun = light.disc[k % kSamples];
    if (surface[k].n.dot(sun) <= 0.0F || surface[k].n_mesh.dot(sun) <= 0.0F) continue;
    lit[k] = -1;
    const Vec3f from = p + kShadowOffset_m * (1.0F + packet.ray.tfar[k] * 0.01F) * surface[k].n_mesh;
    shadow.org_x[k] = from.x();
    shadow.org_y[k] = from.y();
    shadow.org_z[k] = from.z();
    shadow.dir_x[k] = sun.x();
    shadow.dir_y[k] = sun.y();
    shadow.dir_z[k] = sun.z();
    shadow.tnear[k] = 0.0F;
    shadow.tfar[k] = 1.0e4F;
    shadow.mask[k] = ~0U;
  }
  rtcOccluded8(lit, top, &context, &shadow);
  for (int k = 0; k < 8; ++k) {
    if (valid[k] == 0 || packet.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID) continue;
    const Surface& s = surface[k];
    const float facing_up = 0.5F + 0.5F * s.n.z();
    float irradiance = light.sky * s.open * facing_up + ground_albedo * light.ground_irradiance *
                                                            ((1.0F - facing_up) + 0.5F * (1.0F - s.open));
    if (lit[k] != 0 && shadow.tfar[k] >= 0.0F)
      irradiance += kSun * scattered(s.n.dot(light.disc[k % kSamples]), s.n, packet, k, light.backscatter);
    radiance[k] = s.albedo * irradiance;
  }
}

World::World(const Scene& scene)
    : scene_(scene),
      path_(plan(scene)),
      body_(std::make_unique<Body>(scene_, make_shapes(scene_),
                                   [this](const Terrain& terrain, const std::vector<RockShape>& shapes) {
                                     return place_rocks(scene_, terrain, shapes, path_);
                                   })) {}
World::World(const Scene& scene, std::vector<RockShape> shapes, std::vector<Rock> rocks)
    : scene_(scene),
      path_(plan(scene)),
      body_(std::make_unique<Body>(
          scene_, std::move(shapes),
          [&rocks](const Terrain&, const std::vector<RockShape>&) { return rocks; })) {}
World::~World() = default;

const Terrain& World::terrain() const { return body_->terrain; }
const std::vector<Rock>& World::rocks() const { return body_->rocks; }

Pose3 World::T_map_rover(std::size_t frame) const {
  return settle(path_.at(frame), [&](double x, double y) { return body_->terrain.height_m(x, y); });
}

std::vector<AttitudeReading> World::attitude_readings() const {
  return read_attitude_sensors(scene_, path_, [this](std::size_t frame) { return T_map_rover(frame); });
}

namespace {

/// Clears a packet for rays `make(pixel, place_u, place_v, k)` of two neighbouring pixels.
template <typename MakeRay>
void fill(RTCRayHit8& packet, int* valid, int u, int width, const MakeRay& make) {
  for (int k = 0; k < 8; ++k) {
    const int pixel = u + k / kSamples;
    valid[k] = pixel < width ? -1 : 0;
    packet.ray.tnear[k] = 0.0F;
    packet.ray.tfar[k] = valid[k] != 0 ? 1.0e4F : -1.0F;
    packet.ray.mask[k] = ~0U;
    packet.ray.flags[k] = 0;
    packet.ray.time[k] = 0.0F;
    packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
    packet.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    make(pixel, kPlaceU[k % kSamples], kPlaceV[k % kSamples], k);
  }
}

void store(const float* radiance, int u, int width, float* row) {
  for (int i = 0; i < 2 && u + i < width; ++i) {
    const float* r = radiance + kSamples * i;
    row[u + i] = 0.25F * (r[0] + r[1] + r[2] + r[3]);
  }
}

}  // namespace

void World::render(const View& view, const Sun& sun, FloatImage& out, FloatImage* depth) const {
  const Light light = light_of(sun, scene_.light);
  const auto pixels = static_cast<std::size_t>(view.width_px) * static_cast<std::size_t>(view.height_px);
  out = {view.width_px, view.height_px, std::vector<float>(pixels)};
  if (depth != nullptr) *depth = out;
  const Mat3 R = view.T_map_cam.q.toRotationMatrix();
  const Vec3f origin = view.T_map_cam.t.cast<float>();
  alignas(32) RTCRayHit8 packet{};
  alignas(32) int valid[8];
  float footprint[16] = {};
  float radiance[8];
  for (int k = 0; k < 8; ++k)
    footprint[k] = static_cast<float>(0.5 / view.fx_px);  // two samples across a pixel
  const auto direction = [&](double u, double v) {
    return Vec3f((R * Vec3((u - view.cx_px) / view.fx_px, (v - view.cy_px) / view.fy_px, 1.0)).cast<float>());
  };
  const auto aim = [&](const Vec3f& d, int k) {
    packet.ray.org_x[k] = origin.x();
    packet.ray.org_y[k] = origin.y();
    packet.ray.org_z[k] = origin.z();
    packet.ray.dir_x[k] = d.x();  // not normalised: the ray's parameter is the camera's z
    packet.ray.dir_y[k] = d.y();
    packet.ray.dir_z[k] = d.z();
  };
  for (int v = 0; v < view.height_px; ++v) {
    float* row = out.pixels.data() + static_cast<std::ptrdiff_t>(v) * view.width_px;
    for (int u = 0; u < view.width_px; u += 2) {
      fill(packet, valid, u, view.width_px, [&](int pixel, float du, float dv, int k) {
        aim(direction(pixel + static_cast<double>(du), v + static_cast<double>(dv)), k);
      });
      body_->trace(packet, valid, light, footprint, radiance);
      store(radiance, u, view.width_px, row);
    }
  }
  if (depth == nullptr) return;
  for (int v = 0; v < view.height_px; ++v) {
    for (int u = 0; u < view.width_px; ++u) {
      RTCRayHit ray{};
      const Vec3f d = direction(u, v);
      ray.ray = {origin.x(), origin.y(), origin.z(), 0.0F, d.x(), d.y(), d.z(), 0.0F, 1.0e4F, ~0U, 0, 0};
      ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      rtcIntersect1(body_->top, &context, &ray);
      depth->pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(view.width_px) +
                    static_cast<std::size_t>(u)] =
          ray.hit.geomID == RTC_INVALID_GEOMETRY_ID ? 0.0F : ray.ray.tfar;
    }
  }
}

void World::render(const OrthoPart& part, const Sun& sun, FloatImage& out) const {
  const Light light = light_of(sun, scene_.light);
  const auto pixels = static_cast<std::size_t>(part.width_px) * static_cast<std::size_t>(part.height_px);
  out = {part.width_px, part.height_px, std::vector<float>(pixels)};
  constexpr float kAbove_m = 100.0F;
  alignas(32) RTCRayHit8 packet{};
  alignas(32) int valid[8];
  float footprint[16] = {};
  float radiance[8];
  for (int k = 0; k < 8; ++k) {
    footprint[k + 8] = static_cast<float>(0.5 * part.pixel_m);
    packet.ray.org_z[k] = kAbove_m;
    packet.ray.dir_z[k] = -1.0F;
  }
  for (int v = 0; v < part.height_px; ++v) {
    float* row = out.pixels.data() + static_cast<std::ptrdiff_t>(v) * part.width_px;
    for (int u = 0; u < part.width_px; u += 2) {
      fill(packet, valid, u, part.width_px, [&](int pixel, float du, float dv, int k) {
        packet.ray.org_x[k] =
            static_cast<float>(part.x_m + (pixel + 0.5 + static_cast<double>(du)) * part.pixel_m);
        packet.ray.org_y[k] =
            static_cast<float>(part.y_m - (v + 0.5 + static_cast<double>(dv)) * part.pixel_m);
      });
      body_->trace(packet, valid, light, footprint, radiance);
      store(radiance, u, part.width_px, row);
    }
  }
}

}  // namespace cairn::ground::sim
