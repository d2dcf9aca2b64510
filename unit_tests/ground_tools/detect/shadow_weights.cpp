// Fits the model of the shadow detector's confidence (detect/shadow_confidence.hpp): logistic regression on
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
#include <mutex>
#include <string>
#include <vector>

#include "base/parallel.hpp"
#include "base/progress_line.hpp"
#include "base/tool_error.hpp"
#include "detect/shadow_detector.hpp"
#include "ground_tools/detect/shadow_fields.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

enum class Label { kBoulder, kNone, kUnclear };

/// A fit, whatever is thought of it.
struct Example {
  ShadowFeatures features;
  Label label;
};
using Set = std::vector<Example>;

/// The fits of one image with what is true of each.
struct Image {
  ShadowView view;
  std::vector<ShadowCandidate> fits;
  std::vector<Label> labels;   ///< of the shape
  std::vector<bool> boulders;  ///< test::is_boulder, what an entry of a map is asked
  std::vector<bool> in_range;  ///< large enough, and off the rim
};

/// A boulder: its middle within a quarter of the diameter (or a pixel) of a rock of 0.6 to 1.8 times its
/// size. None: no rock of 0.45 times its size or more within its radius (or two pixels). Between: unclear.
Label label_of(const Vec2& p_map_m, double diameter_m, double pixel_m,
               const std::vector<TableBoulder>& rocks) {
  Label label = Label::kNone;
  for (const TableBoulder& rock : rocks) {
    const double away = (rock.p_map_m - p_map_m).norm();
    const double ratio = rock.diameter_m / diameter_m;
    if (away <= std::max(0.25 * diameter_m, pixel_m) && ratio >= 0.6 && ratio <= 1.8) return Label::kBoulder;
    const double touch = std::max({0.5 * diameter_m, 0.5 * rock.diameter_m, 2.0 * pixel_m});
    if (away <= touch && ratio >= 0.45) label = Label::kUnclear;
  }
  return label;
}

Image image_of(const test::Raster& raster, const Sun& sun, const std::vector<TableBoulder>& rocks) {
  Image image;
  image.view = shadow_view(sun, raster.geo);
  ShadowParams params;
  params.min_confidence = 0.0;
  const double pixel_m = image.view.pixel_m;
  const double least_px = std::max(params.min_diameter_px, params.min_diameter_m / pixel_m);
  const PixelRect all{0, 0, raster.width, raster.height};
  image.fits =
      shadow_candidates({all, raster.grey_view(), raster.valid_view()}, all, image.view, params).boulders;
  for (const ShadowCandidate& c : image.fits) {
    const double diameter_px = 2.0 * std::sqrt(c.across_px * c.along_px);
    const double rim_px = std::min({c.u_px, c.v_px, all.width - c.u_px, all.height - c.v_px});
    const Vec2 p = raster.geo.to_map(c.u_px, c.v_px);
    image.in_range.push_back(diameter_px >= least_px && rim_px >= 2.0 * diameter_px);
    image.labels.push_back(label_of(p, diameter_px * pixel_m, pixel_m, rocks));
    image.boulders.push_back(test::is_boulder(p, diameter_px * pixel_m, pixel_m, rocks));
  }
  return image;
}

struct Seeds {
  test::FieldKind kind;
  std::uint64_t first, count;
};
constexpr Seeds kFit[] = {{test::FieldKind::kCratered, 1000, 48},  {test::FieldKind::kCoarse, 2000, 24},
                          {test::FieldKind::kSaturated, 3000, 12}, {test::FieldKind::kFresh, 6000, 20},
                          {test::FieldKind::kNear, 4000, 5},       {test::FieldKind::kFar, 5000, 6}};
constexpr Seeds kHeldOut[] = {{test::FieldKind::kCratered, 1500, 8},  {test::FieldKind::kCoarse, 2500, 6},
                              {test::FieldKind::kSaturated, 3500, 3}, {test::FieldKind::kFresh, 6500, 4},
                              {test::FieldKind::kNear, 4500, 2},      {test::FieldKind::kFar, 5500, 2}};

