// Keypoints: planted blobs, their spread, the cap, images without texture, bad sizes, order, slices.
#include "features/extractor.hpp"

#include <cstring>

#include "features/sift_descriptor.hpp"
#include "support/cmocka.hpp"
#include "support/noise.hpp"
#include "support/slices.hpp"

using namespace cairn;

namespace {

constexpr int kWidth = cfg::kImageWidth;
constexpr int kHeight = cfg::kImageHeight;
std::uint8_t pixels[cfg::kImagePixels];
float canvas[cfg::kImagePixels];
FeatureExtractor extractor;
FeatureExtractor sliced;

const ImageU8 kWhole = packed_view<const std::uint8_t>(pixels, kWidth, kHeight);

struct Blob {
  double u, v, amplitude;
};

void add_blob(const Blob& blob, double sigma) {
  for (int y = static_cast<int>(blob.v) - 8; y <= static_cast<int>(blob.v) + 8; ++y) {
    for (int x = static_cast<int>(blob.u) - 8; x <= static_cast<int>(blob.u) + 8; ++x) {
      if (x < 0 || y < 0 || x >= kWidth || y >= kHeight) continue;
      const double r2 = (x - blob.u) * (x - blob.u) + (y - blob.v) * (y - blob.v);
      canvas[y * kWidth + x] += static_cast<float>(blob.amplitude * std::exp(-0.5 * r2 / (sigma * sigma)));
    }
  }
}

void clear_canvas(float grey) {
  for (float& c : canvas) c = grey;
}
void quantise_canvas() {
  for (std::size_t i = 0; i < cfg::kImagePixels; ++i) {
    const float c = canvas[i] + 0.5F;
    pixels[i] = static_cast<std::uint8_t>(c < 0.0F ? 0.0F : (c > 255.0F ? 255.0F : c));
  }
}

void fill_noise(int low, int high, int columns = kWidth) {
  Random random(21);
  for (std::size_t i = 0; i < cfg::kImagePixels; ++i) {
    const int x = static_cast<int>(i) % kWidth;
    pixels[i] = static_cast<std::uint8_t>(
        x < columns ? low + static_cast<int>(random.below(static_cast<std::uint32_t>(high - low + 1))) : low);
  }
}

void extract(const ImageU8& image) {
  assert_status(extractor.start(image), ExtractStatus::kRunning);
  assert_true(test::run_whole(extractor));
}

void test_planted_blobs_are_found(void**) {
  // Bright and dark Gaussian blobs of sigma 1.5 px at sub-pixel places.
  static Blob blobs[400];
  int count = 0;
  Random random(2);
  clear_canvas(120.0F);
  for (int v = 24; v < kHeight - 24; v += 24) {
    for (int u = 24; u < kWidth - 24; u += 24) {
      Blob& blob = blobs[count++];
      blob = {u + test::uniform(random, -4.0, 4.0), v + test::uniform(random, -4.0, 4.0),
              random.below(2) == 0 ? 70.0 : -70.0};
      add_blob(blob, 1.5);
    }
  }
  quantise_canvas();
  extract(kWhole);
  assert_status(extractor.status(), ExtractStatus::kFeatures);
  double worst = 0.0;
  double sum_u = 0.0;
  double sum_v = 0.0;
  for (int i = 0; i < count; ++i) {
    int hits = 0;
    for (const Feature& f : extractor.result().features) {
      const double du = static_cast<double>(f.u) - blobs[i].u;
      const double dv = static_cast<double>(f.v) - blobs[i].v;
      const double r = std::hypot(du, dv);
      if (r > 1.0) continue;
      ++hits;
      assert_true((f.response < 0) == (blobs[i].amplitude > 0.0));  // bright blobs are negative
      worst = r > worst ? r : worst;
      sum_u += du;
      sum_v += dv;
    }
    assert_int_equal(hits, 1);
  }
  print_message("%d blobs: worst error %.3f px, mean (%.4f, %.4f) px\n", count, worst, sum_u / count,
                sum_v / count);
  assert_at_most(worst, 0.15);
  assert_near(sum_u / count, 0.0, 0.01);
  assert_near(sum_v / count, 0.0, 0.01);
}

void test_tilted_blobs_are_found(void**) {
  // Blobs half as long again along a diagonal: the mixed derivative matters.
  Random random(3);
  for (const double diagonal : {1.0, -1.0}) {
    clear_canvas(120.0F);
    static Blob blobs[100];
    int count = 0;
    for (int v = 40; v < 300; v += 40) {
      for (int u = 40; u < 400; u += 40) {
        Blob& blob = blobs[count++];
        blob = {u + test::uniform(random, -0.5, 0.5), v + test::uniform(random, -0.5, 0.5), 15.0};
        for (int k = -3; k <= 3; ++k) {
          add_blob({blob.u + 0.35 * k, blob.v + 0.35 * diagonal * k, blob.amplitude}, 1.2);
        }
      }
    }
    quantise_canvas();
    extract(kWhole);
    // Such blobs have side lobes, and a few of those are features too.
    assert_at_least(extractor.result().features.size(), count);
    assert_at_most(extractor.result().features.size(), 1.25 * count);
    double sum2 = 0.0;
    for (int i = 0; i < count; ++i) {
      double nearest = 1.0e9;
      for (const Feature& f : extractor.result().features) {
        nearest = std::fmin(nearest, std::hypot(static_cast<double>(f.u) - blobs[i].u,
                                                static_cast<double>(f.v) - blobs[i].v));
      }
      sum2 += nearest * nearest / count;
    }
    print_message("tilted blobs: rms error %.3f px\n", std::sqrt(sum2));
    assert_at_most(std::sqrt(sum2), 0.06);
  }
}

void test_equal_neighbours_are_one_feature(void**) {
  // Blobs centred between pixels make extrema of two or four equal pixels, along rows,
  // columns and both diagonals.
  const double offset[3][2] = {{0.5, 0.0}, {0.0, 0.5}, {0.5, 0.5}};
  for (const auto& o : offset) {
    for (const double amplitude : {80.0, -80.0}) {
      clear_canvas(120.0F);
      add_blob({100.0 + o[0], 100.0 + o[1], amplitude}, 1.5);
      quantise_canvas();
      extract(kWhole);
      assert_int_equal(extractor.result().features.size(), 1);
    }
  }
  for (const int other : {101, 99}) {  // two pixels on a diagonal
    for (const double amplitude : {80.0, -80.0}) {
      clear_canvas(120.0F);
      add_blob({100.0, 100.0, amplitude}, 0.8);
      add_blob({static_cast<double>(other), 101.0, amplitude}, 0.8);
      quantise_canvas();
      extract(kWhole);
      assert_int_equal(extractor.result().features.size(), 1);
    }
  }
}

void test_response_has_the_units_it_says(void**) {
  // A Gaussian blob of variance s2 and amplitude A becomes one of A s2 / (s2 + sigma^2).
  clear_canvas(120.0F);
  add_blob({100.0, 100.0, 90.0}, 1.5);
  add_blob({150.0, 100.0, -90.0}, 1.5);
  quantise_canvas();
  extract(kWhole);
  assert_int_equal(extractor.result().features.size(), 2);
  const double expected = 256.0 * 90.0 * 2.25 * (1.0 / (2.25 + 3.5) - 1.0 / (2.25 + 1.5));
  assert_near(extractor.result().features[0].response, expected, 0.05 * -expected);
  assert_near(extractor.result().features[1].response, -expected, 0.05 * -expected);
}

void test_edges_are_no_features(void**) {
  clear_canvas(60.0F);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) canvas[y * kWidth + x] += 2 * x + y > kWidth + 100 ? 120.0F : 0.0F;
  }
  quantise_canvas();
  extract(kWhole);
  assert_int_equal(extractor.result().features.size(), 0);
  assert_status(extractor.status(), ExtractStatus::kFewFeatures);
}

