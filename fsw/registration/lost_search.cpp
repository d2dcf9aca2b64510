#include "registration/lost_search.hpp"

#include <cmath>

#include "core/arithmetic.hpp"
#include "core/exp_log.hpp"
#include "core/heap_sort.hpp"

namespace cairn {
namespace {

constexpr double kNoSize = -1.0e3;
constexpr double kHitShare = 0.9;  // of true boulders that find a set cell
constexpr double kScale = 64.0;    // of scores in the sequential test, 1/nat
// Looks at an unrelated place that are cheap beside the making of a hypothesis. Where boulders are few a miss
// costs much and says little.
constexpr double kChanceLooks = 12.0;
constexpr double kPassNats = 6.0;                             // what the sequential test asks for in the end
constexpr int kRounds = 3;                                    // of the fit, before the score
constexpr double kGates[kRounds + 1] = {5.0, 4.0, 3.0, 4.0};  // sigmas, and of the score
constexpr int kAmbiguousPairs = 4;                            // for one that is as good to fall behind
constexpr double kOthersWait = 1.0e9;                         // of a pair's cost, while rivals are looked for
constexpr double kMostM = 1.0e6;                              // a diameter, where any may be
constexpr double kBand = 0.1;   // of a length: pairs that go through the map together
constexpr double kSameM = 0.5;  // poses nearer than this, and turned less, are one
constexpr double kSameRad = 0.1;
constexpr std::int32_t kFarthest = 60000;  // of a look, so that its turn fits 32 bits

}  // namespace

bool holds(const SearchRegion& region, const Vec2& pivot_map_m, double yaw_rad) {
  if (std::fabs(wrap_angle(yaw_rad - region.yaw_rad)) > region.half_sector_rad) return false;
  return region.anywhere || (pivot_map_m - region.centre_map_m).norm() <= region.radius_m;
}

LostStatus LostSearch::start(const LostSearchParams& params, const WideMap& map, const LocalMap& local,
                             const Vec2& pivot_site_m, const SearchRegion& region) {
  params_ = params;
  map_ = &map;
  region_ = region;
  hits_.clear();
  queue_.clear();
  queue_at_ = 0;
  ops_ = 0;
  hypotheses_ = 0;
  pairs_tried_ = pairs_since_best_ = rival_pairs_ = 0;
  best_moved_ = false;
  pairs_.clear();
  phase_ = Phase::kSizes;
  row_ = 0;
  for (std::uint32_t& word : tried_) word = 0;
  const auto in = [](double v, double low, double high) { return v >= low && v <= high; };
  const bool good =
      in(params.sigma_pair_m, 1e-3, 1.0) && in(params.drift, 0.0, 0.1) && in(params.true_share, 0.05, 0.95) &&
      (params.sigma_size == 0.0 || in(params.sigma_size, 0.01, 2.0)) && in(params.accept_nats, 0.0, 100.0) &&
      in(params.margin_nats, 0.0, 100.0) && in(params.floor_nats, 1.0, 20.0) && params.max_pairs >= 1 &&
      params.max_pairs <= 10000 && std::isfinite(pivot_site_m.x()) && std::isfinite(pivot_site_m.y()) &&
      (region.anywhere || (in(region.radius_m, 0.01, 1e5) && std::isfinite(region.centre_map_m.x()) &&
                           std::isfinite(region.centre_map_m.y()))) &&
      in(region.half_sector_rad, 0.01, kPi) && in(region.yaw_rad, -10.0, 10.0);
  if (!good) return status_ = LostStatus::kBadInput;
  if (!map.ready() || map.size() == 0) return status_ = LostStatus::kNoMap;
  return status_ = take_local(local, pivot_site_m);
}

LostStatus LostSearch::take_local(const LocalMap& local, const Vec2& pivot_site_m) {
  local_.clear();
  Vec2 sum(0.0, 0.0);
  for (const LocalBoulder& b : local) {
    if (!(std::fabs(b.p_site_m.x()) <= 1e7 && std::fabs(b.p_site_m.y()) <= 1e7)) return LostStatus::kBadInput;
    sum += b.p_site_m;
  }
  if (local.size() < 4) return LostStatus::kTooFewBoulders;
  middle_site_m_ = sum / static_cast<double>(local.size());
  pivot_x_ = pivot_site_m.x() - middle_site_m_.x();
  pivot_y_ = pivot_site_m.y() - middle_site_m_.y();
  double spread2 = 0.0;
  double far2 = 0.0;  // from the pivot
  for (const LocalBoulder& b : local) {
    const Vec2 p = b.p_site_m - middle_site_m_;
    spread2 += p.squaredNorm();
    const double r2 = (b.p_site_m - pivot_site_m).squaredNorm();
    far2 = r2 > far2 ? r2 : far2;
    Point point;
    point.x = static_cast<float>(p.x());
    point.y = static_cast<float>(p.y());
    point.size = params_.sigma_size > 0.0 ? b.diameter_m : 0.0F;
    static_cast<void>(local_.push_back(point));
  }
  reach2_ = square(region_.radius_m + std::sqrt(far2));
  // The radius of a disc of boulders that spread as far.
  const double radius = std::sqrt(2.0 * spread2 / static_cast<double>(local.size()));
  min_length_m_ = 0.5 * radius;
  max_length_m_ = 1.2 * radius;
  if (!(min_length_m_ > 4.0 * params_.sigma_pair_m)) return LostStatus::kTooFewBoulders;
  const double half = region_.half_sector_rad;
  const double place = region_.anywhere ? map_->area_m2() : kPi * square(region_.radius_m);
  log_volume_ = ln(place * 2.0 * half);
  const double t = params_.true_share;
  for (int k = 0; k < kShareLevels; ++k) {
    const double q = (k + 0.5) / kShareLevels;
    const double p = t * kHitShare + (1.0 - t) * q;
    const double hit = p > q ? ln(p / q) : 0.0;
    const double miss = p > q ? ln((1.0 - p) / (1.0 - q)) : 0.0;
    hit_[k] = static_cast<std::int16_t>(kScale * hit);
    miss_[k] = static_cast<std::int16_t>(kScale * miss);
    const double chance = -kChanceLooks * (q * hit + (1.0 - q) * miss);
    const double floor = chance > params_.floor_nats ? chance : params_.floor_nats;
    floor_[k] = static_cast<std::int16_t>(-kScale * floor);
  }
  const SinCos sector = sin_cos(wrap_angle(region_.yaw_rad));
  sector_cos_ = sector.cos;
  sector_sin_ = sector.sin;
  sector_edge_ = half + kEdge_rad < kPi ? sin_cos(half + kEdge_rad).cos : -2.0;
  return LostStatus::kRunning;
}

Progress LostSearch::step(WorkBudget& budget) {
  spent_before_ = budget.spent();
  bool on = true;
  while (on && status_ == LostStatus::kRunning) {
    switch (phase_) {
      case Phase::kSizes: on = sizes_step(budget); break;
      case Phase::kChoose: on = choose_step(budget); break;
      case Phase::kSort:
        on = budget.take(sort_ops(local_.size()));
        if (on) take_pair();
        break;
      case Phase::kSweep: on = sweep_step(budget); break;
      case Phase::kLook: on = look_step(budget); break;
      case Phase::kFit: on = fit_step(budget); break;
    }
  }
  account(budget);
  return status_ == LostStatus::kRunning ? Progress::kMore : Progress::kDone;
}

void LostSearch::account(const WorkBudget& budget) {
  ops_ += budget.spent() - spent_before_;
  spent_before_ = budget.spent();
}

// ---- the next local pairs

bool LostSearch::sizes_step(WorkBudget& budget) {
  for (; row_ < local_.size(); ++row_) {
    if (!budget.take(kSizeOps)) return false;
    Point& p = local_[row_];
    const double size = p.size > 0.0F ? ln(static_cast<double>(p.size)) : kNoSize;
    p.size = static_cast<float>(size);
    if (size > kNoSize) p.among_map = static_cast<float>(map_->size_density(size, params_.sigma_size));
  }
  row_ = 0;
  phase_ = Phase::kChoose;
  return true;
}

bool LostSearch::choose_step(WorkBudget& budget) {
  if (row_ == 0) best_cost_ = -1.0;
  for (; row_ < local_.size(); ++row_) {
    if (!budget.take(choose_ops(local_.size() - row_))) return false;
    choose_row(row_);
  }
  row_ = 0;
  if (best_cost_ >= 0.0 && wants_more_pairs()) {
    phase_ = Phase::kSort;
  } else if (!pairs_.empty()) {
    begin_sweep();
  } else {
    conclude();
  }
  return true;
}

/// As many at once as went before, two at least: the first often suffice. All of those that look for rivals.
bool LostSearch::wants_more_pairs() const {
  const int pairs = static_cast<int>(pairs_.size());
  return !pairs_.full() && (pairs < 2 || pairs < pairs_tried_ || passes_yet()) &&
         pairs_tried_ + pairs < params_.max_pairs;
}

void LostSearch::choose_row(std::size_t i) {
  const Point& a = local_[i];
  const double shortest = pairs_.empty() ? min_length_m_ : shortest_m_;
  const double longest = pairs_.empty() ? max_length_m_ : longest_m_;
  for (std::size_t j = i + 1; j < local_.size(); ++j) {
    const Point& b = local_[j];
    const double length2 = square(static_cast<double>(b.x - a.x)) + square(static_cast<double>(b.y - a.y));
    if (length2 < square(shortest) || length2 > square(longest) || was_tried(i, j)) continue;
    // As many map pairs as far apart, for boulders of equal rank: used ones wait.
    const double uses = (1.0 + a.used) * (1.0 + b.used);
    const double wait = passes_yet() && !(a.on_best && b.on_best) ? kOthersWait : 1.0;
    const double cost = wait * length2 * square(uses) * square(rarity(a) * rarity(b));
    if (best_cost_ >= 0.0 && cost >= best_cost_) continue;
    best_cost_ = cost;
    pair_i_ = static_cast<std::uint16_t>(i);
    pair_j_ = static_cast<std::uint16_t>(j);
  }
}

/// Share of boulders that could be this one by size, from the rock law: large ones are rare. 1 without sizes.
double LostSearch::rarity(const Point& p) {
  if (static_cast<double>(p.size) <= kNoSize) return 1.0;
  const double size = static_cast<double>(p.size) + 3.0;  // ln(d / 5 cm)
  return size > 0.0 ? 1.0 / square(1.0 + size) : 1.0;
}

bool LostSearch::was_tried(std::size_t i, std::size_t j) const {
  const std::size_t k = j * (j - 1) / 2 + i;
  return ((tried_[k / 32] >> (k % 32)) & 1U) != 0;
}

/// The one that was chosen goes with those in hand.
void LostSearch::take_pair() {
  Point& a = local_[pair_i_];
  Point& b = local_[pair_j_];
  ++a.used;
  ++b.used;
  const std::size_t k = static_cast<std::size_t>(pair_j_) * (pair_j_ - 1U) / 2 + pair_i_;
  tried_[k / 32] |= 1U << (k % 32);
  Pair pair;
  pair.dx = static_cast<double>(b.x - a.x);
  pair.dy = static_cast<double>(b.y - a.y);
  const double length2 = pair.dx * pair.dx + pair.dy * pair.dy;
  const double length = std::sqrt(length2);
  const double tolerance =
      kLengthSigmas * std::sqrt(2.0 * square(params_.sigma_pair_m) + square(params_.drift * length));
  pair.low2 = length > tolerance ? square(length - tolerance) : 0.0;
  pair.high2 = square(length + tolerance);
  pair.inverse2 = 1.0 / length2;
  pair.on_best = passes_yet() && a.on_best && b.on_best;
  pair.middle_x = 0.5 * static_cast<double>(a.x + b.x);
  pair.middle_y = 0.5 * static_cast<double>(a.y + b.y);
  const Point* const ends[2] = {&a, &b};
  for (int end = 0; end < 2; ++end) {
    const double size = static_cast<double>(ends[end]->size);
    pair.least_m[end] = size > kNoSize ? exp(size - 3.0 * params_.sigma_size) : 0.0;
    pair.most_m[end] = size > kNoSize ? exp(size + 3.0 * params_.sigma_size) : kMostM;
  }
  if (pairs_.empty()) {
    const double band = kBand * length > tolerance ? kBand * length : tolerance;
    shortest_m_ = length - band > min_length_m_ ? length - band : min_length_m_;
    longest_m_ = length + band < max_length_m_ ? length + band : max_length_m_;
  }
  low2_ = pairs_.empty() || pair.low2 < low2_ ? pair.low2 : low2_;
  high2_ = pairs_.empty() || pair.high2 > high2_ ? pair.high2 : high2_;
  sort_looks(pair.middle_x, pair.middle_y);
  pairs_.append(pair);
  phase_ = Phase::kChoose;
}

/// Nearest to the middle of the pair first: an error of the pair turns far ones away.
void LostSearch::sort_looks(double mx, double my) {
  const double units = kUnits / map_->cell_m();
  auto& looks = looks_[pairs_.size()];
  looks.clear();
  for (std::size_t i = 0; i < local_.size(); ++i) {
    if (i == pair_i_ || i == pair_j_) continue;
    const double x = (static_cast<double>(local_[i].x) - mx) * units;
    const double y = (static_cast<double>(local_[i].y) - my) * units;
    if (std::fabs(x) > kFarthest || std::fabs(y) > kFarthest) continue;
    looks.append({static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)});
  }
  heap_sort(looks.data(), static_cast<int>(looks.size()), [](const Look& l, const Look& m) {
    const double nearer = (square(l.x) + square(l.y)) - (square(m.x) + square(m.y));
    return nearer < 0.0 || (nearer == 0.0 && (l.x < m.x || (l.x == m.x && l.y < m.y)));
  });
}

