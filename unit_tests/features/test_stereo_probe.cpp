// Disparities on a grid: a slanted plane with a box on it, what has no answer, bad input, slices.
#include "features/stereo_probe.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

#include "support/cmocka.hpp"
#include "support/slices.hpp"
#include "support/waves.hpp"

using namespace cairn;

namespace {

constexpr int kWidth = 256;
constexpr int kHeight = 160;
std::uint8_t left_pixels[kWidth * kHeight];
std::uint8_t right_pixels[kWidth * kHeight];
const ImageU8 kLeft = packed_view<const std::uint8_t>(left_pixels, kWidth, kHeight);
const ImageU8 kRight = packed_view<const std::uint8_t>(right_pixels, kWidth, kHeight);
StereoProbeJob job;
StereoProbeJob sliced;

const Vec3 kPlane(0.04, 0.12, 12.0);
constexpr int kBox[4] = {120, 180, 60, 110};  // u0, u1, v0, v1
constexpr double kBoxAbove = 7.0;

bool in_box(double u, double v, double margin) {
  return u >= kBox[0] - margin && u < kBox[1] + margin && v >= kBox[2] - margin && v < kBox[3] + margin;
}
double plane_at(double u, double v) { return kPlane[0] * u + kPlane[1] * v + kPlane[2]; }

std::uint8_t byte(double grey) {
  return static_cast<std::uint8_t>(grey < 0.0 ? 0.0 : (grey > 255.0 ? 255.0 : grey + 0.5));
}

/// The right image is the texture itself; the left one looks it up at its disparity.
void fill_scene(double noise, bool box) {
  const test::Waves waves(7, 5.0, 40.0, 35.0);
  Random random(5);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const double d = plane_at(u, v) + (box && in_box(u, v, 0.0) ? kBoxAbove : 0.0);
      left_pixels[v * kWidth + u] = byte(120.0 + waves.at(u - d, v) + noise * test::normal(random));
      right_pixels[v * kWidth + u] = byte(120.0 + waves.at(u, v) + noise * test::normal(random));
    }
  }
}

void run(const StereoProbeParams& params = {}, const Vec3& plane = kPlane) {
  assert_status(job.start(params, kLeft, kRight, plane), ProbeStatus::kRunning);
  assert_true(test::run_whole(job));
  assert_status(job.status(), ProbeStatus::kDone);
}

/// A right image that lies lower by rows: the same disparities, but for windows that it does not hold.
void test_right_image_lower(void**) {
  fill_scene(1.5, true);
  run();
  const StereoProbeJob::Probes level = job.result();
  static std::uint8_t lower_pixels[kWidth * kHeight];
  const ImageU8 lower = packed_view<const std::uint8_t>(lower_pixels, kWidth, kHeight);
  for (const int rows : {-3, 5}) {
    std::memset(lower_pixels, 0, sizeof lower_pixels);
    for (int v = 0; v < kHeight; ++v) {
      if (v + rows < 0 || v + rows >= kHeight) continue;
      std::memcpy(lower_pixels + (v + rows) * kWidth, right_pixels + v * kWidth, kWidth);
    }
    assert_status(job.start({}, kLeft, lower, kPlane, rows), ProbeStatus::kRunning);
    assert_true(test::run_whole(job));
    std::size_t next = 0;
    for (const StereoProbe& p : level) {
      if (p.v + rows < 4 || p.v + rows + 4 > kHeight) continue;
      assert_true(next < job.result().size());
      const StereoProbe& q = job.result()[next++];
      assert_true(q.u == p.u && q.v == p.v && q.d_px == p.d_px);
    }
    assert_true(next == job.result().size());
    assert_true(next < level.size());
  }
}