void test_texture_in_one_corner_does_not_starve_the_rest(void**) {
  // Strong noise on the left half, faint blobs on the right one.
  fill_noise(20, 235, kWidth / 2);
  for (std::size_t i = 0; i < cfg::kImagePixels; ++i)
    canvas[i] = static_cast<int>(i) % kWidth < kWidth / 2 ? static_cast<float>(pixels[i]) : 120.0F;
  int planted = 0;
  for (int v = 16; v < kHeight; v += 32) {
    for (int u = kWidth / 2 + 48; u < kWidth - 16; u += 32, ++planted)
      add_blob({u + 0.0, v + 0.0, 12.0}, 1.5);
  }
  quantise_canvas();
  extract(kWhole);
  assert_true(extractor.result().features.full());
  int right = 0;
  for (const Feature& f : extractor.result().features) right += f.iu >= kWidth / 2 + 32 ? 1 : 0;
  assert_int_equal(right, planted);
}

void test_cap_spread_and_order(void**) {
  fill_noise(0, 255);
  extract(kWhole);
  const FeatureSet& set = extractor.result();
  assert_int_equal(set.features.size(), cfg::kMaxFeatures);
  assert_int_equal(set.descriptors.size(), cfg::kMaxFeatures);
  assert_int_equal(set.height, kHeight);
  // Scan order, and each row's index.
  assert_int_equal(set.row_begin[0], 0);
  assert_int_equal(set.row_begin[kHeight], set.features.size());
  for (int v = 0; v < kHeight; ++v) {
    for (int i = set.row_begin[v]; i < set.row_begin[v + 1]; ++i) {
      const Feature& f = set.features[static_cast<std::size_t>(i)];
      assert_int_equal(f.iv, v);
      if (i > set.row_begin[v]) assert_true(set.features[static_cast<std::size_t>(i - 1)].iu < f.iu);
      assert_at_most(std::fabs(f.u - f.iu), 0.5);
      assert_at_most(std::fabs(f.v - f.iv), 0.5);
      assert_true(f.iu >= kDescriptorMargin && f.iu < kWidth - kDescriptorMargin);
      assert_true(f.iv >= kDescriptorMargin && f.iv < kHeight - kDescriptorMargin);
    }
  }
  assert_int_equal(set.first_of_row(-5), 0);
  assert_int_equal(set.first_of_row(kHeight + 5), set.features.size());
  // Quarters of the image get alike.
  int quarter[4] = {};
  for (const Feature& f : set.features)
    ++quarter[(f.iv >= kHeight / 2 ? 2 : 0) + (f.iu >= kWidth / 2 ? 1 : 0)];
  for (const int q : quarter) assert_near(q, cfg::kMaxFeatures / 4.0, cfg::kMaxFeatures * 0.007);
}

