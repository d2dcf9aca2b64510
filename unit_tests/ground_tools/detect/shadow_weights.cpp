// Fits the model of the shadow detector's confidence, places and sizes (detect/shadow_confidence.hpp) to
// all fits of rendered fields (shadow_fields.hpp) whose rocks are known. Not a test: `make shadow-weights`.
//
//   shadow_weights FOLDER SOURCE
//
// Renders what is not in FOLDER yet, fits, and prints what the new model and today's are worth on the fields
// fitted to and on others: log loss and Brier score (less is better), how often a boulder stood where so
// much confidence was claimed, and how far entries lie towards the sun and differ in size. Writes the model
// as source to FOLDER/shadow_weights.cpp; 1 where SOURCE, today's, holds other numbers. Seeds: below. No
// seed here is one of bench_detect.cpp.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <mutex>
#include <numeric>
#include <string>
#include <vector>

#include "base/parallel.hpp"
#include "base/progress_line.hpp"
#include "base/tool_error.hpp"
#include "detect/shadow_detector.hpp"
#include "ground_tools/detect/drawn_gullies.hpp"
#include "ground_tools/detect/network_fit.hpp"
#include "ground_tools/detect/shadow_fields.hpp"

using namespace cairn;
using namespace cairn::ground;
using test::Example;
using test::fitted;
using test::rounded;
using test::text_of;

