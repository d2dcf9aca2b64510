// How alike are two data sets to an odometry that is not ours? OpenCV's SIFT, matched between left and right
// and from frame to frame, motion by RANSAC PnP and refinement. With it, the grey levels and the contrast of
// the left images.
//
//   sift_vo DATASET...        prints a line for each; `make realism` calls it
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "dataset/dataset.hpp"
#include "dataset/trajectory.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

struct Seen {
  std::vector<cv::KeyPoint> points;
  cv::Mat descriptors;
  std::vector<cv::Point3d> p_cam_m;  ///< z = 0: no stereo match
};

cv::Mat as_mat(const Image& image) {
  return cv::Mat(image.height, image.width, CV_8U, const_cast<std::uint8_t*>(image.pixels.data())).clone();
}

/// Best match within a gate, where it beats the second by Lowe's ratio; -1: none.
template <typename Gate>
int best_match(const cv::Mat& descriptor, const Seen& in, const Gate& gate) {
  double first = 1e300;
  double second = 1e300;
  int best = -1;
  for (int j = 0; j < in.descriptors.rows; ++j) {
    if (!gate(in.points[static_cast<std::size_t>(j)].pt)) continue;
    const double d = cv::norm(descriptor, in.descriptors.row(j), cv::NORM_L2SQR);
    if (d < first) {
      second = first;
      first = d;
      best = j;
    } else {
      second = std::min(second, d);
    }
  }
  return first < 0.64 * second ? best : -1;
}

Seen see(cv::SIFT& sift, const StereoRig& rig, const PairImages& pair) {
  Seen left;
  Seen right;
  sift.detectAndCompute(as_mat(pair.left), cv::noArray(), left.points, left.descriptors);
  sift.detectAndCompute(as_mat(pair.right), cv::noArray(), right.points, right.descriptors);
  left.p_cam_m.resize(left.points.size());
  for (std::size_t i = 0; i < left.points.size(); ++i) {
    const cv::Point2f p = left.points[i].pt;
    const int j = best_match(left.descriptors.row(static_cast<int>(i)), right, [&](const cv::Point2f& q) {
      return std::fabs(q.y - p.y) < 1.5F && p.x - q.x > 3.0F && p.x - q.x < 160.0F;
    });
    if (j < 0) continue;
    const double d = static_cast<double>(p.x - right.points[static_cast<std::size_t>(j)].pt.x);
    const double z = rig.fx_px * rig.baseline_m / d;
    left.p_cam_m[i] = {(static_cast<double>(p.x) - rig.cx_px) / rig.fx_px * z,
                       (static_cast<double>(p.y) - rig.cy_px) / rig.fy_px * z, z};
  }
  return left;
}

/// T_before_now.
Pose3 motion(const StereoRig& rig, const Seen& before, const Seen& now) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (std::size_t i = 0; i < before.points.size(); ++i) {
    if (before.p_cam_m[i].z <= 0.0) continue;
    const cv::Point2f p = before.points[i].pt;
    const int j = best_match(before.descriptors.row(static_cast<int>(i)), now, [&](const cv::Point2f& q) {
      return std::fabs(q.x - p.x) < 60.0F && std::fabs(q.y - p.y) < 60.0F;
    });
    if (j < 0) continue;
    points.push_back(before.p_cam_m[i]);
    pixels.emplace_back(now.points[static_cast<std::size_t>(j)].pt);
  }
  const cv::Matx33d K(rig.fx_px, 0, rig.cx_px, 0, rig.fy_px, rig.cy_px, 0, 0, 1);
  cv::Vec3d turn(0, 0, 0);
  cv::Vec3d shift(0, 0, 0);
  std::vector<int> inliers;
  if (points.size() < 8 ||
      !cv::solvePnPRansac(points, pixels, K, cv::noArray(), turn, shift, false, 300, 1.0F, 0.999, inliers))
    return Pose3();
  std::vector<cv::Point3d> good_points;
  std::vector<cv::Point2d> good_pixels;
  for (const int i : inliers) {
    good_points.push_back(points[static_cast<std::size_t>(i)]);
    good_pixels.push_back(pixels[static_cast<std::size_t>(i)]);
  }
  cv::solvePnPRefineLM(good_points, good_pixels, K, cv::noArray(), turn, shift);
  cv::Matx33d R;
  cv::Rodrigues(turn, R);
  Mat3 rotation;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) rotation(r, c) = R(r, c);
  const Pose3 T_now_before{Quat(rotation), Vec3(shift[0], shift[1], shift[2])};
  return T_now_before.inverse();
}

struct Greys {
  std::array<double, 256> counts{};
  double gradient = 0.0;
  double pixels = 0.0;

  void add(const cv::Mat& image) {
    for (int v = 0; v + 1 < image.rows; ++v) {
      for (int u = 0; u + 1 < image.cols; ++u) {
        const int here = image.at<std::uint8_t>(v, u);
        counts[static_cast<std::size_t>(here)] += 1.0;
        gradient += std::abs(image.at<std::uint8_t>(v, u + 1) - here) +
                    std::abs(image.at<std::uint8_t>(v + 1, u) - here);
        pixels += 1.0;
      }
    }
  }
  int at(double share) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      sum += counts[i];
      if (sum >= share * pixels) return static_cast<int>(i);
    }
    return 255;
  }
  double deviation() const {
    double sum = 0.0;
    double squares = 0.0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      sum += static_cast<double>(i) * counts[i];
      squares += static_cast<double>(i * i) * counts[i];
    }
    return std::sqrt(squares / pixels - sum * sum / (pixels * pixels));
  }
};

void judge(const char* folder) {
  const Dataset data = Dataset::open(folder);
  const StereoRig rig = data.rig();
  const cv::Ptr<cv::SIFT> sift = cv::SIFT::create(1000);
  Trajectory vo;
  Trajectory truth;
  Greys greys;
  Seen before;
  Pose3 T = *data.truth_cam(0);
  for (std::size_t i = 0; i < data.size(); ++i) {
    const PairImages pair = data.images(i);
    if (i % 20 == 0) greys.add(as_mat(pair.left));
    Seen now = see(*sift, rig, pair);
    if (i > 0) T = T * motion(rig, before, now);
    before = std::move(now);
    vo.push_back({static_cast<double>(i), T});
    truth.push_back({static_cast<double>(i), *data.truth_cam(i)});
  }
  const auto errors = compare(vo, truth);
  fmt::print(
      "{:<36} {:>4} frames {:6.2f} m  drift {:.2f} % {:.2f} deg  grey 1/25/50/75/99 %: {} {} {} {} {}  "
      "deviation {:.1f}  gradient {:.2f}\n",
      folder, data.size(), errors->path_m, errors->percent_of_path(errors->end.xyz_m),
      errors->end.rotation_deg, greys.at(0.01), greys.at(0.25), greys.at(0.5), greys.at(0.75), greys.at(0.99),
      greys.deviation(), greys.gradient / (2.0 * greys.pixels));
}

}  // namespace

int main(int argc, char** argv) {
  try {
    for (int i = 1; i < argc; ++i) judge(argv[i]);
  } catch (const std::exception& error) {
    fmt::print(stderr, "sift_vo: {}\n", error.what());
    return 1;
  }
  return 0;
}
