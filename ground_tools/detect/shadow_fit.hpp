/// One boulder and its shadow, fitted to the pixels around a dark spot.
///
/// Model: half an ellipsoid on level ground, semi-axes `along` (towards the sun), `across` and height h, lit
/// by parallel light at elevation e. Seen from above, with a counted away from the sun and b across it, and
/// w = sqrt(1 - b^2 / across^2), each row b holds
///   lit body    a from -along w to t w,    t = along^2 / q
///   dark        a from t w to q w,         q = sqrt(along^2 + (h / tan e)^2)
///   ground      elsewhere
/// The shadow that an ellipsoid casts is an ellipse about the same centre, and its own terminator is one, too
/// (the points whose normal is square to the light). So the outline from above is fitted by itself, and
/// height follows from q. The ground's level is taken from near the spot, within some 36 samples
/// along the sun.
///
/// Criterion: what the model explains of the squared departure d = g - grey from the ground's level g,
///   J = sum over dark (d^2 - (d - c)^2) + body_weight n_lit (mean_lit - g)^2
/// where c is the depth of the shadow's core (the darkest sample near the spot), so that what is lighter than
/// half-way to it is no shadow: a dark rock is not taken for a part of its shadow. The lit body's mean is
/// free, since albedos differ from rock to rock; where it looks like the ground, weak priors on roundness and
/// height decide. Rows are sampled once, in the sun's direction, and summed along: a trial costs a few
/// look-ups per row, so that thousands of trials can be afforded.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/eigen.hpp"
#include "image/image_view.hpp"

namespace cairn::ground {

/// The largest half width across the sun that is fitted, pixels of the level.
inline constexpr double kFitMostAcross_px = 9.5;
/// And the largest radius of a hollow.
inline constexpr double kMostHollow_px = 17.0;

/// Where the ground's level is looked for, samples from the spot each way; and the largest half width fitted
/// then, since the near window must be more ground than boulder.
enum class ShadowGround : std::uint8_t {
  kWide,  ///< 36 along the sun, all rows; kFitMostAcross_px
  kNear,  ///< 12; 4.8 px
};

/// The picture of a fit, in cells of its own frame: along the sun from 1.2 half lengths before the body to
/// 1.2 beyond the shadow's tip, across it out to 2.3 half widths.
inline constexpr std::size_t kCellsAlong = 10;
inline constexpr std::size_t kCellsAcross = 4;  ///< each side
inline constexpr std::size_t kPictureCells = 2 * kCellsAlong * kCellsAcross;

/// A bowl lit from one side: a disc whose sunward part is dark (wall in its own shade, or the rim's shadow)
/// and whose far part is bright. Its criterion has both means free,
///   J = dark_mean^2 n_dark + lit_mean^2 n_lit, none where one of the two has the wrong sign,
/// and so has ShadowFit::pair, that of the boulder's two parts: the two are held against each other.
struct HollowFit {
  double du_px = 0.0;  ///< centre from the spot
  double dv_px = 0.0;
  double radius_px = 0.0;
  double explained = 0.0;  ///< J, pixels of the view times squared grey levels; 0: there is none
  double dark = 0.0;       ///< means below and above the ground, grey levels
  double lit = 0.0;
};

struct ShadowFit {
  double du_px = 0.0;  ///< centre of the outline from the spot, pixels of the view
  double dv_px = 0.0;
  double across_px = 0.0;  ///< semi-axes
  double along_px = 0.0;
  double reach_px = 0.0;  ///< q
  double ground = 0.0;    ///< grey levels
  double dark = 0.0;
  double lit = 0.0;
  double noise = 0.0;      ///< of the ground, standard deviation
  double explained = 0.0;  ///< J, pixels of the view times squared grey levels
  // What tells boulders from bands and pits, each as a share of (ground - dark):
  double beside = 0.0;   ///< darkness beside the shadow, the worse side: bands go on
  double beyond = 0.0;   ///< darkness beyond its tip
  double before = 0.0;   ///< darkness on the sun's side of the body
  double step = 0.0;     ///< brightness lost from the lit side of the terminator to its dark side
  double spread = 0.0;   ///< standard deviation in the dark
  double band = 0.0;     ///< darkness beside the shadow, the better side
  double ridge = 0.0;    ///< brightness beside the body, the worse side: crests go on
  double clutter = 0.0;  ///< root of the mean square of what is left around the two
  double absent = 0.0;   ///< share of the surroundings that the view does not have
  // What else it may be:
  double pair = 0.0;     ///< as HollowFit::explained, of lit body and shadow
  HollowFit beyond_rim;  ///< the hollow whose dark wall the shadow would be, its rim the body
  HollowFit far_wall;    ///< the hollow whose bright wall the body would be
  /// Mean darkness of the cells, as a share of (ground - dark), -3 to 2. Of each two that lie alike to the
  /// left and to the right the lesser, then the greater: a picture and its mirror image are one.
  std::array<double, kPictureCells> picture = {};
  bool found = false;
};

/// Pixels around a spot that a fit looks at, each way.
int shadow_fit_reach_px(double tan_elevation);

class ShadowFitter {
 public:
  /// `away_from_sun`: unit vector in the pixel grid.
  ShadowFitter(const Vec2& away_from_sun, double tan_elevation);

