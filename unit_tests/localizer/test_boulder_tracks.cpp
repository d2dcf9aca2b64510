// Boulders over time: which sighting goes on which track, what is forgotten, merged and shown.
#include "localizer/boulder_tracks.hpp"

#include <vector>

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

BoulderTracks tracks;
LocalMap map;
BoulderSightings seen;

void take_in(BoulderTracks& job, const BoulderSightings& sightings, std::uint32_t frame, int inliers = 0) {
  job.start(sightings, frame, inliers);
  WorkBudget all = WorkBudget::unlimited();
  assert_status(job.step(all), Progress::kDone);
}

struct At {
  double x;
  double y;
  int previous = 0;
  double range = 1.0;
  double diameter = 0.2;
  double spread = 0.04;
};

void update(std::initializer_list<At> sightings, std::uint32_t frame) {
  seen.clear();
  for (const At& a : sightings) {
    BoulderSighting s;
    s.p_site_m = Vec3(a.x, a.y, 0.05);
    s.range_m = static_cast<float>(a.range);
    s.diameter_m = static_cast<float>(a.diameter);
    s.spread_m = static_cast<float>(a.spread);
    s.previous = static_cast<std::uint8_t>(a.previous);
    assert_true(seen.push_back(s));
  }
  take_in(tracks, seen, frame);
}

/// Everything is shown, so that tests see every track.
TrackParams show_all() {
  TrackParams p;
  p.min_sightings = 1;
  p.min_diameter_m = 0.0;
  return p;
}

void build() { tracks.build(map); }

void test_vote_is_followed_beyond_the_merge_distance(void**) {
  tracks.init(show_all());
  update({{1.0, 0.0}, {2.0, 0.0}}, 1);
  update({{2.3, 0.0, 2}, {1.4, 0.0, 1}}, 2);
  build();
  assert_int_equal(map.size(), 2);
  assert_near(map[0].p_site_m.x(), 1.2, 1e-12);
  assert_near(map[1].p_site_m.x(), 2.15, 1e-12);
  assert_int_equal(map[0].sightings, 2);
  assert_int_equal(tracks.created(), 2);
}

/// A sighting without a vote that comes first must not take the track that another one was voted to.
void test_vote_goes_before_distance(void**) {
  tracks.init(show_all());
  update({{1.0, 0.0}}, 1);
  update({{1.05, 0.0}, {1.3, 0.0, 1}}, 2);
  build();
  assert_int_equal(map.size(), 2);
  assert_near(map[0].p_site_m.x(), 1.15, 1e-12);
  assert_int_equal(map[0].sightings, 2);
  assert_near(map[1].p_site_m.x(), 1.05, 1e-12);
}

void test_without_vote_the_nearest_within_the_distance(void**) {
  const TrackParams p = show_all();
  tracks.init(p);
  update({{1.0, 0.0}, {1.1, 0.0}}, 1);
  update({{1.07, 0.0}}, 2);
  update({{1.0, p.merge_m - 1e-6}}, 3);
  update({{1.0, -p.merge_m - 0.1}}, 4);
  assert_int_equal(tracks.created(), 3);
  build();
  assert_int_equal(map.size(), 3);
  assert_near(map[1].p_site_m.x(), 1.085, 1e-12);
  assert_int_equal(map[0].sightings, 2);
  assert_int_equal(map[1].sightings, 2);
  assert_int_equal(map[2].sightings, 1);
}

/// Of two within the distance the nearer, whichever is the older.
void test_the_nearer_of_two(void**) {
  for (const double x : {1.03, 1.07}) {
    tracks.init(show_all());
    update({{1.0, 0.0}, {1.1, 0.0}}, 1);
    update({{x, 0.0}}, 2);
    build();
    assert_int_equal(map.size(), 2);
    assert_int_equal(map[0].sightings, x < 1.05 ? 2 : 1);
    assert_int_equal(map[1].sightings, x < 1.05 ? 1 : 2);
  }
}

/// Two sightings of one frame are two boulders, however close, until the map is built.
void test_a_track_takes_one_sighting_a_frame(void**) {
  tracks.init(show_all());
  update({{1.0, 0.0}, {1.01, 0.0}, {1.02, 0.0}}, 1);
  assert_int_equal(tracks.created(), 3);
  update({{1.0, 0.0, 1}, {1.01, 0.0, 1}}, 2);  // both name the same one
  assert_int_equal(tracks.created(), 3);
  tracks.init(show_all());
  update({{1.0, 0.0}}, 1);
  update({{1.0, 0.0, 1}, {1.3, 0.0, 1}}, 2);  // and there is no other near
  assert_int_equal(tracks.created(), 2);
}

