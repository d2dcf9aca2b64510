#include "dataset/image.hpp"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <gdal_priv.h>

#include <memory>
#include <string>

namespace cairn::ground {
namespace {

/// Keeps GDAL quiet while it lives and remembers its first failure.
class QuietGdal {
 public:
  QuietGdal() {
    static const bool registered = (GDALAllRegister(), true);
    static_cast<void>(registered);
    CPLPushErrorHandlerEx(&QuietGdal::remember, this);
    // A JPEG that ends early is only a warning to libjpeg, which fills the rest with grey.
    CPLSetThreadLocalConfigOption("GDAL_ERROR_ON_LIBJPEG_WARNING", "TRUE");
    CPLSetThreadLocalConfigOption("GDAL_DISABLE_READDIR_ON_OPEN", "EMPTY_DIR");
  }
  ~QuietGdal() {
    CPLSetThreadLocalConfigOption("GDAL_ERROR_ON_LIBJPEG_WARNING", nullptr);
    CPLSetThreadLocalConfigOption("GDAL_DISABLE_READDIR_ON_OPEN", nullptr);
    CPLPopErrorHandler();
  }
  QuietGdal(const QuietGdal&) = delete;
  QuietGdal& operator=(const QuietGdal&) = delete;

  bool failed() const { return failed_; }
  void set_failed() { failed_ = true; }

  [[noreturn]] void refuse(const std::filesystem::path& path, std::string reason) const {
    if (!message_.empty()) reason += ": " + message_;
    for (char& c : reason) {
      if (c == '\n' || c == '\r') c = ' ';
    }
    throw ImageError(path.string() + ": " + reason);
  }

 private:
  static void CPL_STDCALL remember(CPLErr severity, CPLErrorNum, const char* message) {
    auto* self = static_cast<QuietGdal*>(CPLGetErrorHandlerUserData());
    if (severity < CE_Failure) return;
    self->failed_ = true;
    if (self->message_.empty()) self->message_ = message;
  }

  bool failed_ = false;
  std::string message_;
};

std::uint8_t luma(int red, int green, int blue) {
  return static_cast<std::uint8_t>((299 * red + 587 * green + 114 * blue + 500) / 1000);
}

std::vector<std::uint16_t> read_band(GDALDataset& data, int index, QuietGdal& gdal) {
  const int width = data.GetRasterXSize();
  const int height = data.GetRasterYSize();
  std::vector<std::uint16_t> band(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const CPLErr result = data.GetRasterBand(index)->RasterIO(GF_Read, 0, 0, width, height, band.data(), width,
                                                            height, GDT_UInt16, 0, 0, nullptr);
  if (result != CE_None) gdal.set_failed();
  return band;
}

}  // namespace

Image load_grey(const std::filesystem::path& path) {
  QuietGdal gdal;
  const char* const drivers[] = {"JPEG", "PNG", "GTiff", nullptr};
  const std::unique_ptr<GDALDataset> data(
      GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, drivers, nullptr, nullptr));
  if (data == nullptr) gdal.refuse(path, "not a readable JPEG, PNG or TIFF image");

  const GDALDataType type =
      data->GetRasterCount() > 0 ? data->GetRasterBand(1)->GetRasterDataType() : GDT_Unknown;
  if (type != GDT_Byte && type != GDT_UInt16) gdal.refuse(path, "samples are not 8-bit or 16-bit integers");
  Image image;
  image.width = data->GetRasterXSize();
  image.height = data->GetRasterYSize();
  constexpr int kMaxSide = 16384;  // a damaged header must not ask for all memory
  if (image.width > kMaxSide || image.height > kMaxSide) gdal.refuse(path, "more than 16384 pixels a side");

  const std::vector<std::uint16_t> first = read_band(*data, 1, gdal);
  image.pixels.resize(first.size());
  const auto narrow = [type](int sample) { return type == GDT_Byte ? sample : (sample + 128) / 257; };
  const GDALColorTable* const palette = data->GetRasterBand(1)->GetColorTable();
  if (palette != nullptr) {
    for (std::size_t i = 0; i < first.size(); ++i) {
      GDALColorEntry entry = {0, 0, 0, 0};
      palette->GetColorEntryAsRGB(first[i], &entry);
      image.pixels[i] = luma(entry.c1, entry.c2, entry.c3);
    }
  } else if (data->GetRasterCount() >= 3) {
    const std::vector<std::uint16_t> green = read_band(*data, 2, gdal);
    const std::vector<std::uint16_t> blue = read_band(*data, 3, gdal);
    for (std::size_t i = 0; i < first.size(); ++i) {
      image.pixels[i] = luma(narrow(first[i]), narrow(green[i]), narrow(blue[i]));
    }
  } else {
    for (std::size_t i = 0; i < first.size(); ++i)
      image.pixels[i] = static_cast<std::uint8_t>(narrow(first[i]));
  }
  if (gdal.failed()) gdal.refuse(path, "image data cannot be decoded");
  return image;
}

}  // namespace cairn::ground
