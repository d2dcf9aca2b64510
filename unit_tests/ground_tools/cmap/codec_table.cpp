// How near a .cmap comes to what its boulders must cost, beside general compressors: `make bench-codec`.
//
//   limit       log2 C(G, N) / N, G cells of the mapped ground, N boulders: any places alike
//   cmap        bits of the whole positions-only file over N, and over the limit
//   zstd, xz    the same for u32 pairs (y, x), sorted, as these programs at their best make them smaller
//   attributes  bits that size, height and confidence add to the file, over the entropy of their classes
//               as they come out of the file
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "base/output_file.hpp"
#include "cmap/cmap_file.hpp"
#include "core/random.hpp"
#include "core/trig.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

namespace fs = std::filesystem;
constexpr double kBits = 8.0;
constexpr double kQuantum_m = 0.002;

double limit_bits(double cells, double boulders) {
  return (std::lgamma(cells + 1.0) - std::lgamma(boulders + 1.0) - std::lgamma(cells - boulders + 1.0)) /
         std::log(2.0);
}

/// Bytes that a program's standard output has for this input.
double compressed_bytes(const char* command, const std::vector<std::uint8_t>& bytes) {
  const fs::path path = fs::temp_directory_path() / "codec_table.raw";
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  const std::string line = fmt::format("{} <'{}' 2>/dev/null | wc -c", command, path.string());
  FILE* pipe = popen(line.c_str(), "r");
  char text[32] = {};
  if (pipe == nullptr || std::fgets(text, sizeof text, pipe) == nullptr) std::exit(1);
  pclose(pipe);
  fs::remove(path);
  return std::atof(text);
}

std::vector<std::uint8_t> raw_pairs(const CmapContent& map) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> cells;
  for (const TableBoulder& b : map.boulders) {
    const Vec2 p = (b.p_map_m - Vec2(map.extent.min_x_m, map.extent.min_y_m)) / map.quantum_m;
    cells.emplace(static_cast<std::uint32_t>(std::lround(p.y())),
                  static_cast<std::uint32_t>(std::lround(p.x())));
  }
  std::vector<std::uint8_t> bytes;
  for (const auto& [y, x] : cells) {
    for (const std::uint32_t value : {y, x}) {
      for (unsigned shift = 0; shift < 32; shift += 8)
        bytes.push_back(static_cast<std::uint8_t>(value >> shift));
    }
  }
  return bytes;
}

void print_positions(const std::string& name, const std::vector<TableBoulder>& boulders,
                     const MapExtent& extent, double quantum_m) {
  CmapOptions options;
  options.positions_only = true;
  const std::vector<std::uint8_t> file = encode_cmap(boulders, extent, quantum_m, {}, options);
  const CmapContent map = decode_cmap(file, name);
  const auto n = static_cast<double>(map.boulders.size());
  const double cells = static_cast<double>(map.layout.extent_x) * map.layout.extent_y;
  const double limit = limit_bits(cells, n) / n;
  const double coded = kBits * static_cast<double>(file.size()) / n;
  const std::vector<std::uint8_t> raw = raw_pairs(map);
  const double zstd = kBits * compressed_bytes("zstd -19 -c", raw) / n;
  const double xz = kBits * compressed_bytes("xz -9e -c", raw) / n;
  fmt::print("{:<14} {:>7} {:>9.3g} {:>8} {:>7} {:>8.3f} {:>8.3f} {:>7.3f} {:>7.2f} {:>7.2f}\n", name,
             map.boulders.size(), cells / n, file.size(), map.tiles.size(), limit, coded, coded / limit,
             zstd / limit, xz / limit);
}

