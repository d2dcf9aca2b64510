// Descriptors against the header's formula and Lowe's own in double precision, and against the keypoints of
// another implementation; the chi-squared distance against its formula.
#include "features/sift_descriptor.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>

#include "support/cmocka.hpp"
#include "support/data.hpp"
#include "support/death.hpp"
#include "support/noise.hpp"

using namespace cairn;

namespace {

constexpr int kSide = 64;
std::uint16_t pixels[kSide * kSide];
const SmoothImage kImage = packed_view<const std::uint16_t>(pixels, kSide, kSide);

/// A smooth random texture: waves of random direction, 6 to 25 px long.
void fill_texture(std::uint64_t seed, double gain = 1.0, double offset = 0.0) {
  Random random(seed);
  double wave[12][3];
  for (auto& w : wave) {
    const double k = 2.0 * kPi / test::uniform(random, 6.0, 25.0);
    const double a = test::uniform(random, 0.0, 2.0 * kPi);
    w[0] = k * std::cos(a);
    w[1] = k * std::sin(a);
    w[2] = test::uniform(random, 0.0, 2.0 * kPi);
  }
  for (int i = 0; i < kSide * kSide; ++i) {
    double g = 128.0 + offset;
    for (const auto& w : wave) g += gain * 8.0 * std::sin(w[0] * (i % kSide) + w[1] * (i / kSide) + w[2]);
    pixels[i] = static_cast<std::uint16_t>(256.0 * g);
  }
}

double cosine(const double* a, const double* b) {
  double ab = 0.0;
  double aa = 0.0;
  double bb = 0.0;
  for (int i = 0; i < kDescriptorSize; ++i) {
    ab += a[i] * b[i];
    aa += a[i] * a[i];
    bb += b[i] * b[i];
  }
  return ab / std::sqrt(aa * bb);
}

double cosine(const Descriptor& a, const double* b) {
  double wide[kDescriptorSize];
  std::copy(a.bin, a.bin + kDescriptorSize, wide);
  return cosine(wide, b);
}

/// Shares of a gradient in the axes and diagonals on both sides of it, as the header tells them.
void orientations_of_header(double gx, double gy, double (&votes)[8]) {
  const double ax = std::fabs(gx);
  const double ay = std::fabs(gy);
  const int axis = ax >= ay ? (gx < 0.0 ? 4 : 0) : (gy < 0.0 ? 6 : 2);
  const int diagonal = gy < 0.0 ? (gx < 0.0 ? 5 : 7) : (gx < 0.0 ? 3 : 1);
  votes[axis] += std::fabs(ax - ay);
  votes[diagonal] += 1.375 * std::min(ax, ay);
}

/// Lowe's: shares fall linearly with the angle.
void orientations_of_lowe(double gx, double gy, double (&votes)[8]) {
  const double angle = std::atan2(gy, gx);
  for (int b = 0; b < 8; ++b) {
    const double turn = std::remainder(angle - b * kPi / 4.0, 2.0 * kPi) / (kPi / 4.0);
    votes[b] += std::hypot(gx, gy) * std::max(0.0, 1.0 - std::fabs(turn));
  }
}

double window(double cells_u, double cells_v) {
  return std::exp(-(cells_u * cells_u + cells_v * cells_v) / 8.0);
}

/// Lowe 2004, section 6: as he has it, or as the header tells it.
void brute_force(bool lowe, int iu, int iv, double (&h)[kDescriptorSize]) {
  std::fill(h, h + kDescriptorSize, 0.0);
  for (int dv = -9; dv <= 9; ++dv) {
    for (int du = -9; du <= 9; ++du) {
      if (!lowe && (du + dv) % 2 != 0) continue;
      const int x = iu + du;
      const int y = iv + dv;
      const double gx = static_cast<double>(pixels[y * kSide + x + 1]) - pixels[y * kSide + x - 1];
      const double gy = static_cast<double>(pixels[(y + 1) * kSide + x]) - pixels[(y - 1) * kSide + x];
      const double cu = du / 4.0;
      const double cv = dv / 4.0;
      double votes[8] = {};
      (lowe ? orientations_of_lowe : orientations_of_header)(gx, gy, votes);
      for (int j = 0; j < 4; ++j) {
        for (int i = 0; i < 4; ++i) {
          const double wu = std::max(0.0, 1.0 - std::fabs(cu - (i - 1.5)));
          const double wv = std::max(0.0, 1.0 - std::fabs(cv - (j - 1.5)));
          const double w = wu * wv * (lowe ? window(cu, cv) : window(i - 1.5, j - 1.5));
          for (int b = 0; b < 8; ++b) h[(j * 4 + i) * 8 + b] += w * votes[b];
        }
      }
    }
  }
  for (int pass = 0; pass < 2; ++pass) {
    double norm = 0.0;
    for (const double v : h) norm += v * v;
    for (double& v : h)
      v = pass == 0 ? std::min(v / std::sqrt(norm), 0.2) : std::min(512.0 * v / std::sqrt(norm), 255.0);
  }
}

void test_against_brute_force(void**) {
  double worst = 0.0;
  double least = 1.0;
  double least_lowe = 1.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    fill_texture(seed);
    for (int at = kDescriptorMargin; at < kSide - kDescriptorMargin; at += 7) {
      double expected[kDescriptorSize];
      brute_force(false, at, kSide - 1 - at, expected);
      const Descriptor d = describe(kImage, at, kSide - 1 - at);
      for (int i = 0; i < kDescriptorSize; ++i) worst = std::max(worst, std::fabs(d.bin[i] - expected[i]));
      least = std::min(least, cosine(d, expected));
      brute_force(true, at, kSide - 1 - at, expected);
      least_lowe = std::min(least_lowe, cosine(d, expected));
    }
  }
  print_message("against the formula: largest difference %.2f of 512, least cosine %.6f; of Lowe's %.4f\n",
                worst, least, least_lowe);
  assert_at_most(worst, 2.5);  // rounding 0.5; the window's weights are of 6 bits
  assert_at_least(least, 0.9998);
  assert_at_least(least_lowe, 0.99);
}

