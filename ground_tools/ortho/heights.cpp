#include "ortho/heights.hpp"

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <tuple>

#include "base/quiet_gdal.hpp"
#include "base/tool_error.hpp"
#include "ortho/reference_system.hpp"

namespace cairn::ground {
namespace {

/// A place in the model, pixel centres at integers.
struct Place {
  std::size_t index = 0;
  double u_px = 0.0;
  double v_px = 0.0;
};

/// Places in the model's own reference system; NaN where they have none.
std::vector<Vec2> places_in_model(GDALDataset& model, const std::string& name, std::vector<Vec2> places,
                                  const std::string& reference_system) {
  const OGRSpatialReference* const own = model.GetSpatialRef();
  if (own == nullptr || own->IsLocal() != 0 || is_local_reference(reference_system)) return places;
  const std::unique_ptr<OGRSpatialReference> to(own->Clone());
  to->StripVertical();
  to->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  OGRSpatialReference from = reference_of(reference_system, name);
  if (from.IsSame(to.get()) != 0) return places;
  const QuietGdal quiet;
  const std::unique_ptr<OGRCoordinateTransformation> between(
      OGRCreateCoordinateTransformation(&from, to.get()));
  if (between == nullptr) {
    throw ToolError(
        "{}: its reference system and the map's ({}) cannot be transformed into each other{}; reproject it "
        "with gdalwarp -t_srs",
        name, reference_system, quiet.reason());
  }
  for (Vec2& place : places) {
    double x = place.x();
    double y = place.y();
    place = between->Transform(1, &x, &y) != 0 ? Vec2(x, y) : Vec2(NAN, NAN);
  }
  return places;
}

/// Those on the model, by its blocks.
std::vector<Place> places_on(GDALRasterBand& band, const double inverse[6], const std::vector<Vec2>& points) {
  int block_width = 1;
  int block_height = 1;
  band.GetBlockSize(&block_width, &block_height);
  std::vector<Place> places;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double column = inverse[0] + points[i].x() * inverse[1] + points[i].y() * inverse[2];
    const double row = inverse[3] + points[i].x() * inverse[4] + points[i].y() * inverse[5];
    if (!(column >= 0.0 && column <= band.GetXSize() && row >= 0.0 && row <= band.GetYSize())) continue;
    places.push_back({i, std::clamp(column - 0.5, 0.0, band.GetXSize() - 1.0),
                      std::clamp(row - 0.5, 0.0, band.GetYSize() - 1.0)});
  }
  const auto block = [&](const Place& p) {
    return std::make_tuple(static_cast<int>(p.v_px) / block_height, static_cast<int>(p.u_px) / block_width,
                           p.index);
  };
  std::sort(places.begin(), places.end(),
            [&](const Place& a, const Place& b) { return block(a) < block(b); });
  return places;
}

/// NaN where a pixel that counts has no data.
double height_at(GDALRasterBand& band, GDALRasterBand* mask, const Place& place, QuietGdal& quiet) {
  const int u = std::min(static_cast<int>(place.u_px), std::max(0, band.GetXSize() - 2));
  const int v = std::min(static_cast<int>(place.v_px), std::max(0, band.GetYSize() - 2));
  const int width = std::min(2, band.GetXSize());
  const int height = std::min(2, band.GetYSize());
  double z[4] = {};
  std::uint8_t valid[4] = {255, 255, 255, 255};
  quiet.check(band.RasterIO(GF_Read, u, v, width, height, z, width, height, GDT_Float64, 0, 0, nullptr));
  if (mask != nullptr)
    quiet.check(mask->RasterIO(GF_Read, u, v, width, height, valid, width, height, GDT_Byte, 0, 0, nullptr));
  const double right = place.u_px - u;
  const double down = place.v_px - v;
  double sum = 0.0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double weight = (x == 0 ? 1.0 - right : right) * (y == 0 ? 1.0 - down : down);
      if (weight == 0.0) continue;
      const int i = y * width + x;
      if (valid[i] == 0) return std::numeric_limits<double>::quiet_NaN();
      sum += weight * z[i];
    }
  }
  return sum;
}