/// Inside the boxes everything is as without them; outside, it is each second probe of each second row.
void test_attends_to_boxes(void**) {
  fill_scene(1.5, true);
  run();
  const StereoProbeJob::Probes everywhere = job.result();
  StereoProbeJob::Boxes boxes;
  StereoProbeJob::Boxes around;
  around.append({90, 200, 30, 130});
  around.append({-20, 40, 60, 90});
  boxes.append({-20, 61, 10, 50});
  boxes.append({100, 190, 40, 120});
  boxes.append({230, 300, 140, 300});
  assert_status(job.start({}, kLeft, kRight, kPlane), ProbeStatus::kRunning);
  job.attend_to(boxes, around);
  assert_true(test::run_whole(job));
  std::size_t next = 0;
  int outside = 0;
  int beside = 0;
  for (const StereoProbe& p : everywhere) {
    const auto lies_in = [&p](const StereoProbeJob::Boxes& some) {
      return std::any_of(some.begin(), some.end(), [&p](const PixelBounds& b) {
        return p.u >= b.u_min && p.u <= b.u_max && p.v >= b.v_min && p.v <= b.v_max;
      });
    };
    const bool inside = lies_in(boxes);
    const int column = p.u / StereoProbeJob::kSpacing;
    const int row = p.v / StereoProbeJob::kSpacing;
    const bool few = column % 2 == 0 && row % 2 == 0;
    const bool half = lies_in(around) && (column + row) % 2 == 0;
    if (!inside && !few && !half) continue;
    outside += inside ? 0 : 1;
    beside += half && !inside && !few ? 1 : 0;
    assert_true(next < job.result().size());
    const StereoProbe& q = job.result()[next++];
    assert_true(q.u == p.u && q.v == p.v && q.d_px == p.d_px);
  }
  assert_true(next == job.result().size());
  assert_at_least(outside, 100);
  assert_at_least(beside, 20);
  boxes.clear();
  around.clear();
  assert_status(job.start({}, kLeft, kRight, kPlane), ProbeStatus::kRunning);
  job.attend_to(boxes, around);
  assert_true(test::run_whole(job));
  assert_at_least(job.result().size(), everywhere.size() / 5);
}

/// Of so many operations, and what that cost.
std::uint64_t run_planned(std::uint32_t ops) {
  assert_status(job.start({}, kLeft, kRight, kPlane), ProbeStatus::kRunning);
  job.plan(ops);
  WorkBudget budget = WorkBudget::unlimited();
  assert_int_equal(static_cast<int>(job.step(budget)), static_cast<int>(Progress::kDone));
  return budget.spent();
}

/// Where all probes take more than is planned, upper rows keep all of theirs and lower ones have fewer: none
/// that all do not have. What is enough changes nothing.
void test_plan(void**) {
  fill_scene(20.0, true);
  const std::uint64_t cost = run_planned(UINT32_MAX);
  const StereoProbeJob::Probes all = job.result();
  assert_int_equal(job.thinned_rows(), 0);
  for (const double share : {1.2, 0.8, 0.6, 0.0}) {
    const auto plan = static_cast<std::uint32_t>(share * static_cast<double>(cost));
    const std::uint64_t spent = run_planned(plan);
    print_message("planned %u of %llu: %llu, %zu probes of %zu, %d rows thinned\n", plan,
                  static_cast<unsigned long long>(cost), static_cast<unsigned long long>(spent),
                  job.result().size(), all.size(), job.thinned_rows());
    if (share > 0.0) assert_at_most(spent, 1.03 * plan);
    assert_true((job.thinned_rows() > 0) == (share < 1.0));
    std::size_t next = 0;
    for (const StereoProbe& p : job.result()) {
      while (next < all.size() && (all[next].u != p.u || all[next].v != p.v)) ++next;
      assert_true(next < all.size());
      assert_true(all[next++].d_px == p.d_px);
    }
    assert_at_least(job.result().size(), (std::min(share, 1.0) - 0.2) * static_cast<double>(all.size()));
    assert_at_least(job.result().size(), 0.2 * static_cast<double>(all.size()));
  }
}

/// At the left rim the right image does not hold the ground; rows that repeat agree there at too small a
/// disparity all the same. No hole is found for it.
void test_ground_beyond_the_left_rim(void**) {
  constexpr int kGround_px = 30;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const auto texture = [v](int x) {
        return static_cast<std::uint8_t>(40 + 23 * ((x + 9000) % 6) + 7 * (v % 9));
      };
      left_pixels[v * kWidth + u] = texture(u - kGround_px);
      right_pixels[v * kWidth + u] =
          u < kWidth / 2 ? texture(u) : static_cast<std::uint8_t>(255 - texture(u));
    }
  }
  run({}, Vec3(0.0, 0.0, kGround_px));
  for (const StereoProbe& p : job.result()) assert_at_least(p.u, kGround_px + 6);
}