void test_weights_fall_with_range(void**) {
  TrackParams p = show_all();
  p.sigma_near_m = 0.02;
  p.sigma_per_range2 = 0.01;
  tracks.init(p);
  update({{1.0, 0.0, 0, 2.0, 0.3, 0.06}}, 1);
  update({{1.06, 0.0, 1, 1.0, 0.2, 0.05}}, 2);
  build();
  const double far = 1.0 / (0.02 * 0.02 + 0.04 * 0.04);
  const double near = 1.0 / (0.02 * 0.02 + 0.01 * 0.01);
  assert_near(map[0].p_site_m.x(), (far * 1.0 + near * 1.06) / (far + near), 1e-12);
  assert_near(map[0].diameter_m, (far * 0.3 + near * 0.2) / (far + near), 1e-6);
  assert_near(map[0].spread_m, (far * 0.06 + near * 0.05) / (far + near), 1e-6);
  assert_near(map[0].z_site_m, 0.05, 1e-12);
  // One boulder with two numbers: where they are merged it lies where it would with one.
  const Vec2 with_one = map[0].p_site_m;
  tracks.init(p);
  update({{1.0, 0.0, 0, 2.0}, {1.06, 0.0, 0, 1.0}}, 1);
  build();
  assert_int_equal(map.size(), 1);
  assert_near((map[0].p_site_m - with_one).norm(), 0.0, 1e-12);
}

void test_window(void**) {
  TrackParams p = show_all();
  p.window_frames = 10;
  tracks.init(p);
  update({{1.0, 0.0}, {2.0, 0.0}}, 100);
  update({{2.0, 0.0}}, 105);
  update({}, 110);
  build();
  assert_int_equal(map.size(), 2);
  update({}, 111);
  build();
  assert_int_equal(map.size(), 1);
  assert_near(map[0].p_site_m.x(), 2.0, 1e-12);
  tracks.forget(115);
  build();
  assert_int_equal(map.size(), 1);
  tracks.forget(116);  // without sightings, as over sand
  build();
  assert_int_equal(map.size(), 0);
}

void test_window_across_the_wrap_of_the_frame_number(void**) {
  tracks.init(show_all());
  update({{1.0, 0.0}}, UINT32_MAX - 1);
  update({{1.0, 0.0, 1}}, 3);
  build();
  assert_int_equal(map.size(), 1);
  assert_int_equal(map[0].sightings, 2);
}

/// Tracks move up when one before them is forgotten; votes still name the right ones.
void test_votes_after_tracks_are_forgotten(void**) {
  TrackParams p = show_all();
  p.window_frames = 5;
  tracks.init(p);
  update({{0.0, 0.0}, {1.0, 0.0}}, 1);
  update({{2.0, 0.0}, {1.0, 0.0, 2}, {3.0, 0.0}}, 4);  // the one at 0 goes on no more
  update({{3.3, 0.0, 3}, {1.3, 0.0, 2}, {2.3, 0.0, 1}}, 8);
  build();
  assert_int_equal(map.size(), 3);
  assert_near(map[0].p_site_m.x(), 1.1, 1e-12);
  assert_near(map[1].p_site_m.x(), 2.15, 1e-12);
  assert_near(map[2].p_site_m.x(), 3.15, 1e-12);
  assert_int_equal(map[0].sightings, 3);
  assert_int_equal(tracks.created(), 4);
}

/// A vote for a track that left the window meanwhile, or for a sighting that there was not.
void test_all_forgotten(void**) {
  tracks.init(show_all());
  update({{1.0, 0.0}, {2.0, 0.0}}, 1);
  tracks.forget_all();
  build();
  assert_int_equal(map.size(), 0);
  update({{1.0, 0.0, 1}}, 2);  // its vote is for nothing, its number new
  build();
  assert_int_equal(map.size(), 1);
  assert_int_equal(map[0].sightings, 1);
  assert_int_equal(map[0].id, 2);
}

