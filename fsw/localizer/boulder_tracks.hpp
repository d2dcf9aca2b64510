/// Boulders over time: the ground boulders of the last frames, in `site`, and the local map made of them
/// (METHOD section C).
///
/// A sighting goes on the track of the sighting that the vote names. Without one it joins a track within
/// `merge_m` that this frame has not seen yet, or starts a track. A track's position is the weighted mean of
/// its sightings, with weight 1 / (s0^2 + (s1 range^2)^2): stereo depth worsens with the square of the range.
/// The local map holds the tracks seen within the last `window_frames` frames and often enough; tracks that
/// meanwhile lie within `merge_m` of each other become one boulder (agglomerative, METHOD B.2),
/// the older number staying.
///
/// Room. Where a frame's sightings may not all find room, tracks go before they leave the window: first those
/// that are not shown yet, longest unseen first, then others likewise. What was in view a frame ago stays.
///
/// Jumps. What was in view a frame ago is in view still: of the sightings of a frame a share q, measured
/// over the frames before, go on tracks that were there. After a motion that odometry missed they lie aside
/// of these, and no more than kByChance find one. With a of n sightings on older tracks, n no more than were
/// seen a frame ago (where a view that is seen better shows more, the old are there as well),
///     jump_log = a ln(kByChance / q) + (n - a) ln((1 - kByChance) / (1 - q))
/// is the log likelihood ratio of 'missed a motion' against 'as ever'. Sightings of a frame hang together: a
/// picture that shows less shows less of all. With r the correlation between two of them, measured as q is,
/// the variance of a is n q (1 - q) (1 + (n - 1) r), and jump_log is divided by the last factor; q is
/// kMostAgain at most. Not asked where fewer than half as many tracks were seen the frame before. A few
/// boulders in view can't say enough at once: where it is more than half of what is asked, up to kSuspected
/// frames after it add theirs, of sightings on tracks that are older than the first of them. What was
/// overlooked is there again; after a motion that was missed it isn't. Sightings without room don't count.
/// Odometry has a say as well: after a motion that it missed its matches are few. Where a frame has kAsEver
/// of the inliers of those before, kAgainst times as much is asked.
///
/// Source: the last factor is the design effect of a sample in clusters (Kish 1965, chapter 5).
#pragma once

#include <cstdint>

#include "geometry/boulder.hpp"
#include "localizer/boulder_observer.hpp"

namespace cairn {

struct TrackParams {
  int window_frames = cfg::kMission.local_map_frames;
  int min_sightings = 3;
  double merge_m = 0.08;
  double min_diameter_m = cfg::kMission.boulder_min_diameter_m;
  double sigma_near_m = 0.02;      ///< s0
  double sigma_per_range2 = 0.01;  ///< s1, per metre
  double jump_nats = 9.2;          ///< of jump_log from which on odometry is not believed: 10,000 to 1
};

/// Of a local map, the share that no fix has used whose snapshot was taken when `created` tracks had been
/// created: boulders seen for the first time since. At least that of half a boulder: places settle.
double fresh_share(const LocalMap& local, std::uint32_t created);

class BoulderTracks {
 public:
  static constexpr std::uint32_t voted_ops(std::size_t tracks, std::size_t sightings) {
    return static_cast<std::uint32_t>(50U + 4U * tracks + 14U * sightings);
  }
  static constexpr std::uint32_t room_ops(std::size_t tracks, std::size_t sightings) {
    return static_cast<std::uint32_t>(300U + 6U * tracks + 14U * sightings);
  }
  static constexpr std::uint32_t nearest_ops(std::size_t tracks) {
    return static_cast<std::uint32_t>(20U + 3U * tracks);
  }
  static constexpr std::uint32_t settle_ops(std::size_t tracks) {
    return static_cast<std::uint32_t>(10U + 3U * tracks);
  }
  void init(const TrackParams& params);
  /// Takes in the sightings (borrowed until done) of frame number `frame` (rising), and forgets tracks that
  /// left the window. `inliers`: of odometry's motion to this frame; 0: not known.
  void start(const BoulderSightings& sightings, std::uint32_t frame, int inliers = 0);
  /// Unit: what the votes name, room made for them, or the nearest track of one sighting.
  Progress step(WorkBudget& budget);
  /// Ends an unfinished frame: what was not taken in is lost, and so are votes for it.
  void abandon();
  /// Forgets tracks that left the window by frame `frame`: for frames without sightings, before build().
  void forget(std::uint32_t frame);
  /// Forgets all: from here on `site` is not what it was. Numbers go on.
  void forget_all();
  /// Forgets tracks last seen before `frame`, which is not later than the last one.
  void forget_before(std::uint32_t frame);
  /// Merges tracks that lie close together, for good. Unit: one track against those after it.
  Progress settle(WorkBudget& budget);
  /// The local map, in the order of the tracks' numbers, settled.
  void build(LocalMap& out);
  /// What the last frame says, once taken in, with those suspected before it; 0 where the frame before was
  /// not, or there is no share yet.
  double jump_log() const { return jump_log_; }
  bool jumped() const { return jump_log_ > asked_nats_; }
  std::uint32_t dropped() const { return dropped_; }  ///< sightings without room for a track
  std::uint32_t created() const { return next_id_; }

