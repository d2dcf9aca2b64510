// Corridors cut from a map, ranked, sent in packets over a link with losses to the flight code: whole maps
// and deltas arrive byte for byte.
#include "cmap/uplink.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "app/telecommand.hpp"
#include "core/random.hpp"
#include "ground_tools/scratch.hpp"
#include "support/cmocka.hpp"
#include "support/slices.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

using Bytes = std::vector<std::uint8_t>;
using Cell = std::pair<long, long>;

constexpr double kQuantum_m = 0.01;
constexpr double kSide_m = 120.0;

const test::Scratch scratch;
std::vector<TableBoulder> rocks;
Bytes site;
CmapContent site_content;
PlannedPath path;
Cut cut;
MapTransfer transfer;
std::vector<std::uint8_t> bank;

std::vector<TableBoulder> random_rocks(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<TableBoulder> all(count);
  for (TableBoulder& b : all) {
    b.p_map_m = Vec2(0.01 * random.below(12000) + 1000.0, 0.01 * random.below(12000) - 500.0);
    b.diameter_m = 0.15 + 0.01 * random.below(80);
    b.height_m = random.below(3) == 0 ? 0.0 : 0.4 * b.diameter_m;
    b.confidence = 0.5 + 0.05 * random.below(10);
  }
  return all;
}

Bytes map_of(const std::vector<TableBoulder>& boulders, double quantum_m = kQuantum_m, double shift_m = 0.0) {
  CmapSource source;
  source.reference_system = "EPSG:32633";
  return encode_cmap(boulders, {1000.0 + shift_m, -500.0, 1000.0 + kSide_m, -500.0 + kSide_m}, quantum_m,
                     source);
}

int make_site(void**) {
  rocks = random_rocks(3000, 1);
  site = map_of(rocks);
  site_content = decode_cmap(site, "site.cmap");
  path = path_of({Vec2(1010, -480), Vec2(1050, -470), Vec2(1050, -470), Vec2(1060, -420), Vec2(1100, -390)});
  return 0;
}

Cell cell_of(const Vec2& p_map_m) {
  return {std::lround(p_map_m.x() / kQuantum_m), std::lround(p_map_m.y() / kQuantum_m)};
}
std::set<Cell> cells_of(const std::vector<TableBoulder>& boulders) {
  std::set<Cell> cells;
  for (const TableBoulder& b : boulders) cells.insert(cell_of(b.p_map_m));
  return cells;
}

Cut cut_site(const UplinkParams& params = {}) {
  return cut_corridor(site, "site.cmap", path, params, std::nullopt);
}

/// Least of distance minus reach over points of the path 1 cm apart: negative within the corridor.
double beyond_reach_m(const Vec2& p, const UplinkParams& params) {
  double least = 1e9;
  for (std::size_t i = 1; i < path.p_map_m.size(); ++i) {
    const Vec2 a = path.p_map_m[i - 1];
    const Vec2 along = path.p_map_m[i] - a;
    for (double s = 0.0; s <= along.norm(); s += 0.01) {
      const double reach = reach_m(params, path.s_m[i - 1] + s);
      least = std::min(least, (a + along * (s / along.norm()) - p).norm() - reach);
    }
  }
  return least;
}

void test_path(void**) {
  assert_int_equal(path.p_map_m.size(), 4);  // a point that is given twice counts once
  assert_near(path.s_m[1], std::sqrt(1700.0), 1e-9);
  assert_near(path.length_m(), std::sqrt(1700.0) + std::sqrt(2600.0) + 50.0, 1e-9);
}

void test_reach_grows_and_starts_anew_at_fixes(void**) {
  UplinkParams params;
  params.half_width_m = 3.0;
  params.drift = 0.05;
  assert_near(reach_m(params, 0.0), 3.0, 0.0);
  assert_near(reach_m(params, 100.0), 8.0, 1e-12);
  params.fix_every_m = 30.0;
  assert_near(reach_m(params, 29.0), 4.45, 1e-12);
  assert_near(reach_m(params, 31.0), 3.05, 1e-12);
}