  /// Pixels beyond the view and those whose `valid` is 0 (no view: all are valid) count as ground.
  void look_at(const ImageU8& grey, const ImageU8& valid, int u, int v);

  /// Fits around the spot looked at, half widths `least_across_px` to the most of `from`. `found` is false
  /// where what fits best is wider than `most_across_px`, where many pixels are not there, and where the
  /// darkest sample near the spot is neither three of the ground's standard deviations below it nor 0.4 of
  /// its level: on patched ground the former would be more than all light there is.
  ShadowFit fit(double least_across_px, double most_across_px, ShadowGround from);

 private:
  struct Trial {
    double a, b, across, along, slope;  ///< slope: reach of the shadow on the ground over `along`
  };
  struct Sums {
    double lit_n, lit, dark_n, dark;
  };
  /// Disc about (a, b), dark as far as a + radius (arc w - shift) + tilt (row - b), w as in the file's head:
  /// a straight edge where the wall shades itself, an arc where the rim does. The tilt is for a sun that is
  /// told some degrees wrong, or a slope.
  struct Hollow {
    double a, b, radius, arc, shift, tilt;
  };
  /// Of a row: darkness, ground minus grey in 1/16 levels, and its sum before.
  struct Sample {
    double dark, before;
  };
  struct RowSums;
  struct Rows;
  struct Between;
  struct Disc;
  static constexpr int kWays = 7;  ///< to move a trial
  static constexpr std::size_t kMostRows = 2 * static_cast<std::size_t>(2.2 * kFitMostAcross_px + 2.0) + 1;

  bool begin(ShadowGround from);
  template <typename See>
  void look_along(int a, int b, int step, int count, const See& see) const;
  int samples_to(double a) const;
  const std::int16_t* row_grey(int row, int count);
  const Sample* row_samples(int row, int count);
  void make_ready(int row, int count);
  double core_depth();
  double part(int row, double from, double to);                  ///< darkness summed
  Rows rows(double b, double half_width, int every, double to);  ///< samples as far as `to`
  void see(Rows& rows, int every, double to);
  template <std::size_t kCount>
  std::array<Sums, kCount> sums(const Trial& t, const std::array<double, kCount>& a, const Rows& rows,
                                int every) const;
  template <bool kInside, std::size_t kCount>
  std::array<Sums, kCount> sums_of_rows(const Trial& t, const std::array<double, kCount>& a, const Rows& rows,
                                        int every) const;
  static double tip_of(const Trial& t);
  Sums sums(const Trial& t);
  double prior(const Trial& t) const;
  double value(const Sums& s, double prior, int every) const;  ///< what a trial explains
  double try_places(double across, Trial& best, double& most);
  void search(double least_across_px, Trial& best, double& most);
  void improve(double step, double least_across_px, Trial& best, double& most);
  static Trial moved(Trial t, int way, double by);  ///< by: share of the size
  bool allowed(const Trial& t, double least_across_px) const;
  void measure(const Trial& t, ShadowFit& fit);
  void measure_around(const Trial& t, ShadowFit& fit);
  Between between_rows(double b, double to);
  void picture(const Trial& t, ShadowFit& fit);
  void put(const Hollow& h, Disc& disc);
  Sums sums(const Hollow& h, const Disc& disc) const;
  static double value(const Sums& s);
  /// The hollow whose dark or bright wall lies from `from` to `to` on row b, about.
  HollowFit hollow(bool dark, double from, double to, double b);

  double sin_, cos_;
  double tan_elevation_;
  double most_slope_;
  int half_rows_, half_columns_;
  int cos16_, sin16_;
  ImageU8 grey_, valid_;  ///< of the spot in hand
  int u_ = 0, v_ = 0;
  bool whole_ = false;  ///< the window has all of its pixels
  double most_across_ = kFitMostAcross_px;
  double ground_ = 0.0, noise_ = 0.0, depth_ = 0.0;
  std::size_t pitch_;                 ///< of rows; they are looked at and sampled as they are asked for
  std::vector<std::int16_t> grey16_;  ///< 1/16; -1 where there is no pixel
  std::vector<Sample> samples_;
  std::vector<int> looked_;  ///< samples of the rows of the spot in hand,
  std::vector<int> ready_;   ///< and of its ground in hand
};

}  // namespace cairn::ground
