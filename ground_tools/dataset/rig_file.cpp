#include "dataset/rig_file.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/number_table.hpp"
#include "base/output_file.hpp"
#include "base/tool_error.hpp"

namespace fs = std::filesystem;

namespace cairn::ground {
namespace {

using Numbers = std::vector<double>;

constexpr const char* kKnown =
    "known are `fx fy cx cy baseline`, 3x4 projections (KITTI), KITTI raw, Middlebury, EuRoC, kalibr, ROS, "
    "OpenCV and PDS labels (doc/guide/drives.md)";

// ---- matrices --------------------------------------------------------------------------------------------

/// A 3x4 projection matrix, split: K [I | p], p = K^-1 times its last column = the frame's origin as the
/// camera sees it.
struct Projection {
  CameraModel camera;
  Vec3 p_cam_origin_m = Vec3(0.0, 0.0, 0.0);
};

Projection split_projection(const std::string& where, const Numbers& v) {
  if (v.size() == 12 && std::all_of(v.begin(), v.end(), [](double x) { return x == 0.0; }))
    throw ToolError(
        "{}: the projection is zero throughout: this pair was never calibrated as one; calibrate it", where);
  const bool plain =
      v.size() == 12 && v[0] > 0.0 && v[5] > 0.0 && v[4] == 0.0 && v[8] == 0.0 && v[9] == 0.0 && v[10] == 1.0;
  if (!plain || v[1] != 0.0) {
    throw ToolError(
        "{}: not the 3x4 projection matrix of a rectified camera (fx 0 cx tx 0 fy cy ty 0 0 1 tz){}", where,
        plain ? "; rectified images have no skew" : "");
  }
  Projection out;
  out.camera.fx_px = v[0];
  out.camera.fy_px = v[5];
  out.camera.cx_px = v[2];
  out.camera.cy_px = v[6];
  out.p_cam_origin_m = Vec3((v[3] - v[2] * v[11]) / v[0], (v[7] - v[6] * v[11]) / v[5], v[11]);
  return out;
}

CameraPair pair_of_projections(const std::string& left_where, const Numbers& left,
                               const std::string& right_where, const Numbers& right) {
  const Projection a = split_projection(left_where, left);
  const Projection b = split_projection(right_where, right);
  CameraPair pair;
  pair.left = a.camera;
  pair.right = b.camera;
  pair.T_right_left.t = b.p_cam_origin_m - a.p_cam_origin_m;
  pair.T_cam0_left.t = -a.p_cam_origin_m;
  pair.rectified_alone = true;
  return pair;
}

/// The raw cameras of a rectified pair, by the turns of rectification, p_rect = R p_raw.
void take_raw(const CameraModel& left, const Quat& q_rect_left, const CameraModel& right,
              const Quat& q_rect_right, CameraPair& pair) {
  const Vec3 none(0.0, 0.0, 0.0);
  pair.left = left;
  pair.right = right;
  pair.T_right_left = Pose3{q_rect_right, none}.inverse() * pair.T_right_left * Pose3{q_rect_left, none};
  pair.rectified_alone = false;
}

void take_camera_matrix(const std::string& where, const Numbers& k, CameraModel& camera) {
  if (k.size() != 9 || k[3] != 0.0 || k[6] != 0.0 || k[7] != 0.0 || k[8] != 1.0)
    throw ToolError("{}: not a camera matrix (fx s cx 0 fy cy 0 0 1); give nine numbers, row by row", where);
  camera.fx_px = k[0];
  camera.skew_px = k[1];
  camera.cx_px = k[2];
  camera.fy_px = k[4];
  camera.cy_px = k[5];
}

Mat3 rotation_of(const std::string& where, const Numbers& r) {
  Mat3 R;
  if (r.size() == 9) R << r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8];
  if (r.size() != 9 || !((R.transpose() * R - Mat3::Identity()).norm() < 1.0e-3) || R.determinant() < 0.0)
    throw ToolError("{}: not a rotation; give its nine numbers, row by row", where);
  return R;
}

Pose3 pose_of(const std::string& where, const Numbers& m) {
  if (m.size() != 12 && m.size() != 16)
    throw ToolError("{}: {} numbers; a 4x4 transformation has 16, row by row", where, m.size());
  const Mat3 R = rotation_of(where, {m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]});
  return {Quat(R).normalized(), Vec3(m[3], m[7], m[11])};
}

/// Coefficients in OpenCV's order; `model` as the file calls it, empty where it does not say.
void take_distortion(const std::string& where, const std::string& model, const Numbers& d,
                     CameraModel& camera) {
  std::string name;
  for (const char c : model) {
    if (c != '-' && c != '_' && c != ' ') name += static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  }
  const bool fisheye =
      name == "equidistant" || name == "fisheye" || name == "kannalabrandt4" || name == "kannalabrandt8";
  if (!fisheye && std::all_of(d.begin(), d.end(), [](double k) { return k == 0.0; })) return;
  const bool polynomial = name.empty() || name == "radtan" || name == "radialtangential" ||
                          name == "plumbbob" || name == "rationalpolynomial" || name == "opencv" ||
                          name == "brown" || name == "pinhole";
  if (!fisheye && !polynomial)
    throw ToolError(
        "{}: distortion model '{}' is not known; known are none, radial-tangential (radtan, plumb_bob), rational "
        "and equidistant",
        where, model);
  const std::size_t most = fisheye ? 4 : 8;
  const bool beyond = d.size() > most && std::any_of(d.begin() + static_cast<std::ptrdiff_t>(most), d.end(),
                                                     [](double k) { return k != 0.0; });
  if (beyond || d.size() < 4)
    throw ToolError("{}: {} distortion coefficients; {}", where, d.size(),
                    fisheye ? "the equidistant model has four"
                            : "known are 4, 5 and 8 (thin prisms and tilted sensors are not)");
  std::copy_n(d.begin(), std::min(d.size(), most), camera.k.begin());
  const bool rational = camera.k[5] != 0.0 || camera.k[6] != 0.0 || camera.k[7] != 0.0;
  camera.lens = fisheye ? Lens::kEquidistant : rational ? Lens::kRational : Lens::kRadialTangential;
}

