#include "dataset/stereo_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>

#include "base/number_table.hpp"
#include "base/tool_error.hpp"
#include "dataset/image_names.hpp"

namespace fs = std::filesystem;

namespace cairn::ground {
namespace {

/// `prefix`: of the names, where both sides lie in one folder.
struct Layout {
  const char* left;
  const char* right;
  const char* left_prefix = "";
  const char* right_prefix = "";
};
constexpr Layout kLayouts[] = {
    {"left", "right"},
    {"image_l", "image_r"},
    {"image_0", "image_1"},
    {"image_2", "image_3"},
    {"image_00/data", "image_01/data"},
    {"image_02/data", "image_03/data"},
    {"mav0/cam0/data", "mav0/cam1/data"},
    {"cam0/data", "cam1/data"},
    {"cam0", "cam1"},
    {"img", "img", "I1_", "I2_"},
    {".", ".", "I1_", "I2_"},
    {".", ".", "left", "right"},
    {".", ".", "im0", "im1"},
};

using Images = std::map<std::string, fs::path, NameLess>;

bool is_image(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  constexpr std::array kImages = {".jpg", ".jpeg", ".png",  ".tif", ".tiff", ".pgm", ".ppm",
                                  ".pnm", ".bmp",  ".webp", ".jp2", ".gif",  ".img", ".vic"};
  return std::find(kImages.begin(), kImages.end(), extension) != kImages.end();
}

Images list_images(const fs::path& folder, const std::string& prefix) {
  Images images;
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    const std::string stem = at->path().stem().string();
    if (!is_image(at->path()) || stem.rfind(prefix, 0) != 0) continue;
    const auto [known, added] = images.emplace(stem.substr(prefix.size()), at->path());
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

using Paired = std::map<std::string, Frame, NameLess>;

Paired pair_by_name(const Images& left, const Images& right) {
  Paired paired;
  for (const auto& [stem, path] : left) paired[stem].left = path;
  for (const auto& [stem, path] : right) paired[stem].right = path;
  return paired;
}

std::size_t pairs_in(const Paired& paired) {
  return static_cast<std::size_t>(std::count_if(paired.begin(), paired.end(), [](const auto& entry) {
    return !entry.second.left.empty() && !entry.second.right.empty();
  }));
}

template <typename Named>
std::vector<std::string> names_of(const Named& images) {
  std::vector<std::string> names;
  for (const auto& [name, value] : images) names.push_back(name);
  return names;
}

/// Under their numbers, where names are numbers but for what all begin and end with; else as they are.
template <typename Named>
Named by_bare_number(const Named& images) {
  const std::vector<std::string> numbers = bare_numbers(names_of(images));
  if (numbers.empty()) return images;
  Named out;
  std::size_t i = 0;
  for (const auto& [name, value] : images) out.emplace(numbers[i++], value);
  return out;
}

/// Those with the mark of that side, without it.
Images of_side(const Images& images, const SideMark& mark, bool right) {
  Images out;
  for (const auto& [name, path] : images) {
    if (const auto bare = without_mark(name, mark, right)) out.emplace(*bare, path);
  }
  return out;
}

/// img_0_L in the one folder, and img_0_R in the other.
std::optional<Paired> pair_by_mark(const Images& left, const Images& right) {
  const std::optional<SideMark> mark = find_side_mark(names_of(left), names_of(right));
  if (!mark) return std::nullopt;
  return by_bare_number(pair_by_name(of_side(left, *mark, false), of_side(right, *mark, true)));
}

/// By the digits at the end of each name; nothing where a name has none, or two have the same.
std::optional<Images> by_last_number(const Images& images) {
  Images out;
  for (const auto& [stem, path] : images) {
    std::string digits = stem.substr(stem.find_last_not_of("0123456789") + 1);
    if (digits.empty()) return std::nullopt;
    digits.erase(0, std::min(digits.find_first_not_of('0'), digits.size() - 1));
    if (!out.emplace(digits, path).second) return std::nullopt;
  }
  return out;
}

/// Names that are times: numbers with a point, too large for a frame's, or too far apart.
std::optional<std::vector<double>> times_of(const Images& images) {
  constexpr double kMostFrames = 1.0e11, kMostStep = 1.0e4;
  std::vector<double> out;
  bool all = true, apart = images.size() > 1;
  for (const auto& [stem, path] : images) {
    const std::optional<double> value = to_finite(stem);
    if (!value) return std::nullopt;
    all = all && (stem.find('.') != std::string::npos || *value >= kMostFrames);
    apart = apart && (out.empty() || *value - out.back() >= kMostStep);
    out.push_back(*value);
  }
  if (!all && !apart) return std::nullopt;
  return out;
}

/// In the unit of the names. Whole ones exactly: nanoseconds since 1970 are beyond what a double holds.
double time_between(const std::string& from, const std::string& to) {
  const std::optional<std::int64_t> a = to_number<std::int64_t>(from), b = to_number<std::int64_t>(to);
  return a && b ? static_cast<double>(*b - *a) : *to_finite(to) - *to_finite(from);
}

/// Each right image goes with the nearest left one within half of the least interval.
std::optional<Paired> pair_by_time(const Images& named_left, const Images& named_right,
                                   std::vector<std::string>& notes) {
  const Images left = by_bare_number(named_left), right = by_bare_number(named_right);
  const auto left_times = times_of(left), right_times = times_of(right);
  if (!left_times || !right_times || left.size() < 2) return std::nullopt;
  double interval = INFINITY;
  for (std::size_t i = 1; i < left_times->size(); ++i)
    interval = std::min(interval, (*left_times)[i] - (*left_times)[i - 1]);
  Images renamed;
  double largest = 0.0;
  for (const auto& [stem, path] : right) {
    double best = INFINITY;
    std::string name = stem;
    for (const auto& [other, left_path] : left) {
      const double apart = std::fabs(time_between(other, stem));
      if (apart < best) {
        best = apart;
        name = other;
      }
    }
    if (best >= 0.5 * interval)
      name = stem;
    else
      largest = std::max(largest, best);
    if (!renamed.emplace(name, path).second) return std::nullopt;
  }
  notes.push_back(
      fmt::format("left and right names are times that differ by up to {:.3g} ms; paired by the nearest",
                  1.0e3 * largest * unit_of_stamps(*left_times)));
  return pair_by_name(left, renamed);
}

Paired pair_images(const StereoFolder& at, const Images& left, const Images& right,
                   std::vector<std::string>& notes) {
  const std::size_t half = (std::min(left.size(), right.size()) + 1) / 2;
  const Paired by_name = pair_by_name(left, right);
  if (pairs_in(by_name) >= half) return by_name;
  const std::optional<Images> left_numbers = by_last_number(left), right_numbers = by_last_number(right);
  if (left_numbers && right_numbers) {
    Paired by_number = pair_by_name(*left_numbers, *right_numbers);
    if (pairs_in(by_number) >= half) return by_number;
  }
  if (std::optional<Paired> by_mark = pair_by_mark(left, right); by_mark && pairs_in(*by_mark) >= half)
    return *by_mark;
  if (std::optional<Paired> by_time = pair_by_time(left, right, notes); by_time && pairs_in(*by_time) >= half)
    return *by_time;
  if (pairs_in(by_name) > 0) return by_name;
  throw ToolError("{}: no name pairs with one in {} (first {} and {}); name left and right of a frame alike",
                  at.left.string(), at.right.string(), left.begin()->second.filename().string(),
                  right.begin()->second.filename().string());
}

void number_frames(StereoFolder& out, Paired& paired) {
  // Numbers come from the names only where every name is one: mixed, they could repeat.
  const bool numbered = std::all_of(paired.begin(), paired.end(),
                                    [](const auto& entry) { return whole_number(entry.first).has_value(); });
  Images names;
  for (const auto& [stem, frame] : paired) names.emplace(stem, frame.left);
  const std::optional<std::vector<double>> times = times_of(by_bare_number(names));
  const double unit = times ? unit_of_stamps(*times) : 1.0;
  out.stamped = times.has_value();
  for (auto& [stem, frame] : paired) {
    const std::size_t i = out.frames.size();
    frame.number = numbered ? *whole_number(stem) : static_cast<int>(i);
    frame.stamp_s = times ? (*times)[i] * unit : frame.number;
    if (i > 0 && frame.number <= out.frames.back().number) {
      throw ToolError("{}: two frames have the number {}; give all names the same number of digits",
                      out.left.string(), frame.number);
    }
    out.frames.push_back(std::move(frame));
  }
}

/// Both sides' images, and where they lie.
struct Sides {
  fs::path left_folder, right_folder;
  Images left, right;
  bool by_mark = false;  ///< their names are without it
};

std::vector<std::string> subfolders(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    if (at->is_directory(failed)) names.push_back(at->path().filename().string());
  }
  std::sort(names.begin(), names.end(), NameLess());
  return names;
}

/// The first of the usual layouts whose left folder is there and, where names tell the sides, holds such.
std::optional<Sides> by_layout(const fs::path& folder) {
  for (const Layout& layout : kLayouts) {
    if (!fs::is_directory(folder / layout.left)) continue;
    Sides out{folder / layout.left, folder / layout.right, {}, {}, false};
    out.left = list_images(out.left_folder, layout.left_prefix);
    if (layout.left_prefix[0] != '\0' && out.left.empty()) continue;
    if (fs::is_directory(out.right_folder)) out.right = list_images(out.right_folder, layout.right_prefix);
    return out;
  }
  return std::nullopt;
}

/// The folder where it has images, else the one below that has; empty where there are none, or several.
fs::path with_images(const fs::path& folder) {
  if (!list_images(folder, "").empty()) return folder;
  fs::path found;
  for (const std::string& name : subfolders(folder)) {
    if (list_images(folder / name, "").empty()) continue;
    if (!found.empty()) return {};
    found = folder / name;
  }
  return found;
}

/// Two folders that differ by a word of side: Left and Right, image_left and image_right, cam1 and cam2.
std::optional<Sides> by_folder_names(const fs::path& folder) {
  for (const auto& [left, right] : pairs_by_mark(subfolders(folder))) {
    Sides out{with_images(folder / left), with_images(folder / right), {}, {}, false};
    if (out.left_folder.empty() || out.right_folder.empty()) continue;
    out.left = list_images(out.left_folder, "");
    out.right = list_images(out.right_folder, "");
    return out;
  }
  return std::nullopt;
}

/// One folder, in which names tell the sides: img_0_L and img_0_R.
std::optional<Sides> by_image_names(const fs::path& folder, std::vector<std::string>& notes) {
  for (const char* name : {".", "img", "images", "image", "data", "frames"}) {
    const fs::path here = folder / name;
    if (!fs::is_directory(here)) continue;
    const Images images = list_images(here, "");
    const std::vector<std::string> names = names_of(images);
    const std::optional<SideMark> mark = find_side_mark(names, names);
    if (!mark) continue;
    Sides out{here, here, of_side(images, *mark, false), of_side(images, *mark, true), true};
    if (const std::size_t rest = images.size() - out.left.size() - out.right.size(); rest > 0)
      notes.push_back(fmt::format("{}: {} of {} images are left out, whose names have neither '{}' nor '{}'",
                                  here.string(), rest, images.size(), mark->left, mark->right));
    return out;
  }
  return std::nullopt;
}

/// No image there: what is there in their place, for who has to unpack it.
[[noreturn]] void refuse_empty(const fs::path& folder, const char* side) {
  std::string other;
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    const std::string name = at->path().filename().string();
    if (at->is_regular_file(failed) && name[0] != '.' && (other.empty() || name < other)) other = name;
  }
  throw ToolError("{}: no image here (JPEG, PNG, TIFF, PGM, BMP ...){}; put the {} images there",
                  folder.string(), other.empty() ? "" : fmt::format(", but {}: unpack or convert it", other),
                  side);
}

Sides find_sides(const fs::path& folder, std::vector<std::string>& notes) {
  const std::optional<Sides> usual = by_layout(folder);
  if (usual && !usual->left.empty() && !usual->right.empty()) return *usual;
  if (std::optional<Sides> found = by_folder_names(folder)) return *found;
  if (std::optional<Sides> found = by_image_names(folder, notes)) return *found;
  if (!usual) {
    for (const std::string& name : subfolders(folder)) {
      if (by_layout(folder / name) || by_folder_names(folder / name))
        throw ToolError(
            "{}: no folder of left images here, but in {}; give that one, with the calibration in it",
            folder.string(), (folder / name).string());
    }
    const Images here = list_images(folder, "");
    throw ToolError("{}: no folder of left images here{}; put pairs into left/ and right/", folder.string(),
                    here.empty()
                        ? ""
                        : fmt::format(", and names of images ({}) tell no side (pictures that hold both are "
                                      "to be cut)",
                                      here.begin()->second.filename().string()));
  }
  if (!fs::is_directory(usual->right_folder))
    throw ToolError("{}: no such folder; put the right images of {} there", usual->right_folder.string(),
                    usual->left_folder.string());
  refuse_empty(usual->left.empty() ? usual->left_folder : usual->right_folder,
               usual->left.empty() ? "left" : "right");
}

}  // namespace

