#include "dataset/pair_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>

#include "base/statistics.hpp"

namespace cairn::ground {
namespace {

constexpr int kHalf = 5;  // of a patch
constexpr int kSide = 2 * kHalf + 1;
constexpr int kRows = 12;      // searched up and down
constexpr int kWide_px = 800;  // images beyond are halved
constexpr double kLeastCorrelation = 0.85;
constexpr double kLeastSpread = 5.0;  // grey levels of a patch
constexpr std::size_t kLeastMatches = 12;

Image halved(ImageU8 image) {
  Image out;
  out.width = image.width / 2;
  out.height = image.height / 2;
  out.pixels.resize(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height));
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      const int sum = image.at(2 * x, 2 * y) + image.at(2 * x + 1, 2 * y) + image.at(2 * x, 2 * y + 1) +
                      image.at(2 * x + 1, 2 * y + 1);
      out.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(out.width) +
                 static_cast<std::size_t>(x)] = static_cast<std::uint8_t>((sum + 2) / 4);
    }
  }
  return out;
}

/// Sum and spread of the patch around each pixel, by summed tables.
class PatchSums {
 public:
  explicit PatchSums(ImageU8 image) : width_(image.width + 1) {
    const std::size_t size = static_cast<std::size_t>(width_) * static_cast<std::size_t>(image.height + 1);
    sum_.resize(size);
    square_.resize(size);
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        const double g = image.at(x, y);
        sum_[at(x + 1, y + 1)] = g + sum_[at(x, y + 1)] + sum_[at(x + 1, y)] - sum_[at(x, y)];
        square_[at(x + 1, y + 1)] = g * g + square_[at(x, y + 1)] + square_[at(x + 1, y)] - square_[at(x, y)];
      }
    }
  }
  double sum(int x, int y) const { return box(sum_, x, y); }
  /// Root of the sum of squared departures from the mean.
  double spread(int x, int y) const {
    const double s = sum(x, y);
    return std::sqrt(std::max(0.0, box(square_, x, y) - s * s / (kSide * kSide)));
  }

 private:
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  double box(const std::vector<double>& table, int x, int y) const {
    const int x0 = x - kHalf, y0 = y - kHalf, x1 = x + kHalf + 1, y1 = y + kHalf + 1;
    return table[at(x1, y1)] - table[at(x0, y1)] - table[at(x1, y0)] + table[at(x0, y0)];
  }
  int width_;
  std::vector<double> sum_;
  std::vector<double> square_;
};

/// Structure of the patch in its weaker direction: what can be found along a row, and across.
double texture(ImageU8 image, int x, int y) {
  double xx = 0.0, xy = 0.0, yy = 0.0;
  for (int v = y - kHalf; v <= y + kHalf; v += 2) {
    for (int u = x - kHalf; u <= x + kHalf; u += 2) {
      const double gx = image.at(u + 1, v) - image.at(u - 1, v);
      const double gy = image.at(u, v + 1) - image.at(u, v - 1);
      xx += gx * gx;
      xy += gx * gy;
      yy += gy * gy;
    }
  }
  return 0.5 * (xx + yy) - std::hypot(0.5 * (xx - yy), xy);
}

/// The patch with most texture in each cell of a grid.
std::vector<std::pair<int, int>> choose_patches(ImageU8 image, const PatchSums& sums) {
  constexpr int kColumns = 20, kLines = 15, kMargin = kHalf + 2, kStep = 3;
  std::vector<std::pair<int, int>> out;
  for (int line = 0; line < kLines; ++line) {
    for (int column = 0; column < kColumns; ++column) {
      const int x0 = std::max(kMargin, image.width * column / kColumns);
      const int x1 = std::min(image.width - kMargin, image.width * (column + 1) / kColumns);
      const int y0 = std::max(kMargin, image.height * line / kLines);
      const int y1 = std::min(image.height - kMargin, image.height * (line + 1) / kLines);
      double best = 0.0;
      std::pair<int, int> at;
      for (int y = y0; y < y1; y += kStep) {
        for (int x = x0; x < x1; x += kStep) {
          if (sums.spread(x, y) < kLeastSpread * kSide) continue;
          const double t = texture(image, x, y);
          if (t > best) {
            best = t;
            at = {x, y};
          }
        }
      }
      if (best > 0.0) out.push_back(at);
    }
  }
  return out;
}

