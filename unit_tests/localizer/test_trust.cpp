// Trust: the header's table, row by row, and what must hold for any order of events.
#include "localizer/trust.hpp"

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

constexpr TrustEvent kAll[kTrustEvents] = {
    TrustEvent::kStartGiven,      TrustEvent::kStartWide,   TrustEvent::kStartUnknown,
    TrustEvent::kStepMeasured,    TrustEvent::kCaughtUp,    TrustEvent::kHeld,
    TrustEvent::kGuessed,         TrustEvent::kDoubted,     TrustEvent::kFixAccepted,
    TrustEvent::kFixInconsistent, TrustEvent::kFixDeclined, TrustEvent::kFixUndecided,
    TrustEvent::kFixRefuted,
};

TrustState in_state(Trust state) {
  TrustState t;
  t.init({});
  if (state == Trust::kLost) return t;
  t.on(TrustEvent::kStartGiven);
  if (state == Trust::kClaimed) return t;
  t.on(TrustEvent::kFixAccepted);
  if (state == Trust::kCoasting) t.on(TrustEvent::kHeld);
  if (state == Trust::kUnconfirmed) t.on(TrustEvent::kGuessed);
  t.snapshot();
  return t;
}

Trust after(Trust state, TrustEvent event) {
  TrustState t = in_state(state);
  t.on(event);
  return t.state();
}

void test_before_any_start(void**) {
  TrustState t;
  t.init({});
  assert_status(t.state(), Trust::kLost);
}

void test_commands(void**) {
  for (const Trust from :
       {Trust::kConfirmed, Trust::kCoasting, Trust::kUnconfirmed, Trust::kLost, Trust::kClaimed}) {
    assert_status(in_state(from).state(), from);
    assert_status(after(from, TrustEvent::kStartGiven), Trust::kClaimed);
    assert_status(after(from, TrustEvent::kStartWide), Trust::kUnconfirmed);
    assert_status(after(from, TrustEvent::kStartUnknown), Trust::kLost);
  }
}

/// Both sigmas must be such that the mission can drive by them.
void test_wide_starts(void**) {
  const TrustParams params;
  TrustState t;
  t.init(params);
  const double xy = params.start_sigma_xy_m;
  const double yaw = params.start_sigma_yaw_rad;
  assert_true(t.start_of(xy, yaw) == TrustEvent::kStartGiven);
  assert_true(t.start_of(1.001 * xy, 0.1 * yaw) == TrustEvent::kStartWide);
  assert_true(t.start_of(0.1 * xy, 1.001 * yaw) == TrustEvent::kStartWide);
  t.on(TrustEvent::kStartWide);
  t.on(TrustEvent::kStepMeasured);
  assert_status(t.state(), Trust::kUnconfirmed);
  t.snapshot();
  t.on(TrustEvent::kFixAccepted);
  assert_status(t.state(), Trust::kConfirmed);
}

void test_frames(void**) {
  assert_status(after(Trust::kConfirmed, TrustEvent::kStepMeasured), Trust::kConfirmed);
  assert_status(after(Trust::kConfirmed, TrustEvent::kCaughtUp), Trust::kConfirmed);
  assert_status(after(Trust::kConfirmed, TrustEvent::kHeld), Trust::kCoasting);
  assert_status(after(Trust::kConfirmed, TrustEvent::kGuessed), Trust::kUnconfirmed);
  assert_status(after(Trust::kConfirmed, TrustEvent::kDoubted), Trust::kUnconfirmed);
  assert_status(after(Trust::kCoasting, TrustEvent::kHeld), Trust::kCoasting);
  assert_status(after(Trust::kCoasting, TrustEvent::kStepMeasured), Trust::kCoasting);
  assert_status(after(Trust::kCoasting, TrustEvent::kCaughtUp), Trust::kConfirmed);
  assert_status(after(Trust::kCoasting, TrustEvent::kGuessed), Trust::kUnconfirmed);
  assert_status(after(Trust::kCoasting, TrustEvent::kDoubted), Trust::kUnconfirmed);
}

/// What was told stays a claim through anything but a fix, and a bridge over held frames leads back to it.
void test_a_claim_is_no_confirmation(void**) {
  for (const TrustEvent e : {TrustEvent::kStepMeasured, TrustEvent::kCaughtUp, TrustEvent::kFixDeclined,
                             TrustEvent::kFixUndecided})
    assert_status(after(Trust::kClaimed, e), Trust::kClaimed);
  TrustState t = in_state(Trust::kClaimed);
  t.on(TrustEvent::kHeld);
  assert_status(t.state(), Trust::kCoasting);
  t.on(TrustEvent::kCaughtUp);
  assert_status(t.state(), Trust::kClaimed);
  for (const TrustEvent e :
       {TrustEvent::kGuessed, TrustEvent::kDoubted, TrustEvent::kFixInconsistent, TrustEvent::kFixRefuted})
    assert_status(after(Trust::kClaimed, e), Trust::kUnconfirmed);
  t.snapshot();
  t.on(TrustEvent::kFixAccepted);
  assert_status(t.state(), Trust::kConfirmed);
}

