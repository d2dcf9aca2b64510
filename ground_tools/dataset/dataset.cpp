#include "dataset/dataset.hpp"

#include <algorithm>
#include <cmath>

#include "base/number_table.hpp"
#include "base/output_file.hpp"
#include "base/tool_error.hpp"
#include "dataset/image.hpp"
#include "dataset/image_names.hpp"
#include "dataset/trajectory.hpp"

namespace fs = std::filesystem;

namespace cairn::ground {
namespace {

std::vector<fs::path> yaml_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    const std::string extension = at->path().extension().string();
    if (extension == ".yaml" || extension == ".yml") files.push_back(at->path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// The one, kalibr's one among others, or the two that differ by a word of side; empty where there is doubt.
std::vector<fs::path> only_rig(const std::vector<fs::path>& files) {
  if (files.size() == 1) return files;
  std::vector<fs::path> chains;
  std::vector<std::string> names;
  for (const fs::path& file : files) {
    names.push_back(file.stem().string());
    if (names.back().find("camchain") != std::string::npos) chains.push_back(file);
  }
  if (chains.size() == 1) return chains;
  const auto pairs = pairs_by_mark(names);
  if (pairs.size() != 1) return {};
  const auto file_of = [&](const std::string& name) {
    return files[static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin())];
  };
  return {file_of(pairs[0].first), file_of(pairs[0].second)};
}

/// Calibrations under the names that they usually have, best first; else any YAML, where there is no doubt.
std::vector<fs::path> find_calibration(const fs::path& folder, const fs::path& left, const fs::path& right) {
  const std::vector<std::vector<const char*>> usual = {
      {"calib.txt"},
      {"calib_cam_to_cam.txt"},
      {"../calib_cam_to_cam.txt"},
      {"mav0/cam0/sensor.yaml", "mav0/cam1/sensor.yaml"},
      {"cam0/sensor.yaml", "cam1/sensor.yaml"},
      {"camchain.yaml"},
      {"left.yaml", "right.yaml"},
      {"left.yml", "right.yml"},
      {"left/camera_info.yaml", "right/camera_info.yaml"},
      {"intrinsics.yml", "extrinsics.yml"},
      {"intrinsics.yaml", "extrinsics.yaml"},
  };
  for (const std::vector<const char*>& names : usual) {
    std::vector<fs::path> files;
    for (const char* name : names) {
      if (fs::exists(folder / name)) files.push_back(folder / name);
    }
    if (files.size() == names.size()) return files;
  }
  const std::vector<fs::path> here = only_rig(yaml_files(folder));
  if (!here.empty()) return here;
  const std::vector<fs::path> beside_left = yaml_files(left), beside_right = yaml_files(right);
  if (left == right || beside_left.size() != 1 || beside_right.size() != 1) return {};
  return {beside_left[0], beside_right[0]};  // ROS' ost.yaml
}

[[noreturn]] void refuse_no_calibration(const fs::path& folder) {
  std::string others;
  for (const fs::path& file : yaml_files(folder))
    others += (others.empty() ? "" : ", ") + file.filename().string();
  throw ToolError("{}: no such file, nor another calibration under a usual name (doc/guide/drives.md); {}",
                  (folder / "calib.txt").string(),
                  others.empty() ? "write one line there: fx fy cx cy baseline (pixels, metres)"
                                 : fmt::format("of {} give the rig's by --calibration", others));
}

/// poses.txt and times.txt have a row for each frame number or, where numbers begin late or skip, for each
/// frame. Throws where neither fits.
std::vector<std::size_t> rows_of_frames(const fs::path& path, std::size_t rows,
                                        const std::vector<Frame>& frames) {
  int last = 0;
  for (const Frame& frame : frames) last = std::max(last, frame.number);
  const bool by_number = static_cast<std::size_t>(last) < rows;
  if (!by_number && rows != frames.size()) {
    throw ToolError("{}: {} rows for {} frames (the last has number {}); give a row for each frame",
                    path.string(), rows, frames.size(), last);
  }
  std::vector<std::size_t> out;
  for (const Frame& frame : frames)
    out.push_back(by_number ? static_cast<std::size_t>(frame.number) : out.size());
  return out;
}

/// KITTI's, here or in poses/ beside sequences/; empty where there are none.
fs::path find_kitti_poses(const fs::path& folder) {
  const fs::path whole = fs::canonical(folder);
  const fs::path official =
      whole.parent_path().parent_path() / "poses" / (whole.filename().string() + ".txt");
  if (fs::exists(folder / "poses.txt")) return folder / "poses.txt";
  return whole.parent_path().filename() == "sequences" && fs::exists(official) ? official : fs::path();
}

/// A number that stands for a frame or a rock.
int index_of(const fs::path& path, int line, double value) {
  if (!(value >= 0.0 && value <= 1.0e9) || value != std::floor(value)) {
    throw ToolError("{}:{}: {} is not a whole number from 0 to 1e9; correct this line", path.string(), line,
                    value);
  }
  return static_cast<int>(value);
}

/// KITTI raw's `2011-09-26 13:02:25.964389445`: seconds since 1970; nothing where a line is not of that kind.
std::optional<double> seconds_of_date(std::string_view line) {
  constexpr std::string_view kForm = "dddd-dd-dd dd:dd:dd";
  const std::size_t last = line.find_last_not_of(" \t\r");
  line = last == std::string_view::npos ? std::string_view() : line.substr(0, last + 1);
  if (line.size() < kForm.size()) return std::nullopt;
  for (std::size_t i = 0; i < kForm.size(); ++i) {
    const bool digit = line[i] >= '0' && line[i] <= '9';
    if (kForm[i] == 'd' ? !digit : line[i] != kForm[i]) return std::nullopt;
  }
  const auto part = [&](std::size_t at, std::size_t count) {
    return *to_number<int>(line.substr(at, count));
  };
  const std::optional<double> second = to_finite(line.substr(17));
  if (!second) return std::nullopt;
  // Days since 1970 of the Gregorian calendar (Hinnant, "chrono-compatible low-level date algorithms").
  const int month = part(5, 2);
  const int year = part(0, 4) - (month <= 2 ? 1 : 0);
  const int era = year / 400, of_era = year - era * 400;
  const int day_of_year = (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + part(8, 2) - 1;
  const int day = era * 146097 + of_era * 365 + of_era / 4 - of_era / 100 + day_of_year - 719468;
  return day * 86400.0 + part(11, 2) * 3600.0 + part(14, 2) * 60.0 + *second;
}

/// Such a file's lines; empty where its first is none.
std::vector<double> read_dates(const fs::path& path) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  std::vector<double> out;
  int number = 0;
  for (const std::string_view line :
       split({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, '\n')) {
    ++number;
    if (line.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    const std::optional<double> second = seconds_of_date(line);
    if (!second && out.empty()) return {};
    if (!second)
      throw ToolError("{}:{}: not a date as in the lines before; correct this line", path.string(), number);
    out.push_back(*second);
  }
  return out;
}

/// The file, in the folder or beside the left images (KITTI raw's image_00/timestamps.txt).
fs::path find_times(const fs::path& folder, const fs::path& left, const char* name) {
  for (const fs::path& path : {folder / name, left.parent_path() / name}) {
    if (fs::exists(path)) return path;
  }
  return {};
}

/// How little a camera's poses are those of one that stands upright and drives where it looks: the share of
/// the path that goes sideways, or how far beyond 30 degrees from level the camera looks at its y axis.
double oddness(const Trajectory& truth) {
  double sideways_m = 0.0, path_m = 0.0, up = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Quat& q = truth[i].pose.q;
    up += (q * Vec3(0.0, 1.0, 0.0)).z();
    if (i == 0) continue;
    const Vec3 step_m = truth[i].pose.t - truth[i - 1].pose.t;
    path_m += step_m.norm();
    sideways_m += std::fabs((q.conjugate() * step_m).x());
  }
  if (!(path_m > 0.0)) return 0.0;
  constexpr double kUpright = -0.5;
  return std::max(sideways_m / path_m, up / static_cast<double>(truth.size()) - kUpright);
}

/// Quaternions are told in the other order: with it the camera goes straight, and as they are told it would
/// drive sideways or lie on its side.
bool is_order_of(const Trajectory& other, const Trajectory& told) {
  constexpr double kOdd = 0.12, kPlain = 0.06;
  return oddness(told) > kOdd && oddness(other) < kPlain;
}

/// Numbers told as qx qy qz qw, read as qw qx qy qz.
Trajectory w_first(Trajectory truth) {
  for (StampedPose& at : truth) {
    const Quat q = at.pose.q;
    at.pose.q = Quat(q.x(), q.y(), q.z(), q.w());
  }
  return truth;
}

/// What a table's angles are.
struct AngleReading {
  double unit_rad;      ///< of pitch and roll
  double yaw_unit_rad;  ///< below 0: clockwise
  double yaw_0_rad;     ///< counter-clockwise from east
};

/// The share of a rover's path that goes sideways to its headings; 0 where it stands.
double sideways(const std::map<int, Pose3>& poses) {
  double path_m = 0.0, sideways_m = 0.0;
  const Pose3* before = nullptr;
  for (const auto& [number, pose] : poses) {
    if (before != nullptr) {
      const Vec3 step_m = pose.t - before->t;
      path_m += step_m.norm();
      sideways_m += std::fabs((before->q.conjugate() * step_m).y());
    }
    before = &pose;
  }
  return path_m > 0.0 ? sideways_m / path_m : 0.0;
}

/// The stamped pose, or what lies between two that are close to each other.
std::optional<Pose3> pose_at(const Trajectory& truth, double stamp_s) {
  constexpr double kMostBetween_s = 0.1;
  if (const StampedPose* const at = find_stamp(truth, stamp_s)) return at->pose;
  const auto after = std::upper_bound(truth.begin(), truth.end(), stamp_s,
                                      [](double stamp, const StampedPose& at) { return stamp < at.stamp_s; });
  if (after == truth.begin() || after == truth.end()) return std::nullopt;
  const StampedPose& a = *(after - 1);
  const StampedPose& b = *after;
  if (b.stamp_s - a.stamp_s > kMostBetween_s) return std::nullopt;
  const double share = (stamp_s - a.stamp_s) / (b.stamp_s - a.stamp_s);
  return Pose3{(a.pose.q * quat_exp(share * quat_log(a.pose.q.conjugate() * b.pose.q))).normalized(),
               a.pose.t + share * (b.pose.t - a.pose.t)};
}

/// Truth of the left camera in EuRoC's layout, whose quaternions are told as qw qx qy qz.
Trajectory read_euroc_truth(const fs::path& path, const Pose3& T_body_cam, bool w_last = false) {
  Trajectory out;
  std::vector<double> stamps;
  for (const NumberRow& row : read_number_rows(path)) {
    const std::vector<double>& v = row.values;
    if (v.size() < 8)
      throw ToolError("{}:{}: {} numbers; it needs stamp, x y z, qw qx qy qz", path.string(), row.line,
                      v.size());
    const Quat q = w_last ? Quat(v[7], v[4], v[5], v[6]) : Quat(v[4], v[5], v[6], v[7]);
    if (std::fabs(q.norm() - 1.0) > 1.0e-3)
      throw ToolError("{}:{}: the quaternion's length is {:.6f}; give qw qx qy qz of length 1", path.string(),
                      row.line, q.norm());
    stamps.push_back(v[0]);
    out.push_back({v[0], Pose3{q.normalized(), Vec3(v[1], v[2], v[3])} * T_body_cam});
  }
  const double unit = unit_of_stamps(stamps);
  for (StampedPose& at : out) at.stamp_s *= unit;
  return out;
}

/// Up to `most` places in a row of `count`, the first among them.
std::vector<std::size_t> spread(std::size_t count, std::size_t most) {
  std::vector<std::size_t> out;
  const std::size_t stride = std::max<std::size_t>(1, (count + most - 1) / most);
  for (std::size_t i = 0; i < count; i += stride) out.push_back(i);
  return out;
}

struct Size {
  int width = 0;
  int height = 0;
  int count = 0;     ///< of the images looked at
  fs::path example;  ///< the first of that size
};

/// What most of a side's images have, of those that are looked at; of as many, what comes first. `reason`: of
/// the last that cannot be read.
Size usual_size(const std::vector<Frame>& frames, fs::path Frame::*side, std::string& reason) {
  constexpr std::size_t kLooks = 32;
  std::vector<Size> sizes;
  const auto look = [&](const fs::path& path) {
    if (path.empty()) return;
    try {
      const auto [width, height] = image_size(path);
      const auto same = [w = width, h = height](const Size& size) {
        return size.width == w && size.height == h;
      };
      const auto known = std::find_if(sizes.begin(), sizes.end(), same);
      if (known == sizes.end())
        sizes.push_back({width, height, 1, path});
      else
        ++known->count;
    } catch (const ImageError& error) {
      reason = error.what();
    }
  };
  for (const std::size_t i : spread(frames.size(), kLooks)) look(frames[i].*side);
  for (std::size_t i = 0; i < frames.size() && sizes.empty(); ++i) look(frames[i].*side);
  const auto most = std::max_element(sizes.begin(), sizes.end(),
                                     [](const Size& a, const Size& b) { return a.count < b.count; });
  return most == sizes.end() ? Size() : *most;
}

}  // namespace

Dataset Dataset::open(const fs::path& folder, const std::vector<fs::path>& calibration,
                      ImagesAre images_are) {
  Dataset data;
  data.folder_ = folder;
  if (!fs::is_directory(folder))
    throw ToolError("{}: no such folder; give the data set's folder", folder.string());
  StereoFolder images = find_stereo_images(folder);
  data.left_folder_ = images.left;
  data.right_folder_ = images.right;
  data.frames_ = std::move(images.frames);
  data.notes_ = std::move(images.notes);
  data.measure_images();
  data.read_calibration(calibration, images_are);
  data.read_stamps();
  data.read_truth();
  return data;
}

/// The size of most images of each side, and how many bits samples of 16 use.
void Dataset::measure_images() {
  std::string reason = "no image at all";
  const Size left = usual_size(frames_, &Frame::left, reason),
             right = usual_size(frames_, &Frame::right, reason);
  if (left.count == 0 && right.count == 0)
    throw ToolError("{}: no image can be read; the last: {}", folder_.string(), reason);
  if (left.count > 0 && right.count > 0 && (left.width != right.width || left.height != right.height)) {
    throw ToolError(
        "{}: right images are {} x {}, left ones {} x {}; give both the same size, and its calibration",
        right.example.string(), right.width, right.height, left.width, left.height);
  }
  file_width_px_ = left.count > 0 ? left.width : right.width;
  file_height_px_ = left.count > 0 ? left.height : right.height;
  measure_samples();
}

/// Cameras have 8 to 16 bits, and files 8 or 16.
void Dataset::measure_samples() {
  DeepSamples all;
  for (const std::size_t i : spread(frames_.size(), 8)) {
    for (const fs::path& path : {frames_[i].left, frames_[i].right}) {
      try {
        if (path.empty()) continue;
        const DeepSamples samples = deep_samples(path);
        all.largest = std::max(all.largest, samples.largest);
        all.of_bytes = all.of_bytes && samples.of_bytes;
      } catch (const ImageError&) {  // told where it is flown
      }
    }
  }
  if (all.largest == 0 || all.of_bytes) return;
  for (const int bits : {14, 12, 10, 8}) {
    if (all.largest < (1 << bits)) sample_bits_ = bits;
  }
  if (sample_bits_ < 16)
    notes_.push_back(
        fmt::format("images are of 16 bits, of which {} are used (largest sample {}): scaled by these",
                    sample_bits_, all.largest));
}

void Dataset::read_calibration(const std::vector<fs::path>& given, ImagesAre images_are) {
  const std::vector<fs::path> files =
      given.empty() ? find_calibration(folder_, left_folder_, right_folder_) : given;
  if (files.empty()) refuse_no_calibration(folder_);
  const std::string name = left_folder_.filename() == "data" ? left_folder_.parent_path().filename().string()
                                                             : left_folder_.filename().string();
  RigQuestion question;
  question.images = images_are;
  question.raw_alone = images_are == ImagesAre::kRaw;
  question.colour = name == "image_2" || name == "image_02";
  cameras_ = read_rig(files, question);
  const auto of_these = [this](const CameraPair& pair) {
    return (pair.left.width_px == 0 || pair.left.width_px == file_width_px_) &&
           (pair.left.height_px == 0 || pair.left.height_px == file_height_px_);
  };
  if (!of_these(cameras_) && images_are == ImagesAre::kRectified) {
    question.images = ImagesAre::kRaw;
    if (CameraPair raw = read_rig(files, question); of_these(raw)) cameras_ = std::move(raw);
  }
  for (CameraModel* camera : {&cameras_.left, &cameras_.right}) {
    if (camera->width_px == 0) {
      camera->width_px = file_width_px_;
      camera->height_px = file_height_px_;
    }
    if (camera->width_px != file_width_px_ || camera->height_px != file_height_px_) {
      throw ToolError(
          "{}: is of images of {} x {}, these are {} x {}; give the calibration of these, or scale it",
          files[0].string(), camera->width_px, camera->height_px, file_width_px_, file_height_px_);
    }
  }
  if (const std::string fault = fault_of(cameras_); !fault.empty())
    throw ToolError("{}: {}", files[0].string(), fault);
  for (const std::string& note : cameras_.notes) notes_.push_back(files[0].string() + ": " + note);
  if (const std::string doubt = doubt_of(cameras_); !doubt.empty())
    notes_.push_back(files[0].string() + ": " + doubt);
  take_rectified(files[0]);
}

void Dataset::take_rectified(const fs::path& calibration) {
  const std::string why = why_not_rectified(cameras_);
  if (why.empty()) {
    rig_ = rectified_rig(cameras_);
    return;
  }
  const auto made = std::make_shared<Rectification>();
  if (const std::string fault = rectify(cameras_, *made); !fault.empty()) {
    throw ToolError("{}: understood ({}), and not rectified: {}; and these cannot be rectified: {}",
                    calibration.string(), cameras_.format, why, fault);
  }
  rig_ = rectified_rig(made->pair);
  notes_.push_back(fmt::format(
      "{}: not rectified: {}; rectified here to {} x {} px, focal lengths {:.2f}, {:.2f} px, centre {:.2f}, "
      "{:.2f} px",
      calibration.string(), why, rig_.width_px, rig_.height_px, rig_.fx_px, rig_.fy_px, rig_.cx_px,
      rig_.cy_px));
  rectification_ = made;
}

void Dataset::read_stamps() {
  const fs::path by_row = find_times(folder_, left_folder_, "times.txt");
  const fs::path by_number = find_times(folder_, left_folder_, "timestamps.txt");
  const fs::path from = !by_row.empty() ? by_row : by_number;
  if (from.empty()) return;
  std::vector<double> stamps = read_dates(from);
  if (stamps.empty() && !by_row.empty()) {
    for (const NumberRow& row : read_number_rows(by_row, 1, "seconds")) stamps.push_back(row.values[0]);
  }
  if (!stamps.empty()) {
    const double unit = unit_of_stamps(stamps);
    const std::vector<std::size_t> row_of = rows_of_frames(from, stamps.size(), frames_);
    for (std::size_t i = 0; i < frames_.size(); ++i) frames_[i].stamp_s = stamps[row_of[i]] * unit;
  } else {
    std::map<int, double> stamp_of;
    for (const NumberRow& row : read_number_rows(by_number)) {
      if (row.values.size() < 2)
        throw ToolError("{}:{}: expected a frame number and its stamp", by_number.string(), row.line);
      stamp_of[index_of(by_number, row.line, row.values[0])] = row.values[1];
    }
    for (const auto& [number, stamp] : stamp_of) stamps.push_back(stamp);
    const double unit = unit_of_stamps(stamps);
    for (Frame& frame : frames_) {
      const auto found = stamp_of.find(frame.number);
      if (found == stamp_of.end()) {
        throw ToolError("{}: no stamp for frame {}; add its line or remove this file", by_number.string(),
                        frame.number);
      }
      frame.stamp_s = found->second * unit;
    }
  }
  for (std::size_t i = 1; i < frames_.size(); ++i) {
    if (frames_[i].stamp_s <= frames_[i - 1].stamp_s) {
      throw ToolError("{}: the stamp of frame {} is not after that of frame {}; correct the times",
                      from.string(), frames_[i].number, frames_[i - 1].number);
    }
  }
}

void Dataset::read_truth() {
  truth_cam_.resize(frames_.size());
  const fs::path tum = folder_ / "truth_left_camera.tum";
  const fs::path poses = find_kitti_poses(folder_);
  const fs::path euroc = left_folder_.parent_path().parent_path() / "state_groundtruth_estimate0/data.csv";
  if (fs::exists(tum)) {
    const Trajectory truth = read_tum(tum);
    if (is_order_of(w_first(truth), truth)) {
      throw ToolError(
          "{}: the camera would drive sideways or lie on its side, and goes straight if the four numbers are qw qx "
          "qy qz; write them as qx qy qz qw",
          tum.string());
    }
    take_stamped(tum, truth);
  } else if (!poses.empty()) {
    read_kitti_poses(poses);
  } else if (fs::exists(euroc)) {
    const Trajectory truth = read_euroc_truth(euroc, cameras_.T_body_left);
    if (is_order_of(read_euroc_truth(euroc, cameras_.T_body_left, true), truth)) {
      throw ToolError(
          "{}: the camera would drive sideways or lie on its side, and goes straight if the four numbers are qx qy qz "
          "qw; write them as qw qx qy qz",
          euroc.string());
    }
    take_stamped(euroc, truth);
  }

  if (const fs::path rover = folder_ / "truth_rover.txt"; fs::exists(rover)) read_rover_truth(rover);

  const fs::path rocks = folder_ / "truth_rocks.csv";
  if (fs::exists(rocks)) {
    const CsvTable table(rocks);
    const std::size_t id = table.column("id"), x = table.column("x"), y = table.column("y");
    const std::size_t z = table.column("z_ground"), diameter = table.column("diameter"),
                      height = table.column("height");
    for (std::size_t row = 0; row < table.size(); ++row) {
      const auto at = [&](std::size_t column) { return table.number(row, column); };
      truth_rocks_.push_back(
          {index_of(rocks, table.line(row), at(id)), Vec2(at(x), at(y)), at(z), at(diameter), at(height)});
    }
  }
}

void Dataset::read_rover_truth(const fs::path& path) {
  const std::vector<NumberRow> rows =
      read_number_rows(path, 8, "frame arc x y z yaw pitch roll (metres, degrees)");
  const auto read = [&](const AngleReading& reading) {
    std::map<int, Pose3> poses;
    for (const NumberRow& row : rows) {
      const std::vector<double>& v = row.values;
      const Attitude attitude{reading.yaw_0_rad + reading.yaw_unit_rad * v[5], reading.unit_rad * v[6],
                              reading.unit_rad * v[7]};
      poses[index_of(path, row.line, v[0])] = {quat_from_attitude(attitude), Vec3(v[2], v[3], v[4])};
    }
    return poses;
  };
  const auto odd = [&](const std::map<int, Pose3>& poses) {
    return std::max(sideways(poses), turn_of_camera(poses));
  };
  truth_rover_ = read({kRadPerDeg, kRadPerDeg, 0.0});
  const double told = odd(truth_rover_);
  // What degrees are in radians' stead drives anywhere; a heading may be off the course, for rovers slip.
  constexpr double kLeastOfRadians = 0.02, kLeastOfCompass = 0.5, kBetter = 0.25;
  if (told > kLeastOfRadians && odd(read({1.0, 1.0, 0.0})) < kBetter * told) {
    throw ToolError("{}: yaw, pitch and roll fit the drive as radians; write degrees, 57.29578 times these",
                    path.string());
  }
  if (told > kLeastOfCompass && odd(read({kRadPerDeg, -kRadPerDeg, 0.5 * kPi})) < kBetter * told) {
    throw ToolError("{}: yaw fits the drive as a compass' (clockwise from north); write 90 minus these",
                    path.string());
  }
}

/// The most, in radians, by which the camera's attitude on the rover is not that of the first frame.
double Dataset::turn_of_camera(const std::map<int, Pose3>& rover) const {
  std::optional<Quat> first;
  double most = 0.0;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    const auto found = rover.find(frames_[i].number);
    if (found == rover.end() || !truth_cam_[i]) continue;
    const Quat q_rover_cam = found->second.q.conjugate() * truth_cam_[i]->q;
    if (!first) first = q_rover_cam;
    most = std::max(most, quat_log(first->conjugate() * q_rover_cam).norm());
  }
  return most;
}

void Dataset::take_stamped(const fs::path& path, const Trajectory& truth) {
  std::size_t found = 0;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    truth_cam_[i] = pose_at(truth, frames_[i].stamp_s);
    if (truth_cam_[i] && rectification_ != nullptr)
      truth_cam_[i] = *truth_cam_[i] * rectification_->T_left_rect;
    found += truth_cam_[i] ? 1U : 0U;
  }
  if (found == frames_.size()) return;
  if (truth.empty()) {
    notes_.push_back(fmt::format("{}: it holds no pose", path.string()));
    return;
  }
  notes_.push_back(
      fmt::format("{}: its stamps are those of {} of {} frames (frames {:.10g} to {:.10g}, truth {:.10g} to "
                  "{:.10g}); {}",
                  path.string(), found, frames_.size(), frames_.front().stamp_s, frames_.back().stamp_s,
                  truth.front().stamp_s, truth.back().stamp_s,
                  found == 0 ? "no error is computed" : "errors are of these alone"));
}