void LostSearch::begin_sweep() {
  lay_ring();
  boulder_ = 0;
  ring_at_ = 0;
  span_at_ = 0;
  ring_begun_ = false;
  best_moved_ = false;
  phase_ = Phase::kSweep;
}

/// Half of it, upwards: the other half is this one seen from the other boulder. Wherever in its bucket the
/// boulder lies, so that a bucket more on each side counts.
void LostSearch::lay_ring() {
  ring_.clear();
  const double c = map_->bucket_m();
  const int reach = static_cast<int>(std::sqrt(high2_) / c) + 1;
  if (reach > 100) return;
  const auto piece = [this](int first, int last, int row) {
    ring_.append(
        {static_cast<std::int8_t>(first), static_cast<std::int8_t>(last), static_cast<std::int8_t>(row)});
  };
  const auto across = [c](double r2, double rows) {
    const double left = r2 - square(c * rows);
    return left > 0.0 ? std::sqrt(left) / c : 0.0;
  };
  for (int y = 0; y <= reach; ++y) {
    const int outer = static_cast<int>(across(high2_, y > 0 ? y - 1.0 : 0.0)) + 1;
    const double hole = across(low2_, y + 1.0) - 1.0;
    const int inner = hole > 0.0 ? static_cast<int>(hole) : 0;
    if (y == 0) {
      if (inner == 0) piece(0, 0, 0);
      piece(inner > 0 ? inner : 1, outer, 0);
    } else if (inner == 0) {
      piece(-outer, outer, y);
    } else {
      piece(-outer, -inner, y);
      piece(inner, outer, y);
    }
  }
}

