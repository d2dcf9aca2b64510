#include "vo/absolute_orientation.hpp"

#include <cmath>

namespace cairn {
namespace {

using Mat4 = Eigen::Matrix<double, 4, 4>;

/// An element so small beside the largest turns no eigenvector by a bit. Left in, it would be squared by each
/// sweep, and end as a subnormal number: what some floating-point units trap on, and others flush.
constexpr double kNothing = 0x1p-110;
constexpr double kLeast_m2 = 1.0e-30;

/// One Jacobi rotation that clears a(p, q) of a symmetric matrix, gathered into v. An element of at most
/// `nothing` becomes zero without one: false.
bool rotate(Mat4& a, Mat4& v, int p, int q, double nothing) {
  if (std::fabs(a(p, q)) <= nothing) {
    a(p, q) = a(q, p) = 0.0;
    return false;
  }
  const double theta = (a(q, q) - a(p, p)) / (2.0 * a(p, q));
  const double t = (theta >= 0.0 ? 1.0 : -1.0) / (std::fabs(theta) + std::sqrt(theta * theta + 1.0));
  const double c = 1.0 / std::sqrt(t * t + 1.0);
  const double s = t * c;
  for (int k = 0; k < 4; ++k) {
    const double kp = a(k, p);
    const double kq = a(k, q);
    a(k, p) = c * kp - s * kq;
    a(k, q) = s * kp + c * kq;
  }
  for (int k = 0; k < 4; ++k) {
    const double pk = a(p, k);
    const double qk = a(q, k);
    a(p, k) = c * pk - s * qk;
    a(q, k) = s * pk + c * qk;
    const double vp = v(k, p);
    const double vq = v(k, q);
    v(k, p) = c * vp - s * vq;
    v(k, q) = s * vp + c * vq;
  }
  return true;
}

/// Horn's symmetric matrix of the cross-covariance S(a, b) = sum from_a to_b.
Mat4 horn_matrix(const Mat3& s) {
  Mat4 n;
  n << s(0, 0) + s(1, 1) + s(2, 2), s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0),  //
      s(1, 2) - s(2, 1), s(0, 0) - s(1, 1) - s(2, 2), s(0, 1) + s(1, 0), s(2, 0) + s(0, 2),   //
      s(2, 0) - s(0, 2), s(0, 1) + s(1, 0), -s(0, 0) + s(1, 1) - s(2, 2), s(1, 2) + s(2, 1),  //
      s(0, 1) - s(1, 0), s(2, 0) + s(0, 2), s(1, 2) + s(2, 1), -s(0, 0) - s(1, 1) + s(2, 2);
  return n;
}

}  // namespace

OrientationStatus absolute_orientation(const Vec3* from, const Vec3* to, std::size_t count,
                                       Pose3& T_to_from) {
  if (count < 3) return OrientationStatus::kTooFewPoints;
  Vec3 mean_from(0.0, 0.0, 0.0);
  Vec3 mean_to(0.0, 0.0, 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    mean_from += from[i];
    mean_to += to[i];
  }
  mean_from /= static_cast<double>(count);
  mean_to /= static_cast<double>(count);
  Mat3 s = Mat3::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 a = from[i] - mean_from;
    const Vec3 b = to[i] - mean_to;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) s(r, c) += a[r] * b[c];
    }
  }
  Mat4 n = horn_matrix(s);
  const double largest = n.cwiseAbs().maxCoeff();
  if (!(largest >= kLeast_m2)) return OrientationStatus::kDegenerate;  // all points are one
  Mat4 v = Mat4::Identity();
  constexpr int kSweeps = 12;  // quadratic convergence: five are enough for a double
  bool turned = true;
  for (int sweep = 0; sweep < kSweeps && turned; ++sweep) {
    turned = false;
    for (int p = 0; p < 3; ++p) {
      for (int q = p + 1; q < 4; ++q) turned = rotate(n, v, p, q, kNothing * largest) || turned;
    }
  }
  int best = 0;
  for (int k = 1; k < 4; ++k) {
    if (n(k, k) > n(best, best)) best = k;
  }
  // Points on a line leave a second eigenvector as good as the first.
  double second = -1.0e300;
  for (int k = 0; k < 4; ++k) {
    if (k != best && n(k, k) > second) second = n(k, k);
  }
  if (!(n(best, best) - second > 1.0e-9 * std::fabs(n(best, best)))) return OrientationStatus::kDegenerate;
  T_to_from.q = Quat(v(0, best), v(1, best), v(2, best), v(3, best)).normalized();
  T_to_from.t = mean_to - T_to_from.q * mean_from;
  return OrientationStatus::kSolved;
}

}  // namespace cairn
