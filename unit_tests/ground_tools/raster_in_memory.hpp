/// Small images whole in memory, for tests: the tools go tile by tile.
#pragma once

#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "detect/components.hpp"
#include "detect/kernels.hpp"
#include "detect/map_build.hpp"
#include "detect/shadow_detector.hpp"
#include "image/image_view.hpp"
#include "ortho/grey_range.hpp"
#include "ortho/raster_source.hpp"

namespace cairn::test {

using namespace cairn::ground;

struct Raster {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> grey;
  std::vector<std::uint8_t> valid;  ///< 0 = no data; empty where every pixel is valid
  GeoTransform geo;
  std::string reference_system;  ///< a text as in map/reference_system.hpp

  ImageU8 grey_view() const { return packed_view(grey.data(), width, height); }
  ImageU8 valid_view() const { return valid.empty() ? ImageU8{} : packed_view(valid.data(), width, height); }
};

inline MapExtent extent_of(const Raster& raster) {
  return extent_of(raster.geo, raster.width, raster.height);
}

/// Reads an orthoimage whole, as raster_source.hpp says.
inline Raster read_orthoimage(const std::filesystem::path& path, int band = 0,
                              const NoDataChoice& no_data = {}) {
  const std::unique_ptr<RasterSource> source = open_orthoimage(path, band, no_data);
  const RasterFacts& facts = source->facts();
  const std::unique_ptr<RasterReader> reader = source->reader();
  GreyRange range;
  if (facts.depth != PixelDepth::kEight) {
    GreyRangeSearch search(facts.depth);
    search.add_values(count_values(*reader, facts.depth, facts.box()));
    search.finish_values(facts.name);
    if (search.needs_lower_halves())
      search.add_lower_halves(count_lower_halves(*reader, search.bins(), facts.box()));
    range = search.finish(facts.name);
  }
  Raster raster;
  raster.width = facts.width;
  raster.height = facts.height;
  raster.geo = facts.geo;
  raster.reference_system = facts.reference_system;
  raster.grey.resize(facts.box().pixels());
  std::vector<std::uint8_t> missing(raster.grey.size());
  const bool any = reader->read(facts.box(), range, raster.grey.data(), missing.data(), facts.width);
  GreyContent content;
  content.add(raster.grey.data(), any ? missing.data() : nullptr, raster.grey.size());
  content.check(facts.name);
  if (any) {
    raster.valid = std::move(missing);
    for (std::uint8_t& flag : raster.valid) flag = flag != 0 ? 0 : 255;
  }
  return raster;
}

class MemoryReader final : public RasterReader {
 public:
  explicit MemoryReader(const Raster& raster) : raster_(raster) {}

  bool read(const PixelBox& box, const GreyRange&, std::uint8_t* grey, std::uint8_t* missing,
            int stride) override {
    const auto width = static_cast<std::size_t>(box.width());
    bool any = false;
    for (int y = box.y0; y < box.y1; ++y) {
      const std::size_t from = static_cast<std::size_t>(y) * static_cast<std::size_t>(raster_.width) +
                               static_cast<std::size_t>(box.x0);
      const std::size_t to = static_cast<std::size_t>(y - box.y0) * static_cast<std::size_t>(stride);
      std::memcpy(grey + to, &raster_.grey[from], width);
      for (std::size_t x = 0; !raster_.valid.empty() && x < width; ++x) {
        const bool gone = raster_.valid[from + x] == 0;
        missing[to + x] = gone ? 1 : 0;
        if (gone) grey[to + x] = 0;
        any = any || gone;
      }
    }
    return any;
  }

  bool read_values(const PixelBox& box, float* values, std::uint8_t* missing) override {
    grey_.resize(box.pixels());
    const bool any = read(box, {}, grey_.data(), missing, box.width());
    std::copy(grey_.begin(), grey_.end(), values);
    return any;
  }

 private:
  const Raster& raster_;
  std::vector<std::uint8_t> grey_;
};

class MemorySource final : public RasterSource {
 public:
  explicit MemorySource(const Raster& raster) : raster_(raster) {
    facts_.name = "raster in memory";
    facts_.width = raster.width;
    facts_.height = raster.height;
    facts_.geo = raster.geo;
    facts_.reference_system = raster.reference_system;
    facts_.all_valid = raster.valid.empty();
    facts_.block_width = raster.width;
    facts_.block_height = 1;
  }