struct Searched {
  ImageU8 left, right;
  const PatchSums& left_sums;
  const PatchSums& right_sums;

  double correlation(int x, int y, int u, int v) const {
    const double spread = left_sums.spread(x, y) * right_sums.spread(u, v);
    if (spread <= 0.0) return -1.0;
    int cross = 0;
    for (int j = -kHalf; j <= kHalf; ++j) {
      const std::uint8_t* const a = left.row(y + j) + x;
      const std::uint8_t* const b = right.row(v + j) + u;
      for (int i = -kHalf; i <= kHalf; ++i) cross += a[i] * b[i];
    }
    return (cross - left_sums.sum(x, y) * right_sums.sum(u, v) / (kSide * kSide)) / spread;
  }
};

/// Of disparities with rows; 0 where all are alike.
double nearer_below(const std::vector<PatchMatch>& matches) {
  double row = 0.0, disparity = 0.0;
  for (const PatchMatch& m : matches) row += m.left_px.y(), disparity += m.disparity_px;
  row /= static_cast<double>(matches.size()), disparity /= static_cast<double>(matches.size());
  double cross = 0.0, rows = 0.0, disparities = 0.0;
  for (const PatchMatch& m : matches) {
    const double y = m.left_px.y() - row, d = m.disparity_px - disparity;
    cross += y * d, rows += y * y, disparities += d * d;
  }
  return rows * disparities > 0.0 ? cross / std::sqrt(rows * disparities) : 0.0;
}

/// Where between three samples their parabola has its top, -0.5 to 0.5.
double top_between(double before, double at, double after) {
  const double bend = before - 2.0 * at + after;
  return bend < 0.0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0.0;
}

std::optional<PatchMatch> find_patch(const Searched& in, int x, int y) {
  const int reach = in.right.width / 4;
  const int u0 = std::max(kHalf, x - reach), u1 = std::min(in.right.width - kHalf - 1, x + reach);
  const int v0 = std::max(kHalf, y - kRows), v1 = std::min(in.right.height - kHalf - 1, y + kRows);
  const int columns = u1 - u0 + 1;
  std::vector<double> all(static_cast<std::size_t>(columns) * static_cast<std::size_t>(v1 - v0 + 1));
  const auto at = [&](int u, int v) -> double& {
    return all[static_cast<std::size_t>(v - v0) * static_cast<std::size_t>(columns) +
               static_cast<std::size_t>(u - u0)];
  };
  int bu = u0, bv = v0;
  for (int v = v0; v <= v1; ++v) {
    for (int u = u0; u <= u1; ++u) {
      at(u, v) = in.correlation(x, y, u, v);
      if (at(u, v) > at(bu, bv)) bu = u, bv = v;
    }
  }
  const double best = at(bu, bv);
  if (best < kLeastCorrelation || bu == u0 || bu == u1 || bv == v0 || bv == v1) return std::nullopt;
  double second = -1.0;
  for (int v = v0; v <= v1; ++v) {
    for (int u = u0; u <= u1; ++u) {
      if (std::abs(u - bu) > 3 || std::abs(v - bv) > 3) second = std::max(second, at(u, v));
    }
  }
  constexpr double kClearly = 0.6;
  if (1.0 - best > kClearly * (1.0 - second)) return std::nullopt;
  const double du = top_between(at(bu - 1, bv), best, at(bu + 1, bv));
  const double dv = top_between(at(bu, bv - 1), best, at(bu, bv + 1));
  return PatchMatch{Vec2(x, y), x - (bu + du), bv + dv - y};
}

using Vec4 = Eigen::Matrix<double, 4, 1>;
using Mat4 = Eigen::Matrix<double, 4, 4>;

Vec4 row_terms(const PatchMatch& m, int width, int height) {
  const double x = (m.left_px.x() - 0.5 * width) / width, y = (m.left_px.y() - 0.5 * height) / width;
  return {1.0, x, y, -x * y * m.disparity_px / width * 8.0};
}

// ---- a drive ----------------------------------------------------------------------------------------------

double mean_grey(const Image& image) {
  double sum = 0.0;
  for (const std::uint8_t g : image.pixels) sum += g;
  return sum / static_cast<double>(std::max<std::size_t>(1, image.pixels.size()));
}