void test_ramps_fill_one_orientation(void**) {
  const int step[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  for (int k = 0; k < 4; ++k) {
    for (int i = 0; i < kSide * kSide; ++i) {
      pixels[i] =
          static_cast<std::uint16_t>(30000 + 200 * (step[k][0] * (i % kSide) + step[k][1] * (i / kSide)));
    }
    const Descriptor d = describe(kImage, 32, 32);
    for (int i = 0; i < kDescriptorSize; ++i) {
      if (i % 8 == 2 * k) {
        assert_true(d.bin[i] > 40);
      } else {
        assert_true(d.bin[i] <= 1);
      }
    }
  }
}

void test_flat_is_all_zeros(void**) {
  for (std::uint16_t& p : pixels) p = 20000;
  const Descriptor d = describe(kImage, 32, 32);
  for (const std::uint8_t b : d.bin) assert_int_equal(b, 0);
}

void test_brightness_does_not_matter(void**) {
  fill_texture(3);
  const Descriptor a = describe(kImage, 30, 33);
  fill_texture(3, 0.5, 20.0);
  const Descriptor b = describe(kImage, 30, 33);
  for (int i = 0; i < kDescriptorSize; ++i) assert_near(a.bin[i], b.bin[i], 1.0);
}

void test_margin_asserts(void**) {
  fill_texture(3);
  constexpr int kLow = kDescriptorMargin;
  constexpr int kHigh = kSide - kDescriptorMargin - 1;
  assert_false(test::asserts([] { describe(kImage, kLow, kHigh); }));
  assert_true(test::asserts([] { describe(kImage, kLow - 1, 32); }));
  assert_true(test::asserts([] { describe(kImage, 32, kLow - 1); }));
  assert_true(test::asserts([] { describe(kImage, kHigh + 1, 32); }));
  assert_true(test::asserts([] { describe(kImage, 32, kHigh + 1); }));
}

// ---- keypoints of another implementation ------------------------------------------------------------------

struct Keypoint {
  double row, col, scale, angle;
  double bin[kDescriptorSize];
};
Keypoint keypoints[700];
std::uint8_t box[400 * 300];
int box_width = 0;
int box_height = 0;

bool read_pgm(const char* path) {
  std::FILE* file = std::fopen(path, "rb");
  if (file == nullptr) return false;
  char line[256];
  int wanted = 0;
  while (wanted < 3 && std::fgets(line, sizeof line, file) != nullptr) {
    if (line[0] == '#') continue;
    if (wanted == 1) std::sscanf(line, "%d %d", &box_width, &box_height);
    ++wanted;
  }
  const auto count = static_cast<std::size_t>(box_width) * static_cast<std::size_t>(box_height);
  const bool whole = count > 0 && count <= sizeof box && std::fread(box, 1, count, file) == count;
  std::fclose(file);
  return whole;
}

int read_keypoints(const char* path) {
  std::FILE* file = std::fopen(path, "r");
  if (file == nullptr) return 0;
  int count = 0;
  int size = 0;
  bool good = std::fscanf(file, "%d %d", &count, &size) == 2 && count <= 700 && size == kDescriptorSize;
  for (int k = 0; good && k < count; ++k) {
    Keypoint& p = keypoints[k];
    good = std::fscanf(file, "%lf %lf %lf %lf", &p.row, &p.col, &p.scale, &p.angle) == 4;
    for (int i = 0; good && i < size; ++i) good = std::fscanf(file, "%lf", &p.bin[i]) == 1;
  }
  std::fclose(file);
  return good ? count : 0;
}

/// The image under a Gaussian of `sigma` at a sub-pixel place.
double blurred(double u, double v, double sigma) {
  const int r = static_cast<int>(3.0 * sigma) + 1;
  const int cu = static_cast<int>(std::floor(u + 0.5));
  const int cv = static_cast<int>(std::floor(v + 0.5));
  static double wu[200];
  for (int i = -r; i <= r; ++i) wu[i + r] = std::exp(-0.5 * (cu + i - u) * (cu + i - u) / (sigma * sigma));
  double sum = 0.0;
  double weight = 0.0;
  for (int j = -r; j <= r; ++j) {
    const double wv = std::exp(-0.5 * (cv + j - v) * (cv + j - v) / (sigma * sigma));
    const std::uint8_t* row = box + (cv + j) * box_width + cu;
    for (int i = -r; i <= r; ++i) {
      sum += wv * wu[i + r] * row[i];
      weight += wv * wu[i + r];
    }
  }
  return sum / weight;
}

/// Resamples the surroundings of a keypoint, turned and scaled so that its cells are kCellPx wide and its
/// orientation points along +u. False where the image does not hold them.
bool resample(const Keypoint& p, double turn) {
  constexpr int kHalf = kDescriptorMargin;
  const double step = 3.0 * p.scale / kCellPx;
  const double sigma = std::sqrt(p.scale * p.scale - 0.25);  // the picture itself has 0.5 px
  const double reach = 1.42 * kHalf * step + 3.0 * sigma + 2.0;
  if (p.col < reach || p.row < reach || p.col >= box_width - reach || p.row >= box_height - reach)
    return false;
  for (int j = -kHalf; j <= kHalf; ++j) {
    for (int i = -kHalf; i <= kHalf; ++i) {
      const double u = p.col + step * (std::cos(turn) * i - std::sin(turn) * j);
      const double v = p.row + step * (std::sin(turn) * i + std::cos(turn) * j);
      pixels[(32 + j) * kSide + 32 + i] = static_cast<std::uint16_t>(256.0 * blurred(u, v, sigma) + 0.5);
    }
  }
  return true;
}

void test_agrees_with_another_implementation(void**) {
  const std::string image = test::find_data("oracles/vlfeat/box.pgm");
  const std::string list = test::find_data("oracles/vlfeat/box.sift");
  SKIP_WITHOUT(image, "oracles/vlfeat/box.pgm");
  SKIP_WITHOUT(list, "oracles/vlfeat/box.sift");
  assert_true(read_pgm(image.c_str()));
  const int count = read_keypoints(list.c_str());
  assert_int_equal(count, 638);
  static double agreement[700];
  int used = 0;
  for (int k = 0; k < count; ++k) {
    // That implementation counts angles with v up: turned about, and its bins run the other way round.
    if (!resample(keypoints[k], -keypoints[k].angle)) continue;
    double theirs[kDescriptorSize];
    for (int i = 0; i < kDescriptorSize; ++i) theirs[i] = keypoints[k].bin[i / 8 * 8 + (8 - i % 8) % 8];
    agreement[used++] = cosine(describe(kImage, 32, 32), theirs);
  }
  assert_int_equal(used, 492);
  std::sort(agreement, agreement + used);
  print_message("%d keypoints of another implementation: cosine median %.4f, 10 %% below %.4f, least %.4f\n",
                used, agreement[used / 2], agreement[used / 10], agreement[0]);
  assert_at_least(agreement[used / 2], 0.99);
  assert_at_least(agreement[used / 10], 0.98);
  assert_at_least(agreement[0], 0.93);
}

// ---- chi-squared ------------------------------------------------------------------------------------------

double formula(const Descriptor& a, const Descriptor& b) {
  double sum = 0.0;
  for (int i = 0; i < kDescriptorSize; ++i) {
    const double s = a.bin[i] + b.bin[i];
    if (s > 0.0) sum += (a.bin[i] - b.bin[i]) * static_cast<double>(a.bin[i] - b.bin[i]) / s;
  }
  return 256.0 * sum;
}

Descriptor random_descriptor(Random& random, std::uint32_t most) {
  Descriptor d;
  for (std::uint8_t& b : d.bin) b = static_cast<std::uint8_t>(random.below(most + 1));
  return d;
}

void test_chi_squared_formula_and_symmetry(void**) {
  Random random(8);
  for (int k = 0; k < 2000; ++k) {
    const std::uint32_t most = k % 3 == 0 ? 255U : (k % 3 == 1 ? 60U : 3U);
    const Descriptor a = random_descriptor(random, most);
    const Descriptor b = random_descriptor(random, most);
    const std::uint32_t d = chi_squared(a, b, UINT32_MAX);
    // Reciprocals of 16 bits: 0.4 % at most; each of 128 terms is cut to a whole 1/256.
    assert_near(d, formula(a, b), 0.004 * formula(a, b) + 128.0);
    assert_int_equal(d, chi_squared(b, a, UINT32_MAX));
    assert_int_equal(chi_squared(a, a, UINT32_MAX), 0);
  }
}

void test_chi_squared_corners(void**) {
  Descriptor none;
  Descriptor all;
  for (std::uint8_t& b : all.bin) b = 255;
  assert_int_equal(chi_squared(none, none, UINT32_MAX), 0);
  assert_near(chi_squared(all, none, UINT32_MAX), 256.0 * 128 * 255, 256.0 * 128 * 255 * 0.004);
  Descriptor one;
  one.bin[127] = 1;
  assert_int_equal(chi_squared(one, none, UINT32_MAX), 256);
}

void test_chi_squared_early_stop(void**) {
  Random random(9);
  for (int k = 0; k < 500; ++k) {
    const Descriptor a = random_descriptor(random, 120);
    const Descriptor b = random_descriptor(random, 120);
    const std::uint32_t d = chi_squared(a, b, UINT32_MAX);
    for (const std::uint32_t stop : {0U, d / 3, d - 1, d}) assert_true(chi_squared(a, b, stop) >= stop);
    assert_int_equal(chi_squared(a, b, d + 1), d);
  }
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_against_brute_force),
      cmocka_unit_test(test_ramps_fill_one_orientation),
      cmocka_unit_test(test_flat_is_all_zeros),
      cmocka_unit_test(test_brightness_does_not_matter),
      cmocka_unit_test(test_margin_asserts),
      cmocka_unit_test(test_agrees_with_another_implementation),
      cmocka_unit_test(test_chi_squared_formula_and_symmetry),
      cmocka_unit_test(test_chi_squared_corners),
      cmocka_unit_test(test_chi_squared_early_stop),
  };
  return cmocka_run_group_tests_name("sift_descriptor", tests, nullptr, nullptr);
}
