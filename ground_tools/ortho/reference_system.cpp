#include "ortho/reference_system.hpp"

#include <ogr_spatialref.h>

#include <cmath>
#include <memory>
#include <sstream>
#include <string_view>

#include "base/quiet_gdal.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

constexpr std::string_view kLocal = "local";

std::string ascii(std::string text) {
  for (char& c : text) {
    if (c < 0x20 || c > 0x7E) c = '?';
  }
  return text.substr(0, kMaxReferenceBytes);
}

std::string proj_text(const OGRSpatialReference& system) {
  char* proj = nullptr;
  std::string text;
  if (system.exportToProj4(&proj) == OGRERR_NONE && proj != nullptr) text = proj;
  CPLFree(proj);
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

/// Without the words that PROJ takes for granted, as far as that changes nothing.
std::string shortened(const std::string& proj) {
  std::istringstream words(proj);
  std::string word;
  std::string text;
  while (words >> word) {
    bool granted = false;
    for (const char* given :
         {"+lat_0=0", "+lon_0=0", "+x_0=0", "+y_0=0", "+units=m", "+no_defs", "+type=crs"})
      granted = granted || word == given;
    if (granted) continue;
    if (!text.empty()) text += ' ';
    text += word;
  }
  OGRSpatialReference again;
  return again.importFromProj4(text.c_str()) == OGRERR_NONE && proj_text(again) == proj ? text : proj;
}

/// The same places have the same coordinates, to 0.1 mm: systems are also the same where only their words
/// differ (polar stereographic in its variants, an ellipsoid by its axes or by its flattening).
bool same_places(OGRSpatialReference& a, OGRSpatialReference& b) {
  a.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  b.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> between(OGRCreateCoordinateTransformation(&a, &b));
  if (between == nullptr) return false;
  const double places[][2] = {{1e5, 2e5}, {4e5, -3e5}, {-2e5, 1e6}};
  for (const auto& place : places) {
    double x = place[0];
    double y = place[1];
    if (between->Transform(1, &x, &y) == 0 || !(std::fabs(x - place[0]) < 1e-4) ||
        !(std::fabs(y - place[1]) < 1e-4))
      return false;
  }
  return true;
}

bool numbered(const std::string& text) {
  OGRSpatialReference again;
  return again.SetFromUserInput(text.c_str()) == OGRERR_NONE;
}

}  // namespace

bool is_local_reference(const std::string& text) {
  return text.empty() || text == kLocal || text.rfind("local:", 0) == 0;
}

std::string reference_text(const OGRSpatialReference* system) {
  if (system == nullptr || system->IsEmpty()) return std::string(kLocal);
  const QuietGdal quiet;
  const std::unique_ptr<OGRSpatialReference> flat(system->Clone());
  flat->StripVertical();
  const char* authority = flat->GetAuthorityName(nullptr);
  const char* code = flat->GetAuthorityCode(nullptr);
  if (authority != nullptr && code != nullptr) {
    const std::string text = fmt::format("{}:{}", authority, code);
    if (numbered(text)) return ascii(text);
  }
  if (flat->IsLocal() == 0) {
    const std::string text = shortened(proj_text(*flat));
    if (!text.empty() && text.size() <= kMaxReferenceBytes) return ascii(text);
  }
  const char* name = flat->GetName();
  if (name == nullptr || *name == '\0' || std::string_view(name) == "unnamed" ||
      std::string_view(name) == "unknown" || std::string_view(name) == kLocal) {
    return std::string(kLocal);
  }
  return ascii(std::string(name).rfind("local:", 0) == 0 ? name : fmt::format("local:{}", name));
}

OGRSpatialReference reference_of(const std::string& text, const std::string& what) {
  const QuietGdal quiet;
  OGRSpatialReference system;
  if (is_local_reference(text)) {
    system.SetLocalCS(text.empty() ? std::string(kLocal).c_str() : text.c_str());
    system.SetLinearUnits(SRS_UL_METER, 1.0);
  } else if (system.SetFromUserInput(text.c_str()) != OGRERR_NONE) {
    throw ToolError(
        "{}: its reference system '{}' is not one that PROJ knows{}; correct it, or build the map again",
        what, text, quiet.reason());
  }
  system.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return system;
}

bool same_reference(const std::string& a, const std::string& b) {
  if (a == b || (is_local_reference(a) && is_local_reference(b) && a.size() <= kLocal.size() &&
                 b.size() <= kLocal.size())) {
    return true;
  }
  if (is_local_reference(a) || is_local_reference(b)) return false;
  const QuietGdal quiet;
  OGRSpatialReference first;
  OGRSpatialReference second;
  if (first.SetFromUserInput(a.c_str()) != OGRERR_NONE || second.SetFromUserInput(b.c_str()) != OGRERR_NONE)
    return false;
  const char* const criteria[] = {"IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES", "CRITERION=EQUIVALENT",
                                  nullptr};
  return first.IsSame(&second, criteria) != 0 || same_places(first, second);
}

}  // namespace cairn::ground
