#include "dataset/dataset.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/number_table.hpp"
#include "base/tool_error.hpp"
#include "dataset/image.hpp"
#include "dataset/trajectory.hpp"

namespace fs = std::filesystem;

namespace cairn::ground {
namespace {

struct FolderPair {
  const char* left;
  const char* right;
};
constexpr FolderPair kFolderPairs[] = {
    {"left", "right"}, {"image_l", "image_r"}, {"image_0", "image_1"}, {"image_2", "image_3"}};

/// The order of frames: shorter names first, then by text.
struct StemLess {
  bool operator()(const std::string& a, const std::string& b) const {
    return a.size() != b.size() ? a.size() < b.size() : a < b;
  }
};

bool is_image(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return extension == ".jpg" || extension == ".jpeg" || extension == ".png" || extension == ".tif" ||
         extension == ".tiff";
}

using Images = std::map<std::string, fs::path, StemLess>;

Images list_images(const fs::path& folder) {
  Images images;
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    if (!is_image(at->path())) continue;
    const auto [known, added] = images.emplace(at->path().stem().string(), at->path());
    if (!added) {
      throw ToolError("{}: frame '{}' has two images ({} and {}); keep one", folder.string(), known->first,
                      known->second.filename().string(), at->path().filename().string());
    }
  }
  if (failed)
    throw ToolError("{}: cannot be listed ({}); check its permissions", folder.string(), failed.message());
  return images;
}

std::optional<int> whole_number(const std::string& text) {
  const std::optional<int> value = to_number<int>(text);
  return value && *value >= 0 ? value : std::nullopt;
}

/// A 3x4 projection matrix, split: K [I | p], p = K^-1 times its last column = the frame's origin as the
/// camera sees it.
struct Projection {
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;
  Vec3 p_cam_origin_m = Vec3(0.0, 0.0, 0.0);
};

Projection split_projection(const fs::path& path, const NumberRow& row) {
  const std::vector<double>& v = row.values;
  const bool plain = v.size() == 12 && v[0] > 0.0 && v[5] > 0.0 && v[1] == 0.0 && v[4] == 0.0 &&
                     v[8] == 0.0 && v[9] == 0.0 && v[10] == 1.0;
  if (!plain) {
    throw ToolError(
        "{}:{}: not the 3x4 projection matrix of a rectified camera (fx 0 cx tx 0 fy cy ty 0 0 1 tz)",
        path.string(), row.line);
  }
  Projection out{v[0], v[5], v[2], v[6], Vec3(0.0, 0.0, v[11])};
  out.p_cam_origin_m.x() = (v[3] - out.cx * v[11]) / out.fx;
  out.p_cam_origin_m.y() = (v[7] - out.cy * v[11]) / out.fy;
  return out;
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

/// A number that stands for a frame or a rock.
int index_of(const fs::path& path, int line, double value) {
  if (!(value >= 0.0 && value <= 1.0e9) || value != std::floor(value)) {
    throw ToolError("{}:{}: {} is not a whole number from 0 to 1e9; correct this line", path.string(), line,
                    value);
  }
  return static_cast<int>(value);
}

double seconds(double stamp) { return stamp >= 1.0e12 ? stamp * 1.0e-9 : stamp; }

}  // namespace

Dataset Dataset::open(const fs::path& folder) {
  Dataset data;
  data.folder_ = folder;
  if (!fs::is_directory(folder))
    throw ToolError("{}: no such folder; give the data set's folder", folder.string());
  data.find_images();
  data.read_calibration();
  data.read_stamps();
  data.read_truth();
  return data;
}

void Dataset::find_images() {
  fs::path right_folder;
  for (const FolderPair& pair : kFolderPairs) {
    if (!left_folder_.empty() || !fs::is_directory(folder_ / pair.left)) continue;
    left_folder_ = folder_ / pair.left;
    right_folder = folder_ / pair.right;
  }
  if (left_folder_.empty()) {
    throw ToolError("{}: no folder of left images here; put pairs into left/ and right/", folder_.string());
  }
  if (!fs::is_directory(right_folder)) {
    throw ToolError("{}: no such folder; put the right images of {} there", right_folder.string(),
                    left_folder_.string());
  }
  const Images left = list_images(left_folder_);
  const Images right = list_images(right_folder);
  if (left.empty() || right.empty()) {
    throw ToolError("{}: no JPEG, PNG or TIFF image here; put the {} images there",
                    (left.empty() ? left_folder_ : right_folder).string(), left.empty() ? "left" : "right");
  }
  std::map<std::string, Frame, StemLess> paired;
  for (const auto& [stem, path] : left) paired[stem].left = path;
  for (const auto& [stem, path] : right) paired[stem].right = path;
  // Numbers come from the names only where every name is one: mixed, they could repeat.
  const bool numbered = std::all_of(paired.begin(), paired.end(),
                                    [](const auto& entry) { return whole_number(entry.first).has_value(); });
  for (auto& [stem, frame] : paired) {
    frame.number = numbered ? *whole_number(stem) : static_cast<int>(frames_.size());
    frame.stamp_s = frame.number;
    if (!frames_.empty() && frame.number <= frames_.back().number) {
      throw ToolError("{}: two frames have the number {}; give all names the same number of digits",
                      left_folder_.string(), frame.number);
    }
    frames_.push_back(std::move(frame));
  }

  std::string reason = "no image at all";
  for (std::size_t i = 0; i < frames_.size() && rig_.width_px == 0; ++i) {
    for (const fs::path& path : {frames_[i].left, frames_[i].right}) {
      if (path.empty() || rig_.width_px != 0) continue;
      try {
        const Image image = load_grey(path);
        rig_.width_px = image.width;
        rig_.height_px = image.height;
      } catch (const ImageError& error) {
        reason = error.what();
      }
    }
  }
  if (rig_.width_px == 0) throw ToolError("{}: no image can be read; the last: {}", folder_.string(), reason);
}

void Dataset::read_calibration() {
  const fs::path path = folder_ / "calib.txt";
  if (!fs::exists(path)) {
    throw ToolError("{}: no such file; write one line there: fx fy cx cy baseline (pixels, metres)",
                    path.string());
  }
  std::vector<NumberRow> rows = read_number_rows(path);
  const std::vector<double>* const plain =
      rows.size() == 1 && rows[0].tag.empty() && rows[0].values.size() == 5 ? &rows[0].values : nullptr;
  if (plain != nullptr) {
    rig_.fx_px = (*plain)[0];
    rig_.fy_px = (*plain)[1];
    rig_.cx_px = (*plain)[2];
    rig_.cy_px = (*plain)[3];
    rig_.baseline_m = (*plain)[4];
  } else {
    const bool colour =
        left_folder_.filename() == "image_2" &&
        std::any_of(rows.begin(), rows.end(), [](const NumberRow& row) { return row.tag == "P2"; });
    const std::string left_tag = colour ? "P2" : "P0";
    const std::string right_tag = colour ? "P3" : "P1";
    const NumberRow* left = nullptr;
    const NumberRow* right = nullptr;
    for (const NumberRow& row : rows) {
      if (row.tag == left_tag || (row.tag.empty() && left == nullptr)) {
        left = &row;
      } else if (row.tag == right_tag || (row.tag.empty() && right == nullptr)) {
        right = &row;
      }
    }
    if (left == nullptr || right == nullptr) {
      throw ToolError(
          "{}: neither one line `fx fy cx cy baseline` nor two rows of 3x4 projections ({}: and {}:)",
          path.string(), left_tag, right_tag);
    }
    const Projection a = split_projection(path, *left);
    const Projection b = split_projection(path, *right);
    const double off_row = std::fabs(a.p_cam_origin_m.y() - b.p_cam_origin_m.y());
    if (std::fabs(a.fx - b.fx) > 1e-6 * a.fx || std::fabs(a.fy - b.fy) > 1e-6 * a.fy ||
        std::fabs(a.cx - b.cx) > 1e-3 || std::fabs(a.cy - b.cy) > 1e-3 || !(off_row < 0.05)) {
      throw ToolError("{}: the two cameras do not form a rectified pair; rectify the images first",
                      path.string());
    }
    rig_.fx_px = a.fx;
    rig_.fy_px = a.fy;
    rig_.cx_px = a.cx;
    rig_.cy_px = a.cy;
    rig_.baseline_m = a.p_cam_origin_m.x() - b.p_cam_origin_m.x();
    p_cam0_left_m_ = -a.p_cam_origin_m;
  }
  if (!is_valid(rig_)) {
    throw ToolError(
        "{}: focal lengths and baseline must be above 0 (fx {}, fy {}, baseline {}); are left and right "
        "swapped?",
        path.string(), rig_.fx_px, rig_.fy_px, rig_.baseline_m);
  }
}

void Dataset::read_stamps() {
  const fs::path by_row = folder_ / "times.txt";
  const fs::path by_number = folder_ / "timestamps.txt";
  if (fs::exists(by_row)) {
    const std::vector<NumberRow> rows = read_number_rows(by_row, 1, "seconds");
    const std::vector<std::size_t> row_of = rows_of_frames(by_row, rows.size(), frames_);
    for (std::size_t i = 0; i < frames_.size(); ++i) frames_[i].stamp_s = seconds(rows[row_of[i]].values[0]);
  } else if (fs::exists(by_number)) {
    std::map<int, double> stamp_of;
    for (const NumberRow& row : read_number_rows(by_number)) {
      if (row.values.size() < 2) {
        throw ToolError("{}:{}: expected a frame number and its stamp", by_number.string(), row.line);
      }
      stamp_of[index_of(by_number, row.line, row.values[0])] = seconds(row.values[1]);
    }
    for (Frame& frame : frames_) {
      const auto found = stamp_of.find(frame.number);
      if (found == stamp_of.end()) {
        throw ToolError("{}: no stamp for frame {}; add its line or remove this file", by_number.string(),
                        frame.number);
      }
      frame.stamp_s = found->second;
    }
  }
  for (std::size_t i = 1; i < frames_.size(); ++i) {
    if (frames_[i].stamp_s <= frames_[i - 1].stamp_s) {
      throw ToolError("{}: the stamp of frame {} is not after that of frame {}; correct the times",
                      (fs::exists(by_row) ? by_row : by_number).string(), frames_[i].number,
                      frames_[i - 1].number);
    }
  }
}

void Dataset::read_truth() {
  truth_cam_.resize(frames_.size());
  const fs::path tum = folder_ / "truth_left_camera.tum";
  const fs::path poses = folder_ / "poses.txt";
  if (fs::exists(tum)) {
    const Trajectory truth = read_tum(tum);
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      const StampedPose* const at = find_stamp(truth, frames_[i].stamp_s);
      if (at != nullptr) truth_cam_[i] = at->pose;
    }
  } else if (fs::exists(poses)) {
    read_kitti_poses(poses);
  }