void note_both(CameraPair& pair, const RigQuestion& question) {
  if (pair.left.lens == Lens::kNone && pair.right.lens == Lens::kNone && question.images == ImagesAre::kRaw)
    return;
  pair.notes.emplace_back(question.images == ImagesAre::kRectified
                              ? "the calibration tells of raw images, too; taken are the rectified ones"
                              : "the calibration tells of rectified images, too; taken are the raw ones");
}

// ---- text of rows ----------------------------------------------------------------------------------------

struct TextLine {
  int number = 0;
  std::string text;
};

std::vector<TextLine> lines_of(const fs::path& path) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  refuse_wide_text(path, bytes);
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);
  std::vector<TextLine> lines;
  int number = 0;
  for (std::string_view line : split(text, '\n')) {
    ++number;
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos || line[first] == '#') continue;
    line = line.substr(first, line.find_last_not_of(" \t\r") - first + 1);
    lines.push_back({number, std::string(line)});
  }
  return lines;
}

/// Numbers of a text, whatever stands between them.
std::optional<Numbers> numbers_in(std::string_view text) {
  Numbers out;
  constexpr std::string_view kBetween = " \t\r,;[]()";
  for (std::size_t at = text.find_first_not_of(kBetween); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(kBetween, at), text.size());
    const std::optional<double> value = to_finite(text.substr(at, end - at));
    if (!value) return std::nullopt;
    out.push_back(*value);
    at = text.find_first_not_of(kBetween, end);
  }
  return out;
}

/// `tag: numbers` or `tag=numbers`; lines of other things are left out.
struct TaggedRows {
  fs::path path;
  std::map<std::string, std::pair<int, Numbers>> rows;

  bool has(const std::string& tag) const { return rows.count(tag) != 0; }
  const std::pair<int, Numbers>& row(const std::string& tag) const {
    const auto found = rows.find(tag);
    if (found == rows.end()) throw ToolError("{}: has no row `{}`; add it", path.string(), tag);
    return found->second;
  }
  std::string where(const std::string& tag) const {
    return fmt::format("{}:{}", path.string(), row(tag).first);
  }
  const Numbers& at(const std::string& tag) const { return row(tag).second; }
  double number(const std::string& tag) const {
    const Numbers& v = at(tag);
    if (v.size() != 1) throw ToolError("{}: `{}` is one number", where(tag), tag);
    return v[0];
  }
};

TaggedRows tagged(const fs::path& path, const std::vector<TextLine>& lines, char mark) {
  TaggedRows out{path, {}};
  for (const TextLine& line : lines) {
    const std::size_t at = line.text.find(mark);
    if (at == std::string::npos) continue;
    std::string tag = line.text.substr(0, at);
    tag.erase(tag.find_last_not_of(" \t") + 1);
    if (auto values = numbers_in(std::string_view(line.text).substr(at + 1)); values && !values->empty())
      out.rows[tag] = {line.number, *values};
  }
  return out;
}

/// Width and height; what can be neither is not known.
void take_size(const Numbers& size, CameraModel& camera) {
  constexpr double kMostPx = 1e6;
  if (size.size() != 2 || !(size[0] >= 1.0 && size[0] <= kMostPx && size[1] >= 1.0 && size[1] <= kMostPx))
    return;
  camera.width_px = static_cast<int>(size[0]);
  camera.height_px = static_cast<int>(size[1]);
}

CameraPair read_kitti_raw(const TaggedRows& rows, const RigQuestion& question) {
  const std::string a = question.colour ? "02" : "00", b = question.colour ? "03" : "01";
  const bool has_raw = rows.has("K_" + a) && rows.has("D_" + a) && rows.has("T_" + b);
  const auto size = [&](const std::string& tag, CameraModel& camera) {
    if (rows.has(tag)) take_size(rows.at(tag), camera);
  };
  CameraPair pair;
  if (question.images == ImagesAre::kRectified || !has_raw) {
    pair = pair_of_projections(rows.where("P_rect_" + a), rows.at("P_rect_" + a), rows.path.string(),
                               rows.at("P_rect_" + b));
    size("S_rect_" + a, pair.left);
    size("S_rect_" + b, pair.right);
  } else {
    const auto pose = [&](const std::string& n) {
      const Numbers& t = rows.at("T_" + n);
      if (t.size() != 3) throw ToolError("{}: a translation has three numbers", rows.where("T_" + n));
      return Pose3{Quat(rotation_of(rows.where("R_" + n), rows.at("R_" + n))).normalized(),
                   Vec3(t[0], t[1], t[2])};
    };
    for (const auto& [n, camera] : {std::pair(a, &pair.left), {b, &pair.right}}) {
      take_camera_matrix(rows.where("K_" + n), rows.at("K_" + n), *camera);
      take_distortion(rows.where("D_" + n), "", rows.at("D_" + n), *camera);
      size("S_" + n, *camera);
    }
    pair.T_right_left = pose(b) * pose(a).inverse();
    pair.T_cam0_left = pose(a).inverse();
  }
  pair.format = "KITTI raw (calib_cam_to_cam)";
  if (has_raw) note_both(pair, question);
  return pair;
}

