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

/// The order of frames: shorter names first, then by text.
struct StemLess {
  bool operator()(const std::string& a, const std::string& b) const {
    return a.size() != b.size() ? a.size() < b.size() : a < b;
  }
};
using Images = std::map<std::string, fs::path, StemLess>;

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

using Paired = std::map<std::string, Frame, StemLess>;

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

/// Names that are times: a number with a point, or one too large for a frame's.
std::optional<std::vector<double>> times_of(const Images& images) {
  std::vector<double> out;
  for (const auto& [stem, path] : images) {
    const std::optional<double> value = to_finite(stem);
    if (!value || (stem.find('.') == std::string::npos && *value < 1.0e11)) return std::nullopt;
    out.push_back(*value);
  }
  return out;
}

/// In the unit of the names. Whole ones exactly: nanoseconds since 1970 are beyond what a double holds.
double time_between(const std::string& from, const std::string& to) {
  const std::optional<std::int64_t> a = to_number<std::int64_t>(from), b = to_number<std::int64_t>(to);
  return a && b ? static_cast<double>(*b - *a) : *to_finite(to) - *to_finite(from);
}

/// Each right image goes with the nearest left one within half of the least interval.
std::optional<Paired> pair_by_time(const Images& left, const Images& right, std::vector<std::string>& notes) {
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
  const std::optional<std::vector<double>> times = times_of(names);
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

}  // namespace

StereoFolder find_stereo_images(const fs::path& folder) {
  StereoFolder out;
  Images left, right;
  for (const Layout& layout : kLayouts) {
    if (!fs::is_directory(folder / layout.left)) continue;
    const bool by_prefix = layout.left_prefix[0] != '\0';
    Images first;
    if (by_prefix) {
      first = list_images(folder / layout.left, layout.left_prefix);
      if (first.empty()) continue;
    }
    out.left = folder / layout.left;
    out.right = folder / layout.right;
    if (!fs::is_directory(out.right)) {
      throw ToolError("{}: no such folder; put the right images of {} there", out.right.string(),
                      out.left.string());
    }
    left = by_prefix ? std::move(first) : list_images(out.left, "");
    right = list_images(out.right, layout.right_prefix);
    break;
  }
  if (out.left.empty()) {
    throw ToolError("{}: no folder of left images here; put pairs into left/ and right/", folder.string());
  }
  if (left.empty() || right.empty()) {
    throw ToolError("{}: no image here (JPEG, PNG, TIFF, PGM, BMP ...); put the {} images there",
                    (left.empty() ? out.left : out.right).string(), left.empty() ? "left" : "right");
  }
  Paired paired = pair_images(out, left, right, out.notes);
  number_frames(out, paired);
  return out;
}

double unit_of_stamps(const std::vector<double>& stamps) {
  if (stamps.empty() || stamps[0] < 1.0e11) return 1.0;
  std::vector<double> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i) steps.push_back(stamps[i] - stamps[i - 1]);
  std::sort(steps.begin(), steps.end());
  const double step = steps.empty() ? 0.0 : steps[steps.size() / 2];
  for (const double unit : {1.0e-9, 1.0e-6, 1.0e-3}) {
    const double first_s = stamps[0] * unit;
    const bool of_these_years = first_s > 1.0e9 && first_s < 4.0e9;
    if (of_these_years && (steps.empty() || (step * unit >= 0.5e-3 && step * unit <= 1000.0))) return unit;
  }
  return 1.0e-9;
}

}  // namespace cairn::ground
