#include "cmap/height_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/tool_error.hpp"
#include "core/big_endian.hpp"

namespace cairn::ground {
namespace {

constexpr int kSteps = 12;  // of Landweber's iteration
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::uint32_t code_of(std::int32_t d) {
  return d > 0 ? 2U * static_cast<std::uint32_t>(d) - 1U : 2U * static_cast<std::uint32_t>(-d);
}

/// A sample's square of posts and its place in it.
struct Place {
  std::size_t post = 0;
  double weight[4] = {};  ///< of the posts at 0, 1, columns, columns + 1
};

Place place_of(const HeightSamples& samples, std::size_t index, std::uint32_t post_columns,
               std::uint32_t post_rows) {
  const std::uint32_t u = static_cast<std::uint32_t>(index % samples.columns);
  const std::uint32_t v = static_cast<std::uint32_t>(index / samples.columns);
  const std::uint32_t i = std::min(u / samples.fine, post_columns - 2U);
  const std::uint32_t j = std::min(v / samples.fine, post_rows - 2U);
  const double x = static_cast<double>(u - i * samples.fine) / samples.fine;
  const double y = static_cast<double>(v - j * samples.fine) / samples.fine;
  return {std::size_t{j} * post_columns + i, {(1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y}};
}

double surface(const Place& place, const std::vector<double>& z, std::uint32_t columns) {
  const std::size_t p = place.post;
  return place.weight[0] * z[p] + place.weight[1] * z[p + 1] + place.weight[2] * z[p + columns] +
         place.weight[3] * z[p + columns + 1];
}

/// Largest of 1, 2, 5 times a power of ten millimetres that is at most half of `sigma_m`.
std::uint32_t suitable_quantum_um(double sigma_m) {
  std::uint32_t quantum_um = 1000;
  for (const std::uint32_t um : {2000U, 5000U, 10000U, 20000U, 50000U, 100000U, 200000U, 500000U, 1000000U}) {
    if (um <= 0.5e6 * sigma_m) quantum_um = um;
  }
  return quantum_um;
}

double rms(const HeightSamples& samples, const std::vector<double>& z, std::uint32_t columns,
           std::uint32_t rows) {
  double sum = 0.0;
  std::size_t n = 0;
  for (std::size_t s = 0; s < samples.z_m.size(); ++s) {
    if (!std::isfinite(samples.z_m[s])) continue;
    const double r = samples.z_m[s] - surface(place_of(samples, s, columns, rows), z, columns);
    sum += r * r;
    ++n;
  }
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(n, 1)));
}

struct Bits {
  std::vector<std::uint8_t>& out;
  unsigned used = 0;

  void put(std::uint32_t value, unsigned count) {
    while (count-- > 0U) {
      if (used % 8U == 0U) out.push_back(0);
      out.back() = static_cast<std::uint8_t>(out.back() | (value >> count & 1U) << (7U - used % 8U));
      ++used;
    }
  }
};

}  // namespace

std::size_t HeightGrid::known() const {
  return static_cast<std::size_t>(
      std::count_if(posts.begin(), posts.end(), [](const cmap::Post& p) { return p.known(); }));
}

double HeightGrid::at(double x, double y) const {
  const double u = x / spacing;
  const double v = y / spacing;
  if (!(u >= 0.0 && v >= 0.0 && u <= columns - 1.0 && v <= rows - 1.0)) return kNan;
  const std::uint32_t i = std::min(static_cast<std::uint32_t>(u), columns - 2U);
  const std::uint32_t j = std::min(static_cast<std::uint32_t>(v), rows - 2U);
  double sum = 0.0;
  for (std::uint32_t k = 0; k < 4; ++k) {
    const cmap::Post& post = posts[std::size_t{j + k / 2U} * columns + i + k % 2U];
    if (!post.known()) return kNan;
    sum += (k % 2U == 0 ? 1.0 - (u - i) : u - i) * (k / 2U == 0 ? 1.0 - (v - j) : v - j) * post.value();
  }
  return base_m + sum * quantum_m();
}

void HeightGrid::put_head(std::vector<std::uint8_t>& head) const {
  std::uint8_t fields[cmap::kHeightBytes] = {};
  be::put_u32(fields + cmap::kHeightSpacingAt, spacing);
  be::put_u32(fields + cmap::kHeightQuantumAt, quantum_um);
  be::put_f64(fields + cmap::kHeightBaseAt, base_m);
  be::put_f32(fields + cmap::kHeightSigmaAt, static_cast<float>(sigma_m));
  be::put_f32(fields + cmap::kHeightCommonAt, static_cast<float>(common_m));
  head.insert(head.end(), std::begin(fields), std::end(fields));
}

