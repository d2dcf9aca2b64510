/// Reference systems as short texts: what the head of a flight map carries, and what every product
/// is stamped with.
///
///   "EPSG:32633", "IAU_2015:49910"      where an authority has a number for it
///   "+proj=eqc +lat_ts=-38.07 ..."      else PROJ's words, those that are defaults left out: HiRISE's
///                                       systems, which have the local radius of Mars and no number,
///                                       take about 80 characters
///   "local", "local:rover site"         neither: a plane in metres that nothing ties to a body
///
/// Printable ASCII, at most kMaxReferenceBytes characters.
#pragma once

#include <cstddef>
#include <string>

class OGRSpatialReference;

namespace cairn::ground {

inline constexpr std::size_t kMaxReferenceBytes = 255;

/// The text of a projected or local system in metres. nullptr is "local".
std::string reference_text(const OGRSpatialReference* system);

/// The system that a text means, axes east then north; any text that PROJ or GDAL reads will do, WKT, too. A
/// local one becomes an engineering system of that name. Throws ToolError that names `what` where
/// the text is none.
OGRSpatialReference reference_of(const std::string& text, const std::string& what);

/// Whether both mean the same system, however written. Local ones are the same where their texts are; a text
/// that cannot be read is the same as itself.
bool same_reference(const std::string& a, const std::string& b);

/// "local" or "local:..." or nothing at all.
bool is_local_reference(const std::string& text);

}  // namespace cairn::ground