namespace {

using Set = std::vector<Example<1>>;  ///< 1: a boulder
using Bodies = std::vector<Example<2>>;

/// The fits of one image, and the rocks that are there.
struct Image {
  ShadowView view;
  GeoTransform geo;
  int width, height;
  std::vector<TableBoulder> rocks;
  std::vector<ShadowCandidate> fits;
  std::vector<ShadowFeatures> features;  ///< by ShadowCandidate::fit
};

Image image_of(const test::Raster& raster, const Sun& sun, const std::vector<TableBoulder>& rocks) {
  Image image{shadow_view(sun, raster.geo), raster.geo, raster.width, raster.height, rocks, {}, {}};
  ShadowParams params;
  params.min_confidence = 0.0;
  const PixelRect all{0, 0, raster.width, raster.height};
  image.fits = shadow_candidates({all, raster.grey_view(), raster.valid_view()}, all, image.view, params,
                                 &image.features)
                   .boulders;
  return image;
}

double outline_px(const ShadowCandidate& c) { return 2.0 * std::sqrt(c.across_px * c.along_px); }

/// Where the boulder stands, in the map.
Vec2 place_of(const ShadowCandidate& c, const Image& image) {
  const Vec2 p = Vec2(c.u_px, c.v_px) - c.towards_sun_px * image.view.towards_sun_px;
  return image.geo.to_map(p.x(), p.y());
}

/// What an entry of a map is asked.
bool is_boulder(const ShadowCandidate& c, const Image& image) {
  const double pixel_m = image.view.pixel_m;
  return test::is_boulder(place_of(c, image), c.diameter_px * pixel_m, pixel_m, image.rocks);
}

/// Large enough for a map, and off the rim.
bool in_range(const ShadowCandidate& c, const Image& image) {
  const ShadowParams params;
  const double rim_px = std::min({c.u_px, c.v_px, image.width - c.u_px, image.height - c.v_px});
  return c.diameter_px >= std::max(params.min_diameter_px, params.min_diameter_m / image.view.pixel_m) &&
         rim_px >= 2.0 * c.diameter_px;
}

struct Seeds {
  test::FieldKind kind;
  std::uint64_t first, count;
};
using test::FieldKind;
constexpr Seeds kFit[] = {
    {FieldKind::kCratered, 1000, 96},  {FieldKind::kCratered, 1200, 48}, {FieldKind::kCoarse, 2000, 40},
    {FieldKind::kSaturated, 3000, 12}, {FieldKind::kFresh, 6000, 32},    {FieldKind::kFresh, 6100, 16},
    {FieldKind::kNear, 4000, 5},       {FieldKind::kFar, 5000, 6},       {FieldKind::kEmpty, 9000, 8},
    {FieldKind::kEmpty, 9100, 16},     {FieldKind::kGullied, 10000, 40}};
constexpr Seeds kCalibrate[] = {{FieldKind::kCratered, 1096, 24},
                                {FieldKind::kFresh, 6032, 8},
                                {FieldKind::kEmpty, 9008, 2},
                                {FieldKind::kGullied, 10040, 4}};
constexpr Seeds kHeldOut[] = {{FieldKind::kCratered, 1500, 8},  {FieldKind::kCoarse, 2500, 6},
                              {FieldKind::kSaturated, 3500, 3}, {FieldKind::kFresh, 6500, 4},
                              {FieldKind::kNear, 4500, 2},      {FieldKind::kFar, 5500, 2},
                              {FieldKind::kGullied, 10500, 6}};

/// Each field twice: as it is, and with the sun told up to 16 degrees wrong, as labels are, and slopes.
std::vector<Image> images_of(test::FieldKind kind, std::uint64_t seed, const std::filesystem::path& folder) {
  constexpr double kMostWrong_rad = 16.0 * kRadPerDeg;
  const test::RenderedField field = kind == FieldKind::kGullied
                                        ? test::DrawnGullies(seed).rendered()
                                        : test::render(test::shadow_field(kind, seed), folder);
  std::vector<Image> images;
  for (std::size_t i = 0; i < field.images.size(); ++i) {
    Sun sun = field.suns[i];
    images.push_back(image_of(field.images[i], sun, field.rocks));
    sun.azimuth_rad += kMostWrong_rad * (2.0 * sim::uniform(seed, sim::Stream::kCampaign) - 1.0);
    images.push_back(image_of(field.images[i], sun, field.rocks));
  }
  return images;
}

template <std::size_t kCount>
std::vector<Image> gathered(const Seeds (&seeds)[kCount], const std::filesystem::path& folder) {
  std::vector<Image> all;
  for (const Seeds& of : seeds) {
    const char* kind = test::kFieldKinds[static_cast<int>(of.kind)];
    std::vector<std::vector<Image>> fields(of.count);
    {
      ProgressLine progress(fmt::format("{} fields", kind));
      std::mutex guard;
      std::uint64_t done = 0;
      sim::parallel_for(of.count, [&](std::size_t i) {
        fields[i] = images_of(of.kind, of.first + i, folder);
        const std::lock_guard lock(guard);
        progress.show(static_cast<double>(++done) / static_cast<double>(of.count));
      });
    }
    std::size_t fits = 0;
    for (std::vector<Image>& field : fields) {
      for (Image& image : field) {
        fits += image.fits.size();
        all.push_back(std::move(image));
      }
    }
    fmt::print("{} {} to {}: {} fits\n", kind, of.first, of.first + of.count - 1, fits);
    std::fflush(stdout);
  }
  return all;
}

/// Each fit's place, diameter and confidence by this model.
void rate(const ShadowModel& model, std::vector<Image>& images) {
  for (Image& image : images) {
    for (ShadowCandidate& c : image.fits) {
      const ShadowBody body = shadow_body(image.features[c.fit], 0.5 * outline_px(c), model);
      c.towards_sun_px = body.towards_sun * 0.5 * outline_px(c);
      c.diameter_px = body.size * outline_px(c);
      c.confidence = shadow_confidence(image.features[c.fit], model);
    }
  }
}

void add(const ShadowCandidate& c, const Image& image, const ShadowModel& model, Set& set) {
  if (in_range(c, image))
    set.push_back({scaled(image.features[c.fit], model), {is_boulder(c, image) ? 1.0 : 0.0}});
}

Set fits(const std::vector<Image>& images, const ShadowModel& model) {
  Set set;
  for (const Image& image : images)
    for (const ShadowCandidate& c : image.fits) add(c, image, model, set);
  return set;
}

/// What a map would hold, at whatever confidence.
Set entries(const std::vector<Image>& images, const ShadowModel& model) {
  Set set;
  for (const Image& image : images)
    for (const ShadowCandidate& c : strongest(image.fits, image.view, {})) add(c, image, model, set);
  return set;
}

/// What brings the features to a common scale.
void standardise(const std::vector<Image>& images, ShadowModel& model) {
  ShadowFeatures sum{}, square{};
  double n = 0.0;
  const auto each = [&](const auto& visit) {
    for (const Image& image : images)
      for (const ShadowCandidate& c : image.fits)
        for (std::size_t i = 0; i < kShadowFeatures; ++i) visit(i, image.features[c.fit][i]);
  };
  for (const Image& image : images) n += static_cast<double>(image.fits.size());
  each([&](std::size_t i, double f) { sum[i] += f; });
  for (std::size_t i = 0; i < kShadowFeatures; ++i) model.middle[i] = rounded(sum[i] / n);
  each([&](std::size_t i, double f) { square[i] += (f - model.middle[i]) * (f - model.middle[i]); });
  for (std::size_t i = 0; i < kShadowFeatures; ++i)
    model.spread[i] = rounded(std::sqrt(square[i] / n) + 1e-6);
}

/// The largest rock at the place of a fit; null: there is none.
const TableBoulder* rock_at(const ShadowCandidate& c, const Image& image) {
  const Vec2 p = image.geo.to_map(c.u_px, c.v_px);
  const TableBoulder* largest = nullptr;
  for (const TableBoulder& rock : image.rocks)
    if (test::is_at(p, rock, image.view.pixel_m) &&
        (largest == nullptr || rock.diameter_m > largest->diameter_m))
      largest = &rock;
  return largest;
}

/// How far the outline's middle lies towards the sun from the rock.
double towards_sun_px(const ShadowCandidate& c, const TableBoulder& rock, const Image& image) {
  // Metres of the map to pixels: north is up, so v falls as y grows.
  const Vec2 off = (image.geo.to_map(c.u_px, c.v_px) - rock.p_map_m) / image.view.pixel_m;
  return Vec2(off.x(), -off.y()).dot(image.view.towards_sun_px);
}

/// The narrow fits at a rock, and how it lies against the outline.
Bodies bodies(const std::vector<Image>& images, const ShadowModel& model) {
  constexpr double kMostLogSize = 1.0;  // what is further from a fit's size is not what was fitted
  Bodies set;
  for (const Image& image : images) {
    for (const ShadowCandidate& c : image.fits) {
      if (outline_px(c) >= 2.0 * kTrueOutline_px) continue;
      const TableBoulder* rock = rock_at(c, image);
      if (rock == nullptr) continue;
      const double pixel_m = image.view.pixel_m;
      const double log_size = std::log(rock->diameter_m / (outline_px(c) * pixel_m));
      if (std::fabs(log_size) > kMostLogSize) continue;
      const double towards_px = towards_sun_px(c, *rock, image);
      set.push_back({scaled(image.features[c.fit], model), {2.0 * towards_px / outline_px(c), log_size}});
    }
  }
  return set;
}

/// Least squares, but what lies far off is no more than that: it may be of another rock.
void fit_body(const std::vector<Image>& images, ShadowModel& model) {
  constexpr int kEpochs = 20;
  constexpr double kMostOff = 0.25;
  model.body = fitted(bodies(images, model), kEpochs,
                      [=](double z, double wanted) { return std::clamp(z - wanted, -kMostOff, kMostOff); });
}

/// The log loss.
void fit_boulder(const std::vector<Image>& images, ShadowModel& model) {
  constexpr int kEpochs = 40;
  model.boulder = fitted(fits(images, model), kEpochs,
                         [](double z, double wanted) { return 1.0 / (1.0 + std::exp(-z)) - wanted; });
}

double logit_of(const Example<1>& e, const ShadowModel& model) {
  return outputs(hidden_layer(e.x, model.boulder.hidden), model.boulder)[0];
}

/// z' = z times `slope` + `shift`: so that of what a map holds at a confidence so many are boulders.
void calibrate(const Set& set, ShadowModel& model) {
  double slope = 1.0;
  double shift = 0.0;
  std::vector<double> z(set.size());
  std::transform(set.begin(), set.end(), z.begin(), [&](const Example<1>& e) { return logit_of(e, model); });
  for (int iteration = 0; iteration < 30; ++iteration) {
    double g0 = 0.0, g1 = 0.0, h00 = 0.0, h01 = 0.0, h11 = 0.0;
    for (std::size_t i = 0; i < set.size(); ++i) {
      const double p = 1.0 / (1.0 + std::exp(-(slope * z[i] + shift)));
      const double off = p - set[i].wanted[0];
      const double w = p * (1.0 - p);
      g0 += off;
      g1 += off * z[i];
      h00 += w;
      h01 += w * z[i];
      h11 += w * z[i] * z[i];
    }
    const double determinant = h00 * h11 - h01 * h01;
    shift -= (h11 * g0 - h01 * g1) / determinant;
    slope -= (h00 * g1 - h01 * g0) / determinant;
  }
  fmt::print("calibrated by {} entries: z times {:.3f} {:+.3f}\n", set.size(), slope, shift);
  for (double& v : model.boulder.out[0]) v = rounded(slope * v);
  model.boulder.out_0[0] = rounded(slope * model.boulder.out_0[0] + shift);
}

void judge(const std::string& what, const Set& set, const ShadowModel& model) {
  struct Bin {
    int count = 0;
    double claimed = 0.0, seen = 0.0;
  };
  std::array<Bin, 10> bins;
  double loss = 0.0;
  double brier = 0.0;
  for (const Example<1>& e : set) {
    const double p = 1.0 / (1.0 + std::exp(-logit_of(e, model)));
    const double y = e.wanted[0];
    loss -= std::log(std::max(1e-12, y == 1.0 ? p : 1.0 - p));
    brier += (p - y) * (p - y);
    Bin& bin = bins[std::min<std::size_t>(9, static_cast<std::size_t>(10.0 * p))];
    ++bin.count;
    bin.claimed += p;
    bin.seen += y;
  }
  const auto n = static_cast<double>(set.size());
  fmt::print("\n{}: {} fits, log loss {:.4f}, Brier score {:.4f}\n  claimed   seen  fits\n", what, set.size(),
             loss / n, brier / n);
  for (const Bin& b : bins) {
    if (b.count > 0) fmt::print("   {:.3f}   {:.3f}  {}\n", b.claimed / b.count, b.seen / b.count, b.count);
  }
}

/// How far entries of few pixels lie towards the sun of their rock, as outlines and as the model has them,
/// and how the logarithm of their size is off.
void judge_bodies(const std::string& what, const std::vector<Image>& images) {
  constexpr double kMostOutline_px = 6.0;
  double n = 0.0;
  Vec3 sum = Vec3::Zero(), square = Vec3::Zero();
  for (const Image& image : images) {
    const double pixel_m = image.view.pixel_m;
    for (const ShadowCandidate& c : strongest(image.fits, image.view, {})) {
      const TableBoulder* rock = rock_at(c, image);
      if (rock == nullptr || !in_range(c, image) || c.confidence < 0.5 || outline_px(c) > kMostOutline_px)
        continue;
      const double towards_px = towards_sun_px(c, *rock, image);
      const Vec3 e(towards_px, towards_px - c.towards_sun_px,
                   std::log(c.diameter_px * pixel_m / rock->diameter_m));
      n += 1.0;
      sum += e;
      square += e.cwiseAbs2();
    }
  }
  const Vec3 mean = sum / n;
  const Vec3 rms = (square / n).cwiseSqrt();
  fmt::print(
      "{}: {:.0f} entries, towards the sun {:.2f} px, rms {:.2f}, of the outline; {:.2f}, {:.2f} of the "
      "boulder; log of the size {:.3f}, rms {:.3f}\n",
      what, n, mean[0], rms[0], mean[1], rms[1], mean[2], rms[2]);
}

std::string source_of(const ShadowModel& model) {
  return fmt::format(
      "// Made by `make shadow-weights`, which prints it again: see shadow_confidence.hpp. Not to be edited.\n"
      "#include \"detect/shadow_confidence.hpp\"\n\nnamespace cairn::ground {{\n\n// clang-format off\n"
      "const ShadowModel kShadowModel = {{\n    {},\n    {},\n    {},\n    {}}};\n"
      "// clang-format on\n\n}}  // namespace cairn::ground\n",
      text_of(model.middle), text_of(model.spread), text_of(model.boulder), text_of(model.body));
}

int run(int argc, char** argv) {
  if (argc != 3) throw ToolError("usage: shadow_weights FOLDER SOURCE");
  const std::filesystem::path folder = argv[1];
  std::vector<Image> fit = gathered(kFit, folder);
  std::vector<Image> others = gathered(kCalibrate, folder);
  std::vector<Image> held_out = gathered(kHeldOut, folder);
  auto model = std::make_unique<ShadowModel>();
  standardise(fit, *model);
  fit_body(fit, *model);
  rate(*model, fit);
  fit_boulder(fit, *model);
  rate(*model, others);
  calibrate(entries(others, *model), *model);
  for (const auto& [what, of] : {std::pair{"today's model", &kShadowModel}, {"new model", model.get()}}) {
    rate(*of, fit);
    rate(*of, held_out);
    judge(fmt::format("fits, held out, {}", what), fits(held_out, *of), *of);
    judge(fmt::format("entries, fitted to, {}", what), entries(fit, *of), *of);
    judge(fmt::format("entries, held out, {}", what), entries(held_out, *of), *of);
    judge_bodies(fmt::format("entries, fitted to, {}", what), fit);
    judge_bodies(fmt::format("entries, held out, {}", what), held_out);
  }
  const std::string source = source_of(*model);
  fmt::print("\n{}", source);
  return test::is_source(source, folder / "shadow_weights.cpp", argv[2]) ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const ToolError& error) {
    fmt::print(stderr, "shadow_weights: {}\n", error.what());
    return 1;
  }
}