HeightGrid fit_heights(const HeightSamples& samples, std::uint32_t spacing, double common_m,
                       const HeightGrid& like) {
  HeightGrid grid;
  grid.spacing = spacing;
  grid.columns = (samples.columns - 1U) / samples.fine + 1U;
  grid.rows = (samples.rows - 1U) / samples.fine + 1U;
  double least = kNan;
  for (const double z : samples.z_m) least = std::isfinite(z) && !(z >= least) ? z : least;
  if (!std::isfinite(least)) throw ToolError("the elevation model has no height on the mapped ground");
  grid.base_m = like.present() ? like.base_m : std::floor(least);
  if (std::fabs(grid.base_m) > cmap::kMaxHeight)
    throw ToolError("heights of {} m are beyond {:g} m; shift the elevation model", least, cmap::kMaxHeight);

  // A post is known where all that it is fitted to is.
  std::vector<double> z(std::size_t{grid.columns} * grid.rows, grid.base_m);
  std::vector<char> known(z.size(), 1);
  std::vector<double> share(z.size());
  const std::size_t corner[4] = {0, 1, grid.columns, grid.columns + std::size_t{1}};
  for (int step = 0; step < kSteps; ++step) {
    std::vector<double> pull(z.size());
    std::fill(share.begin(), share.end(), 0.0);
    for (std::size_t s = 0; s < samples.z_m.size(); ++s) {
      const Place place = place_of(samples, s, grid.columns, grid.rows);
      const double r = samples.z_m[s] - surface(place, z, grid.columns);
      for (int k = 0; k < 4; ++k) {
        if (place.weight[k] == 0.0) continue;
        const std::size_t post = place.post + corner[k];
        if (!std::isfinite(r)) known[post] = 0;
        if (!std::isfinite(r)) continue;
        pull[post] += place.weight[k] * r;
        share[post] += place.weight[k];
      }
    }
    for (std::size_t p = 0; p < z.size(); ++p) z[p] += share[p] > 0.0 ? pull[p] / share[p] : 0.0;
  }
  const double rough_m = rms(samples, z, grid.columns, grid.rows);
  grid.quantum_um = like.present() ? like.quantum_um : suitable_quantum_um(std::hypot(rough_m, common_m));
  for (std::size_t p = 0; p < z.size(); ++p) {
    const double value = std::round((z[p] - grid.base_m) / grid.quantum_m());
    if (std::fabs(value) > cmap::kMaxPostValue)
      throw ToolError("heights of {} m do not fit steps of {} m", z[p], grid.quantum_m());
    grid.posts.emplace_back(static_cast<std::int32_t>(value), known[p] != 0);
    z[p] = grid.base_m + value * grid.quantum_m();
  }
  if (grid.known() == 0) throw ToolError("the elevation model has no height on the mapped ground");
  grid.sigma_m = std::max(rms(samples, z, grid.columns, grid.rows), 1e-3);
  grid.common_m = std::max(common_m, 1e-3);
  return grid;
}