/// Each field twice: as it is, and with the sun told up to 16 degrees wrong, as labels are, and slopes.
std::vector<Image> images_of(test::FieldKind kind, std::uint64_t seed, const std::filesystem::path& folder) {
  constexpr double kMostWrong_rad = 16.0 * kRadPerDeg;
  const test::RenderedField field = test::render(test::shadow_field(kind, seed), folder);
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
    std::size_t boulders = 0;
    for (std::vector<Image>& field : fields) {
      for (Image& image : field) {
        fits += image.fits.size();
        boulders +=
            static_cast<std::size_t>(std::count(image.labels.begin(), image.labels.end(), Label::kBoulder));
        all.push_back(std::move(image));
      }
    }
    fmt::print("{} {} to {}: {} fits, {} of them boulders\n", kind, of.first, of.first + of.count - 1, fits,
               boulders);
    std::fflush(stdout);
  }
  return all;
}

/// All fits whose shape is clear.
Set shapes(const std::vector<Image>& images) {
  Set set;
  for (const Image& image : images) {
    for (std::size_t i = 0; i < image.fits.size(); ++i) {
      if (image.in_range[i] && image.labels[i] != Label::kUnclear)
        set.push_back({image.fits[i].features, image.labels[i]});
    }
  }
  return set;
}

/// What a map would hold by this model, at whatever confidence.
Set entries(const std::vector<Image>& images, const ShadowModel& model) {
  Set set;
  for (const Image& image : images) {
    std::vector<ShadowCandidate> fits = image.fits;
    for (ShadowCandidate& c : fits) c.confidence = shadow_confidence(c.features, model);
    std::size_t i = 0;
    for (const ShadowCandidate& c : strongest(fits, image.view, {})) {
      while (fits[i].u_px != c.u_px || fits[i].v_px != c.v_px || fits[i].explained != c.explained ||
             fits[i].across_px != c.across_px)
        ++i;
      if (image.in_range[i]) set.push_back({c.features, image.boulders[i] ? Label::kBoulder : Label::kNone});
    }
  }
  return set;
}

bool is(const Example& e) { return e.label == Label::kBoulder; }

/// As it is written.
double rounded(double x) { return std::stod(fmt::format("{:.4g}", x)); }

/// What brings the features to a common scale.
void standardise(const Set& set, ShadowModel& model) {
  const auto n = static_cast<double>(set.size());
  for (std::size_t i = 0; i < kShadowFeatures; ++i) {
    double sum = 0.0;
    double square = 0.0;
    for (const Example& e : set) sum += e.features[i];
    const double middle = sum / n;
    for (const Example& e : set) square += (e.features[i] - middle) * (e.features[i] - middle);
    model.middle[i] = rounded(middle);
    model.spread[i] = rounded(std::sqrt(square / n) + 1e-6);
  }
}

using Matrix = std::vector<ShadowTerms>;

/// Of H x = g, H symmetric and positive, its lower half given; by Cholesky, in place.
ShadowTerms solved(Matrix& H, ShadowTerms g) {
  for (std::size_t i = 0; i < kShadowTerms; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = H[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= H[i][k] * H[j][k];
      H[i][j] = i == j ? std::sqrt(sum) : sum / H[j][j];
    }
    for (std::size_t k = 0; k < i; ++k) g[i] -= H[i][k] * g[k];
    g[i] /= H[i][i];
  }
  for (std::size_t i = kShadowTerms; i-- > 0;) {
    g[i] /= H[i][i];
    for (std::size_t k = 0; k < i; ++k) g[k] -= H[i][k] * g[i];
  }
  return g;
}

