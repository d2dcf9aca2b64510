/// Boulders as a table: what the detector makes, what CSV files carry, what the flight map is encoded from.
#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "core/eigen.hpp"

namespace cairn::ground {

/// One boulder, frame `map`.
struct TableBoulder {
  Vec2 p_map_m = Vec2(0.0, 0.0);
  double diameter_m = 0.0;  ///< of the disc of the same area
  double area_m2 = 0.0;
  double contrast = 0.0;    ///< mean darkness below the surroundings, share of 8 bits, 0 to 1; 0 = unknown
  double elongation = 1.0;  ///< longer over shorter axis of the ellipse of the same second moments, 1 or more
  double height_m = 0.0;    ///< top above the ground around it; 0 = unknown
  double confidence = 1.0;  ///< probability that a boulder stands here, 0 to 1
  double ground_z_m = std::numeric_limits<double>::quiet_NaN();  ///< of the ground there; NaN = unknown
};

/// Of a table's or a layer's column `kind`: crater or craters, in small letters or capitals.
bool is_crater(std::string_view kind);

/// Throws ToolError, `where` in front: a diameter that is not positive, a confidence beyond 0 to 1.
void check_boulder(const TableBoulder& boulder, const std::string& where);

/// A rectangle in frame `map`.
struct MapExtent {
  double min_x_m = 0.0;
  double min_y_m = 0.0;
  double max_x_m = 0.0;
  double max_y_m = 0.0;

  bool contains(const Vec2& p_map_m, double margin_m = 0.0) const {
    return p_map_m.x() >= min_x_m + margin_m && p_map_m.x() <= max_x_m - margin_m &&
           p_map_m.y() >= min_y_m + margin_m && p_map_m.y() <= max_y_m - margin_m;
  }
};

/// The smallest rectangle around the boulders, 1 cm wider on each side; all zero where there is none.
MapExtent extent_of(const std::vector<TableBoulder>& boulders);

/// CSV text, one boulder a line, then one crater a line, positions to 0.1 mm:
///   x_m,y_m,diameter_m,area_m2,contrast,elongation,height_m,confidence,ground_z_m,kind
/// contrast and ground_z_m are empty where unknown; kind is boulder or crater.
std::string to_csv(const std::vector<TableBoulder>& boulders, const std::vector<TableBoulder>& craters = {});

/// Reads a CSV table with a header line. Columns may stand in any order and others are passed over; x or x_m,
/// y or y_m, diameter, diameter_m or size must be there (or wkt, with points, in place of x and y: QGIS); the
/// others of to_csv are taken where they are, and a field of theirs may be empty. Boulders smaller than
/// `min_diameter_m` are left out, and so are lines of kind crater.
///
/// Throws ToolError: cannot be read, empty, a column missing, a line with more or fewer fields than the first
/// or with no finite number in a field that is needed, what check_boulder() refuses.
std::vector<TableBoulder> read_csv(const std::filesystem::path& path, double min_diameter_m = 0.0);

}  // namespace cairn::ground