/// Matches of images halved so many times, in pixels of the whole ones.
std::vector<PatchMatch> match_halved(ImageU8 left, ImageU8 right, int times) {
  if (times == 0) return match_patches(left, right);
  const Image a = halved(left), b = halved(right);
  std::vector<PatchMatch> out = match_halved(a.view(), b.view(), times - 1);
  for (PatchMatch& m : out) m = {2.0 * m.left_px, 2.0 * m.disparity_px, 2.0 * m.lower_px};
  return out;
}

std::optional<RowFit> fit_of(const Image& left, const Image& right, int halvings) {
  if (left.pixels.empty() || right.pixels.empty() || left.width != right.width || left.height != right.height)
    return std::nullopt;
  return fit_rows(match_halved(left.view(), right.view(), halvings), left.width, left.height);
}

double median_of(const std::vector<RowFit>& fits, double RowFit::*what) {
  std::vector<double> values;
  for (const RowFit& fit : fits) values.push_back(fit.*what);
  return median(values);
}

double departure(const RowFit& fit) {
  return std::fabs(fit.offset_px) + std::fabs(fit.roll_px) + std::fabs(fit.stretch_px) +
         std::fabs(fit.bend_px) + fit.rest_px;
}

/// By how many frames, up to kMostLate, the right images that agree with the left ones are later, for most
/// of these frames: -1 is the frame before. 0 where their own agree best. On flat ground rows of two frames
/// differ smoothly, and so as lenses and turns make them differ: what counts is that they do not differ
/// with the neighbour's.
int late_by(const Drive& drive, const std::vector<std::size_t>& frames, std::size_t first, std::size_t end,
            int halvings) {
  constexpr int kMostLate = 3;
  std::map<int, int> votes;
  int asked = 0;
  for (const std::size_t i : frames) {
    const PairImages pair = drive.images(i);
    const auto own = fit_of(pair.left, pair.right, halvings);
    constexpr double kAgree_px = 0.5, kMost_px = 3.0, kBetter = 0.4;
    double least = own ? kBetter * departure(*own) : kMost_px;
    int best = 0;
    bool any = false;
    for (int late = -kMostLate; late <= kMostLate; ++late) {
      const auto other = static_cast<std::ptrdiff_t>(i) + late;
      if (late == 0 || other < static_cast<std::ptrdiff_t>(first) ||
          other >= static_cast<std::ptrdiff_t>(end))
        continue;
      const auto fit = fit_of(pair.left, drive.images(static_cast<std::size_t>(other)).right, halvings);
      any = any || fit.has_value();
      if (!fit || fit->rest_px >= kAgree_px || departure(*fit) >= std::min(least, kMost_px)) continue;
      least = departure(*fit);
      best = late;
    }
    asked += any ? 1 : 0;
    ++votes[best];
  }
  for (const auto& [late, count] : votes) {
    if (late != 0 && 2 * count > asked) return late;
  }
  return 0;
}

bool has_texture(const Image& image) {
  return std::any_of(image.pixels.begin(), image.pixels.end(),
                     [&](std::uint8_t g) { return g != image.pixels[0]; });
}

/// A side that shows its picture again in the next frame, for most of these frames. No two pictures of a
/// camera are alike to the bit.
PairFault frozen(const Drive& drive, const std::vector<std::size_t>& frames, std::size_t first,
                 std::size_t end) {
  std::size_t asked = 0, left = 0, right = 0;
  for (const std::size_t i : frames) {
    if (end - first < 2) break;
    const PairImages at = drive.images(i), beside = drive.images(i + 1 < end ? i + 1 : i - 1);
    if (at.left.pixels.empty() || at.right.pixels.empty()) continue;
    ++asked;
    left += has_texture(at.left) && at.left.pixels == beside.left.pixels ? 1U : 0U;
    right += has_texture(at.right) && at.right.pixels == beside.right.pixels ? 1U : 0U;
  }
  const bool of_left = 2 * left > asked, of_right = 2 * right > asked;
  if (!of_left && !of_right) return {};
  const char* const sides = !of_right ? "left images" : !of_left ? "right images" : "left and right images";
  const char* const others = !of_right ? ", and right ones change" : !of_left ? ", and left ones change" : "";
  return {
      PairFault::Kind::kFrozen,
      fmt::format(
          "{} repeat from frame to frame, to the bit{}, and two pictures of a camera always differ by their "
          "noise: it has frozen, or its recording, or frames are given twice; give each picture once",
          sides, others)};
}

