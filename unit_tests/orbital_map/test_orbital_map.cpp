// The flight map: validation of damaged and contradictory bytes, windows by position.
#include "orbital_map/orbital_map.hpp"

#include <limits>

#include "core/random.hpp"
#include "orbital_map/small_map.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using cairn::test::GridBoulder;
using cairn::test::kMapHeader;
using cairn::test::MapBytes;

namespace {

constexpr unsigned kColumns = 3;
constexpr unsigned kRows = 2;
constexpr unsigned kSide = 1000;
constexpr double kQuantum = 0.01;  // tiles of 10 m
const Vec2 kOrigin(-35.5, 2251000.25);
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

const GridBoulder kFew[] = {{0, 0, 0, 150},    {0, 999, 999, 65535}, {1, 500, 20, 1},
                            {3, 10, 700, 333}, {3, 11, 700, 334},    {5, 999, 0, 1200}};

MapBytes map;
MapBytes damaged;
MapBoulders out;

void make_few() { test::make_map(map, kColumns, kRows, kSide, kQuantum, kFew, 6); }

MapStatus validate(const MapBytes& m, std::size_t size) {
  MapValidation validation;
  if (validation.start(m.bytes, size) != MapStatus::kChecking) return validation.status();
  WorkBudget budget = WorkBudget::unlimited();
  assert_status(validation.step(budget), Progress::kDone);
  return validation.status();
}

OrbitalMap usable_map() {
  MapValidation validation;
  assert_status(validation.start(map.bytes, map.size), MapStatus::kChecking);
  assert_false(validation.result().usable());
  WorkBudget budget = WorkBudget::unlimited();
  assert_status(validation.step(budget), Progress::kDone);
  assert_status(validation.status(), MapStatus::kUsable);
  return validation.result();
}

void test_header_fields(void**) {
  make_few();
  const OrbitalMap m = usable_map();
  assert_true(m.usable());
  assert_int_equal(m.count(), 6);
  assert_near(m.quantum_m(), kQuantum, 0.0);
  assert_near((m.origin_map_m() - kOrigin).norm(), 0.0, 0.0);
  assert_near(m.extent_m().x(), 30.0, 0.0);
  assert_near(m.extent_m().y(), 18.0, 1e-12);
  assert_int_equal(m.parameter_hash(), 0xCAFE0123U);
  assert_string_equal(m.reference_system(), "EPSG:32633");
}

void test_no_map(void**) {
  MapValidation validation;
  assert_status(validation.status(), MapStatus::kIdle);
  WorkBudget budget = WorkBudget::unlimited();
  assert_status(validation.step(budget), Progress::kDone);
  assert_status(validation.start(nullptr, 100), MapStatus::kNoMap);
  make_few();
  assert_status(validation.start(map.bytes, 0), MapStatus::kNoMap);
  const OrbitalMap none;
  assert_false(none.usable());
  assert_int_equal(none.count(), 0);
  assert_string_equal(none.reference_system(), "");
  out.clear();
  assert_status(none.window(Vec2(0.0, 0.0), 1.0, out), WindowStatus::kNoMap);
}

void test_a_second_start_forgets_the_first(void**) {
  make_few();
  MapValidation validation;
  WorkBudget budget = WorkBudget::unlimited();
  assert_status(validation.start(map.bytes, map.size), MapStatus::kChecking);
  assert_status(validation.step(budget), Progress::kDone);
  assert_true(validation.result().usable());
  assert_status(validation.start(map.bytes, 10), MapStatus::kTruncated);
  assert_false(validation.result().usable());
}

void test_every_truncation_is_named(void**) {
  make_few();
  for (std::size_t size = 1; size < map.size; ++size) {
    assert_status(validate(map, size), MapStatus::kTruncated);
  }
  assert_status(validate(map, map.size), MapStatus::kUsable);
}

void test_bytes_behind_the_map_do_not_matter(void**) {
  make_few();
  map.bytes[map.size] = 0xFF;
  assert_status(validate(map, map.size + 5000), MapStatus::kUsable);
}

MapStatus expected_for_flip_in(std::size_t byte) {
  if (byte < 4) return MapStatus::kBadMagic;
  if (byte < 8) return MapStatus::kUnknownVersion;
  return byte < kMapHeader ? MapStatus::kHeaderCrc : MapStatus::kPayloadCrc;
}

void test_every_single_flip_is_detected(void**) {
  make_few();
  for (std::size_t byte = 0; byte < map.size; ++byte) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      map.bytes[byte] ^= static_cast<std::uint8_t>(1U << bit);
      assert_status(validate(map, map.size), expected_for_flip_in(byte));
      map.bytes[byte] ^= static_cast<std::uint8_t>(1U << bit);
    }
  }
  assert_status(validate(map, map.size), MapStatus::kUsable);
}

