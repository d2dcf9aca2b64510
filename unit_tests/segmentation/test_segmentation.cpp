// Segmentation of synthetic scenes: discs on textured ground with known places, sizes and greys.
#include "segmentation/segmentation.hpp"

#include <cstring>

#include "core/random.hpp"
#include "support/cmocka.hpp"

using namespace cairn;

namespace {

constexpr int kWidth = cfg::kImageWidth;
constexpr int kHeight = cfg::kImageHeight;
std::uint8_t pixels[cfg::kImagePixels];
SegmentationJob job;

struct Disc {
  int u;
  int v;
  int radius;
  int grey;
};

/// What full resolution has room for.
ImageU8 quarter() { return {pixels, kWidth / 2, kHeight / 2, kWidth}; }
ImageU8 image() { return packed_view<const std::uint8_t>(pixels, kWidth, kHeight); }

void fill_ground(int grey, int texture) {
  Random random(11);
  for (std::uint8_t& pixel : pixels) {
    const int noise = static_cast<int>(random.below(static_cast<std::uint32_t>(2 * texture + 1))) - texture;
    pixel = static_cast<std::uint8_t>(grey + noise);
  }
}

void draw(const Disc& disc) {
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const int du = u - disc.u;
      const int dv = v - disc.v;
      if (du * du + dv * dv > disc.radius * disc.radius) continue;
      std::uint8_t& pixel = pixels[v * kWidth + u];
      pixel = static_cast<std::uint8_t>(pixel - 128 + disc.grey);
    }
  }
}

SegmentationStatus run(const SegmentationParams& params, const ImageU8& view) {
  if (job.start(params, view) != SegmentationStatus::kRunning) return job.status();
  WorkBudget budget = WorkBudget::unlimited();
  assert_status(job.step(budget), Progress::kDone);
  return job.status();
}

/// Without the stretch of dull pictures: grey levels come out as they are drawn.
constexpr SegmentationParams as_it_is() {
  SegmentationParams params;
  params.least_deviation_grey = 0;
  return params;
}
constexpr SegmentationParams kAsItIs = as_it_is();

using Discs = Disc[5];
constexpr Discs kDiscs = {
    {60, 50, 20, 60}, {200, 80, 12, 200}, {300, 200, 30, 70}, {420, 300, 8, 50}, {90, 300, 15, 190}};
constexpr Discs kSmallDiscs = {
    {30, 25, 10, 60}, {100, 40, 8, 200}, {150, 100, 15, 70}, {210, 150, 8, 50}, {45, 150, 9, 190}};

void draw_scene(const Discs& discs = kDiscs) {
  fill_ground(128, 6);
  for (const Disc& disc : discs) draw(disc);
}

void check_scene(int divisor, const ImageU8& view, const Discs& discs) {
  draw_scene(discs);
  SegmentationParams params = kAsItIs;
  params.scale_divisor = divisor;
  assert_status(run(params, view), SegmentationStatus::kDone);
  assert_int_equal(job.regions().size(), 5);
  for (const Disc& disc : discs) {
    const std::uint8_t label = job.labels().label_at(disc.u, disc.v);
    assert_int_not_equal(label, 0);
    const Region& region = job.regions()[label - 1U];
    assert_int_equal(region.label, label);
    const double area = 3.14159265 * disc.radius * disc.radius;
    assert_near(region.area_px, area, 0.1 * area + 8.0);
    assert_near(region.centroid_u_px, disc.u, 0.5);
    assert_near(region.centroid_v_px, disc.v, 0.5);
    assert_near(region.u_min_px, disc.u - disc.radius, 2);
    assert_near(region.u_max_px, disc.u + disc.radius, 2);
    assert_near(region.v_min_px, disc.v - disc.radius, 2);
    assert_near(region.v_max_px, disc.v + disc.radius, 2);
    assert_near(region.mean_grey, disc.grey, 6);
    assert_near(region.contrast_grey, std::abs(disc.grey - 128), 6);
    assert_near(region.outline_px, 8 * disc.radius, 0.15 * 8 * disc.radius + 4.0);
    assert_int_equal(region.border_px, 0);
  }
  assert_int_equal(job.labels().label_at(250.0, 20.0), 0);
  assert_int_equal(job.dropped(), 0);
}

void test_discs_at_half_resolution(void**) { check_scene(2, image(), kDiscs); }
void test_discs_at_full_resolution(void**) { check_scene(1, quarter(), kSmallDiscs); }