/// Against distances to many points of the path. Reach is constant on a metre of the way: half of its growth
/// there is what the two may differ by.
void test_what_is_in_the_corridor(void**) {
  UplinkParams params;
  params.half_width_m = 3.0;
  params.drift = 0.04;
  cut = cut_site(params);
  const std::set<Cell> sent = cells_of(decode_cmap(cut.map, "cut").boulders);
  assert_int_equal(sent.size(), cut.boulders);
  assert_int_equal(cut.boulders, cut.corridor_boulders);
  std::size_t inside = 0;
  for (const TableBoulder& b : site_content.boulders) {
    const double beyond_m = beyond_reach_m(b.p_map_m, params);
    if (std::fabs(beyond_m) < 0.03) continue;
    const bool is_sent = sent.count(cell_of(b.p_map_m)) > 0;
    assert_true(is_sent == (beyond_m < 0.0));
    inside += is_sent ? 1U : 0U;
  }
  assert_true(inside > 100);
  assert_int_equal(cut.map_boulders, site_content.boulders.size());
}

/// Sizes, heights and confidences go over as they were; so does what is told of the image.
void test_boulders_go_over_as_they_are(void**) {
  cut = cut_site();
  const CmapContent content = decode_cmap(cut.map, "cut");
  for (const TableBoulder& b : content.boulders) {
    bool found = false;
    for (const TableBoulder& old : site_content.boulders) {
      if (cell_of(old.p_map_m) != cell_of(b.p_map_m)) continue;
      found = true;
      assert_near((old.p_map_m - b.p_map_m).norm(), 0.0, 1e-6);
      assert_near(old.diameter_m, b.diameter_m, 0.0);
      assert_near(old.height_m, b.height_m, 0.0);
      assert_near(old.confidence, b.confidence, 0.0);
    }
    assert_true(found);
  }
  assert_string_equal(content.reference_system.c_str(), "EPSG:32633");
  assert_int_equal(content.revision, site_content.revision);
  // Whole tiles around the corridor, on the grid of the map.
  const double tile_m = content.tile_m;
  const double columns = (content.extent.min_x_m - site_content.extent.min_x_m) / tile_m;
  assert_near(columns, std::round(columns), 1e-6);
  assert_true(content.extent.min_x_m <= cut.box.min_x_m && content.extent.min_x_m > cut.box.min_x_m - tile_m);
  assert_true(content.extent.max_y_m >= cut.box.max_y_m - kQuantum_m &&
              content.extent.max_y_m < cut.box.max_y_m + tile_m);
}

void test_a_path_to_the_maps_edge(void**) {
  const PlannedPath along =
      path_of({Vec2(1000, -500), Vec2(1000 + kSide_m, -500), Vec2(1000 + kSide_m, -380)});
  cut = cut_corridor(site, "site.cmap", along, {}, std::nullopt);
  assert_near(cut.box.min_x_m, 1000.0, 1e-6);
  assert_near(cut.box.max_x_m, 1000.0 + kSide_m, 0.02);
  assert_status(validate_cmap(cut.map), MapStatus::kUsable);
}

void test_budgets(void**) {
  const Cut all = cut_site();
  const std::size_t whole = link_bytes(all.upload.plan);
  UplinkParams params;
  params.budget_bytes = whole;
  assert_true(cut_site(params).map == all.map);
  std::size_t before = 0;
  for (std::size_t budget = 600; budget < whole; budget += 150) {
    params.budget_bytes = budget;
    cut = cut_site(params);
    assert_true(link_bytes(cut.upload.plan) <= budget);
    assert_true(cut.boulders >= before && cut.boulders < all.boulders);
    before = cut.boulders;
    // The best are kept, in the order of their use.
    std::size_t kept = 0;
    for (std::size_t i = 0; i < cut.tiles.size(); ++i) {
      if (i > 0) assert_true(cut.tiles[i].use_per_byte <= cut.tiles[i - 1].use_per_byte);
      if (i > 0 && cut.tiles[i].kept) assert_true(cut.tiles[i - 1].kept);
      kept += cut.tiles[i].kept ? cut.tiles[i].boulders : 0U;
    }
    assert_int_equal(kept, cut.boulders);
  }
  params.budget_bytes = 150;
  assert_refused(cut_site(params), "--budget");
}

