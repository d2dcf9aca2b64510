/// Drives the localizer over a data set, for integration tests.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cmap/cmap_file.hpp"
#include "dataset/dataset.hpp"
#include "dataset/image.hpp"
#include "localizer/localizer.hpp"
#include "support/cmocka.hpp"
#include "support/data.hpp"
#include "support/sanitized.hpp"

namespace cairn::test {

/// Leaves the test where the data set is absent, or the build has the sanitizers.
#define NEEDS_DATA(folder, relative)                                          \
  do {                                                                        \
    if (kSanitized) {                                                         \
      print_message("skipped: %s, too long with the sanitizers\n", relative); \
      skip();                                                                 \
    }                                                                         \
    (folder) = find_data(relative);                                           \
    SKIP_WITHOUT(folder, relative);                                           \
  } while (false)

inline const std::string kSample = CAIRN_SOURCE_DIR "/unit_tests/integration/sample";
inline constexpr int kFixInterval = 30;

/// The data set's intrinsics on the mission's mast.
inline StereoRig rig_of(const ground::Dataset& data) {
  StereoRig rig = data.rig();
  rig.T_rover_cam =
      mast_pose(cfg::kMission.camera_height_m, cfg::kMission.camera_pitch_down_rad, rig.baseline_m);
  return rig;
}

struct Pair {
  ground::Image left;
  ground::Image right;
};

inline void load(const ground::Frame& frame, Pair& pair) {
  pair.left = ground::load_grey(frame.left);
  pair.right = ground::load_grey(frame.right);
}

/// A flight map from a table, its bytes kept. Usable unless the table is empty.
struct FlightMap {
  std::vector<std::uint8_t> bytes;
  OrbitalMap map;

  MapStatus validate() {
    MapValidation validation;
    if (validation.start(bytes.data(), bytes.size()) == MapStatus::kChecking) {
      WorkBudget all = WorkBudget::unlimited();
      static_cast<void>(validation.step(all));
    }
    map = validation.result();
    return validation.status();
  }
  MapStatus make(const std::vector<ground::TableBoulder>& boulders, const ground::MapExtent& extent) {
    bytes = ground::encode_cmap(boulders, extent, 0.001, {});
    return validate();
  }
  MapStatus make(const std::vector<ground::TableBoulder>& boulders) {
    return make(boulders, ground::extent_of(boulders));
  }
};

inline void finish_frame(Localizer& localizer) {
  WorkBudget all = WorkBudget::unlimited();
  assert_status(localizer.step_vo(all), Progress::kDone);
  assert_status(localizer.step_boulders(all), Progress::kDone);
}

inline void frame(Localizer& localizer, const Pair& pair, const Pose3* prior = nullptr) {
  assert_status(localizer.begin_frame(pair.left.view(), pair.right.view(), prior), LocalizerStatus::kReady);
  finish_frame(localizer);
}

inline FixStatus fix(Localizer& localizer) {
  localizer.begin_fix();
  WorkBudget all = WorkBudget::unlimited();
  assert_status(localizer.step_fix(all), Progress::kDone);
  localizer.apply_fix();
  return localizer.last_fix().status;
}

inline double xy_error_m(const Pose3& estimate, const Pose3& truth) {
  return std::hypot(estimate.t.x() - truth.t.x(), estimate.t.y() - truth.t.y());
}
inline double rotation_error_deg(const Pose3& estimate, const Pose3& truth) {
  return quat_log(estimate.q.conjugate() * truth.q).norm() / kRadPerDeg;
}
inline double yaw_error_deg(const Pose3& estimate, const Pose3& truth) {
  return wrap_angle(planar(estimate).yaw_rad - planar(truth).yaw_rad) / kRadPerDeg;
}

/// How many boulders of the local map lie within 0.10 m of a true rock.
struct OnRocks {
  int boulders = 0;
  int on_rocks = 0;

  double share() const { return boulders > 0 ? static_cast<double>(on_rocks) / boulders : 0.0; }
  void add(const Vec2& p_map_m, const std::vector<ground::TruthRock>& rocks) {
    ++boulders;
    for (const ground::TruthRock& rock : rocks) {
      if ((rock.p_map_m - p_map_m).norm() > 0.10) continue;
      ++on_rocks;
      return;
    }
  }
};

/// What a whole drive came to, over frames first to last of the data set.
struct Drive {
  double path_m = 0.0;
  double vo_end_m = 0.0;  ///< in space
  double vo_end_xy_m = 0.0;
  double vo_end_deg = 0.0;
  double end_xy_m = 0.0;
  double largest_xy_m = 0.0;
  double end_yaw_deg = 0.0;
  double largest_excess_m = 0.0;  ///< of the corrected pose's error over VO's own
  int fixes = 0;                  ///< applied
  int rounds = 0;                 ///< begun
  OnRocks local;                  ///< boulders of all local maps
};

/// Runs `localizer` (initialised here, with its trim and map as they are) over a data set that has truth.
inline Drive drive(Localizer& localizer, const LocalizerParams& params, const ground::Dataset& data,
                   std::size_t frames) {
  static Pair pair;
  Drive out;
  assert_status(localizer.init(params, rig_of(data)), LocalizerStatus::kReady);
  assert_status(localizer.set_start(*data.truth_rover(0), 0.02, 0.004), LocalizerStatus::kReady);
  for (std::size_t i = 0; i < frames && i < data.frames().size(); ++i) {
    load(data.frames()[i], pair);
    frame(localizer, pair);
    const Pose3 truth = *data.truth_cam(i);
    if (i > 0) out.path_m += (truth.t - data.truth_cam(i - 1)->t).norm();
    if (i > 0 && i % kFixInterval == 0) {
      ++out.rounds;
      out.fixes += fix(localizer) == FixStatus::kApplied ? 1 : 0;
      for (const LocalBoulder& b : localizer.local_map()) {
        out.local.add(localizer.T_map_site() * b.p_site_m, data.truth_rocks());
      }
    }
    const Pose3 vo = localizer.vo_T_map_cam();
    out.vo_end_m = (vo.t - truth.t).norm();
    out.vo_end_xy_m = xy_error_m(vo, truth);
    out.vo_end_deg = rotation_error_deg(vo, truth);
    out.end_xy_m = xy_error_m(localizer.T_map_cam(), truth);
    out.end_yaw_deg = yaw_error_deg(localizer.T_map_cam(), truth);
    out.largest_xy_m = std::fmax(out.largest_xy_m, out.end_xy_m);
    out.largest_excess_m = std::fmax(out.largest_excess_m, out.end_xy_m - out.vo_end_xy_m);
  }
  print_message(
      "%.1f m: VO %.3f m (%.2f %%, xy %.3f m) %.2f deg; corrected %.3f m, largest %.3f m, yaw %.2f deg; %d "
      "of %d fixes; "
      "%.2f of %d boulders on rocks\n",
      out.path_m, out.vo_end_m, 100.0 * out.vo_end_m / out.path_m, out.vo_end_xy_m, out.vo_end_deg,
      out.end_xy_m, out.largest_xy_m, out.end_yaw_deg, out.fixes, out.rounds, out.local.share(),
      out.local.boulders);
  return out;
}

/// The map that `cairn map build --from-csv` makes of the data set's true rocks.
inline std::vector<ground::TableBoulder> true_rocks(const std::string& folder) {
  return ground::read_csv(folder + "/truth_rocks.csv");
}

}  // namespace cairn::test