// Regions agree with the label image, and come by contrast times area.
void test_regions_describe_the_labels(void**) {
  draw_scene();
  assert_status(run({}, image()), SegmentationStatus::kDone);
  const ImageU8 labels = job.labels().image;
  assert_int_equal(labels.width, kWidth / 2);
  assert_int_equal(labels.height, kHeight / 2);
  static int area[256];
  std::memset(area, 0, sizeof area);
  for (int y = 0; y < labels.height; ++y) {
    for (int x = 0; x < labels.width; ++x) area[labels.at(x, y)] += 4;
  }
  double before = 1e12;
  for (std::size_t i = 0; i < job.regions().size(); ++i) {
    const Region& region = job.regions()[i];
    assert_int_equal(region.label, i + 1);
    assert_int_equal(region.area_px, area[region.label]);
    const double weight = static_cast<double>(region.contrast_grey) * region.area_px;
    assert_true(weight <= before);
    before = weight;
  }
}

void test_halving_rounds_to_nearest(void**) {
  fill_ground(128, 0);
  for (int v = 100; v < 140; ++v) {
    for (int u = 100; u < 140; ++u) pixels[v * kWidth + u] = static_cast<std::uint8_t>(10 + v % 2);
  }
  assert_status(run(kAsItIs, image()), SegmentationStatus::kDone);
  assert_int_equal(job.regions().size(), 1);
  assert_near(job.regions()[0].mean_grey, 11.0, 0.0);
  assert_int_equal(job.regions()[0].area_px, 1600);
  assert_near(job.regions()[0].centroid_u_px, 119.5, 1e-5);
}

void test_label_lookup_at_the_corners(void**) {
  fill_ground(128, 0);
  draw({0, 0, 20, 30});
  draw({kWidth - 1, kHeight - 1, 20, 30});
  assert_status(run({}, image()), SegmentationStatus::kDone);
  const LabelView labels = job.labels();
  const double right = kWidth - 1.0;
  const double bottom = kHeight - 1.0;
  assert_int_not_equal(labels.label_at(0.0, 0.0), 0);
  assert_int_not_equal(labels.label_at(-0.5, -0.5), 0);
  assert_int_equal(labels.label_at(-0.51, 0.0), 0);
  assert_int_equal(labels.label_at(0.0, -0.51), 0);
  assert_int_not_equal(labels.label_at(right + 0.49, bottom + 0.49), 0);
  assert_int_equal(labels.label_at(right + 0.5, bottom), 0);
  assert_int_equal(labels.label_at(right, bottom + 0.5), 0);
  assert_int_equal(labels.label_at(NAN, 0.0), 0);
  assert_int_equal(labels.label_at(0.0, NAN), 0);
  assert_int_equal(labels.label_at(1e300, 1e300), 0);
  assert_int_equal(labels.label_at(-INFINITY, 0.0), 0);
}

void test_border_is_flagged(void**) {
  fill_ground(128, 0);
  draw({0, 100, 20, 40});
  draw({200, kHeight - 1, 10, 210});
  draw({300, 100, 20, 40});
  assert_status(run({}, image()), SegmentationStatus::kDone);
  const auto border_at = [](int u, int v) {
    return job.regions()[job.labels().label_at(u, v) - 1U].border_px;
  };
  assert_near(border_at(2, 100), 40, 4);
  assert_near(border_at(200, kHeight - 2), 20, 4);
  assert_int_equal(border_at(300, 100), 0);
}

void test_area_and_contrast_limits(void**) {
  SegmentationParams params = kAsItIs;
  params.max_area_fraction = 0.005;  // 983 pixels: without the discs of radius 20 and 30
  draw_scene();
  assert_status(run(params, image()), SegmentationStatus::kDone);
  assert_int_equal(job.regions().size(), 3);
  assert_int_equal(job.labels().label_at(300, 200), 0);
  params = kAsItIs;
  params.min_area_px = 300;  // without radius 8
  assert_status(run(params, image()), SegmentationStatus::kDone);
  assert_int_equal(job.regions().size(), 4);
  assert_int_equal(job.labels().label_at(420, 300), 0);
  params = kAsItIs;
  params.min_contrast_grey = 65;  // greys 60, 190 and 70 are within; 200 and 50 are beyond
  assert_status(run(params, image()), SegmentationStatus::kDone);
  assert_int_equal(job.regions().size(), 3);
  params.min_contrast_grey = 255;
  assert_status(run(params, image()), SegmentationStatus::kNoRegions);
}

