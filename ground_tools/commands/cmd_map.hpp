/// The parts of `cairn map`, each with its own file, and what they share.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/boulder_table.hpp"
#include "cmap/cmap_file.hpp"

namespace cairn::ground {

void add_map_build(CLI::App& map);     ///< cairn map build   (cmd_map_build.cpp)
void add_map_info(CLI::App& map);      ///< cairn map info | verify   (cmd_map_info.cpp)
void add_map_diff(CLI::App& map);      ///< cairn map diff | merge   (cmd_map_diff.cpp)
void add_map_unpack(CLI::App& map);    ///< cairn map unpack | quicklook   (cmd_map_unpack.cpp)
void add_map_uplink(CLI::App& map);    ///< cairn map uplink   (cmd_map_uplink.cpp)
void add_map_forecast(CLI::App& map);  ///< cairn map forecast   (cmd_map_forecast.cpp)

/// A command worked and its answer is no (maps differ, map damaged): exit status 2. 1 is an error,
/// told on stderr.
inline constexpr int kAnswerIsNo = 2;

/// Keys in the order in which they are set.
using Json = nlohmann::ordered_json;

/// One object on stdout.
void print_json(const Json& object);
Json to_json(const MapExtent& extent);

/// How near two maps' entries of one boulder lie: two pixels of the coarsest image, at least 0.1 m.
double usual_distance_m(std::initializer_list<double> pixels_m);

}  // namespace cairn::ground
