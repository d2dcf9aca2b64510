// Fits the weights of the shadow detector's confidence (detect/shadow_confidence.hpp): logistic regression on
// all fits of rendered fields whose rocks are known. Not a test: `make shadow-weights`.
//
//   shadow_weights FOLDER... -- FOLDER...
//
// Folders of `cairn sim --ortho`: those to fit to, then those to judge by. Prints the weights as the source
// has them, and for these and today's what they are worth on both sets: log loss and Brier score (less is
// better), and how often a boulder stood where so much confidence was claimed.
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
  double tan_elevation;
  bool boulder;
};
using Set = std::vector<Example>;

enum class Label { kBoulder, kNone, kUnclear };

/// A boulder: its middle within a quarter of the diameter (or a pixel) of a rock of half to twice its size.
/// None: no rock of a third of its size or more within its radius (or two pixels). Between: unclear.
Label label_of(const Vec2& p_map_m, double diameter_m, double pixel_m,
               const std::vector<TableBoulder>& rocks) {
  Label label = Label::kNone;
  for (const TableBoulder& rock : rocks) {
    const double away = (rock.p_map_m - p_map_m).norm();
    const double ratio = rock.diameter_m / diameter_m;
    if (away <= std::max(0.25 * diameter_m, pixel_m) && ratio >= 0.5 && ratio <= 2.0) return Label::kBoulder;
    const double touch = std::max({0.5 * diameter_m, 0.5 * rock.diameter_m, 2.0 * pixel_m});
    if (away <= touch && ratio >= 1.0 / 3.0) label = Label::kUnclear;
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
       shadow_candidates({all, raster.grey_view(), raster.valid_view()}, all, view, params)) {
    const double diameter_px = 2.0 * std::sqrt(c.across_px * c.along_px);
    const double rim_px = std::min({c.u_px, c.v_px, all.width - c.u_px, all.height - c.v_px});
    if (diameter_px < least_px || rim_px < 2.0 * diameter_px) continue;
    const Vec2 p = raster.geo.to_map(c.u_px, c.v_px);
    const Label label = label_of(p, diameter_px * view.pixel_m, view.pixel_m, rocks);
    if (label == Label::kUnclear) continue;
    set.push_back({c.features, view.tan_elevation, label == Label::kBoulder});
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

/// Newton's method on the log likelihood, with a weak pull to zero (sigma 10) that keeps it convex.
ShadowFeatures fitted(const Set& set) {
  using Vector = Eigen::Matrix<double, kShadowFeatures, 1>;
  using Matrix = Eigen::Matrix<double, kShadowFeatures, kShadowFeatures>;
  constexpr double kPull = 1.0 / (10.0 * 10.0);
  ShadowFeatures weights = {};
  for (int iteration = 0; iteration < 50; ++iteration) {
    Matrix H = Matrix::Identity() * kPull;
    Vector g = kPull * Eigen::Map<const Vector>(weights.data());
    for (const Example& e : set) {
      const double p = shadow_confidence(e.features, e.tan_elevation, weights);
      const Eigen::Map<const Vector> x(e.features.data());
      g += (p - (e.boulder ? 1.0 : 0.0)) * x;
      H.noalias() += (p * (1.0 - p)) * x * x.transpose();
    }
    const Eigen::LDLT<Matrix> ldlt(H);
    const Vector step = ldlt.solve(g);
    for (std::size_t i = 0; i < kShadowFeatures; ++i) weights[i] -= step[static_cast<Eigen::Index>(i)];
    if (step.cwiseAbs().maxCoeff() < 1e-9) return weights;
  }
  throw ToolError("the regression does not converge: more fits are needed");
}

void judge(const char* what, const Set& set, const ShadowFeatures& weights) {
  struct Bin {
    int count = 0;
    double claimed = 0.0, seen = 0.0;
  };
  std::array<Bin, 10> bins;
  double loss = 0.0;
  double brier = 0.0;
  for (const Example& e : set) {
    const double p = shadow_confidence(e.features, e.tan_elevation, weights);
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
  const ShadowFeatures weights = fitted(fit);
  judge("fitted to, today's weights", fit, kShadowWeights);
  judge("fitted to, new weights", fit, weights);
  judge("held out, today's weights", held_out, kShadowWeights);
  judge("held out, new weights", held_out, weights);
  fmt::print("\nconst ShadowFeatures kShadowWeights = {{");
  for (std::size_t i = 0; i < kShadowFeatures; ++i) fmt::print("{}{:.3f}", i == 0 ? "" : ", ", weights[i]);
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