PairFault none_matches(std::size_t whole, std::size_t dark, double grey) {
  using Kind = PairFault::Kind;
  constexpr double kBright = 243.0;
  if (grey > kBright)
    return {Kind::kBright,
            fmt::format("images are overexposed (mean grey level {:.0f} of 255); expose shorter", grey)};
  if (2 * dark > whole)
    return {Kind::kDark,
            fmt::format("images are dark (mean grey level {:.0f} of 255); expose longer, or scale the "
                        "samples to their full range",
                        grey)};
  return {
      Kind::kNothingMatches,
      "left and right images show nothing in common within 48 rows and a quarter of the width; are they of "
      "the same moment, and is there texture beyond noise?"};
}

/// Of pairs that match, in images `shrunk` so many times, which see so many times less.
PairFault rows_disagree(const std::vector<RowFit>& fits, int shrunk) {
  using Kind = PairFault::Kind;
  constexpr double kMostSwapped = 0.6;
  const double kLower_px = 0.4 * shrunk, kBent_px = 0.4 * shrunk, kTurned_px = 1.0 * shrunk;
  if (median_of(fits, &RowFit::swapped) > kMostSwapped)
    return {
        Kind::kSwapped,
        "left and right images are swapped (things lie farther right in the right image), or each is mirrored or "
        "upside down; exchange the folders, or turn the images"};
  constexpr double kAbove = -0.7;  // ground gives some 0.9
  if (median_of(fits, &RowFit::nearer_below) < kAbove)
    return {
        Kind::kUpsideDown,
        "what is near lies in the upper part of the images, where the sky should be: they are mirrored top to bottom, "
        "or the cameras hang upside down; turn the images (and left and right with them, where they are turned)"};
  const double offset = median_of(fits, &RowFit::offset_px), roll = median_of(fits, &RowFit::roll_px);
  const double stretch = median_of(fits, &RowFit::stretch_px), bend = median_of(fits, &RowFit::bend_px);
  const double turned = std::max(std::fabs(roll), std::fabs(stretch));
  if (std::fabs(bend) > std::max(kBent_px, turned))
    return {
        Kind::kBent,
        fmt::format(
            "rows of left and right cross each other as raw lenses or turned cameras make them ({:.1f} px in "
            "the corners, {:.2f} px in the middle); rectify the images, or give the lens' calibration",
            bend, offset)};
  if (turned > std::max(kTurned_px, std::fabs(offset)))
    return {
        Kind::kTurned,
        fmt::format("rows of left and right do not agree: {:.1f} px of roll across the width, {:.1f} px of "
                    "stretch; rectify the images, or give the cameras' calibration",
                    roll, stretch)};
  if (std::fabs(offset) > kLower_px)
    return {Kind::kLower,
            fmt::format("right images lie {:.2f} px {} than left ones, measured at {:.0f} matches a pair; "
                        "odometry takes off up to 6 px itself; better rectify the images, or calibrate anew",
                        std::fabs(offset), offset > 0.0 ? "lower" : "higher",
                        static_cast<double>(fits.front().matches))};
  if (shrunk > 1)
    return {
        Kind::kNoisy,
        fmt::format("images are noisy: left and right match at 1/{} of their size alone; expose longer, at "
                    "a lower gain, or add several images up",
                    shrunk)};
  return {};
}

}  // namespace

std::vector<PatchMatch> match_patches(ImageU8 left, ImageU8 right) {
  if (left.width > kWide_px) return match_halved(left, right, 1);
  std::vector<PatchMatch> out;
  constexpr int kLeastSide = 4 * kSide;
  if (left.width < kLeastSide || left.height < kLeastSide) return out;
  const PatchSums left_sums(left), right_sums(right);
  const Searched searched{left, right, left_sums, right_sums};
  for (const auto& [x, y] : choose_patches(left, left_sums)) {
    if (const auto match = find_patch(searched, x, y)) out.push_back(*match);
  }
  return out;
}

