#include "ortho/true_scale.hpp"

#include <ogr_spatialref.h>

#include <algorithm>
#include <cmath>

#include "base/quiet_gdal.hpp"
#include "base/tool_error.hpp"
#include "ortho/reference_system.hpp"

namespace cairn::ground {

struct Places::Inside {
  OGRSpatialReference from;
  OGRSpatialReference to;
  std::unique_ptr<OGRCoordinateTransformation> between;
};

Places::Places(const std::string& from, const std::string& to) : inside_(std::make_unique<Inside>()) {
  const QuietGdal quiet;
  inside_->from = reference_of(from, "the map");
  inside_->to = reference_of(to, "the map");
  inside_->between.reset(OGRCreateCoordinateTransformation(&inside_->from, &inside_->to));
  if (inside_->between == nullptr)
    throw ToolError("{} and {} cannot be transformed into each other{}; use gdalwarp -t_srs", from, to,
                    quiet.reason());
}

Places::~Places() = default;

Vec2 Places::operator()(const Vec2& p_m) const {
  const QuietGdal quiet;
  double x = p_m.x();
  double y = p_m.y();
  return inside_->between->Transform(1, &x, &y) != 0 ? Vec2(x, y) : Vec2(NAN, NAN);
}

Vec2 middle_of(const RasterFacts& facts) {
  return facts.geo.to_map(0.5 * (facts.width - 1), 0.5 * (facts.height - 1));
}

TrueScaleSource::TrueScaleSource(std::unique_ptr<RasterSource> image, const SiteFrame& frame)
    : image_(std::move(image)),
      places_(image_->facts().reference_system, local_reference(image_->facts().reference_system, frame)),
      facts_(image_->facts()),
      middle_m_(middle_of(image_->facts())),
      middle_there_m_(places_(middle_m_)) {
  facts_.reference_system = local_reference(image_->facts().reference_system, frame);
  const std::optional<SiteFrame> there = site_frame(facts_.reference_system, middle_there_m_);
  if (!there || !std::isfinite(middle_there_m_.x()))
    throw ToolError("{}: its place cannot be told on the ground; reproject it with gdalwarp -t_srs '{}'",
                    facts_.name, facts_.reference_system);
  const Mat2 to_affine = there->map_from_ground * frame.map_from_ground.inverse();
  from_affine_ = to_affine.inverse();
  double* const c = facts_.geo.c;
  Mat2 pixel;
  pixel << c[1], c[2], c[4], c[5];
  const Vec2 corner = middle_there_m_ + to_affine * (Vec2(c[0], c[3]) - middle_m_);
  const Mat2 turned = to_affine * pixel;
  c[0] = corner.x();
  c[1] = turned(0, 0);
  c[2] = turned(0, 1);
  c[3] = corner.y();
  c[4] = turned(1, 0);
  c[5] = turned(1, 1);
}

Vec2 TrueScaleSource::exact(const Vec2& p_affine_m) const {
  return places_(middle_m_ + from_affine_ * (p_affine_m - middle_there_m_));
}

void TrueScaleSource::place(std::vector<TableBoulder>& boulders) const {
  for (TableBoulder& b : boulders) b.p_map_m = exact(b.p_map_m);
  boulders.erase(std::remove_if(boulders.begin(), boulders.end(),
                                [](const TableBoulder& b) { return !b.p_map_m.allFinite(); }),
                 boulders.end());
}

MapExtent TrueScaleSource::extent() const {
  constexpr int kSteps = 8;  // sides bend a little
  MapExtent e{middle_there_m_.x(), middle_there_m_.y(), middle_there_m_.x(), middle_there_m_.y()};
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const Vec2 p = exact(facts_.geo.to_map(facts_.width * static_cast<double>(i) / kSteps - 0.5,
                                             facts_.height * static_cast<double>(j) / kSteps - 0.5));
      if (!p.allFinite()) continue;
      e = {std::min(e.min_x_m, p.x()), std::min(e.min_y_m, p.y()), std::max(e.max_x_m, p.x()),
           std::max(e.max_y_m, p.y())};
    }
  }
  return e;
}

}  // namespace cairn::ground
