// Fits the model of the shadow detector's confidence and size (detect/shadow_confidence.hpp) to
// all fits of rendered fields (shadow_fields.hpp) whose rocks are known. Not a test: `make shadow-weights`.
//
//   shadow_weights FOLDER SOURCE
//
// Renders what is not in FOLDER yet, fits, and prints what the new model and today's are worth on the fields
// fitted to and on others: log loss and Brier score (less is better), and how often a boulder stood where so
// much confidence was claimed. Writes the model as source to FOLDER/shadow_weights.cpp; 1 where SOURCE,
// today's, holds other numbers. Seeds: below. No seed here is one of bench_detect.cpp.
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
#include "ground_tools/detect/shadow_fields.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

/// A fit, whatever is thought of it.
struct Example {
  ShadowWeights x;
  bool boulder;
};
using Set = std::vector<Example>;

/// The fits of one image, and the rocks that are there.
struct Image {
  ShadowView view;
  GeoTransform geo;
  int width, height;
  std::vector<TableBoulder> rocks;
  std::vector<ShadowCandidate> fits;
};

Image image_of(const test::Raster& raster, const Sun& sun, const std::vector<TableBoulder>& rocks) {
  Image image{shadow_view(sun, raster.geo), raster.geo, raster.width, raster.height, rocks, {}};
  ShadowParams params;
  params.min_confidence = 0.0;
  const PixelRect all{0, 0, raster.width, raster.height};
  image.fits =
      shadow_candidates({all, raster.grey_view(), raster.valid_view()}, all, image.view, params).boulders;
  return image;
}

double outline_px(const ShadowCandidate& c) { return 2.0 * std::sqrt(c.across_px * c.along_px); }