void test_strongest_of_a_cell_stay(void**) {
  // 16 blobs in one 32 px cell, of different strength: the ten strongest are kept.
  clear_canvas(100.0F);
  for (int i = 0; i < 16; ++i) {
    add_blob({64.0 + 4 + 8 * (i % 4), 64.0 + 4 + 8 * (i / 4), 30.0 + 5.0 * ((i * 7) % 16)}, 1.0);
  }
  quantise_canvas();
  extract(kWhole);
  int found = 0;
  for (const Feature& f : extractor.result().features) {
    if (f.iu < 64 || f.iu >= 96 || f.iv < 64 || f.iv >= 96) continue;
    ++found;
    const int i = (f.iv - 64) / 8 * 4 + (f.iu - 64) / 8;
    assert_true((i * 7) % 16 >= 6);
    assert_true(f.response < 0);
  }
  assert_int_equal(found, 10);
}

void test_images_without_texture(void**) {
  for (const int grey : {0, 128, 255}) {
    std::memset(pixels, grey, sizeof pixels);
    extract(kWhole);
    assert_status(extractor.status(), ExtractStatus::kFewFeatures);
    assert_int_equal(extractor.result().features.size(), 0);
    assert_int_equal(extractor.smooth().at(5, 5), 256 * grey);
  }
}

void test_least_number_of_features(void**) {
  for (const int count : {19, 20}) {
    clear_canvas(100.0F);
    for (int i = 0; i < count; ++i) add_blob({40.0 + 32 * (i % 10), 40.0 + 32 * (i / 10), 80.0}, 1.5);
    quantise_canvas();
    extract(kWhole);
    assert_int_equal(extractor.result().features.size(), count);
    assert_status(extractor.status(), count < 20 ? ExtractStatus::kFewFeatures : ExtractStatus::kFeatures);
  }
}

