#include "detect/detector.hpp"

#include <algorithm>
#include <cmath>

#include "base/tool_error.hpp"
#include "core/trig.hpp"

namespace cairn::ground {
namespace {

constexpr int kLeastBackgroundPx = 61;
constexpr int kLeastBlockPx = 128;
constexpr int kLeastMedianPx = 3;
constexpr int kMostMedianPx = 2 * MedianRows::kMostRadius + 1;

/// Longer over shorter axis of the ellipse with the component's second moments. A pixel is a unit square: its
/// own moment of 1/12 keeps lines of one pixel's width finite. The moments about the centroid are whole
/// numbers over the square of the count: nothing is lost far from the image's origin.
double elongation_of(const Component& c) {
  const auto n = static_cast<double>(c.area_px);
  const auto about_centroid = [&](WideSum sum, std::uint64_t a, std::uint64_t b) {
    const WideSum product = static_cast<WideSum>(a) * b;
    const WideSum scaled = static_cast<WideSum>(c.area_px) * sum;
    const double size = static_cast<double>(scaled > product ? scaled - product : product - scaled) / (n * n);
    return scaled > product ? size : -size;
  };
  const double xx = about_centroid(c.sum_xx, c.sum_x, c.sum_x) + 1.0 / 12.0;
  const double yy = about_centroid(c.sum_yy, c.sum_y, c.sum_y) + 1.0 / 12.0;
  const double xy = about_centroid(c.sum_xy, c.sum_x, c.sum_y);
  const double half_trace = 0.5 * (xx + yy);
  const double half_difference = 0.5 * (xx - yy);
  const double root = std::sqrt(half_difference * half_difference + xy * xy);
  return std::sqrt((half_trace + root) / std::max(half_trace - root, 1.0 / 12.0));
}

/// How likely a blob of this contrast is a boulder: a logistic function fitted to the 5121 blobs of five
/// rendered orthoimages (5, 10 and 20 mm, two suns), of which 83 % are. Size and shape add next to nothing to
/// it. On images of another ground it ranks rather than measures.
double confidence_of(double contrast) { return 1.0 / (1.0 + std::exp(1.76 - 14.6 * contrast)); }

TableBoulder boulder_of(const Component& c, const GeoTransform& geo) {
  TableBoulder b;
  b.p_map_m = geo.to_map(c.mean_x(), c.mean_y());
  b.area_m2 = static_cast<double>(c.area_px) * geo.pixel_area_m2();
  b.diameter_m = std::sqrt(4.0 * b.area_m2 / kPi);
  b.contrast =
      std::max(0.0, kLevel - static_cast<double>(c.sum_value) / static_cast<double>(c.area_px)) / 255.0;
  b.elongation = elongation_of(c);
  b.confidence = confidence_of(b.contrast);
  return b;
}

int whole_pixels(double length_m, double pixel_m) {
  return static_cast<int>(std::lround(std::min(length_m / pixel_m, 1e8)));  // more than any image is wide
}

/// The odd number of pixels nearest to a length.
int odd_pixels(double length_m, double pixel_m) {
  return 2 * static_cast<int>(std::lround(std::min(0.5 * (length_m / pixel_m - 1.0), 1e6))) + 1;
}

}  // namespace

void check(const DetectorParams& params) {
  check_range("--background", params.background_m, 1e-3, 1e5);
  check_range("--block", params.block_m, 1e-3, 1e6);
  check_range("--threshold-scale", params.threshold_scale, 0.05, 5.0);
  check_range("--noise-sigmas", params.noise_sigmas, 0.0, 100.0);
  check_range("--median", params.median_m, 1e-4, 1e3);
  check_range("--min-area", params.min_area_m2, 0.0, 1e6);
  check_range("--min-area-px", params.min_area_px, 1, 1000000000);
}

std::string to_text(const DetectorParams& params) {
  return fmt::format(
      "method=otsu background_m={} block_m={} threshold_scale={} noise_sigmas={} median_m={} min_area_m2={} "
      "min_area_px={}",
      params.background_m, params.block_m, params.threshold_scale, params.noise_sigmas, params.median_m,
      params.min_area_m2, params.min_area_px);
}

DetectorPixels on_pixels(const DetectorParams& params, double pixel_m) {
  DetectorPixels px;
  px.radius = std::max(kLeastBackgroundPx, whole_pixels(params.background_m, pixel_m)) / 2;
  px.block = std::max(kLeastBlockPx, whole_pixels(params.block_m, pixel_m));
  px.median_radius = std::clamp(odd_pixels(params.median_m, pixel_m), kLeastMedianPx, kMostMedianPx) / 2;
  if (px.radius > kMostRadiusPx) {
    throw ToolError("--background: {} m are {} pixels of {:.4g} m; choose {:.4g} m or less",
                    params.background_m, 2 * px.radius + 1, pixel_m, (2 * kMostRadiusPx + 1) * pixel_m);
  }
  return px;
}

TileComponents dark_components(RasterReader& reader, const GreyRange& range, const RasterFacts& facts,
                               const BlockGrid& grid, const BlockDarkness& darkness,
                               const DetectorPixels& pixels, const PixelBox& tile) {
  const PixelBox image = facts.box();
  const PixelBox around = tile.grown(pixels.median_radius, image);
  RowWindow window(reader, range, around.grown(pixels.radius, image),
                   DifferenceRows::rows_kept(pixels.radius), facts.all_valid);
  DifferenceRows difference(window, around, image, pixels.radius);
  ThresholdRows thresholds(grid, darkness, around.x0, around.x1);
  MedianRows median(tile, image, pixels.median_radius);
  TileLabeller labeller(tile, image);

  const auto wide = static_cast<std::size_t>(around.width());
  const auto inset = static_cast<std::size_t>(tile.x0 - around.x0);
  const int kept = 2 * pixels.median_radius + 2;  // the median lags behind the difference
  std::vector<std::uint8_t> differences(wide * static_cast<std::size_t>(kept));
  const auto row = [&](int y) {
    return &differences[static_cast<std::size_t>((y - around.y0) % kept) * wide];
  };
  std::vector<std::uint8_t> level(wide);
  std::vector<std::uint8_t> dark(wide);
  std::vector<std::uint8_t> mask(static_cast<std::size_t>(tile.width()));
  int out = tile.y0;
  for (int y = around.y0; y < around.y1; ++y) {
    difference.next(row(y));
    thresholds.row(y, level.data());
    rows::darker(row(y), level.data(), dark.data(), wide);
    median.push(dark.data());
    for (; median.ready(); ++out) {
      median.pop(mask.data());
      labeller.push(mask.data(), row(out) + inset);
    }
  }
  return labeller.finish();
}

std::vector<FoundBoulder> boulders_of(const std::vector<Component>& components, const DetectorParams& params,
                                      const GeoTransform& geo) {
  std::vector<FoundBoulder> found;
  for (const Component& c : components) {
    const bool large = static_cast<double>(c.area_px) * geo.pixel_area_m2() >= params.min_area_m2 &&
                       c.area_px >= static_cast<std::uint64_t>(params.min_area_px);
    if (large) found.push_back({c.min_y, c.first_x, boulder_of(c, geo), false});
  }
  return found;
}

}  // namespace cairn::ground
