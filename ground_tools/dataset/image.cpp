#include "dataset/image.hpp"

#include <gdal_priv.h>

#include <memory>
#include <string>

#include "base/quiet_gdal.hpp"

namespace cairn::ground {
namespace {

std::uint8_t luma(int red, int green, int blue) {
  return static_cast<std::uint8_t>((299 * red + 587 * green + 114 * blue + 500) / 1000);
}

std::vector<std::uint16_t> read_band(GDALDataset& data, int index, QuietGdal& gdal) {
  const int width = data.GetRasterXSize();
  const int height = data.GetRasterYSize();
  std::vector<std::uint16_t> band(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  gdal.check(data.GetRasterBand(index)->RasterIO(GF_Read, 0, 0, width, height, band.data(), width, height,
                                                 GDT_UInt16, 0, 0, nullptr));
  return band;
}

[[noreturn]] void refuse(const std::filesystem::path& path, const QuietGdal& gdal, const char* what) {
  throw ImageError(path.string() + ": " + what + gdal.reason());
}

}  // namespace

Image load_grey(const std::filesystem::path& path) {
  QuietGdal gdal;
  const char* const drivers[] = {"JPEG", "PNG", "GTiff", nullptr};
  // No look at the files beside it: a folder may hold thousands.
  const char* const no_siblings[] = {nullptr};
  const std::unique_ptr<GDALDataset> data(
      GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, drivers, nullptr, no_siblings));
  if (data == nullptr) refuse(path, gdal, "not a readable JPEG, PNG or TIFF image");

  const GDALDataType type =
      data->GetRasterCount() > 0 ? data->GetRasterBand(1)->GetRasterDataType() : GDT_Unknown;
  if (type != GDT_Byte && type != GDT_UInt16) refuse(path, gdal, "samples are not 8-bit or 16-bit integers");
  Image image;
  image.width = data->GetRasterXSize();
  image.height = data->GetRasterYSize();
  constexpr int kMaxSide = 16384;  // a damaged header must not ask for all memory
  if (image.width > kMaxSide || image.height > kMaxSide) refuse(path, gdal, "more than 16384 pixels a side");

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
    for (std::size_t i = 0; i < first.size(); ++i) {
      image.pixels[i] = static_cast<std::uint8_t>(narrow(first[i]));
    }
  }
  if (gdal.failed()) refuse(path, gdal, "image data cannot be decoded");
  return image;
}

}  // namespace cairn::ground