 private:
  struct Track {
    Vec3 p_site_m = Vec3(0.0, 0.0, 0.0);
    double weight = 0.0;
    double diameter_m = 0.0;
    double spread_m = 0.0;
    std::uint32_t id = 0;
    std::uint32_t last_frame = 0;
    std::uint16_t sightings = 0;
  };
  static constexpr std::int16_t kNone = -1;
  static constexpr double kByChance = 0.25;
  static constexpr double kMostAgain = 0.9;
  static constexpr double kLeastShared = 20.0;  ///< sightings that the share is taken from
  static constexpr double kShareKept = 0.9;     ///< of their weight, a frame
  static constexpr double kScatterKept = 0.98;  ///< likewise, of how the share scatters
  static constexpr double kTogether = 0.05;     ///< r until it is measured: on the rockiest ground
  static constexpr double kPriorPairs = 200.0;  ///< what that is worth
  static constexpr double kMostTogether = 0.2;
  static constexpr std::uint32_t kSuspected = 2;
  static constexpr double kAsEver = 0.75;
  static constexpr double kAgainst = 2.0;
  static constexpr std::uint32_t kAges = 64;  ///< frames unseen that are told apart
  enum class Phase : std::uint8_t { kVoted, kRoom, kNearest, kDone };

  std::int16_t voted_track(const BoulderSighting& sighting, std::uint32_t frame) const;
  std::int16_t nearest_track(const BoulderSighting& sighting, std::uint32_t frame) const;
  void take(const BoulderSighting& sighting, std::int16_t index, std::uint32_t frame);
  static void absorb(Track& track, const Vec3& p, double weight, double diameter, double spread);
  void forget_older(std::uint32_t frame, std::uint32_t age);
  template <typename Gone>
  void forget_if(const Gone& gone);
  bool shown(const Track& track) const {
    return track.sightings >= params_.min_sightings && !(track.diameter_m < params_.min_diameter_m);
  }
  std::uint32_t rank(const Track& track) const;  ///< the highest goes first; 0 stays
  void make_room(std::size_t wanted);
  void take_voted();
  void take_nearest(std::size_t sighting);
  void weigh_jump();
  void weigh_odometry(int inliers);
  double together() const;                      ///< r
  std::uint32_t merge_into(std::size_t track);  ///< returns how many
  void remove(std::size_t index);

  TrackParams params_;
  FixedVector<Track, cfg::kMaxLocalBoulders> tracks_;
  Phase phase_ = Phase::kDone;
  const BoulderSightings* sightings_ = nullptr;
  std::uint32_t frame_ = 0;
  std::size_t cursor_ = 0;                         ///< sighting
  bool settled_ = false;                           ///< no tracks are left to be merged
  bool merged_ = false;                            ///< some were in this pass
  std::size_t settling_ = 0;                       ///< track
  std::int16_t last_track_[cfg::kMaxLabels] = {};  ///< track of each sighting of the last frame
  std::size_t last_count_ = 0;
  std::uint32_t next_id_ = 0;
  std::uint32_t dropped_ = 0;
  std::uint32_t there_ = 0;      ///< tracks that were seen in the frame before
  std::uint32_t again_ = 0;      ///< sightings of this frame on tracks of frames before
  std::uint32_t placed_ = 0;     ///< sightings of this frame that are on a track
  std::uint32_t known_ = 0;      ///< these: created before this frame, or the first that is suspected
  std::uint32_t suspected_ = 0;  ///< frames in a row
  double shared_ = 0.0;          ///< sightings of the frames before, fading, ...
  double shared_again_ = 0.0;
  double scatter_ = 0.0;  ///< variance of the share over that at random, less one: sum, fading, ...
  double scatter_pairs_ = 0.0;
  double jump_log_ = 0.0;
  double asked_nats_ = 0.0;  ///< of it, for a jump
  double inliers_ = 0.0;     ///< of the frames before: sum, fading, ...
  double inlier_frames_ = 0.0;
};

}  // namespace cairn