void Dataset::read_kitti_poses(const fs::path& path) {
  const std::vector<NumberRow> rows = read_number_rows(path, 12, "the 3x4 matrix T_world_cam, row by row");
  const std::vector<std::size_t> row_of = rows_of_frames(path, rows.size(), frames_);
  Mat3 R_map_world;
  R_map_world << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    const NumberRow& row = rows[row_of[i]];
    Mat3 R_world_cam;
    Vec3 p_world_cam_m;
    for (int r = 0; r < 3; ++r) {
      const auto at = static_cast<std::size_t>(4 * r);
      R_world_cam.row(r) << row.values[at], row.values[at + 1], row.values[at + 2];
      p_world_cam_m[r] = row.values[at + 3];
    }
    if (!((R_world_cam.transpose() * R_world_cam - Mat3::Identity()).norm() < 1.0e-3) ||
        R_world_cam.determinant() < 0.0) {
      throw ToolError("{}:{}: the left 3x3 part is not a rotation; give T_world_cam row by row",
                      path.string(), row.line);
    }
    const Pose3 T_map_cam0{Quat(R_map_world * R_world_cam).normalized(), R_map_world * p_world_cam_m};
    truth_cam_[i] = T_map_cam0 * cameras_.T_cam0_left;
    if (rectification_ != nullptr) truth_cam_[i] = *truth_cam_[i] * rectification_->T_left_rect;
  }
}

