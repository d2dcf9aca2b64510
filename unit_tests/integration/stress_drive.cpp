// A drive made to be hard, for profiles: what real ground hardly has, and what asks most of VO and boulders.
// Noise of 3 to 30 grey levels, steps eight times as long, and random texture and discs of all sizes on level
// ground. Each kind's first pair is unlike the one before it: the scene jumps.
//
// The data set at FOLDER lends its pictures, its rig and its truth, which is not this drive's; its rocks lie
// 100 m aside. OUT gets left, right (PGM) and those files.
//
// usage: stress_drive FOLDER OUT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/random.hpp"
#include "dataset/dataset.hpp"
#include "dataset/image.hpp"
#include "support/noise.hpp"

using namespace cairn;
namespace fs = std::filesystem;

namespace {

using Plane = std::vector<double>;

constexpr std::size_t kNoisyPairs = 10;
constexpr std::size_t kLongStep = 8;
constexpr int kMadePairs = 8;
constexpr double kAway_m = 100.0;
constexpr double kGrey = 128.0;
constexpr double kContrast = 45.0;    // of texture
constexpr double kFarthest_px = 8.0;  // disparity of the uppermost row ...
constexpr double kNearest_px = 48.0;  // ... and of the lowest

struct Size {
  int width;
  int height;
};

class Drive {
 public:
  explicit Drive(const fs::path& folder) : folder_(folder) {
    for (const char* side : {"left", "right"}) fs::create_directories(folder_ / side);
  }

  void add(const ground::Image& left, const ground::Image& right) {
    write(left, "left");
    write(right, "right");
    ++pairs_;
  }
  int pairs() const { return pairs_; }

 private:
  void write(const ground::Image& image, const char* side) const {
    const fs::path path = folder_ / side / fmt::format("{:06}.pgm", pairs_);
    std::FILE* file = std::fopen(path.c_str(), "wb");
    if (file == nullptr) throw std::runtime_error(path.string() + ": cannot be written");
    fmt::print(file, "P5\n{} {}\n255\n", image.width, image.height);
    const bool whole = std::fwrite(image.pixels.data(), 1, image.pixels.size(), file) == image.pixels.size();
    if (std::fclose(file) != 0 || !whole) throw std::runtime_error(path.string() + ": cannot be written");
  }

  fs::path folder_;
  int pairs_ = 0;
};

std::uint8_t byte(double grey) { return static_cast<std::uint8_t>(std::clamp(std::lround(grey), 0L, 255L)); }

ground::Image noisy(ground::Image image, double noise, Random& random) {
  for (std::uint8_t& p : image.pixels) p = byte(p + noise * test::normal(random));
  return image;
}

/// Blurred along rows of `width`, then along columns by turning the plane.
Plane blurred_rows(const Plane& in, int width, int height, double sigma_px) {
  const int reach = static_cast<int>(std::ceil(4.0 * sigma_px));
  Plane out(in.size());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0.0;
      for (int k = -reach; k <= reach; ++k) {
        const int at = (x + k + width) % width;
        sum += std::exp(-0.5 * k * k / (sigma_px * sigma_px)) * in[static_cast<std::size_t>(y * width + at)];
      }
      out[static_cast<std::size_t>(x * height + y)] = sum;  // turned
    }
  }
  return out;
}

/// Random texture whose grains are `sigma_px` wide.
Plane texture(Size size, double sigma_px, Random& random) {
  Plane plane(static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height));
  for (double& grey : plane) grey = test::normal(random);
  plane =
      blurred_rows(blurred_rows(plane, size.width, size.height, sigma_px), size.height, size.width, sigma_px);
  double square = 0.0;
  for (const double grey : plane) square += grey * grey;
  const double scale = kContrast / std::sqrt(square / static_cast<double>(plane.size()));
  for (double& grey : plane) grey = kGrey + scale * grey;
  return plane;
}

/// Discs of all greys upon each other.
Plane discs(Size size, int largest_px, Random& random) {
  Plane plane(static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height), 140.0);
  const int count = largest_px < 5 ? 4000 : 1200;
  for (int i = 0; i < count; ++i) {
    const int radius = 1 + static_cast<int>(random.below(static_cast<std::uint32_t>(largest_px - 1)));
    const int x0 = static_cast<int>(random.below(static_cast<std::uint32_t>(size.width)));
    const int y0 = static_cast<int>(random.below(static_cast<std::uint32_t>(size.height)));
    const double grey = 20.0 + random.below(220);
    for (int y = std::max(0, y0 - radius); y <= std::min(size.height - 1, y0 + radius); ++y) {
      for (int x = std::max(0, x0 - radius); x <= std::min(size.width - 1, x0 + radius); ++x) {
        if ((x - x0) * (x - x0) + (y - y0) * (y - y0) <= radius * radius)
          plane[static_cast<std::size_t>(y * size.width + x)] = grey;
      }
    }
  }
  return plane;
}