// ---- the map's pairs

bool LostSearch::sweep_step(WorkBudget& budget) {
  while (boulder_ < map_->size()) {
    if (!budget.take(kBeginOps)) return false;
    if (!ring_begun_) ring_begun_ = begin_boulder();
    if (ring_begun_) budget.charge(sweep_spans());
    if (!ring_begun_ || ring_at_ == ring_.size()) {
      ring_at_ = 0;
      ring_begun_ = false;
      ++boulder_;
    }
    if (!queue_.empty()) {
      queue_at_ = 0;
      phase_ = Phase::kLook;
      return true;
    }
  }
  account(budget);
  end_sweep();
  return true;
}

/// False where this boulder cannot be one of any pair.
bool LostSearch::begin_boulder() {
  const WideMap::Point& a = map_->point(boulder_);
  ax_ = static_cast<double>(a.x_m);
  ay_ = static_cast<double>(a.y_m);
  const double diameter = map_->diameter_m(boulder_);
  as_first_ = as_second_ = 0;
  for (std::uint32_t k = 0; k < pairs_.size(); ++k) {
    as_first_ |= size_agrees(pairs_[k], 0, diameter) ? 1U << k : 0U;
    as_second_ |= size_agrees(pairs_[k], 1, diameter) ? 1U << k : 0U;
  }
  if ((as_first_ | as_second_) == 0) return false;
  if (!region_.anywhere) {
    const Vec2 off = Vec2(ax_, ay_) + map_->origin_map_m() - region_.centre_map_m;
    if (off.squaredNorm() > reach2_) return false;
  }
  column_ = map_->column_of(ax_);
  bucket_row_ = map_->row_of(ay_);
  return true;
}