/// What an entry of a map is asked.
bool is_boulder(const ShadowCandidate& c, const Image& image) {
  const double pixel_m = image.view.pixel_m;
  return test::is_boulder(image.geo.to_map(c.u_px, c.v_px), c.diameter_px * pixel_m, pixel_m, image.rocks);
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
constexpr Seeds kFit[] = {{FieldKind::kCratered, 1000, 96},  {FieldKind::kCoarse, 2000, 40},
                          {FieldKind::kSaturated, 3000, 12}, {FieldKind::kFresh, 6000, 32},
                          {FieldKind::kNear, 4000, 5},       {FieldKind::kFar, 5000, 6},
                          {FieldKind::kEmpty, 9000, 8},      {FieldKind::kGullied, 10000, 40}};
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

/// Each fit's diameter and confidence by this model.
void rate(const ShadowModel& model, std::vector<Image>& images) {
  for (Image& image : images) {
    for (ShadowCandidate& c : image.fits) {
      c.diameter_px = outline_px(c) * shadow_size_factor(c.features, model);
      c.confidence = shadow_confidence(c.features, model);
    }
  }
}

void add(const ShadowCandidate& c, const Image& image, const ShadowModel& model, Set& set) {
  if (in_range(c, image)) set.push_back({scaled(c.features, model), is_boulder(c, image)});
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

/// As it is written.
double rounded(double x) { return std::stod(fmt::format("{:.4g}", x)); }

/// What brings the features to a common scale.
void standardise(const std::vector<Image>& images, ShadowModel& model) {
  ShadowFeatures sum{}, square{};
  double n = 0.0;
  const auto each = [&](const auto& visit) {
    for (const Image& image : images)
      for (const ShadowCandidate& c : image.fits)
        for (std::size_t i = 0; i < kShadowFeatures; ++i) visit(i, c.features[i]);
  };
  for (const Image& image : images) n += static_cast<double>(image.fits.size());
  each([&](std::size_t i, double f) { sum[i] += f; });
  for (std::size_t i = 0; i < kShadowFeatures; ++i) model.middle[i] = rounded(sum[i] / n);
  each([&](std::size_t i, double f) { square[i] += (f - model.middle[i]) * (f - model.middle[i]); });
  for (std::size_t i = 0; i < kShadowFeatures; ++i)
    model.spread[i] = rounded(std::sqrt(square[i] / n) + 1e-6);
}

using Matrix = std::vector<ShadowWeights>;

/// Of H x = g, H symmetric and positive, its lower half given; by Cholesky, in place.
ShadowWeights solved(Matrix& H, ShadowWeights g) {
  for (std::size_t i = 0; i < g.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = H[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= H[i][k] * H[j][k];
      H[i][j] = i == j ? std::sqrt(sum) : sum / H[j][j];
    }
    for (std::size_t k = 0; k < i; ++k) g[i] -= H[i][k] * g[k];
    g[i] /= H[i][i];
  }
  for (std::size_t i = g.size(); i-- > 0;) {
    g[i] /= H[i][i];
    for (std::size_t k = 0; k < i; ++k) g[k] -= H[i][k] * g[i];
  }
  return g;
}

/// The largest rock at the place of a fit, over the fit's diameter; 0: there is none.
double size_ratio(const ShadowCandidate& c, const Image& image) {
  const Vec2 p = image.geo.to_map(c.u_px, c.v_px);
  double largest_m = 0.0;
  for (const TableBoulder& rock : image.rocks)
    if (test::is_at(p, rock, image.view.pixel_m)) largest_m = std::max(largest_m, rock.diameter_m);
  return largest_m / (outline_px(c) * image.view.pixel_m);
}

/// Least squares on the ratio's logarithm.
void fit_size(const std::vector<Image>& images, ShadowModel& model) {
  constexpr double kPull = 400.0;  // to zero
  constexpr double kMost = 1.0;    // what is further from a fit's size is not what was fitted
  Matrix H(model.size.size(), ShadowWeights{});
  ShadowWeights g{};
  for (std::size_t i = 0; i < H.size(); ++i) H[i][i] = i == 0 ? 0.0 : kPull;
  for (const Image& image : images) {
    for (const ShadowCandidate& c : image.fits) {
      if (!shadow_size_is_bound(c.features)) continue;
      const double ratio = size_ratio(c, image);
      if (ratio <= 0.0 || std::fabs(std::log(ratio)) > kMost) continue;
      const ShadowWeights x = scaled(c.features, model);
      for (std::size_t i = 0; i < x.size(); ++i) {
        g[i] += std::log(ratio) * x[i];
        for (std::size_t j = 0; j <= i; ++j) H[i][j] += x[i] * x[j];
      }
    }
  }
  model.size = solved(H, g);
  for (double& w : model.size) w = rounded(w);
}

/// The network's weights, or their gradient.
struct Weights {
  std::array<ShadowHidden, kShadowFeatures + 1> hidden;
  ShadowHidden out;
  double out_0;
};
constexpr std::size_t kWeights = sizeof(Weights) / sizeof(double);

/// Adds the gradient of an example's log loss.
void descend(const Example& e, const ShadowModel& model, Weights& gradient) {
  const ShadowHidden y = hidden_layer(e.x, model);
  const double z = std::inner_product(y.begin(), y.end(), model.out.begin(), model.out_0);
  const double off = 1.0 / (1.0 + std::exp(-z)) - (e.boulder ? 1.0 : 0.0);
  ShadowHidden inner;
  for (std::size_t k = 0; k < kShadowHidden; ++k) {
    const double rest = 1.0 - std::fabs(y[k]);
    inner[k] = off * model.out[k] * rest * rest;  // softsign's derivative, by its value
    gradient.out[k] += off * y[k];
  }
  gradient.out_0 += off;
  for (std::size_t i = 0; i < e.x.size(); ++i)
    for (std::size_t k = 0; k < kShadowHidden; ++k) gradient.hidden[i][k] += e.x[i] * inner[k];
}

/// Adam on the log loss, with a pull to zero that keeps the many weights from chance.
void fit_network(const Set& set, ShadowModel& model) {
  constexpr int kEpochs = 40;
  constexpr std::size_t kBatch = 256;
  constexpr double kRate = 3e-3, kPull = 10.0;
  Weights weights{};
  Weights gradient, mean{}, square{};
  const auto flat = [](Weights& w) { return reinterpret_cast<double*>(&w); };
  sim::Draw draw(1, sim::Stream::kCampaign, 1);
  for (ShadowHidden& of : weights.hidden)
    for (double& w : of) w = 0.2 * draw.uniform(-1.0, 1.0);
  for (double& w : weights.out) w = 0.5 * draw.uniform(-1.0, 1.0);
  std::vector<std::size_t> order(set.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::size_t batches = set.size() / kBatch;
  double step = 0.0;
  for (int epoch = 0; epoch < kEpochs; ++epoch) {
    for (std::size_t i = order.size(); i-- > 1;)
      std::swap(order[i], order[std::min(i, static_cast<std::size_t>(draw.uniform() * (i + 1.0)))]);
    for (std::size_t batch = 0; batch < batches; ++batch) {
      gradient = {};
      model.hidden = weights.hidden;
      model.out = weights.out;
      model.out_0 = weights.out_0;
      for (std::size_t i = 0; i < kBatch; ++i) descend(set[order[batch * kBatch + i]], model, gradient);
      step += 1.0;
      const double rate = kRate * (1.0 - step / (kEpochs * static_cast<double>(batches)));
      const double fade = std::sqrt(1.0 - std::pow(0.999, step)) / (1.0 - std::pow(0.9, step));
      for (std::size_t i = 0; i < kWeights; ++i) {
        double& w = flat(weights)[i];
        const double g = flat(gradient)[i] / kBatch + kPull / static_cast<double>(set.size()) * w;
        flat(mean)[i] += 0.1 * (g - flat(mean)[i]);
        flat(square)[i] += 0.001 * (g * g - flat(square)[i]);
        w -= rate * fade * flat(mean)[i] / (std::sqrt(flat(square)[i]) + 1e-8);
      }
    }
  }
  model.hidden = weights.hidden;
  model.out = weights.out;
  model.out_0 = weights.out_0;
  for (ShadowHidden& of : model.hidden)
    for (double& w : of) w = rounded(w);
}

double logit_of(const Example& e, const ShadowModel& model) {
  const ShadowHidden y = hidden_layer(e.x, model);
  return std::inner_product(y.begin(), y.end(), model.out.begin(), model.out_0);
}

/// z' = z times `slope` + `shift`: so that of what a map holds at a confidence so many are boulders.
void calibrate(const Set& set, ShadowModel& model) {
  double slope = 1.0;
  double shift = 0.0;
  std::vector<double> z(set.size());
  std::transform(set.begin(), set.end(), z.begin(), [&](const Example& e) { return logit_of(e, model); });
  for (int iteration = 0; iteration < 30; ++iteration) {
    double g0 = 0.0, g1 = 0.0, h00 = 0.0, h01 = 0.0, h11 = 0.0;
    for (std::size_t i = 0; i < set.size(); ++i) {
      const double p = 1.0 / (1.0 + std::exp(-(slope * z[i] + shift)));
      const double off = p - (set[i].boulder ? 1.0 : 0.0);
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
  for (double& v : model.out) v = rounded(slope * v);
  model.out_0 = rounded(slope * model.out_0 + shift);
}

void judge(const std::string& what, const Set& set, const ShadowModel& model) {
  struct Bin {
    int count = 0;
    double claimed = 0.0, seen = 0.0;
  };
  std::array<Bin, 10> bins;
  double loss = 0.0;
  double brier = 0.0;
  for (const Example& e : set) {
    const double p = 1.0 / (1.0 + std::exp(-logit_of(e, model)));
    const double y = e.boulder ? 1.0 : 0.0;
    loss -= std::log(std::max(1e-12, e.boulder ? p : 1.0 - p));
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

template <class Numbers>
std::string text_of(const Numbers& numbers) {
  std::string text = "{";
  std::size_t column = 5;
  for (const double x : numbers) {
    const std::string word = fmt::format("{:.4g}, ", x);
    if (column + word.size() > 108) {
      text += "\n     ";
      column = 5;
    }
    text += word;
    column += word.size();
  }
  text.resize(text.size() - 2);
  return text + "}";
}

std::string source_of(const ShadowModel& model) {
  std::string hidden;
  for (const ShadowHidden& of : model.hidden) hidden += (hidden.empty() ? "" : ",\n     ") + text_of(of);
  return fmt::format(
      "// Made by `make shadow-weights`, which prints it again: see shadow_confidence.hpp. Not to be edited.\n"
      "#include \"detect/shadow_confidence.hpp\"\n\nnamespace cairn::ground {{\n\n// clang-format off\n"
      "const ShadowModel kShadowModel = {{\n    {},\n    {},\n    {{{{{}}}}},\n    {:.4g},\n    {},\n    {}}};\n"
      "// clang-format on\n\n}}  // namespace cairn::ground\n",
      text_of(model.middle), text_of(model.spread), hidden, model.out_0, text_of(model.out),
      text_of(model.size));
}

int run(int argc, char** argv) {
  if (argc != 3) throw ToolError("usage: shadow_weights FOLDER SOURCE");
  const std::filesystem::path folder = argv[1];
  std::vector<Image> fit = gathered(kFit, folder);
  std::vector<Image> others = gathered(kCalibrate, folder);
  std::vector<Image> held_out = gathered(kHeldOut, folder);
  auto model = std::make_unique<ShadowModel>();
  standardise(fit, *model);
  fit_size(fit, *model);
  rate(*model, fit);
  fit_network(fits(fit, *model), *model);
  rate(*model, others);
  calibrate(entries(others, *model), *model);
  for (const auto& [what, of] : {std::pair{"today's model", &kShadowModel}, {"new model", model.get()}}) {
    rate(*of, fit);
    rate(*of, held_out);
    judge(fmt::format("fits, held out, {}", what), fits(held_out, *of), *of);
    judge(fmt::format("entries, fitted to, {}", what), entries(fit, *of), *of);
    judge(fmt::format("entries, held out, {}", what), entries(held_out, *of), *of);
  }
  const std::string source = source_of(*model);
  write_file(folder / "shadow_weights.cpp", source);
  const std::vector<std::uint8_t> today = read_file(argv[2]);
  const bool same = std::string(today.begin(), today.end()) == source;
  fmt::print("\n{}\n{}: {}\n", source, argv[2], same ? "these numbers" : "other numbers");
  return same ? 0 : 1;
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
