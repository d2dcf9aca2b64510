// The rover's own hardware from a picture: cells, the boxes of the mission's table, refusals.
#include "dataset/hardware_mask.hpp"

#include <functional>

#include "base/tool_error.hpp"
#include "core/random.hpp"
#include "ground_tools/scratch.hpp"
#include "ground_tools/test_images.hpp"

using namespace cairn;
using namespace cairn::ground;
using cairn::test::Scratch;

namespace {

const Scratch scratch;
constexpr int kCell = OwnHardware::kCell_px;

std::filesystem::path draw(int width, int height, const std::function<int(int, int)>& grey) {
  const std::filesystem::path path = scratch.path("mask.png");
  test::write_image(path, "PNG", GDT_Byte, width, height, 1, [&](int, int x, int y) { return grey(x, y); });
  return path;
}

std::string refusal(const std::filesystem::path& path) {
  try {
    static_cast<void>(read_hardware_mask(path));
  } catch (const ToolError& error) {
    return error.what();
  }
  return {};
}

bool has(const std::string& text, const char* word) { return text.find(word) != std::string::npos; }

/// A cell is covered where the drawing has a light pixel in it, and nowhere else.
void test_cells_are_those_of_the_drawing(void**) {
  const auto light = [](int u, int v) { return v >= 300 + u / 8 || (u == 5 && v == 7); };
  const HardwareMask mask =
      read_hardware_mask(draw(400, 350, [&](int u, int v) { return light(u, v) ? 128 : 127; }));
  assert_int_equal(mask.width_px, 400);
  assert_int_equal(mask.height_px, 350);
  int covered = 0;
  for (int row = 0; row * kCell < 350; ++row) {
    for (int column = 0; column * kCell < 400; ++column) {
      bool expected = false;
      for (int v = row * kCell; v < (row + 1) * kCell && v < 350; ++v) {
        for (int u = column * kCell; u < (column + 1) * kCell && u < 400; ++u)
          expected = expected || light(u, v);
      }
      assert_true(mask.own.covers_cell(column, row) == expected);
      covered += expected ? 1 : 0;
    }
  }
  assert_near(mask.covered, covered / (50.0 * 44.0), 1e-12);
}

/// On a raw image: where the table says that a rectified pixel comes from, 24 px farther right and 16 lower.
void test_a_drawing_on_a_raw_image(void**) {
  constexpr int kWidth = 200, kHeight = 160;
  static RemapTable table;
  table.width_px = kWidth;
  table.height_px = kHeight;
  const int columns = remap::nodes_along(kWidth, remap::kSpacing);
  for (int r = 0; r < remap::nodes_along(kHeight, remap::kSpacing); ++r) {
    for (int c = 0; c < columns; ++c)
      table.nodes[static_cast<std::size_t>(r * columns + c)] = {
          (c * remap::kSpacing + 24) << remap::kFractionBits, (r * remap::kSpacing + 16)
                                                                  << remap::kFractionBits};
  }
  CameraModel raw;
  raw.width_px = 240;
  raw.height_px = 192;
  const auto deck = [](int u, int v) { return u >= 104 && v >= 96 ? 255 : 0; };
  const HardwareMask mask = read_hardware_mask(draw(240, 192, deck), raw, table);
  assert_true(mask.width_px == kWidth && mask.height_px == kHeight);
  for (int row = 0; row * kCell < kHeight; ++row) {
    for (int column = 0; column * kCell < kWidth; ++column)
      assert_true(mask.own.covers_cell(column, row) == (column * kCell >= 80 && row * kCell >= 80));
  }
  for (const auto& [width, height] : {std::pair(kWidth, 192), {240, kHeight}})
    assert_refused(read_hardware_mask(draw(width, height, deck), raw, table),
                   "the raw left images 240 x 192");
}

/// What the table says is what was drawn, whatever that is, and it is short where the drawing is simple.
void test_boxes_give_the_same_cells(void**) {
  Random random(7);
  for (const std::uint32_t one_in : {2U, 5U, 50U}) {
    OwnHardware own;
    for (int row = 0; row < OwnHardware::kRows; ++row) {
      for (int column = 0; column < OwnHardware::kColumns; ++column) {
        if (random.below(one_in) == 0)
          own.cover({column * kCell, row * kCell, column * kCell + 1, row * kCell + 1});
      }
    }
    OwnHardware again;
    for (const PixelBox& box : boxes_of(own)) again.cover(box);
    for (int row = 0; row < OwnHardware::kRows; ++row) {
      for (int column = 0; column < OwnHardware::kColumns; ++column)
        assert_true(again.covers_cell(column, row) == own.covers_cell(column, row));
    }
  }
  OwnHardware deck;
  deck.cover({0, 240, cfg::kImageWidth, cfg::kImageHeight});
  deck.cover({80, 160, 160, 240});
  assert_int_equal(boxes_of(deck).size(), 2);
}

void test_header(void**) {
  const HardwareMask mask = read_hardware_mask(draw(512, 384, [](int, int v) { return v < 240 ? 0 : 255; }));
  const std::string header = hardware_header(mask, "rover.png");
  assert_true(has(header, "    {0, 240, 512, 384},\n};\n"));
  assert_true(has(header, "cairn mask rover.png"));
  assert_true(has(header, "38 % of 512 x 384"));
  assert_true(has(header, "#pragma once"));
}

void test_refusals(void**) {
  assert_true(has(refusal(draw(512, 384, [](int, int) { return 0; })), "black"));
  assert_true(has(refusal(draw(512, 384, [](int, int) { return 255; })), "white"));
  assert_true(has(refusal(draw(cfg::kImageWidth + 1, 64, [](int u, int) { return u; })), "MISSION"));
  scratch.file("none.png", "no picture");
  assert_true(has(refusal(scratch.path("none.png")), "none.png"));
  assert_true(has(refusal(scratch.path("nowhere.png")), "nowhere.png"));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_cells_are_those_of_the_drawing),
      cmocka_unit_test(test_a_drawing_on_a_raw_image),
      cmocka_unit_test(test_boxes_give_the_same_cells),
      cmocka_unit_test(test_header),
      cmocka_unit_test(test_refusals),
  };
  return cmocka_run_group_tests_name("ground_tools/dataset/hardware_mask", tests, nullptr, nullptr);
}
