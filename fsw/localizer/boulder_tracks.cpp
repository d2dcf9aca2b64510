#include "localizer/boulder_tracks.hpp"

#include "core/arithmetic.hpp"
#include "core/exp_log.hpp"

namespace cairn {

double fresh_share(const LocalMap& local, std::uint32_t created) {
  if (local.empty()) return 1.0;
  double fresh = 0.0;
  for (const LocalBoulder& b : local) fresh += b.id >= created ? 1.0 : 0.0;
  return (fresh > 0.5 ? fresh : 0.5) / static_cast<double>(local.size());
}

void BoulderTracks::init(const TrackParams& params) {
  params_ = params;
  tracks_.clear();
  abandon();
  last_count_ = 0;
  settled_ = merged_ = false;
  settling_ = 0;
  next_id_ = dropped_ = 0;
  there_ = again_ = placed_ = known_ = suspected_ = 0;
  shared_ = shared_again_ = scatter_ = scatter_pairs_ = jump_log_ = 0.0;
  asked_nats_ = params.jump_nats;
  inliers_ = inlier_frames_ = 0.0;
}

void BoulderTracks::start(const BoulderSightings& sightings, std::uint32_t frame, int inliers) {
  sightings_ = &sightings;
  there_ = again_ = placed_ = 0;
  for (const Track& t : tracks_) there_ += t.last_frame == frame_ && frame - frame_ == 1 ? 1U : 0U;
  frame_ = frame;
  if (suspected_ == 0) {
    known_ = next_id_;
    jump_log_ = 0.0;
  }
  weigh_odometry(inliers);
  cursor_ = 0;
  phase_ = Phase::kVoted;
}

void BoulderTracks::weigh_odometry(int inliers) {
  const bool as_ever =
      inlier_frames_ >= 1.0 && static_cast<double>(inliers) * inlier_frames_ >= kAsEver * inliers_;
  asked_nats_ = (as_ever ? kAgainst : 1.0) * params_.jump_nats;
  if (inliers == 0) return;
  inliers_ = kShareKept * inliers_ + static_cast<double>(inliers);
  inlier_frames_ = kShareKept * inlier_frames_ + 1.0;
}

Progress BoulderTracks::step(WorkBudget& budget) {
  if (phase_ == Phase::kVoted) {
    if (!budget.take(voted_ops(tracks_.size(), sightings_->size()))) return Progress::kMore;
    forget(frame_);
    const bool fits = tracks_.size() + sightings_->size() <= cfg::kMaxLocalBoulders;
    if (fits) take_voted();
    phase_ = fits ? Phase::kNearest : Phase::kRoom;
  }
  if (phase_ == Phase::kRoom) {
    if (!budget.take(room_ops(tracks_.size(), sightings_->size()))) return Progress::kMore;
    make_room(sightings_->size());
    take_voted();
    phase_ = Phase::kNearest;
  }
  for (; phase_ == Phase::kNearest && cursor_ < last_count_; ++cursor_) {
    if (last_track_[cursor_] != kNone) continue;
    if (!budget.take(nearest_ops(tracks_.size()))) return Progress::kMore;
    take_nearest(cursor_);
  }
  if (phase_ == Phase::kNearest) weigh_jump();
  phase_ = Phase::kDone;
  return Progress::kDone;
}

void BoulderTracks::abandon() {
  if (phase_ == Phase::kVoted || phase_ == Phase::kRoom) last_count_ = 0;
  phase_ = Phase::kDone;
}

/// Votes first: a sighting without one must not take the track that a vote names.
void BoulderTracks::take_voted() {
  settled_ = false;
  settling_ = 0;
  merged_ = false;
  const BoulderSightings& sightings = *sightings_;
  std::int16_t now[cfg::kMaxLabels] = {};
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    now[i] = voted_track(sightings[i], frame_);
    if (now[i] == kNone) continue;
    take(sightings[i], now[i], frame_);
    again_ += tracks_[static_cast<std::size_t>(now[i])].id < known_ ? 1U : 0U;
  }
  last_count_ = sightings.size();
  for (std::size_t i = 0; i < last_count_; ++i) last_track_[i] = now[i];
}

void BoulderTracks::take_nearest(std::size_t sighting) {
  const BoulderSighting& seen = (*sightings_)[sighting];
  std::int16_t& track = last_track_[sighting];
  track = nearest_track(seen, frame_);
  if (track != kNone) {
    again_ += tracks_[static_cast<std::size_t>(track)].id < known_ ? 1U : 0U;
  } else {
    Track fresh;
    fresh.id = next_id_;
    if (!tracks_.push_back(fresh)) {
      ++dropped_;
      return;
    }
    ++next_id_;
    track = static_cast<std::int16_t>(tracks_.size() - 1);
  }
  take(seen, track, frame_);
}

