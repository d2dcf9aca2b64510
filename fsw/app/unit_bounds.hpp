/// The longest units of work: what a slice, however small, is held up by, and how far a row of the schedule
/// may be overspent.
///
/// One table, made of the cost formulas that the jobs themselves ask their budgets by, at the mission's
/// capacities: every container full. Sound over operations: no unit asks for more (test_units holds observed
/// units to it). Whether a unit does no more than it asks for, `make check-units` tells. Of jobs whose
/// parameters decide, with the usual ones.
#pragma once

#include <cstddef>
#include <cstdint>

#include "app/executive.hpp"
#include "core/crc32.hpp"
#include "features/sift_descriptor.hpp"

namespace cairn::app {

struct UnitBound {
  cfg::Task task;
  const char* what;
  std::uint32_t ops;  ///< not weighted
};

namespace unit_bounds {
inline constexpr auto kRaised = static_cast<std::uint32_t>(cfg::kMaxClusterPoints);
inline constexpr std::size_t kLocal = cfg::kMaxLocalBoulders;
inline constexpr int kLabels = static_cast<int>(cfg::kMaxLabels);
inline constexpr std::uint32_t kQuery = BoulderGrid::most_piece_ops();
inline constexpr int kHalfWidth = cfg::kImageWidth / cfg::kMission.segmentation_divisor;
inline constexpr std::uint32_t kMarks =
    WideMap::cells_of_boulder(3.0 * LostSearchParams{}.sigma_pair_m, WideMap::kMinCellM);
}  // namespace unit_bounds

inline constexpr UnitBound kUnitBounds[] = {
    {cfg::Task::kVo, "noise: a row of samples", NoiseJob::kRowOps},
    {cfg::Task::kVo, "features: a row", FeatureExtractor::row_ops(cfg::kImageWidth)},
    {cfg::Task::kVo, "features: the choice", FeatureExtractor::select_ops()},
    {cfg::Task::kVo, "features: a descriptor", kDescriptorOps},
    {cfg::Task::kVo, "matching: one against 95", MatchJob::unit_ops(MatchJob::kUnitTargets, true, true)},
    {cfg::Task::kVo, "ground plane: an iteration", StereoFrameJob::plane_ops(cfg::kMaxFeatures)},
    {cfg::Task::kVo, "alignment of a point", kTemplateOps + kAlignOps},
    {cfg::Task::kVo, "once over all points", kOverPointsOps},
    {cfg::Task::kVo, "motion: a hypothesis", RansacMotionJob::unit_ops(cfg::kMaxFeatures)},
    {cfg::Task::kVo, "motion: refinement, 40 pairs", RefineMotionJob::kMostUnitOps},
    {cfg::Task::kBoulders, "regions: a row", SegmentationJob::row_ops(unit_bounds::kHalfWidth)},
    {cfg::Task::kBoulders, "regions: selection", SegmentationJob::select_ops(unit_bounds::kLabels)},
    {cfg::Task::kBoulders, "filter: words of a row", MeanShiftJob::pack_ops(unit_bounds::kHalfWidth)},
    {cfg::Task::kBoulders, "filter: 8 trajectories", MeanShiftJob::most_run_ops({})},
    {cfg::Task::kBoulders, "regions: merging a row", RegionMergeJob::unit_ops(unit_bounds::kHalfWidth)},
    {cfg::Task::kBoulders, "regions: merging a run", RegionMergeJob::unit_ops(RegionMergeJob::kRun)},
    {cfg::Task::kBoulders, "probes: a band", StereoProbeJob::band_ops(cfg::kImageWidth)},
    {cfg::Task::kBoulders, "probes: a probe", StereoProbeJob::most_probe_ops(StereoProbeJob::most_steps({}))},
    {cfg::Task::kBoulders, "evidence: 384 points",
     RegionEvidenceJob::unit_ops(RegionEvidenceJob::kUnitPoints, RegionEvidenceJob::kMostEach)},
    {cfg::Task::kBoulders, "clusters: laid in strips", ClusteringJob::strips_ops(unit_bounds::kRaised)},
    {cfg::Task::kBoulders, "clusters: one point", ClusteringJob::spread_ops(unit_bounds::kRaised)},
    {cfg::Task::kBoulders, "clusters: numbered", ClusteringJob::number_ops(unit_bounds::kRaised)},
    {cfg::Task::kBoulders, "clusters: begun", BoulderObserver::start_ops(unit_bounds::kRaised)},
    {cfg::Task::kBoulders, "clusters: sorted", BoulderObserver::sort_ops(unit_bounds::kRaised)},
    {cfg::Task::kBoulders, "clusters: one described", BoulderObserver::describe_ops(unit_bounds::kRaised)},
    {cfg::Task::kBoulders, "votes: sightings laid out", BoulderObserver::paint_ops(unit_bounds::kRaised)},
    {cfg::Task::kBoulders, "votes: 128 points", BoulderObserver::kCarryOps},
    {cfg::Task::kBoulders, "votes: a row sifted", VotingJob::sift_ops(unit_bounds::kLabels)},
    {cfg::Task::kBoulders, "votes: an assignment's step", AssignmentCore::unit_ops(unit_bounds::kLabels)},
    {cfg::Task::kBoulders, "points kept", BoulderObserver::keep_ops(unit_bounds::kRaised)},
    {cfg::Task::kBoulders, "tracks: room made",
     BoulderTracks::room_ops(unit_bounds::kLocal, cfg::kMaxLabels)},
    {cfg::Task::kBoulders, "tracks: what votes name",
     BoulderTracks::voted_ops(unit_bounds::kLocal, cfg::kMaxLabels)},
    {cfg::Task::kBoulders, "tracks: the nearest", BoulderTracks::nearest_ops(unit_bounds::kLocal)},
    {cfg::Task::kBoulders, "ground: points placed in the map", GroundHeightJob::kStartOps},
    {cfg::Task::kBoulders, "ground: a row of the map's heights", GroundHeightJob::kRowOps},
    {cfg::Task::kBoulders, "ground: a round of its fit", GroundHeightJob::kRoundOps},
    {cfg::Task::kBoulders, "relief: 32 points laid", Localizer::kLayOps},
    {cfg::Task::kBoulders, "relief: a block's ground", Relief::kPlaneOps},
    {cfg::Task::kBoulders, "relief: a row marked", Relief::mark_ops(cfg::kReliefSide)},
    {cfg::Task::kBoulders, "relief: extents of a boulder", Relief::kExtentOps},
    {cfg::Task::kBoulders, "landmarks: one put among them", Landmarks::take_ops(cfg::kMaxLandmarks)},
    {cfg::Task::kFixBegin, "tracks merged with one", BoulderTracks::settle_ops(unit_bounds::kLocal)},
    {cfg::Task::kFixBegin, "snapshot", Localizer::kBeginFixOps},
    {cfg::Task::kFix, "map: bytes of a CRC", kCrcUnitBytes},
    {cfg::Task::kFix, "map: 32 boulders", MapReader::kChunkOps},
    {cfg::Task::kFix, "search: begun", PoseSearchJob::start_ops(unit_bounds::kLocal)},
    {cfg::Task::kFix, "grid: 256 boulders", BoulderGrid::kChunkOps},
    {cfg::Task::kFix, "grid: cells cleared, or summed", BoulderGrid::cells_ops()},
    {cfg::Task::kFix, "ground: 64 boulders", Ground::kChunkOps},
    {cfg::Task::kFix, "ground: a row of cells", Ground::row_ops()},
    {cfg::Task::kFix, "ground: a boulder's neighbours", Ground::crowd_ops(unit_bounds::kQuery)},
    {cfg::Task::kFix, "search: a local boulder", PoseSearchJob::sight_ops(unit_bounds::kLocal)},
    {cfg::Task::kFix, "search: 64 boulders ranked", PoseSearchJob::rank_ops(PoseSearchJob::kRankUnit)},
    {cfg::Task::kFix, "search: boulders sorted", PoseSearchJob::sort_ops(unit_bounds::kLocal)},
    {cfg::Task::kFix, "search: a pair's first boulders", PoseSearchJob::gather_ops(unit_bounds::kQuery)},
    {cfg::Task::kFix, "search: its second boulders", PoseSearchJob::first_ops(unit_bounds::kQuery)},
    {cfg::Task::kFix, "search: a look", PoseSearchJob::look_ops(unit_bounds::kQuery)},
    {cfg::Task::kFix, "evidence: a boulder", EvidenceJob::look_ops(unit_bounds::kQuery)},
    {cfg::Task::kFix, "evidence: 120 of a sum", EvidenceJob::share_ops(EvidenceJob::kUnitSightings)},
    {cfg::Task::kFix, "whole map: words cleared", WideMap::kWordsPerUnit * 2},
    {cfg::Task::kFix, "whole map: 64 boulders placed", WideMap::kBouldersPerUnit* WideMap::kPlaceOps},
    {cfg::Task::kFix, "whole map: 24 boulders marked",
     WideMap::kMarksPerUnit* WideMap::mark_ops(unit_bounds::kMarks)},
    {cfg::Task::kFix, "whole map: shares of 3 blocks", WideMap::kBlocksPerUnit* WideMap::block_ops()},
    {cfg::Task::kFix, "lost: begun", LostSearch::start_ops(unit_bounds::kLocal)},
    {cfg::Task::kFix, "lost: pairs of a boulder", LostSearch::choose_ops(unit_bounds::kLocal)},
    {cfg::Task::kFix, "lost: a pair", LostSearch::sort_ops(unit_bounds::kLocal)},
    {cfg::Task::kFix, "lost: boulders of a ring", LostSearch::most_sweep_ops()},
    {cfg::Task::kFix, "lost: a hypothesis",
     LostSearch::kLookOps + LostSearch::looks_ops(unit_bounds::kLocal)},
    {cfg::Task::kFix, "lost: fit of a boulder", LostSearch::fit_ops(LostSearch::kMostAbout)},
    {cfg::Task::kFixApply, "correction", Localizer::kApplyFixOps},
};

/// Of a task.
constexpr std::uint32_t longest_unit(cfg::Task task) {
  std::uint32_t longest = 0;
  for (const UnitBound& bound : kUnitBounds) {
    if (bound.task == task && bound.ops > longest) longest = bound.ops;
  }
  return longest;
}

/// Of all tasks, weighted.
constexpr std::uint32_t longest_weighted_unit() {
  std::uint32_t longest = 0;
  for (const UnitBound& bound : kUnitBounds) {
    const std::uint32_t ops = bound.ops * cfg::kTaskWeight[static_cast<std::size_t>(bound.task)];
    if (ops > longest) longest = ops;
  }
  return longest;
}

}  // namespace cairn::app
