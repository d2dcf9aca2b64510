/// Image files for tests, written by GDAL.
#pragma once

#include <gdal_priv.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "support/cmocka.hpp"

namespace cairn::test {

/// Writes bands of width x height samples, `sample(band, x, y)`, with a GDAL driver ("PNG", "JPEG", "GTiff").
template <typename Sample>
void write_image(const std::filesystem::path& path, const char* driver, GDALDataType type, int width,
                 int height, int bands, const Sample& sample, const char* const* options = nullptr) {
  GDALAllRegister();
  GDALDriverManager* const drivers = GetGDALDriverManager();
  const std::unique_ptr<GDALDataset> memory(
      drivers->GetDriverByName("MEM")->Create("", width, height, bands, type, nullptr));
  std::vector<std::uint16_t> row(static_cast<std::size_t>(width));
  for (int b = 0; b < bands; ++b) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x)
        row[static_cast<std::size_t>(x)] = static_cast<std::uint16_t>(sample(b, x, y));
      assert_int_equal(memory->GetRasterBand(b + 1)->RasterIO(GF_Write, 0, y, width, 1, row.data(), width, 1,
                                                              GDT_UInt16, 0, 0, nullptr),
                       CE_None);
    }
  }
  const std::unique_ptr<GDALDataset> written(drivers->GetDriverByName(driver)->CreateCopy(
      path.c_str(), memory.get(), 0, const_cast<char**>(options), nullptr, nullptr));
  assert_non_null(written.get());
}

inline int texture(int x, int y) { return (37 * x + 91 * y + x * y) & 255; }

inline void write_grey_png(const std::filesystem::path& path, int width, int height) {
  write_image(path, "PNG", GDT_Byte, width, height, 1, [](int, int x, int y) { return texture(x, y); });
}

}  // namespace cairn::test