/// From any start until a fix is accepted, whatever else is said in between; and again from the next start.
void test_a_start_is_doubted_until_a_fix(void**) {
  TrustParams params;
  params.doubt_xy_m = 0.5;
  params.doubt_yaw_rad = 0.1;
  const Mat3 doubt = Vec3(0.25, 0.25, 0.01).asDiagonal();
  for (const TrustEvent start :
       {TrustEvent::kStartGiven, TrustEvent::kStartWide, TrustEvent::kStartUnknown}) {
    TrustState t;
    t.init(params);
    for (int again = 0; again < 2; ++again) {
      t.on(start);
      for (const TrustEvent e : kAll) {
        if (e == TrustEvent::kFixAccepted) continue;
        t.on(e);
        assert_true(t.unproven());
        assert_near((t.doubt() - doubt).cwiseAbs().maxCoeff(), 0.0, 1e-15);
      }
      t.on(TrustEvent::kFixAccepted);
      for (const TrustEvent e :
           {TrustEvent::kGuessed, TrustEvent::kFixInconsistent, TrustEvent::kFixRefuted}) {
        t.on(e);
        assert_false(t.unproven());
        assert_near(t.doubt().cwiseAbs().maxCoeff(), 0.0, 0.0);
      }
    }
  }
}

/// No frame, good or bad, lifts a latched state.
void test_latched(void**) {
  for (const Trust from : {Trust::kUnconfirmed, Trust::kLost}) {
    for (const TrustEvent e : {TrustEvent::kStepMeasured, TrustEvent::kCaughtUp, TrustEvent::kHeld,
                               TrustEvent::kGuessed, TrustEvent::kDoubted, TrustEvent::kFixDeclined,
                               TrustEvent::kFixInconsistent, TrustEvent::kFixUndecided}) {
      assert_status(after(from, e), from);
    }
  }
}

void test_fixes(void**) {
  for (const Trust from :
       {Trust::kConfirmed, Trust::kCoasting, Trust::kUnconfirmed, Trust::kLost, Trust::kClaimed}) {
    assert_status(after(from, TrustEvent::kFixAccepted),
                  from == Trust::kCoasting ? Trust::kCoasting : Trust::kConfirmed);
    assert_status(after(from, TrustEvent::kFixUndecided), from);
    assert_status(after(from, TrustEvent::kFixDeclined), from);
  }
  assert_status(after(Trust::kConfirmed, TrustEvent::kFixInconsistent), Trust::kUnconfirmed);
  assert_status(after(Trust::kCoasting, TrustEvent::kFixInconsistent), Trust::kUnconfirmed);
}

/// Refuted twice over, or on top of a step that was guessed: nobody knows where the rover is.
void test_refuted(void**) {
  assert_status(after(Trust::kConfirmed, TrustEvent::kFixRefuted), Trust::kUnconfirmed);
  assert_status(after(Trust::kCoasting, TrustEvent::kFixRefuted), Trust::kUnconfirmed);
  assert_status(after(Trust::kUnconfirmed, TrustEvent::kFixRefuted), Trust::kLost);
  assert_status(after(Trust::kLost, TrustEvent::kFixRefuted), Trust::kLost);
}

void test_refused_too_often(void**) {
  for (int lost_after = 1; lost_after <= 4; ++lost_after) {
    TrustState t;
    t.init({lost_after});
    t.on(TrustEvent::kStartGiven);
    for (int i = 1; i <= lost_after; ++i) {
      assert_true(t.state() != Trust::kLost);
      t.on(i % 2 == 0 ? TrustEvent::kFixInconsistent : TrustEvent::kFixDeclined);
      t.on(TrustEvent::kFixUndecided);
      t.on(TrustEvent::kStepMeasured);
    }
    assert_status(t.state(), Trust::kLost);
    t.on(TrustEvent::kFixAccepted);
    assert_status(t.state(), Trust::kConfirmed);
  }
}

void test_only_rows_count(void**) {
  for (const TrustEvent between : {TrustEvent::kFixAccepted, TrustEvent::kStartGiven, TrustEvent::kStartWide,
                                   TrustEvent::kStartUnknown}) {
    TrustState t;
    t.init({2});
    t.on(TrustEvent::kStartGiven);
    t.on(TrustEvent::kFixDeclined);
    t.on(between);
    t.on(TrustEvent::kFixDeclined);
    assert_true(t.state() != Trust::kLost || between == TrustEvent::kStartUnknown);
    if (between == TrustEvent::kFixAccepted) assert_status(t.state(), Trust::kConfirmed);
    if (between == TrustEvent::kStartGiven) assert_status(t.state(), Trust::kClaimed);
  }
}

