/// A forecast as a GeoPackage, for geographic information systems.
#pragma once

#include <filesystem>
#include <string>

namespace cairn::ground {

/// Writes the features of to_geojson() (forecast_files.hpp) with a layer for each kind: drive, blind,
/// ellipses, stations; those of which there is none are absent. In the map's own system, local ones too, so
/// that they lie over the map's GeoPackage. Throws ToolError as write_layers() of map/geopackage.hpp does.
void write_forecast_layers(const std::filesystem::path& path, const std::string& geojson,
                           const std::string& reference_system);

}  // namespace cairn::ground