/// In view: seen in the last frame that was taken in, whatever its number.
void test_in_view(void**) {
  tracks.init(show_all());
  update({{1.0, 0.0}, {2.0, 0.0}}, 0xFFFFFFFEU);
  update({{2.0, 0.0}, {3.0, 0.0}}, 1);
  tracks.forget(7);
  build();
  assert_int_equal(map.size(), 3);
  assert_false(map[0].in_view);
  assert_true(map[1].in_view);
  assert_true(map[2].in_view);
}

void test_what_was_seen_before_a_frame_is_forgotten(void**) {
  tracks.init(show_all());
  update({{1.0, 0.0}, {2.0, 0.0}}, 0xFFFFFFFEU);
  update({{2.0, 0.0}, {3.0, 0.0}}, 1);
  update({{4.0, 0.0}}, 4);
  tracks.forget_before(1);
  build();
  assert_int_equal(map.size(), 3);
  assert_near(map[0].p_site_m.x(), 2.0, 1e-12);
  tracks.forget_before(2);
  build();
  assert_int_equal(map.size(), 1);
  assert_near(map[0].p_site_m.x(), 4.0, 1e-12);
}

void test_votes_for_nothing(void**) {
  TrackParams p = show_all();
  p.window_frames = 5;
  tracks.init(p);
  update({{0.0, 0.0}}, 1);
  update({{0.0, 0.0, 1}, {4.0, 0.0, 7}}, 9);
  build();
  assert_int_equal(map.size(), 2);
  assert_int_equal(map[0].id, 1);
  assert_int_equal(map[0].sightings, 1);
  assert_int_equal(map[1].id, 2);
}

void test_merging_keeps_the_older(void**) {
  tracks.init(show_all());
  update({{1.0, 0.0}, {2.0, 0.0}, {1.06, 0.0}}, 1);
  build();
  assert_int_equal(map.size(), 2);
  assert_int_equal(map[0].id, 0);
  assert_int_equal(map[0].sightings, 2);
  assert_near(map[0].p_site_m.x(), 1.03, 1e-12);
  assert_int_equal(map[1].id, 1);
  update({{1.4, 0.0, 3}, {2.2, 0.0, 2}}, 2);  // votes for the one that gave way go to the one that stayed
  build();
  assert_int_equal(map.size(), 2);
  assert_int_equal(map[0].sightings, 3);
  assert_int_equal(map[1].sightings, 2);
  assert_int_equal(tracks.created(), 3);
}

/// Merged, and seen under either number: the window counts from the last sighting of both.
void test_a_merged_boulder_was_seen_when_either_was(void**) {
  TrackParams p = show_all();
  p.window_frames = 10;
  tracks.init(p);
  update({{1.0, 0.0}, {1.3, 0.0}}, 1);
  update({{0.76, 0.0, 2}}, 8);  // its mean is now beside the older one, which was not seen
  build();
  assert_int_equal(map.size(), 1);
  assert_int_equal(map[0].id, 0);
  tracks.forget(18);
  build();
  assert_int_equal(map.size(), 1);
  tracks.forget(19);
  build();
  assert_int_equal(map.size(), 0);
}

/// A merged boulder has moved: it may now lie close to another one. None are left within the distance.
void test_merging_goes_on_until_all_are_apart(void**) {
  const TrackParams p = show_all();
  tracks.init(p);
  update({{1.0, 0.0}, {1.10, 0.0, 0, 1.0}, {1.07, 0.0, 0, 1.0}}, 1);
  build();
  assert_int_equal(map.size(), 1);
  Random random(9);
  tracks.init(p);
  for (std::uint32_t frame = 1; frame <= 4; ++frame) {
    seen.clear();
    for (int i = 0; i < 60; ++i) {
      BoulderSighting s;
      s.p_site_m = Vec3(1e-3 * random.below(1000), 1e-3 * random.below(1000), 0.0);
      s.range_m = 1e-3F * static_cast<float>(500 + random.below(2000));
      s.diameter_m = 0.1F;
      assert_true(seen.push_back(s));
    }
    take_in(tracks, seen, frame);
  }
  build();
  int sightings = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    sightings += map[i].sightings;
    for (std::size_t j = 0; j < i; ++j) {
      assert_at_least((map[i].p_site_m - map[j].p_site_m).norm(), p.merge_m);
      assert_true(map[j].id < map[i].id);
    }
  }
  assert_int_equal(sightings, 240);
}

