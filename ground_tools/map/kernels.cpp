#include "map/kernels.hpp"

#include <algorithm>
#include <numeric>

namespace cairn::ground {
namespace {

int clamp_index(int i, int size) { return std::clamp(i, 0, size - 1); }

void tell(const RowDone& done, int rows) {
  if (done) done(rows);
}

/// Sums over a window's rows, column by column; rows enter below and leave above.
struct ColumnSums {
  std::vector<std::uint32_t> grey;
  std::vector<std::uint32_t> count;

  void change(const ImageU8& image, const ImageU8& valid, int y, bool enters) {
    if (y < 0 || y >= image.height) return;
    const std::uint8_t* g = image.row(y);
    const std::uint8_t* v = valid.data != nullptr ? valid.row(y) : nullptr;
    const std::uint32_t sign = enters ? 1U : ~0U;  // minus one, modulo 2^32
    for (std::size_t x = 0; x < grey.size(); ++x) {
      if (v != nullptr && v[x] == 0) continue;
      grey[x] += sign * g[x];
      count[x] += sign;
    }
  }
};

/// The components while rows arrive: a forest over provisional components, each root holding the sums.
class ComponentForest {
 public:
  std::size_t add() {
    parent_.push_back(parent_.size());
    sums_.emplace_back();
    return parent_.size() - 1;
  }
  std::size_t root(std::size_t i) {
    while (parent_[i] != i) {
      parent_[i] = parent_[parent_[i]];  // path halving
      i = parent_[i];
    }
    return i;
  }
  /// The older root wins, so that a component keeps the place of its first pixel.
  std::size_t join(std::size_t a, std::size_t b) {
    a = root(a);
    b = root(b);
    if (a == b) return a;
    if (b < a) std::swap(a, b);
    parent_[b] = a;
    merge(sums_[a], sums_[b]);
    return a;
  }
  Component& sums(std::size_t i) { return sums_[root(i)]; }
  std::vector<Component> finish() const {
    std::vector<Component> found;
    for (std::size_t i = 0; i < parent_.size(); ++i) {
      if (parent_[i] == i) found.push_back(sums_[i]);
    }
    return found;
  }

  static void merge(Component& into, const Component& from) {
    if (from.area_px == 0) return;
    if (into.area_px == 0) {
      into = from;
      return;
    }
    into.area_px += from.area_px;
    into.sum_x += from.sum_x;
    into.sum_y += from.sum_y;
    into.sum_xx += from.sum_xx;
    into.sum_xy += from.sum_xy;
    into.sum_yy += from.sum_yy;
    into.sum_value += from.sum_value;
    into.min_x = std::min(into.min_x, from.min_x);
    into.min_y = std::min(into.min_y, from.min_y);
    into.max_x = std::max(into.max_x, from.max_x);
    into.max_y = std::max(into.max_y, from.max_y);
  }

 private:
  std::vector<std::size_t> parent_;
  std::vector<Component> sums_;
};

/// Non-zero pixels from `begin` to before `end` of one row.
struct Run {
  int begin = 0;
  int end = 0;
  std::size_t component = 0;
};

Component sums_of_run(int begin, int end, int y, const std::uint8_t* values) {
  Component c;
  c.min_x = begin;
  c.max_x = end - 1;
  c.min_y = c.max_y = y;
  const auto row = static_cast<std::uint64_t>(y);
  for (int x = begin; x < end; ++x) {
    const auto column = static_cast<std::uint64_t>(x);
    c.sum_x += column;
    c.sum_xx += column * column;
    c.sum_value += values[x];
  }
  c.area_px = static_cast<std::uint64_t>(end - begin);
  c.sum_y = row * c.area_px;
  c.sum_yy = row * row * c.area_px;
  c.sum_xy = row * c.sum_x;
  return c;
}

}  // namespace

int otsu_threshold(const Histogram& histogram) {
  double total = 0.0;
  double weighted = 0.0;
  int best = 0;
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    total += static_cast<double>(histogram[i]);
    weighted += static_cast<double>(histogram[i]) * static_cast<double>(i);
    if (histogram[i] != 0) best = static_cast<int>(i);
  }
  double best_between = 0.0;
  double dark_count = 0.0;
  double dark_sum = 0.0;
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    if (histogram[i] == 0) continue;  // splits as the bin before
    dark_count += static_cast<double>(histogram[i]);
    dark_sum += static_cast<double>(histogram[i]) * static_cast<double>(i);
    const double bright_count = total - dark_count;
    if (bright_count == 0.0) break;
    const double apart = (weighted - dark_sum) / bright_count - dark_sum / dark_count;
    const double between = (dark_count / total) * (bright_count / total) * apart * apart;
    if (between > best_between) {
      best_between = between;
      best = static_cast<int>(i);
    }
  }
  return best;
}

