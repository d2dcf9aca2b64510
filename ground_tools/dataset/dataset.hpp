/// A stereo data set on disk: image pairs, calibration, and truth where there is some.
///
/// Layout (doc/guide/drives.md tells the same to the user):
///   images       folders and names: stereo_folder.hpp; kinds: image.hpp
///   calibration  calib.txt, or what rig_file.hpp reads under the names that it usually has, or files
///                that are given. A pair that is not rectified is rectified here (rectify.hpp); where the
///                calibration tells of raw and rectified images, sizes decide, else the caller.
///   stamps       optional: times.txt (seconds, a row a frame) or timestamps.txt (frame number, stamp, ...;
///                or KITTI raw's dates, a row a frame), here or beside the left images. Without them a
///                frame's stamp is that of its name where names are times, else its number. Units:
///                unit_of_stamps.
///   truth        optional: truth_left_camera.tum (stamp tx ty tz qx qy qz qw: T_map_cam), or KITTI's
///                poses.txt, also as ../../poses/NN.txt of sequences/NN (3x4 row-major T_world_cam, world
///                x right, y down, z forward; of the camera that P0 describes); truth_rover.txt (frame,
///                arc length, x y z, yaw pitch roll in degrees: T_map_rover); truth_rocks.csv (columns id,
///                x, y, z_ground, diameter, height; others are ignored). EuRoC's
///                mav0/state_groundtruth_estimate0/data.csv (T_world_body). Stamped poses up to 0.1 s
///                apart are interpolated.
///
/// Frames. A KITTI-style world becomes `map` by
///   x_map = z_world (forward),   y_map = -x_world (left),   z_map = -y_world (up)
/// so that plans are seen from above with the start heading along +x.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dataset/camera_model.hpp"
#include "dataset/drive.hpp"
#include "dataset/rectify.hpp"
#include "dataset/rig_file.hpp"
#include "dataset/stereo_folder.hpp"
#include "dataset/trajectory.hpp"

namespace cairn::ground {

class Dataset : public Drive {
 public:
  /// Throws ToolError, one line with the file and the mend: no folder, no images, no or wrong calibration,
  /// truth or stamps that cannot be read, no image that can be decoded (for the size).
  /// `calibration`: one file or two (left, right) in place of the folder's own. `images`: what they are
  /// where it tells of both kinds.
  static Dataset open(const std::filesystem::path& folder,
                      const std::vector<std::filesystem::path>& calibration = {},
                      ImagesAre images = ImagesAre::kRectified);

  const std::filesystem::path& folder() const { return folder_; }
  /// Of the images as `images` gives them: rectified. T_rover_cam stays identity: where the rig sits
  /// is the mission's.
  std::string name() const override { return folder_.string(); }
  const StereoRig& rig() const override { return rig_; }
  std::size_t size() const override { return frames_.size(); }
  FrameTag tag(std::size_t index) const override { return {frames_[index].number, frames_[index].stamp_s}; }
  PairImages images(std::size_t index) const override;
  const std::vector<Frame>& frames() const { return frames_; }
  /// As the calibration tells of the files.
  const CameraPair& cameras() const { return cameras_; }
  /// Null where images are taken as they are.
  const Rectification* rectification() const { return rectification_.get(); }
  /// What was decided on the way and what does not fit, a line each: a warning to who flies it.
  const std::vector<std::string>& notes() const { return notes_; }

  /// T_map_cam (left camera) and T_map_rover of the frame at `index`; empty where the data set has none.
  std::optional<Pose3> truth_cam(std::size_t index) const override;
  std::optional<Pose3> truth_rover(std::size_t index) const override;
  /// Empty where the data set has none.
  const std::vector<TruthRock>& truth_rocks() const override { return truth_rocks_; }

 private:
  void measure_images();
  void measure_samples();
  void read_calibration(const std::vector<std::filesystem::path>& given, ImagesAre images);
  void take_rectified(const std::filesystem::path& calibration);
  void read_stamps();
  void read_truth();
  void read_kitti_poses(const std::filesystem::path& path);
  void read_rover_truth(const std::filesystem::path& path);
  double turn_of_camera(const std::map<int, Pose3>& rover) const;
  void take_stamped(const std::filesystem::path& path, const Trajectory& truth);

  std::filesystem::path folder_;
  std::filesystem::path left_folder_;
  std::filesystem::path right_folder_;
  StereoRig rig_;
  int file_width_px_ = 0;  ///< of most images that can be read
  int file_height_px_ = 0;
  CameraPair cameras_;
  std::shared_ptr<const Rectification> rectification_;  ///< null: images are taken as they are
  int sample_bits_ = 16;                                ///< that 16-bit images use
  std::vector<std::string> notes_;
  std::vector<Frame> frames_;
  std::vector<std::optional<Pose3>> truth_cam_;  ///< as frames_
  std::map<int, Pose3> truth_rover_;             ///< by frame number
  std::vector<TruthRock> truth_rocks_;
};

}  // namespace cairn::ground
