#include "app/command_content.hpp"

#include <cmath>

#include "core/subnormal.hpp"

namespace cairn::app {
namespace {

bool within(double v, const Range& range) { return v >= range.least && v <= range.most; }

ContentStatus judge_number(double v) {
  if (is_subnormal(v)) return ContentStatus::kSubnormal;
  return std::isfinite(v) ? ContentStatus::kGood : ContentStatus::kNotFinite;
}

/// The first fault of seven numbers and their length.
ContentStatus judge_pose(Pose3& pose) {
  for (const double v :
       {pose.t.x(), pose.t.y(), pose.t.z(), pose.q.w(), pose.q.x(), pose.q.y(), pose.q.z()}) {
    const ContentStatus status = judge_number(v);
    if (status != ContentStatus::kGood) return status;
  }
  const double length = std::sqrt(pose.q.squaredNorm());
  if (!(std::fabs(length - 1.0) <= kMaxLengthError)) return ContentStatus::kQuaternion;
  if (!is_valid(pose)) pose.q = pose.q.normalized();
  return ContentStatus::kGood;
}

ContentStatus judge_numbers(const Command& command) {
  for (const double v : command.number) {
    const ContentStatus status = judge_number(v);
    if (status != ContentStatus::kGood) return status;
  }
  return ContentStatus::kGood;
}

ContentStatus judge_start(Command& command) {
  ContentStatus status = judge_pose(command.pose);
  if (status == ContentStatus::kGood) status = judge_numbers(command);
  if (status != ContentStatus::kGood) return status;
  const Vec3& p_m = command.pose.t;
  if (std::fabs(p_m.x()) > kMaxStartPosition_m || std::fabs(p_m.y()) > kMaxStartPosition_m)
    return ContentStatus::kPosition;
  if (std::fabs(p_m.z()) > kMaxStartHeight_m) return ContentStatus::kHeight;
  if (!within(command.number[0], kStartSigmaXy_m)) return ContentStatus::kSigmaXy;
  return within(command.number[1], kStartSigmaYaw_rad) ? ContentStatus::kGood : ContentStatus::kSigmaYaw;
}

ContentStatus judge_trim(const Command& command) {
  const ContentStatus status = judge_numbers(command);
  if (status != ContentStatus::kGood) return status;
  if (!within(command.number[0], kTrimScale)) return ContentStatus::kScale;
  return within(command.number[1], kTrimTurn_rad_per_m) ? ContentStatus::kGood : ContentStatus::kTurn;
}

ContentStatus judge_prior(Command& command) {
  const ContentStatus status = judge_pose(command.pose);
  if (status != ContentStatus::kGood) return status;
  // Each way first: the square of a large number is none.
  for (int i = 0; i < 3; ++i) {
    if (std::fabs(command.pose.t[i]) > kMaxPriorStep_m) return ContentStatus::kStep;
  }
  if (std::sqrt(command.pose.t.squaredNorm()) > kMaxPriorStep_m) return ContentStatus::kStep;
  const Vec3 turn_rad = quat_log(command.pose.q);
  const bool small = std::sqrt(turn_rad.squaredNorm()) <= kMaxPriorRotation_rad;
  return small ? ContentStatus::kGood : ContentStatus::kRotation;
}

ContentStatus judge_attitude(const MeasuredAttitude& a) {
  for (const double v :
       {a.up_rover[0], a.up_rover[1], a.up_rover[2], a.sigma_tilt_rad, a.yaw_rad, a.sigma_yaw_rad}) {
    const ContentStatus status = judge_number(v);
    if (status != ContentStatus::kGood) return status;
  }
  const bool gravity = a.sigma_tilt_rad != 0.0;
  const bool heading = a.sigma_yaw_rad != 0.0;
  if (!gravity && !heading) return ContentStatus::kNothing;
  if (gravity && !within(a.sigma_tilt_rad, kAttitudeSigma_rad)) return ContentStatus::kSigmaTilt;
  const double length = std::sqrt(Vec3(a.up_rover[0], a.up_rover[1], a.up_rover[2]).squaredNorm());
  if (gravity && !(std::fabs(length - 1.0) <= kUpLengthError)) return ContentStatus::kUp;
  if (heading && !within(a.sigma_yaw_rad, kAttitudeSigma_rad)) return ContentStatus::kSigmaYaw;
  return heading && !within(a.yaw_rad, kHeading_rad) ? ContentStatus::kHeading : ContentStatus::kGood;
}

}  // namespace

ContentStatus judge_content(Command& command) {
  switch (command.type) {
    case CommandType::kSetStart: return judge_start(command);
    case CommandType::kSetTrim: return judge_trim(command);
    case CommandType::kMotionPrior: return judge_prior(command);
    case CommandType::kAttitude: return judge_attitude(command.attitude);
    case CommandType::kLoadMap:
    case CommandType::kBeginUpload:
    case CommandType::kMapChunk:
    case CommandType::kUseUpload:
    case CommandType::kReportUpload: break;
  }
  return ContentStatus::kGood;
}

ContentStatus judge_pair(std::uint32_t pair, std::uint32_t last_taken) {
  const std::uint32_t ahead = pair - last_taken;
  if (ahead == 0 || ahead >= 0x80000000U) return ContentStatus::kPairGone;
  return ahead <= kMaxPairsAhead ? ContentStatus::kGood : ContentStatus::kPairFar;
}

}  // namespace cairn::app