/// Statuses of maps whose CRCs hold although a field is wrong.
template <typename Change>
MapStatus after(const Change& change) {
  make_few();
  damaged = map;
  change(damaged.bytes);
  test::seal(damaged);
  return validate(damaged, damaged.size);
}

void test_versions(void**) {
  for (const unsigned version : {0U, 2U, 256U}) {
    assert_status(after([=](std::uint8_t* h) { be::put_u16(h + 4, static_cast<std::uint16_t>(version)); }),
                  MapStatus::kUnknownVersion);
  }
  assert_status(after([](std::uint8_t* h) { be::put_u16(h + 6, 180); }), MapStatus::kUnknownVersion);
}

void test_header_ranges(void**) {
  for (const std::size_t field : {std::size_t{16}, std::size_t{24}}) {
    for (const double value : {kNaN, kInf, 1.001e8, -1.001e8}) {
      assert_status(after([=](std::uint8_t* h) { be::put_f64(h + field, value); }), MapStatus::kBadHeader);
    }
    for (const double value : {1e8, -1e8, 0.0}) {
      assert_status(after([=](std::uint8_t* h) { be::put_f64(h + field, value); }), MapStatus::kUsable);
    }
  }
  for (const std::size_t field : {std::size_t{32}, std::size_t{40}}) {
    for (const double value : {kNaN, -0.01, 30.1}) {
      assert_status(after([=](std::uint8_t* h) { be::put_f64(h + field, value); }), MapStatus::kBadHeader);
    }
  }
  for (const double value : {kNaN, 0.0, -0.01, 0.99e-4, 10.01}) {
    assert_status(after([=](std::uint8_t* h) { be::put_f64(h + 48, value); }), MapStatus::kBadHeader);
  }
  assert_status(after([](std::uint8_t* h) { be::put_f64(h + 48, 10.0); }), MapStatus::kUsable);
  for (const std::size_t field : {std::size_t{56}, std::size_t{58}, std::size_t{60}}) {
    assert_status(after([=](std::uint8_t* h) { be::put_u16(h + field, 0); }), MapStatus::kBadHeader);
  }
}

void test_header_contradictions(void**) {
  assert_status(after([](std::uint8_t* h) { be::put_u32(h + 8, be::get_u32(h + 8) - 6U); }),
                MapStatus::kBadHeader);
  assert_status(after([](std::uint8_t* h) { be::put_u32(h + 12, 7); }), MapStatus::kBadHeader);
  assert_status(after([](std::uint8_t* h) { be::put_u32(h + 12, 0xFFFFFFFFU); }), MapStatus::kBadHeader);
  assert_status(after([](std::uint8_t* h) { be::put_u16(h + 56, 65535), be::put_u16(h + 58, 65535); }),
                MapStatus::kBadHeader);
  // The same sum modulo 2^32 would fit: 2^32 bytes more of boulders cannot be meant.
  assert_status(after([](std::uint8_t* h) { be::put_u32(h + 12, 6U + 0x80000000U); }), MapStatus::kBadHeader);
  assert_status(after([](std::uint8_t* h) { h[72 + 95] = 'x'; }), MapStatus::kBadHeader);
  assert_status(after([](std::uint8_t* h) { h[72 + 3] = 7; }), MapStatus::kBadHeader);
}

void test_directory(void**) {
  assert_status(after([](std::uint8_t* h) { be::put_u32(h + kMapHeader, 1); }), MapStatus::kBadDirectory);
  assert_status(after([](std::uint8_t* h) { be::put_u32(h + kMapHeader + 24, 5); }),
                MapStatus::kBadDirectory);
  assert_status(after([](std::uint8_t* h) { be::put_u32(h + kMapHeader + 24, 0xFFFFFFFFU); }),
                MapStatus::kBadDirectory);
  for (std::size_t entry = 1; entry < 6; ++entry) {  // somewhere it falls: 0xFFFFFFFF > the entry behind it
    assert_status(after([=](std::uint8_t* h) { be::put_u32(h + kMapHeader + 4 * entry, 0xFFFFFFFFU); }),
                  MapStatus::kBadDirectory);
  }
}