/// A fix that comes late confirms its own frame, not what was guessed since.
void test_late_fix(void**) {
  const auto late = [](TrustEvent since) {
    TrustState t = in_state(Trust::kLost);
    t.snapshot();
    t.on(TrustEvent::kStepMeasured);
    t.on(since);
    t.on(TrustEvent::kStepMeasured);
    t.on(TrustEvent::kFixAccepted);
    return t.state();
  };
  assert_status(late(TrustEvent::kStepMeasured), Trust::kConfirmed);
  assert_status(late(TrustEvent::kHeld), Trust::kCoasting);
  assert_status(late(TrustEvent::kGuessed), Trust::kUnconfirmed);
  assert_status(late(TrustEvent::kDoubted), Trust::kUnconfirmed);
  assert_status(late(TrustEvent::kStartGiven), Trust::kConfirmed);  // which forgets the fix's frame
}

/// Nothing of before a start counts after it: neither what was guessed since a snapshot, nor held frames.
void test_a_start_begins_anew(void**) {
  for (const TrustEvent start :
       {TrustEvent::kStartGiven, TrustEvent::kStartWide, TrustEvent::kStartUnknown}) {
    for (const TrustEvent before : {TrustEvent::kHeld, TrustEvent::kGuessed, TrustEvent::kDoubted}) {
      for (const bool snapshot : {false, true}) {
        TrustState t = in_state(Trust::kConfirmed);
        t.on(before);
        t.on(start);
        if (snapshot) t.snapshot();
        t.on(TrustEvent::kFixAccepted);
        assert_status(t.state(), Trust::kConfirmed);
      }
    }
  }
}

/// A fix of a frame that was held confirms the frame of VO's reference; what came after it is still held.
void test_fix_of_a_held_frame(void**) {
  for (const Trust from : {Trust::kConfirmed, Trust::kUnconfirmed, Trust::kLost}) {
    for (const bool caught_up : {false, true}) {
      TrustState t = in_state(from);
      t.on(TrustEvent::kHeld);
      t.snapshot();
      t.on(TrustEvent::kFixAccepted);
      assert_status(t.state(), Trust::kCoasting);
      t.on(caught_up ? TrustEvent::kCaughtUp : TrustEvent::kGuessed);
      assert_status(t.state(), caught_up ? Trust::kConfirmed : Trust::kUnconfirmed);
      t.snapshot();
      t.on(TrustEvent::kFixAccepted);
      assert_status(t.state(), Trust::kConfirmed);
    }
  }
}

/// Any order: what makes a pose confirmed is a fix, or a bridge over frames that were only held.
void test_any_order(void**) {
  Random random(5);
  TrustState t;
  t.init({});
  bool guessed = true;  // since the last start, and since the snapshot of the last accepted fix
  bool guessed_since_snapshot = false;
  bool fixed = false;
  for (int i = 0; i < 200000; ++i) {
    const Trust before = t.state();
    if (random.below(8) == 0) {
      t.snapshot();
      guessed_since_snapshot = false;
    }
    const TrustEvent e = kAll[random.below(kTrustEvents)];
    t.on(e);
    if (e == TrustEvent::kGuessed || e == TrustEvent::kDoubted) guessed = guessed_since_snapshot = true;
    if (e == TrustEvent::kFixAccepted) guessed = guessed_since_snapshot;
    const bool start =
        e == TrustEvent::kStartGiven || e == TrustEvent::kStartUnknown || e == TrustEvent::kStartWide;
    if (start) guessed_since_snapshot = false;
    if (e == TrustEvent::kStartGiven) guessed = false;
    if (e == TrustEvent::kStartWide) guessed = true;
    if (start) fixed = false;
    if (e == TrustEvent::kFixAccepted) fixed = true;
    if (t.state() == Trust::kClaimed) assert_false(guessed || fixed);
    if (t.state() == Trust::kConfirmed) {
      assert_true(fixed && !guessed);
      if (before != Trust::kConfirmed && before != Trust::kCoasting)
        assert_true(e == TrustEvent::kFixAccepted);
    }
    if (before == Trust::kLost && t.state() != Trust::kLost)
      assert_true(e == TrustEvent::kFixAccepted || e == TrustEvent::kStartGiven ||
                  e == TrustEvent::kStartWide);
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_before_any_start),
      cmocka_unit_test(test_commands),
      cmocka_unit_test(test_wide_starts),
      cmocka_unit_test(test_frames),
      cmocka_unit_test(test_a_claim_is_no_confirmation),
      cmocka_unit_test(test_a_start_is_doubted_until_a_fix),
      cmocka_unit_test(test_latched),
      cmocka_unit_test(test_fixes),
      cmocka_unit_test(test_refuted),
      cmocka_unit_test(test_refused_too_often),
      cmocka_unit_test(test_only_rows_count),
      cmocka_unit_test(test_late_fix),
      cmocka_unit_test(test_a_start_begins_anew),
      cmocka_unit_test(test_fix_of_a_held_frame),
      cmocka_unit_test(test_any_order),
  };
  return cmocka_run_group_tests_name("localizer/trust", tests, nullptr, nullptr);
}
