/// Writes a simulated drive as a data set, in the layout that `dataset.hpp` reads.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>

#include "sim/world.hpp"

namespace cairn::ground::sim {

/// calib.txt, truth_left_camera.tum, truth_rover.txt, truth_rocks.csv (rocks, no pebbles) and scene.toml;
/// where there are any, truth_craters.csv and attitude.csv.
void write_truth(const World& world, const std::filesystem::path& folder);

/// left/%06d.png and right/%06d.png of the frames `first` to `end` - 1, on all cores. Pairs that are there
/// already stay: the work goes on where it was stopped. Throws ToolError where a file cannot be written.
/// `done` hears 0 to 1.
void write_frames(const World& world, const std::filesystem::path& folder, std::size_t first, std::size_t end,
                  const std::function<void(double)>& done);

/// Throws ToolError where `folder` holds the data of another scene.
void check_same_scene(const Scene& scene, const std::filesystem::path& folder);

}  // namespace cairn::ground::sim