void BoulderTracks::weigh_jump() {
  const std::uint32_t before = suspected_;
  suspected_ = 0;
  if (2 * there_ < last_count_) {
    jump_log_ = 0.0;
    return;
  }
  const std::uint32_t asked = placed_ < there_ ? placed_ : there_;
  const auto n = static_cast<double>(asked);
  const auto again = static_cast<double>(again_ < asked ? again_ : asked);
  double q = (shared_again_ + 1.0) / (shared_ + 2.0);
  q = q < kMostAgain ? q : kMostAgain;
  const bool measured = shared_ >= kLeastShared && n > 1.0;
  if (shared_ >= kLeastShared && q > kByChance) {
    const double log = again * ln(kByChance / q) + (n - again) * ln((1.0 - kByChance) / (1.0 - q));
    jump_log_ += log / (1.0 + positive(n - 1.0) * together());
  }
  if (jumped()) return;  // tells nothing of the share
  if (jump_log_ > 0.5 * asked_nats_ && before < kSuspected) suspected_ = before + 1;
  if (before > 0) return;  // boulders that came into view since are no misses
  if (measured) {
    scatter_ = kScatterKept * scatter_ + square(again - n * q) / (n * q * (1.0 - q)) - 1.0;
    scatter_pairs_ = kScatterKept * scatter_pairs_ + n - 1.0;
  }
  shared_ = kShareKept * shared_ + n;
  shared_again_ = kShareKept * shared_again_ + again;
}

double BoulderTracks::together() const {
  const double r = (scatter_ + kTogether * kPriorPairs) / (scatter_pairs_ + kPriorPairs);
  return r > kMostTogether ? kMostTogether : positive(r);
}

std::int16_t BoulderTracks::voted_track(const BoulderSighting& sighting, std::uint32_t frame) const {
  if (sighting.previous == 0 || sighting.previous > last_count_) return kNone;
  const std::int16_t voted = last_track_[sighting.previous - 1];
  if (voted == kNone || tracks_[static_cast<std::size_t>(voted)].last_frame == frame) return kNone;
  return voted;
}

std::int16_t BoulderTracks::nearest_track(const BoulderSighting& sighting, std::uint32_t frame) const {
  std::int16_t best = kNone;
  double best2 = params_.merge_m * params_.merge_m;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (tracks_[i].last_frame == frame) continue;
    const double dx = tracks_[i].p_site_m.x() - sighting.p_site_m.x();
    const double dy = tracks_[i].p_site_m.y() - sighting.p_site_m.y();
    if (dx * dx + dy * dy < best2) {
      best2 = dx * dx + dy * dy;
      best = static_cast<std::int16_t>(i);
    }
  }
  return best;
}

void BoulderTracks::take(const BoulderSighting& s, std::int16_t index, std::uint32_t frame) {
  Track& track = tracks_[static_cast<std::size_t>(index)];
  const double far =
      params_.sigma_per_range2 * static_cast<double>(s.range_m) * static_cast<double>(s.range_m);
  const double weight = 1.0 / (params_.sigma_near_m * params_.sigma_near_m + far * far);
  absorb(track, s.p_site_m, weight, static_cast<double>(s.diameter_m), static_cast<double>(s.spread_m));
  track.last_frame = frame;
  if (track.sightings < UINT16_MAX) ++track.sightings;
  ++placed_;
}

void BoulderTracks::absorb(Track& track, const Vec3& p, double weight, double diameter, double spread) {
  const double total = track.weight + weight;
  const double share = weight / total;
  track.p_site_m += (p - track.p_site_m) * share;
  track.diameter_m += (diameter - track.diameter_m) * share;
  track.spread_m += (spread - track.spread_m) * share;
  track.weight = total;
}

void BoulderTracks::forget(std::uint32_t frame) {
  forget_older(frame, static_cast<std::uint32_t>(params_.window_frames));
}

void BoulderTracks::forget_before(std::uint32_t frame) { forget_older(frame_, frame_ - frame); }

/// Frame numbers may wrap.
void BoulderTracks::forget_older(std::uint32_t frame, std::uint32_t age) {
  forget_if([&](const Track& t) { return frame - t.last_frame > age; });
}

template <typename Gone>
void BoulderTracks::forget_if(const Gone& gone) {
  std::int16_t place[cfg::kMaxLocalBoulders] = {};
  std::size_t kept = 0;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    place[i] = kNone;
    if (gone(tracks_[i])) continue;
    place[i] = static_cast<std::int16_t>(kept);
    if (kept != i) tracks_[kept] = tracks_[i];
    ++kept;
  }
  if (kept == tracks_.size()) return;
  tracks_.resize(kept);
  settled_ = false;
  settling_ = 0;
  merged_ = false;
  for (std::size_t k = 0; k < last_count_; ++k) {
    if (last_track_[k] != kNone) last_track_[k] = place[last_track_[k]];
  }
}

