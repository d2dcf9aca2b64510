/// What the rover saw of the boulders, put where it truly was: the local map at each snapshot of a replay.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/eigen.hpp"
#include "dataset/drive.hpp"
#include "replay/replay.hpp"

namespace cairn::ground {

struct SeenBoulder {
  Vec2 p_map_m = Vec2(0.0, 0.0);  ///< as the rover saw it at the snapshot, from its true pose
  double diameter_m = 0.0;
  int sightings = 0;
};

/// The local map that a registration began with.
struct LocalSnapshot {
  std::size_t index = 0;  ///< of the frame in the drive
  std::vector<SeenBoulder> boulders;
};

/// For ReplayOptions::watch: keeps the local map of each registration. Asks for a drive with truth.
class SnapshotKeeper {
 public:
  explicit SnapshotKeeper(const Drive& drive) : drive_(drive) {}
  void watch(const ReplayFrame& frame);
  const std::vector<LocalSnapshot>& snapshots() const { return snapshots_; }

 private:
  const Drive& drive_;
  std::vector<LocalSnapshot> snapshots_;
};

/// As CSV, with `vo` in the first column; without the line of names.
std::string to_csv_rows(const std::vector<LocalSnapshot>& snapshots, const char* vo);
inline constexpr const char* kSeenColumns = "vo,snapshot,x_m,y_m,diameter_m,sightings\n";

}  // namespace cairn::ground
