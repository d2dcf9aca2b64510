/// Raw pairs on board: taken into buffers of their own, laid anew by tables (image/remap.hpp), and only then
/// seen by anything else. A mission whose camera gives rectified pairs pays nothing for it.
///
/// Tables and buffers belong to whoever starts the flight module; `cairn rig --table` makes the tables and
/// their CRCs. At init they are held against size, reach and CRC: what does not fit is refused as a rig that
/// cannot be used, not flown with.
#pragma once

#include <cstdint>

#include "core/work_budget.hpp"
#include "geometry/stereo_rig.hpp"
#include "image/remap.hpp"

namespace cairn::app {

/// Borrowed for good.
struct RawPairs {
  const RemapTable* left_table = nullptr;
  const RemapTable* right_table = nullptr;
  std::uint32_t left_crc = 0;  ///< crc_of(table)
  std::uint32_t right_crc = 0;
  int width_px = 0;  ///< of the raw images: the tables are for these and no others
  int height_px = 0;
  std::uint8_t* left = nullptr;  ///< room for width_px * height_px bytes each
  std::uint8_t* right = nullptr;
};

class PairRectifier {
 public:
  /// `raw` is null where pairs come rectified. False: a table is missing, not of the rig's size, not what its
  /// CRC was made of or beyond what the remap takes; or there is no buffer, or no such image.
  bool init(const RawPairs* raw, const StereoRig& rig);
  bool needed() const { return raw_ != nullptr; }
  bool busy() const { return busy_; }
  const RawPairs& raw() const { return *raw_; }

  /// The raw pair lies in its buffers, in these sizes; a side of another size than the tables' is missing.
  /// Targets are packed, of the rig's size, borrowed until done.
  void start(int left_width, int left_height, int right_width, int right_height, std::uint8_t* left,
             std::uint8_t* right);
  Progress step(WorkBudget& budget);  ///< unit: a row; the same bits for every slicing
  /// The rectified pair; a missing side has no data.
  const ImageU8& left() const { return sides_[0].made; }
  const ImageU8& right() const { return sides_[1].made; }

 private:
  struct Side {
    RemapJob job;
    ImageU8 made;
  };
  void start_side(Side& side, const RemapTable& table, const std::uint8_t* raw, int width, int height,
                  std::uint8_t* target);

  const RawPairs* raw_ = nullptr;
  bool busy_ = false;
  Side sides_[2];
};

}  // namespace cairn::app