  const fs::path rover = folder_ / "truth_rover.txt";
  if (fs::exists(rover)) {
    for (const NumberRow& row :
         read_number_rows(rover, 8, "frame arc x y z yaw pitch roll (metres, degrees)")) {
      const std::vector<double>& v = row.values;
      const Attitude attitude{v[5] * kRadPerDeg, v[6] * kRadPerDeg, v[7] * kRadPerDeg};
      truth_rover_[index_of(rover, row.line, v[0])] = {quat_from_attitude(attitude), Vec3(v[2], v[3], v[4])};
    }
  }

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
    const Mat3 R_map_cam = R_map_world * R_world_cam;
    truth_cam_[i] =
        Pose3{Quat(R_map_cam).normalized(), R_map_world * (p_world_cam_m + R_world_cam * p_cam0_left_m_)};
  }
}

PairImages Dataset::images(std::size_t index) const {
  PairImages pair;
  const auto load = [&pair](const fs::path& path, Image& image) {
    if (path.empty()) return;
    try {
      image = load_grey(path);
    } catch (const ImageError& error) {
      pair.faults.emplace_back(error.what());
    }
  };
  load(frames_[index].left, pair.left);
  load(frames_[index].right, pair.right);
  return pair;
}

std::optional<Pose3> Dataset::truth_cam(std::size_t index) const { return truth_cam_.at(index); }

std::optional<Pose3> Dataset::truth_rover(std::size_t index) const {
  const auto found = truth_rover_.find(frames_.at(index).number);
  return found == truth_rover_.end() ? std::nullopt : std::optional<Pose3>(found->second);
}

}  // namespace cairn::ground
