#include "campaign/local_maps.hpp"

#include <fmt/format.h>

#include "app/flight_app.hpp"

namespace cairn::ground {

void SnapshotKeeper::watch(const ReplayFrame& frame) {
  const Localizer& localizer = app::root.localizer();
  const FixRecord& fix = localizer.last_fix();
  if (fix.status == FixStatus::kNone || fix.frame != localizer.frame()) return;
  const auto truth = drive_.truth_rover(frame.index);
  if (!truth) return;
  // From site to the rover as it is thought to stand, and from there to the map as it truly stands.
  const Pose2 T_rover_site = planar(localizer.T_map_rover()).inverse() * localizer.T_map_site();
  const Pose2 T_map_site = planar(*truth) * T_rover_site;
  LocalSnapshot snapshot;
  snapshot.index = frame.index;
  for (const LocalBoulder& b : localizer.local_map()) {
    snapshot.boulders.push_back(
        {T_map_site * b.p_site_m, static_cast<double>(b.diameter_m), static_cast<int>(b.sightings)});
  }
  snapshots_.push_back(snapshot);
}

std::string to_csv_rows(const std::vector<LocalSnapshot>& snapshots, const char* vo) {
  std::string text;
  for (const LocalSnapshot& s : snapshots) {
    for (const SeenBoulder& b : s.boulders) {
      text += fmt::format("{},{},{:.4f},{:.4f},{:.3f},{}\n", vo, s.index, b.p_map_m.x(), b.p_map_m.y(),
                          b.diameter_m, b.sightings);
    }
  }
  return text;
}

}  // namespace cairn::ground
