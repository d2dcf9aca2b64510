#include "vo/rectification.hpp"

#include <cmath>

#include "core/arithmetic.hpp"
#include "core/factors.hpp"

namespace cairn {
namespace {

/// Rows of the first-order model at a match: shifts of the right point by each angle.
struct Model {
  RectificationEstimator::Angles vertical;
  RectificationEstimator::Angles horizontal;
};

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

/// Row difference that a lens of one makes: exact, as long as it is the only error.
double rows_of_lens(const StereoRig& rig, const StereoPixel& px) {
  const double f2 = square(rig.fx_px);
  const double v_left = px.v_left - rig.cy_px;
  const double v_right = px.v_right - rig.cy_px;
  const double left2 = square(px.u_left - rig.cx_px) + square(v_left);
  const double right2 = square(px.u_right - rig.cx_px) + square(v_right);
  return (v_left * right2 - v_right * left2) / f2;
}

}  // namespace

void RectificationEstimator::init(const RectificationParams& params, const StereoRig& rig) {
  params_ = params;
  rig_ = rig;
  information_.setZero();
  evidence_.setZero();
  motions_ = {};
  angles_.setZero();
  offset_ = {};
  if (params.enabled) offset_.columns_px = params.columns_px;
}

void RectificationEstimator::set_rows(double rows_px) {
  if (params_.enabled) offset_.rows_px = rows_px;
}

void RectificationEstimator::observe(const StereoPixel& measured) {
  if (!params_.enabled) return;
  const Causes rows = causes_at(measured);
  const double dv = measured.v_right - measured.v_left;
  const double expected = offset_.rows_px + rows.head<4>().dot(angles_) + rows[kLens] * offset_.lens;
  if (!(std::fabs(dv - expected) <= params_.gate_px)) return;
  const double w = 1.0 / (params_.sigma_px * params_.sigma_px);
  information_.noalias() += w * rows * rows.transpose();
  evidence_ += (w * dv) * rows;
}

RectificationEstimator::Causes RectificationEstimator::causes_at(const StereoPixel& px) const {
  Causes rows;
  rows.head<4>() = model_at(rig_, px).vertical;
  rows[kRows] = 1.0;
  rows[kYaw] = (px.u_right - rig_.cx_px) * (px.v_right - rig_.cy_px) / rig_.fx_px;
  rows[kLens] = rows_of_lens(rig_, px);
  return rows;
}

void RectificationEstimator::observe_motion(const RigEvidence& motion) {
  if (!params_.enabled) return;
  const double columns_px = offset_.columns_px - params_.columns_px;
  const double lens = offset_.lens;
  motions_.columns_information += motion.columns_information;
  motions_.columns_evidence +=
      motion.columns_information * columns_px + motion.columns_evidence + motion.shared * lens;
  motions_.lens_information += motion.lens_information;
  motions_.lens_evidence +=
      motion.lens_information * lens + motion.lens_evidence + motion.shared * columns_px;
  motions_.shared += motion.shared;
}

/// Angles and lens, whose rows are so much shorter, have the smaller part of the information; offsets are
/// shorter themselves.
void RectificationEstimator::rescale(const StereoRig& rig, double scale) {
  rig_ = rig;
  params_.prior_rows_px *= scale;
  params_.prior_columns_px *= scale;
  params_.columns_px *= scale;
  offset_.rows_px *= scale;
  offset_.columns_px *= scale;
  for (int i = 0; i < kCauses; ++i) {
    const double of_cause = i == kRows ? 1.0 : scale;
    information_.row(i) *= of_cause;
    information_.col(i) *= of_cause;
    evidence_[i] *= of_cause * scale;
  }
  motions_.columns_information /= square(scale);
  motions_.columns_evidence /= scale;
  motions_.shared /= scale;
}

void RectificationEstimator::end_frame() {
  if (!params_.enabled) return;
  if (params_.prior_lens > 0.0 && params_.prior_columns_px > 0.0) estimate_lens();
  if (information_(kRows, kRows) > 0.0) estimate_rows_and_angles();
  if (params_.prior_columns_px > 0.0) estimate_columns();
  const double keep = 1.0 - 1.0 / params_.memory_frames;
  information_ *= keep;
  evidence_ *= keep;
  motions_.columns_information *= keep;
  motions_.columns_evidence *= keep;
  motions_.lens_information *= keep;
  motions_.lens_evidence *= keep;
  motions_.shared *= keep;
}

/// Two witnesses: rows, beside all else that they show (a yaw's are nearly those of a lens), and motions,
/// beside columns. What they differ by is faked, or no lens of this kind.
void RectificationEstimator::estimate_lens() {
  const double angle = 1.0 / square(params_.prior_sigma_rad);
  Normal all = information_;
  for (int k = 0; k < kRows; ++k) all(k, k) += angle;
  all(kRows, kRows) += 1.0 / square(params_.prior_rows_px);
  all(kYaw, kYaw) += angle;
  all(kLens, kLens) += 1.0 / square(params_.prior_lens);
  const double of_rows = Factors(all).solve(evidence_)[kLens];
  const double columns = columns_information();
  const double information =
      motions_.lens_information - square(motions_.shared) / columns + 1.0 / square(params_.prior_lens);
  const double lens =
      (motions_.lens_evidence - motions_.shared * motions_.columns_evidence / columns) / information;
  const bool absurd = !(std::fabs(lens) <= 3.0 * params_.prior_lens);
  const double faked2 = square(params_.least_lens) + square(of_rows - lens) + 4.0 / information;
  offset_.lens = absurd ? 0.0 : beyond(lens, faked2);
}

/// Where images lie on the same rows on the average, the four angles alone; else rows and angles together,
/// with no more evidence than the mean of any number of matches is worth. Between the two, shares of both.
void RectificationEstimator::estimate_rows_and_angles() {
  const double prior = 1.0 / square(params_.prior_sigma_rad);
  const double rows_information = information_(kRows, kRows);
  const Matrix4 of_angles = information_.topLeftCorner<4, 4>();
  const Causes evidence = evidence_ - information_.col(kLens) * offset_.lens;
  const Matrix4 alone = of_angles + Matrix4::Identity() * prior;
  const Angles angles_evidence = evidence.head<4>();
  angles_ = Factors(alone).solve(angles_evidence);
  offset_.rows_px = 0.0;
  const double mean_px = evidence[kRows] / rows_information;
  const double share = beyond(mean_px, square(params_.least_rows_px)) / mean_px;
  if (!(share > 0.0)) return;
  const double worth = 1.0 / (1.0 + rows_information * square(params_.common_px));
  const Matrix4 with_rows = of_angles * worth + Matrix4::Identity() * prior;
  const Factors factors(with_rows);
  const Angles shared = information_.col(kRows).head<4>() * worth;
  const Angles moved = factors.solve(shared);
  const double information =
      rows_information * worth + 1.0 / square(params_.prior_rows_px) - moved.dot(shared);
  const double rows_px = (evidence[kRows] * worth - moved.dot(angles_evidence) * worth) / information;
  const Angles rest = angles_evidence * worth - shared * rows_px;
  const Angles angles = factors.solve(rest);
  offset_.rows_px = share * rows_px;
  angles_ += share * (angles - angles_);
}

double RectificationEstimator::columns_information() const {
  return motions_.columns_information + 1.0 / square(params_.prior_columns_px);
}

void RectificationEstimator::estimate_columns() {
  const double information = columns_information();
  const double columns_px = (motions_.columns_evidence - motions_.shared * offset_.lens) / information;
  // No offset of a rig.
  const bool absurd = !(std::fabs(columns_px) <= 3.0 * params_.prior_columns_px);
  const double counts = beyond(columns_px, square(params_.least_columns_px) + 4.0 / information);
  offset_.columns_px = params_.columns_px + (absurd ? 0.0 : counts);
}

StereoPixel RectificationEstimator::correct(const StereoPixel& measured) const {
  if (!params_.enabled) return measured;
  StereoPixel px = without_lens(rig_, offset_.lens, measured);
  const Model m = model_at(rig_, px);
  px.u_right -= offset_.columns_px + m.horizontal.dot(angles_);
  px.v_right -= offset_.rows_px + m.vertical.dot(angles_);
  return px;
}

}  // namespace cairn