// A unit at a time: the same map, to the last number.
void test_same_for_every_slicing(void**) {
  static BoulderTracks sliced;
  static LocalMap sliced_map;
  TrackParams p = show_all();
  p.merge_m = 0.1;
  tracks.init(p);
  sliced.init(p);
  Random random(11);
  std::size_t units = 0;
  for (std::uint32_t frame = 1; frame <= 6; ++frame) {
    seen.clear();
    for (int i = 0; i < 40; ++i) {
      BoulderSighting s;
      s.p_site_m = Vec3(1e-3 * random.below(2000), 1e-3 * random.below(2000), 0.0);
      s.range_m = 1e-3F * static_cast<float>(500 + random.below(2000));
      s.previous = static_cast<std::uint8_t>(frame > 1 && i % 3 == 0 ? 1 + random.below(40) : 0);
      assert_true(seen.push_back(s));
    }
    take_in(tracks, seen, frame);
    sliced.start(seen, frame);
    for (Progress progress = Progress::kMore; progress == Progress::kMore; ++units) {
      WorkBudget one(1);
      progress = sliced.step(one);
      assert_at_most(one.spent(), 5000);
    }
  }
  for (Progress progress = Progress::kMore; progress == Progress::kMore; ++units) {
    WorkBudget one(1);
    progress = sliced.settle(one);
    assert_at_most(one.spent(), 5000);
  }
  assert_at_least(units, 200);
  build();
  sliced.build(sliced_map);
  assert_int_equal(sliced_map.size(), map.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    assert_int_equal(sliced_map[i].id, map[i].id);
    assert_int_equal(sliced_map[i].sightings, map[i].sightings);
    assert_true(sliced_map[i].p_site_m == map[i].p_site_m);
  }
}

// What is abandoned before its votes are counted takes the last frame's names with it: a vote would name
// another boulder's track.
void test_abandoned(void**) {
  tracks.init(show_all());
  update({{0.0, 0.0}, {1.0, 0.0}}, 1);
  tracks.start(seen, 2);
  tracks.abandon();
  update({{5.0, 0.0, 1}}, 3);
  build();
  assert_int_equal(map.size(), 3);
  assert_near(map[2].p_site_m.x(), 5.0, 1e-12);
}

void test_what_is_shown(void**) {
  TrackParams p;
  p.min_sightings = 3;
  p.min_diameter_m = 0.08;
  tracks.init(p);
  for (std::uint32_t frame = 1; frame <= 3; ++frame) {
    const int previous = frame > 1 ? 1 : 0;
    if (frame > 1) {
      update({{0.0, 0.0, previous, 1.0, 0.0801}, {1.0, 0.0, 2, 1.0, 0.0799}, {2.0, 0.0, frame == 2 ? 0 : 3}},
             frame);
    } else {
      update({{0.0, 0.0, 0, 1.0, 0.0801}, {1.0, 0.0, 0, 1.0, 0.0799}}, frame);
    }
  }
  build();
  assert_int_equal(map.size(), 1);
  assert_near(map[0].p_site_m.x(), 0.0, 1e-12);
  update({{2.0, 0.0, 3}}, 4);
  build();
  assert_int_equal(map.size(), 2);
  assert_int_equal(map[1].sightings, 3);
}

/// More than there is room for: the longest unseen make room, and no more of them than are needed.
void test_full(void**) {
  constexpr std::size_t kMore = 5;
  tracks.init(show_all());
  std::uint32_t frame = 1;
  std::size_t made = 0;
  while (made < cfg::kMaxLocalBoulders + kMore) {
    seen.clear();
    for (; !seen.full() && made < cfg::kMaxLocalBoulders + kMore; ++made) {
      BoulderSighting s;
      s.p_site_m = Vec3(0.2 * static_cast<double>(made), 0.0, 0.0);
      assert_true(seen.push_back(s));
    }
    take_in(tracks, seen, frame++);
  }
  assert_true(frame > 3);  // what was in view a frame ago stays
  assert_int_equal(tracks.dropped(), 0);
  assert_int_equal(tracks.created(), cfg::kMaxLocalBoulders + kMore);
  build();
  assert_true(map.full());
  for (const LocalBoulder& b : map) assert_true(b.id >= kMore);
}

