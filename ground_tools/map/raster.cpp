#include "map/raster.hpp"

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <memory>
#include <string>

#include "map/reference_system.hpp"
#include "tool_error.hpp"

namespace cairn::ground {
namespace {

/// Keeps GDAL from printing while it lives; `reason()` is its last message, on one line.
class QuietGdal {
 public:
  QuietGdal() {
    GDALAllRegister();
    CPLSetConfigOption("GDAL_ERROR_ON_LIBJPEG_WARNING", "TRUE");  // a truncated JPEG is an error here
    CPLErrorReset();
    CPLPushErrorHandler(CPLQuietErrorHandler);
  }
  ~QuietGdal() { CPLPopErrorHandler(); }
  QuietGdal(const QuietGdal&) = delete;
  QuietGdal& operator=(const QuietGdal&) = delete;

  static std::string reason() {
    std::string text = CPLGetLastErrorMsg();
    std::replace(text.begin(), text.end(), '\n', ' ');
    return text.empty() ? "no reason given" : text;
  }
};

GeoTransform geo_transform_of(GDALDataset& data, const std::string& name) {
  GeoTransform geo;
  if (data.GetGeoTransform(geo.c) != CE_None) {
    throw ToolError(
        "{}: has no geo-reference; give a GeoTIFF, or put a world file (six lines, same name, .tfw, .pgw or "
        ".wld) beside it",
        name);
  }
  if (!(geo.pixel_area_m2() > 0.0) || !std::isfinite(geo.pixel_area_m2()) || !std::isfinite(geo.c[0]) ||
      !std::isfinite(geo.c[3])) {
    throw ToolError(
        "{}: its geo-reference gives pixels without area; mend the geo-transform or the world file", name);
  }
  return geo;
}

std::string reference_system_of(GDALDataset& data, const std::string& name) {
  const OGRSpatialReference* system = data.GetSpatialRef();
  if (system == nullptr) return "local";  // a world file says no more: metres are taken
  if (system->IsGeographic() != 0) {
    throw ToolError(
        "{}: its coordinates are degrees; reproject to metres first, e.g. gdalwarp -t_srs to an equidistant "
        "cylindrical or polar stereographic system",
        name);
  }
  const char* unit = nullptr;
  const double metres = system->GetLinearUnits(&unit);
  if (std::fabs(metres - 1.0) > 1e-9) {
    throw ToolError("{}: its unit is '{}' ({} m); reproject to a system in metres with gdalwarp -t_srs", name,
                    unit != nullptr ? unit : "unknown", metres);
  }
  return reference_text(system);
}

std::vector<int> bands_to_read(GDALDataset& data, int band, const std::string& name) {
  const int count = data.GetRasterCount();
  if (count == 0) throw ToolError("{}: holds no image band; give an orthoimage", name);
  if (band < 0 || band > count)
    throw ToolError("{}: has no band {}; choose --band 1 to {}", name, band, count);
  if (band > 0) return {band};
  return count >= 3 ? std::vector<int>{1, 2, 3} : std::vector<int>{1};
}

void read_band(GDALRasterBand& band, GDALDataType type, void* to, const std::string& name) {
  CPLErrorReset();
  if (band.RasterIO(GF_Read, 0, 0, band.GetXSize(), band.GetYSize(), to, band.GetXSize(), band.GetYSize(),
                    type, 0, 0, nullptr) != CE_None) {
    throw ToolError("{}: cannot be read to its end ({}); is the file whole?", name, QuietGdal::reason());
  }
}

/// Pixels of the chosen bands as floats, their mean where there are three; `valid` gets the masks' common
/// part.
std::vector<float> read_grey(GDALDataset& data, const std::vector<int>& bands,
                             std::vector<std::uint8_t>& valid, const std::string& name) {
  const std::size_t pixels = static_cast<std::size_t>(data.GetRasterXSize()) * data.GetRasterYSize();
  std::vector<float> grey(pixels, 0.0F);
  std::vector<float> one(pixels);
  std::vector<std::uint8_t> mask(pixels);
  valid.assign(pixels, 255);
  for (const int b : bands) {
    GDALRasterBand& band = *data.GetRasterBand(b);
    if (GDALDataTypeIsComplex(band.GetRasterDataType()) != 0) {
      throw ToolError("{}: band {} holds complex numbers; give an image of brightness", name, b);
    }
    read_band(band, GDT_Float32, one.data(), name);
    const float share = 1.0F / static_cast<float>(bands.size());
    for (std::size_t i = 0; i < pixels; ++i) {
      grey[i] += bands.size() == 1 ? one[i] : one[i] * share;
      if (!std::isfinite(one[i])) valid[i] = 0;
    }
    if (band.GetMaskFlags() == GMF_ALL_VALID) continue;
    read_band(*band.GetMaskBand(), GDT_Byte, mask.data(), name);
    for (std::size_t i = 0; i < pixels; ++i) {
      if (mask[i] == 0) valid[i] = 0;
    }
  }
  return grey;
}

/// Pixel values that become 0 and 255.
struct Range {
  float low = 0.0F;
  float high = 0.0F;
};

Range stretch_range(const std::vector<float>& grey, const std::vector<std::uint8_t>& valid) {
  std::vector<float> values;
  values.reserve(grey.size());
  for (std::size_t i = 0; i < grey.size(); ++i) {
    if (valid[i] != 0) values.push_back(grey[i]);
  }
  const auto at = [&](double share) {
    const auto nth =
        values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), nth, values.end());
    return *nth;
  };
  const Range clipped{at(0.001), at(0.999)};
  if (clipped.high > clipped.low) return clipped;
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return {*low, *high};
}