CameraPair read_kitti_rows(const TaggedRows& rows, const RigQuestion& question) {
  const bool colour = question.colour && rows.has("P2");
  const std::string a = colour ? "P2" : "P0", b = colour ? "P3" : "P1";
  for (const std::string& tag : {a, b}) {
    if (!rows.has(tag))
      throw ToolError(
          "{}: neither one line `fx fy cx cy baseline` nor two rows of 3x4 projections ({}: and {}:)",
          rows.path.string(), a, b);
  }
  CameraPair pair = pair_of_projections(rows.where(a), rows.at(a), rows.where(b), rows.at(b));
  pair.format = fmt::format("KITTI rows {}, {}", a, b);
  return pair;
}

CameraPair read_plain_rows(const fs::path& path) {
  const std::vector<NumberRow> rows = read_number_rows(path);
  CameraPair pair;
  if (rows.size() == 1 && rows[0].values.size() == 5) {
    const Numbers& v = rows[0].values;
    pair.left.fx_px = v[0];
    pair.left.fy_px = v[1];
    pair.left.cx_px = v[2];
    pair.left.cy_px = v[3];
    pair.right = pair.left;
    pair.T_right_left.t = Vec3(-v[4], 0.0, 0.0);
    pair.format = "fx fy cx cy baseline";
    return pair;
  }
  if (rows.size() == 2 && rows[0].values.size() == 12) {
    const auto where = [&](const NumberRow& row) { return fmt::format("{}:{}", path.string(), row.line); };
    pair = pair_of_projections(where(rows[0]), rows[0].values, where(rows[1]), rows[1].values);
    pair.format = "two 3x4 projections";
    return pair;
  }
  const bool decimal_comma = rows.size() == 1 && rows[0].values.size() == 10;
  throw ToolError(
      "{}: neither one line `fx fy cx cy baseline` nor two rows of 3x4 projections (P0: and P1:){}",
      path.string(), decimal_comma ? "; the decimal sign is the point" : "");
}

CameraPair read_middlebury(const TaggedRows& rows) {
  CameraPair pair;
  for (const auto& [tag, camera] : {std::pair("cam0", &pair.left), {"cam1", &pair.right}}) {
    take_camera_matrix(rows.path.string() + ": " + tag, rows.at(tag), *camera);
    if (!rows.has("width") || !rows.has("height")) continue;
    take_size({rows.number("width"), rows.number("height")}, *camera);
  }
  const double shift_px = pair.right.cx_px - pair.left.cx_px;
  constexpr double kMostShift_px = 0.5;
  if (rows.has("doffs") && !(std::fabs(rows.number("doffs") - shift_px) < kMostShift_px))
    throw ToolError(
        "{}: doffs is {:g}, and the centres' columns differ by {:g}; correct the one or the other",
        rows.where("doffs"), rows.number("doffs"), shift_px);
  constexpr double kMetre_mm = 1.0e-3;
  pair.T_right_left.t = Vec3(-rows.number("baseline") * kMetre_mm, 0.0, 0.0);
  pair.format = "Middlebury";
  pair.notes.emplace_back("the baseline is taken as millimetres, as this format has it");
  return pair;
}

// ---- YAML ------------------------------------------------------------------------------------------------

/// One camera's or one pair's keys, of one file or several.
class Keys {
 public:
  void add(const fs::path& path) {
    const std::vector<std::uint8_t> bytes = read_file(path);
    refuse_wide_text(path, bytes);
    add(path, std::string(bytes.begin(), bytes.end()));
  }
  void add(const fs::path& path, std::string text) {
    path_ = path_.empty() ? path.string() : path_;
    // OpenCV's first line, %YAML:1.0, is no YAML.
    if (const std::size_t at = text.find("%YAML"); at != std::string::npos && at <= 3)
      text.erase(0, text.find('\n'));
    try {
      const YAML::Node node = YAML::Load(text);
      if (!node.IsMap()) throw ToolError("{}: not a calibration; {}", path.string(), kKnown);
      take(node);
    } catch (const YAML::Exception& error) {
      throw ToolError("{}:{}: not YAML ({}); {}", path.string(), error.mark.line + 1, error.msg, kKnown);
    }
  }
  Keys() = default;
  explicit Keys(const fs::path& path) { add(path); }
  Keys(const Keys& whole, const char* part) : path_(whole.path_ + ": " + part) {
    take(whole.values_.at(part));
  }

  const std::string& path() const { return path_; }
  /// The first of these names that is there.
  std::optional<std::string> find(std::initializer_list<const char*> names) const {
    for (const char* name : names) {
      if (values_.count(name) == 0) continue;
      asked_.insert(name);
      return name;
    }
    return std::nullopt;
  }
  bool has(std::initializer_list<const char*> names) const { return find(names).has_value(); }
  bool is_map(const char* name) const { return values_.count(name) != 0 && values_.at(name).IsMap(); }
  std::string where(const std::string& name) const { return path_ + ": " + name; }