void test_boulder_ranges(void**) {
  const std::size_t last = kMapHeader + 28 + 6 * 5;
  assert_status(after([=](std::uint8_t* h) { be::put_u16(h + last, kSide); }), MapStatus::kBadBoulder);
  assert_status(after([=](std::uint8_t* h) { be::put_u16(h + last + 2, kSide); }), MapStatus::kBadBoulder);
  assert_status(after([=](std::uint8_t* h) { be::put_u16(h + last + 4, 0); }), MapStatus::kBadBoulder);
  assert_status(after([=](std::uint8_t* h) { be::put_u16(h + last + 2, kSide - 1); }), MapStatus::kUsable);
}

void test_no_boulders(void**) {
  test::make_map(map, kColumns, kRows, kSide, kQuantum, nullptr, 0);
  assert_status(validate(map, map.size), MapStatus::kNoBoulders);
}

Vec2 position(const GridBoulder& b) {
  return kOrigin + kQuantum * Vec2(b.tile % kColumns * kSide + b.x, b.tile / kColumns * kSide + b.y);
}

void test_window_at_its_corners(void**) {
  make_few();
  const OrbitalMap m = usable_map();
  for (const GridBoulder& b : kFew) {  // radius 0, exactly on it
    out.clear();
    assert_status(m.window(position(b), 0.0, out), WindowStatus::kUsable);
    assert_int_equal(out.size(), 1);
    assert_near((out[0].p_map_m - position(b)).norm(), 0.0, 1e-9);
    assert_near(out[0].diameter_m, b.diameter_mm * 0.001, 1e-5);
  }
  out.clear();
  assert_status(m.window(kOrigin + Vec2(15.0, 10.0), 1e30, out), WindowStatus::kUsable);
  assert_int_equal(out.size(), 6);
  assert_status(m.window(kOrigin, 1.0, out), WindowStatus::kUsable);  // appended, not cleared
  assert_int_equal(out.size(), 7);
  out.clear();
  for (const Vec2& away : {Vec2(-20.0, 5.0), Vec2(60.0, 5.0), Vec2(5.0, -20.0), Vec2(5.0, 60.0),
                           Vec2(1e300, -1e300), Vec2(25.0, 5.0)}) {
    assert_status(m.window(kOrigin + away, 4.0, out), WindowStatus::kNoneNear);
  }
  assert_int_equal(out.size(), 0);
  assert_status(m.window(Vec2(kNaN, 0.0), 1.0, out), WindowStatus::kBadInput);
  assert_status(m.window(Vec2(0.0, kInf), 1.0, out), WindowStatus::kBadInput);
  assert_status(m.window(kOrigin, kNaN, out), WindowStatus::kBadInput);
  assert_status(m.window(kOrigin, kInf, out), WindowStatus::kBadInput);
  assert_status(m.window(kOrigin, -1e-9, out), WindowStatus::kBadInput);
}

GridBoulder many[8000];

/// `count` boulders all over the map, in the order of tiles.
void make_many(unsigned count) {
  Random random(11);
  for (unsigned i = 0; i < count; ++i) {
    many[i] = {i * kColumns * kRows / count, random.below(kSide), random.below(kSide),
               1 + random.below(2000)};
  }
  test::make_map(map, kColumns, kRows, kSide, kQuantum, many, count);
}

void test_window_equals_brute_force(void**) {
  constexpr unsigned kCount = 2000;
  make_many(kCount);
  const OrbitalMap m = usable_map();
  Random random(5);
  for (int trial = 0; trial < 500; ++trial) {
    const Vec2 p = kOrigin + 0.01 * Vec2(static_cast<int>(random.below(4000)) - 500,
                                         static_cast<int>(random.below(3000)) - 500);
    const double radius_m =
        0.01 * random.below(1200) + 0.0051;  // between the grid's distances near the tiles' edges
    out.clear();
    const WindowStatus status = m.window(p, radius_m, out);
    std::size_t next = 0;
    for (unsigned i = 0; i < kCount; ++i) {  // same order as in the file
      const double distance_m = (position(many[i]) - p).norm();
      if (std::fabs(distance_m - radius_m) < 1e-9) continue;
      if (distance_m > radius_m) continue;
      assert_true(next < out.size());
      assert_near((out[next].p_map_m - position(many[i])).norm(), 0.0, 1e-9);
      ++next;
    }
    assert_int_equal(next, out.size());
    assert_status(status, next > 0 ? WindowStatus::kUsable : WindowStatus::kNoneNear);
  }
}

