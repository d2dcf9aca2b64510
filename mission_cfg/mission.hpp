/// What a mission may choose: sizes, rig and parameters, with the paper's rig as the default values.
///
/// `mission_cfg/<mission>/mission_values.hpp` sets `cfg::kMission` from this; `mission_cfg.hpp` derives the
/// capacities that flight code uses and checks everything with static_assert. Metres, radians, pixels.
#pragma once

namespace cairn::cfg {

/// Pixels from (u0, v0) on to before (u1, v1).
struct PixelBox {
  int u0 = 0;
  int v0 = 0;
  int u1 = 0;
  int v1 = 0;
};

struct Mission {
  const char* name = "paper";

  // Rig (METHOD section IV): 66 x 52 degrees, 0.7 m high, 39 degrees down, 0.12 m baseline.
  int image_width_px = 512;  ///< largest image; smaller ones are accepted
  int image_height_px = 384;
  double fx_px = 394.205430737;
  double fy_px = 394.205430737;
  double cx_px = 255.5;
  double cy_px = 191.5;
  double baseline_m = 0.12;
  double camera_height_m = 0.7;
  double camera_pitch_down_rad = 0.68067840827778852;  // 39 degrees
  // The rover itself in the left picture (geometry/own_hardware.hpp): a table that `cairn mask` makes.
  const PixelBox* own_hardware = nullptr;
  int own_hardware_boxes = 0;

  // Capacities.
  int max_features = 600;                ///< per image
  int max_labels = 128;                  ///< segmented regions per frame
  int pixels_per_region = 16;            ///< so many pieces an image may have before they are merged
  int max_map_window_boulders = 4096;    ///< orbital boulders near the rover
  int max_local_boulders = 256;          ///< ground boulders in the sliding window
  int max_wide_map_boulders = 16384;     ///< of the map, where a lost rover is looked for
  int occupancy_bits = 4 * 1024 * 1024;  ///< raster of the same
  int max_map_chunks = 4096;             ///< of one uplinked map (orbital_map/map_transfer.hpp)

  // Budgets of memory; `make check` holds each target's library to them.
  int root_max_bytes = 5 * 1024 * 1024;  ///< all static memory of the flight module
  int code_max_bytes = 352 * 1024;       ///< its code and constants
  int stack_max_bytes = 16 * 1024;       ///< of the deepest chain of calls from any function of it

  // Work of a minor frame (schedule.hpp), operations a pixel of the largest image: what the rows allow. VO
  // and boulders plan by a share of it (mission_cfg.hpp), and do with fewer points where a picture would take
  // more. With these, VO ends within 0.50 s of a RAD750 and boulders within 0.45 s.
  int vo_ops_per_pixel = 211;
  int boulder_ops_per_pixel = 60;

  // Visual odometry.
  int min_disparity_px = 4;  ///< nearer to infinity than this is not triangulated
  int max_disparity_px = 160;
  int search_radius_px = 40;         ///< t to t+1, about the predicted position
  int first_search_radius_px = 120;  ///< where no motion is known yet
  int max_reference_age = 1;         ///< frames that a reference serves; 1 = frame to frame, as in the paper
  double max_step_m = 0.5;           ///< between two frames; beyond it VO is wrong
  double max_step_rad = 0.5;

  // Ground boulders (features/stereo_probe.hpp, labeling/, localizer/boulder_observer.hpp).
  int probe_spacing_px = 5;            ///< grid of disparities
  double boulder_min_height_m = 0.02;  ///< a point lower than this is ground: ripples and gravel reach it
  double boulder_min_top_m = 0.035;    ///< of its highest point, at least: 0.1 m boulders stand some 0.05 m
  double boulder_cut_m = 0.05;         ///< points of one boulder lie closer together than this
  double boulder_max_range_m = 3.0;    ///< farther points are too uncertain and too flat to judge

  // What ground tools that plan drives take for one; flight code takes whatever comes.
  double usual_step_m = 0.06;                   ///< between frames
  double usual_turn_rad = 0.03490658503988659;  ///< 2 degrees, turning in place

  double boulder_min_diameter_m = 0.08;  ///< smaller ones are not in the local map
  int local_map_frames = 60;             ///< sliding window: two intervals between fixes