  /// A scalar, a list, a list of lists, or a map with `data`; empty where no name is there.
  Numbers numbers(std::initializer_list<const char*> names) const {
    const std::optional<std::string> name = find(names);
    Numbers out;
    if (name) gather(*name, values_.at(*name), out, 0);
    return out;
  }
  /// The same, or refused.
  Numbers asked(std::initializer_list<const char*> names, std::size_t least = 1) const {
    Numbers out = numbers(names);
    if (out.size() < least) throw ToolError("{}: has no `{}`; add it", path_, *names.begin());
    return out;
  }
  std::string text(std::initializer_list<const char*> names) const {
    const std::optional<std::string> name = find(names);
    return name && values_.at(*name).IsScalar() ? values_.at(*name).Scalar() : "";
  }
  /// Nobody has asked for a key that looks like a lens: refused.
  void refuse_unread_lens() const {
    for (const auto& [name, value] : values_) {
      if (asked_.count(name) == 0 && names_lens(name) && !is_zero(value))
        throw ToolError(
            "{}: looks like a lens' coefficients, and is not understood; name it as one of the known formats does "
            "(distortion_coeffs with distortion_model, D1 and D2), or remove it where images have no lens",
            where(name));
    }
  }

 private:
  void take(const YAML::Node& node) {
    std::set<std::string> taken;
    for (const auto& entry : node) {
      if (!entry.first.IsScalar())
        throw ToolError("{}: has a key that is not a word; correct it, {}", path_, kKnown);
      const std::string name = entry.first.Scalar();
      if (!taken.insert(name).second) throw ToolError("{}: stands there twice; keep one", where(name));
      values_[name] = entry.second;
    }
  }
  static bool names_lens(std::string name) {
    for (char& c : name) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
    for (const char* part : {"distor", "distco", "dist_co", "radial", "tangential"}) {
      if (name.find(part) != std::string::npos) return true;
    }
    const std::size_t at = name.find_last_of("._") + 1;
    return name.size() == at + 2 && std::string_view("kpd").find(name[at]) != std::string_view::npos &&
           name[at + 1] >= '1' && name[at + 1] <= '9';
  }
  static bool is_zero(const YAML::Node& node) {
    if (node.IsMap()) return !node["data"] || is_zero(node["data"]);
    if (node.IsSequence())
      return std::all_of(node.begin(), node.end(), [](const auto& part) { return is_zero(part); });
    return to_finite(node.IsScalar() ? node.Scalar() : "").value_or(0.0) == 0.0;
  }
  void gather(const std::string& name, const YAML::Node& node, Numbers& out, int depth) const {
    constexpr int kMostDepth = 3;
    if (node.IsMap() && node["data"]) return gather(name, node["data"], out, depth + 1);
    if (node.IsSequence() && depth < kMostDepth) {
      for (const YAML::Node& part : node) gather(name, part, out, depth + 1);
      return;
    }
    const std::optional<double> value = node.IsScalar() ? to_finite(node.Scalar()) : std::nullopt;
    if (!value) throw ToolError("{}: not a list of finite numbers; correct it", where(name));
    out.push_back(*value);
  }

  std::string path_;
  std::map<std::string, YAML::Node> values_;
  mutable std::set<std::string> asked_;
};

/// Model and coefficients by these names, where there are any. An empty list is no lens.
void take_lens(const Keys& keys, std::initializer_list<const char*> models,
               std::initializer_list<const char*> coefficients, CameraModel& camera) {
  const std::string model = keys.text(models);
  const std::optional<std::string> name = keys.find(coefficients);
  if (!name && !model.empty() && model != "none")
    throw ToolError("{}: distortion model '{}' without coefficients; add `{}`, or say none", keys.path(),
                    model, *coefficients.begin());
  const Numbers d = keys.numbers(coefficients);
  if (!d.empty()) take_distortion(keys.where(*name), model, d, camera);
}

/// kalibr's and EuRoC's way of one camera.
void take_asl_camera(const Keys& keys, CameraModel& camera) {
  const std::string kind = keys.text({"camera_model"});
  if (!kind.empty() && kind != "pinhole")
    throw ToolError("{}: camera model '{}' is not known; calibrate with pinhole", keys.path(), kind);
  const Numbers k = keys.asked({"intrinsics"}, 4);
  if (k.size() != 4) throw ToolError("{}: give four numbers, fu fv cu cv", keys.where("intrinsics"));
  camera.fx_px = k[0];
  camera.fy_px = k[1];
  camera.cx_px = k[2];
  camera.cy_px = k[3];
  take_size(keys.numbers({"resolution"}), camera);
  take_lens(keys, {"distortion_model"}, {"distortion_coeffs", "distortion_coefficients"}, camera);
  keys.refuse_unread_lens();
}

CameraPair read_euroc(const Keys& left, const Keys& right) {
  CameraPair pair;
  take_asl_camera(left, pair.left);
  take_asl_camera(right, pair.right);
  pair.T_body_left = pose_of(left.where("T_BS"), left.asked({"T_BS"}, 12));
  pair.T_right_left = pose_of(right.where("T_BS"), right.asked({"T_BS"}, 12)).inverse() * pair.T_body_left;
  pair.format = "EuRoC (ASL) sensor.yaml";
  return pair;
}

