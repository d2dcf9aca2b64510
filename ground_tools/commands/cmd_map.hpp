/// The parts of `cairn map`, each with its own file, and what they share.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/boulder_table.hpp"
#include "cmap/cmap_file.hpp"
#include "commands/command_line.hpp"

namespace cairn::ground {

// Each of `cairn map`, in its file cmd_map_<name>.cpp.
void add_map_build(Command map);
void add_map_diff(Command map);
void add_map_forecast(Command map);
void add_map_info(Command map);
void add_map_merge(Command map);
void add_map_quicklook(Command map);
void add_map_score(Command map);
void add_map_unpack(Command map);
void add_map_uplink(Command map);
void add_map_verify(Command map);

/// A command worked and its answer is no (maps differ, map damaged): exit status 2. 1 is an error,
/// told on stderr.
inline constexpr int kAnswerIsNo = 2;

/// Keys in the order in which they are set.
using Json = nlohmann::ordered_json;

/// One object on stdout.
void print_json(const Json& object);
Json to_json(const MapExtent& extent);

CmapContent load_map(const std::filesystem::path& path);

/// Throws ToolError where the maps lie in different reference systems.
void need_same_system(const std::filesystem::path& a_path, const CmapContent& a,
                      const std::filesystem::path& b_path, const CmapContent& b);

/// The scale of a map's system at its middle as ortho/site_frame.hpp tells it, and as a warning on stderr.
std::string scale_words(const CmapContent& map);
void warn_of_scale(const std::filesystem::path& path, const CmapContent& map);

/// A way of less than a metre, or with numbers that could be degrees of a map that lies elsewhere, warned of
/// on stderr: coordinates are metres.
void warn_of_way(const std::filesystem::path& path, const std::vector<Vec2>& p_map_m);

/// In words that two maps lie farther apart than either is wide, with the circumference of their body where
/// that is what lies between them (longitudes of 0 to 360 against -180 to 180); empty where
/// they are neighbours.
std::string apart_words(const std::filesystem::path& a_path, const CmapContent& a,
                        const std::filesystem::path& b_path, const CmapContent& b);

/// How near two maps' entries of one boulder lie: two pixels of the coarsest image, at least 0.1 m.
double usual_distance_m(std::initializer_list<double> pixels_m);

}  // namespace cairn::ground
