/// Where the stereo pairs of a data set lie, and which image belongs to which.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace cairn::ground {

struct Frame {
  int number = 0;               ///< the file's name where it is a number, else the position in the order
  double stamp_s = 0.0;         ///< of the name where it is a time, else the number
  std::filesystem::path left;   ///< empty: missing
  std::filesystem::path right;  ///< empty: missing
};

struct StereoFolder {
  std::filesystem::path left;
  std::filesystem::path right;
  std::vector<Frame> frames;
  bool stamped = false;            ///< names are times
  std::vector<std::string> notes;  ///< what had to be decided, a line each
};

/// Finds the pairs below `folder` (layouts: doc/guide/drives.md): two folders of usual names, two whose
/// names differ by a word of side, or one in which names do (image_names.hpp). Order: NameLess, so that
/// numbers need no leading zeros. Left and right belong together by name without extension; where fewer than
/// half agree so, by the number at the end of the name (left0001, I1_000001, 7 and 000007), by name but for
/// the word of side, then, where names are times, by the nearest within half an interval. An image missing
/// on one side is a frame with an empty path there. Throws ToolError: no images, names that do not pair,
/// numbers that repeat.
StereoFolder find_stereo_images(const std::filesystem::path& folder);

/// What turns stamps into seconds: 1, 1e-3, 1e-6 or 1e-9. From 1e11 on stamps are no seconds; taken is the
/// unit that makes them a date of these years at steps of 0.5 ms to 1000 s, else nanoseconds. Below they are
/// none where steps are 1e4 and more: microseconds, from 5e5 on nanoseconds.
double unit_of_stamps(const std::vector<double>& stamps);

}  // namespace cairn::ground
