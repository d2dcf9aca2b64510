#include "detect/map_build.hpp"

#include <sched.h>

#include <algorithm>

#include "base/tool_error.hpp"
#include "detect/partial_state.hpp"
#include "detect/tile_team.hpp"
#include "ortho/grey_range.hpp"

namespace cairn::ground {
namespace {

int threads_to_use(int asked, const MpiRanks& ranks) {
  if (asked > 0) return asked;
  cpu_set_t mine;
  const int cores = ::sched_getaffinity(0, sizeof mine, &mine) == 0 ? CPU_COUNT(&mine) : 1;
  return std::max(1, cores / ranks.on_this_machine());
}

/// All that a record depends on.
std::string text_of(const RasterFacts& facts, const Detection& detection, const TileGrid& grid) {
  std::string geo;
  for (const double c : facts.geo.c) geo += fmt::format(" {}", c);
  return fmt::format("records 2\nsize {} {} depth {} geo{}\ntiles {} {}\n{}\n{}", facts.width, facts.height,
                     static_cast<int>(facts.depth), geo, grid.tile_width, grid.tile_height,
                     to_text(detection), facts.identity);
}

void check_settings(const BuildSettings& settings) {
  if (settings.tile_px != 0) check_range("--tile", settings.tile_px, kLeastTilePx, kMostTilePx);
  if (settings.threads != 0) check_range("--threads", settings.threads, 1, kMostThreads);
}

}  // namespace

struct MapBuild::Inside {
  Inside(const RasterSource& source, const Detection& detection, BuildSettings asked, const MpiRanks& ranks)
      : settings(std::move(asked)),
        job{source, detection, tiles_of(source.facts(), detection, settings.tile_px)},
        team(job, threads_to_use(settings.threads, ranks), ranks),
        state(source.facts().box().pixels() >= settings.state_from_px ? settings.state
                                                                      : std::filesystem::path(),
              text_of(source.facts(), job.detection, job.grid)) {}

  const RasterFacts& facts() const { return job.source.facts(); }
  void tell_state() const;
  void round(const RoundInput& input, double from, double to, const TakeRecord& add);
  GreyRange find_range(double to);
  BlockDarkness find_darkness(RoundInput input, double from, double to);
  std::vector<TableBoulder> gather();

