#include "map/detector.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/trig.hpp"
#include "map/kernels.hpp"
#include "tool_error.hpp"

namespace cairn::ground {
namespace {

constexpr int kLevel = 128;  ///< a difference of nothing
constexpr int kLeastBackgroundPx = 61;
constexpr int kLeastBlockPx = 128;
constexpr int kLeastMedianPx = 3;
constexpr int kMostMedianPx = 15;
constexpr double kLeastOfGlobal = 0.5;
constexpr double kMostOfGlobal = 1.5;

ImageU8 view_of(const std::vector<std::uint8_t>& pixels, const Raster& raster) {
  return packed_view(pixels.data(), raster.width, raster.height);
}
MutableImageU8 view_of(std::vector<std::uint8_t>& pixels, const Raster& raster) {
  return packed_view(pixels.data(), raster.width, raster.height);
}

/// Median absolute difference, as the standard deviation of the Gaussian that has it.
double texture_sigma(const Histogram& histogram) {
  Histogram magnitude{};
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    magnitude[static_cast<std::size_t>(std::abs(static_cast<int>(i) - kLevel))] += histogram[i];
    total += histogram[i];
  }
  const double half = 0.5 * static_cast<double>(total);
  double below = 0.0;
  for (std::size_t i = 0; i < magnitude.size(); ++i) {
    const auto here = static_cast<double>(magnitude[i]);
    if (here > 0.0 && below + here >= half) {  // grey level i stands for i - 0.5 to i + 0.5
      return 1.4826 * std::max(0.0, static_cast<double>(i) - 0.5 + (half - below) / here);
    }
    below += here;
  }
  return 0.0;
}

/// Otsu's threshold as a darkness below the surroundings, in the middle between two grey levels; 1 or more.
/// What is brighter than its surroundings counts as level ground: bright rocks must not draw the split to
/// their own side.
double darkness_threshold(const Histogram& histogram) {
  Histogram folded{};
  for (std::size_t i = 0; i < histogram.size(); ++i) folded[std::min<std::size_t>(i, kLevel)] += histogram[i];
  return std::max(1.0, kLevel - otsu_threshold(folded) - 0.5);
}

/// Blocks of about `block_px`, evenly spread over the image; thresholds at their centres, interpolated
/// between.
class BlockThresholds {
 public:
  BlockThresholds(const Raster& raster, const std::vector<std::uint8_t>& difference, int block_px,
                  const DetectorParams& params)
      : columns_(std::max(1, (raster.width + block_px / 2) / block_px)),
        rows_(std::max(1, (raster.height + block_px / 2) / block_px)),
        width_(raster.width),
        height_(raster.height) {
    std::vector<Histogram> histograms(static_cast<std::size_t>(columns_) * rows_, Histogram{});
    Histogram whole{};
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * width_ + x;
        if (!raster.valid.empty() && raster.valid[i] == 0) continue;
        ++histograms[index(block_of(x, columns_, width_), block_of(y, rows_, height_))][difference[i]];
        ++whole[difference[i]];
      }
    }
    const double global = darkness_threshold(whole);
    const double whole_sigma = texture_sigma(whole);
    for (const Histogram& histogram : histograms) {
      const double own =
          std::clamp(darkness_threshold(histogram), kLeastOfGlobal * global, kMostOfGlobal * global);
      const double sigma = std::min(texture_sigma(histogram), whole_sigma);
      darkness_.push_back(std::max({params.threshold_scale * own, params.noise_sigmas * sigma, 1.0}));
    }
  }

  /// Row `y` of thresholds on the difference image: what is below is dark.
  void row(int y, std::vector<double>& level) const {
    const Between v = between(y, rows_, height_);
    for (int x = 0; x < width_; ++x) {
      const Between u = between(x, columns_, width_);
      const double above =
          mix(darkness_[index(u.first, v.first)], darkness_[index(u.second, v.first)], u.share);
      const double below =
          mix(darkness_[index(u.first, v.second)], darkness_[index(u.second, v.second)], u.share);
      level[static_cast<std::size_t>(x)] = kLevel - mix(above, below, v.share);
    }
  }

 private:
  struct Between {
    int first = 0;
    int second = 0;
    double share = 0.0;  ///< of the second
  };

  static int block_of(int i, int blocks, int size) {
    return static_cast<int>(static_cast<std::int64_t>(i) * blocks / size);
  }
  static Between between(int i, int blocks, int size) {
    const double at = std::clamp((i + 0.5) * blocks / size - 0.5, 0.0, blocks - 1.0);
    const int first = static_cast<int>(at);
    return {first, std::min(first + 1, blocks - 1), at - first};
  }
  static double mix(double a, double b, double share) { return a + (b - a) * share; }
  std::size_t index(int column, int row) const { return static_cast<std::size_t>(row) * columns_ + column; }

  int columns_;
  int rows_;
  int width_;
  int height_;
  std::vector<double> darkness_;
};