std::uint32_t BoulderTracks::rank(const Track& track) const {
  const std::uint32_t unseen = frame_ - track.last_frame;
  if (unseen <= 1) return 0;
  const std::uint32_t age = unseen < kAges ? unseen : kAges - 1;
  return shown(track) ? age : age + kAges;
}

void BoulderTracks::make_room(std::size_t wanted) {
  std::uint16_t count[2 * kAges] = {};
  for (const Track& t : tracks_) ++count[rank(t)];
  std::size_t excess = tracks_.size() + wanted - cfg::kMaxLocalBoulders;
  std::uint32_t all_from = 2 * kAges;  // of this rank and higher ones all go, of the one below `excess`
  while (all_from > 1 && count[all_from - 1] <= excess) excess -= count[--all_from];
  forget_if([&](const Track& t) {
    const std::uint32_t r = rank(t);
    if (r == 0 || r + 1 < all_from) return false;
    if (r >= all_from) return true;
    return excess > 0 && excess-- > 0;
  });
}

void BoulderTracks::forget_all() {
  tracks_.clear();
  settling_ = 0;
  last_count_ = 0;
}

void BoulderTracks::remove(std::size_t index) {
  for (std::size_t i = index; i + 1 < tracks_.size(); ++i) tracks_[i] = tracks_[i + 1];
  tracks_.resize(tracks_.size() - 1);
  for (std::size_t k = 0; k < last_count_; ++k) {
    const auto gone = static_cast<std::int16_t>(index);
    if (last_track_[k] == gone) {
      last_track_[k] = kNone;
    } else if (last_track_[k] > gone) {
      --last_track_[k];
    }
  }
}

std::uint32_t BoulderTracks::merge_into(std::size_t i) {
  const double merge2 = params_.merge_m * params_.merge_m;
  const std::size_t before = tracks_.size();
  for (std::size_t j = tracks_.size(); j-- > i + 1;) {
    const double dx = tracks_[i].p_site_m.x() - tracks_[j].p_site_m.x();
    const double dy = tracks_[i].p_site_m.y() - tracks_[j].p_site_m.y();
    if (dx * dx + dy * dy >= merge2) continue;
    Track& kept = tracks_[i];
    const Track gone = tracks_[j];
    absorb(kept, gone.p_site_m, gone.weight, gone.diameter_m, gone.spread_m);
    kept.sightings = static_cast<std::uint16_t>(
        kept.sightings + gone.sightings < UINT16_MAX ? kept.sightings + gone.sightings : UINT16_MAX);
    if (gone.last_frame > kept.last_frame) kept.last_frame = gone.last_frame;
    for (std::size_t k = 0; k < last_count_; ++k) {
      if (last_track_[k] == static_cast<std::int16_t>(j)) last_track_[k] = static_cast<std::int16_t>(i);
    }
    remove(j);
  }
  return static_cast<std::uint32_t>(before - tracks_.size());
}

/// Passes over all pairs: tracks that were merged have moved, and others may lie close to them now.
Progress BoulderTracks::settle(WorkBudget& budget) {
  while (!settled_) {
    if (settling_ >= tracks_.size()) {
      settled_ = !merged_;
      merged_ = false;
      settling_ = 0;
      continue;
    }
    if (!budget.take(settle_ops(tracks_.size() - settling_))) return Progress::kMore;
    const std::uint32_t gone = merge_into(settling_++);
    budget.charge(gone * (2U * tracks_.size() + cfg::kMaxLabels));
    merged_ = merged_ || gone > 0;
  }
  return Progress::kDone;
}

void BoulderTracks::build(LocalMap& out) {
  WorkBudget all = WorkBudget::unlimited();
  const Progress settled = settle(all);
  CAIRN_ASSERT(settled == Progress::kDone);
  out.clear();
  for (const Track& t : tracks_) {
    if (!shown(t)) continue;
    LocalBoulder b;
    b.p_site_m = Vec2(t.p_site_m.x(), t.p_site_m.y());
    b.z_site_m = t.p_site_m.z();
    b.diameter_m = static_cast<float>(t.diameter_m);
    b.spread_m = static_cast<float>(t.spread_m);
    b.id = t.id;
    b.sightings = t.sightings;
    b.in_view = t.last_frame == frame_;
    out.append(b);
  }
}

}  // namespace cairn