/// Bits a boulder by which knowing the density would bring the places below the limit: the mean of
/// log2(density / mean density), each boulder's density by a Gaussian kernel over the others, a twentieth of
/// it uniform. More than any coder can gain, which has to send the density or learn it as it goes.
double gain_of_density(const std::vector<TableBoulder>& boulders, const MapExtent& extent, double width_m) {
  constexpr double kUniform = 0.05;
  const double reach_m = 3.5 * width_m;
  const double area_m2 = (extent.max_x_m - extent.min_x_m) * (extent.max_y_m - extent.min_y_m);
  std::map<std::pair<long, long>, std::vector<Vec2>> cells;
  const auto cell_of = [&](double x) { return std::lround(std::floor(x / reach_m)); };
  for (const TableBoulder& b : boulders)
    cells[{cell_of(b.p_map_m.x()), cell_of(b.p_map_m.y())}].push_back(b.p_map_m);
  double bits = 0.0;
  for (const TableBoulder& b : boulders) {
    double sum = -1.0;  // itself
    for (long x = cell_of(b.p_map_m.x()) - 1; x <= cell_of(b.p_map_m.x()) + 1; ++x) {
      for (long y = cell_of(b.p_map_m.y()) - 1; y <= cell_of(b.p_map_m.y()) + 1; ++y) {
        const auto cell = cells.find({x, y});
        if (cell == cells.end()) continue;
        for (const Vec2& p : cell->second)
          sum += std::exp(-0.5 * (p - b.p_map_m).squaredNorm() / (width_m * width_m));
      }
    }
    const double density = sum / (2.0 * kPi * width_m * width_m) / static_cast<double>(boulders.size() - 1);
    bits += std::log2((1.0 - kUniform) * density * area_m2 + kUniform);
  }
  return bits / static_cast<double>(boulders.size());
}

void print_gain(const std::vector<TableBoulder>& boulders, const MapExtent& extent) {
  double best = 0.0;
  double best_m = 0.0;
  for (double width_m = 2.0; width_m < 400.0; width_m *= 1.25) {
    const double gain = gain_of_density(boulders, extent, width_m);
    if (gain > best) {
      best = gain;
      best_m = width_m;
    }
  }
  fmt::print("  a density known for nothing would gain {:.2f} bits each at most (kernel of {:.1f} m)\n", best,
             best_m);
}

double entropy_bits(const std::vector<double>& values) {
  std::map<double, double> counts;
  for (const double v : values) ++counts[v];
  double bits = 0.0;
  for (const auto& entry : counts)
    bits -= entry.second * std::log2(entry.second / static_cast<double>(values.size()));
  return bits;
}

void print_attributes(const std::string& name, const std::vector<TableBoulder>& boulders,
                      const MapExtent& extent, double quantum_m) {
  CmapOptions options;
  const std::vector<std::uint8_t> file = encode_cmap(boulders, extent, quantum_m, {}, options);
  options.positions_only = true;
  const std::vector<std::uint8_t> bare = encode_cmap(boulders, extent, quantum_m, {}, options);
  const CmapContent map = decode_cmap(file, name);
  std::vector<double> values[3];
  for (const TableBoulder& b : map.boulders) {
    values[0].push_back(b.diameter_m);
    values[1].push_back(b.height_m);
    values[2].push_back(b.confidence);
  }
  const auto n = static_cast<double>(map.boulders.size());
  const double entropy = (entropy_bits(values[0]) + entropy_bits(values[1]) + entropy_bits(values[2])) / n;
  const double coded = kBits * static_cast<double>(file.size() - bare.size()) / n;
  fmt::print("{:<22} {:>7} {:>7.3f} {:>7.3f} {:>10.3f} {:>8.3f} {:>8.3f} {:>7.3f}\n", name,
             map.boulders.size(), entropy_bits(values[0]) / n, entropy_bits(values[1]) / n,
             entropy_bits(values[2]) / n, entropy, coded, coded / entropy);
}

double uniform(Random& random) { return 1e-9 * (random.below(1000000000) + 0.5); }

/// Uniform places on a square of as many cells.
std::vector<TableBoulder> uniform_ground(int n, double cells_each, MapExtent& extent, std::uint32_t seed) {
  const double side_m = kQuantum_m * std::floor(std::sqrt(cells_each * n));
  extent = {-1000.0, 2000.0, -1000.0 + side_m, 2000.0 + side_m};
  Random random(seed);
  std::vector<TableBoulder> boulders;
  for (int i = 0; i < n; ++i) {
    TableBoulder b;
    b.p_map_m = Vec2(extent.min_x_m + side_m * uniform(random), extent.min_y_m + side_m * uniform(random));
    b.diameter_m = 0.2;
    boulders.push_back(b);
  }
  return boulders;
}

