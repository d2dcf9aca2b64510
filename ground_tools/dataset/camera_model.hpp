/// A camera as calibrations tell of it, raw or rectified: a lens that bends rays, then a pinhole; and a pair.
///
/// A point p of the camera's frame (x right, y down, z forward, metres) is seen at
///   (x, y) = lens(p)      u = fx x + s y + cx      v = fy y + cy        pixel centres at whole numbers
/// With a = p.x / p.z, b = p.y / p.z, r2 = a a + b b, theta = atan(r), t = theta2:
///   none                (a, b)
///   radial-tangential   k1 k2 p1 p2 k3 (Brown; OpenCV's first five, kalibr's radtan, ROS' plumb_bob):
///                       x = a (1 + k1 r2 + k2 r4 + k3 r6) + 2 p1 a b + p2 (r2 + 2 a a), y alike
///   rational            k1 k2 p1 p2 k3 k4 k5 k6: the radial factor divided by 1 + k4 r2 + k5 r4 + k6 r6
///   equidistant         k1 k2 k3 k4 (Kannala, Brandt; OpenCV's fisheye): theta (1 + k1 t + k2 t2 + ...) / r
///   CAHVOR, CAHVORE     about an axis O of its own (Gennery, "Generalized camera calibration including
///                       fish-eye lenses", IJCV 2006): r0 r1 r2, and e0 e1 e2, linearity
/// CAHV's C, A, H, V become pose and pinhole: z = A, fy y = V - (V.A) A, fx x + s y = H - (H.A) A.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "geometry/stereo_rig.hpp"

namespace cairn::ground {

enum class Lens : std::uint8_t { kNone, kRadialTangential, kRational, kEquidistant, kCahvor, kCahvore };

struct CameraModel {
  int width_px = 0;  ///< 0: not told
  int height_px = 0;
  double fx_px = 0.0;
  double fy_px = 0.0;
  double cx_px = 0.0;
  double cy_px = 0.0;
  double skew_px = 0.0;
  Lens lens = Lens::kNone;
  std::array<double, 8> k{};        ///< as above, zeros behind
  Vec3 axis = Vec3(0.0, 0.0, 1.0);  ///< of CAHVOR and CAHVORE: O in this camera's frame
};

/// CAHV and what follows, all in one frame of reference; O, R, E where the lens has them.
struct Cahv {
  Vec3 c, a, h, v;
  Vec3 o = Vec3(0.0, 0.0, 0.0);
  Vec3 r = Vec3(0.0, 0.0, 0.0);
  Vec3 e = Vec3(0.0, 0.0, 0.0);
  double linearity = 1.0;  ///< of CAHVORE: 1 perspective, 0 fish-eye
};
struct PosedCamera {
  CameraModel camera;
  Pose3 T_cam_ref;
};
/// `lens`: none for CAHV.
PosedCamera from_cahv(const Cahv& model, Lens lens);

/// Where the camera sees a point; nothing behind it, and where the lens' polynomial turns back.
std::optional<Vec2> project(const CameraModel& camera, const Vec3& p_cam_m);
/// The direction, z = 1, that is seen at a pixel, by Newton from the pinhole's; nothing where there is none.
std::optional<Vec3> direction(const CameraModel& camera, const Vec2& pixel);
/// The angle between what is seen at the middle of opposite edges, radians: across, and down. Nothing where
/// the size is not told, or an edge sees nothing before the camera.
std::optional<Vec2> fields_of_view(const CameraModel& camera);
const char* lens_name(Lens lens);

/// A stereo pair: p_right = T_right_left p_left.
struct CameraPair {
  std::string format;  ///< for people: what kind of calibration it was
  CameraModel left;
  CameraModel right;
  Pose3 T_right_left;
  /// The left camera in the frames that truth is told of where the calibration has them: KITTI's camera 0 (of
  /// poses.txt), EuRoC's body.
  Pose3 T_cam0_left;
  Pose3 T_body_left;
  bool rectified_alone = false;    ///< the calibration tells of no raw images
  std::vector<std::string> notes;  ///< what had to be decided, a line each
};

/// Length of the baseline, metres.
double baseline_m(const CameraPair& pair);
/// Why the flight module cannot take images of this pair as they are; empty where it can: no lens, no skew,
/// equal intrinsics (focal lengths to 1e-6, centres to 1e-3 px), no turn (1e-6 rad), the right camera on the
/// left one's x axis (to 1 % of the baseline: KITTI's projections have half of that).
std::string why_not_rectified(const CameraPair& pair);
/// What a calibration is surely wrong in, with the mend; empty where nothing is: numbers that are not finite,
/// focal lengths of 0, of more than 1e5 px or one of twice the other, intrinsics that were normalised, a
/// principal point outside of the image, a baseline of more than 10 m (millimetres, or the product with the
/// focal length), of less than 0.01 m or none, cameras that are swapped.
std::string fault_of(const CameraPair& pair);
/// What is likely wrong in one, with the mend; empty where nothing is: a principal point more than 12 % of
/// the size from the middle of the image, focal lengths that differ by more than 5 %. Some good rigs are so.
std::string doubt_of(const CameraPair& pair);

/// The rig that flight code is told. Asks for a rectified pair.
StereoRig rectified_rig(const CameraPair& pair);

}  // namespace cairn::ground
