#include "vo/rectification.hpp"

#include <cmath>

namespace cairn {
namespace {

/// Rows of the first-order model at a match: shifts of the right point by each angle.
struct Model {
  RectificationEstimator::Angles vertical;
  RectificationEstimator::Angles horizontal;
};

double square(double x) { return x * x; }

/// The part of an estimate that counts where `least2` is the square of what is faked.
double beyond(double x, double least2) { return square(x) > least2 ? x - least2 / x : 0.0; }

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
  rows_and_angles_.setZero();
  rows_information_ = rows_evidence_ = columns_information_ = columns_evidence_ = 0.0;
  angles_.setZero();
  offset_ = {};
  if (params.enabled) offset_.columns_px = params.columns_px;
}

void RectificationEstimator::set_rows(double rows_px) {
  if (params_.enabled) offset_.rows_px = rows_px;
}

void RectificationEstimator::observe(const StereoPixel& measured) {
  if (!params_.enabled) return;
  const Model m = model_at(rig_, measured);
  const double dv = measured.v_right - measured.v_left;
  if (!(std::fabs(dv - offset_.rows_px - m.vertical.dot(angles_)) <= params_.gate_px)) return;
  const double w = 1.0 / (params_.sigma_px * params_.sigma_px);
  information_.noalias() += w * m.vertical * m.vertical.transpose();
  evidence_ += (w * dv) * m.vertical;
  rows_and_angles_ += w * m.vertical;
  rows_information_ += w;
  rows_evidence_ += w * dv;
}

void RectificationEstimator::observe_columns(double information, double evidence) {
  if (!params_.enabled) return;
  columns_information_ += information;
  columns_evidence_ += information * (offset_.columns_px - params_.columns_px) + evidence;
}

void RectificationEstimator::end_frame() {
  if (!params_.enabled) return;
  if (rows_information_ > 0.0) estimate_rows_and_angles();
  if (params_.prior_columns_px > 0.0) estimate_columns();
  const double keep = 1.0 - 1.0 / params_.memory_frames;
  information_ *= keep;
  evidence_ *= keep;
  rows_and_angles_ *= keep;
  rows_information_ *= keep;
  rows_evidence_ *= keep;
  columns_information_ *= keep;
  columns_evidence_ *= keep;
}

/// Where images lie on the same rows on the average, the four angles alone; else rows and angles together,
/// with no more evidence than the mean of any number of matches is worth. Between the two, shares of both.
void RectificationEstimator::estimate_rows_and_angles() {
  const double prior = 1.0 / square(params_.prior_sigma_rad);
  const Matrix4 alone = information_ + Matrix4::Identity() * prior;
  angles_ = Eigen::LDLT<Matrix4>(alone).solve(evidence_);
  offset_.rows_px = 0.0;
  const double mean_px = rows_evidence_ / rows_information_;
  const double share = beyond(mean_px, square(params_.least_rows_px)) / mean_px;
  if (!(share > 0.0)) return;
  const double worth = 1.0 / (1.0 + rows_information_ * square(params_.common_px));
  const Matrix4 with_rows = information_ * worth + Matrix4::Identity() * prior;
  const Eigen::LDLT<Matrix4> ldlt(with_rows);
  const Angles shared = rows_and_angles_ * worth;
  const Angles moved = ldlt.solve(shared);
  const double information =
      rows_information_ * worth + 1.0 / square(params_.prior_rows_px) - moved.dot(shared);
  const double rows_px = (rows_evidence_ * worth - moved.dot(evidence_) * worth) / information;
  const Angles rest = evidence_ * worth - shared * rows_px;
  const Angles angles = ldlt.solve(rest);
  offset_.rows_px = share * rows_px;
  angles_ += share * (angles - angles_);
}

void RectificationEstimator::estimate_columns() {
  const double information = columns_information_ + 1.0 / square(params_.prior_columns_px);
  const double columns_px = columns_evidence_ / information;
  // Of a lens that nobody told of, say: no offset of a rig.
  const bool absurd = !(std::fabs(columns_px) <= 3.0 * params_.prior_columns_px);
  const double counts = beyond(columns_px, square(params_.least_columns_px) + 4.0 / information);
  offset_.columns_px = params_.columns_px + (absurd ? 0.0 : counts);
}

StereoPixel RectificationEstimator::correct(const StereoPixel& measured) const {
  if (!params_.enabled) return measured;
  const Model m = model_at(rig_, measured);
  StereoPixel px = measured;
  px.u_right -= offset_.columns_px + m.horizontal.dot(angles_);
  px.v_right -= offset_.rows_px + m.vertical.dot(angles_);
  return px;
}

}  // namespace cairn
