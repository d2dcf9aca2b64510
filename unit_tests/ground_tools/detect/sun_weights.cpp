// Fits the network that tells by an image where its sun stands (detect/sun_evidence.hpp) to all fits of
// rendered fields (shadow_fields.hpp) under their sun and under others. Not a test: `make sun-weights`.
//
//   sun_weights FOLDER SOURCE
//
// Renders what is not in FOLDER yet, fits, and prints of fields that were not fitted to by how much more
// speaks for their sun than for the opposite one; turned round, it is the same with the other sign. Writes
// the network as source to FOLDER/sun_weights.cpp; 1 where SOURCE, today's, holds other numbers. Features
// are scaled as kShadowModel has it: after `make shadow-weights` this is made anew.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

#include "base/parallel.hpp"
#include "base/progress_line.hpp"
#include "base/tool_error.hpp"
#include "detect/sun_evidence.hpp"
#include "ground_tools/detect/drawn_gullies.hpp"
#include "ground_tools/detect/network_fit.hpp"
#include "ground_tools/detect/shadow_fields.hpp"

using namespace cairn;
using namespace cairn::ground;
using test::FieldKind;

namespace {

using Set = std::vector<test::Example<1>>;  ///< 1: the sun is told right

struct Seeds {
  FieldKind kind;
  std::uint64_t first, count;
};
constexpr Seeds kFit[] = {{FieldKind::kCratered, 1000, 48}, {FieldKind::kCoarse, 2000, 10},
                          {FieldKind::kSaturated, 3000, 5}, {FieldKind::kFresh, 6000, 26},
                          {FieldKind::kNear, 4000, 2},      {FieldKind::kFar, 5000, 3},
                          {FieldKind::kEmpty, 9000, 6},     {FieldKind::kGullied, 10000, 40}};
constexpr Seeds kHeldOut[] = {{FieldKind::kCratered, 1500, 8},  {FieldKind::kCoarse, 2500, 4},
                              {FieldKind::kSaturated, 3500, 2}, {FieldKind::kFresh, 6500, 4},
                              {FieldKind::kNear, 4500, 1},      {FieldKind::kFar, 5500, 2},
                              {FieldKind::kEmpty, 9008, 2},     {FieldKind::kGullied, 10500, 24}};

GreyTile tile_of(const test::Raster& raster) {
  return {{0, 0, raster.width, raster.height}, raster.grey_view(), raster.valid_view()};
}

Sun turned(Sun sun, double by_deg) {
  sun.azimuth_rad += by_deg * kRadPerDeg;
  return sun;
}

/// At most some thousand, from all over the image.
void add_fits(const test::Raster& raster, const Sun& sun, bool right, Set& set) {
  constexpr std::size_t kMost = 1000;
  ShadowParams params;
  params.min_confidence = 0.0;
  std::vector<ShadowFeatures> fits;
  const GreyTile tile = tile_of(raster);
  shadow_candidates(tile, tile.rect, shadow_view(sun, raster.geo), params, &fits);
  const std::size_t step = std::max<std::size_t>(1, fits.size() / kMost);
  for (std::size_t i = 0; i < fits.size(); i += step)
    set.push_back({scaled(fits[i], kShadowModel), {right ? 1.0 : 0.0}});
}

test::RenderedField field_of(FieldKind kind, std::uint64_t seed, const std::filesystem::path& folder) {
  return kind == FieldKind::kGullied ? test::DrawnGullies(seed).rendered()
                                     : test::render(test::shadow_field(kind, seed), folder);
}

/// Under its sun, told right and up to 16 degrees off, as labels are; under the opposite one, and another.
Set examples_of(const test::RenderedField& field, std::uint64_t seed) {
  constexpr double kMostOff_deg = 16.0;
  constexpr double kLeastWrong_deg = 60.0;
  const test::Raster& raster = field.images.back();
  const Sun& sun = field.suns.back();
  sim::Draw draw(seed, sim::Stream::kCampaign, 2);
  Set set;
  add_fits(raster, sun, true, set);
  add_fits(raster, turned(sun, draw.uniform(-kMostOff_deg, kMostOff_deg)), true, set);
  add_fits(raster, turned(sun, 180.0), false, set);
  add_fits(raster, turned(sun, draw.uniform(kLeastWrong_deg, 360.0 - kLeastWrong_deg)), false, set);
  return set;
}

/// Calls `take` with each field, in parallel, its place among all, and its seed.
template <std::size_t kCount, class Take>
void for_each_field(const Seeds (&seeds)[kCount], const std::filesystem::path& folder, const Take& take) {
  std::size_t place = 0;
  for (const Seeds& of : seeds) {
    const char* kind = test::kFieldKinds[static_cast<int>(of.kind)];
    ProgressLine progress(fmt::format("{} fields", kind));
    std::mutex guard;
    std::uint64_t done = 0;
    sim::parallel_for(of.count, [&](std::size_t i) {
      take(field_of(of.kind, of.first + i, folder), place + i, fmt::format("{} {}", kind, of.first + i),
           of.first + i);
      const std::lock_guard lock(guard);
      progress.show(static_cast<double>(++done) / static_cast<double>(of.count));
    });
    place += of.count;
  }
}

template <std::size_t kCount>
std::size_t fields_in(const Seeds (&seeds)[kCount]) {
  std::size_t count = 0;
  for (const Seeds& of : seeds) count += of.count;
  return count;
}

ShadowNetwork<1> fitted_network(const std::filesystem::path& folder) {
  constexpr int kEpochs = 10;
  std::vector<Set> sets(fields_in(kFit));
  for_each_field(kFit, folder,
                 [&](const test::RenderedField& field, std::size_t place, const std::string&,
                     std::uint64_t seed) { sets[place] = examples_of(field, seed); });
  Set all;
  for (const Set& set : sets) all.insert(all.end(), set.begin(), set.end());
  fmt::print("{} fits of {} fields\n", all.size(), sets.size());
  return test::fitted(all, kEpochs,
                      [](double z, double wanted) { return 1.0 / (1.0 + std::exp(-z)) - wanted; });
}

void judge(const std::filesystem::path& folder, const ShadowNetwork<1>& network) {
  std::vector<std::string> lines(fields_in(kHeldOut));
  for_each_field(
      kHeldOut, folder,
      [&](const test::RenderedField& field, std::size_t place, const std::string& name, std::uint64_t) {
        const GreyTile tile = tile_of(field.images.back());
        const auto evidence = [&](double by_deg) {
          SunEvidence sum;
          add_evidence(tile, shadow_view(turned(field.suns.back(), by_deg), field.images.back().geo), sum,
                       network);
          return sum;
        };
        const SunEvidence right = evidence(0.0);
        const SunMargin over = margin(right, evidence(180.0));
        const SunMargin across =
            std::min(margin(right, evidence(90.0)), margin(right, evidence(270.0)),
                     [](const SunMargin& a, const SunMargin& b) { return a.each < b.each; });
        lines[place] = fmt::format("{:<16} {:6} {:+9.2f} {:+8.1f} {:+9.2f} {:+8.1f}", name, right.fits,
                                   over.each, over.together, across.each, across.together);
      });
  fmt::print(
      "\nnot fitted to        fits  over the opposite   over those across\n"
      "                              each together       each together\n");
  for (const std::string& line : lines) fmt::print("{}\n", line);
}

std::string source_of(const ShadowNetwork<1>& network) {
  return fmt::format(
      "// Made by `make sun-weights`, which prints it again: see sun_evidence.hpp. Not to be edited.\n"
      "#include \"detect/sun_evidence.hpp\"\n\nnamespace cairn::ground {{\n\n// clang-format off\n"
      "const ShadowNetwork<1> kSunNetwork = {};\n"
      "// clang-format on\n\n}}  // namespace cairn::ground\n",
      test::text_of(network));
}

int run(int argc, char** argv) {
  if (argc != 3) throw ToolError("usage: sun_weights FOLDER SOURCE");
  const std::filesystem::path folder = argv[1];
  const ShadowNetwork<1> network = fitted_network(folder);
  judge(folder, network);
  const std::string source = source_of(network);
  return test::is_source(source, folder / "sun_weights.cpp", argv[2]) ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const ToolError& error) {
    fmt::print(stderr, "sun_weights: {}\n", error.what());
    return 1;
  }
}
