#include "sim/orthoimage.hpp"

#include <gdal_priv.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <system_error>

#include "base/interrupts.hpp"
#include "base/parallel.hpp"
#include "base/quiet_gdal.hpp"
#include "base/tool_error.hpp"
#include "sim/hash_random.hpp"

namespace cairn::ground::sim {
namespace {

namespace fs = std::filesystem;

constexpr double kFinest_m = 0.005;
constexpr const char* kReferenceSystem = "+proj=eqc +R=3396190 +units=m +no_defs +type=crs";

/// A GeoTIFF that is whole or absent.
class GeoTiff {
 public:
  /// `gdal` outlives it.
  GeoTiff(QuietGdal& gdal, const fs::path& path, int width, int height, GDALDataType type, double x_m,
          double y_m, double pixel_m)
      : gdal_(gdal),
        path_(path),
        part_(path.string() + fmt::format(".part{}", ::getpid())),
        unfinished_(part_),
        width_(width),
        type_(type) {
    GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
    const char* options[] = {"BIGTIFF=IF_SAFER", nullptr};
    file_ = driver->Create(part_.c_str(), width, height, 1, type, const_cast<char**>(options));
    if (file_ == nullptr) throw ToolError("{}: cannot be written{}", path_.string(), gdal_.reason());
    double geo[6] = {x_m, pixel_m, 0.0, y_m, 0.0, -pixel_m};
    gdal_.check(file_->SetGeoTransform(geo));
    OGRSpatialReference system;
    system.SetFromUserInput(kReferenceSystem);
    gdal_.check(file_->SetSpatialRef(&system));
  }
  ~GeoTiff() {
    if (file_ != nullptr) GDALClose(file_);
    std::error_code ignored;
    fs::remove(part_, ignored);
  }
  GeoTiff(const GeoTiff&) = delete;
  GeoTiff& operator=(const GeoTiff&) = delete;

  /// Where the sun stood, for who prepares a map from the image: degrees, azimuth clockwise from north.
  void tell_sun(const Sun& sun) {
    gdal_.check(file_->SetMetadataItem("SUN_ELEVATION", fmt::format("{}", sun.elevation_deg).c_str()));
    gdal_.check(file_->SetMetadataItem("SUN_AZIMUTH", fmt::format("{}", sun.azimuth_deg).c_str()));
  }
  void write_row(int row, const void* samples) {
    gdal_.check(file_->GetRasterBand(1)->RasterIO(GF_Write, 0, row, width_, 1, const_cast<void*>(samples),
                                                  width_, 1, type_, 0, 0, nullptr));
    refuse_if_failed();
  }
  void commit() {
    file_->FlushCache();
    GDALClose(file_);
    file_ = nullptr;
    refuse_if_failed();
    std::error_code fault;
    fs::rename(part_, path_, fault);
    if (fault) throw ToolError("{}: cannot be written: {}", path_.string(), fault.message());
  }

 private:
  void refuse_if_failed() const {
    if (gdal_.failed())
      throw ToolError("{}: cannot be written{}; check the space that is left", path_.string(),
                      gdal_.reason());
  }

  QuietGdal& gdal_;
  fs::path path_;
  fs::path part_;
  Unfinished unfinished_;
  int width_;
  GDALDataType type_;
  GDALDataset* file_ = nullptr;
};

/// Takes the finest rows from north to south and writes one product.
class Product {
 public:
  Product(QuietGdal& gdal, const World& world, const OrthoProduct& product, double finest_m,
          std::uint64_t number)
      : ratio_(product.pixel_m / finest_m),
        white_(static_cast<float>(world.scene().camera.white_radiance)),
        gamma_(static_cast<float>(world.scene().ortho_camera.gamma)),
        noise_dn_(static_cast<float>(world.scene().ortho_camera.noise_dn)),
        noise_(world.scene().seed),
        number_(number),
        width_(count(world.scene().site.width_m, product.pixel_m)),
        height_(count(world.scene().site.height_m, product.pixel_m)),
        file_(gdal, product.path, width_, height_, GDT_Byte, world.scene().site.origin_x_m,
              world.scene().site.origin_y_m + world.scene().site.height_m, product.pixel_m),
        sum_(static_cast<std::size_t>(width_), 0.0F) {
    const double blur_px = world.scene().ortho_camera.blur_px;
    double total = 0.0;
    for (int i = -kReach; i <= kReach; ++i) {
      kernel_[static_cast<std::size_t>(i + kReach)] =
          static_cast<float>(std::exp(-0.5 * i * i / (blur_px * blur_px)));
      total += static_cast<double>(kernel_[static_cast<std::size_t>(i + kReach)]);
    }
    for (float& k : kernel_) k /= static_cast<float>(total);
    file_.tell_sun(world.scene().ortho_sun);
  }