CameraPair read_kalibr(const Keys& chain) {
  if (!chain.is_map("cam0") || !chain.is_map("cam1"))
    throw ToolError("{}: a camchain of one camera; calibrate the pair (cam0 and cam1)", chain.path());
  const Keys left(chain, "cam0"), right(chain, "cam1");
  CameraPair pair;
  take_asl_camera(left, pair.left);
  take_asl_camera(right, pair.right);
  const auto pose = [](const Keys& keys, const char* name) {
    return pose_of(keys.where(name), keys.numbers({name}));
  };
  // OpenVINS has T_imu_cam of each, and no chain.
  if (left.has({"T_imu_cam"})) {
    pair.T_body_left = pose(left, "T_imu_cam");
  } else if (left.has({"T_cam_imu"})) {
    pair.T_body_left = pose(left, "T_cam_imu").inverse();
  }
  if (right.has({"T_imu_cam"}) && left.has({"T_imu_cam"}) && !right.has({"T_cn_cnm1"})) {
    pair.T_right_left = pose(right, "T_imu_cam").inverse() * pair.T_body_left;
  } else if (right.has({"T_cam_imu"}) && left.has({"T_cam_imu"}) && !right.has({"T_cn_cnm1"})) {
    pair.T_right_left = pose(right, "T_cam_imu") * pair.T_body_left;
  } else {
    pair.T_right_left = pose_of(right.where("T_cn_cnm1"), right.asked({"T_cn_cnm1"}, 12));
  }
  pair.format = "kalibr camchain";
  return pair;
}

/// K and P of a camera_info are the whole sensor's: images that are binned or cut out are not theirs.
void refuse_part_of_sensor(const Keys& keys) {
  const auto beyond = [](const Keys& of, const char* name, double most) {
    const Numbers v = of.numbers({name});
    return !v.empty() && v[0] > most;
  };
  bool part = beyond(keys, "binning_x", 1.0) || beyond(keys, "binning_y", 1.0);
  if (keys.is_map("roi")) {
    const Keys roi(keys, "roi");
    part = part || beyond(roi, "x_offset", 0.0) || beyond(roi, "y_offset", 0.0);
  }
  if (part)
    throw ToolError(
        "{}: images are binned, or a region of interest is cut out; scale and move K and P to the images as they "
        "are, and remove binning_x, binning_y and roi",
        keys.path());
}

CameraPair read_ros(const Keys& left, const Keys& right, const RigQuestion& question) {
  CameraPair pair;
  CameraModel raw[2];
  Quat q_rect_raw[2] = {Quat(1.0, 0.0, 0.0, 0.0), Quat(1.0, 0.0, 0.0, 0.0)};
  bool all_raw = true;
  bool lens = false;
  for (int side = 0; side < 2; ++side) {
    const Keys& keys = side == 0 ? left : right;
    CameraModel& camera = raw[side];
    const Numbers k = keys.numbers({"camera_matrix", "K", "k"});
    const Numbers r = keys.numbers({"rectification_matrix", "R", "r"});
    all_raw = all_raw && !k.empty();
    if (!k.empty()) take_camera_matrix(keys.path(), k, camera);
    take_lens(keys, {"distortion_model"}, {"distortion_coefficients", "D", "d"}, camera);
    if (!r.empty()) q_rect_raw[side] = Quat(rotation_of(keys.path(), r)).normalized();
    lens = lens || camera.lens != Lens::kNone || quat_log(q_rect_raw[side]).norm() > 1.0e-6;
    refuse_part_of_sensor(keys);
    keys.refuse_unread_lens();
  }
  const auto projection = [](const Keys& keys) { return keys.asked({"projection_matrix", "P", "p"}, 12); };
  pair = pair_of_projections(left.path(), projection(left), right.path(), projection(right));
  if (question.images == ImagesAre::kRaw && all_raw)
    take_raw(raw[0], q_rect_raw[0], raw[1], q_rect_raw[1], pair);
  for (const auto& [keys, camera] : {std::pair(&left, &pair.left), {&right, &pair.right}}) {
    const Numbers width = keys->numbers({"image_width", "width"}),
                  height = keys->numbers({"image_height", "height"});
    if (width.size() == 1 && height.size() == 1) take_size({width[0], height[0]}, *camera);
  }
  pair.format = "ROS camera_info";
  if (all_raw && lens) note_both(pair, question);
  return pair;
}

