#include "plot/jpeg.hpp"

#include <cpl_string.h>
#include <cpl_vsi.h>
#include <gdal_priv.h>
#include <unistd.h>

#include <memory>

#include "base/quiet_gdal.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

using DatasetPtr = std::unique_ptr<GDALDataset>;

std::string to_base64(const std::uint8_t* bytes, std::size_t size) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((size + 2) / 3 * 4);
  for (std::size_t i = 0; i < size; i += 3) {
    const std::size_t left = size - i;
    const std::uint32_t three = (std::uint32_t{bytes[i]} << 16) |
                                (left > 1 ? std::uint32_t{bytes[i + 1]} << 8 : 0U) |
                                (left > 2 ? std::uint32_t{bytes[i + 2]} : 0U);
    text += kDigits[three >> 18];
    text += kDigits[(three >> 12) & 63U];
    text += left > 1 ? kDigits[(three >> 6) & 63U] : '=';
    text += left > 2 ? kDigits[three & 63U] : '=';
  }
  return text;
}

}  // namespace

std::string jpeg_base64(const std::vector<std::uint8_t>& bytes, int width, int height, int bands,
                        int quality) {
  QuietGdal gdal;
  GDALDriverManager* const drivers = GetGDALDriverManager();
  const DatasetPtr memory(
      drivers->GetDriverByName("MEM")->Create("", width, height, bands, GDT_Byte, nullptr));
  const std::string name = fmt::format("/vsimem/cairn-{}.jpg", ::getpid());
  CPLStringList options;
  options.SetNameValue("QUALITY", std::to_string(quality).c_str());
  if (memory != nullptr) {
    std::vector<std::uint8_t> samples = bytes;  // GDAL takes no constant
    gdal.check(memory->RasterIO(GF_Write, 0, 0, width, height, samples.data(), width, height, GDT_Byte, bands,
                                nullptr, 0, 0, 0, nullptr));
    GDALDriver* const jpeg = drivers->GetDriverByName("JPEG");
    const DatasetPtr written(
        jpeg->CreateCopy(name.c_str(), memory.get(), 0, options.List(), nullptr, nullptr));
  }
  vsi_l_offset size = 0;
  const GByte* const file = VSIGetMemFileBuffer(name.c_str(), &size, 0);
  std::string text = file == nullptr ? std::string() : to_base64(file, static_cast<std::size_t>(size));
  VSIUnlink(name.c_str());
  if (gdal.failed() || text.empty())
    throw ToolError("a picture of {} x {} cannot be made{}; is GDAL's JPEG driver there?", width, height,
                    gdal.reason());
  return text;
}

}  // namespace cairn::ground
