// Point-set trials of the search and its verdict: per cent right, declined and false, by density and start,
// on wrong sites, on lattices, rows and clusters, in tracking; predicted against observed false rates;
// coverage of the covariance; lost in a whole map; drives. Plain ICP and a plain RANSAC beside it.
//
//   bench_fix [--trials N] [--seed S] [--threads T] [--sigma-pair M] [--only K] [--svg FILE] [suite ...]
//
// Right: accepted, within 3 sigma (sigma: root of the trace of the position's covariance) and 0.5 m. False:
// accepted, more than 3 sigma and 0.3 m off. The pivot (the rover) is what is judged.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "bench/drives.hpp"
#include "bench/lost_rover.hpp"
#include "bench/point_sets.hpp"
#include "localizer/carried_hypothesis.hpp"
#include "mission_cfg.hpp"
#include "registration/evidence_sum.hpp"
#include "registration/icp.hpp"
#include "registration/pose_search.hpp"

using namespace cairn;
using namespace cairn::bench;

namespace {

int trials = 200;
std::uint64_t seed = 20001;  // of evaluation; tuning used those below 10000
int threads = 2;
int only = 0;                // of lost and drives: the row or kind of that number, alone
std::string svg;             // of calibration: file for its plot
double sigma_pair_m = 0.05;  // as the verdict takes it; the ground's own is View::noise_m

struct Outcome {
  bool accepted = false;
  double error_m = 0.0;
  double sigma_m = 0.0;
  double nees2 = 0.0;  // squared distance in sigmas, of x and y
  double log_ratio = 0.0;
  double bound_m = 0.0;  // Cramer-Rao of the true pairs and the prior: root of the trace of x and y
  VerdictStatus status = VerdictStatus::kNone;
  SearchStatus search = SearchStatus::kIdle;
  std::uint64_t ops = 0;
  double chance = 0.0;
  double second = 0.0;
};

struct Cell {
  GroundKind ground;
  View view;
  Start start;
  Site site = Site::kRight;
  bool confirmed = false;
  int fewest = 0;  // local boulders at random between these, where given
  int most = 0;
  bool any_share = false;                               // of true boulders: drawn as the verdict has it
  double scale_sigma = PoseSearchParams().scale_sigma;  // looked for where it is too little: as MapFix does
  double map_scale = 1.0;
  double pair_m = 0.0;  // as the verdict takes it; 0: sigma_pair_m
};

using Method = std::function<void(const Cell&, const Trial&, Outcome&)>;

struct Engines {
  PoseSearchJob search;
  IcpJob icp;
  Trial trial;
};

bool right(const Outcome& o) { return o.accepted && o.error_m <= 3.0 * o.sigma_m && o.error_m <= 0.5; }
bool wrong(const Outcome& o) { return o.accepted && o.error_m > 3.0 * o.sigma_m && o.error_m > 0.3; }

/// The least that any estimator's error can be which knows the true pairs: root of the trace of x and y of
/// (P^-1 + sum H' H / noise^2)^-1, H = [1, 0, -ry; 0, 1, rx] of a boulder at r from the pivot, in map.
double cramer_rao_m(const Trial& t, double noise_m) {
  Mat3 information = t.covariance.inverse();
  for (const LocalBoulder& b : t.local) {
    if (static_cast<int>(b.id) >= t.truths) continue;
    const Vec2 r = t.T_map_site * b.p_site_m - t.T_map_site * t.pivot_site_m;
    Eigen::Matrix<double, 2, 3> H;
    H << 1.0, 0.0, -r.y(), 0.0, 1.0, r.x();
    information += H.transpose() * H / (noise_m * noise_m);
  }
  return std::sqrt(information.inverse().topLeftCorner<2, 2>().trace());
}

void search_once(Engines& e, const Cell& cell, double scale_sigma, Outcome& o) {
  PoseSearchParams p;
  p.evidence.sigma_pair_m = cell.pair_m > 0.0 ? cell.pair_m : sigma_pair_m;
  p.evidence.scale_sigma = scale_sigma;
  p.scale_sigma = cell.scale_sigma;
  if (cell.view.size_noise > 0.0) p.evidence.size_sigma = 1.2 * cell.view.size_noise;
  if (cell.confirmed) p.verdict.prior_log_odds = std::log(1.0e3);
  const Trial& t = e.trial;
  o.search = e.search.start(p, t.map, t.window_m, t.local, t.T_map_site_prior, t.pivot_site_m, t.covariance);
  WorkBudget all = WorkBudget::unlimited();
  if (o.search == SearchStatus::kRunning) (void)e.search.step(all);
  o.ops += all.spent();
  o.search = e.search.status();
  const SearchResult& r = e.search.result();
  o.status = r.verdict.status;
  o.accepted = o.status == VerdictStatus::kAccepted;
  o.log_ratio = r.verdict.log_ratio;
  o.chance = r.verdict.chance_log;
  o.second = r.verdict.second_log_ratio;
  const Vec2 off = r.T_map_site * t.pivot_site_m - t.T_map_site * t.pivot_site_m;
  o.error_m = off.norm();
  const Mat2 c = r.covariance.topLeftCorner<2, 2>();
  o.sigma_m = std::sqrt(c.trace());
  if (c.determinant() > 0.0) o.nees2 = off.dot(Vec2(c.inverse() * off));
  o.bound_m = cramer_rao_m(t, cell.view.noise_m);
}

void search(Engines& e, const Cell& cell, Outcome& o) {
  search_once(e, cell, 0.0, o);
  if (o.status != VerdictStatus::kTooLittleEvidence || cell.scale_sigma == 0.0) return;
  Outcome again;
  search_once(e, cell, cell.scale_sigma, again);
  again.ops += o.ops;
  o.ops = again.ops;
  if (again.accepted) o = again;
}

/// Whether one of `counted` lies as near as the flight module takes for the same boulder.
bool has_counted(const LocalMap& counted, const LocalBoulder& b) {
  return std::any_of(counted.begin(), counted.end(), [&](const LocalBoulder& other) {
    return (other.p_site_m - b.p_site_m).norm() <= CarriedHypothesis::kSameBoulder_m;
  });
}

/// Three windows of a third of the boulders each, the pose carried from one to the next with odometry's
/// noise; later ones without the boulders that count as seen (localizer/carried_hypothesis.hpp).
void in_windows(Engines& e, const Cell& cell, Outcome& o) {
  Trial& t = e.trial;
  const LocalMap all = t.local;
  Pose2 pose = t.T_map_site_prior;
  Mat3 covariance = t.covariance;
  EvidenceSum sum;
  PoseSearchParams p;
  p.evidence.sigma_pair_m = sigma_pair_m;
  constexpr std::size_t kWindows = 3;
  static thread_local LocalMap counted;
  counted.clear();
  for (std::size_t w = 0; w < kWindows; ++w) {
    t.local.clear();
    for (std::size_t i = w; i < all.size(); i += kWindows) {
      if (!has_counted(counted, all[i])) (void)t.local.push_back(all[i]);
    }
    for (const LocalBoulder& b : t.local) (void)counted.push_back(b);
    if (w > 0 && t.local.empty()) break;
    o.search = e.search.start(p, t.map, t.window_m, t.local, pose, t.pivot_site_m, covariance);
    WorkBudget budget = WorkBudget::unlimited();
    if (o.search == SearchStatus::kRunning) (void)e.search.step(budget);
    o.ops += budget.spent();
    if (e.search.status() != SearchStatus::kDone) return;
    const SearchResult& r = e.search.result();
    sum.add(r.verdict);
    if (r.verdict.status != VerdictStatus::kNoHypothesis) {
      pose = r.T_map_site;
      covariance = r.covariance;
    }
    covariance += Vec3(4e-4, 4e-4, 1.6e-5).asDiagonal();  // 2 cm and 4 mrad of odometry
    o.status = sum.verdict(p.verdict);
    if (o.status == VerdictStatus::kAccepted) break;  // one may look after each
  }
  o.accepted = o.status == VerdictStatus::kAccepted;
  o.log_ratio = sum.log_ratio();
  o.error_m = (pose * t.pivot_site_m - t.T_map_site * t.pivot_site_m).norm();
  o.sigma_m = std::sqrt(covariance.topLeftCorner<2, 2>().trace());
  (void)cell;
}

/// The paper's: from the start, accepted where it converges.
void plain_icp(Engines& e, const Cell&, Outcome& o) {
  IcpParams p;
  const Trial& t = e.trial;
  (void)e.icp.start(p, t.map, t.local, t.T_map_site_prior, t.pivot_site_m);
  WorkBudget all = WorkBudget::unlimited();
  (void)e.icp.step(all);
  o.accepted = e.icp.status() == IcpStatus::kConverged;
  const Vec2 off = e.icp.result().T_map_site * t.pivot_site_m - t.T_map_site * t.pivot_site_m;
  o.error_m = off.norm();
  o.sigma_m = std::sqrt(e.icp.result().covariance.topLeftCorner<2, 2>().trace());
}

/// Plain: pairs at random within the gate of what sigma allows, most inliers within 3 sigma wins, accepted
/// with four inliers and half of the boulders.
void ransac(Engines& e, const Cell& cell, Outcome& o) {
  const Trial& t = e.trial;
  Rng rng(12345);
  const double s = 0.05;
  const double reach = 4.0 * cell.start.sigma_xy_m + 0.3;
  std::size_t best = 0;
  Pose2 pose = t.T_map_site_prior;
  const std::size_t n = t.local.size();
  if (n >= 2 && t.map.size() >= 2) {
    for (int k = 0; k < 2000; ++k) {
      const std::size_t i = rng() % n;
      const std::size_t j = rng() % n;
      const std::size_t a = rng() % t.map.size();
      const Vec2 pi = t.T_map_site_prior * t.local[i].p_site_m;
      const Vec2 pj = t.T_map_site_prior * t.local[j].p_site_m;
      if (i == j || (t.map[a].p_map_m - pi).norm() > reach) continue;
      for (const MapBoulder& b : t.map) {
        const Vec2 v = b.p_map_m - t.map[a].p_map_m;
        const Vec2 u = pj - pi;
        if (std::fabs(v.norm() - u.norm()) > 4.2 * s || u.norm() < 0.5) continue;
        const double turn = std::atan2(u.x() * v.y() - u.y() * v.x(), u.dot(v));
        if (std::fabs(turn) > 4.0 * cell.start.sigma_yaw_rad + 0.05) continue;
        Pose2 h{0.0, 0.0, wrap_angle(t.T_map_site_prior.yaw_rad + turn)};
        const Vec2 shift = 0.5 * (b.p_map_m + t.map[a].p_map_m) -
                           h * Vec2(0.5 * (t.local[i].p_site_m + t.local[j].p_site_m));
        h.x_m = shift.x();
        h.y_m = shift.y();
        std::size_t inliers = 0;
        for (const LocalBoulder& l : t.local) {
          const Vec2 q = h * l.p_site_m;
          for (const MapBoulder& m : t.map) {
            if ((m.p_map_m - q).norm() <= 3.0 * s) {
              ++inliers;
              break;
            }
          }
        }
        if (inliers > best) {
          best = inliers;
          pose = h;
        }
      }
    }
  }
  o.accepted = best >= 4 && 2 * best >= n;
  o.error_m = (pose * t.pivot_site_m - t.T_map_site * t.pivot_site_m).norm();
  o.sigma_m = 0.05;
}

void prepare(const Cell& cell, std::uint64_t number, Trial& trial) {
  Rng rng(seed * 1000003U + number);
  rng.discard(8);
  View view = cell.view;
  if (cell.most > 0) view.boulders = cell.fewest + static_cast<int>(rng() % (cell.most - cell.fewest + 1));
  if (cell.any_share) {
    constexpr double kShares[] = {0.25, 0.5, 0.75, 0.92};
    const double share = kShares[rng() % 4];
    int truths = 0;
    for (int i = 0; i < view.boulders; ++i) truths += uniform(rng, 0.0, 1.0) < share ? 1 : 0;
    view.clutter = 1.0 - static_cast<double>(truths) / view.boulders;
  }
  make_trial(rng, cell.ground, view, cell.start, cell.site, trial);
  if (cell.map_scale != 1.0) {
    const Vec2 about = trial.T_map_site_prior * trial.pivot_site_m;
    for (MapBoulder& b : trial.map) b.p_map_m = about + cell.map_scale * (b.p_map_m - about);
    const Vec2 pivot = about + cell.map_scale * (trial.T_map_site * trial.pivot_site_m - about);
    const Vec2 moved = pivot - trial.T_map_site * trial.pivot_site_m;
    trial.T_map_site.x_m += moved.x();
    trial.T_map_site.y_m += moved.y();
  }
}

std::uint64_t cells_run = 0;
using Runner = void (*)(Engines&, const Cell&, Outcome&);

std::vector<Outcome> run(const Cell& cell, Runner runner, int count) {
  std::vector<Outcome> out(count);
  std::atomic<int> next{0};
  const std::uint64_t base = cells_run * 10000019U;
  const auto work = [&](bool tells) {
    const auto engines = std::make_unique<Engines>();
    for (int i = next++; i < count; i = next++) {
      prepare(cell, base + i, engines->trial);
      runner(*engines, cell, out[i]);
      if (tells && isatty(2) && i % 50 == 0) std::fprintf(stderr, "\r%d of %d  ", i, count);
    }
  };
  std::vector<std::thread> crew;
  for (int k = 1; k < threads; ++k) crew.emplace_back(work, false);
  work(true);
  for (std::thread& t : crew) t.join();
  if (isatty(2)) std::fprintf(stderr, "\r                    \r");
  ++cells_run;
  return out;
}

struct Tally {
  int n = 0, right = 0, wrong = 0, accepted = 0;
  int status[8] = {};
  int no_room = 0;
  double ops = 0.0, most_ops = 0.0;
};
Tally tally(const std::vector<Outcome>& all) {
  Tally t;
  for (const Outcome& o : all) {
    ++t.n;
    t.right += right(o);
    t.wrong += wrong(o);
    t.accepted += o.accepted;
    ++t.status[static_cast<int>(o.status)];
    t.no_room += o.search == SearchStatus::kNoSearchRoom;
    t.ops += static_cast<double>(o.ops);
    t.most_ops = std::max(t.most_ops, static_cast<double>(o.ops));
  }
  return t;
}
void print(const char* what, const std::vector<Outcome>& all) {
  const Tally t = tally(all);
  std::printf("%-44s %7.2f %7.2f  %6d  %d/%d", what, 100.0 * t.right / t.n, 100.0 * (t.n - t.accepted) / t.n,
              t.wrong, t.accepted - t.right - t.wrong, t.n);
  const auto declined = [&](VerdictStatus status) { return t.status[static_cast<int>(status)]; };
  std::printf("   none %d off %d poor %d view %d ambig %d chance %d room %d   Mops %.2f max %.1f\n",
              declined(VerdictStatus::kNoHypothesis), declined(VerdictStatus::kInconsistentWithPrior),
              declined(VerdictStatus::kTooLittleEvidence), declined(VerdictStatus::kViewDisagrees),
              declined(VerdictStatus::kAmbiguous), declined(VerdictStatus::kChanceAgreement), t.no_room,
              t.ops / t.n * 1e-6, t.most_ops * 1e-6);
  std::fflush(stdout);
}
void head(const char* title) {
  std::printf("\n%s\n%-44s %7s %7s  %6s  %s\n", title, "", "right%", "decl.%", "FALSE", "other/trials");
}

std::string text(const char* format, double a, double b = 0.0, double c = 0.0) {
  char line[128];
  std::snprintf(line, sizeof line, format, a, b, c);
  return line;
}

void in_parallel(const std::function<void(std::atomic<int>&)>& work) {
  std::atomic<int> next{0};
  std::vector<std::thread> crew;
  for (int k = 1; k < threads; ++k) crew.emplace_back([&] { work(next); });
  work(next);
  for (std::thread& t : crew) t.join();
}

Cell usual(double per_m2) {
  Cell c;
  c.ground.per_m2 = per_m2;
  c.fewest = 10;
  c.most = 30;
  return c;
}

void suite_start() {
  struct Kind {
    const char* name;
    Start start;
    bool confirmed;
  };
  const Kind kinds[] = {{"start good to 0.1 m, confirmed", {0.1, 0.02}, true},
                        {"start good to 0.1 m", {0.1, 0.02}, false},
                        {"0.5 m off, sigma says so", {0.35, 0.02, 0.5, 0.5}, false},
                        {"1 to 5 m off, sigma says so", {2.0, 0.02, 1.0, 5.0}, false}};
  for (const Kind& kind : kinds) {
    head(kind.name);
    for (const double d : {0.1, 0.3, 0.5, 1.0, 2.0, 4.0}) {
      Cell c = usual(d);
      c.start = kind.start;
      c.confirmed = kind.confirmed;
      print(text("%.1f per m2", d).c_str(), run(c, search, trials));
    }
  }
}

void suite_peers() {
  for (const double sigma : {0.1, 1.5}) {
    head(text("start good to %.1f m: search, plain ICP, RANSAC", sigma).c_str());
    for (const double d : {0.1, 0.5, 1.0, 2.0, 4.0}) {
      for (const Site site : {Site::kRight, Site::kElsewhere}) {
        Cell c = usual(d);
        c.site = site;
        c.start = {sigma, 0.02};
        const std::string at =
            text("%.1f per m2", d) + (site == Site::kRight ? ", right map" : ", another place");
        print((at + ": search").c_str(), run(c, search, trials));
        print((at + ": plain ICP").c_str(), run(c, plain_icp, trials));
        print((at + ": RANSAC").c_str(), run(c, ransac, std::min(trials, 100)));
      }
    }
  }
}

void suite_wrong() {
  struct Kind {
    const char* name;
    Site site;
  };
  const Kind kinds[] = {{"another place", Site::kElsewhere},
                        {"mirrored", Site::kMirrored},
                        {"shifted by 7 m", Site::kShifted},
                        {"random clutter", Site::kClutter}};
  for (const Kind& kind : kinds) {
    head(kind.name);
    // A map shifted by 7 m and a rover 7 m off its prior are one and the same: sigma must say that
    // it is not.
    for (const double sigma : {0.1, kind.site == Site::kShifted ? 0.5 : 1.0}) {
      for (const double d : {0.05, 0.1, 0.3, 1.0, 2.0, 4.0}) {
        Cell c = usual(d);
        c.site = kind.site;
        c.start = {sigma, 0.02};
        print(text("%.2f per m2, sigma %.1f m", d, sigma).c_str(), run(c, search, trials));
      }
    }
  }
}

void structure_cells(bool right_place, bool confirmed) {
  for (const double sigma : {0.1, 1.0}) {
    for (const Pattern pattern : {Pattern::kLattice, Pattern::kRows}) {
      for (const double d : {0.25, 1.0, 4.0}) {
        for (const double jitter : {0.0, 0.02, 0.05, 0.1}) {
          Cell c = usual(d);
          c.ground.pattern = pattern;
          c.ground.jitter_m = jitter;
          c.site = right_place ? Site::kRight : Site::kElsewhere;
          c.start = {sigma, 0.02};
          c.confirmed = confirmed;
          print(text(pattern == Pattern::kLattice ? "lattice %.2f per m2, jitter %.2f, sigma %.1f"
                                                  : "rows %.2f per m2, jitter %.2f, sigma %.1f",
                     d, jitter, sigma)
                    .c_str(),
                run(c, search, trials));
        }
      }
    }
    for (const double d : {0.5, 1.0, 2.0}) {
      for (const int per : {3, 8, 12}) {
        for (const double spread : {0.1, 0.15, 0.3, 0.5}) {
          Cell c = usual(d);
          if (right_place) {
            c.most = 0;
            c.view.boulders = 29;
            c.view.truths = 20;
          }
          c.ground.pattern = Pattern::kClusters;
          c.ground.per_cluster = per;
          c.ground.spread_m = spread;
          c.site = right_place ? Site::kRight : Site::kElsewhere;
          c.start = {sigma, 0.02};
          c.confirmed = confirmed;
          print((text("clusters of %.0f, spread %.2f, sigma %.1f", per, spread, sigma) +
                 text(", %.1f per m2", d))
                    .c_str(),
                run(c, search, trials));
        }
      }
    }
  }
}
/// The hard ones among clusters, for themselves.
void suite_clusters() {
  for (const bool right_place : {false, true}) {
    head(right_place ? "tight clusters, right place, 20 true of 29" : "tight clusters of another place");
    for (const double sigma : {0.1, 1.0}) {
      for (const double d : {0.5, 1.0}) {
        for (const int per : {8, 12}) {
          for (const double spread : {0.1, 0.15}) {
            Cell c = usual(d);
            if (right_place) {
              c.most = 0;
              c.view.boulders = 29;
              c.view.truths = 20;
            }
            c.ground.pattern = Pattern::kClusters;
            c.ground.per_cluster = per;
            c.ground.spread_m = spread;
            c.site = right_place ? Site::kRight : Site::kElsewhere;
            c.start = {sigma, 0.02};
            print((text("clusters of %.0f, spread %.2f, sigma %.1f", per, spread, sigma) +
                   text(", %.1f per m2", d))
                      .c_str(),
                  run(c, search, trials));
          }
        }
      }
    }
  }
}

void suite_structure() {
  head("lattices, rows, clusters of another place");
  structure_cells(false, false);
}
void suite_confirmed_structure() {
  head("lattices, rows, clusters of another place, track wrongly confirmed (prior odds of 1000)");
  structure_cells(false, true);
}
void suite_right_structure() {
  head("lattices, rows, clusters of the right place (clusters: 20 true of 29)");
  structure_cells(true, false);
}

/// True boulders as many as a bound on paper asks for at 98 %, plus two; heading +-10 degrees where
/// E is given.
void suite_least() {
  head("as many true boulders as the bound for 98 % asks, plus two");
  struct Row {
    double per_m2;
    int least[4][3];  // sigma 0.1 m and 0.02 rad, E = 1, 5, 20 m; 30, 50, 60 % clutter
  };
  const Row rows[] = {{0.1, {{5, 6, 6}, {6, 7, 8}, {7, 7, 8}, {8, 9, 9}}},
                      {0.3, {{6, 7, 7}, {8, 9, 10}, {9, 11, 11}, {10, 11, 12}}},
                      {1.0, {{9, 10, 12}, {12, 13, 15}, {13, 16, 17}, {14, 17, 18}}},
                      {4.0, {{17, 22, 26}, {22, 28, 34}, {24, 30, 38}, {26, 32, 40}}}};
  const double clutter[] = {0.3, 0.5, 0.6};
  const double errors[] = {0.0, 1.0, 5.0, 20.0};
  for (const Row& row : rows) {
    for (int e = 0; e < 4; ++e) {
      if (row.per_m2 * errors[e] > 10.0) continue;  // more map boulders than a window holds
      for (int k = 0; k < 3; ++k) {
        Cell c;
        c.ground.per_m2 = row.per_m2;
        c.view.truths = row.least[e][k] + 2;
        c.view.boulders = static_cast<int>(std::lround(c.view.truths / (1.0 - clutter[k])));
        c.start = {0.1, 0.02};
        if (e > 0) c.start = {errors[e] / 2.5, 0.09, 0.0, errors[e], 10.0 * kRadPerDeg};
        c.start.ring_spacings = 1.5;
        print(text("%.1f per m2, E %.0f m, clutter %.1f", row.per_m2, errors[e], clutter[k]).c_str(),
              run(c, search, trials));
      }
    }
  }
}

void suite_tracking() {
  head("tracking: error up to 20 m, heading +-10 degrees, 50 % clutter");
  const double density[] = {0.01, 0.04, 0.1, 0.3, 0.4};
  const int needed[] = {6, 8, 9, 11, 12};  // EVIDENCE's table, E = 20 m, 50 % clutter
  for (int k = 0; k < 5; ++k) {
    for (const bool half : {false, true}) {
      Cell c;
      c.ground.per_m2 = density[k];
      c.view.truths = half ? (needed[k] + 2) / 2 : needed[k] + 2;
      c.view.boulders = 2 * c.view.truths;
      c.start = {7.0, 0.07, 0.0, 20.0, 10.0 * kRadPerDeg};
      c.start.ring_spacings = 1.0;
      print((text("%.2f per m2, %.0f true", density[k], c.view.truths) + (half ? " (half)" : "")).c_str(),
            run(c, search, trials));
    }
  }
}

void suite_windows() {
  head("three windows of 6 to 10 boulders, one by one, added up; on another place, added up");
  for (const double d : {0.5, 1.0, 2.0}) {
    Cell c = usual(d);
    c.fewest = 18;
    c.most = 30;
    c.start = {0.35, 0.02};
    print(text("%.1f per m2, added up", d).c_str(), run(c, in_windows, trials));
    c.site = Site::kElsewhere;
    print(text("%.1f per m2, another place", d).c_str(), run(c, in_windows, trials));
    c.site = Site::kRight;
    c.fewest = 6;
    c.most = 10;
    print(text("%.1f per m2, one window", d).c_str(), run(c, search, trials));
  }
  head("three windows of another place, added up, looked at after each");
  for (const double sigma : {0.1, 1.0}) {
    Cell c = usual(1.0);
    c.fewest = 18;
    c.most = 60;
    c.start = {sigma, 0.02};
    for (const Site site : {Site::kMirrored, Site::kClutter}) {
      for (const double d : {0.3, 1.0, 4.0}) {
        c.site = site;
        c.ground.per_m2 = d;
        print((text("%.1f per m2, sigma %.1f", d, sigma) +
               (site == Site::kMirrored ? ", mirrored" : ", random clutter"))
                  .c_str(),
              run(c, in_windows, trials));
      }
    }
    c.site = Site::kElsewhere;
    c.ground.per_m2 = 1.0;
    for (const Pattern pattern : {Pattern::kLattice, Pattern::kRows}) {
      for (const double jitter : {0.0, 0.02, 0.05, 0.1}) {
        c.ground.pattern = pattern;
        c.ground.jitter_m = jitter;
        print(text(pattern == Pattern::kLattice ? "lattice, jitter %.2f, sigma %.1f"
                                                : "rows, jitter %.2f, sigma %.1f",
                   jitter, sigma)
                  .c_str(),
              run(c, in_windows, trials));
      }
    }
    c.ground.pattern = Pattern::kClusters;
    for (const int per : {3, 8, 12}) {
      for (const double spread : {0.1, 0.15, 0.3, 0.5}) {
        c.ground.per_cluster = per;
        c.ground.spread_m = spread;
        print(text("clusters of %.0f, spread %.2f, sigma %.1f", per, spread, sigma).c_str(),
              run(c, in_windows, trials));
      }
    }
  }
}

void suite_scale() {
  head("a map too large");
  for (const double scale : {1.0, 1.02, 1.04}) {
    for (const double d : {0.3, 1.0}) {
      Cell c = usual(d);
      c.fewest = 20;
      c.start = {0.35, 0.02};
      c.map_scale = scale;
      print(text("%.2f, %.1f per m2", scale, d).c_str(), run(c, search, trials));
    }
  }
}

/// A false rate at a threshold: events seen, and what importance sampling says.
struct Rate {
  double per_m2;
  double observed;
  std::size_t events;
  double predicted;
};

/// Predicted against observed, both axes of 1e-4 to 1, the diagonal and a factor of 3 about it.
void draw_rates(const std::vector<Rate>& rates, const std::string& path) {
  std::FILE* out = std::fopen(path.c_str(), "w");
  if (out == nullptr) {
    std::fprintf(stderr, "bench_fix: %s cannot be written\n", path.c_str());
    std::exit(1);
  }
  const auto at = [](double rate) { return 60.0 + 100.0 * (std::log10(std::max(rate, 1e-4)) + 4.0); };
  const auto line = [&](double factor, const char* dash) {
    const double from = std::max(1e-4, 1e-4 / factor);
    const double to = std::min(1.0, 1.0 / factor);
    std::fprintf(out, "<line x1='%.1f' y1='%.1f' x2='%.1f' y2='%.1f' stroke='#888' stroke-dasharray='%s'/>\n",
                 at(from), 520.0 - at(from * factor), at(to), 520.0 - at(to * factor), dash);
  };
  std::fprintf(out,
               "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 640 540' font-family='sans-serif' "
               "font-size='13'>\n<rect width='640' height='540' fill='white'/>\n");
  line(1.0, "none");
  line(3.0, "4");
  line(1.0 / 3.0, "4");
  for (int e = -4; e <= 0; ++e) {
    const double p = at(std::pow(10.0, e));
    std::fprintf(out, "<text x='%.1f' y='500' text-anchor='middle'>1e%d</text>\n", p, e);
    std::fprintf(out, "<text x='48' y='%.1f' text-anchor='end'>1e%d</text>\n", 524.0 - p, e);
  }
  std::fprintf(out,
               "<text x='260' y='525' text-anchor='middle'>observed false rate</text>\n"
               "<text x='12' y='30'>predicted</text>\n");
  const char* const colours[] = {"#1b6ca8", "#d1495b", "#3c8d40", "#8a4fbe", "#c77d0a"};
  std::size_t colour = 0;
  double density = rates.empty() ? 0.0 : rates.front().per_m2;
  int row = 0;
  for (const Rate& r : rates) {
    const bool next = r.per_m2 != density;
    if (next) colour = (colour + 1) % 5;
    if (next || row == 0) {
      std::fprintf(out, "<text x='490' y='%d' fill='%s'>%.2f per m2</text>\n", 330 + 20 * row,
                   colours[colour], r.per_m2);
      ++row;
    }
    density = r.per_m2;
    std::fprintf(out, "<circle cx='%.1f' cy='%.1f' r='5' fill='%s'/>\n", at(r.observed),
                 520.0 - at(r.predicted), colours[colour]);
  }
  std::fprintf(out, "</svg>\n");
  std::fclose(out);
}

/// Where log_ratio lies above t on other ground: bounded by e^-t, observed, and predicted from the same
/// ground by importance sampling, P0(ratio > t) = E1[1 / ratio; ratio > t], with the shares of true
/// boulders as the verdict assumes them. At rates of 1e-1 to 1e-3.
void calibrate(const Cell& cell, std::vector<Rate>& rates) {
  Cell c = cell;
  c.any_share = true;
  c.scale_sigma = 0.0;
  c.site = Site::kElsewhere;
  const std::vector<Outcome> null = run(c, search, 20 * trials);
  c.site = Site::kRight;
  const std::vector<Outcome> same = run(c, search, 10 * trials);
  const auto predicted = [&same](double t) {
    double said = 0.0;
    for (const Outcome& o : same) said += o.log_ratio > t ? std::exp(-o.log_ratio) : 0.0;
    return said / static_cast<double>(same.size());
  };
  std::vector<double> ratios;
  for (const Outcome& o : null) ratios.push_back(o.log_ratio);
  std::sort(ratios.rbegin(), ratios.rend());
  const double d = c.ground.per_m2;
  for (const double rate : {0.1, 0.03, 0.01, 0.003, 0.001}) {
    const auto seen = static_cast<std::size_t>(rate * static_cast<double>(ratios.size()));
    if (seen < 10) continue;
    const double t = ratios[seen];
    const double said = predicted(t);
    std::printf("%.3f per m2  t %6.2f  bound %.4f  observed %.5f (%zu)  predicted %.5f  ratio %.2f\n", d, t,
                std::min(1.0, std::exp(-t)), rate, seen, said, said / rate);
    rates.push_back({d, rate, seen, said});
  }
  const VerdictParams v;
  std::printf("%.3f per m2  at the threshold: predicted %.2e a search\n", d,
              predicted(v.ln_threshold - v.calibration));
  std::fflush(stdout);
}

void suite_calibration() {
  std::printf(
      "\nfalse rate of log_ratio > t: bound e^-t, observed (events), predicted by importance sampling\n");
  std::vector<Rate> rates;
  for (const double d : {0.05, 0.1, 0.3, 1.0, 4.0}) {
    Cell c = usual(d);
    c.fewest = 6;
    c.most = 10;
    c.start = {0.35, 0.02};
    calibrate(c, rates);
  }
  if (!svg.empty()) draw_rates(rates, svg);
}

/// The same of landmarks on a map of 25 cm a pixel, k = 0.10, 0.15 and 0.30.
void suite_coarse_calibration() {
  std::printf("\nthe same of landmarks\n");
  std::vector<Rate> rates;
  for (const double d : {0.01, 0.021, 0.06}) {
    Cell c = usual(d);
    c.fewest = 8;
    c.most = 20;
    c.pair_m = 0.1;
    c.view.noise_m = 0.1;
    c.start = {0.5, 0.02};
    calibrate(c, rates);
  }
  if (!svg.empty()) draw_rates(rates, svg);
}

double median(std::vector<double> v) {
  if (v.empty()) return 0.0;
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

/// Half of the errors of a round Gaussian are within 0.833 of the root of its trace: by that much is the
/// bound taken smaller, that 1 is the best there is.
constexpr double kMedianOverRoot = 0.8326;

void suite_coverage() {
  std::printf(
      "\ncovariance of accepted fixes: inside the 50 %% and 95 %% ellipse, median error, over bound\n");
  for (const double d : {0.1, 0.3, 1.0, 2.0, 4.0}) {
    Cell c = usual(d);
    c.start = {0.1, 0.02};
    c.confirmed = true;
    const std::vector<Outcome> all = run(c, search, trials);
    int n = 0, half = 0, most = 0;
    std::vector<double> errors, over;
    for (const Outcome& o : all) {
      if (!o.accepted) continue;
      ++n;
      half += o.nees2 <= 1.3863;
      most += o.nees2 <= 5.9915;
      errors.push_back(o.error_m);
      over.push_back(o.error_m / (kMedianOverRoot * o.bound_m));
    }
    if (n == 0) continue;
    std::printf("%.1f per m2: %d fixes, %.1f %%, %.1f %%, median %.4f m, largest %.3f m, over bound %.2f\n",
                d, n, 100.0 * half / n, 100.0 * most / n, median(errors),
                *std::max_element(errors.begin(), errors.end()), median(over));
    std::fflush(stdout);
  }
}

/// Anywhere in the map, at any heading, on the parameters that fly: localizer/map_fix.hpp with a map as the
/// ground segment encodes it. A map serves 50 trials.
struct LostRow {
  const char* name;
  LostCase lost;
};

template <std::size_t kCount>
void lost_rows(const LostRow (&rows)[kCount]) {
  std::uint64_t number = 0;
  for (const LostRow& row : rows) {
    ++number;
    if (only > 0 && static_cast<std::uint64_t>(only) != number) continue;
    std::vector<Outcome> out(static_cast<std::size_t>(trials));
    in_parallel([&](std::atomic<int>& next) {
      const auto rover = std::make_unique<LostRover>();
      for (int i = next++; i < trials; i = next++) {
        const LostResult r = rover->look(row.lost, seed * 1000003U + number * 10000019U, i);
        Outcome& o = out[static_cast<std::size_t>(i)];
        o.accepted = r.accepted;
        o.error_m = r.error_m;
        o.sigma_m = r.sigma_m;
        o.ops = r.ops;
      }
    });
    std::vector<double> ops, errors;
    for (const Outcome& o : out) ops.push_back(static_cast<double>(o.ops) * 1e-6);
    for (const Outcome& o : out)
      if (right(o)) errors.push_back(o.error_m);
    const Tally t = tally(out);
    std::printf("%-44s %7.2f %7.2f  %6d  %d/%d   median error %.3f m   Mops median %.1f max %.1f\n", row.name,
                100.0 * t.right / t.n, 100.0 * (t.n - t.accepted) / t.n, t.wrong,
                t.accepted - t.right - t.wrong, t.n, median(errors), median(ops),
                *std::max_element(ops.begin(), ops.end()));
    std::fflush(stdout);
  }
}

void suite_lost() {
  const LostRow rows[] = {{"1 km2, 10,000: 20 true, 30 others", {1000.0, 10000, 30.0, 20, 30, 0.0}},
                          {"1 km2, 10,000: 12 true, 18 others", {1000.0, 10000, 30.0, 12, 18, 0.0}},
                          {"1 km2, 10,000: 8 true, 12 others", {1000.0, 10000, 30.0, 8, 12, 0.0}},
                          {"1 km2, 10,000: 50 of another place", {1000.0, 10000, 30.0, 0, 50, 0.0}},
                          {"77 m, 8,500: 30 true, 45 others", {77.0, 8500, 4.0, 30, 45, 0.0}},
                          {"77 m, 8,500: 20 and 30, sizes", {77.0, 8500, 4.0, 20, 30, 0.15}},
                          {"77 m, 8,500: 75 of another place", {77.0, 8500, 4.0, 0, 75, 0.0}}};
  head("lost: anywhere in the map, any heading (Mops: of the flight module)");
  lost_rows(rows);
}

/// The same of landmarks: a way of 60 m with a mast rig, on a map of 25 cm a pixel, odometry a little long
/// and bent. Boulders of 0.75 m and more by the rock-size law; of ten about seven are on the map and found.
void suite_coarse() {
  if (!cfg::kHaveLandmarks) {
    std::printf("\ncoarse: mission %s keeps no landmarks; MISSION=mast does\n", cfg::kMission.name);
    return;
  }
  const auto way = [](double side_m, int boulders, int truths, int others, double noise_m) {
    LostCase c{side_m, boulders, 30.0, truths, others, 0.0};
    c.noise_m = noise_m;
    c.half_band_m = 10.0;
    c.pixel_m = 0.25;
    c.scale = 1.005;
    c.bend_per_m = 1.0e-4;
    return c;
  };
  const LostRow rows[] = {{"1 km2, k 0.15: 15 true, 11 others", way(1000.0, 21000, 15, 11, 0.14)},
                          {"the same, pairs good to 0.20 m", way(1000.0, 21000, 15, 11, 0.20)},
                          {"1 km2, k 0.10: 8 true, 6 others", way(1000.0, 10000, 8, 6, 0.14)},
                          {"0.5 km2, k 0.30: 42 true, 30 others", way(700.0, 30000, 42, 30, 0.14)},
                          {"1 km2, k 0.15: 26 of another place", way(1000.0, 21000, 0, 26, 0.14)},
                          {"0.5 km2, k 0.30: 72 of another place", way(700.0, 30000, 0, 72, 0.14)}};
  head("coarse: lost on a map of 25 cm, landmarks of 60 m (Mops: of the flight module)");
  lost_rows(rows);
}

/// Good: ends within 0.15 m. Off: neither that nor lost at the end. Misled: metres a drive that were twice
/// three sigmas off, and confirmed; of a slip at least those before the next fix; beyond: once that; out:
/// once that, and neither confirmed nor claimed. Ellipses and median: of all poses, one a metre, that were
/// not lost. Claimed: metres that trust calls so.
void print_drives(double per_m2, const std::vector<DriveResult>& all) {
  int good = 0, lost = 0, off = 0, misled = 0, beyond = 0, out = 0, claimed = 0, confirmed = 0, half = 0,
      most = 0, poses = 0, fixes = 0;
  std::vector<double> errors;
  for (const DriveResult& r : all) {
    const DrivePose& end = r.poses.back();
    const bool within = end.error_m <= 0.15;
    good += within;
    lost += !within && end.lost;
    off += !within && !end.lost;
    fixes += r.fixes;
    for (const DrivePose& p : r.poses) {
      misled += p.confirmed && p.error_m > 6.0 * p.sigma_m;
      beyond += p.confirmed && p.error_m > 3.0 * p.sigma_m;
      out += !p.confirmed && !p.claimed && p.error_m > 3.0 * p.sigma_m;
      confirmed += p.confirmed;
      claimed += p.claimed;
      if (p.lost) continue;
      ++poses;
      half += p.nees2 <= 1.3863;
      most += p.nees2 <= 5.9915;
      errors.push_back(p.error_m);
    }
  }
  const double n = static_cast<double>(all.size());
  std::printf("%-10.1f %7.2f %7.2f %6d %9.2f %7.2f %7.2f %8.1f %8.1f %7.1f %7.1f %6d %6.1f %8.4f %8.3f\n",
              per_m2, 100.0 * good / n, 100.0 * lost / n, off, misled / n, beyond / n, out / n, confirmed / n,
              claimed / n, 100.0 * half / std::max(poses, 1), 100.0 * most / std::max(poses, 1), poses,
              fixes / n, median(errors),
              errors.empty() ? 0.0 : *std::max_element(errors.begin(), errors.end()));
  std::fflush(stdout);
}

/// Drives of 60 m: what is said at the end, and how far the fused pose lies off at each metre.
void suite_drives() {
  struct Kind {
    const char* name;
    DriveCase drive;
  };
  DriveCase sound;
  DriveCase better = sound;
  better.vo_share = 0.3;
  better.common_share = 0.0;
  DriveCase said = sound;
  said.start_error_m = 1.0;
  said.start_sigma_m = 0.7;
  DriveCase unsaid = sound;
  unsaid.start_error_m = 1.0;
  unsaid.start_sigma_m = 0.1;
  DriveCase slip = sound;
  slip.slip_m = 1.0;
  DriveCase slide = sound;
  slide.slip_m = 2.0;
  const auto started = [](double off_m, bool coarse) {
    DriveCase c;
    c.start_error_m = off_m;
    c.coarse = coarse;
    c.frames = 250;
    return c;
  };
  const Kind kinds[] = {{"errors as modelled", sound},
                        {"errors a third of these, map not aside", better},
                        {"start 1 m off, said to be good to 0.7 m", said},
                        {"start 1 m off, said to be good to 0.1 m", unsaid},
                        {"slip of 1 m half way, unnoticed", slip},
                        {"15 m, start as good as said, to 0.05 m", started(-1.0, false)},
                        {"15 m, start 0.3 m off, said to be good to 0.05 m", started(0.3, false)},
                        {"15 m, start 0.5 m off", started(0.5, false)},
                        {"15 m, start 1 m off", started(1.0, false)},
                        {"15 m, start 2 m off", started(2.0, false)},
                        {"15 m, start as good as said, coarse map", started(-1.0, true)},
                        {"15 m, start 0.3 m off, coarse map", started(0.3, true)},
                        {"15 m, start 0.5 m off, coarse map", started(0.5, true)},
                        {"15 m, start 1 m off, coarse map", started(1.0, true)},
                        {"slip of 2 m half way, unnoticed", slide}};
  int number = 0;
  for (const Kind& kind : kinds) {
    ++number;
    if (only > 0 && only != number) continue;
    std::printf("\nDrives: %s\n%-10s %7s %7s %6s %9s %7s %7s %8s %8s %7s %7s %6s %6s %8s %8s\n", kind.name,
                "per m2", "good%", "lost%", "off", "misled", "beyond", "out", "confirm.", "claimed", "in 50%",
                "in 95%", "poses", "fixes", "median", "largest");
    for (const double d : {0.3, 1.0, 2.0, 4.0}) {
      if (kind.drive.coarse && d > 0.3) continue;  // coarse maps hold few
      DriveCase c = kind.drive;
      c.per_m2 = d;
      std::vector<DriveResult> out(static_cast<std::size_t>(trials));
      in_parallel([&](std::atomic<int>& next) {
        const auto rover = std::make_unique<DrivenRover>();
        for (int i = next++; i < trials; i = next++)
          rover->drive(c,
                       seed * 1000003U + static_cast<std::uint64_t>(number * 1000 + d * 10) * 10000019U + i,
                       out[static_cast<std::size_t>(i)]);
      });
      print_drives(d, out);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  struct Suite {
    const char* name;
    void (*run)();
  };
  const Suite suites[] = {{"start", suite_start},
                          {"wrong", suite_wrong},
                          {"structure", suite_structure},
                          {"clusters", suite_clusters},
                          {"confirmed-structure", suite_confirmed_structure},
                          {"right-structure", suite_right_structure},
                          {"least", suite_least},
                          {"tracking", suite_tracking},
                          {"windows", suite_windows},
                          {"scale", suite_scale},
                          {"calibration", suite_calibration},
                          {"coarse-calibration", suite_coarse_calibration},
                          {"coverage", suite_coverage},
                          {"lost", suite_lost},
                          {"coarse", suite_coarse},
                          {"drives", suite_drives},
                          {"peers", suite_peers}};
  std::vector<std::string> chosen;
  for (int i = 1; i < argc; ++i) {
    const std::string a = argv[i];
    const bool more = i + 1 < argc;
    if (a == "--trials" && more)
      trials = std::max(1, std::atoi(argv[++i]));
    else if (a == "--seed" && more)
      seed = std::strtoull(argv[++i], nullptr, 10);
    else if (a == "--sigma-pair" && more)
      sigma_pair_m = std::atof(argv[++i]);
    else if (a == "--only" && more)
      only = std::atoi(argv[++i]);
    else if (a == "--svg" && more)
      svg = argv[++i];
    else if (a == "--threads" && more)
      threads = std::clamp(std::atoi(argv[++i]), 1, 2);
    else
      chosen.push_back(a);
  }
  for (const std::string& name : chosen) {
    if (std::none_of(std::begin(suites), std::end(suites), [&](const Suite& s) { return name == s.name; })) {
      std::fprintf(stderr, "bench_fix: no suite '%s'; there are:", name.c_str());
      for (const Suite& s : suites) std::fprintf(stderr, " %s", s.name);
      std::fprintf(stderr, "\n");
      return 2;
    }
  }
  for (const Suite& s : suites) {
    if (chosen.empty() || std::find(chosen.begin(), chosen.end(), s.name) != chosen.end()) s.run();
  }
  return 0;
}
