// Clustering: against an agglomeration by the definition, label merging, statuses, slicing.
#include "labeling/clustering.hpp"

#include <vector>

#include "core/random.hpp"
#include "support/cmocka.hpp"
#include "support/noise.hpp"

using namespace cairn;
using test::uniform;

namespace {

ClusteringJob job;
ClusteringJob sliced;
ClusterPoints points;

void add(double x, double y, double z, int label = 0) {
  assert_true(points.push_back({Vec3(x, y, z), static_cast<std::uint8_t>(label)}));
}

void run(double cut_m) {
  (void)job.start({cut_m}, points);
  WorkBudget all = WorkBudget::unlimited();
  assert_int_equal(static_cast<int>(job.step(all)), static_cast<int>(Progress::kDone));
  assert_status(job.status(), ClusteringStatus::kDone);
}

/// Agglomeration by its definition: cluster distances from all pairs of points, each time anew.
double cluster_distance(const std::vector<int>& a, const std::vector<int>& b) {
  double least = 1e300;
  for (const int i : a) {
    for (const int j : b) {
      const double d = (points[i].p_m - points[j].p_m).norm();
      if (d < least) least = d;
    }
  }
  return least;
}

std::vector<std::vector<int>> agglomerate(double cut_m) {
  std::vector<std::vector<int>> clusters;
  for (int i = 0; i < static_cast<int>(points.size()); ++i) clusters.push_back({i});
  for (;;) {
    double least = cut_m;
    std::size_t best_a = 0;
    std::size_t best_b = 0;
    for (std::size_t a = 0; a < clusters.size(); ++a) {
      for (std::size_t b = a + 1; b < clusters.size(); ++b) {
        const double d = cluster_distance(clusters[a], clusters[b]);
        if (d > least || (best_b != 0 && d == least)) continue;
        least = d;
        best_a = a;
        best_b = b;
      }
    }
    if (best_b == 0) return clusters;
    clusters[best_a].insert(clusters[best_a].end(), clusters[best_b].begin(), clusters[best_b].end());
    clusters.erase(clusters.begin() + static_cast<std::ptrdiff_t>(best_b));
  }
}

void assert_same_clusters(double cut_m) {
  static std::vector<std::vector<int>> oracle;  // static: a failed assertion runs no destructors
  oracle = agglomerate(cut_m);
  run(cut_m);
  assert_int_equal(job.result().clusters, oracle.size());
  for (const std::vector<int>& cluster : oracle) {
    for (const int i : cluster)
      assert_int_equal(job.result().cluster_of[i], job.result().cluster_of[cluster[0]]);
  }
}

void test_against_the_definition(void**) {
  Random random(1);
  for (int trial = 0; trial < 60; ++trial) {
    points.clear();
    const int n = 1 + static_cast<int>(random.below(60));
    const int heaps = 1 + static_cast<int>(random.below(6));
    for (int i = 0; i < n; ++i) {
      const double at = 0.5 * (i % heaps);
      add(at + uniform(random, 0.0, 0.4), uniform(random, 0.0, 0.6), uniform(random, 0.0, 0.1));
    }
    const double cut_m = uniform(random, 0.02, 0.4);
    assert_same_clusters(cut_m);
    // The same a hundred strips wide, and far on either side of zero.
    const double aside = uniform(random, -9.0e6, 9.0e6);
    for (ClusterPoint& point : points) point.p_m.x() = aside + 20.0 * point.p_m.x();
    assert_same_clusters(cut_m);
  }
}

/// On a raster all neighbours tie.
void test_ties(void**) {
  points.clear();
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 5; ++j) add(i, j, 0.0);
  }
  assert_same_clusters(1.0);
  assert_int_equal(job.result().clusters, 1);
  assert_same_clusters(0.99);
  assert_int_equal(job.result().clusters, 25);
}

void test_cut_at_its_corner(void**) {
  points.clear();
  add(0.0, 0.0, 0.0);
  add(0.25, 0.0, 0.0);
  run(0.25);
  assert_int_equal(job.result().clusters, 1);
  run(std::nextafter(0.25, 0.0));
  assert_int_equal(job.result().clusters, 2);
  points[1].p_m.x() = 0.0;
  run(0.0);
  assert_int_equal(job.result().clusters, 1);
}

void test_follows_a_chain(void**) {
  points.clear();
  for (int i = 0; i < 20; ++i) add(0.1 * i, 0.0, 0.0);
  run(0.11);
  assert_int_equal(job.result().clusters, 1);
  run(0.09);
  assert_int_equal(job.result().clusters, 20);
}

void test_full_capacity(void**) {
  Random random(4);
  points.clear();
  while (!points.full()) {
    const double at = 2.0 * static_cast<double>(points.size() % 4);
    add(at + uniform(random, 0.0, 0.5), uniform(random, 0.0, 0.5), 0.0);
  }
  run(0.2);
  assert_int_equal(job.result().clusters, 4);
  for (std::size_t i = 0; i < points.size(); ++i) assert_int_equal(job.result().cluster_of[i], i % 4);
}

