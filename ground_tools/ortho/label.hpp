/// The numbers that an image says of itself, whatever the format of its label.
#pragma once

#include <initializer_list>
#include <map>
#include <optional>
#include <string>

class GDALDataset;

namespace cairn::ground {

/// Names in capitals without underlines, blanks and what stands before a colon -> number; the first of a name
/// stays. Angles told in radians are in degrees. PDS3's 16#FF7FFFFB# is the whole number of these digits.
using Label = std::map<std::string, double>;

/// GDAL's metadata items, the labels of ISIS cubes, PDS3, PDS4 and VICAR products, and a PDS3 label of the
/// same name beside the image (`.LBL`, as HiRISE has them beside JPEG 2000).
Label label_of(GDALDataset& image);

/// The first of these names that the label has.
std::optional<double> first_of(const Label& label, std::initializer_list<const char*> names);

}  // namespace cairn::ground