  BuildSettings settings;
  TileJob job;
  TileTeam team;
  PartialState state;
  std::vector<TableBoulder> craters;
};

/// All tiles of a round: those of an earlier run from the state, the others from the team.
void MapBuild::Inside::round(const RoundInput& input, double from, double to, const TakeRecord& add) {
  const auto name = static_cast<std::uint8_t>(input.round);
  // The last round's records are gathered from the state; of the others, what they add up to is enough.
  const bool last = input.round == Round::kBoulders;
  std::vector<std::uint32_t> todo;
  for (std::uint32_t tile = 0; tile < job.grid.size(); ++tile) {
    if (!state.has(name, tile)) {
      todo.push_back(tile);
    } else if (!last) {
      add(tile, state.get(name, tile));
    }
  }
  std::size_t done = job.grid.size() - todo.size();
  const auto tell = [&] {
    const double share = static_cast<double>(done) / static_cast<double>(job.grid.size());
    if (settings.done) settings.done(from + (to - from) * share);
    return share;
  };
  tell();
  const auto take = [&](std::uint32_t tile, Bytes&& record) {
    if (last || !state.in_memory()) state.add(name, tile, record);
    if (!last) add(tile, std::move(record));
    ++done;
    tell();
  };
  if (todo.empty() || team.run(input, todo, take, settings.stop)) return;
  if (state.in_memory()) throw ToolError("{}: stopped; nothing was written", facts().name);
  throw ToolError("{}: stopped with {:.0f} % done; run the same command again to resume from {}",
                  facts().name, 100.0 * (from + (to - from) * tell()), state.path().string());
}

void MapBuild::Inside::tell_state() const {
  if (!settings.say) return;
  const std::string name = state.path().string();
  if (state.found() == PartialState::Found::kOtherBuild)
    settings.say(fmt::format("{}: is from another input or other parameters; starting over", name));
  if (state.found() == PartialState::Found::kSameBuild)
    settings.say(fmt::format("{}: resuming with {} finished tiles", name, state.records()));
}

GreyRange MapBuild::Inside::find_range(double to) {
  GreyRangeSearch search(facts().depth);
  RoundInput input;
  input.round = Round::kValues;
  const bool twice = search.needs_lower_halves();
  round(input, 0.0, twice ? 0.5 * to : to, [&](std::uint32_t, Bytes&& record) { search.add_values(record); });
  search.finish_values(facts().name);
  if (settings.say && !search.left_out().empty()) {
    settings.say(fmt::format(
        "cairn: warning: {}: {} lie far from all others, where no brightness is, and are black or white; if they "
        "hold no data, give --no-data",
        facts().name, search.left_out()));
  }
  if (twice) {
    input.round = Round::kLowerHalves;
    input.bins = search.bins();
    round(input, 0.5 * to, to, [&](std::uint32_t, Bytes&& record) { search.add_lower_halves(record); });
  }
  return search.finish(facts().name);
}

/// Tile by tile in their order: what lies within one, and what several share.
std::vector<TableBoulder> MapBuild::Inside::gather() {
  TileJoiner joiner;
  GreyContent content;
  std::vector<FoundBoulder> found;
  for (std::uint32_t tile = 0; tile < job.grid.size(); ++tile) {
    const TileBoulders here = tile_boulders(state.get(static_cast<std::uint8_t>(Round::kBoulders), tile));
    found.insert(found.end(), here.found.begin(), here.found.end());
    joiner.add(here.shared, job.grid.starts_row(tile));
    content.add(here.content);
  }
  if (job.detection.method == cmap::Method::kShadow) content.check(facts().name);
  const std::vector<FoundBoulder> joined = boulders_of(joiner.finish(), job.detection.otsu, facts().geo);
  found.insert(found.end(), joined.begin(), joined.end());
  // Of one pixel, those of one tile keep their order.
  std::stable_sort(found.begin(), found.end(), [](const FoundBoulder& a, const FoundBoulder& b) {
    return a.y != b.y ? a.y < b.y : a.x < b.x;
  });
  std::vector<TableBoulder> boulders;
  boulders.reserve(found.size());
  craters.clear();
  for (const FoundBoulder& each : found) (each.crater ? craters : boulders).push_back(each.boulder);
  return boulders;
}

MapBuild::MapBuild(const RasterSource& source, const Detection& detection, BuildSettings settings,
                   const MpiRanks& ranks) {
  check(detection);
  check_settings(settings);
  inside_ = std::make_unique<Inside>(source, detection, std::move(settings), ranks);
}

MapBuild::~MapBuild() = default;

/// The thresholds of the paper's detector.
BlockDarkness MapBuild::Inside::find_darkness(RoundInput input, double from, double to) {
  const DetectorParams& params = job.detection.otsu;
  const DetectorPixels pixels = on_pixels(params, facts().geo.pixel_m());
  BlockStatistics statistics(BlockGrid(facts().width, facts().height, pixels.block));
  input.round = Round::kStatistics;
  round(input, from, to, [&](std::uint32_t, Bytes&& record) { statistics.add(record); });
  return statistics.finish({params.threshold_scale, params.noise_sigmas}, facts().name);
}

std::vector<TableBoulder> MapBuild::run() {
  Inside& in = *inside_;
  in.tell_state();
  try {
    // Shares of the time, as measured.
    const bool stretched = in.facts().depth != PixelDepth::kEight;
    const bool otsu = in.job.detection.method == cmap::Method::kOtsu;
    const double begun = !stretched ? 0.0 : otsu ? 0.2 : 0.02;
    const double middle = otsu ? begun + 0.45 * (1.0 - begun) : begun;
    RoundInput input;
    if (stretched) input.range = in.find_range(begun);
    if (otsu) input.darkness = in.find_darkness(input, begun, middle);
    input.round = Round::kBoulders;
    in.round(input, middle, 1.0, {});
    return in.gather();
  } catch (const BadImage&) {
    in.state.remove();  // nothing to go on with
    throw;
  }
}

const std::vector<TableBoulder>& MapBuild::craters() const { return inside_->craters; }

void MapBuild::finished() { inside_->state.remove(); }

void MapBuild::follow(const std::function<TileInput()>& open, const BuildSettings& settings,
                      const MpiRanks& ranks) {
  follow_tile_team(open, threads_to_use(settings.threads, ranks), ranks);
}

}  // namespace cairn::ground
