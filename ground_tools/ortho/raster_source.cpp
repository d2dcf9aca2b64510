#include "ortho/raster_source.hpp"

#include <gdal_priv.h>
#include <ogr_spatialref.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/quiet_gdal.hpp"
#include "base/tool_error.hpp"
#include "ortho/reference_system.hpp"
#include "ortho/sun_label.hpp"

namespace cairn::ground {
namespace {

constexpr float kMostValue = 3.4e38F;

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
        "{}: its geo-reference gives pixels of no area; correct the geo-transform or the world file", name);
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
  if (count == 0) throw ToolError("{}: has no image band; give an orthoimage", name);
  if (band < 0 || band > count)
    throw ToolError("{}: has no band {}; choose --band 1 to {}", name, band, count);
  std::vector<int> bands = {band > 0 ? band : 1};
  if (band == 0 && count >= 3) bands = {1, 2, 3};
  for (const int b : bands) {
    if (GDALDataTypeIsComplex(data.GetRasterBand(b)->GetRasterDataType()) != 0)
      throw ToolError("{}: band {} contains complex numbers; give an image of brightness", name, b);
  }
  return bands;
}

PixelDepth depth_of(GDALDataset& data, const std::vector<int>& bands) {
  const GDALDataType type = data.GetRasterBand(bands[0])->GetRasterDataType();
  if (type == GDT_Byte) return PixelDepth::kEight;
  if (bands.size() == 1 && (type == GDT_UInt16 || type == GDT_Int16)) return PixelDepth::kSixteen;
  return PixelDepth::kReal;
}

/// Size and time of every file that the image is made of: a VRT's pieces and labels among them.
std::string identity_of(GDALDataset& data) {
  std::string text;
  char** const files = data.GetFileList();
  for (int i = 0; i < CSLCount(files); ++i) {
    struct stat facts = {};
    if (::stat(files[i], &facts) != 0) continue;
    text += fmt::format("{} {} {}.{:09}\n", std::filesystem::path(files[i]).filename().string(),
                        static_cast<long long>(facts.st_size), static_cast<long long>(facts.st_mtim.tv_sec),
                        static_cast<long long>(facts.st_mtim.tv_nsec));
  }
  CSLDestroy(files);
  return text;
}

/// What of a band is missing, apart from what is no number.
enum class Mask : std::uint8_t { kNone, kByteValue, kBand };

struct Band {
  GDALRasterBand* band = nullptr;
  Mask mask = Mask::kNone;
  std::uint8_t no_data = 0;
};

class GdalReader final : public RasterReader {
 public:
  GdalReader(const std::string& name, const std::vector<int>& bands) : name_(name) {
    data_.reset(GDALDataset::Open(name.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY));
    if (data_ == nullptr) {
      throw ToolError("{}: cannot be opened as an image{}; is the file whole, and of a format of GDAL?", name,
                      quiet_.reason());
    }
    for (const int b : bands) bands_.push_back(band_of(b));
  }

  bool read(const PixelBox& box, const GreyRange& range, std::uint8_t* grey, std::uint8_t* missing,
            int stride) override {
    if (bands_.size() == 1 && bands_[0].band->GetRasterDataType() == GDT_Byte)
      return read_bytes(box, grey, missing, stride);
    values_.resize(box.pixels());
    flags_.resize(box.pixels());
    const bool any = read_values(box, values_.data(), flags_.data());
    const float scale = 255.0F / (range.high - range.low);
    const std::size_t width = static_cast<std::size_t>(box.width());
    for (std::size_t y = 0; y < static_cast<std::size_t>(box.height()); ++y) {
      const float* from = &values_[y * width];
      const std::uint8_t* flag = &flags_[y * width];
      std::uint8_t* to = grey + y * static_cast<std::size_t>(stride);
      for (std::size_t x = 0; x < width; ++x) {
        const float value = any && flag[x] != 0 ? 0.0F : (from[x] - range.low) * scale + 0.5F;
        to[x] = static_cast<std::uint8_t>(std::min(std::max(value, 0.0F), 255.0F));
      }
      if (any) std::memcpy(missing + y * static_cast<std::size_t>(stride), flag, width);
    }
    return any;
  }

  bool read_values(const PixelBox& box, float* values, std::uint8_t* missing) override {
    const std::size_t pixels = box.pixels();
    std::memset(missing, 0, pixels);
    const float share = 1.0F / static_cast<float>(bands_.size());
    unsigned any = 0;
    for (std::size_t b = 0; b < bands_.size(); ++b) {
      const bool first = b == 0;
      if (!first) one_.resize(pixels);
      float* const to = first ? values : one_.data();
      read_window(*bands_[b].band, box, GDT_Float32, to, box.width());
      const bool whole = bands_[b].band->GetRasterDataType() != GDT_Float32 &&
                         bands_[b].band->GetRasterDataType() != GDT_Float64;
      for (std::size_t i = 0; !whole && i < pixels; ++i) {
        const bool number = std::fabs(to[i]) < kMostValue;  // false for a NaN, too
        missing[i] = number ? missing[i] : 1;
        any |= number ? 0U : 1U;
      }
      if (bands_.size() > 1) {
        for (std::size_t i = 0; i < pixels; ++i) values[i] = (first ? 0.0F : values[i]) + to[i] * share;
      }
      any |= add_mask(bands_[b], box, missing) ? 1U : 0U;
    }
    return any != 0;
  }