void test_more_regions_than_labels(void**) {
  draw_scene();
  SegmentationParams params;
  params.max_labels = 2;
  assert_status(run(params, image()), SegmentationStatus::kDone);
  assert_int_equal(job.regions().size(), 2);
  assert_int_equal(job.dropped(), 3);
  assert_int_equal(job.labels().label_at(300, 200), 1);  // radius 30
  assert_int_equal(job.labels().label_at(60, 50), 2);    // radius 20
  // A grid of more discs than any label count.
  fill_ground(128, 0);
  int discs = 0;
  for (int v = 12; v < kHeight - 10; v += 20) {
    for (int u = 12; u < kWidth - 10; u += 20) {
      draw({u, v, 6, 40});
      ++discs;
    }
  }
  assert_true(discs > static_cast<int>(cfg::kMaxLabels));
  assert_status(run({}, image()), SegmentationStatus::kDone);
  assert_int_equal(job.regions().size(), cfg::kMaxLabels);
  assert_int_equal(job.dropped(), discs - static_cast<int>(cfg::kMaxLabels));
}

// A picture of a third of the contrast, at any brightness, shows the same regions where it is stretched, and
// loses some where it is not; a lively one is left as it is.
void test_dull_pictures_are_stretched(void**) {
  for (const int brightness : {50, 200}) {
    draw_scene();
    for (std::uint8_t& pixel : pixels) pixel = static_cast<std::uint8_t>(brightness + (pixel - 128) / 4);
    assert_status(run(kAsItIs, image()), SegmentationStatus::kDone);
    assert_true(job.regions().size() < 5);
    assert_status(run({}, image()), SegmentationStatus::kDone);
    assert_int_equal(job.regions().size(), 5);
    for (const Disc& disc : kDiscs) assert_int_not_equal(job.labels().label_at(disc.u, disc.v), 0);
    assert_int_equal(job.labels().label_at(250.0, 20.0), 0);
  }
  draw_scene();
  draw({350, 60, 50, 20});
  draw({60, 200, 50, 230});
  assert_status(run(kAsItIs, image()), SegmentationStatus::kDone);
  const float lively = job.regions()[0].mean_grey;
  assert_status(run({}, image()), SegmentationStatus::kDone);
  assert_float_equal(job.regions()[0].mean_grey, lively, 0.0F);
}

void test_blank_images_have_no_regions(void**) {
  for (const int grey : {0, 128, 255}) {
    std::memset(pixels, grey, sizeof pixels);
    assert_status(run({}, image()), SegmentationStatus::kNoRegions);
    assert_true(job.regions().empty());
    assert_null(job.labels().image.data);
    assert_int_equal(job.labels().label_at(5.0, 5.0), 0);
  }
  draw_scene();
  assert_status(run({}, image()), SegmentationStatus::kDone);
}

void test_noise_is_named(void**) {
  Random random(2);
  for (std::uint8_t& pixel : pixels) pixel = static_cast<std::uint8_t>(random.below(256));
  SegmentationParams params;
  params.each_second = false;  // by halves it has few pieces, and is found to have no boulders later
  assert_status(run(params, image()), SegmentationStatus::kTooManyRegions);
  params.scale_divisor = 1;
  assert_status(run(params, quarter()), SegmentationStatus::kTooManyRegions);
  assert_int_equal(job.tolerance_grey(), params.merge_grey);
  assert_true(job.regions().empty());
  assert_null(job.labels().image.data);
  draw_scene();
  assert_status(run(params, quarter()), SegmentationStatus::kDone);
}

// Checks of one pixel, 4 levels apart: too many pieces for a tolerance of 3 at full resolution, few for 7.
void test_wider_tolerance_before_giving_up(void**) {
  for (int i = 0; i < kWidth * kHeight; ++i) {
    pixels[i] = static_cast<std::uint8_t>(((i % kWidth + i / kWidth) & 1) != 0 ? 128 : 132);
  }
  draw({100, 100, 20, 40});
  SegmentationParams params;
  params.scale_divisor = 1;
  params.range_radius_grey = 1;  // the filter leaves the pattern
  params.each_second = false;
  assert_status(run(params, quarter()), SegmentationStatus::kDone);
  assert_int_equal(job.tolerance_grey(), 7);
  assert_int_equal(job.regions().size(), 1);
  assert_int_equal(job.labels().label_at(100, 100), 1);
}

