/// Ground of gullies, scarps and ridges without a boulder, drawn from a seed alone: what the simulator's
/// terrain does not have. Heights are sums of few shapes, shaded as a matt surface is, shadows marched along
/// the sun; lengths in pixels, of 0.25 m.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/trig.hpp"
#include "ground_tools/detect/shadow_fields.hpp"

namespace cairn::test {

class DrawnGullies {
 public:
  static constexpr int kSide = 400;

  explicit DrawnGullies(std::uint64_t seed) : draw_(seed, sim::Stream::kCraters, 1200) {
    heights_.assign(static_cast<std::size_t>(kWide) * kWide, 0.0);
    sun_.elevation_rad = draw_.uniform(15.0, 55.0) * kRadPerDeg;
    sun_.azimuth_rad = draw_.uniform(0.0, 2.0 * kPi);
    undulate();
    const int count = 1 + static_cast<int>(draw_.uniform() * 4.0);
    for (int i = 0; i < count; ++i) carve();
  }

  RenderedField rendered() {
    Raster raster;
    raster.width = raster.height = kSide;
    raster.geo.c[1] = 0.25;
    raster.geo.c[5] = -0.25;
    shade(raster);
    RenderedField field;
    field.images.push_back(raster);
    field.suns.push_back(sun_);
    return field;
  }

 private:
  static constexpr int kMargin = 60;  ///< for shadows that come from beyond
  static constexpr int kWide = kSide + 2 * kMargin;

  double& height(int x, int y) {
    return heights_[static_cast<std::size_t>(y) * kWide + static_cast<std::size_t>(x)];
  }

  /// Waves of every length, steeper where they are short, and rough ground.
  void undulate() {
    const double rough = draw_.uniform(0.0, 0.25);
    struct Wave {
      double kx, ky, phase, amplitude;
    };
    std::vector<Wave> waves;
    for (double length = 12.0; length < 300.0; length *= 1.5) {
      const double angle = draw_.uniform(0.0, 2.0 * kPi);
      const double k = 2.0 * kPi / length;
      waves.push_back({k * std::cos(angle), k * std::sin(angle), draw_.uniform(0.0, 2.0 * kPi),
                       draw_.uniform(0.0, 0.12) / k});
    }
    for (int y = 0; y < kWide; ++y) {
      for (int x = 0; x < kWide; ++x) {
        double h = rough * (draw_.uniform() - 0.5);
        for (const Wave& w : waves) h += w.amplitude * std::sin(w.kx * x + w.ky * y + w.phase);
        height(x, y) = h;
      }
    }
  }

  /// A trench, a ridge or a step along a line that winds; its edge is frayed.
  void carve() {
    const double angle = draw_.uniform(0.0, 2.0 * kPi);
    const double c = std::cos(angle), s = std::sin(angle);
    const double x0 = draw_.uniform(0.2, 0.8) * kWide, y0 = draw_.uniform(0.2, 0.8) * kWide;
    const double half = std::exp(draw_.uniform(std::log(1.5), std::log(30.0)));
    const double depth = half * draw_.uniform(0.25, 0.9) * (draw_.uniform() < 0.75 ? -1.0 : 1.0);
    const bool step = draw_.uniform() < 0.3;
    const double fray = draw_.uniform(0.0, 0.25) * half;
    double bends[4][3];  // wave number, phase, amplitude
    for (double(&bend)[3] : bends) {
      const double length = std::exp(draw_.uniform(std::log(8.0), std::log(400.0)));
      bend[0] = 2.0 * kPi / length;
      bend[1] = draw_.uniform(0.0, 2.0 * kPi);
      bend[2] = draw_.uniform(0.0, 0.05) * length;
    }
    for (int y = 0; y < kWide; ++y) {
      for (int x = 0; x < kWide; ++x) {
        const double along = c * (x - x0) + s * (y - y0);
        double off = c * (y - y0) - s * (x - x0) + fray * (draw_.uniform() - 0.5);
        for (const double(&bend)[3] : bends) off += bend[2] * std::sin(bend[0] * along + bend[1]);
        const double t = off / half;
        if (step) {
          height(x, y) += depth * 0.5 * (1.0 + std::tanh(1.5 * t));
        } else if (std::fabs(t) < 1.0) {
          height(x, y) += depth * (1.0 - t * t);
        }
      }
    }
  }

  bool in_shadow(int x, int y, double dx, double dy, double rise) {
    const double from = height(x, y);
    for (int k = 1; k < kMargin; ++k) {
      const double h =
          height(static_cast<int>(std::lround(x + k * dx)), static_cast<int>(std::lround(y + k * dy)));
      if (h > from + k * rise + 0.3) return true;
    }
    return false;
  }

  void shade(Raster& raster) {
    const SinCos e = sin_cos(sun_.elevation_rad);
    const double dx = std::sin(sun_.azimuth_rad), dy = -std::cos(sun_.azimuth_rad);  // v grows southwards
    const double sky = draw_.uniform(0.01, 0.12);
    const double level = draw_.uniform(60.0, 130.0) / (e.sin + sky);
    const double texture = draw_.uniform(0.02, 0.12), noise = draw_.uniform(0.5, 3.0);
    std::vector<double> light(static_cast<std::size_t>(kSide) * kSide);
    for (int v = 0; v < kSide; ++v) {
      for (int u = 0; u < kSide; ++u) {
        const int x = u + kMargin, y = v + kMargin;
        const double gx = 0.5 * (height(x + 1, y) - height(x - 1, y));
        const double gy = 0.5 * (height(x, y + 1) - height(x, y - 1));
        const double facing = (e.sin - e.cos * (gx * dx + gy * dy)) / std::sqrt(1.0 + gx * gx + gy * gy);
        const bool lit = facing > 0.0 && !in_shadow(x, y, dx, dy, e.sin / e.cos);
        const double albedo = 1.0 + texture * (2.0 * draw_.uniform() - 1.0);
        light[static_cast<std::size_t>(v) * kSide + static_cast<std::size_t>(u)] =
            level * albedo * (sky + (lit ? facing : 0.0));
      }
    }
    raster.grey.resize(light.size());
    const auto at = [&light](int u, int v) {
      const int cu = std::min(kSide - 1, std::max(0, u)), cv = std::min(kSide - 1, std::max(0, v));
      return light[static_cast<std::size_t>(cv) * kSide + static_cast<std::size_t>(cu)];
    };
    const double side = draw_.uniform(0.05, 0.2);  // of the camera's blur, a weight either way
    for (int v = 0; v < kSide; ++v) {
      for (int u = 0; u < kSide; ++u) {
        double sum = 0.0;
        for (int j = -1; j <= 1; ++j) {
          for (int i = -1; i <= 1; ++i)
            sum += (i == 0 ? 1.0 - 2.0 * side : side) * (j == 0 ? 1.0 - 2.0 * side : side) * at(u + i, v + j);
        }
        const double grey = sum + noise * 1.7 * (2.0 * draw_.uniform() - 1.0);
        raster.grey[static_cast<std::size_t>(v) * kSide + static_cast<std::size_t>(u)] =
            static_cast<std::uint8_t>(std::min(255.0, std::max(0.0, grey + 0.5)));
      }
    }
  }

  sim::Draw draw_;
  std::vector<double> heights_;
  Sun sun_;
};

}  // namespace cairn::test
