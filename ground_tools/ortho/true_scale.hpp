/// Maps in metres of the ground, whatever the projection of what they are made from: doc/adr.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/boulder_table.hpp"
#include "ortho/raster_source.hpp"
#include "ortho/site_frame.hpp"

namespace cairn::ground {

/// Takes places of one system to another; both texts as in reference_system.hpp.
class Places {
 public:
  Places(const std::string& from, const std::string& to);
  ~Places();
  Places(const Places&) = delete;
  Places& operator=(const Places&) = delete;

  /// NaN where a place has none in the other system.
  Vec2 operator()(const Vec2& p_m) const;

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

/// An image of another scale than the ground's, in the plane that touches the ground at its middle
/// (local_reference): pixels are as they were, and where they lie is affine, and right to first order.
/// `image`'s system must have a body.
class TrueScaleSource final : public RasterSource {
 public:
  TrueScaleSource(std::unique_ptr<RasterSource> image, const SiteFrame& frame);

  const RasterFacts& facts() const override { return facts_; }
  std::unique_ptr<RasterReader> reader() const override { return image_->reader(); }

  /// Boulders found in it, each to its place in the system of facts().
  void place(std::vector<TableBoulder>& boulders) const;
  /// What it covers there.
  MapExtent extent() const;

 private:
  Vec2 exact(const Vec2& p_affine_m) const;

  std::unique_ptr<RasterSource> image_;
  Places places_;
  RasterFacts facts_;
  Mat2 from_affine_;     ///< metres of the image's own plane of one of the affine one
  Vec2 middle_m_;        ///< in the image's own plane
  Vec2 middle_there_m_;  ///< and in the other
};

/// The middle of an image, in its own plane.
Vec2 middle_of(const RasterFacts& facts);

}  // namespace cairn::ground
