#include "map/quicklook.hpp"

#include <gdal_priv.h>
#include <gdalwarper.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "base/output_file.hpp"
#include "base/quiet_gdal.hpp"
#include "base/tool_error.hpp"
#include "ortho/raster.hpp"
#include "ortho/reference_system.hpp"
#include "plot/canvas.hpp"

namespace cairn::ground {
namespace {

using Dataset = std::unique_ptr<GDALDataset>;

constexpr Colour kNoData{16, 24, 48};
constexpr Colour kPlain{70, 70, 70};
constexpr Colour kWhite{255, 255, 255};
constexpr Colour kBlack{0, 0, 0};

/// Red, yellow, cyan: told apart on grey, and by who does not tell red from green.
Colour colour_of(double confidence) {
  constexpr double kStops[3][3] = {{235, 40, 60}, {255, 205, 40}, {60, 225, 255}};
  const double at = 2.0 * std::clamp(std::isfinite(confidence) ? confidence : 0.0, 0.0, 1.0);
  const int from = at < 1.0 ? 0 : 1;
  Colour colour{};
  for (std::size_t i = 0; i < 3; ++i)
    colour[i] =
        static_cast<std::uint8_t>(kStops[from][i] + (at - from) * (kStops[from + 1][i] - kStops[from][i]));
  return colour;
}

struct Picture {
  Canvas canvas;
  GeoTransform geo;  ///< of the canvas
};

/// A whole number of times larger where it is small, else as much smaller as it must be.
double magnification(int longest_px, int max_side_px) {
  if (longest_px > max_side_px) return static_cast<double>(max_side_px) / longest_px;
  return std::clamp(max_side_px / std::max(longest_px, 1), 1, 4);
}

Picture plain_picture(const MapExtent& extent, int max_side_px) {
  const double width_m = extent.max_x_m - extent.min_x_m;
  const double height_m = extent.max_y_m - extent.min_y_m;
  const double pixel_m = std::max(width_m, height_m) / max_side_px;
  const auto side = [&](double length_m) {
    return std::max(1, static_cast<int>(std::ceil(length_m / pixel_m - 1e-9)));
  };
  GeoTransform geo{{extent.min_x_m, pixel_m, 0.0, extent.max_y_m, 0.0, -pixel_m}};
  return {Canvas(side(width_m), side(height_m), kPlain), geo};
}

struct Window {
  int x = 0, y = 0, width = 0, height = 0;
};

/// The orthoimage's pixels that the extent touches.
Window window_of(GDALDataset& ortho, const GeoTransform& geo, const MapExtent& extent) {
  double inverse[6] = {};
  if (GDALInvGeoTransform(const_cast<double*>(geo.c), inverse) == 0) return {};
  double low[2] = {INFINITY, INFINITY};
  double high[2] = {-INFINITY, -INFINITY};
  for (const double x : {extent.min_x_m, extent.max_x_m}) {
    for (const double y : {extent.min_y_m, extent.max_y_m}) {
      const double at[2] = {inverse[0] + x * inverse[1] + y * inverse[2],
                            inverse[3] + x * inverse[4] + y * inverse[5]};
      for (int i = 0; i < 2; ++i) {
        low[i] = std::min(low[i], at[i]);
        high[i] = std::max(high[i], at[i]);
      }
    }
  }
  const auto bound = [](double at, int size) { return static_cast<int>(std::clamp(at, 0.0, 1.0 * size)); };
  // A thousandth of a pixel is rounding of the extent, not a pixel more.
  const int x0 = bound(std::floor(low[0] + 1e-3), ortho.GetRasterXSize());
  const int x1 = bound(std::ceil(high[0] - 1e-3), ortho.GetRasterXSize());
  const int y0 = bound(std::floor(low[1] + 1e-3), ortho.GetRasterYSize());
  const int y1 = bound(std::ceil(high[1] - 1e-3), ortho.GetRasterYSize());
  return {x0, y0, std::max(0, x1 - x0), std::max(0, y1 - y0)};
}

struct Grey {
  std::vector<float> values;
  std::vector<std::uint8_t> valid;
};

struct Reading {
  const std::function<void(double)>* show;
  double done = 0.0;
  double share = 1.0;
};

int CPL_STDCALL on_progress(double share, const char*, void* user) {
  const auto* const reading = static_cast<const Reading*>(user);
  (*reading->show)(reading->done + share * reading->share);
  return TRUE;
}

Grey read_reduced(GDALDataset& ortho, const Window& w, int width, int height, const QuicklookParams& params,
                  QuietGdal& gdal) {
  std::vector<int> bands{std::max(1, params.band)};
  if (params.band == 0 && ortho.GetRasterCount() >= 3) bands = {1, 2, 3};
  const std::size_t area = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  Grey grey{std::vector<float>(area, 0.0F), std::vector<std::uint8_t>(area, 255)};
  std::vector<float> one(area);
  std::vector<std::uint8_t> mask(area);
  GDALRasterIOExtraArg how;
  INIT_RASTERIO_EXTRA_ARG(how);
  how.eResampleAlg = width < w.width ? GRIORA_Average : GRIORA_Cubic;
  Reading reading{&params.progress, 0.0, 1.0 / static_cast<double>(bands.size())};
  how.pfnProgress = on_progress;
  how.pProgressData = &reading;
  for (const int b : bands) {
    GDALRasterBand& band = *ortho.GetRasterBand(b);
    gdal.check(band.RasterIO(GF_Read, w.x, w.y, w.width, w.height, one.data(), width, height, GDT_Float32, 0,
                             0, &how));
    reading.done += reading.share;
    const bool masked = band.GetMaskFlags() != GMF_ALL_VALID;
    if (masked) {
      gdal.check(band.GetMaskBand()->RasterIO(GF_Read, w.x, w.y, w.width, w.height, mask.data(), width,
                                              height, GDT_Byte, 0, 0, nullptr));
    }
    for (std::size_t i = 0; i < area; ++i) {
      grey.values[i] += one[i];
      if (!std::isfinite(one[i]) || (masked && mask[i] == 0)) grey.valid[i] = 0;
    }
  }
  return grey;
}

void paint(Canvas& canvas, const Grey& grey) {
  std::vector<float> good;
  for (std::size_t i = 0; i < grey.values.size(); ++i) {
    if (grey.valid[i] != 0) good.push_back(grey.values[i]);
  }
  const GreyStretch stretch(std::move(good));
  for (int y = 0; y < canvas.height(); ++y) {
    for (int x = 0; x < canvas.width(); ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(canvas.width()) +
                            static_cast<std::size_t>(x);
      const std::uint8_t level = stretch.level(grey.values[i]);
      canvas.mix(x, y, grey.valid[i] != 0 ? Colour{level, level, level} : kNoData, 1.0);
    }
  }
}

/// The image as it looks in the map's system; null where it is in it, or either has none.
std::unique_ptr<GDALDataset> in_system(GDALDataset& image, const std::string& reference_system) {
  const std::string own = reference_text(image.GetSpatialRef());
  if (is_local_reference(own) || is_local_reference(reference_system) ||
      same_reference(own, reference_system))
    return nullptr;
  const OGRSpatialReference wanted = reference_of(reference_system, "the map");
  char* text = nullptr;
  wanted.exportToWkt(&text);
  std::unique_ptr<GDALDataset> turned(GDALDataset::FromHandle(
      GDALAutoCreateWarpedVRT(GDALDataset::ToHandle(&image), nullptr, text, GRA_Bilinear, 0.1, nullptr)));
  CPLFree(text);
  if (turned == nullptr)
    throw ToolError("{}: is in {}, the map in {}, and neither can be drawn in the other; use gdalwarp -t_srs",
                    image.GetDescription(), own, reference_system);
  return turned;
}

Picture picture_of(const MapExtent& extent, const std::string& reference_system,
                   const QuicklookParams& params) {
  const std::string name = params.ortho.string();
  QuietGdal gdal;
  std::unique_ptr<GDALDataset> image = open_raster(name, "an orthoimage", gdal);
  std::unique_ptr<GDALDataset> turned = in_system(*image, reference_system);
  GDALDataset* const ortho = turned != nullptr ? turned.get() : image.get();
  if (params.band < 0 || params.band > ortho->GetRasterCount())
    throw ToolError("{}: has no band {}; choose --band 1 to {}", name, params.band, ortho->GetRasterCount());
  GeoTransform geo;
  if (ortho->GetGeoTransform(geo.c) != CE_None)
    throw ToolError("{}: has no geo-reference; give the orthoimage that the map was made from", name);
  const Window w = window_of(*ortho, geo, extent);
  if (w.width == 0 || w.height == 0)
    throw ToolError("{}: does not overlap the mapped area; give the orthoimage of this site", name);
  const double zoom = magnification(std::max(w.width, w.height), params.max_side_px);
  const int width = std::max(1, static_cast<int>(std::lround(w.width * zoom)));
  const int height = std::max(1, static_cast<int>(std::lround(w.height * zoom)));
  const Grey grey = read_reduced(*ortho, w, width, height, params, gdal);
  if (gdal.failed()) throw ToolError("{}: cannot be read whole{}; check the file", name, gdal.reason());
  const double across = static_cast<double>(w.width) / width;
  const double down = static_cast<double>(w.height) / height;
  const double* c = geo.c;
  Picture picture{Canvas(width, height),
                  {{c[0] + w.x * c[1] + w.y * c[2], c[1] * across, c[2] * down,
                    c[3] + w.x * c[4] + w.y * c[5], c[4] * across, c[5] * down}}};
  paint(picture.canvas, grey);
  return picture;
}

void draw_boulders(Picture& picture, const std::vector<TableBoulder>& boulders) {
  double inverse[6] = {};
  if (GDALInvGeoTransform(picture.geo.c, inverse) == 0) return;
  std::vector<std::size_t> order(boulders.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  // The surer lie on top.
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return boulders[a].confidence < boulders[b].confidence;
  });
  constexpr double kLeastRadius = 2.0;
  const double line_px =
      std::clamp(std::max(picture.canvas.width(), picture.canvas.height()) / 900.0, 1.0, 2.0);
  const double per_metre = 1.0 / picture.geo.pixel_m();
  for (const std::size_t i : order) {
    const TableBoulder& b = boulders[i];
    const double u = inverse[0] + b.p_map_m.x() * inverse[1] + b.p_map_m.y() * inverse[2] - 0.5;
    const double v = inverse[3] + b.p_map_m.x() * inverse[4] + b.p_map_m.y() * inverse[5] - 0.5;
    if (!std::isfinite(u) || !std::isfinite(v)) continue;
    const double radius = std::max(kLeastRadius, 0.5 * b.diameter_m * per_metre);
    picture.canvas.circle(u, v, radius, line_px, colour_of(b.confidence));
  }
}

/// 1, 2 or 5 times a power of ten, at most `longest_m`.
double round_length_m(double longest_m) {
  const double ten = std::pow(10.0, std::floor(std::log10(longest_m)));
  return longest_m >= 5.0 * ten ? 5.0 * ten : longest_m >= 2.0 * ten ? 2.0 * ten : ten;
}

std::string length_text(double length_m) {
  if (length_m >= 1000.0) return fmt::format("{:g} km", length_m / 1000.0);
  return length_m < 1.0 ? fmt::format("{:g} cm", 100.0 * length_m) : fmt::format("{:g} m", length_m);
}

void draw_legend(Picture& picture, std::size_t count) {
  Canvas& canvas = picture.canvas;
  const int zoom = std::max(canvas.width(), canvas.height()) >= 1200 ? 2 : 1;
  const int gap = 5 * zoom;
  const double pixel_m = picture.geo.pixel_m();
  const double length_m = round_length_m(90.0 * zoom * pixel_m);
  const int bar = static_cast<int>(std::lround(length_m / pixel_m));
  const std::string length = length_text(length_m);
  const std::string boulders = fmt::format("{} boulders", count);
  const int column = Canvas::text_width("confidence", zoom) + gap;
  const int colours = 60 * zoom;
  const int width =
      4 * gap + std::max({bar + gap + Canvas::text_width(length, zoom), Canvas::text_width(boulders, zoom),
                          column + colours + 2 * gap + Canvas::text_width("01", zoom)});
  const int line = 11 * zoom;
  const int height = 3 * line + 2 * gap;
  if (width > canvas.width() || height > canvas.height()) return;  // a picture that small tells no more
  const int x = 2 * gap;
  int y = canvas.height() - height + gap;
  canvas.rectangle(0, canvas.height() - height, width, height, kBlack, 0.6);
  canvas.text(x, y, boulders, kWhite, zoom);
  y += line;
  canvas.rectangle(x, y + 2 * zoom, bar, 3 * zoom, kWhite);
  canvas.text(x + bar + gap, y, length, kWhite, zoom);
  y += line;
  canvas.text(x, y, "confidence", kWhite, zoom);
  canvas.text(x + column, y, "0", kWhite, zoom);
  const int from = x + column + Canvas::text_width("0", zoom) + gap / 2;
  for (int i = 0; i < colours; ++i)
    canvas.rectangle(from + i, y, 1, 7 * zoom, colour_of(static_cast<double>(i) / (colours - 1)));
  canvas.text(from + colours + gap / 2 + zoom, y, "1", kWhite, zoom);
}

void write_png(const std::filesystem::path& path, const Picture& picture,
               const std::string& reference_system) {
  OGRSpatialReference system = reference_of(reference_system, path.string());
  OutputByName output(path);
  QuietGdal gdal;
  GDALDriverManager* const drivers = GetGDALDriverManager();
  GDALDriver* const png = drivers->GetDriverByName("PNG");
  const Canvas& canvas = picture.canvas;
  if (png == nullptr) throw ToolError("{}: this GDAL cannot write PNG; install one that does", path.string());
  {
    const Dataset memory(
        drivers->GetDriverByName("MEM")->Create("", canvas.width(), canvas.height(), 3, GDT_Byte, nullptr));
    gdal.check(memory->RasterIO(GF_Write, 0, 0, canvas.width(), canvas.height(),
                                const_cast<std::uint8_t*>(canvas.planes().data()), canvas.width(),
                                canvas.height(), GDT_Byte, 3, nullptr, 0, 0, 0, nullptr));
    gdal.check(memory->SetGeoTransform(const_cast<double*>(picture.geo.c)));
    gdal.check(memory->SetSpatialRef(&system));
    const Dataset written(png->CreateCopy(output.file().c_str(), memory.get(), 0, nullptr, nullptr, nullptr));
    if (written == nullptr) gdal.check(CE_Failure);
  }
  if (gdal.failed())
    throw ToolError("{}: writing failed{}; free some disk space and run again", path.string(), gdal.reason());
  output.commit({".aux.xml"});
}

}  // namespace

QuicklookFacts write_quicklook(const std::filesystem::path& path, const std::vector<TableBoulder>& boulders,
                               const MapExtent& extent, const std::string& reference_system,
                               const QuicklookParams& params) {
  check_range("--max-side", params.max_side_px, 100, 10000);
  if (!(extent.max_x_m > extent.min_x_m && extent.max_y_m > extent.min_y_m))
    throw ToolError("{}: the map covers no area; there is nothing to show", path.string());
  Picture picture = params.ortho.empty() ? plain_picture(extent, params.max_side_px)
                                         : picture_of(extent, reference_system, params);
  draw_boulders(picture, boulders);
  draw_legend(picture, boulders.size());
  write_png(path, picture, reference_system);
  return {picture.canvas.width(), picture.canvas.height(), picture.geo.pixel_m()};
}

}  // namespace cairn::ground
