#include "ortho/pixel_meaning.hpp"

#include <fmt/format.h>
#include <gdal_priv.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

constexpr std::uint32_t kIsisNullReal = 0xFF7FFFFBU;  // ... LRS, LIS, HIS, HRS follow, one by one

float real_of(std::uint32_t bits) {
  float value = 0.0F;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

bool holds(const std::vector<float>& list, float value) {
  return std::find(list.begin(), list.end(), value) != list.end();
}

/// A label that GDAL keeps as JSON in `domain` has `words`.
bool label_says(GDALDataset& image, const char* domain, const char* words) {
  char** const label = image.GetMetadata(domain);
  return label != nullptr && label[0] != nullptr && std::strstr(label[0], words) != nullptr;
}

/// Of a PDS3 label: SAMPLE_TYPE without UNSIGNED.
bool says_signed(GDALDataset& image) {
  for (const char* const order : {"", "MSB_", "LSB_", "PC_", "SUN_", "MAC_", "VAX_"}) {
    if (label_says(image, "json:PDS", fmt::format(R"("SAMPLE_TYPE":"{}INTEGER")", order).c_str()))
      return true;
  }
  return false;
}

bool from_isis(GDALDataset& image, GDALRasterBand& band) {
  const char* const driver = image.GetDriverName();
  if (std::strncmp(driver, "ISIS", 4) == 0) return true;
  int has = 0;
  const double no_data = band.GetNoDataValue(&has);
  const GDALDataType type = band.GetRasterDataType();
  if (has == 0) return false;
  if (no_data == 0.0 && (type == GDT_Byte || type == GDT_UInt16))  // too common to tell by itself
    return label_says(image, "json:ISIS3",
                      type == GDT_Byte ? R"("Type":"UnsignedByte")" : R"("Type":"UnsignedWord")");
  return (type == GDT_Int16 && no_data == -32768.0) ||
         (type == GDT_Float32 && static_cast<float>(no_data) == real_of(kIsisNullReal));
}

void add_isis(GDALDataType type, PixelMeaning& meaning) {
  switch (type) {
    case GDT_Byte:  // Null and the low ones are one value: nothing is known of it
      meaning.missing = {0.0F};
      meaning.bright = {255.0F};
      break;
    case GDT_Int16:
      meaning.missing = {-32768.0F};
      meaning.dark = {-32767.0F, -32766.0F};
      meaning.bright = {-32765.0F, -32764.0F};
      break;
    case GDT_UInt16:
      meaning.missing = {0.0F};
      meaning.dark = {1.0F, 2.0F};
      meaning.bright = {65534.0F, 65535.0F};
      break;
    case GDT_Float32:
      meaning.missing = {real_of(kIsisNullReal)};
      meaning.dark = {real_of(kIsisNullReal + 1), real_of(kIsisNullReal + 2)};
      meaning.bright = {real_of(kIsisNullReal + 3), real_of(kIsisNullReal + 4)};
      break;
    default: break;
  }
}

void add_label(const Label& label, GDALDataType type, PixelMeaning& meaning) {
  const auto sample_bits = label.find("SAMPLEBITS");
  if (sample_bits != label.end() && sample_bits->second > GDALGetDataTypeSizeBits(type)) return;
  const auto add = [&](std::initializer_list<const char*> names, std::vector<float>& to) {
    for (const char* name : names) {
      const auto found = label.find(name);
      if (found == label.end()) continue;
      double value = found->second;
      // PDS3 writes special reals by their bits, 16#FF7FFFFB#; as numbers they are too large for a picture.
      if (type == GDT_Float32 && value >= 2147483648.0 && value <= 4294967295.0)
        value = static_cast<double>(real_of(static_cast<std::uint32_t>(value)));
      const auto as_read = static_cast<float>(value);
      if (!holds(meaning.missing, as_read) && !holds(meaning.dark, as_read) &&
          !holds(meaning.bright, as_read))
        to.push_back(as_read);
    }
  };
  add({"CORENULL", "NULL", "NULLCONSTANT", "MISSING", "MISSINGCONSTANT", "INVALIDCONSTANT", "ERRORCONSTANT",
       "UNKNOWNCONSTANT", "NOTAPPLICABLECONSTANT", "NULLVALUE"},
      meaning.missing);
  add({"CORELOWREPRSATURATION", "CORELOWINSTRSATURATION", "LOWREPRSATURATION", "LOWINSTRSATURATION",
       "LOWREPRESENTATIONSATURATION", "LOWINSTRUMENTSATURATION"},
      meaning.dark);
  add({"COREHIGHREPRSATURATION", "COREHIGHINSTRSATURATION", "HIGHREPRSATURATION", "HIGHINSTRSATURATION",
       "HIGHREPRESENTATIONSATURATION", "HIGHINSTRUMENTSATURATION", "SATURATEDCONSTANT"},
      meaning.bright);
}

void add_palette(const GDALColorTable& palette, PixelMeaning& meaning) {
  const int entries = palette.GetColorEntryCount();
  meaning.grey.assign(static_cast<std::size_t>(std::max(entries, 256)), 0);
  meaning.grey_kind.assign(meaning.grey.size(), PixelKind::kValue);
  for (int i = 0; i < entries; ++i) {
    GDALColorEntry colour = {};
    palette.GetColorEntryAsRGB(i, &colour);
    const int mean = (colour.c1 + colour.c2 + colour.c3 + 1) / 3;
    const auto at = static_cast<std::size_t>(i);
    meaning.grey[at] = static_cast<std::uint8_t>(std::clamp(mean, 0, 255));
    if (colour.c4 == 0) meaning.grey_kind[at] = PixelKind::kMissing;
  }
}

/// GDAL reads signed bytes as if they had no sign.
bool is_signed_byte(GDALDataset& image, GDALRasterBand& band) {
  if (band.GetRasterDataType() != GDT_Byte) return false;
  const char* const type = band.GetMetadataItem("PIXELTYPE", "IMAGE_STRUCTURE");
  return (type != nullptr && EQUAL(type, "SIGNEDBYTE")) || says_signed(image);
}

/// From -128, black, to 127. Values that were told are turned into what is read.
void add_sign(PixelMeaning& meaning) {
  meaning.signed_bytes = true;
  for (std::size_t i = 0; i < 256; ++i) meaning.grey.push_back(static_cast<std::uint8_t>(i ^ 0x80U));
  meaning.grey_kind.assign(meaning.grey.size(), PixelKind::kValue);
  for (std::vector<float>* const list : {&meaning.missing, &meaning.dark, &meaning.bright}) {
    for (float& value : *list) value = meaning.raw(static_cast<double>(value));
  }
}

/// raw -> largest - raw, for TIFF's min-is-white.
void invert(GDALRasterBand& band, PixelMeaning& meaning) {
  const char* const bits = band.GetMetadataItem("NBITS", "IMAGE_STRUCTURE");
  switch (band.GetRasterDataType()) {
    case GDT_Byte: meaning.offset = 255.0F; break;
    case GDT_UInt16: meaning.offset = 65535.0F; break;
    case GDT_Int16: meaning.offset = -1.0F; break;
    default: meaning.offset = 0.0F; break;
  }
  const int count = bits != nullptr ? std::atoi(bits) : 0;
  if (count > 0 && count < 16 && meaning.offset > 0.0F) meaning.offset = static_cast<float>((1 << count) - 1);
  meaning.scale = -1.0F;
}

/// One band is stretched whatever its scale; what turns dark into bright is turned back.
void add_scale(GDALRasterBand& band, bool several, PixelMeaning& meaning) {
  int has = 0;
  const double scale = band.GetScale(&has);
  if (has == 0) return;
  if (!(std::fabs(scale) > 0.0) || !std::isfinite(scale)) {
    throw ToolError("{}: the scale of band {} is {}; correct it with gdal_edit.py -scale",
                    band.GetDataset()->GetDescription(), band.GetBand(), scale);
  }
  const bool byte = band.GetRasterDataType() == GDT_Byte;
  if (scale < 0.0 && (byte || !several)) {
    invert(band, meaning);
  } else if (several && !byte) {
    meaning.scale = static_cast<float>(scale);
    meaning.offset = static_cast<float>(band.GetOffset(nullptr));
  }
}

}  // namespace

