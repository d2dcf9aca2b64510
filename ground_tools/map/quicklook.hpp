/// A picture of a boulder map, to be looked at before the map goes anywhere.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/boulder_table.hpp"

namespace cairn::ground {

struct QuicklookParams {
  std::filesystem::path ortho;  ///< what is drawn on; empty: plain ground
  int band = 0;                 ///< as in read_orthoimage
  int max_side_px = 2000;       ///< of the picture, 100 to 10000
  std::function<void(double share)> progress = [](double) {};
};

/// What the picture shows, for those who tell.
struct QuicklookFacts {
  int width_px = 0;
  int height_px = 0;
  double pixel_m = 0.0;
};

/// Writes a PNG of `extent`, and `<path>.aux.xml` beside it, which gives its place and reference system to
/// GDAL and QGIS. It has the pixel grid of the orthoimage (cut to the extent, averaged down, or magnified two
/// to four times where it is small), stretched so that 1 % of it is black and 1 % white;
/// no data is dark blue.
///
/// Each boulder is a circle around it of its true diameter, at least 2 pixels in radius, coloured by
/// confidence: red 0, yellow 0.5, cyan 1. A bar tells lengths, a second one the colours. The orthoimage is
/// read in pieces: memory does not grow with it.
///
/// Throws ToolError: orthoimage missing, not whole, without geo-reference, in another reference system, or
/// beside the map; folder, disk full; a side out of range; a map without extent.
QuicklookFacts write_quicklook(const std::filesystem::path& path, const std::vector<TableBoulder>& boulders,
                               const MapExtent& extent, const std::string& reference_system,
                               const QuicklookParams& params = {});

}  // namespace cairn::ground
