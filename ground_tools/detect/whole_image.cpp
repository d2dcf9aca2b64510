#include "detect/whole_image.hpp"

#include "detect/kernels.hpp"

namespace cairn::ground {
namespace {

PixelBox box_of(const ImageU8& image) { return {0, 0, image.width, image.height}; }

std::vector<std::uint8_t> packed(const ImageU8& image) {
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < image.height; ++y)
    pixels.insert(pixels.end(), image.row(y), image.row(y) + image.width);
  return pixels;
}

/// A row as zeros and ones.
void to_ones(const std::uint8_t* from, std::vector<std::uint8_t>& to) {
  for (std::size_t x = 0; x < to.size(); ++x) to[x] = from[x] != 0 ? 1 : 0;
}

}  // namespace

void difference_from_surroundings(const ImageU8& grey, const ImageU8& valid, int radius,
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

void median_of_mask(const ImageU8& mask, int side, const MutableImageU8& out) {
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

std::vector<Component> connected_components(const ImageU8& mask, const ImageU8& values) {
  TileLabeller labeller(box_of(mask), box_of(mask));
  std::vector<std::uint8_t> row(static_cast<std::size_t>(mask.width));
  for (int y = 0; y < mask.height; ++y) {
    to_ones(mask.row(y), row);
    labeller.push(row.data(), values.row(y));
  }
  return labeller.finish().closed;
}

}  // namespace cairn::ground
