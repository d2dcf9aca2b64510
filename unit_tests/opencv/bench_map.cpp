// Speed and memory of `cairn map build` on large images, and OpenCV's whole-image pipeline beside it, in the
// same run (make bench-map).
//
//   bench_map CAIRN FOLDER   makes images of 15000, 30000 and 60000 pixels a side in FOLDER, one at a time
#include <fcntl.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "core/random.hpp"

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kBlock = 256;
constexpr int kCell = 64;     ///< px; a boulder in two cells of three
constexpr int kPatch = 2048;  ///< px; in a sparse image every sixteenth is there

double seconds_since(Clock::time_point begun) {
  return std::chrono::duration<double>(Clock::now() - begun).count();
}

std::uint32_t mixed(std::uint32_t a, std::uint32_t b) {
  std::uint32_t h = a * 0x9E3779B1U ^ (b + 0x7F4A7C15U) * 0x85EBCA77U;
  h = (h ^ (h >> 15)) * 0x2C1B3C6DU;
  return h ^ (h >> 13);
}

/// Ground with slow shading and grain; boulders of 3 to 14 px with a sunlit cap and a shadow to the right.
class Field {
 public:
  Field() : grain_(1 << 16) {
    cairn::Random random(5);
    for (std::uint8_t& g : grain_)
      g = static_cast<std::uint8_t>(random.below(13) + random.below(13) + random.below(13));
  }

  void draw(int x0, int y0, std::vector<std::uint8_t>& block) const {
    for (int y = 0; y < kBlock; ++y) {
      const std::uint32_t from =
          mixed(static_cast<std::uint32_t>(y0 + y), static_cast<std::uint32_t>(x0)) & 0x7FFFU;
      const int shade = static_cast<int>(90 + 14 * std::sin((y0 + y) / 700.0) + 14 * std::sin(x0 / 900.0));
      for (int x = 0; x < kBlock; ++x)
        block[at(x, y)] = static_cast<std::uint8_t>(shade + grain_[from + static_cast<std::uint32_t>(x)]);
    }
    for (int v = y0 / kCell - 1; v <= (y0 + kBlock) / kCell; ++v)
      for (int u = x0 / kCell - 1; u <= (x0 + kBlock) / kCell; ++u) boulder(u, v, x0, y0, block);
  }

 private:
  static std::size_t at(int x, int y) {
    return static_cast<std::size_t>(y) * kBlock + static_cast<std::size_t>(x);
  }

  static void boulder(int u, int v, int x0, int y0, std::vector<std::uint8_t>& block) {
    const std::uint32_t h = mixed(static_cast<std::uint32_t>(u + 7), static_cast<std::uint32_t>(v + 7));
    if (h % 3 == 0) return;
    const int radius = 3 + static_cast<int>((h >> 8) % 12 * ((h >> 12) % 12) / 12);
    const int cx = u * kCell + static_cast<int>((h >> 16) % kCell) - x0;
    const int cy = v * kCell + static_cast<int>((h >> 22) % kCell) - y0;
    for (int y = std::max(0, cy - radius); y <= std::min(kBlock - 1, cy + radius); ++y)
      for (int x = std::max(0, cx - radius); x <= std::min(kBlock - 1, cx + 3 * radius); ++x) {
        const int dy = (y - cy) * (y - cy);
        const bool cap = (x - cx) * (x - cx) + dy <= radius * radius;
        const int along = std::max(0, std::abs(x - cx - radius) - radius / 2);
        if (cap && x < cx) {
          block[at(x, y)] = static_cast<std::uint8_t>(std::min(255, block[at(x, y)] + 50));
        } else if (cap || along * along + dy <= radius * radius) {
          block[at(x, y)] = static_cast<std::uint8_t>(block[at(x, y)] / 3);
        }
      }
  }

  std::vector<std::uint8_t> grain_;
};

void make_image(const fs::path& path, int side, bool sparse) {
  GDALAllRegister();
  const char* options[] = {"TILED=YES", "BIGTIFF=IF_SAFER", sparse ? "SPARSE_OK=TRUE" : nullptr, nullptr};
  const std::unique_ptr<GDALDataset> data(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), side, side, 1, GDT_Byte, const_cast<char**>(options)));
  if (data == nullptr) throw std::runtime_error("cannot write " + path.string());
  double geo[6] = {10000.0, 0.25, 0.0, 20000.0, 0.0, -0.25};
  data->SetGeoTransform(geo);
  OGRSpatialReference system;
  system.importFromEPSG(32633);
  data->SetSpatialRef(&system);
  GDALRasterBand& band = *data->GetRasterBand(1);
  if (sparse) band.SetNoDataValue(0.0);
  const Field field;
  std::vector<std::uint8_t> block(kBlock * kBlock);
  for (int y = 0; y < side; y += kBlock)
    for (int x = 0; x < side; x += kBlock) {
      if (sparse && (x / kPatch % 4 != 0 || y / kPatch % 4 != 0)) continue;
      field.draw(x, y, block);
      if (band.WriteBlock(x / kBlock, y / kBlock, block.data()) != CE_None)
        throw std::runtime_error("cannot write " + path.string());
    }
}

