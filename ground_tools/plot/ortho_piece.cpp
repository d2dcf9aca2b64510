#include "plot/ortho_piece.hpp"

#include <gdal_priv.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/quiet_gdal.hpp"
#include "base/tool_error.hpp"
#include "plot/canvas.hpp"
#include "plot/jpeg.hpp"

namespace cairn::ground {
namespace {

struct Window {
  int x = 0, y = 0, width = 0, height = 0;           // in the orthoimage
  int out_width = 0, out_height = 0, out_bands = 0;  // in the piece
};

/// All bands of the window, one after the other, 0 to 255.
std::vector<std::uint8_t> read_stretched(GDALDataset& data, const Window& w, QuietGdal& gdal) {
  const std::size_t area = static_cast<std::size_t>(w.out_width) * static_cast<std::size_t>(w.out_height);
  std::vector<float> samples(area * static_cast<std::size_t>(w.out_bands));
  std::vector<bool> valid(samples.size(), true);
  GDALRasterIOExtraArg resample;
  INIT_RASTERIO_EXTRA_ARG(resample);
  resample.eResampleAlg = GRIORA_Average;
  for (int b = 0; b < w.out_bands; ++b) {
    GDALRasterBand* const band = data.GetRasterBand(b + 1);
    float* const out = samples.data() + area * static_cast<std::size_t>(b);
    gdal.check(band->RasterIO(GF_Read, w.x, w.y, w.width, w.height, out, w.out_width, w.out_height,
                              GDT_Float32, 0, 0, &resample));
    int has_no_data = 0;
    const auto no_data = static_cast<float>(band->GetNoDataValue(&has_no_data));
    for (std::size_t i = 0; i < area; ++i) {
      valid[area * static_cast<std::size_t>(b) + i] =
          std::isfinite(out[i]) && !(has_no_data != 0 && out[i] == no_data);
    }
  }
  std::vector<float> good;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (valid[i]) good.push_back(samples[i]);
  }
  const GreyStretch stretch(std::move(good));
  std::vector<std::uint8_t> bytes(samples.size(), 255);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (valid[i]) bytes[i] = stretch.level(samples[i]);
  }
  return bytes;
}

}  // namespace

OrthoPiece read_ortho_piece(const std::filesystem::path& path, const Box& box, int max_side_px) {
  QuietGdal gdal;
  const std::unique_ptr<GDALDataset> data = open_raster(path.string(), "an orthoimage", gdal);
  double gt[6] = {};
  if (data->GetGeoTransform(gt) != CE_None || gt[2] != 0.0 || gt[4] != 0.0 || !(gt[1] > 0.0) ||
      !(gt[5] < 0.0)) {
    throw ToolError("{}: not a north-up image with geo-registration; warp it first (gdalwarp)",
                    path.string());
  }
  const auto bound = [](double at, int size) {
    return static_cast<int>(std::clamp(at, 0.0, static_cast<double>(size)));
  };
  const int x0 = bound(std::floor((box.low_m.x() - gt[0]) / gt[1]), data->GetRasterXSize());
  const int x1 = bound(std::ceil((box.high_m.x() - gt[0]) / gt[1]), data->GetRasterXSize());
  const int y0 = bound(std::floor((box.high_m.y() - gt[3]) / gt[5]), data->GetRasterYSize());
  const int y1 = bound(std::ceil((box.low_m.y() - gt[3]) / gt[5]), data->GetRasterYSize());
  OrthoPiece piece;
  piece.box.low_m = Vec2(gt[0] + x0 * gt[1], gt[3] + y1 * gt[5]);
  piece.box.high_m = Vec2(gt[0] + x1 * gt[1], gt[3] + y0 * gt[5]);
  if (x0 >= x1 || y0 >= y1) return piece;

  const double shrink = std::min(1.0, static_cast<double>(max_side_px) / std::max(x1 - x0, y1 - y0));
  Window window{x0, y0, x1 - x0, y1 - y0, 0, 0, data->GetRasterCount() >= 3 ? 3 : 1};
  window.out_width = std::max(1, static_cast<int>(shrink * window.width));
  window.out_height = std::max(1, static_cast<int>(shrink * window.height));
  const std::vector<std::uint8_t> bytes = read_stretched(*data, window, gdal);
  if (gdal.failed())
    throw ToolError("{}: cannot be read whole{}; check the file", path.string(), gdal.reason());
  piece.base64 = jpeg_base64(bytes, window.out_width, window.out_height, window.out_bands, 85);
  return piece;
}

}  // namespace cairn::ground
