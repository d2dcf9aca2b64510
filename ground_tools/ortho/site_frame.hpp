/// How the plane of a projection lies on the ground at a site: its north, its scale, its hand.
#pragma once

#include <optional>
#include <string>

#include "base/boulder_table.hpp"
#include "core/eigen.hpp"

class OGRSpatialReference;

namespace cairn::ground {

struct SiteFrame {
  /// Map metres of one metre on the ground: columns east and north. The identity where no body is known. From
  /// PROJ's forward and inverse projection, by central differences on the system's ellipsoid: good to 1e-7.
  Mat2 map_from_ground = Mat2::Identity();
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;

  /// Clockwise from true north to clockwise from the map's y axis, [0, 2 pi), and back.
  double azimuth_in_map(double from_north_rad) const;
  double azimuth_from_north(double in_map_rad) const;
  /// Metres on the ground of one metre along the map's x and y axis.
  Vec2 ground_per_map() const;
};

/// At a place of a projected system. Nothing for local systems, and where the place is none of the body.
std::optional<SiteFrame> site_frame(const OGRSpatialReference* system, const Vec2& p_map_m);
/// The same of a text as in reference_system.hpp.
std::optional<SiteFrame> site_frame(const std::string& reference, const Vec2& p_map_m);

/// Metres on the ground of one metre of the map, most and least over all directions. Between the axes where
/// the projection shears.
Vec2 scale_limits(const SiteFrame& frame);
/// Most that one of these departs from 1: 0.04 for HiRISE's maps at 56.5 N.
double scale_error(const SiteFrame& frame);

/// Beyond this a map's metres are told from the ground's,
inline constexpr double kScaleTolerance = 1e-3;
/// and beyond this the map is made in local_reference() unless it is told otherwise.
inline constexpr double kScaleLeft = 1e-2;

/// A transverse Mercator system of the same body centred on the site, to 0.1 degrees, so that images of one
/// site share it: within 1e-5 of true scale and 0.1 degrees of true north. `reference` must have a body.
std::string local_reference(const std::string& reference, const SiteFrame& frame);
std::string local_reference(const OGRSpatialReference& system, const SiteFrame& frame);

/// In words, what a metre of the system is on the ground at a place; empty where it is one within
/// kScaleTolerance, or no body is known.
std::string scale_words(const std::string& reference, const Vec2& p_map_m);

}  // namespace cairn::ground
