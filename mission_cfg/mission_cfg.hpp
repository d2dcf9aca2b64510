/// The mission's sizes and parameters as flight code uses them. MISSION=<name> on make's command line chooses
/// the folder that `mission_values.hpp` comes from.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mission_values.hpp"

namespace cairn::cfg {

inline constexpr int kImageWidth = kMission.image_width_px;
inline constexpr int kImageHeight = kMission.image_height_px;
inline constexpr std::size_t kImagePixels = static_cast<std::size_t>(kImageWidth) * kImageHeight;
/// Of the image that is segmented.
inline constexpr std::size_t kWorkingPixels =
    kImagePixels / (kMission.segmentation_divisor * kMission.segmentation_divisor);
inline constexpr std::size_t kMaxFeatures = kMission.max_features;
inline constexpr std::size_t kMaxLabels = kMission.max_labels;
inline constexpr std::size_t kMaxMapWindowBoulders = kMission.max_map_window_boulders;
inline constexpr std::size_t kMaxWideMapBoulders = kMission.max_wide_map_boulders;
inline constexpr std::size_t kOccupancyBits = kMission.occupancy_bits;
inline constexpr std::size_t kMaxLocalBoulders = kMission.max_local_boulders;
inline constexpr std::size_t kMaxMapChunks = kMission.max_map_chunks;
inline constexpr std::size_t kRootMaxBytes = kMission.root_max_bytes;
inline constexpr std::size_t kCodeMaxBytes = kMission.code_max_bytes;
inline constexpr std::size_t kStackMaxBytes = kMission.stack_max_bytes;
inline constexpr std::size_t kIcpJobMaxBytes = kMission.icp_job_max_bytes;
inline constexpr std::size_t kPoseSearchMaxBytes = kMission.pose_search_max_bytes;
inline constexpr std::size_t kMapFixMaxBytes = kMission.map_fix_max_bytes;
inline constexpr std::size_t kMaxClusterPoints = kMission.max_cluster_points;
inline constexpr bool kHaveLandmarks = kMission.landmark_least_pixel_m > 0.0;
inline constexpr std::size_t kMaxLandmarks = kMission.max_landmarks;
inline constexpr std::uint32_t kReliefSide = kMission.relief_side;

inline constexpr std::size_t kMaxProbes =
    static_cast<std::size_t>(kImageWidth / kMission.probe_spacing_px + 1) *
    static_cast<std::size_t>(kImageHeight / kMission.probe_spacing_px + 1);
/// Errors of VO's steps over the sigma that it says, wherever they are weighed. On which drives it was
/// found is not on record.
inline constexpr double kVoSigmaFactor = 1.6;
/// Of a probed disparity: a quarter of a pixel or so (doc/adr/0001-stereo-probes.md).
inline constexpr double kProbeSigma_px = 0.25;

/// What the schedule allows VO and boulders in a minor frame, and what they plan by: VO all, boulders their
/// segmentation and disparities. The rest is for what no plan cuts short.
inline constexpr std::uint32_t kVoOps = kMission.vo_ops_per_pixel * static_cast<std::uint32_t>(kImagePixels);
inline constexpr std::uint32_t kBoulderOps =
    kMission.boulder_ops_per_pixel * static_cast<std::uint32_t>(kImagePixels);
inline constexpr std::uint32_t kVoPlanOps = kVoOps / 6 * 5;
inline constexpr std::uint32_t kProbePlanOps = kBoulderOps / 3 * 2;

// Static memory by part: working images, one number or two a pixel, and what a boulder takes.
inline constexpr std::size_t kVoMaxBytes = 16 * kImagePixels;  ///< 3 MiB at 512 x 384
inline constexpr std::size_t kObserverMaxBytes = 16 * kImagePixels;
inline constexpr std::size_t kSegmentationMaxBytes = 5 * kImagePixels + 3 * kWorkingPixels;
inline constexpr std::size_t kTracksMaxBytes = 256 * kMaxLocalBoulders;
inline constexpr std::size_t kMapWindowMaxBytes = 32 * kMaxMapWindowBoulders;
inline constexpr std::size_t kWideMapMaxBytes = kOccupancyBits / 8 + 20 * kMaxWideMapBoulders;
inline constexpr std::size_t kLandmarksMaxBytes = 160 * kMaxLandmarks + 256;
inline constexpr std::size_t kReliefMaxBytes = std::size_t{24} * kReliefSide * kReliefSide + 16 * 1024;
inline constexpr std::size_t kTransferMaxBytes = 4 * 1024 + kMaxMapChunks / 8;

static_assert(kImageWidth >= 64 && kImageWidth <= 2048 && kImageWidth % 2 == 0,
              "image width: even, 64 to 2048");
static_assert(kImageHeight >= 64 && kImageHeight <= 2048 && kImageHeight % 2 == 0,
              "image height: even, 64 to 2048");
static_assert(kMission.segmentation_divisor == 1 || kMission.segmentation_divisor == 2,
              "segmentation: 1 or 2");
static_assert(kMission.pixels_per_region >= 4, "regions: a number for every 4 pixels at most");
static_assert(kMaxFeatures >= 50 && kMaxFeatures <= 4096, "features: 50 to 4096");
static_assert(kMaxLabels >= 8 && kMaxLabels <= 255, "labels fit a byte, 0 is 'none'");
static_assert(kMission.min_disparity_px >= 1 && kMission.max_disparity_px > kMission.min_disparity_px,
              "disparity range");
static_assert(kMission.probe_spacing_px >= 3 && kMission.probe_spacing_px <= 16, "probes: every 3 to 16 px");
static_assert(kMaxMapWindowBoulders >= 1 && kMaxMapWindowBoulders < 0xFFFF,
              "map boulders are indexed by 16 bits");
static_assert(kMaxWideMapBoulders >= 1 && kMaxWideMapBoulders < 0xFFFF,
              "boulders of the wide map are indexed by 16 bits");
static_assert(kOccupancyBits % 32 == 0 && kOccupancyBits >= 1024 * 1024,
              "the raster: whole words, a megabit and more");
static_assert(kMaxLocalBoulders >= 3 && kMaxLocalBoulders < 0xFFFF, "local boulders are indexed by 16 bits");
static_assert(kMaxLandmarks >= 1 && kMaxLandmarks <= 1024, "landmarks: 1 to 1024");
static_assert(!kHaveLandmarks ||
                  kMission.relief_range_m <= kMission.relief_cell_m * (kMission.relief_side / 2.0),
              "the relief holds what is laid in it");
static_assert(kMaxMapChunks >= 1 && kMaxMapChunks <= 0xFFFF, "chunks are numbered by 16 bits");
static_assert(kMaxClusterPoints >= 1 && kMaxClusterPoints < 0xFFFE, "points are indexed by 16 bits");

}  // namespace cairn::cfg
