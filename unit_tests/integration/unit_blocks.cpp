// Does a unit of work do no more than it asks its budget for? Flight code is compiled so that each basic
// block that is executed is counted (-fsanitize-coverage=trace-pc), and goes over drives a unit at a time: no
// unit may execute more blocks than its weighted operations, and kFree. A loop that does not ask shows,
// however it is written, since each turn of it is a block at least. `--self-test`: one is planted, and seen.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <numeric>

#include "app/unit_bounds.hpp"
#include "core/random.hpp"
#include "integration/replay.hpp"

namespace {
volatile std::uint64_t blocks = 0;  // the compiler believes that counting leaves memory as it is
}
extern "C" __attribute__((no_sanitize_coverage)) void __sanitizer_cov_trace_pc() { blocks = blocks + 1; }

using namespace cairn;
using namespace cairn::test;

namespace {

/// What a unit may do beside its operations: ends, statuses, small matrices.
constexpr std::uint64_t kFree = 1500;

struct Tally {
  cfg::Task task;
  const char* name;
  std::uint64_t units = 0;
  std::uint64_t faults = 0;
  std::uint64_t longest = 0;  ///< operations
  double fullest = 0.0;       ///< blocks of what they may be

  void unit(std::uint64_t ops, std::uint64_t executed) {
    const std::uint64_t may = ops * cfg::kTaskWeight[static_cast<std::size_t>(task)] + kFree;
    ++units;
    longest = std::max(longest, ops);
    fullest = std::max(fullest, static_cast<double>(executed) / static_cast<double>(may));
    if (executed <= may) return;
    if (++faults <= 5)
      std::fprintf(stderr, "%s: a unit of %llu operations executes %llu blocks, %llu at most\n", name,
                   static_cast<unsigned long long>(ops), static_cast<unsigned long long>(executed),
                   static_cast<unsigned long long>(may));
  }
  bool sound() const {
    std::printf("units: %s: %llu, %.2f of the blocks that they may at most; longest %llu operations of %u\n",
                name, static_cast<unsigned long long>(units), fullest,
                static_cast<unsigned long long>(longest), app::longest_unit(task));
    return faults == 0 && longest <= app::longest_unit(task);
  }
};

Tally vo{cfg::Task::kVo, "vo"};
Tally boulders{cfg::Task::kBoulders, "boulders"};
Tally fix_begin{cfg::Task::kFixBegin, "fix begin"};
Tally fixes{cfg::Task::kFix, "fix"};
Tally fix_apply{cfg::Task::kFixApply, "fix apply"};

template <typename Step>
void by_units(Tally& tally, const Step& step) {
  for (Progress progress = Progress::kMore; progress == Progress::kMore;) {
    WorkBudget one(1);
    const std::uint64_t before = blocks;
    progress = step(one);
    tally.unit(one.spent(), blocks - before);
  }
}

Localizer localizer;

void frame_by_units(const Pair& pair) {
  (void)localizer.begin_frame(pair.left.view(), pair.right.view(), nullptr);
  by_units(vo, [](WorkBudget& b) { return localizer.step_vo(b); });
  by_units(boulders, [](WorkBudget& b) { return localizer.step_boulders(b); });
  by_units(fixes, [](WorkBudget& b) { return localizer.step_fix(b); });
}

void fix_by_units() {
  by_units(fix_begin, [](WorkBudget& b) { return localizer.prepare_fix(b); });
  std::uint64_t before = blocks;
  localizer.begin_fix();
  fix_begin.unit(Localizer::kBeginFixOps, blocks - before);
  by_units(fixes, [](WorkBudget& b) { return localizer.step_fix(b); });
  before = blocks;
  localizer.apply_fix();
  fix_apply.unit(Localizer::kApplyFixOps, blocks - before);
}

bool start(const ground::Dataset& data, const OrbitalMap& map) {
  const bool good = localizer.init({}, rig_of(data)) == LocalizerStatus::kReady;
  localizer.set_map(map);
  return good && localizer.set_start(*data.truth_rover(0), 0.02, 0.004) == LocalizerStatus::kReady;
}

/// Texture wherever one looks, so that containers are full: noise of one pixel, or of blocks of some.
void make_noise(Pair& pair, const StereoRig& rig, int block_px, int shift_px, std::uint64_t seed) {
  const auto width = static_cast<std::size_t>(rig.width_px);
  const auto height = static_cast<std::size_t>(rig.height_px);
  for (ground::Image* image : {&pair.left, &pair.right}) {
    const std::size_t disparity = image == &pair.right ? 40 : 0;
    image->width = rig.width_px;
    image->height = rig.height_px;
    image->pixels.resize(width * height);
    for (std::size_t v = 0; v < height; ++v) {
      for (std::size_t u = 0; u < width; ++u) {
        const std::size_t at = (u + disparity + static_cast<std::size_t>(shift_px)) /
                                   static_cast<std::size_t>(block_px) * 7919U +
                               v / static_cast<std::size_t>(block_px) * 104729U;
        Random random(seed + at);
        image->pixels[v * width + u] = static_cast<std::uint8_t>(random.below(256));
      }
    }
  }
}

/// Heights of any kind over the whole map, as many posts to a tile as there may be, so that they are long.
MapStatus make_with_heights(FlightMap& map, const std::vector<ground::TableBoulder>& rocks, double z_m) {
  constexpr double kQuantum_m = 0.001;
  const ground::MapExtent extent = ground::extent_of(rocks);
  const ground::CmapLayout cells = ground::cells_of(extent, kQuantum_m);
  ground::HeightGrid grid{250, 1000, z_m, 0.1, 0.5, 0, 0, {}};
  grid.columns = ground::posts_along(cells.extent_x, grid.spacing);
  grid.rows = ground::posts_along(cells.extent_y, grid.spacing);
  Random random(1);
  for (std::uint32_t i = 0; i < grid.columns * grid.rows; ++i)
    grid.posts.emplace_back(static_cast<std::int32_t>(random.below(200)), true);
  ground::CmapOptions options;
  options.heights = &grid;
  map.bytes = ground::encode_cmap(rocks, extent, kQuantum_m, {}, options);
  return map.validate();
}

std::uint32_t grounds() {
  const auto& heights = localizer.health().heights;
  return std::accumulate(heights.begin(), heights.end(), 0U);
}

int check() {
  static FlightMap map;
  static Pair pair;
  const ground::Dataset data = ground::Dataset::open(kSample);
  if (make_with_heights(map, true_rocks(kSample), data.truth_rover(0)->t.z()) != MapStatus::kUsable) return 1;
  if (!start(data, map.map)) return 1;
  for (std::size_t i = 0; i < 33; ++i) {
    load(data.frames()[i], pair);
    frame_by_units(pair);
    if (i == 30) fix_by_units();
  }
  if (grounds() == 0) {
    std::fprintf(stderr, "no ground was held against the map's heights\n");
    return 1;
  }
  for (const int block_px : {1, 3, 12}) {
    if (!start(data, map.map)) return 1;
    for (int i = 0; i < 3; ++i) {
      make_noise(pair, rig_of(data), block_px, 30 * i, static_cast<std::uint64_t>(block_px));
      frame_by_units(pair);
    }
    fix_by_units();
  }
  bool sound = true;
  for (const Tally* tally : {&vo, &boulders, &fix_begin, &fixes, &fix_apply}) sound = tally->sound() && sound;
  return sound ? 0 : 1;
}

/// Asks for 1000 operations a unit; one unit has a loop that does not ask.
struct PlantedJob {
  int left = 20;
  int planted = 0;
  volatile unsigned sum = 0;

  Progress step(WorkBudget& budget) {
    for (; left > 0; --left) {
      if (!budget.take(1000)) return Progress::kMore;
      const unsigned turns = left == planted ? 20000U : 900U;
      for (unsigned i = 0; i < turns; ++i) sum = sum + i;
    }
    return Progress::kDone;
  }
};

int self_test() {
  Tally sound{cfg::Task::kVo, "a sound job"};
  PlantedJob job;
  by_units(sound, [&](WorkBudget& b) { return job.step(b); });
  Tally seen{cfg::Task::kVo, "as planted"};
  PlantedJob looping;
  looping.planted = 7;
  by_units(seen, [&](WorkBudget& b) { return looping.step(b); });
  const bool passed = sound.faults == 0 && sound.fullest > 0.2 && seen.faults == 1;
  std::printf("units: self-test %s\n", passed ? "passed (1 planted loop seen)" : "FAILED");
  return passed ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  return argc > 1 && std::strcmp(argv[1], "--self-test") == 0 ? self_test() : check();
}
