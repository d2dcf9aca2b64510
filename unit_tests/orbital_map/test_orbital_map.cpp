// The flight map: validation of damaged and contradictory bytes, windows by position.
#include "orbital_map/orbital_map.hpp"

#include <limits>

#include "core/random.hpp"
#include "orbital_map/map_reader.hpp"
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

const GridBoulder kFew[] = {{0, 0, 0, 150},    {0, 999, 999, 38400}, {1, 500, 20, 75},
                            {3, 10, 700, 300}, {3, 11, 700, 600},    {5, 999, 0, 1200}};

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
  assert_near(m.extent_m().x(), 29.99, 1e-12);
  assert_near(m.extent_m().y(), 18.99, 1e-12);
  assert_int_equal(m.parameter_hash(), 0xCAFE0123U);
  assert_int_equal(m.damaged_tiles(), 0);
  assert_int_equal(m.tiles(), kColumns * kRows);
  assert_int_equal(m.columns(), kColumns);
  assert_near(m.pixel_m(), 0.25, 0.0);
}

// The pixel chooses which boulders a map is matched by: what cannot be one counts as not known.
void test_pixel_that_is_none(void**) {
  for (const float pixel :
       {0.0F, -0.25F, 0.0005F, 101.0F, 1.0e-42F, static_cast<float>(kInf), static_cast<float>(kNaN)}) {
    make_few();
    be::put_f32(map.bytes + 64, pixel);
    test::seal(map);
    assert_near(usable_map().pixel_m(), 0.0, 0.0);
  }
  assert_near(OrbitalMap().pixel_m(), 0.0, 0.0);
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

/// A flip of its lowest bit makes version 3 of version 2, which this is not.
MapStatus expected_for_flip_of(std::size_t bit) {
  const std::size_t byte = bit / 8;
  if (byte < 4) return MapStatus::kBadMagic;
  if (byte == 4 && bit % 8 > 0) return MapStatus::kUnknownVersion;
  if (byte < kMapHeader) return MapStatus::kHeaderCrc;
  return byte < map.payloads() ? MapStatus::kDirectoryCrc : MapStatus::kDamaged;
}

void flip(MapBytes& m, std::size_t bit) {
  m.bytes[bit / 8] = static_cast<std::uint8_t>(m.bytes[bit / 8] ^ 1U << bit % 8);
}

void test_every_single_flip_is_detected(void**) {
  make_few();
  for (std::size_t bit = 0; bit < 8 * map.size; ++bit) {
    flip(map, bit);
    const MapStatus status = validate(map, map.size);
    // A length of the head that cannot be is told as damage, one beyond the bank as a lack of bytes.
    if (bit / 8 == 8 || bit / 8 == 9) {
      assert_true(status == MapStatus::kHeaderCrc || status == MapStatus::kTruncated);
    } else {
      assert_status(status, expected_for_flip_of(bit));
    }
    flip(map, bit);
  }
  assert_status(validate(map, map.size), MapStatus::kUsable);
}

void test_double_flips_are_detected(void**) {
  make_few();
  Random random(8);
  const auto bits = static_cast<std::uint32_t>(8 * map.size);
  for (int trial = 0; trial < 20000; ++trial) {
    const std::uint32_t first = random.below(bits);
    const std::uint32_t second = (first + 1 + random.below(bits - 1)) % bits;
    flip(map, first);
    flip(map, second);
    assert_true(validate(map, map.size) != MapStatus::kUsable);
    flip(map, first);
    flip(map, second);
  }
}

Vec2 position(const GridBoulder& b) {
  return kOrigin + kQuantum * Vec2(b.tile % kColumns * kSide + b.x, b.tile / kColumns * kSide + b.y);
}

/// The boulders of all tiles but one, exactly.
void check_all_but(const OrbitalMap& m, unsigned bad_tile, unsigned bad_boulders) {
  assert_int_equal(m.damaged_tiles(), 1);
  assert_int_equal(m.count(), 6 - bad_boulders);
  out.clear();
  assert_status(m.window(kOrigin, 1000.0, out), WindowStatus::kDamaged);
  std::size_t next = 0;
  for (const GridBoulder& b : kFew) {
    if (b.tile == bad_tile) continue;
    assert_true(next < out.size() && out[next].p_map_m == position(b));
    assert_near(out[next++].diameter_m, b.diameter_mm * 0.001, 1e-5);
  }
  assert_int_equal(next, out.size());
}

void test_a_damaged_tile_is_left_out(void**) {
  for (const unsigned tile : {0U, 1U, 3U, 5U}) {
    make_few();
    map.bytes[map.payload(tile) + 6] ^= 4U;
    MapValidation validation;
    assert_status(validation.start(map.bytes, map.size), MapStatus::kChecking);
    WorkBudget budget = WorkBudget::unlimited();
    assert_status(validation.step(budget), Progress::kDone);
    assert_status(validation.status(), MapStatus::kDamaged);
    check_all_but(validation.result(), tile, tile == 0 || tile == 3 ? 2 : 1);
    out.clear();  // elsewhere nothing is known to be missing
    const GridBoulder& other = kFew[tile == 5 ? 0 : 5];
    assert_status(validation.result().window(position(other), 1.0, out), WindowStatus::kUsable);
  }
}

void test_no_tile_that_holds(void**) {
  make_few();
  for (const unsigned tile : {0U, 1U, 3U, 5U}) map.bytes[map.payload(tile)] ^= 1U;
  assert_status(validate(map, map.size), MapStatus::kPayloadCrc);
}

void test_an_upset_after_validation(void**) {
  make_few();
  const OrbitalMap m = usable_map();
  map.bytes[map.payload(1) + 5] ^= 16U;
  out.clear();
  assert_status(m.window(kOrigin, 1000.0, out), WindowStatus::kDamaged);
  assert_int_equal(out.size(), 5);
  map.bytes[map.payload(1) + 5] ^= 16U;
  for (unsigned tile = 0; tile < map.tiles; ++tile) {  // of the directory: both tiles about it
    for (const unsigned bit : {1U, 0x80U}) {
      map.entry(tile)[0] = static_cast<std::uint8_t>(map.entry(tile)[0] ^ bit);
      out.clear();
      assert_status(m.window(kOrigin, 1000.0, out), WindowStatus::kDamaged);
      assert_true(out.size() < 6);
      map.entry(tile)[0] = static_cast<std::uint8_t>(map.entry(tile)[0] ^ bit);
    }
  }
  out.clear();
  assert_status(m.window(kOrigin, 1000.0, out), WindowStatus::kUsable);
  assert_int_equal(out.size(), 6);
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
  for (const unsigned version : {0U, 1U, 4U, 255U}) {
    assert_status(after([=](std::uint8_t* h) { h[4] = static_cast<std::uint8_t>(version); }),
                  MapStatus::kUnknownVersion);
  }
}

void test_header_ranges(void**) {
  for (const std::size_t field : {std::size_t{20}, std::size_t{28}}) {
    for (const double value : {kNaN, kInf, 1.001e8, -1.001e8, 0x1p-1074, -0x1.8p-1023}) {
      assert_status(after([=](std::uint8_t* h) { be::put_f64(h + field, value); }), MapStatus::kBadHeader);
    }
    for (const double value : {1e8, -1e8, 0.0, -0.0, 0x1p-1022}) {
      assert_status(after([=](std::uint8_t* h) { be::put_f64(h + field, value); }), MapStatus::kUsable);
    }
  }
  struct {
    std::size_t field;
    std::uint32_t value;
  } const bad[] = {{36, 0},        {36, 0x80000000U}, {36, 0x7FFFFFFFU},
                   {40, 0},        {40, 0xFFFFFFFFU}, {44, 99},
                   {44, 10000001}, {48, 0},           {48, (1U << 21U) + 1}};
  for (const auto& b : bad) {
    assert_status(after([=](std::uint8_t* h) { be::put_u32(h + b.field, b.value); }), MapStatus::kBadHeader);
  }
  for (const std::uint32_t quantum : {100U, 10000000U})
    assert_status(after([=](std::uint8_t* h) { be::put_u32(h + 44, quantum); }), MapStatus::kUsable);
  for (const unsigned flags : {0U, 3U, 4U, 5U, 8U, 9U, 0x81U})
    assert_status(after([=](std::uint8_t* h) { h[5] = static_cast<std::uint8_t>(flags); }),
                  MapStatus::kBadHeader);
  for (const unsigned width : {0U, 1U, 5U, 255U})
    assert_status(after([=](std::uint8_t* h) { h[6] = static_cast<std::uint8_t>(width); }),
                  MapStatus::kBadHeader);
}

void test_header_contradictions(void**) {
  assert_status(after([](std::uint8_t* h) { be::put_u32(h + 12, be::get_u32(h + 12) + 1U); }),
                MapStatus::kTruncated);
  assert_status(after([](std::uint8_t* h) { be::put_u32(h + 12, kMapHeader + 11U); }), MapStatus::kBadHeader);
  assert_status(after([](std::uint8_t* h) { be::put_u32(h + 48, 1); }), MapStatus::kBadHeader);  // tiles
  for (const unsigned length : {9U, 11U, 25U, 26U, 255U})
    assert_status(after([=](std::uint8_t* h) { h[76] = static_cast<std::uint8_t>(length); }),
                  MapStatus::kBadHeader);
  for (const unsigned c : {0U, 31U, 127U, 200U})
    assert_status(after([=](std::uint8_t* h) { h[test::kMapText + 3] = static_cast<std::uint8_t>(c); }),
                  MapStatus::kBadHeader);
}

void test_models(void**) {
  for (const unsigned classes : {0U, 8U, 12U, 33U, 255U})
    assert_status(after([=](std::uint8_t* h) { h[test::kMapModel] = static_cast<std::uint8_t>(classes); }),
                  MapStatus::kBadHeader);
  assert_status(after([](std::uint8_t* h) { be::put_u16(h + test::kMapModel + 1, 0); }),
                MapStatus::kBadHeader);
  // 128 * 2^9 is more than 65535 mm, 127 * 2^9 is not.
  assert_status(after([](std::uint8_t* h) { be::put_u16(h + test::kMapModel + 1, 128); }),
                MapStatus::kBadHeader);
  assert_status(after([](std::uint8_t* h) { be::put_u16(h + test::kMapModel + 1, 127); }),
                MapStatus::kUsable);
  assert_status(after([](std::uint8_t* h) { h[test::kMapModel + 3] = 129; }), MapStatus::kUsable);
  assert_status(after([](std::uint8_t* h) { h[test::kMapModel + 10] = 1; }),
                MapStatus::kBadHeader);                       // padding
  for (unsigned length = 0; length < kMapHeader; ++length) {  // a head that ends early, and says so
    make_few();
    damaged = map;
    be::put_u16(damaged.bytes + 8, static_cast<std::uint16_t>(length));
    if (length >= 4) be::put_u32(damaged.bytes + length - 4, crc32(damaged.bytes, length - 4));
    const MapStatus status = validate(damaged, damaged.size);
    assert_true(!may_be_used(status) && status != MapStatus::kNoBoulders);
  }
}

void test_directory(void**) {
  assert_status(after([](std::uint8_t* h) { be::put_u16(h + kMapHeader, 1); }), MapStatus::kBadDirectory);
  for (std::size_t entry = 1; entry < 6; ++entry) {
    assert_status(after([=](std::uint8_t* h) { be::put_u16(h + kMapHeader + 2 * entry, 0xFFFF); }),
                  MapStatus::kBadDirectory);
  }
  assert_status(after([](std::uint8_t* h) { be::put_u32(h + 16, 7); }), MapStatus::kBadDirectory);
  assert_status(after([](std::uint8_t* h) { be::put_u32(h + 16, 5); }), MapStatus::kBadDirectory);
  make_few();  // good tiles of another map: each holds, but they are not the head's
  be::put_u32(map.bytes + 68, 0);
  be::put_u32(map.bytes + kMapHeader - 4, crc32(map.bytes, kMapHeader - 4));
  assert_status(validate(map, map.size), MapStatus::kPayloadCrc);
}

/// A tile whose CRC holds although it contradicts itself; the others stay.
template <typename Change>
void check_tile_contradiction(unsigned tile, const Change& change) {
  make_few();
  change(map.bytes + map.payload(tile));
  test::seal_tile(map, tile);
  test::seal(map);
  MapValidation validation;
  assert_status(validation.start(map.bytes, map.size), MapStatus::kChecking);
  WorkBudget budget = WorkBudget::unlimited();
  assert_status(validation.step(budget), Progress::kDone);
  assert_status(validation.status(), MapStatus::kDamaged);
  check_all_but(validation.result(), tile, tile == 0 || tile == 3 ? 2 : 1);
}

void test_tile_contradictions(void**) {
  for (const unsigned tile : {0U, 1U, 3U, 5U}) {
    make_few();
    const std::size_t coded = map.payload(tile + 1) - map.payload(tile) - 4;
    const std::size_t stream = be::get_u16(map.bytes + map.payload(tile) + 3);
    for (const unsigned count : {0U, 3U, 4U, 4096U, 4097U, 65535U}) {
      check_tile_contradiction(tile,
                               [=](std::uint8_t* p) { be::put_u16(p, static_cast<std::uint16_t>(count)); });
    }
    check_tile_contradiction(tile, [](std::uint8_t* p) { p[2] = 21; });
    check_tile_contradiction(tile, [](std::uint8_t* p) { p[2] = 255; });
    for (const std::size_t bytes :
         {std::size_t{0}, stream - 1, stream + 1, coded - 5, coded - 4, std::size_t{65535}})
      check_tile_contradiction(
          tile, [=](std::uint8_t* p) { be::put_u16(p + 3, static_cast<std::uint16_t>(bytes)); });
    check_tile_contradiction(tile, [=](std::uint8_t* p) { p[coded - 1] |= 1U; });  // padding
    check_tile_contradiction(tile,
                             [=](std::uint8_t* p) { std::memset(p + 5 + stream, 0xFF, coded - 5 - stream); });
  }
  // The first gap of tile 0 leads beyond what leaves room for the second boulder.
  check_tile_contradiction(0, [](std::uint8_t* p) { p[5 + be::get_u16(p + 3)] = 0xFF; });
}

void test_tiles_do_not_pass_for_each_other(void**) {
  const GridBoulder twins[] = {{0, 5, 5, 300}, {1, 5, 5, 600}};
  test::make_map(map, 2, 1, kSide, kQuantum, twins, 2);
  const std::size_t bytes = map.payload(1) - map.payload(0);
  assert_int_equal(map.payload(2) - map.payload(1), bytes);
  std::memcpy(damaged.bytes, map.bytes + map.payload(0), bytes);
  std::memcpy(map.bytes + map.payload(0), map.bytes + map.payload(1), bytes);
  std::memcpy(map.bytes + map.payload(1), damaged.bytes, bytes);
  assert_status(validate(map, map.size), MapStatus::kPayloadCrc);
}

void test_no_boulders(void**) {
  test::make_map(map, kColumns, kRows, kSide, kQuantum, nullptr, 0);
  assert_status(validate(map, map.size), MapStatus::kNoBoulders);
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
    const unsigned tile = i * kColumns * kRows / count;
    const unsigned row = i == 0 || many[i - 1].tile != tile ? 0 : many[i - 1].y + 1;
    many[i] = {tile, random.below(kSide), row, 75U << random.below(test::kSizes)};
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
    // Between the grid's distances near the tiles' edges.
    const double radius_m = 0.01 * random.below(1200) + 0.0051;
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

/// The reader gives what window() gives, in the same order, however it is sliced.
void test_reader_equals_window(void**) {
  make_many(2000);
  const OrbitalMap m = usable_map();
  Random random(6);
  for (int trial = 0; trial < 60; ++trial) {
    const Vec2 p = kOrigin + 0.01 * Vec2(static_cast<int>(random.below(4000)) - 500,
                                         static_cast<int>(random.below(3000)) - 500);
    const double radius_m = trial == 0 ? 1e30 : 0.01 * random.below(1200) + 0.0051;
    out.clear();
    const bool any = m.window(p, radius_m, out) == WindowStatus::kUsable;
    for (const std::uint32_t ops : {1U, 700U, UINT32_MAX}) {
      MapReader reader;
      assert_status(reader.start(m, p, radius_m), WindowStatus::kUsable);
      MapReader::Chunk chunk;
      std::size_t next = 0;
      for (Progress progress = Progress::kMore; progress == Progress::kMore;) {
        WorkBudget budget(ops);
        progress = reader.step(budget, chunk);
        if (ops != UINT32_MAX) assert_at_most(budget.spent(), ops + 800.0);
        for (const MapBoulder& b : chunk) {
          assert_true(next < out.size());
          assert_memory_equal(&b, &out[next], sizeof b.p_map_m);
          assert_true(b.diameter_m == out[next].diameter_m);
          ++next;
        }
      }
      assert_int_equal(next, out.size());
      assert_int_equal(next > 0, any);
      assert_int_equal(reader.damaged_tiles(), 0);
    }
  }
}

/// A tile upset after validation is left out and counted; the others are given.
void test_reader_leaves_out_a_bad_tile(void**) {
  make_few();
  const OrbitalMap m = usable_map();
  map.bytes[map.payload(kFew[0].tile)] ^= 0x10U;
  MapReader reader;
  MapReader::Chunk chunk;
  assert_status(reader.start(m, kOrigin, 1e3), WindowStatus::kUsable);
  std::size_t given = 0;
  WorkBudget budget = WorkBudget::unlimited();
  for (Progress p = Progress::kMore; p == Progress::kMore; given += chunk.size())
    p = reader.step(budget, chunk);
  std::size_t elsewhere = 0;
  for (const GridBoulder& b : kFew) elsewhere += b.tile != kFew[0].tile ? 1 : 0;
  assert_int_equal(given, elsewhere);
  assert_int_equal(reader.damaged_tiles(), 1);
  assert_status(reader.start(OrbitalMap(), kOrigin, 1.0), WindowStatus::kNoMap);
  assert_status(reader.start(m, kOrigin, kNaN), WindowStatus::kBadInput);
  assert_true(reader.step(budget, chunk) == Progress::kDone);
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
    assert_at_most(budget.spent(), ops + 800.0);
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
  for (const bool sealed : {false, true}) {  // by its CRC, by its bits
    make_many(1500);
    map.bytes[map.payload(6) - 5] ^= 1U;
    if (sealed) test::seal_tile(map, 5), test::seal(map);
    for (const std::uint32_t ops : {1U, 700U, UINT32_MAX}) {
      MapValidation validation;
      assert_true(steps_to_validate(validation, map, ops) > 0);
      assert_status(validation.status(), MapStatus::kDamaged);
      assert_int_equal(validation.result().count(), 1250);
    }
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_header_fields),
      cmocka_unit_test(test_pixel_that_is_none),
      cmocka_unit_test(test_no_map),
      cmocka_unit_test(test_a_second_start_forgets_the_first),
      cmocka_unit_test(test_every_truncation_is_named),
      cmocka_unit_test(test_bytes_behind_the_map_do_not_matter),
      cmocka_unit_test(test_every_single_flip_is_detected),
      cmocka_unit_test(test_double_flips_are_detected),
      cmocka_unit_test(test_a_damaged_tile_is_left_out),
      cmocka_unit_test(test_no_tile_that_holds),
      cmocka_unit_test(test_an_upset_after_validation),
      cmocka_unit_test(test_versions),
      cmocka_unit_test(test_header_ranges),
      cmocka_unit_test(test_header_contradictions),
      cmocka_unit_test(test_directory),
      cmocka_unit_test(test_models),
      cmocka_unit_test(test_tile_contradictions),
      cmocka_unit_test(test_tiles_do_not_pass_for_each_other),
      cmocka_unit_test(test_no_boulders),
      cmocka_unit_test(test_window_at_its_corners),
      cmocka_unit_test(test_window_equals_brute_force),
      cmocka_unit_test(test_reader_equals_window),
      cmocka_unit_test(test_reader_leaves_out_a_bad_tile),
      cmocka_unit_test(test_window_full),
      cmocka_unit_test(test_slicing_does_not_matter),
  };
  return cmocka_run_group_tests_name("orbital_map", tests, nullptr, nullptr);
}