PairImages Dataset::images(std::size_t index) const {
  PairImages pair;
  const auto load = [&](const fs::path& path, const RemapTable* table, Image& image) {
    if (path.empty()) return;
    try {
      image = load_grey(path, sample_bits_);
      if (image.width != file_width_px_ || image.height != file_height_px_) {
        pair.faults.push_back(fmt::format("{}: is {} x {}, most others {} x {}; not used", path.string(),
                                          image.width, image.height, file_width_px_, file_height_px_));
      } else if (table != nullptr) {
        image = remapped(*table, image);
      }
    } catch (const ImageError& error) {
      pair.faults.emplace_back(error.what());
    }
  };
  const bool raw = rectification_ != nullptr;
  load(frames_[index].left, raw ? &rectification_->left : nullptr, pair.left);
  load(frames_[index].right, raw ? &rectification_->right : nullptr, pair.right);
  return pair;
}

std::optional<Pose3> Dataset::truth_cam(std::size_t index) const { return truth_cam_.at(index); }

std::optional<Pose3> Dataset::truth_rover(std::size_t index) const {
  const auto found = truth_rover_.find(frames_.at(index).number);
  return found == truth_rover_.end() ? std::nullopt : std::optional<Pose3>(found->second);
}

}  // namespace cairn::ground
