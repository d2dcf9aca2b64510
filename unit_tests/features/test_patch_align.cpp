// Sub-pixel alignment of textures whose exact place is known: bias and noise, gain and offset,
// warps, each status.
#include "features/patch_align.hpp"

#include <cstring>

#include "image/gaussian.hpp"
#include "support/cmocka.hpp"
#include "support/waves.hpp"

using namespace cairn;

namespace {

constexpr int kSide = 48;
std::uint16_t from_pixels[kSide * kSide];
std::uint16_t to_pixels[kSide * kSide];
const SmoothImage kFrom = packed_view<const std::uint16_t>(from_pixels, kSide, kSide);
const SmoothImage kTo = packed_view<const std::uint16_t>(to_pixels, kSide, kSide);
constexpr float kIdentity[4] = {1.0F, 0.0F, 0.0F, 1.0F};
constexpr int kAt = 24;

struct Change {
  double du = 0.0;
  double dv = 0.0;
  double gain = 1.0;
  double offset = 0.0;
  double warp[4] = {1.0, 0.0, 0.0, 1.0};
  double noise = 0.0;  ///< grey levels, before quantisation to bytes
};

/// A camera's picture of the texture: bytes, then smoothed as the extractor does.
template <typename Grey>
void picture(const Grey& grey, double noise, Random& random, std::uint16_t* out) {
  static std::uint8_t bytes[kSide * kSide];
  static ScaleRows rows;
  static std::int16_t unused[kSide];
  for (int i = 0; i < kSide * kSide; ++i) {
    const double g = grey(i % kSide, i / kSide) + noise * test::normal(random) + 0.5;
    bytes[i] = static_cast<std::uint8_t>(g < 0.0 ? 0.0 : (g > 255.0 ? 255.0 : g));
  }
  rows.start(packed_view<const std::uint8_t>(bytes, kSide, kSide));
  for (int y = 0; y < kSide; ++y) rows.next(out + y * kSide, unused);
}

/// The texture, and what the change makes of it: the template's pixel lies at (kAt + du, kAt + dv).
void fill(const test::Waves& waves, const Change& c, Random& random) {
  const double det = c.warp[0] * c.warp[3] - c.warp[1] * c.warp[2];
  picture([&](int x, int y) { return 120.0 + waves.at(x, y); }, c.noise, random, from_pixels);
  picture(
      [&](int x, int y) {
        const double u = x - kAt - c.du;
        const double v = y - kAt - c.dv;
        const double su = (c.warp[3] * u - c.warp[1] * v) / det;
        const double sv = (c.warp[0] * v - c.warp[2] * u) / det;
        return 120.0 + c.offset + c.gain * waves.at(kAt + su, kAt + sv);
      },
      c.noise, random, to_pixels);
}

Alignment run(const float (&warp)[4] = kIdentity, float u = kAt, float v = kAt,
              const AlignParams& params = {}) {
  static PatchTemplate patch;
  assert_status(cut_template(kFrom, kAt, kAt, patch), AlignStatus::kAligned);
  return align(patch, kTo, u, v, warp, params);
}

struct Errors {
  double mean_u, mean_v, rms, worst;
  int aligned;
};

/// Errors over random shifts of up to `reach` px; the change's own shift is not used.
Errors errors_over_shifts(Change change, double reach, const float (&warp)[4], int draws = 120) {
  Random random(17);
  Errors e = {};
  for (int i = 0; i < draws; ++i) {
    const test::Waves waves(1000 + static_cast<std::uint64_t>(i), 6.0, 30.0, 28.0);
    change.du = test::uniform(random, -reach, reach);
    change.dv = test::uniform(random, -reach, reach);
    fill(waves, change, random);
    const Alignment a = run(warp);
    if (a.status != AlignStatus::kAligned) continue;
    ++e.aligned;
    const double eu = static_cast<double>(a.u) - kAt - change.du;
    const double ev = static_cast<double>(a.v) - kAt - change.dv;
    e.mean_u += eu;
    e.mean_v += ev;
    e.rms += eu * eu + ev * ev;
    e.worst = std::fmax(e.worst, std::hypot(eu, ev));
  }
  e.mean_u /= e.aligned;
  e.mean_v /= e.aligned;
  e.rms = std::sqrt(e.rms / (2.0 * e.aligned));
  return e;
}

void show(const char* name, const Errors& e) {
  print_message("%s: %d aligned, bias (%.4f, %.4f) px, rms %.4f px, worst %.4f px\n", name, e.aligned,
                e.mean_u, e.mean_v, e.rms, e.worst);
}

// What is left without noise comes from the bilinear interpolation, and from rounding to bytes.
void test_shifts(void**) {
  const Errors e = errors_over_shifts({}, 1.0, kIdentity);
  show("shifts", e);
  assert_at_least(e.aligned, 116);
  assert_near(e.mean_u, 0.0, 0.004);
  assert_near(e.mean_v, 0.0, 0.004);
  assert_at_most(e.rms, 0.024);
  assert_at_most(e.worst, 0.11);
}

void test_gain_and_offset(void**) {
  Change change;
  change.gain = 0.6;
  change.offset = -25.0;
  const Errors e = errors_over_shifts(change, 1.0, kIdentity);
  show("gain 0.6, offset -25", e);
  assert_at_least(e.aligned, 116);
  assert_near(e.mean_u, 0.0, 0.004);
  assert_near(e.mean_v, 0.0, 0.004);
  assert_at_most(e.rms, 0.024);
  assert_at_most(e.worst, 0.13);
}

void test_noise(void**) {
  Change change;
  change.noise = 2.0;
  const Errors e = errors_over_shifts(change, 1.0, kIdentity);
  show("noise of 2 grey levels", e);
  assert_at_least(e.aligned, 114);
  assert_near(e.mean_u, 0.0, 0.01);
  assert_near(e.mean_v, 0.0, 0.01);
  assert_at_most(e.rms, 0.06);
}

void test_warps(void**) {
  const double warps[3][4] = {{0.85, 0.1, 0.0, 1.0}, {1.2, 0.15, -0.1, 1.15}, {0.95, -0.2, 0.2, 0.95}};
  for (const auto& w : warps) {
    Change change;
    float warp[4];
    for (int k = 0; k < 4; ++k) {
      change.warp[k] = w[k];
      warp[k] = static_cast<float>(w[k]);
    }
    const Errors told = errors_over_shifts(change, 1.0, warp, 60);
    const Errors untold = errors_over_shifts(change, 1.0, kIdentity, 60);
    show("warp told  ", told);
    show("warp untold", untold);
    assert_at_least(told.aligned, 57);
    assert_near(told.mean_u, 0.0, 0.01);
    assert_near(told.mean_v, 0.0, 0.01);
    assert_at_most(told.rms, 0.035);
    assert_at_most(told.worst, 0.2);
    assert_true(untold.rms > 2.0 * told.rms);
  }
}

void test_zero_shift_stays(void**) {
  Random random(1);
  const test::Waves waves(5, 6.0, 30.0, 28.0);
  fill(waves, {}, random);
  const Alignment a = run();
  assert_status(a.status, AlignStatus::kAligned);
  assert_near(a.u, kAt, 1e-3);  // weights are rounded
  assert_near(a.v, kAt, 1e-3);
  assert_near(a.correlation, 1.0, 1e-3);
}

void test_template_outside(void**) {
  Random random(1);
  fill(test::Waves(5, 6.0, 30.0, 28.0), {}, random);
  static PatchTemplate patch;
  constexpr int kLow = kPatchRadius + 1;  // one more for the gradient
  constexpr int kHigh = kSide - kPatchRadius - 2;
  assert_status(cut_template(kFrom, kLow, kLow, patch), AlignStatus::kAligned);
  assert_status(cut_template(kFrom, kHigh, kHigh, patch), AlignStatus::kAligned);
  assert_status(cut_template(kFrom, kLow - 1, 30, patch), AlignStatus::kOutside);
  assert_status(cut_template(kFrom, 30, kLow - 1, patch), AlignStatus::kOutside);
  assert_status(cut_template(kFrom, kHigh + 1, 30, patch), AlignStatus::kOutside);
  assert_status(cut_template(kFrom, 30, kHigh + 1, patch), AlignStatus::kOutside);
  assert_status(cut_template(kFrom, -1000, 1000, patch), AlignStatus::kOutside);
}

void test_target_outside(void**) {
  Random random(1);
  fill(test::Waves(5, 6.0, 30.0, 28.0), {}, random);
  constexpr float kHigh = kSide - 1 - kPatchRadius;
  for (const float bad :
       {kPatchRadius - 0.1F, kHigh, 1e9F, -1e9F, static_cast<float>(NAN), static_cast<float>(INFINITY)}) {
    assert_status(run(kIdentity, bad, 32.0F).status, AlignStatus::kOutside);
    assert_status(run(kIdentity, 32.0F, bad).status, AlignStatus::kOutside);
  }
  const float twice[4] = {2.0F, 0.0F, 0.0F, 1.0F};
  assert_status(run(twice, 2 * kPatchRadius - 0.1F, 32.0F).status, AlignStatus::kOutside);
  const float broken[4] = {1.0F, NAN, 0.0F, 1.0F};
  assert_status(run(broken).status, AlignStatus::kOutside);
}

void test_rounding_does_not_read_beyond_the_rim(void**) {
  // Where the farthest sample lies a rounding error inside the last column, the sum in another order lies on
  // it: there is nothing to the right of it to interpolate with.
  constexpr int kWidth = 512;
  static std::uint16_t wide[kWidth * 20];
  const SmoothImage target = packed_view<const std::uint16_t>(wide, kWidth, 20);
  const SmoothImage upright = packed_view<const std::uint16_t>(wide, 20, kWidth);
  const float rims[3][3] = {{506.448782F, 0.572843671F, 0.337394714F},
                            {505.378557F, -0.91843462F, -0.205850586F},
                            {505.297051F, -1.0599196F, -0.0806670487F}};
  Random random(1);
  fill(test::Waves(5, 6.0, 30.0, 28.0), {}, random);
  static PatchTemplate patch;
  assert_status(cut_template(kFrom, kAt, kAt, patch), AlignStatus::kAligned);
  for (const auto& rim : rims) {
    const float along_u[4] = {rim[1], rim[2], 0.0F, 1.0F};
    assert_status(align(patch, target, rim[0], 10.0F, along_u, {}).status, AlignStatus::kOutside);
    const float along_v[4] = {1.0F, 0.0F, rim[1], rim[2]};
    assert_status(align(patch, upright, 10.0F, rim[0], along_v, {}).status, AlignStatus::kOutside);
  }
}

void test_flat(void**) {
  static PatchTemplate patch;
  Random random(3);
  picture([](int, int) { return 90.0; }, 0.0, random, from_pixels);
  assert_status(cut_template(kFrom, kAt, kAt, patch), AlignStatus::kFlat);
  picture([](int x, int) { return x < kAt ? 40.0 : 200.0; }, 0.0, random,
          from_pixels);  // an edge fixes one direction
  assert_status(cut_template(kFrom, kAt, kAt, patch), AlignStatus::kFlat);
  picture([](int x, int y) { return 3.0 * x + y; }, 0.0, random, from_pixels);
  assert_status(cut_template(kFrom, kAt, kAt, patch), AlignStatus::kFlat);
}

void test_not_converged(void**) {
  Random random(1);
  Change change;
  change.du = 0.8;
  fill(test::Waves(5, 6.0, 30.0, 28.0), change, random);
  assert_status(run().status, AlignStatus::kAligned);
  AlignParams one;
  one.max_iterations = 1;
  assert_status(run(kIdentity, kAt, kAt, one).status, AlignStatus::kNotConverged);
  AlignParams narrow;
  narrow.max_shift_px = 0.5F;
  assert_status(run(kIdentity, kAt, kAt, narrow).status, AlignStatus::kNotConverged);
}

void test_different(void**) {
  Random random(1);
  const test::Waves waves(5, 6.0, 30.0, 28.0);
  Change negative;
  negative.gain = -1.0;
  fill(waves, negative, random);
  assert_status(run().status, AlignStatus::kDifferent);
  Change noisy;  // right, but not to be trusted
  noisy.noise = 4.0;
  fill(waves, noisy, random);
  AlignParams strict;
  strict.converged_px = 0.2F;
  strict.min_correlation = 0.0F;
  const Alignment a = run(kIdentity, kAt, kAt, strict);
  assert_status(a.status, AlignStatus::kAligned);
  strict.min_correlation = a.correlation + 0.001F;
  assert_status(run(kIdentity, kAt, kAt, strict).status, AlignStatus::kDifferent);
}

void test_flat_target_is_never_aligned(void**) {
  Random random(1);
  fill(test::Waves(5, 6.0, 30.0, 28.0), {}, random);
  for (const int grey : {0, 20000, 65280}) {
    for (std::uint16_t& p : to_pixels) p = static_cast<std::uint16_t>(grey);
    assert_true(run().status != AlignStatus::kAligned);
  }
}

void test_unrelated_patches_are_told_apart(void**) {
  int aligned = 0;
  Random random(2);
  for (std::uint64_t i = 0; i < 200; ++i) {
    const test::Waves a(2 * i, 6.0, 30.0, 28.0);
    const test::Waves b(2 * i + 1, 6.0, 30.0, 28.0);
    picture([&](int x, int y) { return 120.0 + a.at(x, y); }, 1.0, random, from_pixels);
    picture([&](int x, int y) { return 120.0 + b.at(x, y); }, 1.0, random, to_pixels);
    aligned += run().status == AlignStatus::kAligned ? 1 : 0;
  }
  print_message("unrelated patches taken for the same: %d of 200\n", aligned);
  assert_at_most(aligned, 8);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_shifts),
      cmocka_unit_test(test_gain_and_offset),
      cmocka_unit_test(test_noise),
      cmocka_unit_test(test_warps),
      cmocka_unit_test(test_zero_shift_stays),
      cmocka_unit_test(test_template_outside),
      cmocka_unit_test(test_target_outside),
      cmocka_unit_test(test_rounding_does_not_read_beyond_the_rim),
      cmocka_unit_test(test_flat),
      cmocka_unit_test(test_not_converged),
      cmocka_unit_test(test_different),
      cmocka_unit_test(test_flat_target_is_never_aligned),
      cmocka_unit_test(test_unrelated_patches_are_told_apart),
  };
  return cmocka_run_group_tests_name("patch_align", tests, nullptr, nullptr);
}