void test_plane_and_box(void**) {
  fill_scene(1.5, true);
  run();
  int ground = 0;
  int on_box = 0;
  int good = 0;
  double sum = 0.0;
  for (const StereoProbe& p : job.result()) {
    const double u = p.u - 0.5;  // the window's centre
    const double v = p.v - 0.5;
    const bool inside = in_box(u, v, -8.0);
    if (!inside && in_box(u, v, 30.0)) continue;  // its rim, and what it hides
    const double e = static_cast<double>(p.d_px) - plane_at(u, v) - (inside ? kBoxAbove : 0.0);
    (inside ? on_box : ground) += 1;
    if (std::fabs(e) > 0.5) continue;
    ++good;
    sum += e;
  }
  print_message("%d probes on the ground, %d on the box, %d of them within 0.5 px, mean error %.4f px\n",
                ground, on_box, good, sum / good);
  assert_true(ground > 500);
  assert_true(on_box > 40);
  assert_at_least(good, 0.98 * (ground + on_box));
  assert_near(sum / good, 0.0, 0.02);
}

void test_position_is_the_windows_centre(void**) {
  // On a plane that is steep in u, half a pixel to the side shows.
  const Vec3 steep(0.25, 0.0, 5.0);
  const test::Waves waves(7, 8.0, 40.0, 35.0);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      left_pixels[v * kWidth + u] = byte(120.0 + waves.at(u - steep[0] * u - steep[2], v));
      right_pixels[v * kWidth + u] = byte(120.0 + waves.at(u, v));
    }
  }
  StereoProbeParams params;
  params.min_disparity_px = 1;
  run(params, steep);
  double sum = 0.0;
  int count = 0;
  for (const StereoProbe& p : job.result()) {
    const double e = static_cast<double>(p.d_px) - (steep[0] * (p.u - 0.5) + steep[2]);
    if (std::fabs(e) > 1.0) continue;
    sum += e;
    ++count;
  }
  print_message("steep plane: mean error %.4f px of %d probes\n", sum / count, count);
  assert_true(count > 200);
  assert_near(sum / count, 0.0, 0.06);
}

void test_order_and_grid(void**) {
  fill_scene(0.0, false);
  run();
  int last = -1;
  for (const StereoProbe& p : job.result()) {
    assert_int_equal((p.u - 4) % StereoProbeJob::kSpacing, 0);
    assert_int_equal((p.v - 4) % StereoProbeJob::kSpacing, 0);
    assert_true(p.u + 4 <= kWidth && p.v + 4 <= kHeight);
    const int at = p.v * kWidth + p.u;
    assert_true(at > last);
    last = at;
  }
}

void test_no_texture_no_probe(void**) {
  std::memset(left_pixels, 100, sizeof left_pixels);
  std::memset(right_pixels, 100, sizeof right_pixels);
  run();
  assert_int_equal(job.result().size(), 0);
  for (int i = 0; i < kWidth * kHeight; ++i)
    left_pixels[i] = right_pixels[i] = (i / kWidth) % 2 == 0 ? 60 : 200;
  run();  // texture that runs along the rows tells nothing
  assert_int_equal(job.result().size(), 0);
}

void test_repeated_texture_is_left_out(void**) {
  for (int i = 0; i < kWidth * kHeight; ++i) {
    left_pixels[i] = right_pixels[i] = byte(120.0 + 80.0 * std::sin((i % kWidth) * 2.0 * kPi / 6.0));
  }
  run({}, Vec3(0.0, 0.0, 30.0));  // searched from 22 to 50 px: more than one period, but for the left rim
  for (const StereoProbe& p : job.result()) assert_true(p.u < 54);
  StereoProbeParams narrow;  // from 14 to 26 px: 18 and 24, six apart
  narrow.below = narrow.above = 0.2;
  run(narrow, Vec3(0.0, 0.0, 20.0));
  for (const StereoProbe& p : job.result()) assert_true(p.u < 30);
}

void test_minimum_at_the_end_of_the_range_is_left_out(void**) {
  fill_scene(0.0, false);
  StereoProbeParams params;
  params.above = 0.0;
  params.below = 0.0;
  run(params, kPlane + Vec3(0.0, 0.0, 8.0));  // searched from 6 to 10 px nearer than it is
  int right_ones = 0;
  for (const StereoProbe& p : job.result()) {
    right_ones += std::fabs(static_cast<double>(p.d_px) - plane_at(p.u, p.v)) < 5.0 ? 1 : 0;
  }
  assert_int_equal(right_ones, 0);
  run(params);
  assert_true(job.result().size() > 800);
}