void check_content(const std::vector<float>& grey, const std::vector<std::uint8_t>& valid,
                   const std::string& name) {
  std::size_t first = 0;
  while (first < grey.size() && valid[first] == 0) ++first;
  if (first == grey.size()) {
    throw ToolError("{}: every pixel is marked as no data; check the no-data value, mask or alpha band",
                    name);
  }
  for (std::size_t i = first; i < grey.size(); ++i) {
    if (valid[i] != 0 && grey[i] != grey[first]) return;
  }
  throw ToolError(
      "{}: every valid pixel has the same value ({}), so there is nothing to detect; check the file", name,
      grey[first]);
}

}  // namespace

Raster read_orthoimage(const std::filesystem::path& path, int band) {
  const std::string name = path.string();
  const QuietGdal quiet;
  if (!std::filesystem::exists(path)) throw ToolError("{}: no such file; check the name", name);
  const std::unique_ptr<GDALDataset> data(GDALDataset::Open(name.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY));
  if (data == nullptr) {
    throw ToolError("{}: cannot be opened as an image ({}); is the file whole, and of a format of GDAL?",
                    name, QuietGdal::reason());
  }
  const std::vector<int> bands = bands_to_read(*data, band, name);
  Raster raster;
  raster.geo = geo_transform_of(*data, name);
  raster.reference_system = reference_system_of(*data, name);
  raster.width = data->GetRasterXSize();
  raster.height = data->GetRasterYSize();
  const std::vector<float> grey = read_grey(*data, bands, raster.valid, name);
  check_content(grey, raster.valid, name);

  Range range{0.0F, 255.0F};
  if (data->GetRasterBand(bands[0])->GetRasterDataType() != GDT_Byte)
    range = stretch_range(grey, raster.valid);
  const float scale = 255.0F / (range.high - range.low);
  raster.grey.resize(grey.size());
  for (std::size_t i = 0; i < grey.size(); ++i) {
    const float value = raster.valid[i] != 0 ? (grey[i] - range.low) * scale : 0.0F;
    raster.grey[i] = static_cast<std::uint8_t>(std::clamp(value + 0.5F, 0.0F, 255.0F));
  }
  if (std::find(raster.valid.begin(), raster.valid.end(), 0) == raster.valid.end()) raster.valid.clear();
  return raster;
}

}  // namespace cairn::ground