void test_bad_images(void**) {
  static FeatureExtractor fresh;
  assert_status(fresh.status(), ExtractStatus::kIdle);
  WorkBudget budget = WorkBudget::unlimited();
  assert_status(fresh.step(budget), Progress::kDone);
  assert_status(fresh.status(), ExtractStatus::kIdle);
  const ImageU8 bad[] = {
      {},
      {nullptr, kWidth, kHeight, kWidth},
      {pixels, 63, 64, 64},
      {pixels, 64, 63, 64},
      {pixels, kWidth + 1, 64, kWidth + 1},
      {pixels, 64, kHeight + 1, 64},
      {pixels, 128, 64, 127},
      {pixels, -64, 64, 64},
  };
  fill_noise(0, 255);
  for (const ImageU8& image : bad) {
    extract(kWhole);
    assert_status(extractor.start(image), ExtractStatus::kBadImage);
    assert_status(extractor.step(budget), Progress::kDone);
    assert_status(extractor.status(), ExtractStatus::kBadImage);
    assert_int_equal(extractor.result().features.size(), 0);
    assert_int_equal(extractor.result().first_of_row(40), 0);
  }
  extract({pixels, 64, 64, kWidth});
  assert_int_equal(extractor.smooth().width, 64);
  extract(kWhole);
  assert_status(extractor.status(), ExtractStatus::kFeatures);
}

void test_stride_is_followed(void**) {
  fill_noise(0, 255);
  extract({pixels + 17 * kWidth + 31, 200, 100, kWidth});
  static FeatureSet strided;
  strided = extractor.result();
  static std::uint8_t packed[200 * 100];
  for (int y = 0; y < 100; ++y) std::memcpy(packed + 200 * y, pixels + (17 + y) * kWidth + 31, 200);
  extract({packed, 200, 100, 200});
  assert_int_equal(strided.features.size(), extractor.result().features.size());
  assert_memory_equal(strided.descriptors.data(), extractor.result().descriptors.data(),
                      strided.features.size() * sizeof(Descriptor));
}

/// Features are the same without descriptors, and a descriptor is the same whenever it is made.
void test_descriptors_may_come_later(void**) {
  fill_noise(30, 220);
  extract(kWhole);
  static FeatureSet whole;
  whole = extractor.result();
  for (const Feature& f : whole.features) assert_true(f.described);
  assert_status(extractor.start(kWhole, false, false), ExtractStatus::kRunning);
  assert_true(test::run_whole(extractor));
  assert_status(extractor.status(), ExtractStatus::kFeatures);
  const FeatureSet& bare = extractor.result();
  assert_int_equal(bare.features.size(), whole.features.size());
  for (std::size_t i = 0; i < bare.features.size(); i += 3) {
    assert_true(bare.features[i].iu == whole.features[i].iu && bare.features[i].iv == whole.features[i].iv);
    assert_false(bare.features[i].described);
    extractor.describe(i);
    assert_true(bare.features[i].described);
    assert_memory_equal(&bare.descriptors[i], &whole.descriptors[i], sizeof(Descriptor));
  }
}

void test_slices_give_the_same_bits(void**) {
  fill_noise(30, 220);
  extract(kWhole);
  assert_status(sliced.start(kWhole), ExtractStatus::kRunning);
  assert_true(test::run_in_slices(sliced) > kHeight / 8);
  assert_status(sliced.status(), extractor.status());
  const FeatureSet& a = extractor.result();
  const FeatureSet& b = sliced.result();
  assert_int_equal(a.features.size(), b.features.size());
  for (std::size_t i = 0; i < a.features.size(); ++i) {
    assert_true(a.features[i].u == b.features[i].u && a.features[i].v == b.features[i].v);
    assert_int_equal(a.features[i].response, b.features[i].response);
  }
  assert_memory_equal(a.descriptors.data(), b.descriptors.data(), a.features.size() * sizeof(Descriptor));
  assert_memory_equal(a.row_begin, b.row_begin, sizeof a.row_begin);
  assert_memory_equal(extractor.smooth().data, sliced.smooth().data,
                      cfg::kImagePixels * sizeof(std::uint16_t));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_planted_blobs_are_found),
      cmocka_unit_test(test_tilted_blobs_are_found),
      cmocka_unit_test(test_equal_neighbours_are_one_feature),
      cmocka_unit_test(test_response_has_the_units_it_says),
      cmocka_unit_test(test_edges_are_no_features),
      cmocka_unit_test(test_texture_in_one_corner_does_not_starve_the_rest),
      cmocka_unit_test(test_cap_spread_and_order),
      cmocka_unit_test(test_strongest_of_a_cell_stay),
      cmocka_unit_test(test_images_without_texture),
      cmocka_unit_test(test_least_number_of_features),
      cmocka_unit_test(test_bad_images),
      cmocka_unit_test(test_stride_is_followed),
      cmocka_unit_test(test_descriptors_may_come_later),
      cmocka_unit_test(test_slices_give_the_same_bits),
  };
  return cmocka_run_group_tests_name("extractor", tests, nullptr, nullptr);
}