void test_disparity_limits(void**) {
  fill_scene(0.0, false);
  StereoProbeParams params;
  params.min_disparity_px = 20;
  params.max_disparity_px = 30;
  run(params);
  assert_true(job.result().size() > 100);
  for (const StereoProbe& p : job.result()) {
    assert_true(p.d_px > 19.0F && p.d_px < 31.0F);
  }
  run(params, Vec3(0.0, 0.0, 1000.0));  // ground nearer than the limit: nothing to search
  assert_int_equal(job.result().size(), 0);
  run(params, Vec3(0.0, 0.0, -1000.0));
  assert_int_equal(job.result().size(), 0);
  run(params, Vec3(1e150, -1e150, 0.0));
}

/// The definition, pixel by pixel: whether there is a probe at (u, v), and its disparity.
bool brute_force(const StereoProbeParams& params, const Vec3& plane, int u, int v, float& d_px) {
  const auto difference = [&](int d) {
    int sum = 0;
    for (int y = v - 4; y < v + 4; ++y) {
      for (int x = u - 4; x < u + 4; ++x)
        sum += std::abs(left_pixels[y * kWidth + x] - right_pixels[y * kWidth + x - d]);
    }
    return sum;
  };
  int texture = 0;
  for (int y = v - 4; y < v + 4; ++y) {
    for (int x = u - 4; x < u + 3; ++x)
      texture += std::abs(left_pixels[y * kWidth + x + 1] - left_pixels[y * kWidth + x]);
  }
  const double d_plane = plane[0] * u + plane[1] * v + plane[2];
  const double least = std::max<double>(d_plane * (1.0 - params.below) - 2.0, params.min_disparity_px);
  const double most =
      std::min<double>(d_plane * (1.0 + params.above) + 2.0, std::min(u - 4, params.max_disparity_px));
  const int low = static_cast<int>(least);
  const int high = std::min(static_cast<int>(most), low + 255);
  const bool ground = d_plane + 2.0 <= std::min(u - 4, params.max_disparity_px);
  if (!ground || !(most > least) || high - low < 3 || texture < params.min_texture) return false;
  int best = low;
  for (int d = low; d <= high; ++d) best = difference(d) < difference(best) ? d : best;
  if (best == low || best == high) return false;
  for (int d = low; d <= high; ++d) {
    if (std::abs(d - best) > 2 && difference(best) >= params.uniqueness * difference(d)) return false;
  }
  const auto least_sum = static_cast<float>(difference(best));
  const auto before = static_cast<float>(difference(best - 1));
  const auto after = static_cast<float>(difference(best + 1));
  const float steeper = std::max(before, after) - least_sum;
  d_px = static_cast<float>(best) + (steeper > 0.0F ? 0.5F * (before - after) / steeper : 0.0F);
  return true;
}

/// Returns how many probes there are.
std::size_t expect_brute_force(const StereoProbeParams& params, const Vec3& plane) {
  run(params, plane);
  std::size_t next = 0;
  for (int v = 4; v + 4 <= kHeight; v += StereoProbeJob::kSpacing) {
    for (int u = 4; u + 4 <= kWidth; u += StereoProbeJob::kSpacing) {
      float d_px = 0.0F;
      if (!brute_force(params, plane, u, v, d_px)) continue;
      assert_true(next < job.result().size());
      const StereoProbe& probe = job.result()[next++];
      assert_int_equal(probe.u, u);
      assert_int_equal(probe.v, v);
      assert_true(probe.d_px == d_px);
    }
  }
  assert_int_equal(next, job.result().size());
  return next;
}

