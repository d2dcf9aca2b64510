#include "localizer/ground_height.hpp"

#include <cmath>

#include "core/arithmetic.hpp"
#include "core/big_endian.hpp"
#include "core/crc32.hpp"
#include "core/factors.hpp"
#include "labeling/plane_fit.hpp"

namespace cairn {
namespace {

constexpr int kRounds = 5;

}  // namespace

GroundHeightStatus GroundHeightJob::start(const GroundHeightParams& params, const OrbitalMap& map,
                                          const SurfacePoints& points, const Pose3& T_map_site,
                                          const Vec3& rover_map_m, double sigma_xy_m) {
  status_ = GroundHeightStatus::kNoHeights;
  if (!map.usable() || map.heights().spacing == 0) return status_;
  params_ = params;
  map_ = map;
  rover_map_m_ = rover_map_m;
  sigma_xy_m_ = sigma_xy_m;
  points_.clear();
  const std::size_t stride = points.size() / kMaxPoints + 1;
  double reach_m = 0.0;
  for (std::size_t i = 0; i < points.size(); i += stride) {
    if (points[i].raised) continue;
    Point p;
    p.d_m = T_map_site * points[i].p_site_m - rover_map_m;
    p.sigma_m = static_cast<double>(points[i].sigma_height_m);
    points_.append(p);
    const double away_m = std::sqrt(square(p.d_m.x()) + square(p.d_m.y()));
    reach_m = away_m > reach_m ? away_m : reach_m;
  }
  if (static_cast<int>(points_.size()) < params.min_points) return status_;
  map.tiles_about(Vec2(rover_map_m.x(), rover_map_m.y()), reach_m, columns_, rows_);
  column_ = columns_.first;
  row_ = rows_.first;
  phase_ = Phase::kTile;
  status_ = GroundHeightStatus::kRunning;
  return status_;
}

std::uint32_t GroundHeightJob::unit_ops() const {
  switch (phase_) {
    case Phase::kTile: return kTileOps;
    case Phase::kCrc: return kCrcUnitBytes;
    case Phase::kRow: return kRowOps;
    case Phase::kFit: break;
  }
  return kRoundOps;
}

Progress GroundHeightJob::step(WorkBudget& budget) {
  while (status_ == GroundHeightStatus::kRunning) {
    if (!budget.take(unit_ops())) return Progress::kMore;
    unit();
  }
  return Progress::kDone;
}

void GroundHeightJob::unit() {
  switch (phase_) {
    case Phase::kTile: tile(); break;
    case Phase::kCrc: crc(); break;
    case Phase::kRow: row(); break;
    case Phase::kFit: round(); break;
  }
}

void GroundHeightJob::next_tile() {
  ++column_;
  phase_ = Phase::kTile;
}

void GroundHeightJob::tile() {
  if (column_ >= columns_.end) {
    column_ = columns_.first;
    ++row_;
  }
  if (row_ >= rows_.end || columns_.first >= columns_.end) {
    weigh();
    return;
  }
  const bool placed = map_.tile(row_ * map_.columns() + column_, tile_);
  if (!placed || tile_.height_bytes == 0 || tile_.bytes > cmap::kMaxTileBytes) {
    next_tile();
    return;
  }
  crc_ = cmap::tile_crc_start(row_ * map_.columns() + column_);
  cursor_ = 0;
  phase_ = Phase::kCrc;
}

void GroundHeightJob::crc() {
  const std::uint32_t coded = tile_.bytes - cmap::kCrcBytes;
  const std::uint32_t bytes = coded - cursor_ < kCrcUnitBytes ? coded - cursor_ : kCrcUnitBytes;
  crc_ = crc32(tile_.payload + cursor_, bytes, crc_);
  cursor_ += bytes;
  if (cursor_ < coded) return;
  cursor_ = 0;
  phase_ = Phase::kRow;
  const MapHeights& grid = map_.heights();
  if (crc_ != be::get_u32(tile_.payload + coded) ||
      !decoder_.start(grid.posts(tile_.shape.width), grid.posts(tile_.shape.height), tile_.heights(),
                      tile_.height_bytes))
    next_tile();
}

void GroundHeightJob::row() {
  for (std::uint32_t i = 0; i < cmap::kMaxPosts; ++i) before_[i] = posts_[i];
  const cmap::HeightStep step = decoder_.read(posts_);
  if (cursor_++ > 0 && step != cmap::HeightStep::kCorrupt) take_between_rows();
  if (step != cmap::HeightStep::kMore) next_tile();
}

/// Points of the tile between the last two rows.
void GroundHeightJob::take_between_rows() {
  const MapHeights& grid = map_.heights();
  const Vec2 corner = map_.origin_map_m() + Vec2(tile_.first_x, tile_.first_y) * map_.quantum_m();
  const double spacing_m = grid.spacing * map_.quantum_m();
  const double east = tile_.shape.width * map_.quantum_m() / spacing_m;
  const double north = tile_.shape.height * map_.quantum_m() / spacing_m;
  for (Point& p : points_) {
    const double u = (rover_map_m_.x() + p.d_m.x() - corner.x()) / spacing_m;
    const double v = (rover_map_m_.y() + p.d_m.y() - corner.y()) / spacing_m - (cursor_ - 2U);
    if (!(u >= 0.0 && u < east && v >= 0.0 && v < 1.0 && v + (cursor_ - 2U) < north)) continue;
    const auto i = static_cast<std::uint32_t>(u);
    const double x = u - i;
    const cmap::Post* const s = before_ + i;
    const cmap::Post* const n = posts_ + i;
    if (!(s[0].known() && s[1].known() && n[0].known() && n[1].known())) continue;
    const double south = s[0].value() + x * (s[1].value() - s[0].value());
    const double value = south + v * (n[0].value() + x * (n[1].value() - n[0].value()) - south);
    p.lack_m = grid.base_m + value * grid.quantum_m - (rover_map_m_.z() + p.d_m.z());
    p.known = true;
  }
}

/// How many points stand for one square of posts.
void GroundHeightJob::weigh() {
  PlaneSums sums;
  for (const Point& p : points_) {
    if (p.known) sums.add(1.0, p.d_m.x(), p.d_m.y(), 0.0);
  }
  result_ = GroundOffset();
  result_.points = static_cast<int>(sums.w);
  status_ = GroundHeightStatus::kNoHeights;
  if (result_.points < params_.min_points) return;
  const double n = sums.w;
  const double xx = sums.xx / n - square(sums.x / n);
  const double yy = sums.yy / n - square(sums.y / n);
  const double xy = sums.xy / n - sums.x / n * (sums.y / n);
  const double area_m2 = 12.0 * std::sqrt(std::fabs(xx * yy - xy * xy));  // of an even rectangle
  const double squares = area_m2 / square(map_.heights().spacing * map_.quantum_m()) + 1.0;
  const double alike = n > squares ? n / squares : 1.0;
  rough_m2_ = alike * square(static_cast<double>(map_.heights().sigma_m));
  round_ = 0;
  phase_ = Phase::kFit;
  status_ = GroundHeightStatus::kRunning;
}

void GroundHeightJob::round() {
  Mat3 G = Mat3::Identity();  // a tilt is less than a radian, ...
  G(0, 0) = 1.0e-6;           // ... a height off by less than a kilometre
  Vec3 b(0.0, 0.0, 0.0);
  Vec3 of_bias(0.0, 0.0, 0.0);
  double chi2 = 0.0;
  double weights = 0.0;
  PlaneSums ground;
  for (const Point& p : points_) {
    if (!p.known) continue;
    const Vec3 j(1.0, p.d_m.y(), -p.d_m.x());
    const double variance = square(p.sigma_m) + rough_m2_;
    const double e2 = square(p.lack_m - j.dot(result_.offset)) / variance;
    const double robust = round_ == 0 ? 1.0 : 1.0 / square(1.0 + e2 / 9.0);
    const double w = robust / variance;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) G(r, c) += w * j[r] * j[c];
    }
    b += w * p.lack_m * j;
    of_bias += w * p.sigma_m * j;
    chi2 += robust * e2;
    weights += robust;
    ground.add(w, p.d_m.x(), p.d_m.y(), p.d_m.z() + p.lack_m);
  }
  const Mat3 inverse = Factors(G).inverse();
  for (int r = 0; r < 3; ++r)
    result_.offset[r] = inverse(r, 0) * b[0] + inverse(r, 1) * b[1] + inverse(r, 2) * b[2];
  if (++round_ < kRounds) return;
  const double scatter = chi2 > weights ? chi2 / weights : 1.0;
  GroundPlane plane{};
  ground.solve(plane);
  const double share = params_.bias_px / params_.probe_sigma_px;
  const Vec3 lean = share * inverse * of_bias;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) result_.covariance(r, c) = scatter * inverse(r, c) + lean[r] * lean[c];
  }
  const auto common_m = static_cast<double>(map_.heights().common_m);
  const double lean_rad =
      std::sqrt(square(common_m / params_.common_reach_m) + square(params_.common_tilt_rad));
  result_.least = Vec3(common_m, lean_rad, lean_rad);
  for (int r = 0; r < 3; ++r) result_.covariance(r, r) += square(result_.least[r]);
  result_.covariance(0, 0) += (square(plane.a) + square(plane.b)) * square(sigma_xy_m_);
  status_ = GroundHeightStatus::kFitted;
}

}  // namespace cairn