std::optional<RowFit> fit_rows(const std::vector<PatchMatch>& matches, int width, int height) {
  if (matches.size() < kLeastMatches) return std::nullopt;
  RowFit fit;
  fit.matches = matches.size();
  std::vector<double> lower;
  for (const PatchMatch& m : matches) {
    lower.push_back(m.lower_px);
    fit.swapped += m.disparity_px < -1.0 ? 1.0 / static_cast<double>(matches.size()) : 0.0;
  }
  Vec4 terms(median(lower), 0.0, 0.0, 0.0);
  const auto rest = [&](const PatchMatch& m) {
    return std::fabs(m.lower_px - row_terms(m, width, height).dot(terms));
  };
  std::vector<double> rests(matches.size());
  const auto median_rest = [&] {
    std::transform(matches.begin(), matches.end(), rests.begin(), rest);
    return median(rests);
  };
  for (int round = 0; round < 5; ++round) {
    const double gate = std::max(0.05, 2.0 * median_rest());
    Mat4 A = Mat4::Identity() * 1.0e-3;  // what the matches do not tell stays at 0
    Vec4 b = Vec4::Zero();
    for (const PatchMatch& m : matches) {
      if (rest(m) > gate) continue;
      const Vec4 t = row_terms(m, width, height);
      A += t * t.transpose();
      b += t * m.lower_px;
    }
    terms = A.ldlt().solve(b);
  }
  fit.offset_px = terms[0];
  fit.roll_px = terms[1];
  fit.stretch_px = terms[2];
  std::vector<double> disparities;
  for (const PatchMatch& m : matches) disparities.push_back(std::fabs(m.disparity_px));
  const PatchMatch corner{Vec2(width, height), median(disparities), 0.0};
  fit.bend_px = row_terms(corner, width, height)[3] * terms[3];
  fit.rest_px = median_rest();
  fit.nearer_below = nearer_below(matches);
  return fit;
}

PairFault check_pairs(const Drive& drive, std::size_t first, std::size_t end) {
  using Kind = PairFault::Kind;
  constexpr std::size_t kLooks = 3;
  std::vector<std::size_t> frames;
  const std::size_t count = end - first;
  for (std::size_t k = 0; k < std::min(count, kLooks); ++k)
    frames.push_back(first + (count <= kLooks ? k : (k + 1) * count / (kLooks + 1)));
  if (PairFault fault = frozen(drive, frames, first, end); fault.kind != Kind::kNone) return fault;
  std::vector<RowFit> fits;
  std::size_t whole = 0, dark = 0, same = 0;
  double grey = 0.0;
  int halvings = 0;
  const auto matched = [&] { return 2 * fits.size() > whole; };
  for (constexpr int kMostHalvings = 2; halvings <= kMostHalvings; ++halvings) {
    fits.clear();
    whole = dark = same = 0;
    for (const std::size_t i : frames) {
      const PairImages pair = drive.images(i);
      if (pair.left.pixels.empty() || pair.right.pixels.empty()) continue;
      ++whole;
      same += has_texture(pair.left) && pair.left.pixels == pair.right.pixels ? 1U : 0U;
      const double level = std::min(mean_grey(pair.left), mean_grey(pair.right));
      grey = std::max(grey, level);
      constexpr double kDark = 12.0;
      dark += level < kDark ? 1U : 0U;
      if (const auto fit = fit_of(pair.left, pair.right, halvings)) fits.push_back(*fit);
    }
    if (whole == 0) return {};
    if (2 * same > whole)
      return {Kind::kSame, "left and right images are the same picture; give those of both cameras"};
    if (2 * dark > whole || matched()) break;
  }
  constexpr double kAgree_px = 0.35;  // pairs of one moment agree to a tenth of a pixel
  const bool match = matched();
  const PairFault fault = match ? rows_disagree(fits, 1 << halvings) : none_matches(whole, dark, grey);
  if (fault.kind == Kind::kSwapped || fault.kind == Kind::kUpsideDown) return fault;
  const bool agree = match && (fault.kind == Kind::kNone || fault.kind == Kind::kNoisy) &&
                     median_of(fits, &RowFit::rest_px) < kAgree_px * (1 << halvings);
  const int late = agree ? 0 : late_by(drive, frames, first, end, match ? halvings : 0);
  if (late == 0) return fault;
  return {
      Kind::kLate,
      fmt::format(
          "left images agree with the right ones of {}, and not with their own: the right ones are {} {}; "
          "pair them anew",
          late == -1  ? "the frame before"
          : late == 1 ? "the frame after"
                      : fmt::format("{} frames {}", std::abs(late), late < 0 ? "before" : "after"),
          late * late == 1 ? "one frame" : fmt::format("{} frames", std::abs(late)),
          late < 0 ? "early" : "late")};
}

}  // namespace cairn::ground
