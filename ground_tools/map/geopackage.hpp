/// Boulder tables for geographic information systems (QGIS and the like): GeoPackage, and CSV with what they
/// need beside it.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/boulder_table.hpp"

class GDALDataset;
class OGRSpatialReference;

namespace cairn::ground {

/// Writes a GeoPackage (OGC 12-128, GDAL's driver) with the layers that `fill` adds to it, given the
/// reference system as GDAL has it; `fill` returns false where GDAL failed. The same layers give the same
/// bytes: the date that a GeoPackage carries is 2000-01-01. The file is whole or absent, and one that was
/// there before is replaced. Throws ToolError: folder, disk full, reference system unknown.
void write_layers(const std::filesystem::path& path, const std::string& reference_system,
                  const std::function<bool(GDALDataset&, OGRSpatialReference&)>& fill);

/// By write_layers(): one layer `boulders`, in the order of the table,
///   geom          point, x east and y north as in the table, to the last bit; with z where ground_z_m of all
///                 boulders is known
///   diameter_m, area_m2, contrast, elongation, height_m, confidence, ground_z_m
///                 as in boulder_table.hpp, NULL where unknown
/// with a spatial index, and, where there are any, a layer `craters` of the same columns.
void write_geopackage(const std::filesystem::path& path, const std::vector<TableBoulder>& boulders,
                      const std::string& reference_system, const std::vector<TableBoulder>& craters = {});

/// Writes `path` as to_csv has it, and beside it what makes GDAL and QGIS see points in it: `.csvt` (types of
/// the columns) and, unless the reference system is a local one, `.prj` (the system as WKT), named as `path`
/// with its ending exchanged. Throws ToolError: folder, disk full, reference system unknown, or the `.prj`
/// belongs to a shapefile of the same name.
void write_csv(const std::filesystem::path& path, const std::vector<TableBoulder>& boulders,
               const std::string& reference_system, const std::vector<TableBoulder>& craters = {});

/// The reference system of a table of boulders: that of the `.prj` beside it (WKT), "local" where there is
/// none. Throws ToolError where it is there and means nothing, or means degrees.
std::string reference_beside(const std::filesystem::path& csv);

/// Boulders of a layer of points that GDAL opens: a GeoPackage as above or as QGIS saves it, GeoJSON, a
/// shapefile. Fields diameter_m or diameter, others of write_geopackage where they are, as numbers or text.
/// Features of kind crater are left out, as by read_csv(). Of several layers `boulders`, else the first but
/// `craters`. Throws ToolError: cannot be read, no points, no such field, text that is no number, degrees,
/// what check_boulder() refuses.
struct PointLayer {
  std::vector<TableBoulder> boulders;
  std::string reference_system;
};
PointLayer read_points(const std::filesystem::path& path, double min_diameter_m = 0.0);

}  // namespace cairn::ground
