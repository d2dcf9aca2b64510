/// Boulders of an orthoimage of any size, in bounded memory, on all cores and machines: the same table to the
/// bit whatever the tiles, the threads and the processes, and however often it was stopped on the way.
///
/// The image is cut into tiles, and goes by in rounds. Of each tile a round gives a record of bytes, which is
/// a pure function of the image around the tile and of what the rounds before found;
/// records add up in any order.
///   values        (not 8-bit) counts of pixel values, for the stretch to grey; reals twice
///   statistics    histograms of the difference image, for the thresholds
///   boulders      boulders, and pieces of those that other tiles share
/// Threads and ranks take tiles; rank 0 gathers the records and keeps them (partial_state.hpp).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/boulder_table.hpp"
#include "detect/detector.hpp"
#include "detect/mpi_ranks.hpp"
#include "detect/tile_team.hpp"
#include "ortho/raster_source.hpp"

namespace cairn::ground {

using ShareDone = std::function<void(double share)>;

struct BuildSettings {
  int tile_px = 0;  ///< side of the tiles; 0 = what suits the file
  int threads = 0;  ///< 0 = one for each core that this process may use
  /// Keeps what is finished, so that a run that was stopped goes on; empty = nowhere.
  std::filesystem::path state;
  /// Images of so many pixels or more keep a state; the others take a second or two.
  std::uint64_t state_from_px = 0;
  ShareDone done;                               ///< hears 0 to 1, a finished part of an earlier run included
  std::function<bool()> stop;                   ///< true: end with the tiles in hand, then throw
  std::function<void(const std::string&)> say;  ///< one line, e.g. about going on
};

inline constexpr int kLeastTilePx = 64;
inline constexpr int kMostTilePx = 65536;
inline constexpr int kMostThreads = 1024;

class MapBuild {
 public:
  MapBuild(const RasterSource& source, const Detection& detection, BuildSettings settings,
           const MpiRanks& ranks);
  ~MapBuild();
  MapBuild(const MapBuild&) = delete;
  MapBuild& operator=(const MapBuild&) = delete;

  /// Rank 0: all boulders, in the order of their first pixels. Throws ToolError: parameters out of range,
  /// the file ends early, nothing valid or one value throughout, disk full, stopped.
  std::vector<TableBoulder> run();
  /// After run(): in the order of their centres' pixels; none of kOtsu.
  const std::vector<TableBoulder>& craters() const;
  /// The boulders are where they should be: the partial state goes.
  void finished();
  /// Ranks 1 and on: works for rank 0 until its TileLead (tile_team.hpp) ends.
  static void follow(const std::function<TileInput()>& open, const BuildSettings& settings,
                     const MpiRanks& ranks);

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

}  // namespace cairn::ground
