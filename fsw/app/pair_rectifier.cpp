#include "app/pair_rectifier.hpp"

namespace cairn::app {
namespace {

bool table_fits(const RemapTable* table, std::uint32_t crc, const StereoRig& rig) {
  return table != nullptr && table->width_px == rig.width_px && table->height_px == rig.height_px &&
         is_sound(*table) && crc_of(*table) == crc;
}

}  // namespace

bool PairRectifier::init(const RawPairs* raw, const StereoRig& rig) {
  raw_ = nullptr;
  busy_ = false;
  if (raw == nullptr) return true;
  constexpr int kMostSide_px = remap::kReach_px + 1;
  const bool fits = table_fits(raw->left_table, raw->left_crc, rig) &&
                    table_fits(raw->right_table, raw->right_crc, rig) && raw->left != nullptr &&
                    raw->right != nullptr && raw->width_px >= 2 && raw->width_px <= kMostSide_px &&
                    raw->height_px >= 2 && raw->height_px <= kMostSide_px;
  if (fits) raw_ = raw;
  return fits;
}

void PairRectifier::start(int left_width, int left_height, int right_width, int right_height,
                          std::uint8_t* left, std::uint8_t* right) {
  start_side(sides_[0], *raw_->left_table, raw_->left, left_width, left_height, left);
  start_side(sides_[1], *raw_->right_table, raw_->right, right_width, right_height, right);
  busy_ = true;
}

void PairRectifier::start_side(Side& side, const RemapTable& table, const std::uint8_t* raw, int width,
                               int height, std::uint8_t* target) {
  side = Side();
  if (width != raw_->width_px || height != raw_->height_px) return;
  const RemapStatus started = side.job.start(table, packed_view(raw, width, height),
                                             packed_view(target, table.width_px, table.height_px));
  if (started == RemapStatus::kRunning)
    side.made = packed_view<const std::uint8_t>(target, table.width_px, table.height_px);
}

Progress PairRectifier::step(WorkBudget& budget) {
  for (Side& side : sides_) {
    if (side.job.step(budget) == Progress::kMore) return Progress::kMore;
  }
  busy_ = false;
  return Progress::kDone;
}

}  // namespace cairn::app
