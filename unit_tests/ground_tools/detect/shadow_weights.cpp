// Fits the model of the shadow detector's confidence (detect/shadow_confidence.hpp): logistic regression on
// all fits of rendered fields whose rocks are known. Not a test: `make shadow-weights`.
//
//   shadow_weights FOLDER... -- FOLDER...
//
// Folders of `cairn sim --ortho`: those to fit to, then those to judge by. Prints the model as its source
// (shadow_weights.cpp) has it, and for this and today's what they are worth on both sets: log loss and Brier
// score (less is better), and how often a boulder stood where so much confidence was claimed.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "base/tool_error.hpp"
#include "detect/shadow_detector.hpp"
#include "ground_tools/raster_in_memory.hpp"
#include "ortho/raster_source.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

struct Example {
  ShadowFeatures features;
  bool boulder;
};
using Set = std::vector<Example>;

enum class Label { kBoulder, kNone, kUnclear };

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

/// Adds the fits of one orthoimage, whatever today's weights say of them.
void add_image(const std::filesystem::path& path, const std::vector<TableBoulder>& rocks, Set& set) {
  const std::optional<Sun> sun = open_orthoimage(path)->facts().sun;
  if (!sun) throw ToolError("{}: its label does not tell where the sun stood", path.string());
  const test::Raster raster = test::read_orthoimage(path);
  const ShadowView view = shadow_view(*sun, raster.geo);
  ShadowParams params;
  params.min_confidence = 0.0;
  const double least_px = std::max(params.min_diameter_px, params.min_diameter_m / view.pixel_m);
  const PixelRect all{0, 0, raster.width, raster.height};
  std::size_t boulders = 0;
  const std::size_t before = set.size();
  for (const ShadowCandidate& c :
       shadow_candidates({all, raster.grey_view(), raster.valid_view()}, all, view, params).boulders) {
    const double diameter_px = 2.0 * std::sqrt(c.across_px * c.along_px);
    const double rim_px = std::min({c.u_px, c.v_px, all.width - c.u_px, all.height - c.v_px});
    if (diameter_px < least_px || rim_px < 2.0 * diameter_px) continue;
    const Vec2 p = raster.geo.to_map(c.u_px, c.v_px);
    const Label label = label_of(p, diameter_px * view.pixel_m, view.pixel_m, rocks);
    if (label == Label::kUnclear) continue;
    set.push_back({c.features, label == Label::kBoulder});
    boulders += label == Label::kBoulder ? 1 : 0;
  }
  fmt::print("{}: {} fits, {} of them boulders\n", path.string(), set.size() - before, boulders);
}

void add_folder(const std::filesystem::path& folder, Set& set) {
  const std::vector<TableBoulder> rocks = read_csv(folder / "truth_rocks.csv");
  std::vector<std::filesystem::path> images;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.rfind("ortho_", 0) == 0 && entry.path().extension() == ".tif") images.push_back(entry.path());
  }
  std::sort(images.begin(), images.end());
  if (images.empty()) throw ToolError("{}: no ortho_*.tif", folder.string());
  for (const std::filesystem::path& image : images) add_image(image, rocks, set);
}

/// What brings the features to a common scale.
void standardise(const Set& set, ShadowModel& model) {
  const auto n = static_cast<double>(set.size());
  for (std::size_t i = 0; i < kShadowFeatures; ++i) {
    double sum = 0.0;
    double square = 0.0;
    for (const Example& e : set) sum += e.features[i];
    const double middle = sum / n;
    for (const Example& e : set) square += (e.features[i] - middle) * (e.features[i] - middle);
    model.middle[i] = middle;
    model.spread[i] = std::sqrt(square / n) + 1e-6;
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

/// Newton's method on the log likelihood, with a pull to zero that keeps the many weights from chance.
ShadowModel fitted(const Set& set) {
  constexpr double kPull = 20.0;
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
        g[i] += (p - (e.boulder ? 1.0 : 0.0)) * x[i];
        for (std::size_t j = 0; j <= i; ++j) H[i][j] += weighted * x[j];
      }
    }
    const ShadowTerms step = solved(H, g);
    double largest = 0.0;
    for (std::size_t i = 0; i < kShadowTerms; ++i) {
      model.weights[i] -= step[i];
      largest = std::max(largest, std::fabs(step[i]));
    }
    if (largest < 1e-6) return model;
  }
  throw ToolError("the regression does not converge: more fits are needed");
}

void judge(const char* what, const Set& set, const ShadowModel& model) {
  struct Bin {
    int count = 0;
    double claimed = 0.0, seen = 0.0;
  };
  std::array<Bin, 10> bins;
  double loss = 0.0;
  double brier = 0.0;
  for (const Example& e : set) {
    const double p = shadow_confidence(e.features, model);
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

template <std::size_t kCount>
void print_numbers(const std::array<double, kCount>& numbers) {
  fmt::print("\n    {{");
  for (std::size_t i = 0; i < kCount; ++i)
    fmt::print("{}{:.4g}", i == 0 ? "" : i % 10 == 0 ? ",\n     " : ", ", numbers[i]);
  fmt::print("}}");
}

int run(int argc, char** argv) {
  Set fit;
  Set held_out;
  bool second = false;
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--") {
      second = true;
    } else {
      add_folder(argv[i], second ? held_out : fit);
    }
  }
  if (fit.empty() || held_out.empty()) throw ToolError("usage: shadow_weights FOLDER... -- FOLDER...");
  const ShadowModel model = fitted(fit);
  judge("fitted to, today's model", fit, kShadowModel);
  judge("fitted to, new model", fit, model);
  judge("held out, today's model", held_out, kShadowModel);
  judge("held out, new model", held_out, model);
  fmt::print("\nconst ShadowModel kShadowModel = {{");
  print_numbers(model.middle);
  fmt::print(",");
  print_numbers(model.spread);
  fmt::print(",");
  print_numbers(model.weights);
  fmt::print("}};\n");
  return 0;
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