/// What is seen once and never again fills the room there is, and what was seen often stays.
void test_room_is_made_of_what_was_seen_seldom(void**) {
  TrackParams p = show_all();
  p.min_sightings = 3;
  tracks.init(p);
  std::uint32_t frame = 1;
  for (; frame <= 3; ++frame) update({{-5.0, 0.0}, {-6.0, 0.0}}, frame);
  for (std::size_t k = 0; k < 3 * cfg::kMaxLocalBoulders; ++frame) {
    seen.clear();
    for (std::size_t i = 0; i < cfg::kMaxLocalBoulders / 8; ++i, ++k) {
      BoulderSighting s;
      s.p_site_m = Vec3(0.2 * static_cast<double>(k), 10.0, 0.0);
      s.diameter_m = 0.2F;
      assert_true(seen.push_back(s));
    }
    take_in(tracks, seen, frame);
  }
  assert_int_equal(tracks.dropped(), 0);
  build();
  assert_int_equal(map.size(), 2);
}

/// Boulders come into view and leave it, beside many that are seen but once: more than there is room for.
/// Nothing is lost, and it is no jump.
void test_no_jump_for_want_of_room(void**) {
  tracks.init(show_all());
  constexpr int kInView = 30;
  for (std::uint32_t frame = 1; frame <= 200; ++frame) {
    seen.clear();
    const int first = static_cast<int>(frame) / 2;
    for (int i = 0; i < 2 * kInView; ++i) {
      BoulderSighting s;
      const bool stays = i < kInView;
      s.p_site_m = stays ? Vec3(0.5 * (first + i), 0.0, 0.0)
                         : Vec3(0.5 * i, 5.0 + 0.5 * static_cast<double>(frame), 0.0);
      assert_true(seen.push_back(s));
    }
    take_in(tracks, seen, frame);
    assert_false(tracks.jumped());
  }
  assert_int_equal(tracks.dropped(), 0);
}

/// What was in view is there again, and as many more beside it: the view got better.
void test_more_than_before_is_no_jump(void**) {
  tracks.init(show_all());
  for (std::uint32_t frame = 1; frame <= 40; ++frame) {
    seen.clear();
    for (int i = 0; i < (frame < 40 ? 25 : 70); ++i) {
      BoulderSighting s;
      s.p_site_m = Vec3(0.5 * i, 0.0, 0.0);
      if (frame < 40 || i % 9 != 0) assert_true(seen.push_back(s));
    }
    take_in(tracks, seen, frame);
    assert_false(tracks.jumped());
  }
}

void test_fresh_share(void**) {
  LocalMap local;
  assert_near(fresh_share(local, 0), 1.0, 0.0);
  for (std::uint32_t id : {3U, 4U, 7U, 9U}) {
    LocalBoulder b;
    b.id = id;
    assert_true(local.push_back(b));
  }
  assert_near(fresh_share(local, 0), 1.0, 0.0);  // no fix yet
  assert_near(fresh_share(local, 4), 0.75, 0.0);
  assert_near(fresh_share(local, 8), 0.25, 0.0);
  assert_near(fresh_share(local, 10), 0.125, 0.0);
}

// ---- jumps

/// Boulders of a strip that the rover drives along; each seen in `share` of the frames, aside by `jump_m`.
struct Strip {
  Random random;
  std::vector<At> boulders;
  double astray = 0.0;  ///< share of the sightings that lie anywhere within half a metre
  int inliers = 0;      ///< of odometry
  double uniform() { return random.next() / 4294967296.0; }
  explicit Strip(std::uint32_t seed = 7, std::size_t count = 500) : random{seed}, boulders(count) {
    for (At& b : boulders) b = {60.0 * uniform(), 4.0 * uniform()};
  }
  void look(std::uint32_t frame, double share, const Vec2& jump_m) {
    seen.clear();
    for (const At& b : boulders) {
      const double ahead = b.x - 0.06 * frame;
      if (ahead < 0.0 || ahead > 3.0 || uniform() > share) continue;
      BoulderSighting s;
      s.p_site_m = Vec3(b.x + 0.02 * uniform() + jump_m.x(), b.y + 0.02 * uniform() + jump_m.y(), 0.0);
      if (astray > 0.0 && uniform() < astray) s.p_site_m += Vec3(uniform() - 0.5, uniform() - 0.5, 0.0);
      s.range_m = 2.0F;
      s.diameter_m = 0.2F;
      if (!seen.push_back(s)) break;
    }
    take_in(tracks, seen, frame, inliers);
  }
};