 private:
  Band band_of(int number) {
    Band b;
    b.band = data_->GetRasterBand(number);
    const int flags = b.band->GetMaskFlags();
    if (flags == GMF_ALL_VALID) return b;
    b.mask = Mask::kBand;
    if (flags == GMF_NODATA && b.band->GetRasterDataType() == GDT_Byte) {
      const double value = b.band->GetNoDataValue();
      b.mask = value >= 0.0 && value <= 255.0 ? Mask::kByteValue : Mask::kNone;
      if (b.mask == Mask::kByteValue) b.no_data = static_cast<std::uint8_t>(value);
    }
    return b;
  }

  void read_window(GDALRasterBand& band, const PixelBox& box, GDALDataType type, void* to, int stride) {
    const int bytes = GDALGetDataTypeSizeBytes(type);
    const CPLErr result =
        band.RasterIO(GF_Read, box.x0, box.y0, box.width(), box.height(), to, box.width(), box.height(), type,
                      bytes, static_cast<GSpacing>(bytes) * stride, nullptr);
    if (result != CE_None) {
      throw BadImage("{}: cannot be read to its end{}; is the file whole?", name_, quiet_.reason());
    }
  }

  /// 8 bits of one band, straight to where they belong.
  bool read_bytes(const PixelBox& box, std::uint8_t* grey, std::uint8_t* missing, int stride) {
    const Band& band = bands_[0];
    read_window(*band.band, box, GDT_Byte, grey, stride);
    if (band.mask == Mask::kNone) return false;
    if (band.mask == Mask::kBand) read_window(*band.band->GetMaskBand(), box, GDT_Byte, missing, stride);
    const auto width = static_cast<std::size_t>(box.width());
    unsigned any = 0;
    for (int y = 0; y < box.height(); ++y) {
      std::uint8_t* const g = grey + static_cast<std::size_t>(y) * static_cast<std::size_t>(stride);
      std::uint8_t* const m = missing + static_cast<std::size_t>(y) * static_cast<std::size_t>(stride);
      for (std::size_t x = 0; x < width; ++x) {
        const bool gone = band.mask == Mask::kBand ? m[x] == 0 : g[x] == band.no_data;
        m[x] = gone ? 1 : 0;
        g[x] = gone ? 0 : g[x];
        any |= m[x];
      }
    }
    return any != 0;
  }

  bool add_mask(const Band& band, const PixelBox& box, std::uint8_t* missing) {
    if (band.mask == Mask::kNone) return false;
    mask_.resize(box.pixels());
    read_window(*band.band->GetMaskBand(), box, GDT_Byte, mask_.data(), box.width());
    unsigned any = 0;
    for (std::size_t i = 0; i < mask_.size(); ++i) {
      const std::uint8_t gone = mask_[i] == 0 ? 1 : 0;
      missing[i] |= gone;
      any |= gone;
    }
    return any != 0;
  }

  QuietGdal quiet_;
  std::string name_;
  std::unique_ptr<GDALDataset> data_;
  std::vector<Band> bands_;
  std::vector<float> values_;
  std::vector<float> one_;
  std::vector<std::uint8_t> flags_;
  std::vector<std::uint8_t> mask_;
};

class GdalSource final : public RasterSource {
 public:
  GdalSource(const std::filesystem::path& path, int band) {
    const QuietGdal quiet;
    facts_.name = path.string();
    const std::string& name = facts_.name;
    const std::unique_ptr<GDALDataset> data(
        GDALDataset::Open(name.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY));
    if (data == nullptr) {
      // GDAL also opens what is no file (vsi paths, connection strings): only now is that worth a look.
      if (!std::filesystem::exists(path)) throw ToolError("{}: no such file; check the name", name);
      throw ToolError("{}: cannot be opened as an image{}; is the file whole, and of a format of GDAL?", name,
                      quiet.reason());
    }
    bands_ = bands_to_read(*data, band, name);
    facts_.geo = geo_transform_of(*data, name);
    facts_.reference_system = reference_system_of(*data, name);
    facts_.width = data->GetRasterXSize();
    facts_.height = data->GetRasterYSize();
    facts_.depth = depth_of(*data, bands_);
    facts_.all_valid = facts_.depth == PixelDepth::kEight || facts_.depth == PixelDepth::kSixteen;
    for (const int b : bands_)
      facts_.all_valid = facts_.all_valid && data->GetRasterBand(b)->GetMaskFlags() == GMF_ALL_VALID;
    data->GetRasterBand(bands_[0])->GetBlockSize(&facts_.block_width, &facts_.block_height);
    facts_.identity = identity_of(*data);
    for (const int b : bands_) facts_.identity += fmt::format("band {}\n", b);
    facts_.sun = find_sun(*data);
  }

  const RasterFacts& facts() const override { return facts_; }
  std::unique_ptr<RasterReader> reader() const override {
    return std::make_unique<GdalReader>(facts_.name, bands_);
  }

 private:
  RasterFacts facts_;
  std::vector<int> bands_;
};

}  // namespace

std::unique_ptr<RasterSource> open_orthoimage(const std::filesystem::path& path, int band) {
  return std::make_unique<GdalSource>(path, band);
}

}  // namespace cairn::ground
