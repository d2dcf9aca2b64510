#include "vo/rectification.hpp"

#include <cmath>

namespace cairn {
namespace {

/// Rows of the first-order model at a match: shifts of the right point by each angle.
struct Model {
  RectificationEstimator::Angles vertical;
  RectificationEstimator::Angles horizontal;
};

Model model_at(const StereoRig& rig, const StereoPixel& px) {
  const double f = rig.fx_px;
  const double u = px.u_right - rig.cx_px;
  const double v = px.v_right - rig.cy_px;
  const double d = px.disparity_px();
  Model m;
  m.vertical << f + v * v / f, -u, -d, v * d / f;
  m.horizontal << u * v / f, v, 0.0, u * d / f;
  return m;
}

}  // namespace

void RectificationEstimator::init(const RectificationParams& params, const StereoRig& rig) {
  params_ = params;
  rig_ = rig;
  information_.setZero();
  evidence_.setZero();
  angles_.setZero();
}

void RectificationEstimator::observe(const StereoPixel& measured) {
  if (!params_.enabled) return;
  const Model m = model_at(rig_, measured);
  const double dv = measured.v_right - measured.v_left;
  if (!(std::fabs(dv - m.vertical.dot(angles_)) <= params_.gate_px)) return;
  const double w = 1.0 / (params_.sigma_px * params_.sigma_px);
  information_.noalias() += w * m.vertical * m.vertical.transpose();
  evidence_ += (w * dv) * m.vertical;
}

void RectificationEstimator::end_frame() {
  if (!params_.enabled) return;
  const Matrix4 prior = Matrix4::Identity() * (1.0 / (params_.prior_sigma_rad * params_.prior_sigma_rad));
  const Eigen::LDLT<Matrix4> ldlt(information_ + prior);
  angles_ = ldlt.solve(evidence_);
  const double keep = 1.0 - 1.0 / params_.memory_frames;
  information_ *= keep;
  evidence_ *= keep;
}

StereoPixel RectificationEstimator::correct(const StereoPixel& measured) const {
  if (!params_.enabled) return measured;
  const Model m = model_at(rig_, measured);
  StereoPixel px = measured;
  px.u_right -= m.horizontal.dot(angles_);
  px.v_right -= m.vertical.dot(angles_);
  return px;
}

}  // namespace cairn
