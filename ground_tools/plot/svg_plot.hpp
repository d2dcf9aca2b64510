/// The picture of a replay: paths over the orthoimage with boulders and fixes, and the error
/// over the distance.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/eigen.hpp"

namespace cairn::ground {

struct PlotBoulder {
  Vec2 p_map_m = Vec2(0.0, 0.0);
  double diameter_m = 0.0;
};

/// A registration: where the rover was thought to be, and by how much that was moved.
struct PlotFix {
  Vec2 p_map_m = Vec2(0.0, 0.0);
  Vec2 correction_m = Vec2(0.0, 0.0);
  double distance_m = 0.0;  ///< along the path, for the lower panel
  bool used = true;         ///< false: computed, and refused
  std::string verdict;      ///< what became of it
};

struct ErrorSample {
  double distance_m = 0.0;
  double xy_m = 0.0;
};

/// A stretch of the drive over which the pose was trusted alike.
struct PlotTrust {
  double from_m = 0.0;
  double to_m = 0.0;
  std::string state;  ///< confirmed, claimed, coasting, unconfirmed or lost
};

/// What to draw. Every list may be empty; what is absent is left out of the legend too.
struct ReplayPlot {
  std::string title;
  std::string subtitle;
  std::filesystem::path orthoimage;    ///< empty: a plain background
  Vec2 p_proj_map_m = Vec2(0.0, 0.0);  ///< the map's origin in the orthoimage's projection
  std::vector<Vec2> truth_map_m;       ///< paths: points x east, y north in metres
  std::vector<Vec2> vo_map_m;
  std::vector<Vec2> corrected_map_m;
  std::vector<PlotBoulder> orbital;
  std::vector<PlotBoulder> ground;
  std::vector<PlotFix> fixes;
  std::vector<ErrorSample> vo_error;  ///< the lower panel is drawn where one of these has samples
  std::vector<ErrorSample> corrected_error;
  std::vector<ErrorSample>
      three_sigma;               ///< a band behind them: what the corrected error is claimed to be below
  std::vector<PlotTrust> trust;  ///< a strip along the lower panel's foot
};

/// The whole picture as one SVG text; the piece of orthoimage is inside it. The view is the paths with a
/// margin. Corrections are drawn larger than they are where they would be too short to see; the legend tells
/// by how much. Colours are those of Okabe and Ito, which colour-blind readers tell apart. Throws ToolError
/// where the orthoimage cannot be read or is not north-up, or no path has a point.
std::string render_svg(const ReplayPlot& plot);

}  // namespace cairn::ground