struct Run {
  double wall_s = 0.0;
  double cpu_s = 0.0;
  double peak_mib = 0.0;
};

/// A child's own time and memory: `work` runs in it.
template <typename Work>
Run run_child(const Work& work) {
  const Clock::time_point begun = Clock::now();
  const pid_t child = ::fork();
  if (child == 0) {
    work();
    std::_Exit(0);
  }
  int how = 0;
  rusage used = {};
  ::wait4(child, &how, 0, &used);
  if (!WIFEXITED(how) || WEXITSTATUS(how) != 0) throw std::runtime_error("a child failed");
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return {seconds_since(begun), seconds(used.ru_utime) + seconds(used.ru_stime),
          static_cast<double>(used.ru_maxrss) / 1024.0};
}

void print(const char* what, int side, const Run& run) {
  const double megapixels = 1e-6 * side * side;
  fmt::print("{:<34} {:>6} {:>10.1f} {:>10.1f} {:>12.1f} {:>10.0f}\n", what, side, run.wall_s, run.cpu_s,
             megapixels / run.wall_s, run.peak_mib);
  std::fflush(stdout);
}

/// Otsu's threshold block by block, median, components: all of the image in memory.
void opencv_pipeline(const fs::path& path) {
  GDALAllRegister();
  const std::unique_ptr<GDALDataset> data(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER));
  const int width = data->GetRasterXSize();
  const int height = data->GetRasterYSize();
  cv::Mat image(height, width, CV_8U);
  if (data->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, width, height, image.data, width, height, GDT_Byte, 0,
                                       0, nullptr) != CE_None)
    std::_Exit(1);
  cv::Mat mask(height, width, CV_8U);
  for (int y = 0; y < height; y += 128)
    for (int x = 0; x < width; x += 128) {
      const cv::Rect block(x, y, std::min(128, width - x), std::min(128, height - y));
      cv::Mat part = mask(block);
      cv::threshold(image(block), part, 0, 255, cv::THRESH_BINARY_INV | cv::THRESH_OTSU);
    }
  image.release();
  cv::Mat smooth;
  cv::medianBlur(mask, smooth, 15);
  mask.release();
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centroids;
  cv::connectedComponentsWithStats(smooth, labels, stats, centroids, 8, CV_32S);
}

double available_mib() {
  std::ifstream facts("/proc/meminfo");
  std::string word;
  while (facts >> word) {
    double kib = 0.0;
    if (word == "MemAvailable:" && facts >> kib) return kib / 1024.0;
  }
  return 0.0;
}

void bench(const std::string& cairn, const fs::path& folder, int side, bool sparse) {
  const fs::path image = folder / fmt::format("field_{}.tif", side);
  const fs::path map = folder / fmt::format("field_{}.cmap", side);
  make_image(image, side, sparse);
  const auto map_build = [&](const char* method, const char* sun, const char* threads) {
    const Run run = run_child([&] {
      const int nowhere = ::open("/dev/null", O_WRONLY);
      ::dup2(nowhere, STDOUT_FILENO);
      ::execl(cairn.c_str(), cairn.c_str(), "map", "build", image.c_str(), "-o", map.c_str(), "--method",
              method, "--threads", threads, sun, nullptr);
      std::_Exit(127);
    });
    print(fmt::format("{}, {} thread{}{}", method, threads, threads[0] == '1' ? "" : "s",
                      sparse ? ", sparse" : "")
              .c_str(),
          side, run);
  };
  map_build("otsu", nullptr, "2");
  if (!sparse) {
    map_build("otsu", nullptr, "1");
    map_build("shadow", "--sun=35,270", "2");  // shadows lie to the right
  }
  const double need_mib = 8.0 * side * side / 1048576.0;
  if (!sparse && available_mib() > 1.2 * need_mib) {
    print("OpenCV, whole image", side, run_child([&] { opencv_pipeline(image); }));
  } else {
    fmt::print("OpenCV, whole image                {:>6}  left out: asks for about {:.0f} GiB\n", side,
               need_mib / 1024.0);
  }
  fs::remove(image);
  fs::remove(map);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "bench_map CAIRN FOLDER\n");
    return 1;
  }
  try {
    fs::create_directories(argv[2]);
    fmt::print("{:<34} {:>6} {:>10} {:>10} {:>12} {:>10}\n", "", "side", "wall s", "CPU s", "Mpixel/s",
               "peak MiB");
    bench(argv[1], argv[2], 15000, false);
    bench(argv[1], argv[2], 30000, false);
    bench(argv[1], argv[2], 60000, true);
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_map: {}\n", error.what());
    return 1;
  }
  return 0;
}