/// Metres of one unit of the model's heights: its band's, else its vertical system's; metres
/// where neither tells.
double metres_a_unit(GDALDataset& model, GDALRasterBand& band, const std::string& name) {
  struct Unit {
    const char* name;
    double metres;
  };
  constexpr double kFoot = 0.3048;
  constexpr double kSurveyFoot = 1200.0 / 3937.0;
  constexpr Unit kUnits[] = {{"m", 1.0},
                             {"metre", 1.0},
                             {"meter", 1.0},
                             {"metres", 1.0},
                             {"meters", 1.0},
                             {"km", 1000.0},
                             {"kilometre", 1000.0},
                             {"kilometer", 1000.0},
                             {"cm", 0.01},
                             {"centimetre", 0.01},
                             {"mm", 0.001},
                             {"ft", kFoot},
                             {"foot", kFoot},
                             {"feet", kFoot},
                             {"international foot", kFoot},
                             {"us survey foot", kSurveyFoot},
                             {"us survey feet", kSurveyFoot},
                             {"us-ft", kSurveyFoot},
                             {"ftus", kSurveyFoot},
                             {"sft", kSurveyFoot},
                             {"foot_us", kSurveyFoot},
                             {"us_survey_foot", kSurveyFoot},
                             {"us foot", kSurveyFoot}};
  const char* const unit = band.GetUnitType();
  if (unit != nullptr && *unit != '\0') {
    for (const Unit& known : kUnits) {
      if (EQUAL(unit, known.name)) return known.metres;
    }
    throw ToolError(
        "{}: its heights are in '{}', which is not known; convert them to metres with gdal_calc.py, or "
        "correct the unit with gdal_edit.py -units m",
        name, unit);
  }
  const OGRSpatialReference* const system = model.GetSpatialRef();
  if (system == nullptr || system->GetAttrNode("VERT_CS") == nullptr) return 1.0;
  return system->GetTargetLinearUnits("VERT_CS");
}

/// Positive down, as depths are.
bool counts_down(GDALDataset& model) {
  const OGRSpatialReference* const system = model.GetSpatialRef();
  OGRAxisOrientation towards = OAO_Up;
  if (system != nullptr && system->GetAttrNode("VERT_CS") != nullptr) system->GetAxis("VERT_CS", 0, &towards);
  return towards == OAO_Down;
}

void refuse_picture(GDALDataset& model, const std::string& name) {
  const bool bytes = model.GetRasterBand(1)->GetRasterDataType() == GDT_Byte;
  if (!bytes || (model.GetRasterCount() < 3 && model.GetRasterBand(1)->GetColorTable() == nullptr)) return;
  throw ToolError(
      "{}: is a picture in colours, no elevation model; give the raster of heights it was made of", name);
}

/// The two least of different values and the two largest, of what has been added.
struct Ends {
  double least[2] = {INFINITY, INFINITY};
  double largest[2] = {-INFINITY, -INFINITY};

  void add(double z) {
    if (z < least[0]) {
      least[1] = least[0];
      least[0] = z;
    } else if (z > least[0] && z < least[1]) {
      least[1] = z;
    }
    if (z > largest[0]) {
      largest[1] = largest[0];
      largest[0] = z;
    } else if (z < largest[0] && z > largest[1]) {
      largest[1] = z;
    }
  }
};

constexpr int kAroundPx = 64;            // of the places: ground to compare with
constexpr double kMostLooked = 64e6;     // pixels
constexpr double kVoidStep_m = 50.0;     // to the next height: no cliff of one height alone
constexpr double kVoidTimesRange = 4.0;  // and so many times what all the others span

/// Voids that nothing marks as no data, -9999 say, would become ground. `places` in the model's system.
void refuse_voids(GDALRasterBand& band, GDALRasterBand* mask, const double inverse[6],
                  const std::vector<Vec2>& places, double metres, const std::string& name, QuietGdal& quiet) {
  double box[4] = {INFINITY, INFINITY, -INFINITY, -INFINITY};
  for (const Vec2& p : places) {
    const double column = inverse[0] + p.x() * inverse[1] + p.y() * inverse[2];
    const double row = inverse[3] + p.x() * inverse[4] + p.y() * inverse[5];
    if (!std::isfinite(column) || !std::isfinite(row)) continue;
    box[0] = std::min(box[0], column - kAroundPx);
    box[1] = std::min(box[1], row - kAroundPx);
    box[2] = std::max(box[2], column + kAroundPx);
    box[3] = std::max(box[3], row + kAroundPx);
  }
  const int x0 = static_cast<int>(std::clamp(box[0], 0.0, 1.0 * band.GetXSize()));
  const int y0 = static_cast<int>(std::clamp(box[1], 0.0, 1.0 * band.GetYSize()));
  const int width = static_cast<int>(std::clamp(box[2], 0.0, 1.0 * band.GetXSize())) - x0;
  const int height = static_cast<int>(std::clamp(box[3], 0.0, 1.0 * band.GetYSize())) - y0;
  if (width <= 0 || height <= 0) return;
  const int step = 1 + static_cast<int>(1.0 * width * height / kMostLooked);
  std::vector<double> z(static_cast<std::size_t>(width));
  std::vector<std::uint8_t> valid(z.size(), 255);
  Ends ends;
  for (int y = y0; y < y0 + height; y += step) {
    quiet.check(band.RasterIO(GF_Read, x0, y, width, 1, z.data(), width, 1, GDT_Float64, 0, 0, nullptr));
    if (mask != nullptr)
      quiet.check(mask->RasterIO(GF_Read, x0, y, width, 1, valid.data(), width, 1, GDT_Byte, 0, 0, nullptr));
    for (std::size_t i = 0; i < z.size(); ++i) {
      if (valid[i] != 0 && std::isfinite(z[i])) ends.add(z[i]);
    }
  }
  const double others = ends.largest[1] - ends.least[1];
  if (quiet.failed() || !(others >= 0.0)) return;  // of two values nothing can be told
  const auto refuse_far = [&](const double end[2]) {
    const double away = std::fabs(end[0] - end[1]);
    if (away * std::fabs(metres) <= kVoidStep_m || away <= kVoidTimesRange * others) return;
    throw ToolError(
        "{}: has pixels of {} where all others are {:.4g} or more away, and nothing marks them as no data; mark "
        "them with gdal_edit.py -a_nodata {}",
        name, end[0], away, end[0]);
  };
  refuse_far(ends.least);
  refuse_far(ends.largest);
}

}  // namespace