CameraPair read_opencv(const Keys& keys, const RigQuestion& question) {
  const Numbers P1 = keys.numbers({"P1", "LEFT.P", "left_projection_matrix", "projection_matrix_left"});
  const Numbers P2 = keys.numbers({"P2", "RIGHT.P", "right_projection_matrix", "projection_matrix_right"});
  const Numbers K1 = keys.numbers(
      {"M1", "K1", "cameraMatrix1", "camera_matrix_1", "left_camera_matrix", "K_left", "LEFT.K"});
  const Numbers K2 = keys.numbers(
      {"M2", "K2", "cameraMatrix2", "camera_matrix_2", "right_camera_matrix", "K_right", "RIGHT.K"});
  const Numbers R1 = keys.numbers({"R1", "LEFT.R"}), R2 = keys.numbers({"R2", "RIGHT.R"});
  const Numbers R = keys.numbers({"R", "rotation_matrix"}), T = keys.numbers({"T", "translation_vector"});
  const bool by_pose = (R.size() == 9 || R.size() == 3) && T.size() == 3;
  const bool rectified = !P1.empty() && !P2.empty();
  const bool raw = !K1.empty() && !K2.empty() && (by_pose || (rectified && !R1.empty() && !R2.empty()));
  if (!raw && !rectified)
    throw ToolError(
        "{}: neither P1 and P2 of stereoRectify, nor M1, D1, M2, D2, R and T of stereoCalibrate; {}",
        keys.path(), "write them into this file, or give the second file, too");
  CameraModel left, right;
  take_lens(keys, {"distortion_model"},
            {"D1", "distCoeffs1", "dist_coeffs_1", "left_distortion_coefficients", "D_left", "LEFT.D"}, left);
  take_lens(keys, {"distortion_model"},
            {"D2", "distCoeffs2", "dist_coeffs_2", "right_distortion_coefficients", "D_right", "RIGHT.D"},
            right);
  keys.refuse_unread_lens();
  const bool lens = left.lens != Lens::kNone || right.lens != Lens::kNone;
  CameraPair pair;
  if (rectified) pair = pair_of_projections(keys.where("P1"), P1, keys.where("P2"), P2);
  if (raw && (question.images == ImagesAre::kRaw || !rectified)) {
    take_camera_matrix(keys.where("M1"), K1, left);
    take_camera_matrix(keys.where("M2"), K2, right);
    const auto turn = [&](const char* name, const Numbers& r) {
      if (r.size() != 3) return Quat(rotation_of(keys.where(name), r)).normalized();
      const Vec3 turn_rad(r[0], r[1], r[2]);  // Rodrigues' vector
      if (!(turn_rad.norm() <= kPi))
        throw ToolError("{}: a turn of {:g} radians; is it degrees? write radians", keys.where(name),
                        turn_rad.norm());
      return quat_exp(turn_rad);
    };
    const Quat none(1.0, 0.0, 0.0, 0.0);
    take_raw(left, by_pose ? none : turn("R1", R1), right, by_pose ? none : turn("R2", R2), pair);
    if (by_pose) pair.T_right_left = {turn("R", R), Vec3(T[0], T[1], T[2])};
  }
  if (lens && !raw)
    pair.notes.emplace_back(
        "the lenses are told, and not how the raw cameras stand (R and T, or R1 and R2): the images are taken as "
        "rectified");
  Numbers size = keys.numbers({"imageSize", "image_size", "size"});
  if (size.empty() && keys.has({"image_width", "width", "LEFT.width"}))
    size = {keys.numbers({"image_width", "width", "LEFT.width"})[0],
            keys.asked({"image_height", "height", "LEFT.height"})[0]};
  take_size(size, pair.left);
  take_size(size, pair.right);
  pair.format = "OpenCV";
  if (raw && rectified && (by_pose || lens)) note_both(pair, question);
  return pair;
}

/// The camera whose keys begin with one of these.
CameraModel keyed_camera(const Keys& keys, std::initializer_list<const char*> prefixes,
                         const std::string& type) {
  const auto find = [&](const char* name) -> std::optional<double> {
    for (const std::string prefix : prefixes) {
      if (const std::string key = prefix + name; keys.has({key.c_str()})) return keys.asked({key.c_str()})[0];
    }
    return std::nullopt;
  };
  const auto asked = [&](const char* name) {
    const std::optional<double> value = find(name);
    if (!value) throw ToolError("{}: has no `{}{}`; add it", keys.path(), *prefixes.begin(), name);
    return *value;
  };
  CameraModel camera;
  camera.fx_px = asked("fx");
  camera.fy_px = asked("fy");
  camera.cx_px = asked("cx");
  camera.cy_px = asked("cy");
  Numbers d;
  if (type == "KannalaBrandt8") {
    for (const char* name : {"k1", "k2", "k3", "k4"}) d.push_back(asked(name));
  } else if (type != "Rectified") {
    for (const char* name : {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"})
      d.push_back(find(name).value_or(0.0));
  }
  if (!d.empty()) take_distortion(keys.path(), type, d, camera);
  return camera;
}

CameraPair read_key_by_key(const Keys& keys) {
  const auto one = [&](std::initializer_list<const char*> names) { return keys.asked(names)[0]; };
  const std::string type = keys.text({"Camera.type"});
  CameraPair pair;
  pair.left = keyed_camera(keys, {"", "Camera.", "Camera1."}, type);
  const bool two = keys.has({"Camera2.fx"});
  pair.right = two ? keyed_camera(keys, {"Camera2."}, type) : pair.left;
  if (keys.has({"Camera.width", "width", "image_width"})) {
    const Numbers size = {one({"Camera.width", "width", "image_width"}),
                          one({"Camera.height", "height", "image_height"})};
    take_size(size, pair.left);
    take_size(size, pair.right);
  }
  const std::initializer_list<const char*> poses = {"Stereo.T_c1_c2", "T_c1_c2", "Tlr"};
  if (const std::optional<std::string> pose = keys.find(poses)) {
    pair.T_right_left = pose_of(keys.where(*pose), keys.numbers(poses)).inverse();
    pair.format = "fx, fy, cx, cy, pose by key (ORB-SLAM3)";
  } else if (two) {
    throw ToolError(
        "{}: tells of two cameras, and not how they stand; add `Stereo.T_c1_c2`, the right camera's 4x4 pose "
        "in the left one",
        keys.path());
  } else {
    const bool bf = keys.has({"bf", "Camera.bf"});
    const double b = bf ? one({"bf", "Camera.bf"}) / pair.left.fx_px : one({"baseline", "Stereo.b", "b"});
    pair.T_right_left.t = Vec3(-b, 0.0, 0.0);
    pair.format = bf ? "fx, fy, cx, cy, bf by key" : "fx, fy, cx, cy, baseline by key";
  }
  keys.refuse_unread_lens();
  return pair;
}

/// `key = value`, a line each, as YAML.
std::string as_yaml(const fs::path& path, const std::vector<TextLine>& lines) {
  std::string text;
  for (const TextLine& line : lines) {
    const std::size_t at = line.text.find('=');
    if (at == std::string::npos)
      throw ToolError("{}:{}: not `key = value` as the lines before; correct it, {}", path.string(),
                      line.number, kKnown);
    text += line.text.substr(0, at) + ": " + line.text.substr(at + 1) + "\n";
  }
  return text;
}

CameraPair read_yaml(const std::vector<fs::path>& files, const RigQuestion& question) {
  const Keys first(files[0]);
  if (first.has({"cam0", "cam1"})) return read_kalibr(first);
  const bool asl = first.has({"T_BS"}) || (first.has({"intrinsics"}) && !first.has({"P1", "M1", "K1"}));
  const bool ros = first.has({"projection_matrix", "P", "p"});
  if (asl || ros) {
    if (files.size() != 2)
      throw ToolError("{}: tells of one camera; give two files, left then right", files[0].string());
    const Keys second(files[1]);
    return asl ? read_euroc(first, second) : read_ros(first, second, question);
  }
  Keys all;
  for (const fs::path& file : files) all.add(file);
  if (all.has({"fx", "Camera.fx", "Camera1.fx"}) && !all.has({"LEFT.P", "P1"})) return read_key_by_key(all);
  return read_opencv(all, question);
}

// ---- PDS labels ------------------------------------------------------------------------------------------

struct LabelCamera {
  Cahv model{Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0)};
  Lens lens = Lens::kNone;
  int width_px = 0;
  int height_px = 0;
  std::string frame;  ///< of reference, with its index
};

/// Without `/* comments */` and `<units>`, but for what is quoted.
std::string bare(std::string_view line) {
  std::string out;
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"') quoted = !quoted;
    const bool comment = line.substr(i, 2) == "/*";
    if (!quoted && (comment || line[i] == '<')) {
      const std::string_view end = comment ? "*/" : ">";
      const std::size_t at = line.find(end, i);
      i = at == std::string_view::npos ? line.size() : at + end.size() - 1;
    } else {
      out += line[i];
    }
  }
  return out;
}

