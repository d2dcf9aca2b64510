#include "dataset/image.hpp"

#include <gdal_priv.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <memory>
#include <string>

#include "base/quiet_gdal.hpp"

namespace cairn::ground {
namespace {

constexpr int kMaxSide = 16384;  // a damaged header must not ask for all memory

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

/// Of bytes that hold 1, 2 or 4 bits, as drawings do, the largest that these can hold; else 255.
int largest_shallow_sample(GDALRasterBand& band) {
  const char* const told = band.GetMetadataItem("NBITS", "IMAGE_STRUCTURE");
  const int bits = told != nullptr ? std::atoi(told) : 8;
  return bits >= 1 && bits < 8 ? (1 << bits) - 1 : 255;
}

[[noreturn]] void refuse(const std::filesystem::path& path, const QuietGdal& gdal, const char* what) {
  throw ImageError(path.string() + ": " + what + gdal.reason());
}

struct Opened {
  std::unique_ptr<GDALDataset> data;
  GDALDataType type = GDT_Unknown;
};

/// PGM and PPM of numbers in words (P2, P3), which GDAL does not read; null where a file is none, or its
/// samples are not all there.
std::unique_ptr<GDALDataset> open_words(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string kind;
  in >> kind;
  if (kind != "P2" && kind != "P3") return nullptr;
  const auto next = [&in] {
    int value = -1;
    while ((in >> std::ws).peek() == '#') in.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
    in >> value;
    return in.fail() ? -1 : value;
  };
  const int width = next(), height = next(), most = next(), bands = kind == "P2" ? 1 : 3;
  if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide || most < 1 || most > 65535)
    return nullptr;
  std::vector<std::uint16_t> samples;
  for (const int count = width * height * bands; static_cast<int>(samples.size()) < count;) {
    const int sample = next();
    if (sample < 0 || sample > most) return nullptr;
    samples.push_back(static_cast<std::uint16_t>(sample));
  }
  auto* const memory = GetGDALDriverManager()->GetDriverByName("MEM");
  std::unique_ptr<GDALDataset> data(
      memory->Create("", width, height, bands, most > 255 ? GDT_UInt16 : GDT_Byte, nullptr));
  const int pixel = 2 * bands;
  if (data == nullptr ||
      data->RasterIO(GF_Write, 0, 0, width, height, samples.data(), width, height, GDT_UInt16, bands, nullptr,
                     pixel, pixel * width, 2, nullptr) != CE_None)
    return nullptr;
  return data;
}

Opened open_image(const std::filesystem::path& path, const QuietGdal& gdal) {
  const char* const drivers[] = {"JPEG",        "PNG", "GTiff", "PNM",   "BMP",  "WEBP",
                                 "JP2OpenJPEG", "GIF", "PDS",   "VICAR", nullptr};
  // No look at the files beside it: a folder may hold thousands.
  const char* const no_siblings[] = {nullptr};
  Opened out;
  out.data.reset(
      GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, drivers, nullptr, no_siblings));
  if (out.data == nullptr) out.data = open_words(path);
  std::error_code error;
  if (out.data == nullptr && !std::filesystem::exists(path, error)) refuse(path, gdal, "is not there");
  if (out.data == nullptr) refuse(path, gdal, "not a readable image (JPEG, PNG, TIFF, PGM, BMP ...)");
  if (out.data->GetRasterCount() > 0) out.type = out.data->GetRasterBand(1)->GetRasterDataType();
  if (out.type != GDT_Byte && out.type != GDT_UInt16 && out.type != GDT_Int16)
    refuse(path, gdal, "samples are not 8-bit or 16-bit integers; convert it");
  if (out.data->GetRasterXSize() > kMaxSide || out.data->GetRasterYSize() > kMaxSide)
    refuse(path, gdal, "more than 16384 pixels a side");
  return out;
}

}  // namespace

std::pair<int, int> image_size(const std::filesystem::path& path) {
  const QuietGdal gdal;
  const Opened opened = open_image(path, gdal);
  return {opened.data->GetRasterXSize(), opened.data->GetRasterYSize()};
}

DeepSamples deep_samples(const std::filesystem::path& path) {
  QuietGdal gdal;
  const Opened opened = open_image(path, gdal);
  DeepSamples out;
  if (opened.type == GDT_Byte) return out;
  const auto all_of = [](const std::vector<std::uint16_t>& samples, int factor) {
    return std::all_of(samples.begin(), samples.end(), [factor](int sample) { return sample % factor == 0; });
  };
  const int bands = std::min(opened.data->GetRasterCount(), 3);
  for (int b = 1; b <= bands; ++b) {
    const std::vector<std::uint16_t> samples = read_band(*opened.data, b, gdal);
    for (const int sample : samples) out.largest = std::max(out.largest, sample);
    out.of_bytes = out.of_bytes && (all_of(samples, 257) || all_of(samples, 256));
  }
  if (gdal.failed()) refuse(path, gdal, "image data cannot be decoded");
  return out;
}

Image load_grey(const std::filesystem::path& path, int bits) {
  QuietGdal gdal;
  const auto [data, type] = open_image(path, gdal);
  Image image;
  image.width = data->GetRasterXSize();
  image.height = data->GetRasterYSize();

  const std::vector<std::uint16_t> first = read_band(*data, 1, gdal);
  image.pixels.resize(first.size());
  const bool deep = type != GDT_Byte;
  const int most = deep ? (1 << bits) - 1 : largest_shallow_sample(*data->GetRasterBand(1));
  const auto narrow = [most](int sample) { return (std::min(sample, most) * 255 + most / 2) / most; };
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
