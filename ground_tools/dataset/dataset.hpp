/// A stereo data set on disk: rectified image pairs, calibration, and truth where there is some.
///
/// Layout (doc/guide/drives.md tells the same to the user):
///   images       left/ and right/, or image_l/ + image_r/, image_0/ + image_1/, image_2/ + image_3/ (first
///                pair found); JPEG, PNG or TIFF. Order: shorter names first, then by text, so that numbers
///                need no leading zeros. Left and right belong together by name without extension. An image
///                missing on one side is a frame with an empty path there, no error: a camera may fail.
///   calib.txt    one line `fx fy cx cy baseline` (pixels, pixel centres at integers; metres), or two rows of
///                3x4 projection matrices, left then right; with tags `P0:` ... `P3:` (KITTI), P2 and P3
///                serve image_2 and image_3, P0 and P1 the others.
///   stamps       optional: times.txt (seconds, a row a frame) or timestamps.txt (frame number, stamp, ...).
///                Stamps of 1e12 and more are nanoseconds. Without them a frame's stamp is its number.
///   truth        optional: truth_left_camera.tum (stamp tx ty tz qx qy qz qw: T_map_cam), or poses.txt
///                (KITTI: 3x4 row-major T_world_cam, world x right, y down, z forward; of the camera that P0
///                describes); truth_rover.txt (frame, arc length, x y z, yaw pitch roll in degrees:
///                T_map_rover); truth_rocks.csv (columns id, x, y, z_ground, diameter, height;
///                others are ignored).
///
/// Frames. A KITTI-style world becomes `map` by
///   x_map = z_world (forward),   y_map = -x_world (left),   z_map = -y_world (up)
/// so that plans are seen from above with the start heading along +x.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "dataset/drive.hpp"

namespace cairn::ground {

struct Frame {
  int number = 0;               ///< the file's name where it is a number, else the position in the order
  double stamp_s = 0.0;         ///< the number where the data set has no times
  std::filesystem::path left;   ///< empty: missing
  std::filesystem::path right;  ///< empty: missing
};

class Dataset : public Drive {
 public:
  /// Throws ToolError, one line with the file and the mend: no folder, no images, no or wrong calibration,
  /// truth or stamps that cannot be read, no image that can be decoded (for the size).
  static Dataset open(const std::filesystem::path& folder);

  const std::filesystem::path& folder() const { return folder_; }
  /// Sizes are those of the first readable image. T_rover_cam stays identity: where the rig sits
  /// is the mission's.
  std::string name() const override { return folder_.string(); }
  const StereoRig& rig() const override { return rig_; }
  std::size_t size() const override { return frames_.size(); }
  FrameTag tag(std::size_t index) const override { return {frames_[index].number, frames_[index].stamp_s}; }
  PairImages images(std::size_t index) const override;
  const std::vector<Frame>& frames() const { return frames_; }

  /// T_map_cam (left camera) and T_map_rover of the frame at `index`; empty where the data set has none.
  std::optional<Pose3> truth_cam(std::size_t index) const override;
  std::optional<Pose3> truth_rover(std::size_t index) const override;
  /// Empty where the data set has none.
  const std::vector<TruthRock>& truth_rocks() const override { return truth_rocks_; }

 private:
  void find_images();
  void read_calibration();
  void read_stamps();
  void read_truth();
  void read_kitti_poses(const std::filesystem::path& path);

  std::filesystem::path folder_;
  std::filesystem::path left_folder_;
  StereoRig rig_;
  Vec3 p_cam0_left_m_ = Vec3(0.0, 0.0, 0.0);  ///< the left camera in the frame that poses.txt tells about
  std::vector<Frame> frames_;
  std::vector<std::optional<Pose3>> truth_cam_;  ///< as frames_
  std::map<int, Pose3> truth_rover_;             ///< by frame number
  std::vector<TruthRock> truth_rocks_;
};

}  // namespace cairn::ground