/// Newton's method on the log likelihood, with a pull to zero that keeps the many weights from chance: as
/// good on fields held out with 20 as with 400, on pictures of other renderers better with 400.
ShadowModel fitted(const Set& set) {
  constexpr double kPull = 400.0;
  ShadowModel model = {};
  standardise(set, model);
  for (int iteration = 0; iteration < 50; ++iteration) {
    Matrix H(kShadowTerms, ShadowTerms{});
    ShadowTerms g;
    for (std::size_t i = 0; i < kShadowTerms; ++i) {
      H[i][i] = kPull;
      g[i] = kPull * model.weights[i];
    }
    for (const Example& e : set) {
      const ShadowTerms x = shadow_terms(e.features, model);
      const double p = shadow_confidence(e.features, model);
      for (std::size_t i = 0; i < kShadowTerms; ++i) {
        const double weighted = p * (1.0 - p) * x[i];
        g[i] += (p - (is(e) ? 1.0 : 0.0)) * x[i];
        for (std::size_t j = 0; j <= i; ++j) H[i][j] += weighted * x[j];
      }
    }
    const ShadowTerms step = solved(H, g);
    double largest = 0.0;
    for (std::size_t i = 0; i < kShadowTerms; ++i) {
      model.weights[i] -= step[i];
      largest = std::max(largest, std::fabs(step[i]));
    }
    if (largest < 1e-6) {
      return model;
    }
  }
  throw ToolError("the regression does not converge: more fits are needed");
}

/// z' = z times `slope` + `shift`: so that of what a map holds at a confidence so many are boulders.
void calibrate(const Set& set, ShadowModel& model) {
  double slope = 1.0;
  double shift = 0.0;
  std::vector<double> z(set.size());
  std::transform(set.begin(), set.end(), z.begin(), [&](const Example& e) {
    const double p = std::clamp(shadow_confidence(e.features, model), 1e-12, 1.0 - 1e-12);
    return std::log(p / (1.0 - p));
  });
  for (int iteration = 0; iteration < 30; ++iteration) {
    double g0 = 0.0, g1 = 0.0, h00 = 0.0, h01 = 0.0, h11 = 0.0;
    for (std::size_t i = 0; i < set.size(); ++i) {
      const double p = 1.0 / (1.0 + std::exp(-(slope * z[i] + shift)));
      const double off = p - (is(set[i]) ? 1.0 : 0.0);
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
  for (double& w : model.weights) w *= slope;
  model.weights[0] += shift;
  for (double& w : model.weights) w = rounded(w);
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
    const double p = shadow_confidence(e.features, model);
    const double y = is(e) ? 1.0 : 0.0;
    loss -= std::log(std::max(1e-12, is(e) ? p : 1.0 - p));
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

template <std::size_t kCount>
std::string text_of(const std::array<double, kCount>& numbers) {
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
  return fmt::format(
      "// Made by `make shadow-weights`, which prints it again: see shadow_confidence.hpp. Not to be edited.\n"
      "#include \"detect/shadow_confidence.hpp\"\n\nnamespace cairn::ground {{\n\n// clang-format off\n"
      "const ShadowModel kShadowModel = {{\n    {},\n    {},\n    {}}};\n// clang-format on\n\n"
      "}}  // namespace cairn::ground\n",
      text_of(model.middle), text_of(model.spread), text_of(model.weights));
}

int run(int argc, char** argv) {
  if (argc != 3) throw ToolError("usage: shadow_weights FOLDER SOURCE");
  const std::filesystem::path folder = argv[1];
  const std::vector<Image> fit = gathered(kFit, folder);
  const std::vector<Image> held_out = gathered(kHeldOut, folder);
  ShadowModel model = fitted(shapes(fit));
  calibrate(entries(fit, model), model);
  for (const auto& [what, today] : {std::pair{"today's model", true}, {"new model", false}}) {
    const ShadowModel& of = today ? kShadowModel : model;
    judge(fmt::format("fits, held out, {}", what), shapes(held_out), of);
    judge(fmt::format("entries, fitted to, {}", what), entries(fit, of), of);
    judge(fmt::format("entries, held out, {}", what), entries(held_out, of), of);
  }
  const std::string source = source_of(model);
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
