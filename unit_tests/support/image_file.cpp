#include "support/image_file.hpp"

#include <gdal.h>

#include <algorithm>
#include <vector>

namespace cairn::test {

MutableImageU8 read_image(const std::string& path, std::uint8_t* pixels, std::size_t capacity, int shift) {
  GDALAllRegister();
  GDALDatasetH file = GDALOpen(path.c_str(), GA_ReadOnly);
  if (file == nullptr) return {};
  const int width = GDALGetRasterXSize(file);
  const int height = GDALGetRasterYSize(file);
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  MutableImageU8 view;
  if (count <= capacity && GDALGetRasterCount(file) > 0) {
    std::vector<std::uint16_t> wide(count);
    if (GDALRasterIO(GDALGetRasterBand(file, 1), GF_Read, 0, 0, width, height, wide.data(), width, height,
                     GDT_UInt16, 0, 0) == CE_None) {
      for (std::size_t i = 0; i < count; ++i)
        pixels[i] = static_cast<std::uint8_t>(std::min(wide[i] >> shift, 255));
      view = packed_view(pixels, width, height);
    }
  }
  GDALClose(file);
  return view;
}

bool write_png(const std::string& path, const std::uint8_t* pixels, int width, int height, int channels) {
  GDALAllRegister();
  GDALDatasetH memory =
      GDALCreate(GDALGetDriverByName("MEM"), "", width, height, channels, GDT_Byte, nullptr);
  if (memory == nullptr) return false;
  CPLErr error =
      GDALDatasetRasterIO(memory, GF_Write, 0, 0, width, height, const_cast<std::uint8_t*>(pixels), width,
                          height, GDT_Byte, channels, nullptr, channels, channels * width, 1);
  GDALDatasetH png = nullptr;
  if (error == CE_None) {
    png = GDALCreateCopy(GDALGetDriverByName("PNG"), path.c_str(), memory, FALSE, nullptr, nullptr, nullptr);
  }
  if (png != nullptr) GDALClose(png);
  GDALClose(memory);
  return png != nullptr;
}

}  // namespace cairn::test
