// What images say of themselves: metadata items, labels of ISIS, PDS3, PDS4 and VICAR, camera labels. Any
// bytes are read as a sun that can be, as none, or refused in one line.
//
// Input: which label, then the text.
#include <gdal_priv.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "core/trig.hpp"
#include "dataset/rig_file.hpp"
#include "fuzz/fuzz_file.hpp"
#include "ortho/site_frame.hpp"
#include "ortho/sun_label.hpp"

using namespace cairn;
using namespace cairn::fuzz;
using namespace cairn::ground;

namespace {

constexpr const char* kDomains[] = {"json:ISIS3", "json:PDS", "json:VICAR", "xml:PDS4"};

/// An image that says `text` of itself: whole in one domain, or as items, a line each.
std::unique_ptr<GDALDataset> image_of(unsigned which, const std::string& text) {
  GDALAllRegister();
  std::unique_ptr<GDALDataset> image(
      GetGDALDriverManager()->GetDriverByName("MEM")->Create("", 8, 8, 1, GDT_Byte, nullptr));
  double geo[6] = {1000.0, 1.0, 0.0, 2000.0, 0.0, -1.0};
  image->SetGeoTransform(geo);
  if (which < std::size(kDomains)) {
    char* const whole[] = {const_cast<char*>(text.c_str()), nullptr};
    image->SetMetadata(const_cast<char**>(whole), kDomains[which]);
    return image;
  }
  CPLStringList items;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    items.AddString(text.substr(at, end - at).c_str());
    at = end + 1;
  }
  image->SetMetadata(items.List());
  return image;
}

void read(unsigned which, const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (which % 7U == 5U) {
    const std::filesystem::path path = file_of(data, size);
    static_cast<void>(read_rig({path, path}));
    return;
  }
  if (which % 7U == 6U) {  // by itself: through an image PROJ would take most of the time
    const std::optional<Vec2> sun_deg =
        sun_of_spice(nlohmann::json::parse(text, nullptr, false), {Mat2::Identity(), -40.0, 137.0});
    CAIRN_ASSERT(!sun_deg || sun_deg->allFinite());
    return;
  }
  const std::optional<Sun> sun = find_sun(*image_of(which % 7U, text));
  if (!sun) return;
  CAIRN_ASSERT(sun->elevation_rad > 0.0 && sun->elevation_rad <= 0.5 * kPi + 1e-9);
  CAIRN_ASSERT(sun->azimuth_rad >= 0.0 && sun->azimuth_rad < 2.0 * kPi);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  refused_in_one_line([&] { read(data[0], data + 1, size - 1); });
  return 0;
}