/// Sizes by a power law (as rocks have), heights about half of them where known, confidences.
void give_attributes(std::vector<TableBoulder>& boulders, double exponent, double height_known, double sure) {
  Random random(7);
  for (TableBoulder& b : boulders) {
    b.diameter_m = std::min(5.0, 0.15 * std::pow(uniform(random), -1.0 / exponent));
    const double share = 0.35 + 0.3 * uniform(random);
    b.height_m = uniform(random) < height_known ? b.diameter_m * share : 0.0;
    b.confidence = uniform(random) < sure ? 1.0 : uniform(random);
  }
}

/// The rocks that ROSCO found in a HiRISE picture: columns 6 and 7 a rock's place in pixels, 12 and 13 its
/// width and height in metres.
std::vector<TableBoulder> rosco(const fs::path& path, double pixel_m, MapExtent& extent) {
  std::ifstream file(path);
  std::string line;
  std::vector<TableBoulder> boulders;
  while (std::getline(file, line)) {
    double fields[13] = {};
    const char* next = line.c_str();
    std::size_t read = 0;
    for (; read < 13; ++read) {
      char* end = nullptr;
      fields[read] = std::strtod(next, &end);
      if (end == next) break;
      next = *end == ',' ? end + 1 : end;
    }
    if (read < 13) continue;
    TableBoulder b;
    b.p_map_m = Vec2(fields[5], -fields[6]) * pixel_m;
    b.diameter_m = std::max(0.001, fields[11]);
    b.height_m = fields[12];
    boulders.push_back(b);
  }
  extent = extent_of(boulders);
  return boulders;
}

}  // namespace

int main(int argc, char** argv) {
  MapExtent extent;
  if (argc > 2 && std::string(argv[1]) == "--map") {  // for `make bench-decode`
    std::vector<TableBoulder> boulders = uniform_ground(4000, 1e5, extent, 2);
    give_attributes(boulders, 2.0, 0.7, 0.5);
    const std::vector<std::uint8_t> file = encode_cmap(boulders, extent, kQuantum_m, {});
    write_file(argv[2], {reinterpret_cast<const char*>(file.data()), file.size()});
    return 0;
  }
  fmt::print(
      "positions      boulders      G/N    bytes   tiles    limit     cmap   ratio    zstd      xz\n"
      "                                                bit each bit each  cmap and others / limit\n");
  for (const int n : {2000, 5000, 20000, 100000}) {
    for (const double cells_each : {1e3, 1e4, 1e5, 1e6}) {
      const std::vector<TableBoulder> boulders = uniform_ground(n, cells_each, extent, 1);
      print_positions("uniform", boulders, extent, kQuantum_m);
    }
  }
  const double pixel_m = 0.273;
  const double quantum_m = suitable_quantum_m(pixel_m);
  if (argc > 1) {
    const std::vector<TableBoulder> rocks = rosco(argv[1], pixel_m, extent);
    print_positions("ROSCO", rocks, extent, quantum_m);
    print_gain(rocks, extent);
  }

  fmt::print("\nattributes             boulders    size  height confidence  entropy    coded   ratio\n");
  struct Kind {
    const char* name;
    double exponent, height_known, sure;
  };
  for (const int n : {2000, 20000}) {
    for (const Kind& kind :
         {Kind{"rocks, all known", 2.0, 1.0, 0.0}, Kind{"rocks, heights of half", 2.0, 0.5, 0.7},
          Kind{"few heights, sure", 3.0, 0.05, 0.95}, Kind{"small, nearly all sure", 8.0, 0.02, 0.99},
          Kind{"sizes alone", 2.0, 0.0, 1.0}, Kind{"wide sizes", 0.7, 0.8, 0.2}}) {
      std::vector<TableBoulder> boulders = uniform_ground(n, 1e5, extent, 2);
      give_attributes(boulders, kind.exponent, kind.height_known, kind.sure);
      print_attributes(kind.name, boulders, extent, kQuantum_m);
    }
  }
  if (argc > 1) print_attributes("ROSCO", rosco(argv[1], pixel_m, extent), extent, quantum_m);
  return 0;
}