/// A tile in sight over a long way, full, and near comes before others.
void test_use(void**) {
  std::vector<TableBoulder> boulders;
  const auto put = [&](double x, double y, int count) {
    for (int i = 0; i < count; ++i) {
      TableBoulder b;
      b.p_map_m = Vec2(x + 0.1 * (i % 5), y + 0.1 * (i / 5));
      b.diameter_m = 0.3;
      boulders.push_back(b);
    }
  };
  put(1005, -495, 20);  // near the start, beside the path
  put(1105, -495, 20);  // the same at its end
  put(1055, -491, 20);  // half-way, at the corridor's rim
  put(1065, -495, 2);   // two alone
  const Bytes map = map_of(boulders);
  UplinkParams params;
  params.half_width_m = 5.0;
  params.drift = 0.0;
  params.tile_m = 10.0;
  const PlannedPath straight = path_of({Vec2(1000, -495.5), Vec2(1119, -495.5)});
  cut = cut_corridor(map, "map", straight, params, std::nullopt);
  assert_int_equal(cut.tiles.size(), 4);
  const auto column = [](const RankedTile& t) { return t.tile % cut.layout.columns(); };
  assert_int_equal(column(cut.tiles[0]), 0);
  assert_int_equal(column(cut.tiles[1]), 10);
  assert_int_equal(cut.tiles[0].boulders, 20);
  assert_int_equal(cut.tiles[3].boulders, 2);
  assert_near(cut.tiles[1].first_s_m, 105.2 - 5.0, 0.5);
  // The sum of chords of circles about its boulders.
  double way_m = 0.0;
  for (int i = 20; i < 40; ++i) {
    const double off_m = boulders[i].p_map_m.y() + 495.5;
    way_m += 2.0 * std::sqrt(25.0 - off_m * off_m);
  }
  assert_near(cut.tiles[1].way_m, way_m, 0.05);
}

void test_bad_parameters(void**) {
  UplinkParams params;
  params.half_width_m = 0.0;
  assert_refused(cut_site(params), "--width");
  params.half_width_m = std::nan("");
  assert_refused(cut_site(params), "--width");
  params = {};
  params.drift = -0.01;
  assert_refused(cut_site(params), "--drift");
  params = {};
  params.fix_every_m = -1.0;
  assert_refused(cut_site(params), "--fix-every");
  params = {};
  params.tile_m = 0.01;
  assert_refused(cut_site(params), "--tile");
  params = {};
  for (const std::size_t chunk : {std::size_t{0}, std::size_t{15}, std::size_t{491}}) {
    params.chunk_bytes = chunk;
    assert_refused(cut_site(params), "--chunk");
  }
  params.chunk_bytes = 16;
  assert_int_equal(cut_site(params).upload.plan.chunk_bytes, 16);
  const auto along = [](const Vec2& a, const Vec2& b) {
    return cut_corridor(site, "site.cmap", path_of({a, b}), {}, std::nullopt);
  };
  assert_refused(along(Vec2(1010, -480), Vec2(1130, -480)), "way-point 2");
  assert_refused(along(Vec2(999, -480), Vec2(1010, -480)), "way-point 1");
  std::vector<TableBoulder> corner(1);
  corner[0].p_map_m = Vec2(1001, -400);
  corner[0].diameter_m = 0.3;
  assert_refused(cut_corridor(map_of(corner), "empty.cmap", path, {}, std::nullopt), "empty.cmap");
  assert_refused(cut_corridor({site.begin(), site.end() - 1}, "short.cmap", path, {}, std::nullopt),
                 "short.cmap");
  Bytes damaged = site;
  damaged[damaged.size() - 10] ^= 1U;
  assert_refused(cut_corridor(damaged, "site.cmap", path, {}, std::nullopt), "site.cmap");
}