bool LostSearch::size_agrees(const Pair& pair, int end, double diameter_m) {
  return !(diameter_m > 0.0) || (diameter_m >= pair.least_m[end] && diameter_m <= pair.most_m[end]);
}

/// How much likelier the two sizes are of one boulder than of two of the map's.
double LostSearch::size_ratio(const Point& local, std::uint32_t map_index) const {
  const double d = map_->diameter_m(map_index);
  if (static_cast<double>(local.size) <= kNoSize || !(d > 0.0)) return 1.0;
  const double off = (ln(d) - static_cast<double>(local.size)) / params_.sigma_size;
  const double same = exp(-0.5 * off * off) / (params_.sigma_size * std::sqrt(2.0 * kPi));
  return same / static_cast<double>(local.among_map);
}

/// Boulders of the ring from the cursor on, until kScan of them are seen or the queue may run over; the cost.
std::uint32_t LostSearch::sweep_spans() {
  std::uint32_t seen = 0;
  std::uint32_t spans = 0;
  while (ring_at_ < ring_.size()) {
    const Span& span = ring_[ring_at_];
    const int row = bucket_row_ + span.dy;
    const int column0 = column_ + span.dx0 > 0 ? column_ + span.dx0 : 0;
    const int last = map_->columns() - 1;
    const int column1 = column_ + span.dx1 < last ? column_ + span.dx1 : last;
    ++spans;
    if (row < map_->rows() && column0 <= column1) {
      const std::uint32_t first = map_->first_in(column0, row) + span_at_;
      const std::uint32_t all = map_->end_in(column1, row);
      const std::uint32_t end = all - first > kScan - seen ? first + kScan - seen : all;
      const std::uint32_t stop = scan(first, end, span.dy == 0 && span.dx1 == 0);
      seen += stop - first;
      span_at_ += stop - first;
      if (stop < all) break;
    }
    ++ring_at_;
    span_at_ = 0;
  }
  return kSpanOps * spans + sweep_ops(seen, static_cast<std::uint32_t>(queue_.size()));
}

