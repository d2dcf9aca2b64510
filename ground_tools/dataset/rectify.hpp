/// From a raw rig to a rectified one: the tables by which `fsw/image/remap.hpp` lays each camera's images
/// anew, and the rig that they then are of.
///
/// Both cameras are turned about their centres, so that x runs along the baseline and z is the mean of the
/// two optical axes made normal to it (Fusiello, Trucco, Verri, "A compact algorithm for rectification of
/// stereo pairs", Machine Vision and Applications 12, 2000; the mean as in Bouguet's toolbox). Focal lengths
/// and principal point are the means of the two cameras', which keeps the scale in the middle of a lens'
/// image. Where that would show more than kMostBeyond of the width from beyond a source's border, the focal
/// lengths are raised until it doesn't: no wide black rims that features could stick to.
#pragma once

#include <string>

#include "dataset/camera_model.hpp"
#include "dataset/image.hpp"
#include "image/remap.hpp"

namespace cairn::ground {

struct Rectification {
  /// As rectified; poses of the left camera are of the turned one, notes and format are the raw one's.
  CameraPair pair;
  Pose3 T_left_rect;  ///< from the rectified left camera to the raw one: a turn
  double zoom = 1.0;  ///< by which focal lengths were raised
  RemapTable left;
  RemapTable right;
};

inline constexpr double kMostBeyond = 0.02;

/// Why there is none, else empty and `out` is filled. Sizes must be told; the target has the source's, or the
/// mission's where that is smaller (the middle is kept). None: images of two sizes or above 2048 px a side,
/// cameras that look more than a right angle apart, no common field at four times the focal length.
std::string rectify(const CameraPair& raw, Rectification& out);

/// An image of the raw size as the table lays it, by the flight code's own warp.
Image remapped(const RemapTable& table, const Image& image);

/// A header for the integrator: both tables, their CRCs and the raw size, and in its comment what is to be
/// said in mission_values.hpp. `source`: what the calibration was read from.
std::string rectification_header(const CameraPair& raw, const Rectification& made, const std::string& source);

/// Where the rectified pixel lies in the raw image, by the model itself and not by the table; nothing where
/// the lens doesn't see it.
std::optional<Vec2> raw_pixel(const CameraModel& raw, const CameraModel& rectified, const Quat& q_raw_rect,
                              const Vec2& pixel);

/// Does the raw image show what the rectified pixel is to show? Beyond it the border's grey is repeated.
bool has_source(const CameraModel& raw, const CameraModel& rectified, const Quat& q_raw_rect,
                const Vec2& pixel);

/// Shares of the rectified pixels that have a source, 0 to 1: in the left image, in the right one, at one
/// place in both.
struct SourceArea {
  double left = 0.0;
  double right = 0.0;
  double both = 0.0;
};
SourceArea source_area(const CameraPair& raw, const Rectification& rectification);

/// What both sides' turns are, q_raw_rect.
struct RectifyingTurns {
  Quat left;
  Quat right;
};
RectifyingTurns rectifying_turns(const CameraPair& raw);

}  // namespace cairn::ground