  static int count(double side_m, double pixel_m) {
    return static_cast<int>(std::floor(side_m / pixel_m + 1e-6));
  }

  /// The next row of the finest image, `n` samples.
  void push(const float* row, std::size_t n) {
    const double from = static_cast<double>(pushed_++);
    double done = from;
    while (taken_ < height_ && done < from + 1.0 - 1e-9) {
      const double end = ratio_ * (taken_ + 1);
      const double to = std::min(from + 1.0, end);
      add(row, n, static_cast<float>((to - done) / ratio_));
      done = to;
      if (to >= end - 1e-9) take();
    }
  }

  /// Writes the rows that are ready. GDAL is called from one thread, so that its complaints are heard.
  void flush() {
    for (const std::vector<std::uint8_t>& row : ready_) file_.write_row(flushed_++, row.data());
    ready_.clear();
  }
  void finish() {
    while (written_ < height_) write_next();
    flush();
    file_.commit();
  }

 private:
  static constexpr int kReach = 2;

  /// Adds `weight` of a finest row, averaged across.
  void add(const float* row, std::size_t n, float weight) {
    for (int u = 0; u < width_; ++u) {
      const double low = ratio_ * u;
      const double high = ratio_ * (u + 1);
      float sum = 0.0F;
      for (auto i = static_cast<std::size_t>(low + 1e-9); i < n && static_cast<double>(i) < high - 1e-9;
           ++i) {
        const double share =
            std::min(high, static_cast<double>(i + 1)) - std::max(low, static_cast<double>(i));
        sum += static_cast<float>(share) * row[i];
      }
      sum_[static_cast<std::size_t>(u)] += weight * sum / static_cast<float>(ratio_);
    }
  }

  /// A row of the product is whole: blurred across, it waits for its neighbours.
  void take() {
    std::vector<float>& row = rows_[static_cast<std::size_t>(taken_ % kRing)];
    row.assign(sum_.size(), 0.0F);
    for (int u = 0; u < width_; ++u) {
      for (int k = -kReach; k <= kReach; ++k)
        row[static_cast<std::size_t>(u)] += kernel_[static_cast<std::size_t>(k + kReach)] *
                                            sum_[static_cast<std::size_t>(std::clamp(u + k, 0, width_ - 1))];
    }
    std::fill(sum_.begin(), sum_.end(), 0.0F);
    ++taken_;
    if (taken_ > kReach && taken_ < height_) write_next();
  }

  void write_next() {
    std::vector<std::uint8_t> out(static_cast<std::size_t>(width_));
    std::array<const float*, 2 * kReach + 1> from{};
    for (int k = -kReach; k <= kReach; ++k)
      from[static_cast<std::size_t>(k + kReach)] =
          rows_[static_cast<std::size_t>(std::clamp(written_ + k, 0, taken_ - 1) % kRing)].data();
    const std::uint64_t row_hash =
        hash(noise_, Stream::kOrtho, number_, static_cast<std::uint64_t>(written_));
    for (std::size_t u = 0; u < out.size(); ++u) {
      float radiance = 0.0F;
      for (std::size_t k = 0; k < from.size(); ++k) radiance += kernel_[k] * from[k][u];
      // Sum of four uniform numbers: near enough to normal for one DN.
      const std::uint64_t bits = mix(row_hash + u * 0x9E3779B97F4A7C15ULL);
      const auto part = [&](unsigned shift) {
        return static_cast<float>((bits >> shift) & 0xFFFFU) / 65535.0F - 0.5F;
      };
      const float noise = noise_dn_ * 1.7320508F * (part(0) + part(16) + part(32) + part(48));
      const float share = std::max(0.0F, radiance) / white_;
      const float dn = 255.0F * (gamma_ == 0.5F ? std::sqrt(share) : std::pow(share, gamma_)) + noise;
      out[u] = static_cast<std::uint8_t>(std::clamp(dn + 0.5F, 0.0F, 255.0F));
    }
    ready_.push_back(std::move(out));
    ++written_;
  }

