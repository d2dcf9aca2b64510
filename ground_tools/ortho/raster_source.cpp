#include "ortho/raster_source.hpp"

#include <gdal_priv.h>
#include <ogr_spatialref.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/quiet_gdal.hpp"
#include "base/tool_error.hpp"
#include "ortho/pixel_meaning.hpp"
#include "ortho/reference_system.hpp"
#include "ortho/site_frame.hpp"
#include "ortho/sun_label.hpp"
#include "ortho/unmarked_value.hpp"

namespace cairn::ground {
namespace {

constexpr float kMostValue = 3.4e38F;

GeoTransform geo_transform_of(GDALDataset& data, const std::string& name) {
  GeoTransform geo;
  if (data.GetGeoTransform(geo.c) != CE_None) {
    if (std::strncmp(data.GetDriverName(), "ISIS", 4) == 0)
      throw ToolError("{}: is an ISIS cube that is not map-projected; run cam2map on it first", name);
    if (data.GetGCPCount() > 0)
      throw ToolError(
          "{}: has ground control points instead of a geo-transform; run gdalwarp -t_srs on it first (to a system "
          "in metres)",
          name);
    if (data.GetMetadata("RPC") != nullptr)
      throw ToolError(
          "{}: has rational polynomials (RPC) instead of a geo-transform; orthorectify it first with gdalwarp -rpc "
          "-to RPC_DEM=DEM.tif -t_srs (a system in metres)",
          name);
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

std::string reference_system_of(GDALDataset& data, const GeoTransform& geo, const std::string& name) {
  const OGRSpatialReference* system = data.GetSpatialRef();
  if (system == nullptr) return "local";  // a world file says no more: metres are taken
  if (system->IsGeographic() != 0) {
    SiteFrame place;
    const Vec2 middle = geo.to_map(0.5 * (data.GetRasterXSize() - 1), 0.5 * (data.GetRasterYSize() - 1));
    place.longitude_deg = middle.x();
    place.latitude_deg = middle.y();
    throw ToolError("{}: its coordinates are degrees; reproject to metres first: gdalwarp -t_srs '{}'", name,
                    local_reference(*system, place));
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

PixelDepth depth_of(GDALDataset& data, const std::vector<int>& bands, const PixelMeaning& meaning) {
  if (bands.size() == 1 && !meaning.grey.empty()) return PixelDepth::kEight;
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

/// What of a band is missing by GDAL's masks.
enum class Mask : std::uint8_t { kNone, kByteValue, kBand };

struct Band {
  GDALRasterBand* band = nullptr;
  Mask mask = Mask::kNone;
  bool alone = false;  ///< what is missing of it is missing of the mean, too
  std::uint8_t no_data = 0;
  PixelMeaning meaning;
};

/// The bands that are read, and what their values mean.
struct BandChoice {
  int number = 1;
  PixelMeaning meaning;
};

class GdalReader final : public RasterReader {
 public:
  GdalReader(const std::string& name, const std::vector<BandChoice>& bands) : name_(name) {
    data_.reset(GDALDataset::Open(name.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY));
    if (data_ == nullptr) {
      throw ToolError("{}: cannot be opened as an image{}; is the file whole, and of a format of GDAL?", name,
                      quiet_.reason());
    }
    for (const BandChoice& b : bands) bands_.push_back(band_of(b, bands.size() > 1));
    const Band& first = bands_[0];
    if (bands.size() == 1 && first.band->GetRasterDataType() == GDT_Byte && !first.meaning.plain())
      look_up_ = table_of(first.meaning);
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
    bool gone = false;
    for (std::size_t y = 0; y < static_cast<std::size_t>(box.height()); ++y) {
      const float* from = &values_[y * width];
      const std::uint8_t* flag = &flags_[y * width];
      std::uint8_t* to = grey + y * static_cast<std::size_t>(stride);
      std::uint8_t* const out = missing + y * static_cast<std::size_t>(stride);
      for (std::size_t x = 0; x < width; ++x) {
        const float value = any && flag[x] != 0 ? 0.0F : (from[x] - range.low) * scale + 0.5F;
        to[x] = static_cast<std::uint8_t>(std::min(std::max(value, 0.0F), 255.0F));
      }
      for (std::size_t x = 0; any && x < width; ++x) {
        out[x] = flag[x] == kMissing ? 1 : 0;
        gone = gone || out[x] != 0;
        if (flag[x] == static_cast<std::uint8_t>(PixelKind::kBright)) to[x] = 255;
      }
    }
    return gone;
  }

  bool read_values(const PixelBox& box, float* values, std::uint8_t* missing) override {
    const std::size_t pixels = box.pixels();
    std::memset(missing, 0, pixels);
    const float share = 1.0F / static_cast<float>(bands_.size());
    unsigned any = 0;
    if (bands_.size() > 1) gone_.assign(pixels, 0);
    for (std::size_t b = 0; b < bands_.size(); ++b) {
      const bool first = b == 0;
      if (!first) one_.resize(pixels);
      float* const to = first ? values : one_.data();
      read_window(*bands_[b].band, box, GDT_Float32, to, box.width());
      any |= take_meaning(bands_[b], to, missing, pixels) ? 1U : 0U;
      if (bands_.size() > 1) {
        for (std::size_t i = 0; i < pixels; ++i) values[i] = (first ? 0.0F : values[i]) + to[i] * share;
      }
      any |= add_mask(bands_[b], box, missing) ? 1U : 0U;
    }
    for (std::size_t i = 0; bands_.size() > 1 && i < pixels; ++i) {
      if (gone_[i] < bands_.size()) continue;
      missing[i] = kMissing;
      any = 1;
    }
    return any != 0;
  }

 private:
  Band band_of(const BandChoice& choice, bool several) {
    Band b;
    b.band = data_->GetRasterBand(choice.number);
    b.meaning = choice.meaning;
    const int flags = b.band->GetMaskFlags();
    const GDALDataType type = b.band->GetRasterDataType();
    const bool unsigned_whole = type == GDT_Byte || type == GDT_UInt16 || type == GDT_UInt32;
    b.alone = !several || !unsigned_whole || (flags & GMF_PER_DATASET) != 0;
    if (flags == GMF_ALL_VALID || choice.meaning.lists_all) return b;
    b.mask = Mask::kBand;
    if (flags == GMF_NODATA && type == GDT_Byte) {
      const double value = b.band->GetNoDataValue();
      b.mask = value >= 0.0 && value <= 255.0 ? Mask::kByteValue : Mask::kNone;
      if (b.mask == Mask::kByteValue) b.no_data = static_cast<std::uint8_t>(value);
    }
    return b;
  }

  struct ByteMeaning {
    std::uint8_t grey = 0;
    std::uint8_t missing = 0;
  };
  static std::vector<ByteMeaning> table_of(const PixelMeaning& meaning) {
    std::vector<ByteMeaning> table(256);
    for (std::size_t i = 0; i < table.size(); ++i) {
      const auto raw = static_cast<float>(i);
      switch (meaning.kind(raw)) {
        case PixelKind::kValue:
          table[i].grey = static_cast<std::uint8_t>(std::clamp(meaning.value(raw), 0.0F, 255.0F));
          break;
        case PixelKind::kMissing: table[i].missing = 1; break;
        case PixelKind::kDark: break;
        case PixelKind::kBright: table[i].grey = 255; break;
      }
    }
    return table;
  }

  /// Raw values become brightness; kinds go to `missing`, or, where one band alone does not decide,
  /// to gone_. True: some are no values.
  bool take_meaning(const Band& band, float* values, std::uint8_t* missing, std::size_t pixels) {
    const GDALDataType type = band.band->GetRasterDataType();
    const bool real = type == GDT_Float32 || type == GDT_Float64;
    const bool plain = band.meaning.plain();
    if (plain && !real) return false;
    unsigned any = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      PixelKind kind = plain ? PixelKind::kValue : band.meaning.kind(values[i]);
      const bool number = std::fabs(values[i]) < kMostValue;  // false for a NaN, too
      if (kind == PixelKind::kValue && !number) kind = PixelKind::kMissing;
      if (kind == PixelKind::kMissing && !band.alone) {
        ++gone_[i];
      } else if (kind != PixelKind::kValue && missing[i] != kMissing) {
        missing[i] = static_cast<std::uint8_t>(kind);
        any = 1;
      }
      if (!plain && kind == PixelKind::kValue) values[i] = band.meaning.value(values[i]);
    }
    return any != 0;
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
    if (band.mask == Mask::kNone && look_up_.empty()) return false;
    if (band.mask == Mask::kBand) read_window(*band.band->GetMaskBand(), box, GDT_Byte, missing, stride);
    const auto width = static_cast<std::size_t>(box.width());
    unsigned any = 0;
    for (int y = 0; y < box.height(); ++y) {
      std::uint8_t* const g = grey + static_cast<std::size_t>(y) * static_cast<std::size_t>(stride);
      std::uint8_t* const m = missing + static_cast<std::size_t>(y) * static_cast<std::size_t>(stride);
      for (std::size_t x = 0; x < width; ++x) {
        bool gone = false;
        if (band.mask == Mask::kBand) gone = m[x] == 0;
        if (band.mask == Mask::kByteValue) gone = g[x] == band.no_data;
        if (!look_up_.empty()) {
          const ByteMeaning meaning = look_up_[g[x]];
          gone = meaning.missing != 0 || (gone && !(band.meaning.masked_special && meaning.grey == 255));
          g[x] = meaning.grey;
        }
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
      const bool special = band.meaning.masked_special && missing[i] != 0 && missing[i] != kMissing;
      if (mask_[i] != 0 || special) continue;
      if (!band.alone) {
        ++gone_[i];
        continue;
      }
      missing[i] = kMissing;
      any = 1;
    }
    return any != 0;
  }

  QuietGdal quiet_;
  std::string name_;
  std::unique_ptr<GDALDataset> data_;
  std::vector<Band> bands_;
  std::vector<ByteMeaning> look_up_;  ///< of one band of 8 bits that is not grey as it is
  std::vector<std::uint8_t> gone_;    ///< of each pixel, the bands that have no data
  std::vector<float> values_;
  std::vector<float> one_;
  std::vector<std::uint8_t> flags_;
  std::vector<std::uint8_t> mask_;
};

class GdalSource final : public RasterSource {
 public:
  GdalSource(const std::filesystem::path& path, int band, const NoDataChoice& no_data) {
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
    const std::vector<int> numbers = bands_to_read(*data, band, name);
    facts_.geo = geo_transform_of(*data, name);
    facts_.reference_system = reference_system_of(*data, facts_.geo, name);
    facts_.width = data->GetRasterXSize();
    facts_.height = data->GetRasterYSize();
    const Label label = label_of(*data);
    for (const int b : numbers) {
      bands_.push_back({b, pixel_meaning(*data, b, label, numbers.size() > 1)});
      if (no_data.value) bands_.back().meaning.missing.push_back(bands_.back().meaning.raw(*no_data.value));
    }
    facts_.depth = depth_of(*data, numbers, bands_[0].meaning);
    set_all_valid(*data);
    data->GetRasterBand(numbers[0])->GetBlockSize(&facts_.block_width, &facts_.block_height);
    facts_.identity = identity_of(*data);
    for (const int b : numbers) facts_.identity += fmt::format("band {}\n", b);
    facts_.sun = find_sun(*data);
    if (no_data.guess && !no_data.value && guess_no_data(*data)) guess_no_data(*data);  // the other end, too
    doubt_black(*data);
    for (const float value : bands_[0].meaning.missing) facts_.identity += fmt::format("no data {}\n", value);
  }

  const RasterFacts& facts() const override { return facts_; }
  std::unique_ptr<RasterReader> reader() const override {
    return std::make_unique<GdalReader>(facts_.name, bands_);
  }

 private:
  void set_all_valid(GDALDataset& data) {
    facts_.all_valid = facts_.depth == PixelDepth::kEight || facts_.depth == PixelDepth::kSixteen;
    for (const BandChoice& b : bands_) {
      facts_.all_valid = facts_.all_valid && b.meaning.plain() &&
                         data.GetRasterBand(b.number)->GetMaskFlags() == GMF_ALL_VALID;
    }
  }

  /// Black may be a shadow, too, where it is marked as no data.
  void doubt_black(GDALDataset& data) {
    constexpr double kDoubtfulShare = 0.002;
    GDALRasterBand& band = *data.GetRasterBand(bands_[0].number);
    int has = 0;
    const double no_data = band.GetNoDataValue(&has);
    const bool dark_end = no_data == 0.0 && bands_[0].meaning.grey.empty() && bands_[0].meaning.scale > 0.0F;
    if (has == 0 || !dark_end || bands_.size() > 1 || !bands_[0].meaning.dark.empty()) return;
    GdalReader reader(facts_.name, bands_);
    const double share = share_in_gaps(reader, facts_);
    if (share < kDoubtfulShare) return;
    facts_.remarks.push_back(fmt::format(
        "{:.2g} % of the pixels are no data (0) in small gaps; if they are shadows, which are black, take "
        "the mark off with gdal_edit.py -unsetnodata, and mark the collar by a mask",
        100.0 * share));
  }

  /// True: a value is no data from now on.
  bool guess_no_data(GDALDataset& data) {
    GdalReader reader(facts_.name, bands_);
    const std::optional<UnmarkedValue> found = unmarked_value(reader, facts_);
    if (!found) return false;
    // The values that were looked at are brightness: raw ones where that is the same.
    const bool raw = std::all_of(bands_.begin(), bands_.end(), [](const BandChoice& b) {
      return b.meaning.grey.empty() && b.meaning.scale == 1.0F;
    });
    const bool taken = raw && found->is_no_ground;
    facts_.remarks.push_back(fmt::format(
        "about {:.2g} % of the pixels have the value {}, the {} of all, and nothing marks it as no data; {}",
        100.0 * found->share, found->value, found->is_least ? "least" : "largest",
        taken ? "it is taken for that (--no-data none: as it is)"
              : fmt::format("if they hold none, give --no-data {}", found->value)));
    if (!taken) return false;
    for (BandChoice& b : bands_) b.meaning.missing.push_back(found->value);
    set_all_valid(data);
    return true;
  }

  RasterFacts facts_;
  std::vector<BandChoice> bands_;
};

}  // namespace

std::unique_ptr<RasterSource> open_orthoimage(const std::filesystem::path& path, int band,
                                              const NoDataChoice& no_data) {
  return std::make_unique<GdalSource>(path, band, no_data);
}

}  // namespace cairn::ground