void test_any_smaller_size(void**) {
  draw_scene();
  for (const int width : {2, 3, 17, 131, kWidth - 1}) {
    for (const int height : {2, 5, 130, kHeight - 1}) {
      const SegmentationStatus status = run({}, {pixels + 1, width, height, kWidth});
      assert_true(status == SegmentationStatus::kDone || status == SegmentationStatus::kNoRegions);
      if (status != SegmentationStatus::kDone) continue;
      assert_int_equal(job.labels().image.width, width / 2);
      assert_int_equal(job.labels().label_at(width - 1 + width % 2, 0.0), 0);
    }
  }
  // A part of the image: the disc at (60, 50) is found at its place in the part.
  SegmentationParams params;
  params.max_area_fraction = 0.5;
  assert_status(run(params, {pixels + 20 * kWidth + 30, 75, 65, kWidth}), SegmentationStatus::kDone);
  assert_int_equal(job.regions().size(), 1);
  assert_near(job.regions()[0].centroid_u_px, 30, 0.5);
  assert_near(job.regions()[0].centroid_v_px, 30, 0.5);
}

void test_same_bits_however_sliced(void**) {
  static std::uint8_t whole[cfg::kImagePixels / 4];
  static Regions regions;
  constexpr std::uint32_t kUnit = RegionMergeJob::unit_ops(RegionMergeJob::kRun);
  draw_scene();
  assert_status(run({}, image()), SegmentationStatus::kDone);
  std::memcpy(whole, job.labels().image.data, sizeof whole);
  regions = job.regions();
  for (const std::uint32_t ops : {1U, 997U, 10007U, 1000000U}) {
    assert_status(job.start({}, image()), SegmentationStatus::kRunning);
    assert_null(job.labels().image.data);
    int steps = 0;
    for (Progress progress = Progress::kMore; progress == Progress::kMore; ++steps) {
      assert_true(steps < 1000000);
      WorkBudget budget(ops);
      progress = job.step(budget);
      assert_at_most(budget.spent(), ops + kUnit);
    }
    assert_status(job.status(), SegmentationStatus::kDone);
    assert_memory_equal(whole, job.labels().image.data, sizeof whole);
    assert_int_equal(regions.size(), job.regions().size());
    for (std::size_t i = 0; i < regions.size(); ++i) {
      assert_memory_equal(&regions[i].mean_grey, &job.regions()[i].mean_grey, sizeof(float));
      assert_memory_equal(&regions[i].centroid_u_px, &job.regions()[i].centroid_u_px, sizeof(float));
      assert_memory_equal(&regions[i].centroid_v_px, &job.regions()[i].centroid_v_px, sizeof(float));
      assert_int_equal(regions[i].outline_px, job.regions()[i].outline_px);
      assert_int_equal(regions[i].area_px, job.regions()[i].area_px);
    }
  }
}

/// The job's planes still hold the image before: neither the result nor the work may depend on it.
void test_image_before_leaves_no_trace(void**) {
  static std::uint8_t before[2][cfg::kImagePixels];
  draw_scene();
  std::memset(before[0], 0, sizeof before[0]);
  std::memset(before[1], pixels[0] + 8, sizeof before[1]);  // near enough to draw the first pixel's mean
  std::uint64_t work[2];
  for (int i = 0; i < 2; ++i) {
    assert_status(run({}, packed_view<const std::uint8_t>(before[i], kWidth, kHeight)),
                  SegmentationStatus::kNoRegions);
    assert_status(job.start({}, image()), SegmentationStatus::kRunning);
    WorkBudget budget = WorkBudget::unlimited();
    assert_true(job.step(budget) == Progress::kDone);
    work[i] = budget.spent();
  }
  assert_int_equal(work[0], work[1]);
}

void test_bad_views(void**) {
  static SegmentationJob fresh;
  assert_status(fresh.status(), SegmentationStatus::kIdle);
  assert_null(fresh.labels().image.data);
  assert_status(run({}, {}), SegmentationStatus::kBadInput);
  assert_status(run({}, {pixels, 1, kHeight, kWidth}), SegmentationStatus::kBadInput);
  assert_status(run({}, {pixels, kWidth, 1, kWidth}), SegmentationStatus::kBadInput);
  assert_status(run({}, {pixels, kWidth + 1, 20, kWidth + 1}), SegmentationStatus::kBadInput);
  assert_status(run({}, {pixels, 20, kHeight + 1, 20}), SegmentationStatus::kBadInput);
  assert_status(run({}, {pixels, kWidth, kHeight, kWidth - 1}), SegmentationStatus::kBadInput);
  SegmentationParams fine;  // more working pixels than there is room for
  fine.scale_divisor = 1;
  assert_status(run(fine, image()), SegmentationStatus::kBadInput);
  WorkBudget budget = WorkBudget::unlimited();
  assert_status(job.step(budget), Progress::kDone);
  assert_status(job.status(), SegmentationStatus::kBadInput);
  assert_int_equal(budget.spent(), 0);
}