/// Where it ended: before `end` where the queue may run over. `own`: of the boulder's own bucket, where each
/// two meet twice.
std::uint32_t LostSearch::scan(std::uint32_t first, std::uint32_t end, bool own) {
  for (std::uint32_t k = first; k < end; ++k) {
    if (queue_.size() + kMostOfTwo > kMaxQueue) return k;
    const std::uint32_t b = map_->by_bucket(k);
    const double mx = static_cast<double>(map_->point(b).x_m) - ax_;
    const double my = static_cast<double>(map_->point(b).y_m) - ay_;
    const double length2 = mx * mx + my * my;
    if (length2 < low2_ || length2 > high2_ || (own && b <= boulder_)) continue;
    const double diameter = map_->diameter_m(b);
    for (std::uint32_t p = 0; p < pairs_.size(); ++p) {
      const Pair& pair = pairs_[p];
      if (length2 < pair.low2 || length2 > pair.high2) continue;
      const bool forth = ((as_first_ >> p) & 1U) != 0 && size_agrees(pair, 1, diameter);
      const bool back = ((as_second_ >> p) & 1U) != 0 && size_agrees(pair, 0, diameter);
      if (forth || back) propose(p, mx, my, length2, forth, back);
    }
  }
  return end;
}

void LostSearch::propose(std::uint32_t pair, double mx, double my, double length2, bool forth, bool back) {
  // 1 / (|map pair| |local pair|) without a root: the two are nearly equal.
  const Pair& p = pairs_[pair];
  const double e = 0.5 * (length2 * p.inverse2 - 1.0);
  const double scale = p.inverse2 * (1.0 - e * (1.0 - 1.5 * e));
  const double c = (mx * p.dx + my * p.dy) * scale;
  const double s = (my * p.dx - mx * p.dy) * scale;
  const double inside = c * sector_cos_ + s * sector_sin_;
  const double units = kUnits / map_->cell_m();
  Hypothesis h;
  h.x = static_cast<std::int32_t>((ax_ + 0.5 * mx) * units);
  h.y = static_cast<std::int32_t>((ay_ + 0.5 * my) * units);
  h.cos = static_cast<std::int32_t>(c * kOne);
  h.sin = static_cast<std::int32_t>(s * kOne);
  h.pair = pair;
  if (forth && inside >= sector_edge_) {
    queue_.append(h);
    ++hypotheses_;
  }
  if (!back || -inside < sector_edge_) return;
  h.cos = -h.cos;
  h.sin = -h.sin;
  queue_.append(h);
  ++hypotheses_;
}