void test_window_full(void**) {
  const unsigned capacity = static_cast<unsigned>(MapBoulders::capacity());
  make_many(capacity);
  OrbitalMap m = usable_map();
  out.clear();
  assert_status(m.window(kOrigin, 100.0, out), WindowStatus::kUsable);
  assert_int_equal(out.size(), capacity);
  make_many(capacity + 1);
  m = usable_map();
  out.clear();
  assert_status(m.window(kOrigin, 100.0, out), WindowStatus::kWindowFull);
  assert_int_equal(out.size(), capacity);
}

/// Steps until done with budgets of `ops`; the number of steps, at most 100000.
int steps_to_validate(MapValidation& validation, const MapBytes& m, std::uint32_t ops) {
  if (validation.start(m.bytes, m.size) != MapStatus::kChecking) return 0;
  for (int steps = 1; steps < 100000; ++steps) {
    WorkBudget budget(ops);
    const Progress progress = validation.step(budget);
    assert_at_most(budget.spent(), ops + 600.0);
    if (progress == Progress::kDone) return steps;
    assert_status(validation.status(), MapStatus::kChecking);
    assert_false(validation.result().usable());
  }
  return -1;
}

void test_slicing_does_not_matter(void**) {
  make_many(1500);
  const OrbitalMap whole = usable_map();
  static MapBoulders expected;
  expected.clear();
  assert_status(whole.window(kOrigin + Vec2(12.0, 8.0), 6.0, expected), WindowStatus::kUsable);
  int most_steps = 0;
  for (const std::uint32_t ops : {1U, 7U, 513U, 1000U, 12345U, UINT32_MAX}) {
    MapValidation validation;
    const int steps = steps_to_validate(validation, map, ops);
    assert_true(steps > 0);
    if (ops == 1U) most_steps = steps;
    if (ops == UINT32_MAX) assert_int_equal(steps, 1);
    assert_status(validation.status(), MapStatus::kUsable);
    out.clear();
    assert_status(validation.result().window(kOrigin + Vec2(12.0, 8.0), 6.0, out), WindowStatus::kUsable);
    assert_int_equal(out.size(), expected.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
      assert_true(out[i].p_map_m == expected[i].p_map_m && out[i].diameter_m == expected[i].diameter_m);
    }
  }
  assert_true(most_steps > 50);
  damaged = map;
  be::put_u16(damaged.bytes + damaged.size - 2, 0);
  for (const bool sealed : {false, true}) {
    if (sealed) test::seal(damaged);
    for (const std::uint32_t ops : {1U, 700U, UINT32_MAX}) {
      MapValidation validation;
      assert_true(steps_to_validate(validation, damaged, ops) > 0);
      assert_status(validation.status(), sealed ? MapStatus::kBadBoulder : MapStatus::kPayloadCrc);
      assert_false(validation.result().usable());
    }
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_header_fields),
      cmocka_unit_test(test_no_map),
      cmocka_unit_test(test_a_second_start_forgets_the_first),
      cmocka_unit_test(test_every_truncation_is_named),
      cmocka_unit_test(test_bytes_behind_the_map_do_not_matter),
      cmocka_unit_test(test_every_single_flip_is_detected),
      cmocka_unit_test(test_versions),
      cmocka_unit_test(test_header_ranges),
      cmocka_unit_test(test_header_contradictions),
      cmocka_unit_test(test_directory),
      cmocka_unit_test(test_boulder_ranges),
      cmocka_unit_test(test_no_boulders),
      cmocka_unit_test(test_window_at_its_corners),
      cmocka_unit_test(test_window_equals_brute_force),
      cmocka_unit_test(test_window_full),
      cmocka_unit_test(test_slicing_does_not_matter),
  };
  return cmocka_run_group_tests_name("orbital_map", tests, nullptr, nullptr);
}
