/// Where the sun stood, as an orthoimage's label tells it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "ortho/sun.hpp"

class GDALDataset;

namespace cairn::ground {

struct SiteFrame;

/// Looks for the sun in what the image says of itself: GDAL's metadata items, the labels of ISIS cubes, PDS3
/// and PDS4 products, and a PDS3 label of the same name beside the image (`.LBL`, as HiRISE has them beside
/// JPEG 2000). Names are compared without case, underlines and blanks; angles are degrees.
///
///   elevation   SUN_ELEVATION, SOLAR_ELEVATION (each also ..._ANGLE), or 90 less INCIDENCE_ANGLE or
///               SOLAR_INCIDENCE_ANGLE
///   azimuth     SUN_AZIMUTH, SOLAR_AZIMUTH (each also ..._ANGLE), ISIS's SubSolarGroundAzimuth: clockwise
///               from north. Else SUB_SOLAR_AZIMUTH or SUBSOLAR_AZIMUTH, which PDS, HiRISE and ISIS measure
///               clockwise from the line that leads from the image's centre to the right (3 o'clock): a
///               direction of the image, whatever its turn or flip, that goes through its geo-transform.
///               Where NORTH_AZIMUTH, measured alike, is more than 5 degrees off the image's north, the label
///               is of another picture: then the difference of the two is the azimuth from north
///
/// An ISIS cube without these keys, but with the tables that `spiceinit` puts into it (SunPosition,
/// BodyRotation), tells the sun all the same: its direction in the body's frame, seen from the middle
/// of the image.
///
/// North of a label is the pole's; the result is in the map's axes (SiteFrame::azimuth_in_map at the middle
/// of the image); without a reference system both are the same.
///
/// Nothing where elevation or azimuth is missing, no number, or out of range (elevation 1 to 90 degrees).
std::optional<Sun> find_sun(GDALDataset& image);

/// Of an ISIS cube's label as GDAL has it in JSON, with the tables of spiceinit: elevation and azimuth from
/// north, degrees, seen from `middle`. Nothing where they are not there or not as ISIS writes them.
std::optional<Vec2> sun_of_spice(const nlohmann::json& label, const SiteFrame& middle);

}  // namespace cairn::ground