void test_dismissals_change_nothing(void**) {
  for (const double uniqueness : {0.85, 1.0, 0.5, 0.3, 1.4, 0.0, static_cast<double>(NAN)}) {
    StereoProbeParams params;
    params.uniqueness = uniqueness;
    fill_scene(4.0, true);
    const std::size_t found = expect_brute_force(params, kPlane);
    assert_true(uniqueness == 0.0 ? found == 0 : found > 200);
    fill_scene(25.0, true);  // hardly any likeness
    expect_brute_force(params, kPlane);
  }
  // The largest differences that there are, and ties: black and white, at random and in stripes.
  Random random(11);
  StereoProbeParams params;
  for (const int period : {1, 5, 9}) {
    for (int i = 0; i < kWidth * kHeight; ++i) {
      left_pixels[i] = (random.next() >> 20U) % 2 != 0 ? 255 : 0;
      right_pixels[i] = period == 1 ? static_cast<std::uint8_t>(255 - left_pixels[i])
                                    : static_cast<std::uint8_t>(i % kWidth / period % 2 * 255);
    }
    for (params.uniqueness = 0.7; params.uniqueness < 1.1; params.uniqueness += 0.15)
      expect_brute_force(params, Vec3(0.1, 0.0, 20.0));
  }
  params.min_texture = 0;  // flat: all the same
  std::memset(left_pixels, 255, sizeof left_pixels);
  std::memset(right_pixels, 0, sizeof right_pixels);
  expect_brute_force(params, kPlane);
}

void test_bad_input(void**) {
  fill_scene(0.0, false);
  static StereoProbeJob fresh;
  assert_status(fresh.status(), ProbeStatus::kIdle);
  assert_true(test::run_whole(fresh));
  const ImageU8 bad[] = {{},
                         {nullptr, kWidth, kHeight, kWidth},
                         {left_pixels, kWidth - 2, kHeight, kWidth},
                         {left_pixels, kWidth, kHeight - 2, kWidth},
                         {left_pixels, kWidth, kHeight, kWidth - 1}};
  for (const ImageU8& image : bad) {
    assert_status(job.start({}, image, kRight, kPlane), ProbeStatus::kBadInput);
    assert_status(job.start({}, kLeft, image, kPlane), ProbeStatus::kBadInput);
    assert_true(test::run_whole(job));
    assert_status(job.status(), ProbeStatus::kBadInput);
    assert_int_equal(job.result().size(), 0);
  }
  const ImageU8 small = {left_pixels, 63, 64, kWidth};
  assert_status(job.start({}, small, small, kPlane), ProbeStatus::kBadInput);
  const ImageU8 large = {left_pixels, cfg::kImageWidth + 2, 64, cfg::kImageWidth + 2};
  assert_status(job.start({}, large, large, kPlane), ProbeStatus::kBadInput);
  for (const double v : {static_cast<double>(NAN), std::numeric_limits<double>::infinity(), 1e200}) {
    for (int k = 0; k < 3; ++k) {
      Vec3 plane = kPlane;
      plane[k] = v;
      assert_status(job.start({}, kLeft, kRight, plane), ProbeStatus::kBadInput);
    }
  }
  StereoProbeParams params;
  const auto refused = [&] {
    const bool no = job.start(params, kLeft, kRight, kPlane) == ProbeStatus::kBadInput;
    params = {};
    return no;
  };
  params.min_disparity_px = 0;
  assert_true(refused());
  params.max_disparity_px = params.min_disparity_px;
  assert_true(refused());
  params.max_disparity_px = cfg::kImageWidth;
  assert_true(refused());
  params.below = -0.1;
  assert_true(refused());
  params.above = NAN;
  assert_true(refused());
  assert_false(refused());
}

void test_slices_give_the_same_probes(void**) {
  fill_scene(2.0, true);
  run();
  assert_status(sliced.start({}, kLeft, kRight, kPlane), ProbeStatus::kRunning);
  assert_true(test::run_in_slices(sliced) > 12);
  assert_int_equal(sliced.result().size(), job.result().size());
  assert_memory_equal(sliced.result().data(), job.result().data(), job.result().size() * sizeof(StereoProbe));
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_plan),
      cmocka_unit_test(test_ground_beyond_the_left_rim),
      cmocka_unit_test(test_plane_and_box),
      cmocka_unit_test(test_right_image_lower),
      cmocka_unit_test(test_attends_to_boxes),
      cmocka_unit_test(test_position_is_the_windows_centre),
      cmocka_unit_test(test_order_and_grid),
      cmocka_unit_test(test_no_texture_no_probe),
      cmocka_unit_test(test_repeated_texture_is_left_out),
      cmocka_unit_test(test_minimum_at_the_end_of_the_range_is_left_out),
      cmocka_unit_test(test_disparity_limits),
      cmocka_unit_test(test_dismissals_change_nothing),
      cmocka_unit_test(test_bad_input),
      cmocka_unit_test(test_slices_give_the_same_probes),
  };
  return cmocka_run_group_tests_name("stereo_probe", tests, nullptr, nullptr);
}