/// A drive whose boulders are where they were never jumps, be each seen in all frames or in half of them; one
/// that moves aside in between does, at that frame and at no other.
void test_a_jump_shows_at_its_frame(void**) {
  for (const double share : {1.0, 0.7, 0.5}) {
    for (const Vec2& jump : {Vec2(0.0, 0.0), Vec2(0.3, 0.0), Vec2(-0.7, 0.7)}) {
      Strip strip;
      tracks.init(show_all());
      for (std::uint32_t frame = 1; frame <= 800; ++frame) {
        strip.look(frame, share, frame < 300 ? Vec2(0.0, 0.0) : jump);
        const bool jumps = frame == 300 && jump.x() != 0.0;
        assert_int_equal(tracks.jumped(), jumps);
        if (jumps) tracks.forget_before(frame);
      }
    }
  }
}

/// Where few boulders are in view, a jump shows within two frames more, and nothing else does: what is
/// overlooked in single frames is there again.
void test_a_jump_shows_among_few(void**) {
  int told = 0;
  int late = 0;
  for (std::uint32_t seed = 1; seed <= 200; ++seed) {
    Strip strip(seed, 110);
    tracks.init(show_all());
    int first = 0;
    for (int frame = 1; frame <= 400; ++frame) {
      const bool jumped = frame >= 300;
      strip.look(static_cast<std::uint32_t>(frame), 0.95, jumped ? Vec2(0.7, 0.7) : Vec2(0.0, 0.0));
      if (!tracks.jumped()) continue;
      assert_true(jumped && first == 0);  // once, and not before
      first = frame;
      tracks.forget_before(static_cast<std::uint32_t>(frame));
    }
    assert_true(first <= 302);
    told += first > 0;
    late += first > 300;
  }
  assert_at_least(told, 170);
  assert_at_least(late, 20);
}

/// Pictures that are cut otherwise than those before, now and then, so that half of all in them is found
/// aside, are no jump; and a jump is seen all the same within two frames more.
void test_a_frame_that_is_cut_otherwise_is_no_jump(void**) {
  int told = 0;
  for (std::uint32_t seed = 1; seed <= 100; ++seed) {
    Strip strip(seed, 900);
    tracks.init(show_all());
    bool seen_to_jump = false;
    for (std::uint32_t frame = 1; frame <= 303; ++frame) {
      strip.astray = frame > 20 && strip.uniform() < 0.2 ? 0.5 : 0.2;
      strip.look(frame, 0.95, frame < 300 ? Vec2(0.0, 0.0) : Vec2(0.7, 0.7));
      if (!tracks.jumped()) continue;
      assert_true(frame >= 300 && frame <= 302);
      seen_to_jump = true;
      break;
    }
    told += seen_to_jump ? 1 : 0;
  }
  assert_at_least(told, 95);
}

/// Two pictures in a row that are cut otherwise look like a jump, and are taken for one where odometry lost
/// its matches as well. Where it has as many as ever they are not; a jump of all that is in view is.
void test_odometry_that_sees_as_ever_speaks_against_a_jump(void**) {
  struct Case {
    int inliers;
    bool all;
    int least;
    int most;
  };
  for (const auto& [inliers, all, least, most] :
       {Case{100, false, 40, 100}, Case{280, false, 0, 10}, Case{280, true, 95, 100}}) {
    int told = 0;
    for (std::uint32_t seed = 1; seed <= 100; ++seed) {
      Strip strip(seed, 500);
      tracks.init(show_all());
      for (std::uint32_t frame = 1; frame <= 302; ++frame) {
        const bool odd = frame > 300;
        strip.inliers = odd ? inliers : 300;
        strip.astray = odd && !all ? 0.75 : 0.2;
        strip.look(frame, 0.95, odd && all ? Vec2(0.7, 0.7) : Vec2(0.0, 0.0));
        if (!tracks.jumped()) continue;
        assert_true(odd);
        ++told;
        break;
      }
    }
    assert_at_least(told, least);
    assert_at_most(told, most);
  }
}