  static constexpr int kRing = 2 * kReach + 1;
  double ratio_;
  float white_;
  float gamma_;
  float noise_dn_;
  std::uint64_t noise_;
  std::uint64_t number_;
  int width_;
  int height_;
  GeoTiff file_;
  std::array<float, 2 * kReach + 1> kernel_{};
  std::vector<float> sum_;
  std::vector<float> rows_[kRing];
  long pushed_ = 0;
  int taken_ = 0;
  int written_ = 0;
  int flushed_ = 0;
  std::vector<std::vector<std::uint8_t>> ready_;
};

}  // namespace

std::string ortho_name(double pixel_m) { return fmt::format("ortho_{:.3g}mm.tif", 1e3 * pixel_m); }

void check(const Site& site, const std::vector<OrthoProduct>& products) {
  const double most_m = std::min(site.width_m, site.height_m);
  for (const OrthoProduct& p : products) {
    if (!(p.pixel_m >= 0.001 && p.pixel_m <= 10.0) || p.pixel_m > most_m)
      throw ToolError("{}: a pixel of {} m; give 0.001 to 10, and not more than the site's {} m",
                      p.path.string(), p.pixel_m, most_m);
  }
}

void write_orthoimages(const World& world, const std::vector<OrthoProduct>& products,
                       const std::function<void(double)>& done, int most_samples) {
  const Site& site = world.scene().site;
  check(site, products);
  if (products.empty()) return;
  double smallest = products[0].pixel_m;
  for (const OrthoProduct& p : products) smallest = std::min(smallest, p.pixel_m);
  const double finest_m =
      smallest / std::min(std::ceil(smallest / kFinest_m - 1e-9), static_cast<double>(most_samples));
  QuietGdal gdal;
  std::vector<std::unique_ptr<Product>> writers;
  for (std::size_t i = 0; i < products.size(); ++i)
    writers.push_back(std::make_unique<Product>(gdal, world, products[i], finest_m, i));

  const int width = Product::count(site.width_m, finest_m);
  const int height = Product::count(site.height_m, finest_m);
  const int rows_a_part = 16;
  const auto parts_a_strip = 4 * static_cast<int>(core_count());
  std::vector<FloatImage> parts(static_cast<std::size_t>(parts_a_strip));
  for (int v = 0; v < height; v += parts_a_strip * rows_a_part) {
    parallel_for(parts.size(), [&](std::size_t i) {
      const int top = v + static_cast<int>(i) * rows_a_part;
      const int rows = std::clamp(height - top, 0, rows_a_part);
      const OrthoPart part{width, rows, site.origin_x_m, site.origin_y_m + site.height_m - top * finest_m,
                           finest_m};
      world.render(part, world.scene().ortho_sun, parts[i]);
    });
    parallel_for(writers.size(), [&](std::size_t w) {
      for (const FloatImage& part : parts) {
        for (int row = 0; row < part.height; ++row)
          writers[w]->push(part.pixels.data() + static_cast<std::ptrdiff_t>(row) * width,
                           static_cast<std::size_t>(width));
      }
    });
    for (const auto& writer : writers) writer->flush();
    if (done) done(std::min(1.0, static_cast<double>(v + parts_a_strip * rows_a_part) / height));
  }
  for (const auto& writer : writers) writer->finish();
}

void write_dem(const World& world, const fs::path& path) {
  const Site& site = world.scene().site;
  constexpr double kCell_m = 0.05;
  const int width = Product::count(site.width_m, kCell_m);
  const int height = Product::count(site.height_m, kCell_m);
  const double north = site.origin_y_m + site.height_m;
  QuietGdal gdal;
  GeoTiff file(gdal, path, width, height, GDT_Float32, site.origin_x_m, north, kCell_m);
  std::vector<float> row(static_cast<std::size_t>(width));
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u)
      row[static_cast<std::size_t>(u)] = static_cast<float>(
          world.terrain().height_m(site.origin_x_m + (u + 0.5) * kCell_m, north - (v + 0.5) * kCell_m));
    file.write_row(v, row.data());
  }
  file.commit();
}

}  // namespace cairn::ground::sim
