// cairn sim: renders a simulated drive and its site.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/output_file.hpp"
#include "base/progress_line.hpp"
#include "base/tool_error.hpp"
#include "commands/commands.hpp"
#include "commands/frame_range.hpp"
#include "sim/data_set.hpp"
#include "sim/orthoimage.hpp"
#include "sim/scene.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct SimOptions {
  fs::path scene;
  std::vector<std::string> sets;
  fs::path output;
  std::string frames;
  std::vector<double> ortho_m;
  int ortho_samples = sim::kOrthoSamples;
  bool no_frames = false;
};

void simulate(const SimOptions& options) {
  const sim::Scene scene = sim::load_scene(options.scene, options.sets);
  sim::check_same_scene(scene, options.output);
  const FrameRange range = options.frames.empty() ? FrameRange{} : parse_frames(options.frames);
  const std::size_t frames = sim::plan(scene).size();
  const std::size_t end = std::min(range.end, frames);
  if (range.first >= end) {
    throw ToolError("--frames: the traverse has {} frames; give a range within 0:{}", frames, frames);
  }
  std::vector<sim::OrthoProduct> products;
  std::error_code ignored;
  for (const double pixel_m : options.ortho_m) {
    const fs::path path = options.output / sim::ortho_name(pixel_m);
    if (!fs::exists(path, ignored)) products.push_back({path, pixel_m});
  }
  check(scene.site, products);  // all is told before the work
  make_folder(options.output);
  fmt::print("making the site\n");
  std::fflush(stdout);
  const sim::World world(scene);
  sim::write_truth(world, options.output);
  sim::write_dem(world, options.output / "dem_5cm.tif");
  fmt::print("{:g} x {:g} m, {} rocks and pebbles, {} frames over {:.1f} m\n", scene.site.width_m,
             scene.site.height_m, world.rocks().size(), frames, world.path().back().arc_m);
  if (!products.empty()) {
    ProgressLine progress("sim orthoimage");
    sim::write_orthoimages(
        world, products, [&](double share) { progress.show(share); }, options.ortho_samples);
  }
  if (!options.no_frames) {
    ProgressLine progress("sim frames");
    sim::write_frames(world, options.output, range.first, end, [&](double share) { progress.show(share); });
  }
  fmt::print("written: {}\n", options.output.string());
}

}  // namespace

void add_sim_command(Command app) {
  const auto options = std::make_shared<SimOptions>();
  Command command = app.add_command(
      "sim",
      "Render a simulated drive over a field of boulders and craters: stereo pairs, orthoimages, truth");
  command.add_option("scene", options->scene,
                     "the scene, TOML (keys: doc/guide/simulator.md); default: the paper's");
  command.add_option("--set", options->sets,
                     "override a value of the scene, e.g. traverse.length_m=20; repeatable");
  command.add_option("-o,--output", options->output, "folder for the data set").required();
  command.add_option("--ortho", options->ortho_m, "pixel sizes of the orthoimages, m, e.g. 0.005,0.02")
      .separated_by(',');
  command
      .add_option("--ortho-samples", options->ortho_samples,
                  "most samples across the smallest orthoimage's pixel: 4 is quick, with rougher edges")
      .within(2, sim::kOrthoSamples)
      .default_shown();
  command.add_option("--frames", options->frames, "frames to render, FIRST:END, counted from 0");
  command.add_flag("--no-frames", options->no_frames, "no stereo pairs");
  command.on_run([options] { simulate(*options); });
}

}  // namespace cairn::ground