PixelKind PixelMeaning::kind(float raw) const {
  if (holds(missing, raw)) return PixelKind::kMissing;
  if (holds(dark, raw)) return PixelKind::kDark;
  if (holds(bright, raw)) return PixelKind::kBright;
  if (grey.empty()) return PixelKind::kValue;
  return raw >= 0.0F && raw < static_cast<float>(grey.size()) ? grey_kind[static_cast<std::size_t>(raw)]
                                                              : PixelKind::kMissing;
}

float PixelMeaning::raw(double told) const {
  return static_cast<float>(signed_bytes && told < 0.0 ? told + 256.0 : told);
}

float PixelMeaning::value(float raw) const {
  if (grey.empty()) return raw * scale + offset;
  return raw >= 0.0F && raw < static_cast<float>(grey.size()) ? grey[static_cast<std::size_t>(raw)] : 0.0F;
}

PixelMeaning pixel_meaning(GDALDataset& image, int number, const Label& label, bool several) {
  GDALRasterBand& band = *image.GetRasterBand(number);
  PixelMeaning meaning;
  const char* const driver = image.GetDriverName();
  meaning.lists_all = std::strncmp(driver, "ISIS", 4) == 0 || std::strcmp(driver, "PDS4") == 0;
  if (from_isis(image, band)) {
    add_isis(band.GetRasterDataType(), meaning);
    // GDAL compares reals to some bits, and takes Null's neighbours for it.
    meaning.lists_all = meaning.lists_all || band.GetMaskFlags() == GMF_NODATA;
    meaning.masked_special = true;
  }
  add_label(label, band.GetRasterDataType(), meaning);
  int has = 0;
  const double no_data = band.GetNoDataValue(&has);
  if (meaning.lists_all && has != 0 && meaning.kind(static_cast<float>(no_data)) == PixelKind::kValue)
    meaning.missing.push_back(static_cast<float>(no_data));
  if (is_signed_byte(image, band)) {
    // GDAL's no-data value of a PDS3 label is one without a sign.
    meaning.lists_all = meaning.lists_all || says_signed(image);
    if (has != 0 && !meaning.lists_all) meaning.missing.push_back(static_cast<float>(no_data));
    add_sign(meaning);
    return meaning;
  }
  const GDALColorTable* const palette = band.GetColorTable();
  const char* const white = image.GetMetadataItem("MINISWHITE", "IMAGE_STRUCTURE");
  if (palette != nullptr && band.GetColorInterpretation() == GCI_PaletteIndex) {
    add_palette(*palette, meaning);
  } else if (white != nullptr && CPLTestBool(white)) {
    invert(band, meaning);
  } else {
    add_scale(band, several, meaning);
  }
  return meaning;
}

}  // namespace cairn::ground