void expect_bad(void (*spoil)(SegmentationParams&)) {
  SegmentationParams params;
  spoil(params);
  assert_status(job.start(params, image()), SegmentationStatus::kBadInput);
}

void test_bad_parameters(void**) {
  expect_bad([](SegmentationParams& p) { p.scale_divisor = 0; });
  expect_bad([](SegmentationParams& p) { p.scale_divisor = 3; });
  expect_bad([](SegmentationParams& p) { p.spatial_radius_px = 0; });
  expect_bad([](SegmentationParams& p) { p.range_radius_grey = 256; });
  expect_bad([](SegmentationParams& p) { p.max_iterations = 0; });
  expect_bad([](SegmentationParams& p) { p.convergence = -1; });
  expect_bad([](SegmentationParams& p) { p.connect_grey = -1; });
  expect_bad([](SegmentationParams& p) { p.connect_grey = 256; });
  expect_bad([](SegmentationParams& p) { p.merge_grey = -1; });
  expect_bad([](SegmentationParams& p) { p.merge_grey = 256; });
  expect_bad([](SegmentationParams& p) { p.min_area_px = -1; });
  expect_bad([](SegmentationParams& p) { p.max_area_fraction = 0.0; });
  expect_bad([](SegmentationParams& p) { p.max_area_fraction = 1.01; });
  expect_bad([](SegmentationParams& p) { p.max_area_fraction = NAN; });
  expect_bad([](SegmentationParams& p) { p.min_contrast_grey = -1; });
  expect_bad([](SegmentationParams& p) { p.min_contrast_grey = 256; });
  expect_bad([](SegmentationParams& p) { p.max_labels = 0; });
  expect_bad([](SegmentationParams& p) { p.max_labels = static_cast<int>(cfg::kMaxLabels) + 1; });
}

// The other ends of the ranges run.
void test_extreme_parameters(void**) {
  draw_scene();
  SegmentationParams params;
  params.merge_grey = 0;
  params.connect_grey = 0;
  params.min_area_px = 0;
  params.max_area_fraction = 1.0;
  params.min_contrast_grey = 0;
  params.max_labels = 1;
  const SegmentationStatus status = run(params, image());
  assert_true(status == SegmentationStatus::kDone || status == SegmentationStatus::kTooManyRegions);
  params.merge_grey = 255;
  params.connect_grey = 255;
  params.min_area_px = INT32_MAX;
  assert_status(run(params, image()), SegmentationStatus::kNoRegions);
  params.min_area_px = 0;
  assert_status(run(params, image()), SegmentationStatus::kDone);
  assert_int_equal(job.regions()[0].area_px, kWidth * kHeight);
  assert_int_equal(job.regions()[0].border_px, 2 * (kWidth + kHeight));
  assert_near(job.regions()[0].centroid_u_px, 0.5 * (kWidth - 1), 1e-4);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_discs_at_half_resolution),
      cmocka_unit_test(test_discs_at_full_resolution),
      cmocka_unit_test(test_regions_describe_the_labels),
      cmocka_unit_test(test_halving_rounds_to_nearest),
      cmocka_unit_test(test_label_lookup_at_the_corners),
      cmocka_unit_test(test_border_is_flagged),
      cmocka_unit_test(test_area_and_contrast_limits),
      cmocka_unit_test(test_more_regions_than_labels),
      cmocka_unit_test(test_dull_pictures_are_stretched),
      cmocka_unit_test(test_blank_images_have_no_regions),
      cmocka_unit_test(test_noise_is_named),
      cmocka_unit_test(test_wider_tolerance_before_giving_up),
      cmocka_unit_test(test_any_smaller_size),
      cmocka_unit_test(test_same_bits_however_sliced),
      cmocka_unit_test(test_image_before_leaves_no_trace),
      cmocka_unit_test(test_bad_views),
      cmocka_unit_test(test_bad_parameters),
      cmocka_unit_test(test_extreme_parameters),
  };
  return cmocka_run_group_tests_name("segmentation/segmentation", tests, nullptr, nullptr);
}