/// What comes of the packets, shuffled, with losses and repeats, until the flight code has all; the map in
/// use is `base`.
void send(const Cut& c, std::uint64_t seed, const Bytes& base) {
  Random random(seed);
  bank.assign(20000, 0xEE);
  transfer = MapTransfer();
  const auto take = [](const PacketBytes& packet) {
    app::Command command;
    assert_status(app::decode(packet.data(), packet.size(), command), app::CommandStatus::kAccepted);
    return command;
  };
  const PacketBytes begin = begin_packet(c.upload, 0);
  assert_status(transfer.begin(take(begin).upload, bank.data(), bank.size()), BeginStatus::kBegun);
  const std::vector<std::uint32_t> order = send_order(c.upload, c.rank_of_tile);
  std::size_t sent_bytes = begin.size() + use_packet(c.upload, 0).size();
  for (const std::uint32_t n : order) sent_bytes += chunk_packet(c.upload, n, 0).size();
  assert_int_equal(sent_bytes, link_bytes(c.upload.plan));
  for (int rounds = 0; transfer.status() == TransferStatus::kReceiving; ++rounds) {
    assert_true(rounds < 100);
    for (std::size_t i = 0; i < order.size(); ++i) {
      const std::uint32_t number = order[random.below(static_cast<std::uint32_t>(order.size()))];
      PacketBytes packet = chunk_packet(c.upload, number, static_cast<std::uint32_t>(i));
      if (random.below(4) == 0) continue;  // lost
      if (random.below(4) == 0) {          // damaged
        packet[random.below(static_cast<std::uint32_t>(packet.size()))] ^= 0x10U;
        app::Command command;
        assert_status(app::decode(packet.data(), packet.size(), command), app::CommandStatus::kBadPacket);
        continue;
      }
      const app::Command command = take(packet);
      const ChunkStatus status = transfer.accept(command.chunk, command.chunk_bytes);
      assert_true(status == ChunkStatus::kTaken || status == ChunkStatus::kRepeated);
    }
  }
  assert_status(transfer.verify(base.data(), base.size()), TransferStatus::kVerifying);
  assert_true(test::run_in_slices(transfer) > 0);
  assert_status(transfer.status(), TransferStatus::kReady);
  assert_memory_equal(bank.data(), c.map.data(), c.map.size());
  assert_int_equal(transfer.result().count(), c.boulders);
  assert_int_equal(take(use_packet(c.upload, 9)).upload.id, transfer.record().plan.id);
}

void test_a_map_over_a_link_with_losses(void**) {
  UplinkParams params;
  for (const std::size_t chunk : {std::size_t{16}, std::size_t{100}, std::size_t{490}}) {
    params.chunk_bytes = chunk;
    cut = cut_site(params);
    assert_false(cut.is_delta);
    for (std::uint64_t seed = 1; seed <= 3; ++seed) send(cut, seed, {});
  }
}

/// A later version of the site: some boulders gone, some new, in a part of the corridor.
std::vector<TableBoulder> revised() {
  std::vector<TableBoulder> next;
  for (const TableBoulder& b : site_content.boulders) {
    const bool here = (b.p_map_m - Vec2(1050, -470)).norm() < 6.0;
    if (!here || next.size() % 3 != 0) next.push_back(b);
  }
  TableBoulder b;
  b.p_map_m = Vec2(1051.5, -468.5);
  b.diameter_m = 0.4;
  next.push_back(b);
  return next;
}