void LostSearch::end_sweep() {
  const int pairs = static_cast<int>(pairs_.size());
  pairs_tried_ += pairs;
  // That which found the best has been through the map with the others.
  pairs_since_best_ = best_moved_ ? pairs - 1 : pairs_since_best_ + pairs;
  if (best_moved_) rival_pairs_ = 0;
  for (const Pair& pair : pairs_) rival_pairs_ += pair.on_best && !best_moved_ ? 1 : 0;
  pairs_.clear();
  phase_ = Phase::kChoose;
  if (ops_ >= params_.max_ops || enough()) conclude();
}

bool LostSearch::enough() const {
  if (!passes_yet()) return false;
  if (behind_nats() < params_.margin_nats) return pairs_since_best_ >= kAmbiguousPairs;
  return rival_pairs_ >= kRivalPairs || pairs_since_best_ >= kSincePairs;
}

void LostSearch::conclude() {
  if (!passes_yet()) {
    status_ = LostStatus::kNotFound;
  } else {
    status_ = behind_nats() >= params_.margin_nats ? LostStatus::kFound : LostStatus::kAmbiguous;
  }
}

double LostSearch::behind_nats() const {
  if (hits_.empty()) return 0.0;
  return hits_.size() > 1 ? hits_[0].score_nats - hits_[1].score_nats : hits_[0].score_nats;
}

// ---- the sequential test

bool LostSearch::look_step(WorkBudget& budget) {
  while (queue_at_ < queue_.size()) {
    if (!budget.take(kLookOps)) return false;
    const Hypothesis& h = queue_[queue_at_];
    ++queue_at_;
    std::uint32_t looks = 0;
    const bool passed = passes(h, looks);
    budget.charge(looks_ops(looks));
    if (!passed) continue;
    begin_fit(h);
    phase_ = Phase::kFit;
    return true;
  }
  queue_.clear();
  phase_ = Phase::kSweep;
  return true;
}

bool LostSearch::passes(const Hypothesis& h, std::uint32_t& looks) const {
  const int level = map_->density(h.x / kUnits, h.y / kUnits) * kShareLevels / 65536;
  const int hit = hit_[level];
  const int miss = miss_[level];
  const int floor = floor_[level];
  const int pass = static_cast<int>(kPassNats * kScale);
  const WideMap::Raster raster = map_->raster();
  const Look* const all = looks_[h.pair].begin();
  const std::uint32_t count = static_cast<std::uint32_t>(looks_[h.pair].size());
  const std::int32_t x0 = h.x, y0 = h.y, c = h.cos, s = h.sin;
  int score = 0;
  std::uint32_t k = 0;
  for (; k < count && score >= floor; ++k) {
    const Look l = all[k];
    const std::int32_t x = x0 + ((c * l.x - s * l.y) >> 14);
    const std::int32_t y = y0 + ((s * l.x + c * l.y) >> 14);
    score += raster.occupied(x >> 6, y >> 6) ? hit : miss;
  }
  looks = k;
  return score >= pass;
}

// ---- the fit

void LostSearch::begin_fit(const Hypothesis& h) {
  const double c = static_cast<double>(h.cos) / kOne;
  const double s = static_cast<double>(h.sin) / kOne;
  const double cell = map_->cell_m() / kUnits;
  fit_.yaw = atan2(s, c);
  const Pair& pair = pairs_[h.pair];
  fit_.x = h.x * cell - (c * pair.middle_x - s * pair.middle_y);
  fit_.y = h.y * cell - (s * pair.middle_x + c * pair.middle_y);
  drift_ = params_.drift;
  round_ = 0;
  begin_round();
}

void LostSearch::begin_round() {
  const SinCos r = sin_cos(fit_.yaw);
  fit_cos_ = r.cos;
  fit_sin_ = r.sin;
  fit_at_ = 0;
  fit_pairs_ = 0;
  for (std::uint32_t& word : matched_) word = 0;
  for (double& v : log_sum_) v = 0.0;
  for (double& v : sum_) v = 0.0;
}

