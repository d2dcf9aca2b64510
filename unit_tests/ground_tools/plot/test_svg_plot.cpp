// The picture: what is in it, where things lie, and what it refuses. How it looks is for the eye.
#include "plot/svg_plot.hpp"

#include "ground_tools/scratch.hpp"
#include "ground_tools/test_images.hpp"
#include "plot/ortho_piece.hpp"

using namespace cairn;
using namespace cairn::ground;
using cairn::test::Scratch;

namespace {

const Scratch scratch;
std::string svg;

bool has(const char* words) { return svg.find(words) != std::string::npos; }

int count(const char* words) {
  int found = 0;
  for (std::size_t at = svg.find(words); at != std::string::npos; at = svg.find(words, at + 1)) ++found;
  return found;
}

/// A GeoTIFF of 40 x 20 pixels of 0.1 m, upper left corner at (100, 50): grey rises to the east.
std::filesystem::path write_ortho(const char* name, double turn = 0.0) {
  const std::filesystem::path path = scratch.path(name);
  test::write_image(path, "GTiff", GDT_Byte, 40, 20, 1, [](int, int x, int) { return 5 * x; });
  const std::unique_ptr<GDALDataset> data(GDALDataset::Open(path.c_str(), GDAL_OF_UPDATE));
  double gt[6] = {100.0, 0.1, turn, 50.0, 0.0, -0.1};
  assert_int_equal(data->SetGeoTransform(gt), CE_None);
  return path;
}

ReplayPlot straight_drive() {
  ReplayPlot plot;
  plot.title = "a < b & \"c\"";
  for (int i = 0; i <= 10; ++i) {
    plot.truth_map_m.emplace_back(0.1 * i, 0.0);
    plot.vo_map_m.emplace_back(0.1 * i, 0.02 * i);
    plot.vo_error.push_back({0.1 * i, 0.02 * i});
  }
  return plot;
}

void test_only_what_is_there(void**) {
  svg = render_svg(straight_drive());
  assert_true(has("a &lt; b &amp; &quot;c&quot;"));
  assert_true(has("true path") && has("VO alone") && has("0.200 m at the end"));
  assert_false(has("corrected") || has("boulder") || has("fix") || has("<image"));
  assert_int_equal(count("<svg"), 1);
  assert_int_equal(count("</svg>"), 1);
  assert_int_equal(count("<g "), count("</g>"));
  static ReplayPlot bare;
  bare = straight_drive();
  bare.vo_error.clear();
  svg = render_svg(bare);
  assert_false(has("distance along"));
}

void test_everything(void**) {
  static ReplayPlot plot;
  plot = straight_drive();
  plot.corrected_map_m = plot.truth_map_m;
  plot.corrected_error = {{0.0, 0.0}, {1.0, 0.01}};
  plot.orbital = {{Vec2(0.5, 0.5), 0.3}, {Vec2(500.0, 0.5), 0.3}};  // the second lies outside the view
  plot.ground = {{Vec2(0.5, 0.4), 0.2}};
  plot.fixes = {{Vec2(0.3, 0.06), Vec2(0.0, -0.02), 0.3, true, "applied"},
                {Vec2(0.6, 0.06), Vec2(0.0, 3.0), 0.6, false, "ambiguous"}};
  svg = render_svg(plot);
  assert_true(has("corrected") && has("orbital boulder") && has("ground boulder"));
  assert_true(has("fix, and its correction") && has("fix not used") && has("1 ambiguous"));
  assert_true(has("0.200 m at the end") && has("0.010 m at the end"));
  assert_int_equal(count("<circle"), 2 + 3);  // two boulders in view; three circles in the legend
}

/// The claim stands behind the error, cut off where it is far larger; trust is told along the foot.
void test_claims(void**) {
  static ReplayPlot plot;
  plot = straight_drive();
  svg = render_svg(plot);
  assert_false(has("class=\"band\"") || has("class=\"trust\"") || has("3 sigma"));
  plot.three_sigma = {{0.0, 0.1}, {0.5, 0.3}, {1.0, 1.0e5}};
  plot.trust = {{0.0, 0.4, "confirmed"}, {0.4, 0.5, "lost"}, {0.5, 1.0, "confirmed"}};
  svg = render_svg(plot);
  assert_int_equal(count("class=\"band\""), 1);
  assert_int_equal(count("class=\"trust\""), 3);
  assert_true(has("3 sigma") && count("pose confirmed") == 1 && count("pose lost") == 1);
  assert_false(has("pose coasting"));
  // The panel: errors to 0.2 m, the claim to 2.5 times that; 1e5 m is at its upper edge.
  const std::size_t at = svg.find("points=\"", svg.find("class=\"band\"")) + 8;
  static std::string points;
  points = svg.substr(at, svg.find('"', at) - at);
  assert_true(points.find('-') == std::string::npos && points.find('e') == std::string::npos);
}

// The view is 3 m wide (1 m of drive, 1 m of margin on each side) on 900 pixels from x = 70, and 2.2 m high
// from the top at y = 74: 300 pixels a metre, north up.
void test_positions(void**) {
  svg = render_svg(straight_drive());
  assert_true(has("<polyline points=\"370.0,434.0 "));  // the start, at (0, 0)
  assert_true(has(" 670.0,434.0 "));                    // the true end, 1 m east
  assert_true(has(" 670.0,374.0 "));                    // the end of VO, 0.2 m north of it
}

void test_orthoimage(void**) {
  static ReplayPlot plot;
  plot = straight_drive();
  plot.orthoimage = write_ortho("ortho.tif");
  plot.p_proj_map_m = Vec2(101.0, 49.0);
  svg = render_svg(plot);
  assert_int_equal(count("<image"), 1);
  assert_true(has("data:image/jpeg;base64,/9j/"));
  assert_true(has("<image x=\"70.00\""));  // the view begins at x = 100 in the projection, as the image does
  plot.p_proj_map_m = Vec2(900.0, 49.0);   // elsewhere: no picture, no failure
  svg = render_svg(plot);
  assert_int_equal(count("<image"), 0);
}

void test_piece_is_whole_pixels(void**) {
  static OrthoPiece piece;
  piece = read_ortho_piece(write_ortho("piece.tif"), {Vec2(101.05, 48.55), Vec2(101.95, 49.95)}, 100);
  assert_near(piece.box.low_m.x(), 101.0, 1e-9);
  assert_near(piece.box.high_m.x(), 102.0, 1e-9);
  assert_near(piece.box.low_m.y(), 48.5, 1e-9);
  assert_near(piece.box.high_m.y(), 50.0, 1e-9);
  assert_false(piece.base64.empty());
  piece = read_ortho_piece(scratch.path("piece.tif"), {Vec2(90.0, 40.0), Vec2(110.0, 60.0)}, 8);  // clipped
  assert_near(piece.box.low_m.x(), 100.0, 1e-9);
  assert_near(piece.box.high_m.x(), 104.0, 1e-9);
  assert_near(piece.box.low_m.y(), 48.0, 1e-9);
}

void test_refusals(void**) {
  static ReplayPlot plot;
  assert_refused(render_svg(plot), "plot: no path to draw");
  plot = straight_drive();
  plot.orthoimage = scratch.path("absent.tif");
  assert_refused(render_svg(plot), "absent.tif: cannot be read as an orthoimage");
  plot.orthoimage = write_ortho("turned.tif", 0.01);
  assert_refused(render_svg(plot), "turned.tif: not a north-up image");
  test::write_grey_png(scratch.path("bare.png"), 40, 40);
  plot.orthoimage = scratch.path("bare.png");
  assert_refused(render_svg(plot), "bare.png: not a north-up image");
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_only_what_is_there),
      cmocka_unit_test(test_everything),
      cmocka_unit_test(test_claims),
      cmocka_unit_test(test_positions),
      cmocka_unit_test(test_orthoimage),
      cmocka_unit_test(test_piece_is_whole_pixels),
      cmocka_unit_test(test_refusals),
  };
  return cmocka_run_group_tests_name("ground_tools/plot/svg_plot", tests, nullptr, nullptr);
}