void test_a_delta_over_a_link_with_losses(void**) {
  UplinkParams params;
  params.tile_m = 10.0;
  const Cut first = cut_site(params);
  const Bytes next = map_of(revised());
  cut = cut_corridor(next, "next.cmap", path, params, BaseMap{first.map, "first.cmap"});
  assert_true(cut.is_delta);
  assert_true(cut.delta_bytes < cut.whole_bytes / 2);
  assert_true(cut.tiles_of_base > 3);
  assert_int_equal(cut.upload.bytes.size(), cut.delta_bytes);
  assert_true(cells_of(decode_cmap(cut.map, "cut").boulders) !=
              cells_of(decode_cmap(first.map, "first").boulders));
  for (std::uint64_t seed = 1; seed <= 3; ++seed) send(cut, seed, first.map);
  // What is sent whole holds the same boulders.
  const Cut whole = cut_corridor(next, "next.cmap", path, {}, std::nullopt);
  assert_true(cells_of(decode_cmap(whole.map, "whole").boulders) ==
              cells_of(decode_cmap(cut.map, "cut").boulders));
}

/// The plan goes on: what the old corridor had is not sent again, though the box is another one.
void test_a_delta_to_a_longer_path(void**) {
  const PlannedPath first_part = path_of({Vec2(1050, -480), Vec2(1080, -480)});
  const PlannedPath longer =
      path_of({Vec2(1050, -480), Vec2(1080, -480), Vec2(1080, -440), Vec2(1015, -440)});
  UplinkParams params;
  params.tile_m = 8.0;
  const Cut first = cut_corridor(site, "site.cmap", first_part, params, std::nullopt);
  cut = cut_corridor(site, "site.cmap", longer, params, BaseMap{first.map, "first.cmap"});
  assert_true(cut.is_delta);
  assert_true(cut.tiles_of_base > 2);
  assert_true(cut.layout.origin_x_m != first.layout.origin_x_m);
  send(cut, 4, first.map);
}

void test_a_delta_that_does_not_pay(void**) {
  const PlannedPath elsewhere = path_of({Vec2(1010, -400), Vec2(1030, -395)});
  const Cut first = cut_corridor(site, "site.cmap", elsewhere, {}, std::nullopt);
  cut = cut_corridor(map_of(random_rocks(3000, 2)), "other.cmap", path, {}, BaseMap{first.map, "first.cmap"});
  assert_true(cut.delta_bytes > 0);
  assert_int_equal(cut.is_delta, cut.delta_bytes < cut.whole_bytes);
  send(cut, 5, first.map);
}

void test_bases_of_another_grid(void**) {
  const auto with_base = [](Bytes bytes) {
    return cut_corridor(site, "site.cmap", path, {}, BaseMap{std::move(bytes), "base.cmap"});
  };
  assert_refused(with_base(map_of(site_content.boulders, 0.02)), "position step");
  std::vector<TableBoulder> some = rocks;
  some.erase(
      std::remove_if(some.begin(), some.end(), [](const TableBoulder& b) { return b.p_map_m.x() < 1001; }),
      some.end());
  assert_refused(with_base(map_of(some, kQuantum_m, 0.004)), "a different grid");
  CmapSource local;
  assert_refused(with_base(encode_cmap(rocks, site_content.extent, kQuantum_m, local)), "reference system");
  assert_refused(with_base({}), "base.cmap");
  // Whole steps apart is near enough: tiles then come from nowhere but the delta.
  cut = with_base(map_of(some, kQuantum_m, 0.05));
  assert_true(cut.delta_bytes > 0);
}