  // Fusion (localizer/pose_fusion.hpp): what VO may be off. Rendered drives of four scenes gave rates of
  // 0.0001 and 0.00006 to 0.0002 rad a metre with an exact calibration, a car's 0.005 and 0.0002. A mission
  // does not know beforehand that its rig is as good, so these are about the paper's drift: a sigma that is
  // too large costs fixes their weight, one that is too small is believed.
  double drift_scale = 0.02;
  double drift_yaw_rad_per_m = 0.001;  ///< 0.06 degrees
  double max_drift_scale = 0.05;       ///< beyond it a rig would not have been flown
  double max_drift_yaw_rad_per_m = 0.005;
  double drift_noise_xy_m = 0.002;  ///< of one metre; grows with the square root of the way
  double drift_noise_yaw_rad = 0.0004;
  double drift_noise_turn = 0.004;  ///< of one radian turned, as VO's yaw errors of a metre and more
  double fix_common_xy_m = 0.02;    ///< a map's shift, and what the sunlit side of all boulders is off
  double fix_common_yaw_rad = 0.003;
  double fix_common_length_m = 50.0;  ///< over which these become others
  // Frames without VO. Sigmas, of which three are the most that can be; they add up from frame to frame.
  double unseen_step_m = 0.05;     ///< the rover drives some 0.06 m a frame ...
  double unseen_step_rad = 0.05;   ///< ... and turns 0.035 rad on the spot
  double prior_share = 0.1;        ///< of the way and turn that a motion prior tells: slip
  double prior_sigma_rad = 0.001;  ///< of its yaw
  // Beside these, where VO is held against a motion prior (localizer/vo_watch.hpp).
  double watch_sigma_m = 0.004;
  double watch_sigma_rad = 0.004;
  double map_window_radius_m = 8.0;  ///< orbital boulders near the VO position
  double track_log_odds = 6.9;       ///< ln of the odds of a track that a fix has confirmed: 1000 to 1
  int lost_after_fixes = 3;          ///< fixes in a row that speak against the pose (localizer/trust.hpp)
  // A start pose with larger sigmas than these is confirmed by a fix alone: nobody drives by a map on which
  // the rover may lie a metre and a half aside.
  double confirmed_start_xy_m = 0.5;
  double confirmed_start_yaw_rad = 0.1;

  // Registration (registration/icp.hpp). Boulders of a local map lie some 0.3 m apart at the smallest size
  // that both maps hold, and a drive drifts a few centimetres between fixes.
  int icp_max_iterations = 40;            ///< usual: 5 to 15
  double icp_gate_start_m = 0.60;         ///< wider than the drift to be caught ...
  double icp_gate_final_m = 0.25;         ///< ... narrower than the spacing of boulders
  double icp_gate_shrink = 0.80;          ///< per iteration: four to come down
  double icp_trim_fraction = 0.30;        ///< the middle of the paper's 20 to 40 %
  int icp_min_pairs = 4;                  ///< two fix a similarity; as many again to check it
  double icp_min_lever_m = 0.30;          ///< 0.06 m on that is 11 degrees of yaw: nothing to be had below
  double icp_sigma_pair_m = 0.06;         ///< centroid of an orbital blob against that of the ground points
  double icp_max_correction_m = 1.0;      ///< 20 times the paper's drift between fixes
  double icp_max_correction_rad = 0.175;  ///< 10 degrees
  double icp_max_scale_change = 0.10;     ///< five times a bad stereo baseline
  int icp_job_max_bytes = 160 * 1024;
  int pose_search_max_bytes = 320 * 1024;
  int map_fix_max_bytes = 2 * 1024 * 1024;  ///< with the search in the whole map

  // Landmarks (localizer/landmarks.hpp, labeling/relief.hpp), for rigs that see ground enough to match maps
  // of coarse pixels. Who keeps none keeps their memory small.
  double landmark_least_pixel_m = 0.0;  ///< maps of such pixels and coarser are matched by them; 0: no map is
  int max_landmarks = 8;
  double landmark_window_m = 60.0;    ///< of way: how long they are kept
  int relief_side = 8;                ///< cells of the relief's grid: a power of two, 8 to 256
  double relief_cell_m = 0.125;       ///< half a pixel of a map of 25 cm
  double relief_range_m = 12.0;       ///< of points that are laid in it
  double relief_min_height_m = 0.12;  ///< a boulder of 0.6 m and more stands higher, gravel does not

  // Labelling (labeling/clustering.hpp).
  int max_cluster_points = 1024;  ///< 3D points of the boulders of one frame, or boulders of the local map

  // Segmentation (fsw/segmentation): what the parameters mean is told there.
  int segmentation_divisor = 2;  ///< 1: full resolution, 2: half
  int mean_shift_radius_px = 2;  ///< working pixels
  int mean_shift_radius_grey = 16;
  int region_connect_grey = 3;
  int region_merge_grey = 14;
  int min_region_area_px = 48;        ///< full-resolution pixels
  double max_region_fraction = 0.05;  ///< of the image: larger regions are ground or sky
  int min_region_contrast_grey = 14;
};

}  // namespace cairn::cfg