void test_labels(void**) {
  const int last = static_cast<int>(cfg::kMaxLabels);
  points.clear();
  add(0.00, 0.0, 0.0, 5);
  add(0.02, 0.0, 0.0, 3);  // 3 and 5 are one boulder
  add(0.04, 0.0, 0.0, 3);
  add(0.06, 0.0, 0.0, 0);  // no label
  add(1.00, 0.0, 0.0, 7);
  add(1.02, 0.0, 0.0, 7);
  add(0.05, 0.0, 0.0, 7);  // strayed: the majority of 7 is elsewhere
  add(2.00, 0.0, 0.0, last);
  add(2.01, 0.0, 0.0, 8);
  add(0.01, 0.0, 0.0, 8);  // 8 is one to one: the first cluster
  run(0.1);
  const ClusteringResult& r = job.result();
  assert_int_equal(r.clusters, 3);
  assert_int_equal(r.merged_label[3], 3);
  assert_int_equal(r.merged_label[5], 3);
  assert_int_equal(r.merged_label[7], 7);
  assert_int_equal(r.merged_label[8], 3);
  assert_int_equal(r.merged_label[last], last);
  assert_int_equal(r.merged_label[1], 0);
  assert_int_equal(r.merged_label[0], 0);
  assert_int_equal(r.labels_merged, 2);
}

void test_statuses(void**) {
  static ClusteringJob fresh;
  assert_status(fresh.status(), ClusteringStatus::kIdle);
  WorkBudget any(10);
  assert_int_equal(static_cast<int>(fresh.step(any)), static_cast<int>(Progress::kDone));
  points.clear();
  assert_status(job.start({}, points), ClusteringStatus::kNoPoints);
  add(0.0, 0.0, 0.0);
  assert_status(job.start({}, points), ClusteringStatus::kRunning);
  for (const double cut_m : {-1e-9, 1.1e6, static_cast<double>(NAN)}) {
    assert_status(job.start({cut_m}, points), ClusteringStatus::kBadInput);
  }
  for (const double v : {static_cast<double>(NAN), static_cast<double>(INFINITY), 1.1e7}) {
    points[0].p_m.z() = v;
    assert_status(job.start({}, points), ClusteringStatus::kBadInput);
  }
  points[0].p_m.z() = 0.0;
  points[0].label = static_cast<std::uint8_t>(cfg::kMaxLabels + 1);
  assert_status(job.start({}, points), ClusteringStatus::kBadInput);
  points[0].label = static_cast<std::uint8_t>(cfg::kMaxLabels);
  assert_status(job.start({}, points), ClusteringStatus::kRunning);
}

void test_same_for_every_slicing(void**) {
  Random random(5);
  points.clear();
  for (int i = 0; i < 120; ++i) {
    add(uniform(random, 0.0, 2.0), uniform(random, 0.0, 2.0), 0.0, static_cast<int>(random.below(20)));
  }
  run(0.2);
  for (const std::uint32_t ops : {1U, 1000U, 12345U}) {
    (void)sliced.start({0.2}, points);
    int steps = 0;
    for (; steps < 100000; ++steps) {
      WorkBudget slice(ops);
      if (sliced.step(slice) == Progress::kDone) break;
    }
    if (ops == 1U) assert_at_least(steps, 120);
    if (ops == 1U) print_message("%d units for 120 points\n", steps);
    assert_int_equal(sliced.result().clusters, job.result().clusters);
    for (std::size_t i = 0; i < points.size(); ++i) {
      assert_int_equal(sliced.result().cluster_of[i], job.result().cluster_of[i]);
    }
    assert_memory_equal(sliced.result().merged_label, job.result().merged_label,
                        sizeof job.result().merged_label);
  }
}

std::uint64_t ops_of(double cut_m) {
  (void)job.start({cut_m}, points);
  WorkBudget all = WorkBudget::unlimited();
  assert_int_equal(static_cast<int>(job.step(all)), static_cast<int>(Progress::kDone));
  return all.spent();
}

/// What is reached is not looked at again, nor what lies strips away; and a label costs by its own points.
void test_cost(void**) {
  Random random(6);
  points.clear();
  while (!points.full()) add(uniform(random, 0.0, 1.0), 0.0, 0.0, static_cast<int>(random.below(20)));
  const std::uint64_t n = points.size();
  const std::uint64_t linear = 24 * n + 10 * cfg::kMaxLabels;
  assert_at_most(ops_of(2.0), linear);
  assert_at_most(ops_of(0.0), linear + 2 * n * n);
  assert_at_most(ops_of(0.02), linear + 2 * n * n / 8);  // 50 strips
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_against_the_definition),
      cmocka_unit_test(test_ties),
      cmocka_unit_test(test_cut_at_its_corner),
      cmocka_unit_test(test_follows_a_chain),
      cmocka_unit_test(test_full_capacity),
      cmocka_unit_test(test_labels),
      cmocka_unit_test(test_statuses),
      cmocka_unit_test(test_same_for_every_slicing),
      cmocka_unit_test(test_cost),
  };
  return cmocka_run_group_tests_name("labeling/clustering", tests, nullptr, nullptr);
}