bool LostSearch::fit_step(WorkBudget& budget) {
  for (;;) {
    while (fit_at_ < local_.size()) {
      const Place p = place();
      if (!budget.take(fit_ops(boulders_about(p)))) return false;
      take_nearest(p);
      ++fit_at_;
    }
    if (fit_pairs_ < 3) break;
    if (round_ < kRounds) {
      estimate();
      ++round_;
    } else {
      keep();
      if (!without_drift()) break;
    }
    begin_round();
  }
  phase_ = Phase::kLook;
  return true;
}

/// Once more, from where it is, where drift is most of the errors; false where it is not, or was left out.
bool LostSearch::without_drift() {
  if (!(drift_ * max_length_m_ > params_.sigma_pair_m)) return false;
  drift_ = 0.0;
  round_ = 0;
  return true;
}

LostSearch::Place LostSearch::place() const {
  const double lx = static_cast<double>(local_[fit_at_].x);
  const double ly = static_cast<double>(local_[fit_at_].y);
  Place p{};
  p.x = fit_cos_ * lx - fit_sin_ * ly + fit_.x;
  p.y = fit_sin_ * lx + fit_cos_ * ly + fit_.y;
  p.variance = square(params_.sigma_pair_m) + square(drift_) * (lx * lx + ly * ly);
  p.gate = kGates[round_] * std::sqrt(p.variance);
  p.column0 = map_->column_of(p.x - p.gate);
  p.column1 = map_->column_of(p.x + p.gate);
  p.row0 = map_->row_of(p.y - p.gate);
  p.row1 = map_->row_of(p.y + p.gate);
  return p;
}

std::uint32_t LostSearch::boulders_about(const Place& p) const {
  std::uint32_t count = 0;
  for (int row = p.row0; row <= p.row1; ++row) {
    for (int column = p.column0; column <= p.column1; ++column)
      count += map_->end_in(column, row) - map_->first_in(column, row);
  }
  return count < kMostAbout ? count : kMostAbout;
}

void LostSearch::take_nearest(const Place& p) {
  double best2 = p.gate * p.gate;
  double best_x = 0.0;
  double best_y = 0.0;
  double likelihood = 0.0;
  bool found = false;
  std::uint32_t left = kMostAbout;
  for (int row = p.row0; row <= p.row1; ++row) {
    for (int column = p.column0; column <= p.column1; ++column) {
      const std::uint32_t end = map_->end_in(column, row);
      for (std::uint32_t k = map_->first_in(column, row); k < end && left > 0; ++k, --left) {
        const WideMap::Point& m = map_->point(map_->by_bucket(k));
        const double mx = static_cast<double>(m.x_m);
        const double my = static_cast<double>(m.y_m);
        const double r2 = square(mx - p.x) + square(my - p.y);
        if (r2 > p.gate * p.gate) continue;
        if (round_ == kRounds) {
          likelihood += exp(-0.5 * r2 / p.variance) / (2.0 * kPi * p.variance) *
                        size_ratio(local_[fit_at_], map_->by_bucket(k));
        }
        if (r2 > best2) continue;
        best2 = r2;
        best_x = mx;
        best_y = my;
        found = true;
      }
    }
  }
  if (round_ == kRounds) score(p, likelihood);
  if (!found) return;
  ++fit_pairs_;
  matched_[fit_at_ / 32] |= 1U << (fit_at_ % 32);
  const double w = 1.0 / p.variance;
  const double lx = static_cast<double>(local_[fit_at_].x);
  const double ly = static_cast<double>(local_[fit_at_].y);
  const double terms[8] = {w,
                           w * lx,
                           w * ly,
                           w * best_x,
                           w * best_y,
                           w * (lx * best_x + ly * best_y),
                           w * (lx * best_y - ly * best_x),
                           w * (lx * lx + ly * ly)};
  for (int k = 0; k < 8; ++k) sum_[k] += terms[k];
}

void LostSearch::score(const Place& place, double likelihood) {
  const auto cell = [&](double at) { return static_cast<std::int32_t>(at / map_->cell_m()); };
  const double q = map_->density(cell(place.x), cell(place.y)) / 65536.0;
  const double lambda = -ln(1.0 - q) / map_->spread_of_boulder_m2();
  for (std::size_t k = 0; k < kShares; ++k) {
    log_sum_[k] += ln((1.0 - kShare[k]) + kShare[k] / lambda * likelihood);
  }
}

