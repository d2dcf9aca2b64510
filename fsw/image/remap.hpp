/// Takes an image apart and lays it anew, each pixel from where a table says: what rectifies the images of a
/// raw rig (lenses, cameras that differ or are turned) before anything else sees them.
///
/// The table holds source coordinates at each kSpacing-th pixel of the target, in whole 1/512 px; between
/// them they are interpolated bilinearly, in integers and exactly: at (x, y) in the cell with corners n00 n10
/// n01 n11, S = kSpacing,
///   u = ((S - x)((S - y) u00 + y u01) + x ((S - y) u10 + y u11)) / S^2    v alike
/// and the grey there is the bilinear mean of four pixels, weights in 1/256, rounded to nearest. Coordinates
/// beyond the source's border are taken to the border. No target divides or rounds otherwise: same bits.
///
/// A lens whose source coordinates bend by c px / px^2 is followed to S^2 c / 8: with the k1 = -0.28 of a
/// wide lens (f 394 px, S = 8) to 0.03 px at the edge, 0.01 px in the middle. kSpacing is the least power
/// of two from 8 on with which both cameras' tables of the mission take no more than 64 KiB.
///
/// The table comes from the ground (ground_tools/dataset/rectify.hpp) as a parameter of the mission; a pair
/// that is rectified needs none. Cost: 4 operations a pixel; a unit of work is a row. On the model of the
/// RAD750 53 cycles a pixel, 0.105 s for both images of 512 x 384.
///
/// Source: bilinear warp by a control grid, Wolberg, "Digital Image Warping" (1990), 7.
#pragma once

#include <array>
#include <cstdint>

#include "core/work_budget.hpp"
#include "image/image_view.hpp"
#include "mission_cfg.hpp"

namespace cairn {

/// In the source, 1/512 px: u right, v down.
struct RemapNode {
  std::int32_t u = 0;
  std::int32_t v = 0;
};

namespace remap {
inline constexpr int kFractionBits = 9;
inline constexpr int kReach_px = 2047;  ///< of coordinates, either sign
inline constexpr std::size_t kMostBytes = 64 * 1024;

constexpr int nodes_along(int pixels, int spacing) { return (pixels - 1) / spacing + 2; }
constexpr std::size_t nodes_of(int spacing) {
  return static_cast<std::size_t>(nodes_along(cfg::kImageWidth, spacing)) *
         static_cast<std::size_t>(nodes_along(cfg::kImageHeight, spacing));
}
constexpr int spacing_bits() {
  int bits = 3;
  while (2 * sizeof(RemapNode) * nodes_of(1 << bits) > kMostBytes) ++bits;
  return bits;
}
inline constexpr int kSpacingBits = spacing_bits();
inline constexpr int kSpacing = 1 << kSpacingBits;
inline constexpr std::size_t kMostNodes = nodes_of(kSpacing);
static_assert(kSpacingBits <= 5, "a coordinate times kSpacing^2 stays within 31 bits");
}  // namespace remap

/// Of one camera. Nodes row by row, remap::nodes_along(width_px) a row: (x, y) of the target in each, both
/// multiples of kSpacing, the last ones on the border or beyond it.
struct RemapTable {
  std::int32_t width_px = 0;  ///< of the target, at most the mission's
  std::int32_t height_px = 0;
  std::array<RemapNode, remap::kMostNodes> nodes;
};

/// A size within the mission's, and no coordinate beyond kReach_px.
bool is_sound(const RemapTable& table);
/// Of width, height and the nodes that they ask for, u then v of each, as big-endian words. Asks for a table
/// that is sound.
std::uint32_t crc_of(const RemapTable& table);

enum class CAIRN_NODISCARD RemapStatus : std::uint8_t {
  kIdle,      ///< never started
  kRunning,   ///< call step() again
  kDone,      ///< the target is whole: use it
  kBadTable,  ///< a size beyond the mission's or below 1, or a coordinate beyond kReach_px
  kBadImage,  ///< the source is below 2 x 2 or above 2048 px a side, or the target is not of the table's size
};

class RemapJob {
 public:
  /// Table and images are borrowed until the job is done. The target must not be the source.
  RemapStatus start(const RemapTable& table, const ImageU8& source, const MutableImageU8& target);
  Progress step(WorkBudget& budget);  // same result for every slicing
  RemapStatus status() const { return status_; }

  /// The longest unit of work, operations.
  static constexpr std::uint32_t kMostUnit = 4U * static_cast<std::uint32_t>(cfg::kImageWidth);

 private:
  void do_row();

  const RemapTable* table_ = nullptr;
  ImageU8 source_;
  MutableImageU8 target_;
  int y_ = 0;
  RemapStatus status_ = RemapStatus::kIdle;
};

}  // namespace cairn