/// Of the ground that `plane` shows, moved down by rows: level, so that disparities grow with the row.
ground::Image seen(const Plane& plane, Size ground, Size image, int moved_px, bool right) {
  ground::Image out{image.width, image.height, {}};
  out.pixels.reserve(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  const int margin = (ground.width - image.width) / 3;
  for (int v = 0; v < image.height; ++v) {
    const int row = ((v - moved_px) % ground.height + ground.height) % ground.height;
    const double d = kFarthest_px + (kNearest_px - kFarthest_px) * v / image.height;
    const int from = margin + (right ? static_cast<int>(d) : 0);
    for (int u = 0; u < image.width; ++u)
      out.pixels.push_back(byte(plane[static_cast<std::size_t>(row * ground.width + from + u)]));
  }
  return out;
}

void make(const ground::Dataset& data, Drive& drive) {
  Random random(77);
  const auto pair_at = [&data](std::size_t i) {
    const ground::Frame& frame = data.frames()[i];
    return std::pair(ground::load_grey(frame.left), ground::load_grey(frame.right));
  };
  const auto add_noisy = [&](std::size_t first, std::size_t step, std::size_t pairs, double noise) {
    for (std::size_t k = 0; k < pairs && first + k * step < data.frames().size(); ++k) {
      const auto [left, right] = pair_at(first + k * step);
      drive.add(noisy(left, noise, random), noisy(right, noise, random));
    }
  };
  for (const double noise : {10.0, 14.0, 20.0, 3.0, 30.0, 6.0}) add_noisy(0, 1, kNoisyPairs, noise);
  for (const double noise : {0.0, 10.0}) add_noisy(0, kLongStep, SIZE_MAX, noise);
  const auto first = pair_at(0).first;
  const Size image = {first.width, first.height};
  const Size ground = {image.width + 3 * (static_cast<int>(kNearest_px) + 16), image.height};
  const auto add_ground = [&](const Plane& plane) {
    for (int k = 0; k < kMadePairs; ++k)
      drive.add(seen(plane, ground, image, 4 * k, false), seen(plane, ground, image, 4 * k, true));
  };
  for (const double sigma_px : {0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0})
    add_ground(texture(ground, sigma_px, random));
  for (const int largest_px : {3, 6, 10, 16}) add_ground(discs(ground, largest_px, random));
  const ground::Image grey = {image.width, image.height, std::vector<std::uint8_t>(first.pixels.size(), 128)};
  for (int k = 0; k < kMadePairs; ++k) drive.add(noisy(grey, 80.0, random), noisy(grey, 80.0, random));
}

/// Out of reach: nothing of this ground is in a map, and no search among rocks is what is asked here.
void write_rocks(const fs::path& from, const fs::path& to) {
  std::ifstream in(from);
  std::ofstream out(to);
  std::string line;
  while (std::getline(in, line)) {
    const std::size_t x = line.find(',') + 1;  // after the number
    char* rest = nullptr;
    const double x_m = std::strtod(line.c_str() + x, &rest);
    out << (rest == line.c_str() + x ? line
                                     : fmt::format("{}{:.4f}{}", line.substr(0, x), x_m + kAway_m, rest))
        << '\n';
  }
  if (!out.flush()) throw std::runtime_error(to.string() + ": cannot be written");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "usage: stress_drive FOLDER OUT\n");
    return 1;
  }
  const fs::path from = argv[1];
  const fs::path out = argv[2];
  try {
    Drive drive(out);
    make(ground::Dataset::open(from), drive);
    for (const char* name : {"calib.txt", "truth_left_camera.tum", "truth_rover.txt"})
      fs::copy_file(from / name, out / name, fs::copy_options::overwrite_existing);
    write_rocks(from / "truth_rocks.csv", out / "truth_rocks.csv");
    fmt::print("{} pairs in {}\n", drive.pairs(), out.string());
  } catch (const std::exception& e) {
    fmt::print(stderr, "stress_drive: {}\n", e.what());
    return 1;
  }
  return 0;
}
