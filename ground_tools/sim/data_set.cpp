#include "sim/data_set.hpp"

#include <fmt/format.h>
#include <gdal_priv.h>

#include <mutex>
#include <string>

#include "base/output_file.hpp"
#include "base/parallel.hpp"
#include "base/quiet_gdal.hpp"
#include "base/tool_error.hpp"
#include "dataset/trajectory.hpp"
#include "sim/simulated_drive.hpp"

namespace cairn::ground::sim {
namespace {

namespace fs = std::filesystem;

void write_png(const Image& image, const fs::path& path) {
  QuietGdal gdal;
  const std::string memory = fmt::format("/vsimem/{}", path.string());
  const std::string source =
      fmt::format("MEM:::DATAPOINTER={},PIXELS={},LINES={},BANDS=1,DATATYPE=Byte",
                  static_cast<const void*>(image.pixels.data()), image.width, image.height);
  GDALDataset* pixels = GDALDataset::Open(source.c_str(), GDAL_OF_RASTER);
  const char* options[] = {"ZLEVEL=1", nullptr};
  GDALDataset* png = pixels == nullptr
                         ? nullptr
                         : GetGDALDriverManager()->GetDriverByName("PNG")->CreateCopy(
                               memory.c_str(), pixels, FALSE, const_cast<char**>(options), nullptr, nullptr);
  if (png != nullptr) GDALClose(png);
  if (pixels != nullptr) GDALClose(pixels);
  vsi_l_offset size = 0;
  GByte* bytes = VSIGetMemFileBuffer(memory.c_str(), &size, TRUE);
  if (bytes == nullptr || gdal.failed()) {
    VSIFree(bytes);
    throw ToolError("{}: cannot be made{}", path.string(), gdal.reason());
  }
  const std::string content(reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(size));
  VSIFree(bytes);
  write_file(path, content);
}

std::string rover_text(const World& world) {
  std::string text =
      "# frame arc_length_m x y z yaw_deg pitch_deg roll_deg : body origin on the ground under the stereo "
      "mid-point; "
      "body x forward, y left, z up; R = Rz(yaw) Ry(pitch) Rx(roll)\n";
  for (std::size_t i = 0; i < world.path().size(); ++i) {
    const Pose3 T = world.T_map_rover(i);
    const Attitude a = attitude_of(T.q);
    text += fmt::format("{} {:.6f} {:.6f} {:.6f} {:.6f} {:.6f} {:.6f} {:.6f}\n", i, world.path()[i].arc_m,
                        T.t.x(), T.t.y(), T.t.z(), a.yaw_rad * kDegPerRad, a.pitch_rad * kDegPerRad,
                        a.roll_rad * kDegPerRad);
  }
  return text;
}

std::string rocks_text(const World& world) {
  std::string text = "id,x,y,z_ground,diameter,height,albedo,shape\n";
  const std::vector<TruthRock> rocks = truth_rocks(world);
  for (std::size_t i = 0; i < rocks.size(); ++i) {
    const TruthRock& r = rocks[i];
    text += fmt::format("{},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.3f},{}\n", r.id, r.p_map_m.x(),
                        r.p_map_m.y(), r.z_ground_map_m, r.diameter_m, r.height_m, world.rocks()[i].albedo,
                        world.rocks()[i].shape);
  }
  return text;
}

std::string craters_text(const World& world) {
  std::string text = "x,y,diameter,depth,rim,degradation\n";
  for (const Crater& c : world.terrain().craters())
    text += fmt::format("{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.3f}\n", c.p_map_m.x(), c.p_map_m.y(),
                        c.diameter_m, c.depth_m, c.rim_m, c.degradation);
  return text;
}

}  // namespace

void check_same_scene(const Scene& scene, const fs::path& folder) {
  const fs::path record = folder / "scene.toml";
  std::error_code ignored;
  if (!fs::exists(record, ignored)) return;
  // A record of before some key was there means that key's default.
  if (to_toml(load_scene(record)) != to_toml(scene))
    throw ToolError("{}: describes another scene; give another folder, or remove this one", record.string());
}

void write_truth(const World& world, const fs::path& folder) {
  const Rig& rig = world.scene().rig;
  write_file(
      folder / "calib.txt",
      fmt::format("# fx fy cx cy baseline_m (pixels, pixel centres at integers; no distortion, rectified)\n"
                  "{:.9f} {:.9f} {:.3f} {:.3f} {:.6f}\n",
                  rig.fx_px, rig.fy_px, rig.cx_px, rig.cy_px, rig.baseline_m));
  Trajectory cameras;
  for (std::size_t i = 0; i < world.path().size(); ++i)
    cameras.push_back({static_cast<double>(i), left_view(rig, world.T_map_rover(i)).T_map_cam});
  write_file(folder / "truth_left_camera.tum", to_tum(cameras));
  write_file(folder / "truth_rover.txt", rover_text(world));
  write_file(folder / "truth_rocks.csv", rocks_text(world));
  if (!world.terrain().craters().empty()) write_file(folder / "truth_craters.csv", craters_text(world));
  if (world.scene().attitude.every_m > 0.0)
    write_file(folder / "attitude.csv", attitude_text(world.scene().attitude, world.attitude_readings()));
  write_file(folder / "scene.toml", to_toml(world.scene()));
}

void write_frames(const World& world, const fs::path& folder, std::size_t first, std::size_t end,
                  const std::function<void(double)>& done) {
  make_folder(folder / "left");
  make_folder(folder / "right");
  std::mutex guard;
  std::size_t count = 0;
  parallel_for(end - first, [&](std::size_t k) {
    const std::string name = fmt::format("{:06}.png", first + k);
    const fs::path left = folder / "left" / name;
    const fs::path right = folder / "right" / name;
    std::error_code ignored;
    if (!fs::exists(left, ignored) || !fs::exists(right, ignored)) {
      const PairImages pair = take_pair(world, first + k);
      write_png(pair.left, left);
      write_png(pair.right, right);
    }
    const std::lock_guard lock(guard);
    ++count;
    if (done) done(static_cast<double>(count) / static_cast<double>(end - first));
  });
}

}  // namespace cairn::ground::sim