StereoFolder find_stereo_images(const fs::path& folder) {
  StereoFolder out;
  const Sides sides = find_sides(folder, out.notes);
  out.left = sides.left_folder;
  out.right = sides.right_folder;
  Paired paired = pair_images(out, sides.left, sides.right, out.notes);
  if (sides.by_mark) paired = by_bare_number(paired);
  number_frames(out, paired);
  return out;
}

double unit_of_stamps(const std::vector<double>& stamps) {
  if (stamps.empty()) return 1.0;
  std::vector<double> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i) steps.push_back(stamps[i] - stamps[i - 1]);
  std::sort(steps.begin(), steps.end());
  const double step = steps.empty() ? 0.0 : steps[steps.size() / 2];
  constexpr double kSeconds = 1.0e11, kLongStep = 1.0e4, kNanoseconds = 5.0e5;
  if (stamps[0] < kSeconds) return step < kLongStep ? 1.0 : step < kNanoseconds ? 1.0e-6 : 1.0e-9;
  for (const double unit : {1.0e-9, 1.0e-6, 1.0e-3}) {
    const double first_s = stamps[0] * unit;
    const bool of_these_years = first_s > 1.0e9 && first_s < 4.0e9;
    if (of_these_years && (steps.empty() || (step * unit >= 0.5e-3 && step * unit <= 1000.0))) return unit;
  }
  return 1.0e-9;
}

}  // namespace cairn::ground
