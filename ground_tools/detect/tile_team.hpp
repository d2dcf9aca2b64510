/// Who works on the tiles: threads of this process, and the other ranks' threads.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "detect/mpi_ranks.hpp"
#include "detect/tile_grid.hpp"
#include "detect/tile_work.hpp"

namespace cairn::ground {

/// What a build is about; the same on all ranks.
struct TileJob {
  const RasterSource& source;
  Detection detection;
  TileGrid grid;
};

/// Takes each tile's record, on the thread that called, in no order that may be relied on.
using TakeRecord = std::function<void(std::uint32_t tile, Bytes&& record)>;

/// Rank 0 leads while this lives; at its end, whatever the reason, the other ranks hear that there
/// is no more.
class TileLead {
 public:
  explicit TileLead(const MpiRanks& ranks) : ranks_(ranks) {}
  ~TileLead();
  TileLead(const TileLead&) = delete;
  TileLead& operator=(const TileLead&) = delete;

 private:
  const MpiRanks& ranks_;
};

/// Rank 0's side of the rounds; a TileLead must live as long.
class TileTeam {
 public:
  /// `threads` of this process.
  TileTeam(const TileJob& job, int threads, const MpiRanks& ranks);

  /// One round over the tiles in `todo`. Once `stop` says so, no tile is begun any more, and those in hand
  /// are taken. True: all done; false: stopped. Throws what a worker threw, of whatever rank.
  bool run(const RoundInput& input, const std::vector<std::uint32_t>& todo, const TakeRecord& take,
           const std::function<bool()>& stop);

 private:
  void tell(std::size_t rank, const RoundInput& input, const std::vector<std::uint32_t>& tiles) const;
  /// Takes one message of another rank, if there is one.
  bool take_message(const TakeRecord& take);

  const TileJob& job_;
  int threads_;
  const MpiRanks& ranks_;
};

/// What a build starts from.
struct TileInput {
  std::unique_ptr<RasterSource> source;
  Detection detection;
};

/// The other ranks' side: works until rank 0 says that there is no more. `open` is called at the first round;
/// what it throws goes to rank 0.
void follow_tile_team(const std::function<TileInput()>& open, int threads, const MpiRanks& ranks);

}  // namespace cairn::ground