/// The rigid motion that fits the pairs best (Umeyama 1991, in the plane).
void LostSearch::estimate() {
  const double w = sum_[0];
  const double lx = sum_[1] / w;
  const double ly = sum_[2] / w;
  const double mx = sum_[3] / w;
  const double my = sum_[4] / w;
  const double dot = sum_[5] - w * (lx * mx + ly * my);
  const double cross = sum_[6] - w * (lx * my - ly * mx);
  fit_.yaw = atan2(cross, dot);
  const SinCos r = sin_cos(fit_.yaw);
  fit_.x = mx - (r.cos * lx - r.sin * ly);
  fit_.y = my - (r.sin * lx + r.cos * ly);
}

/// Of the likelihood ratios over the shares, each as likely as the others.
double LostSearch::log_of_mean() const {
  double top = log_sum_[0];
  for (const double v : log_sum_) top = v > top ? v : top;
  double sum = 0.0;
  for (const double v : log_sum_) sum += exp(v - top);
  return top + ln(sum / static_cast<double>(kShares));
}

void LostSearch::keep() {
  // Information on x, y, yaw of the pairs; det C = 1 / det of it.
  const double w = sum_[0];
  const double lever2 = sum_[7] - (sum_[1] * sum_[1] + sum_[2] * sum_[2]) / w;
  if (!(lever2 > 0.0)) return;
  const SinCos r = sin_cos(fit_.yaw);
  SearchHit hit;
  hit.score_nats = log_of_mean() + 1.5 * ln(2.0 * kPi) - 0.5 * ln(w * w * lever2) - log_volume_;
  hit.pairs = fit_pairs_;
  // T_map_site carries the middle of the local map to where it was fitted.
  const Vec2 m = middle_site_m_;
  hit.T_map_site = {fit_.x + map_->origin_map_m().x() - (r.cos * m.x() - r.sin * m.y()),
                    fit_.y + map_->origin_map_m().y() - (r.sin * m.x() + r.cos * m.y()), fit_.yaw};
  if (!near_region()) return;
  // In the place of the same pose, if that is worse; else in its order.
  const auto position = [&](const SearchHit& h) -> Vec2 { return h.T_map_site * m; };
  const Vec2 here = position(hit);
  for (std::size_t i = 0; i < hits_.size(); ++i) {
    const bool same = (position(hits_[i]) - here).squaredNorm() < kSameM * kSameM &&
                      std::fabs(wrap_angle(hits_[i].T_map_site.yaw_rad - hit.T_map_site.yaw_rad)) < kSameRad;
    if (!same) continue;
    if (hits_[i].score_nats >= hit.score_nats) return;
    for (std::size_t k = i + 1; k < hits_.size(); ++k) hits_[k - 1] = hits_[k];
    hits_.resize(hits_.size() - 1);
    --i;
  }
  std::size_t at = hits_.size();
  while (at > 0 && hits_[at - 1].score_nats < hit.score_nats) --at;
  if (at == kHits) return;
  if (at == 0) {
    const bool moved = hits_.empty() || (position(hits_[0]) - here).squaredNorm() >= kSameM * kSameM;
    best_moved_ = best_moved_ || moved;
    mark_best();
  }
  if (hits_.full()) hits_.resize(kHits - 1);
  static_cast<void>(hits_.push_back(hit));
  for (std::size_t k = hits_.size() - 1; k > at; --k) hits_[k] = hits_[k - 1];
  hits_[at] = hit;
}

void LostSearch::mark_best() {
  for (std::size_t i = 0; i < local_.size(); ++i)
    local_[i].on_best = ((matched_[i / 32] >> (i % 32)) & 1U) != 0;
}

bool LostSearch::near_region() const {
  const SinCos r = sin_cos(fit_.yaw);
  if (r.cos * sector_cos_ + r.sin * sector_sin_ < sector_edge_) return false;
  if (region_.anywhere) return true;
  const Vec2 pivot =
      Vec2(fit_.x + r.cos * pivot_x_ - r.sin * pivot_y_, fit_.y + r.sin * pivot_x_ + r.cos * pivot_y_) +
      map_->origin_map_m();
  return (pivot - region_.centre_map_m).squaredNorm() <= square(region_.radius_m + kEdge_m);
}

}  // namespace cairn
