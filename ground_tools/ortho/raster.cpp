#include "ortho/raster.hpp"

#include <algorithm>

#include "base/tool_error.hpp"
#include "ortho/grey_range.hpp"
#include "ortho/raster_source.hpp"

namespace cairn::ground {

Raster read_orthoimage(const std::filesystem::path& path, int band) {
  const std::unique_ptr<RasterSource> source = open_orthoimage(path, band);
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

MapExtent extent_of(const GeoTransform& geo, int width, int height) {
  MapExtent e;
  for (int i = 0; i < 4; ++i) {
    const Vec2 p = geo.to_map(i % 2 == 0 ? -0.5 : width - 0.5, i / 2 == 0 ? -0.5 : height - 0.5);
    e = i == 0 ? MapExtent{p.x(), p.y(), p.x(), p.y()}
               : MapExtent{std::min(e.min_x_m, p.x()), std::min(e.min_y_m, p.y()), std::max(e.max_x_m, p.x()),
                           std::max(e.max_y_m, p.y())};
  }
  return e;
}

MapExtent extent_of(const Raster& raster) { return extent_of(raster.geo, raster.width, raster.height); }

}  // namespace cairn::ground