/// Does a value go on in the next line? Brackets of what is quoted do not count.
bool is_open(std::string_view value) {
  int depth = 0;
  bool quoted = false;
  for (const char c : value) {
    if (c == '"') quoted = !quoted;
    if (!quoted) depth += c == '(' ? 1 : c == ')' ? -1 : 0;
  }
  return quoted || depth > 0;
}

/// `KEY = VALUE` of the label, groups flat with their name before; lists and texts may go on over lines.
std::multimap<std::string, std::string> label_values(const fs::path& path) {
  std::vector<std::uint8_t> bytes = read_file(path);
  constexpr std::size_t kLongestLabel = 1U << 20U;
  bytes.resize(std::min(bytes.size(), kLongestLabel));
  std::multimap<std::string, std::string> out;
  std::string group, key, value;
  bool open = false;
  const auto trimmed = [](std::string_view text) {
    const std::size_t first = text.find_first_not_of(" \t\r");
    return first == std::string_view::npos ? std::string_view()
                                           : text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
  };
  for (const std::string_view raw :
       split({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, '\n')) {
    const std::string whole = bare(raw);
    const std::string_view line = trimmed(whole);
    if (line == "END") break;
    if (open) {
      value += line;
    } else {
      const std::size_t at = line.find('=');
      if (at == std::string_view::npos) continue;
      key = trimmed(line.substr(0, at));
      value = trimmed(line.substr(at + 1));
      if (key == "GROUP" || key == "OBJECT") group = value;
      if (key == "END_GROUP" || key == "END_OBJECT") group.clear();
    }
    open = is_open(value);
    if (!open) out.emplace(group + "." + key, value);
  }
  return out;
}

LabelCamera read_label(const fs::path& path) {
  const std::multimap<std::string, std::string> values = label_values(path);
  std::string group;
  for (const auto& [name, value] : values) {
    const std::size_t at = name.find(".MODEL_TYPE");
    if (at != std::string::npos && name.compare(0, 22, "GEOMETRIC_CAMERA_MODEL") == 0)
      group = name.substr(0, at);
  }
  if (group.empty())
    throw ToolError("{}: the label has no GEOMETRIC_CAMERA_MODEL; give images or labels that have",
                    path.string());
  const auto text = [&](const std::string& key) {
    const auto found = values.find(group + "." + key);
    std::string out = found == values.end() ? "" : found->second;
    out.erase(std::remove(out.begin(), out.end(), '"'), out.end());
    return out;
  };
  LabelCamera out;
  const std::string type = text("MODEL_TYPE");
  if (type != "CAHV" && type != "CAHVOR" && type != "CAHVORE")
    throw ToolError("{}: camera model '{}' is not known; known are CAHV, CAHVOR and CAHVORE", path.string(),
                    type);
  out.lens = type == "CAHV" ? Lens::kNone : type == "CAHVOR" ? Lens::kCahvor : Lens::kCahvore;
  const auto component = [&](std::size_t index) {
    const std::optional<Numbers> v = numbers_in(text(fmt::format("MODEL_COMPONENT_{}", index + 1)));
    if (!v || v->empty())
      throw ToolError("{}: MODEL_COMPONENT_{} is not there, or not numbers; correct the label", path.string(),
                      index + 1);
    return *v;
  };
  Vec3* const vectors[] = {&out.model.c, &out.model.a, &out.model.h, &out.model.v,
                           &out.model.o, &out.model.r, &out.model.e};
  for (std::size_t i = 0; i < type.size(); ++i) {
    const Numbers v = component(i);
    if (v.size() != 3)
      throw ToolError("{}: MODEL_COMPONENT_{} has {} numbers; give 3", path.string(), i + 1, v.size());
    *vectors[i] = Vec3(v[0], v[1], v[2]);
  }
  if (out.lens == Lens::kCahvore) {
    // T: 1 perspective, 2 fish-eye, 3 by P.
    const double kind = component(7)[0];
    out.model.linearity = kind == 1.0 ? 1.0 : kind == 2.0 ? 0.0 : component(8)[0];
  }
  out.frame = text("REFERENCE_COORD_SYSTEM_NAME") + " " + text("REFERENCE_COORD_SYSTEM_INDEX");
  const auto pixels = [&](const char* key) {
    const auto found = values.find(key);
    const auto value = found == values.end() ? std::nullopt : to_number<int>(found->second);
    return value.value_or(0);
  };
  out.width_px = pixels("IMAGE.LINE_SAMPLES");
  out.height_px = pixels("IMAGE.LINES");
  return out;
}

CameraPair read_labels(const std::vector<fs::path>& files) {
  if (files.size() != 2)
    throw ToolError("{}: tells of one camera; give two files, left then right", files[0].string());
  const LabelCamera left = read_label(files[0]), right = read_label(files[1]);
  if (left.frame != right.frame)
    throw ToolError("{}: its camera model is in {}, that of {} in {}; give a pair that was taken together",
                    files[1].string(), right.frame, files[0].string(), left.frame);
  const PosedCamera a = from_cahv(left.model, left.lens), b = from_cahv(right.model, right.lens);
  CameraPair pair;
  pair.left = a.camera;
  pair.right = b.camera;
  take_size({static_cast<double>(left.width_px), static_cast<double>(left.height_px)}, pair.left);
  take_size({static_cast<double>(right.width_px), static_cast<double>(right.height_px)}, pair.right);
  pair.T_right_left = b.T_cam_ref * a.T_cam_ref.inverse();
  pair.format = fmt::format("PDS label ({})", left.lens == Lens::kNone ? "CAHV" : lens_name(left.lens));
  return pair;
}

// ---- which -----------------------------------------------------------------------------------------------

CameraPair read_as_told(const std::vector<fs::path>& files, const RigQuestion& question) {
  const std::vector<TextLine> lines = lines_of(files[0]);
  const auto begins = [&](const char* word) {
    return std::any_of(lines.begin(), lines.end(),
                       [&](const TextLine& line) { return line.text.rfind(word, 0) == 0; });
  };
  const std::string head = lines.empty() ? "" : lines[0].text;
  if (begins("PDS_VERSION_ID") || begins("ODL_VERSION_ID") || head.rfind("CCSD3ZF", 0) == 0)
    return read_labels(files);
  if (head.rfind("<?xml", 0) == 0)
    throw ToolError(
        "{}: XML is not read; write OpenCV's as .yml, PDS4's as a PDS3 label or as `fx fy cx cy baseline`",
        files[0].string());
  if (head == "[image]")
    throw ToolError("{}: ROS' .ini is not read; write it as .yaml (camera_calibration_parsers convert)",
                    files[0].string());
  const std::string extension = files[0].extension().string();
  if (extension == ".yaml" || extension == ".yml" || extension == ".json" || head.rfind("%YAML", 0) == 0)
    return read_yaml(files, question);
  if (files.size() != 1) throw ToolError("{}: is whole by itself; give this file alone", files[0].string());
  if (begins("cam0=") || begins("cam0 =")) return read_middlebury(tagged(files[0], lines, '='));
  if (begins("P_rect_")) return read_kitti_raw(tagged(files[0], lines, ':'), question);
  if (begins("P0:") || begins("P1:") || begins("P2:")) {
    static_cast<void>(read_number_rows(files[0]));  // refuses words among the numbers
    return read_kitti_rows(tagged(files[0], lines, ':'), question);
  }
  const bool key_first =
      !head.empty() && ((head[0] >= 'A' && head[0] <= 'Z') || (head[0] >= 'a' && head[0] <= 'z'));
  if (key_first && head.find(':') != std::string::npos) return read_yaml(files, question);
  if (key_first && head.find('=') != std::string::npos) {
    Keys keys;
    keys.add(files[0], as_yaml(files[0], lines));
    return read_key_by_key(keys);
  }
  return read_plain_rows(files[0]);
}

}  // namespace

CameraPair read_rig(const std::vector<fs::path>& files, const RigQuestion& question) {
  if (files.empty() || files.size() > 2) throw ToolError("a rig is told by one file or two; {}", kKnown);
  for (const fs::path& file : files) {
    if (!fs::exists(file)) throw ToolError("{}: no such file; check the name", file.string());
  }
  CameraPair pair = read_as_told(files, question);
  if (question.raw_alone && pair.rectified_alone)
    throw ToolError(
        "{}: tells of rectified images alone ({}), and --raw asks for raw ones; give the cameras' own "
        "matrices, lenses and pose, too",
        files[0].string(), pair.format);
  if (const std::string fault = fault_of(pair); !fault.empty())
    throw ToolError("{}: {}", files[0].string(), fault);
  return pair;
}

}  // namespace cairn::ground