  const RasterFacts& facts() const override { return facts_; }
  std::unique_ptr<RasterReader> reader() const override { return std::make_unique<MemoryReader>(raster_); }

 private:
  const Raster& raster_;
  RasterFacts facts_;
};

/// `raster` must outlive it.
inline std::unique_ptr<RasterSource> view_of(const Raster& raster) {
  return std::make_unique<MemorySource>(raster);
}

/// Boulders of a raster by MapBuild, on one thread.
inline std::vector<TableBoulder> detect_boulders(const Raster& raster, const DetectorParams& params,
                                                 const ShareDone& done = {}) {
  const std::unique_ptr<RasterSource> source = view_of(raster);
  const MpiRanks alone;
  BuildSettings settings;
  settings.threads = 1;
  settings.done = done;
  Detection detection;
  detection.otsu = params;
  return MapBuild(*source, detection, settings, alone).run();
}

/// All boulders of a raster by their shadows.
inline std::vector<TableBoulder> detect_boulders_by_shadow(const Raster& raster, const Sun& sun,
                                                           const ShadowParams& params) {
  const PixelRect all{0, 0, raster.width, raster.height};
  std::vector<TableBoulder> boulders;
  for (const ShadowBoulder& b : detect_boulders_by_shadow({all, raster.grey_view(), raster.valid_view()}, all,
                                                          shadow_view(sun, raster.geo), params)) {
    boulders.push_back(table_boulder(b, raster.geo));
  }
  return boulders;
}

// The detector's kernels on whole images, one call each.

inline PixelBox box_of(const ImageU8& image) { return {0, 0, image.width, image.height}; }

inline std::vector<std::uint8_t> packed(const ImageU8& image) {
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < image.height; ++y)
    pixels.insert(pixels.end(), image.row(y), image.row(y) + image.width);
  return pixels;
}

/// A row as zeros and ones.
inline void to_ones(const std::uint8_t* from, std::vector<std::uint8_t>& to) {
  for (std::size_t x = 0; x < to.size(); ++x) to[x] = from[x] != 0 ? 1 : 0;
}

/// DifferenceRows over the image. `valid.data` null: every pixel is; otherwise 0 = no data.
inline void difference_from_surroundings(const ImageU8& grey, const ImageU8& valid, int radius,
                                         const MutableImageU8& out) {
  Raster raster;
  raster.width = grey.width;
  raster.height = grey.height;
  raster.grey = packed(grey);
  if (valid.data != nullptr) raster.valid = packed(valid);
  const std::unique_ptr<RasterReader> reader = view_of(raster)->reader();
  const PixelBox box = box_of(grey);
  RowWindow window(*reader, {}, box, DifferenceRows::rows_kept(radius), raster.valid.empty());
  DifferenceRows rows(window, box, box, radius);
  for (int y = 0; y < grey.height; ++y) rows.next(out.row(y));
}

/// MedianRows of side `side` (odd, at most 15) over a mask of zeros and non-zeros; gives 0 and 255.
inline void median_of_mask(const ImageU8& mask, int side, const MutableImageU8& out) {
  MedianRows median(box_of(mask), box_of(mask), side / 2);
  std::vector<std::uint8_t> row(static_cast<std::size_t>(mask.width));
  int done = 0;
  for (int y = 0; y < mask.height; ++y) {
    to_ones(mask.row(y), row);
    for (median.push(row.data()); median.ready(); ++done) {
      median.pop(row.data());
      for (std::size_t x = 0; x < row.size(); ++x) out.row(done)[x] = row[x] != 0 ? 255 : 0;
    }
  }
}

/// The 8-connected components of the non-zero pixels, in the order of their first pixel (row by row).
/// `values` (same size) is summed over each.
inline std::vector<Component> connected_components(const ImageU8& mask, const ImageU8& values) {
  TileLabeller labeller(box_of(mask), box_of(mask));
  std::vector<std::uint8_t> row(static_cast<std::size_t>(mask.width));
  for (int y = 0; y < mask.height; ++y) {
    to_ones(mask.row(y), row);
    labeller.push(row.data(), values.row(y));
  }
  return labeller.finish().closed;
}

}  // namespace cairn::test
