/// What the images of a stereo pair say about themselves: do left and right belong together as a rectified
/// pair does? Small patches of the left image are looked for in the right one, up and down as well, by
/// normalised correlation; nothing of the flight code's own matching, which looks along rows alone.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dataset/drive.hpp"

namespace cairn::ground {

/// A patch found again: where in the left image, and how far off in the right one. Pixels.
struct PatchMatch {
  Vec2 left_px = Vec2(0.0, 0.0);
  double disparity_px = 0.0;  ///< left minus right, either sign
  double lower_px = 0.0;      ///< by how much it lies lower in the right image
};

/// Up to 300 patches of 11 x 11 pixels with texture, spread over the left image, searched within a quarter
/// of the width either way and 12 rows up and down (images wider than 800 are halved first, so 24 rows).
/// Kept are those that correlate to 0.85 or better and clearly better than anywhere else.
std::vector<PatchMatch> match_patches(ImageU8 left, ImageU8 right);

/// How matches depart from equal rows: lower = offset + roll x + stretch y + c x y d (pixels from the
/// image's middle, in units of the width), by least squares on the half that agrees best.
struct RowFit {
  std::size_t matches = 0;
  double offset_px = 0.0;  ///< at the middle of the image
  double roll_px = 0.0;    ///< from the left edge to the right one
  double stretch_px = 0.0;
  double bend_px = 0.0;       ///< what a lens does: in a corner, at the median disparity
  double rest_px = 0.0;       ///< median of what remains
  double swapped = 0.0;       ///< share of disparities below -1 px
  double nearer_below = 0.0;  ///< correlation of disparities with rows: 1 over level ground
};
/// Nothing where there are fewer than 12 matches.
std::optional<RowFit> fit_rows(const std::vector<PatchMatch>& matches, int width, int height);

/// What is wrong with the pairs of a drive, with the mend; empty where nothing shows. Looks at three frames
/// of the range: the same picture twice, a side that shows the next frame's picture, dark, overexposed,
/// nothing matches, swapped, near things above far ones, one image lower, the right image of one of the three
/// frames before or after, turned or bent images. Most frames have to agree, with 12 matches or more each.
/// Where nothing matches it is looked for in images of half and of a quarter of the size, which average noise
/// out: what matches there alone is noisy, and is judged by what is seen there.
struct PairFault {
  enum class Kind {
    kNone,
    kSame,
    kFrozen,
    kDark,
    kBright,
    kNothingMatches,
    kNoisy,
    kSwapped,
    kUpsideDown,
    kLower,
    kLate,
    kTurned,
    kBent
  } kind = Kind::kNone;
  std::string words;
};
PairFault check_pairs(const Drive& drive, std::size_t first, std::size_t end);

}  // namespace cairn::ground