std::vector<std::uint8_t> mask_of_dark(const Raster& raster, const std::vector<std::uint8_t>& difference,
                                       const BlockThresholds& thresholds) {
  std::vector<std::uint8_t> mask(difference.size());
  std::vector<double> level(static_cast<std::size_t>(raster.width));
  for (int y = 0; y < raster.height; ++y) {
    thresholds.row(y, level);
    const std::size_t from = static_cast<std::size_t>(y) * raster.width;
    for (std::size_t x = 0; x < level.size(); ++x) mask[from + x] = difference[from + x] < level[x] ? 255 : 0;
  }
  return mask;
}

/// Longer over shorter axis of the ellipse with the component's second moments. A pixel is a unit square: its
/// own moment of 1/12 keeps lines of one pixel's width finite.
double elongation_of(const Component& c) {
  const auto n = static_cast<double>(c.area_px);
  const double xx = static_cast<double>(c.sum_xx) / n - c.mean_x() * c.mean_x() + 1.0 / 12.0;
  const double yy = static_cast<double>(c.sum_yy) / n - c.mean_y() * c.mean_y() + 1.0 / 12.0;
  const double xy = static_cast<double>(c.sum_xy) / n - c.mean_x() * c.mean_y();
  const double half_trace = 0.5 * (xx + yy);
  const double root = std::hypot(0.5 * (xx - yy), xy);
  return std::sqrt((half_trace + root) / std::max(half_trace - root, 1.0 / 12.0));
}

TableBoulder boulder_of(const Component& c, const GeoTransform& geo) {
  TableBoulder b;
  b.p_map_m = geo.to_map(c.mean_x(), c.mean_y());
  b.area_m2 = static_cast<double>(c.area_px) * geo.pixel_area_m2();
  b.diameter_m = std::sqrt(4.0 * b.area_m2 / kPi);
  b.contrast =
      std::max(0.0, kLevel - static_cast<double>(c.sum_value) / static_cast<double>(c.area_px)) / 255.0;
  b.elongation = elongation_of(c);
  return b;
}

void check_range(const char* option, double value, double least, double most) {
  if (!(value >= least && value <= most)) {
    throw ToolError("{}: {} is out of range; choose {} to {}", option, value, least, most);
  }
}

int pixels(double length_m, double pixel_m) {
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
  check_range("--min-area-px", params.min_area_px, 1, 1e9);
}

std::string to_text(const DetectorParams& params) {
  return fmt::format(
      "method=otsu background_m={} block_m={} threshold_scale={} noise_sigmas={} median_m={} min_area_m2={} "
      "min_area_px={}",
      params.background_m, params.block_m, params.threshold_scale, params.noise_sigmas, params.median_m,
      params.min_area_m2, params.min_area_px);
}

std::vector<TableBoulder> detect_boulders(const Raster& raster, const DetectorParams& params,
                                          const ShareDone& done) {
  const double pixel_m = raster.geo.pixel_m();
  const int background_px = std::max(kLeastBackgroundPx, pixels(params.background_m, pixel_m));
  const int block_px = std::max(kLeastBlockPx, pixels(params.block_m, pixel_m));
  const int median_px = std::clamp(odd_pixels(params.median_m, pixel_m), kLeastMedianPx, kMostMedianPx);
  const auto part = [&](double from, double to) -> RowDone {  // shares of the time, as measured
    if (!done) return {};
    return [&done, from, to, &raster](int rows) { done(from + (to - from) * rows / raster.height); };
  };

  std::vector<std::uint8_t> difference(raster.grey.size());
  difference_from_surroundings(raster.grey_view(), raster.valid_view(), background_px / 2,
                               view_of(difference, raster), part(0.0, 0.4));
  const BlockThresholds thresholds(raster, difference, block_px, params);
  const std::vector<std::uint8_t> dark = mask_of_dark(raster, difference, thresholds);
  std::vector<std::uint8_t> mask(dark.size());
  median_of_mask(view_of(dark, raster), median_px, view_of(mask, raster), part(0.6, 0.9));
  const ImageU8 blobs = packed_view<const std::uint8_t>(mask.data(), raster.width, raster.height);
  const std::vector<Component> components = connected_components(
      blobs, packed_view<const std::uint8_t>(difference.data(), raster.width, raster.height), part(0.9, 1.0));

  std::vector<TableBoulder> boulders;
  for (const Component& c : components) {
    const bool large = static_cast<double>(c.area_px) * raster.geo.pixel_area_m2() >= params.min_area_m2 &&
                       c.area_px >= static_cast<std::uint64_t>(params.min_area_px);
    if (large) boulders.push_back(boulder_of(c, raster.geo));
  }
  return boulders;
}

MapExtent extent_of(const Raster& raster) {
  MapExtent e;
  for (int i = 0; i < 4; ++i) {
    const Vec2 p =
        raster.geo.to_map(i % 2 == 0 ? -0.5 : raster.width - 0.5, i / 2 == 0 ? -0.5 : raster.height - 0.5);
    e = i == 0 ? MapExtent{p.x(), p.y(), p.x(), p.y()}
               : MapExtent{std::min(e.min_x_m, p.x()), std::min(e.min_y_m, p.y()), std::max(e.max_x_m, p.x()),
                           std::max(e.max_y_m, p.y())};
  }
  return e;
}

}  // namespace cairn::ground