GroundHeights heights_at(const std::filesystem::path& dem, const std::vector<Vec2>& places,
                         const std::string& reference_system) {
  const std::string name = dem.string();
  QuietGdal quiet;
  const std::unique_ptr<GDALDataset> model = open_raster(name, "an elevation model", quiet);
  double geo[6] = {};
  double inverse[6] = {};
  if (model->GetGeoTransform(geo) != CE_None || GDALInvGeoTransform(geo, inverse) == 0) {
    throw ToolError("{}: has no geo-reference; give an elevation model with one (GeoTIFF, or a world file)",
                    name);
  }
  refuse_picture(*model, name);
  GDALRasterBand& band = *model->GetRasterBand(1);
  GDALRasterBand* const mask = band.GetMaskFlags() == GMF_ALL_VALID ? nullptr : band.GetMaskBand();
  const double unit_m = metres_a_unit(*model, band, name) * (counts_down(*model) ? -1.0 : 1.0);
  const double scale = band.GetScale(nullptr);
  const double offset = band.GetOffset(nullptr);
  if (!(std::fabs(scale) > 0.0))
    throw ToolError("{}: its scale is {}; correct it with gdal_edit.py -scale", name, scale);

  GroundHeights heights;
  heights.z_m.assign(places.size(), std::numeric_limits<double>::quiet_NaN());
  std::vector<Vec2> looked_up = places;
  if (!places.empty()) looked_up.push_back(places[0] + Vec2(1.0, 0.0));  // how large a pixel is
  looked_up = places_in_model(*model, name, std::move(looked_up), reference_system);
  if (!places.empty()) {
    const Vec2 metre = looked_up.back() - looked_up.front();
    looked_up.pop_back();
    const double pixels = std::hypot(inverse[1] * metre.x() + inverse[2] * metre.y(),
                                     inverse[4] * metre.x() + inverse[5] * metre.y());
    if (std::isfinite(pixels) && pixels > 0.0) heights.pixel_m = 1.0 / pixels;
  }
  refuse_voids(band, mask, inverse, looked_up, scale * unit_m, name, quiet);
  for (const Place& place : places_on(band, inverse, looked_up)) {
    const double z_m = (height_at(band, mask, place, quiet) * scale + offset) * unit_m;
    if (quiet.failed()) throw ToolError("{}: cannot be read whole{}; check the file", name, quiet.reason());
    if (!std::isfinite(z_m)) continue;
    heights.z_m[place.index] = z_m;
    ++heights.known;
  }
  return heights;
}

std::size_t sample_heights(const std::filesystem::path& dem, std::vector<TableBoulder>& boulders,
                           const std::string& reference_system) {
  std::vector<Vec2> places;
  places.reserve(boulders.size());
  for (const TableBoulder& b : boulders) places.push_back(b.p_map_m);
  const GroundHeights heights = heights_at(dem, places, reference_system);
  for (std::size_t i = 0; i < boulders.size(); ++i) boulders[i].ground_z_m = heights.z_m[i];
  if (heights.known == 0 && !boulders.empty()) {
    throw ToolError("{}: has no height under any of the {} boulders; give the elevation model of this site",
                    dem.string(), boulders.size());
  }
  return heights.known;
}

}  // namespace cairn::ground