void test_order_of_sending(void**) {
  UplinkParams params;
  params.chunk_bytes = 16;
  params.tile_m = 10.0;
  cut = cut_site(params);
  const std::vector<std::uint32_t> order = send_order(cut.upload, cut.rank_of_tile);
  assert_int_equal(order.size(), chunks_of(cut.upload.plan));
  assert_int_equal(std::set<std::uint32_t>(order.begin(), order.end()).size(), order.size());
  // Head and directory first; then the chunks of the best tile, and so on.
  std::size_t payloads = cut.map.size();
  for (const TilePiece& piece : cut.upload.pieces) payloads = std::min(payloads, piece.offset);
  std::size_t at = 0;
  for (; order[at] * 16 < payloads; ++at) assert_int_equal(order[at], at);
  for (const RankedTile& tile : cut.tiles) {
    const TilePiece& piece = cut.upload.pieces[tile.tile];
    for (std::size_t n = piece.offset / 16; n <= (piece.offset + piece.bytes - 1) / 16; ++n) {
      const auto place = std::find(order.begin(), order.end(), n);
      assert_true(place <= order.begin() + static_cast<std::ptrdiff_t>(at));
      if (place == order.begin() + static_cast<std::ptrdiff_t>(at)) ++at;
    }
  }
  assert_int_equal(at, order.size());
}

void test_chosen_chunks(void**) {
  using Numbers = std::vector<std::uint32_t>;
  const Numbers order{4, 0, 3, 1, 2};
  assert_true(choose_chunks(order, "") == order);
  assert_true(choose_chunks(order, "2") == Numbers{2});
  assert_true((choose_chunks(order, "0-1,4,1") == Numbers{4, 0, 1}));
  assert_true(choose_chunks(order, "0-4") == order);
  for (const char* bad : {"5", "0-5", "3-1", "-1", "1-", "a", ",", "1,", "1 2", "99999999999999999999"})
    assert_refused(choose_chunks(order, bad), "--only");
}

void test_too_many_chunks(void**) {
  assert_refused(make_upload(UploadKind::kMap, Bytes(16 * cfg::kMaxMapChunks + 1), {}, 16), "--chunk");
  assert_int_equal(chunks_of(make_upload(UploadKind::kMap, Bytes(16 * cfg::kMaxMapChunks), {}, 16).plan),
                   cfg::kMaxMapChunks);
}

void test_report(void**) {
  UplinkParams params;
  params.budget_bytes = 1500;
  cut = cut_site(params);
  const nlohmann::json report = nlohmann::json::parse(to_json(cut, params, 0));
  assert_int_equal(report["boulders"]["sent"], cut.boulders);
  assert_int_equal(report["boulders"]["corridor"], cut.corridor_boulders);
  assert_int_equal(report["bytes"]["link"], link_bytes(cut.upload.plan));
  assert_true(report["bytes"].count("delta") == 0);
  assert_int_equal(report["upload"]["chunks"], chunks_of(cut.upload.plan));
  assert_int_equal(report["ranked"].size(), cut.tiles.size());
  assert_near(report["path_m"], path.length_m(), 1e-9);
  assert_near(report["corridor"]["half_width_at_end_m"], reach_m(params, path.length_m()), 1e-9);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_path),
      cmocka_unit_test(test_reach_grows_and_starts_anew_at_fixes),
      cmocka_unit_test(test_what_is_in_the_corridor),
      cmocka_unit_test(test_boulders_go_over_as_they_are),
      cmocka_unit_test(test_a_path_to_the_maps_edge),
      cmocka_unit_test(test_budgets),
      cmocka_unit_test(test_use),
      cmocka_unit_test(test_bad_parameters),
      cmocka_unit_test(test_a_map_over_a_link_with_losses),
      cmocka_unit_test(test_a_delta_over_a_link_with_losses),
      cmocka_unit_test(test_a_delta_to_a_longer_path),
      cmocka_unit_test(test_a_delta_that_does_not_pay),
      cmocka_unit_test(test_bases_of_another_grid),
      cmocka_unit_test(test_order_of_sending),
      cmocka_unit_test(test_chosen_chunks),
      cmocka_unit_test(test_too_many_chunks),
      cmocka_unit_test(test_report),
  };
  return cmocka_run_group_tests(tests, make_site, nullptr);
}
