/// Calibrations of stereo pairs as people have them, into one model (camera_model.hpp).
///
///   plain          one line `fx fy cx cy baseline`, or two rows of 3x4 projections; pixels, metres
///   KITTI          rows P0 ... P3; calib_cam_to_cam.txt (P_rect_0x; S, K, D, R, T of the raw images)
///   Middlebury     cam0=[f 0 cx; 0 f cy; 0 0 1] cam1=... doffs= baseline= (millimetres) width= height=
///   EuRoC (ASL)    sensor.yaml of cam0 and cam1: T_BS, intrinsics, distortion
///   kalibr         camchain: cam0, cam1 with T_cn_cnm1; OpenVINS': T_imu_cam of both
///   ROS            camera_info of left and right: projection_matrix (P), camera_matrix (K), distortion (D),
///                  rectification_matrix (R)
///   OpenCV         stereoCalibrate and stereoRectify, in one file or two: M1 D1 M2 D2 R T R1 R2 P1 P2, and
///                  the names of stereo_calib's kin (K1, cameraMatrix1, distCoeffs1, LEFT.K ...)
///   fx fy cx cy    as YAML keys or `key = value`, with bf or baseline (ORB-SLAM, Camera.fx ...), or two
///                  cameras and the right one's pose (ORB-SLAM3: Camera1, Camera2, Stereo.T_c1_c2 or Tlr)
///   PDS3 labels    GEOMETRIC_CAMERA_MODEL of left and right: CAHV, CAHVOR, CAHVORE
///
/// Where a file tells of rectified images and of raw ones, which of the two is asked for is the caller's.
/// Distortion models that are not in camera_model.hpp are refused by name, and so are keys that look like
/// those of a lens and are not understood: no lens is left out in silence.
#pragma once

#include <filesystem>
#include <vector>

#include "dataset/camera_model.hpp"

namespace cairn::ground {

enum class ImagesAre : std::uint8_t { kRectified, kRaw };

struct RigQuestion {
  ImagesAre images = ImagesAre::kRectified;  ///< where the files tell of both
  bool raw_alone = false;                    ///< refuse what tells of rectified images alone
  bool colour = false;                       ///< KITTI: cameras 2 and 3, not 0 and 1
};

/// One file, or left then right. Throws ToolError, one line with the file and the mend: cannot be read, not
/// one of these formats, a key that is missing, a fault that `fault_of` knows.
CameraPair read_rig(const std::vector<std::filesystem::path>& files, const RigQuestion& question = {});

}  // namespace cairn::ground