std::vector<std::uint8_t> encode_heights(const HeightGrid& grid, std::uint32_t first_x, std::uint32_t first_y,
                                         const cmap::TileShape& shape) {
  const std::uint32_t columns = posts_along(shape.width, grid.spacing);
  const std::uint32_t rows = posts_along(shape.height, grid.spacing);
  const std::uint32_t left = first_x / grid.spacing;
  const std::uint32_t low = first_y / grid.spacing;
  std::vector<std::uint32_t> codes;  // of the known
  std::vector<char> known;
  std::vector<std::int32_t> value(std::size_t{columns} * rows);
  for (std::uint32_t j = 0; j < rows; ++j) {
    for (std::uint32_t i = 0; i < columns; ++i) {
      const std::size_t at = std::size_t{j} * columns + i;
      const cmap::Post& post = grid.posts[std::size_t{low + j} * grid.columns + left + i];
      const std::int32_t west = i > 0 ? value[at - 1] : 0;
      const std::int32_t south = j > 0 ? value[at - columns] : west;
      value[at] = i == 0 ? south : west;
      known.push_back(post.known() ? 1 : 0);
      if (!post.known()) continue;
      const std::int32_t predicted = i > 0 && j > 0 ? west + south - value[at - columns - 1] : value[at];
      codes.push_back(code_of(post.value() - predicted));
      value[at] = post.value();
    }
  }
  if (codes.empty()) return {};
  const auto bits_of = [&](unsigned k) {
    std::size_t bits = 0;
    for (const std::uint32_t c : codes)
      bits += c >> k < cmap::kMaxOnes ? (c >> k) + 1U + k : cmap::kMaxOnes + cmap::kEscapeBits;
    return bits;
  };
  unsigned best = 0;
  for (unsigned k = 1; k <= cmap::kMaxRice; ++k) best = bits_of(k) < bits_of(best) ? k : best;
  const bool holes = codes.size() < known.size();
  std::vector<std::uint8_t> out = {static_cast<std::uint8_t>(best | (holes ? cmap::kHoles : 0U))};
  Bits bits{out};
  std::size_t next = 0;
  for (const char is_known : known) {
    if (holes) bits.put(is_known != 0 ? 1U : 0U, 1);
    if (is_known == 0) continue;
    const std::uint32_t code = codes[next++];
    const std::uint32_t ones = std::min(code >> best, std::uint32_t{cmap::kMaxOnes});
    for (std::uint32_t n = 0; n < ones; ++n) bits.put(1, 1);
    if (ones == cmap::kMaxOnes) {
      bits.put(code, cmap::kEscapeBits);
    } else {
      bits.put(0, 1);
      bits.put(code, best);
    }
  }
  return out;
}

HeightGrid read_heights(const OrbitalMap& map, std::uint32_t extent_x, std::uint32_t extent_y) {
  HeightGrid grid;
  const MapHeights& head = map.heights();
  if (!map.usable() || head.spacing == 0) return grid;
  grid.spacing = head.spacing;
  grid.quantum_um = static_cast<std::uint32_t>(std::lround(1e6 * head.quantum_m));
  grid.base_m = head.base_m;
  grid.sigma_m = static_cast<double>(head.sigma_m);
  grid.common_m = static_cast<double>(head.common_m);
  grid.columns = posts_along(extent_x, grid.spacing);
  grid.rows = posts_along(extent_y, grid.spacing);
  grid.posts.resize(std::size_t{grid.columns} * grid.rows);
  for (std::uint32_t t = 0; t < map.tiles(); ++t) {
    MapTile tile;
    if (!map.tile(t, tile) || !OrbitalMap::tile_holds(t, tile) || tile.height_bytes == 0) continue;
    const std::uint32_t columns = head.posts(tile.shape.width);
    const std::uint32_t rows = head.posts(tile.shape.height);
    cmap::HeightDecoder decoder;
    if (!decoder.start(columns, rows, tile.heights(), tile.height_bytes)) continue;
    std::vector<cmap::Post> row(columns);
    std::vector<cmap::Post> all;
    cmap::HeightStep step = cmap::HeightStep::kMore;
    while (step == cmap::HeightStep::kMore) {
      step = decoder.read(row.data());
      all.insert(all.end(), row.begin(), row.end());
    }
    if (step == cmap::HeightStep::kCorrupt) continue;
    for (std::uint32_t j = 0; j < rows; ++j) {
      for (std::uint32_t i = 0; i < columns; ++i) {
        const cmap::Post& post = all[std::size_t{j} * columns + i];
        if (!post.known()) continue;
        grid.posts[std::size_t{tile.first_y / grid.spacing + j} * grid.columns + tile.first_x / grid.spacing +
                   i] = post;
      }
    }
  }
  return grid;
}

HeightGrid moved(const HeightGrid& grid, std::int64_t east, std::int64_t north, std::uint32_t extent_x,
                 std::uint32_t extent_y) {
  HeightGrid out = grid;
  out.columns = posts_along(extent_x, grid.spacing);
  out.rows = posts_along(extent_y, grid.spacing);
  out.posts.assign(std::size_t{out.columns} * out.rows, {});
  for (std::uint32_t j = 0; j < out.rows; ++j) {
    for (std::uint32_t i = 0; i < out.columns; ++i) {
      const std::int64_t x = i + east / grid.spacing;
      const std::int64_t y = j + north / grid.spacing;
      if (x < 0 || y < 0 || x >= grid.columns || y >= grid.rows) continue;
      out.posts[std::size_t{j} * out.columns + i] =
          grid.posts[static_cast<std::size_t>(y) * grid.columns + static_cast<std::size_t>(x)];
    }
  }
  return out;
}

}  // namespace cairn::ground