/// Nothing is said where nothing was in view the frame before, or nothing is known of the share.
void test_no_jump_without_a_frame_before(void**) {
  const Vec2 aside(0.5, 0.5);
  Strip strip;
  tracks.init(show_all());
  strip.look(1, 1.0, Vec2(0.0, 0.0));
  strip.look(2, 1.0, aside);
  assert_near(tracks.jump_log(), 0.0, 0.0);
  tracks.init(show_all());
  for (std::uint32_t frame = 1; frame <= 20; ++frame) strip.look(frame, 1.0, Vec2(0.0, 0.0));
  assert_at_most(tracks.jump_log(), -1.0);
  tracks.forget_all();
  strip.look(21, 1.0, aside);
  assert_near(tracks.jump_log(), 0.0, 0.0);
  strip.look(23, 1.0, -aside);  // a frame is missing
  assert_near(tracks.jump_log(), 0.0, 0.0);
  strip.look(24, 1.0, Vec2(1.1, -0.3));
  assert_true(tracks.jumped());
}

/// Nor where the frame before saw little of what is in view now: the rest is new, and no miss.
void test_no_jump_out_of_the_dark(void**) {
  tracks.init(show_all());
  for (std::uint32_t frame = 1; frame <= 20; ++frame)
    update({{0.0, 0.0}, {1.0, 0.0}, {2.0, 0.0}, {0.0, 1.0}, {1.0, 1.0}, {2.0, 1.0}}, frame);
  assert_at_most(tracks.jump_log(), -1.0);
  update({{0.0, 0.0}, {1.0, 0.0}}, 21);
  update({{0.0, 0.0}, {1.0, 0.0}, {4.0, 0.0}, {5.0, 0.0}, {6.0, 0.0}, {4.0, 1.0}, {5.0, 1.0}, {6.0, 1.0}},
         22);
  assert_near(tracks.jump_log(), 0.0, 0.0);
  // With half of them seen the frame before it is asked again, and they are where they were.
  update({{0.0, 0.0}, {1.0, 0.0}, {4.0, 0.0}, {5.0, 0.0}, {6.0, 0.0}, {4.0, 1.0}, {5.0, 1.0}, {6.0, 1.0}},
         23);
  assert_at_most(tracks.jump_log(), -1.0);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_vote_is_followed_beyond_the_merge_distance),
      cmocka_unit_test(test_vote_goes_before_distance),
      cmocka_unit_test(test_without_vote_the_nearest_within_the_distance),
      cmocka_unit_test(test_the_nearer_of_two),
      cmocka_unit_test(test_a_track_takes_one_sighting_a_frame),
      cmocka_unit_test(test_weights_fall_with_range),
      cmocka_unit_test(test_window),
      cmocka_unit_test(test_window_across_the_wrap_of_the_frame_number),
      cmocka_unit_test(test_votes_after_tracks_are_forgotten),
      cmocka_unit_test(test_all_forgotten),
      cmocka_unit_test(test_in_view),
      cmocka_unit_test(test_what_was_seen_before_a_frame_is_forgotten),
      cmocka_unit_test(test_votes_for_nothing),
      cmocka_unit_test(test_merging_keeps_the_older),
      cmocka_unit_test(test_a_merged_boulder_was_seen_when_either_was),
      cmocka_unit_test(test_merging_goes_on_until_all_are_apart),
      cmocka_unit_test(test_same_for_every_slicing),
      cmocka_unit_test(test_abandoned),
      cmocka_unit_test(test_what_is_shown),
      cmocka_unit_test(test_full),
      cmocka_unit_test(test_room_is_made_of_what_was_seen_seldom),
      cmocka_unit_test(test_no_jump_for_want_of_room),
      cmocka_unit_test(test_more_than_before_is_no_jump),
      cmocka_unit_test(test_fresh_share),
      cmocka_unit_test(test_a_jump_shows_at_its_frame),
      cmocka_unit_test(test_a_jump_shows_among_few),
      cmocka_unit_test(test_a_frame_that_is_cut_otherwise_is_no_jump),
      cmocka_unit_test(test_odometry_that_sees_as_ever_speaks_against_a_jump),
      cmocka_unit_test(test_no_jump_without_a_frame_before),
      cmocka_unit_test(test_no_jump_out_of_the_dark),
  };
  return cmocka_run_group_tests_name("localizer/boulder_tracks", tests, nullptr, nullptr);
}