void difference_from_surroundings(const ImageU8& grey, const ImageU8& valid, int radius,
                                  const MutableImageU8& out, const RowDone& done) {
  const int width = grey.width;
  ColumnSums columns{std::vector<std::uint32_t>(static_cast<std::size_t>(width)),
                     std::vector<std::uint32_t>(static_cast<std::size_t>(width))};
  for (int y = 0; y < radius; ++y) columns.change(grey, valid, y, true);
  for (int y = 0; y < grey.height; ++y) {
    columns.change(grey, valid, y + radius, true);
    columns.change(grey, valid, y - radius - 1, false);
    std::int64_t sum = 0;
    std::int64_t count = 0;
    for (int x = 0; x < std::min(radius, width); ++x) {
      sum += columns.grey[static_cast<std::size_t>(x)];
      count += columns.count[static_cast<std::size_t>(x)];
    }
    const std::uint8_t* from = grey.row(y);
    const std::uint8_t* known = valid.data != nullptr ? valid.row(y) : nullptr;
    std::uint8_t* to = out.row(y);
    for (int x = 0; x < width; ++x) {
      if (x + radius < width) {
        sum += columns.grey[static_cast<std::size_t>(x + radius)];
        count += columns.count[static_cast<std::size_t>(x + radius)];
      }
      if (x - radius - 1 >= 0) {
        sum -= columns.grey[static_cast<std::size_t>(x - radius - 1)];
        count -= columns.count[static_cast<std::size_t>(x - radius - 1)];
      }
      if (count == 0 || (known != nullptr && known[x] == 0)) {
        to[x] = 128;
        continue;
      }
      const std::int64_t mean = (sum + count / 2) / count;
      to[x] = static_cast<std::uint8_t>(std::clamp<std::int64_t>(from[x] - mean + 128, 0, 255));
    }
    tell(done, y + 1);
  }
}

void median_of_mask(const ImageU8& mask, int side, const MutableImageU8& out, const RowDone& done) {
  const int radius = side / 2;
  const int half = side * side / 2;
  const int width = mask.width;
  const int height = mask.height;
  std::vector<int> columns(static_cast<std::size_t>(width));
  const auto change = [&](int y, int sign) {
    const std::uint8_t* row = mask.row(clamp_index(y, height));
    for (std::size_t x = 0; x < columns.size(); ++x) columns[x] += row[x] != 0 ? sign : 0;
  };
  for (int y = -radius - 1; y < radius; ++y) change(y, 1);
  for (int y = 0; y < height; ++y) {
    change(y + radius, 1);
    change(y - radius - 1, -1);
    int sum = 0;
    for (int x = -radius - 1; x < radius; ++x)
      sum += columns[static_cast<std::size_t>(clamp_index(x, width))];
    std::uint8_t* to = out.row(y);
    for (int x = 0; x < width; ++x) {
      sum += columns[static_cast<std::size_t>(clamp_index(x + radius, width))];
      sum -= columns[static_cast<std::size_t>(clamp_index(x - radius - 1, width))];
      to[x] = sum > half ? 255 : 0;
    }
    tell(done, y + 1);
  }
}

std::vector<Component> connected_components(const ImageU8& mask, const ImageU8& values, const RowDone& done) {
  ComponentForest forest;
  std::vector<Run> above;
  std::vector<Run> here;
  for (int y = 0; y < mask.height; ++y) {
    here.clear();
    const std::uint8_t* row = mask.row(y);
    std::size_t candidate = 0;  // first run above that may still touch
    for (int x = 0; x < mask.width; ++x) {
      if (row[x] == 0) continue;
      Run run{x, x, 0};
      while (run.end < mask.width && row[run.end] != 0) ++run.end;
      x = run.end;
      while (candidate < above.size() && above[candidate].end < run.begin) ++candidate;
      bool placed = false;
      for (std::size_t i = candidate; i < above.size() && above[i].begin <= run.end; ++i) {
        run.component =
            placed ? forest.join(run.component, above[i].component) : forest.root(above[i].component);
        placed = true;
      }
      if (!placed) run.component = forest.add();
      ComponentForest::merge(forest.sums(run.component), sums_of_run(run.begin, run.end, y, values.row(y)));
      here.push_back(run);
    }
    above.swap(here);
    tell(done, y + 1);
  }
  return forest.finish();
}

}  // namespace cairn::ground
