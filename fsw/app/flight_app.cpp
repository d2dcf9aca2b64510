#include "app/flight_app.hpp"

#include "hal/camera.hpp"
#include "hal/link.hpp"
#include "hal/nvm.hpp"
#include "hal/watchdog.hpp"

namespace cairn::app {

StereoRig mission_rig() {
  StereoRig rig;
  rig.width_px = cfg::kMission.image_width_px;
  rig.height_px = cfg::kMission.image_height_px;
  rig.fx_px = cfg::kMission.fx_px;
  rig.fy_px = cfg::kMission.fy_px;
  rig.cx_px = cfg::kMission.cx_px;
  rig.cy_px = cfg::kMission.cy_px;
  rig.baseline_m = cfg::kMission.baseline_m;
  rig.T_rover_cam =
      mast_pose(cfg::kMission.camera_height_m, cfg::kMission.camera_pitch_down_rad, rig.baseline_m);
  return rig;
}

namespace {

/// Goes on with what is no row of the schedule, in its share of the slice: an operation of it weighs more.
template <typename Job>
Progress go_on(Job& job, std::uint32_t weight, WorkBudget& slice) {
  WorkBudget share(slice.left() < weight ? 1U : slice.left() / weight);
  const Progress progress = job.step(share);
  slice.charge(share.spent() * weight);
  return progress;
}

/// As it was made. On a frame of its own, which is given back before anything deeper is called.
template <typename T>
[[gnu::noinline]] void clear(T& out) {
  out = T();
}

}  // namespace

LocalizerStatus FlightApp::init(const LocalizerParams& params, const StereoRig& rig, const RawPairs* raw) {
  executive_.init();
  clear(validation_);
  clear(transfer_);
  map_status_ = MapStatus::kIdle;
  order_ = CommandOrder();
  validating_ = any_pair_ = false;
  pair_number_ = sequence_ = bad_priors_ = bad_attitudes_ = lost_packets_ = missed_pairs_ = 0;
  priors_.init();
  attitudes_.init();
  pairs_.init();
  pair_counts_ = {};
  commands_ = {};
  pair_time_us_ = 0;
  localizer_.set_map(OrbitalMap());
  const LocalizerStatus untrimmed = localizer_.set_trim(StepTrim());
  CAIRN_ASSERT(untrimmed == LocalizerStatus::kReady);
  const bool fits = rectifier_.init(raw, rig);
  return localizer_.init(params, fits ? rig : StereoRig());  // no raw pair is flown as if it were rectified
}

FlightApp::State FlightApp::cycle(std::uint32_t slice_ops) {
  hal::watchdog_kick();
  WorkBudget slice(slice_ops);
  if (executive_.busy()) {
    if (executive_.run(localizer_, slice) == Progress::kDone) end_minor();
    return State::kBusy;
  }
  const bool busy =
      rectify_pair(slice) || take_command() || validate_map(slice) || verify_upload(slice) || take_pair();
  return busy ? State::kBusy : State::kIdle;
}

bool FlightApp::take_command() {
  std::uint8_t bytes[kMaxPacketBytes];
  const std::size_t size = hal::telecommand_receive(bytes, sizeof bytes);
  if (size == 0) return false;
  Command command;
  AckReport ack;
  const CommandStatus decoded = decode(bytes, size, command);
  const bool known = decoded == CommandStatus::kAccepted;
  CommandStatus status = known ? order_.judge(command) : decoded;
  if (status == CommandStatus::kAccepted) {
    status = carry_out(command, ack.detail);
    if (status == CommandStatus::kAccepted) order_.accepted(command, ack.detail);
  } else if (status == CommandStatus::kRepeated) {
    ack.detail = order_.detail(command.type);
  }
  ++commands_[static_cast<std::size_t>(status)];
  if (status != CommandStatus::kBadPacket) {  // of a bad packet no field is believed
    ack.command_sequence = command.sequence;
    ack.command_type = static_cast<std::uint8_t>(command.type);
  }
  if (known) ack.newest = order_.newest(command.type);
  ack.status = static_cast<std::uint8_t>(status);
  send(ack);
  return true;
}

CommandStatus FlightApp::carry_out(Command& command, std::uint8_t& detail) {
  switch (command.type) {
    case CommandType::kSetStart: return set_start(command, detail);
    case CommandType::kSetTrim: return set_trim(command, detail);
    case CommandType::kMotionPrior: return take_prior(command, detail);
    case CommandType::kAttitude: return take_attitude(command, detail);
    case CommandType::kLoadMap: return load_map(detail);
    case CommandType::kBeginUpload: return begin_upload(command.upload, detail);
    case CommandType::kMapChunk: return take_chunk(command, detail);
    case CommandType::kUseUpload: return use_upload(command.upload.id, detail);
    case CommandType::kReportUpload: report_upload(); break;
  }
  return CommandStatus::kAccepted;
}

CommandStatus FlightApp::set_start(Command& command, std::uint8_t& detail) {
  const ContentStatus content = judge_content(command);
  detail = static_cast<std::uint8_t>(content);
  if (content != ContentStatus::kGood) return CommandStatus::kRefused;
  const LocalizerStatus set = localizer_.set_start(command.pose, command.number[0], command.number[1]);
  CAIRN_ASSERT(set == LocalizerStatus::kReady);  // judge_content asks for more
  executive_.restart();
  return CommandStatus::kAccepted;
}

CommandStatus FlightApp::set_trim(Command& command, std::uint8_t& detail) {
  const ContentStatus content = judge_content(command);
  detail = static_cast<std::uint8_t>(content);
  if (content != ContentStatus::kGood) return CommandStatus::kRefused;
  const LocalizerStatus set = localizer_.set_trim({command.number[0], command.number[1]});
  CAIRN_ASSERT(set == LocalizerStatus::kReady);
  return CommandStatus::kAccepted;
}

/// What is for a pair to come.
CommandStatus FlightApp::judge_for_pair(Command& command, std::uint8_t& detail) const {
  ContentStatus content = judge_content(command);
  if (content == ContentStatus::kGood && any_pair_) content = judge_pair(command.pair, pair_number_);
  detail = static_cast<std::uint8_t>(content);
  if (content == ContentStatus::kGood) return CommandStatus::kAccepted;
  return content == ContentStatus::kPairGone ? CommandStatus::kStale : CommandStatus::kRefused;
}

CommandStatus FlightApp::take_prior(Command& command, std::uint8_t& detail) {
  const CommandStatus status = judge_for_pair(command, detail);
  if (status == CommandStatus::kAccepted) {
    priors_.put(command.pair, command.pose);
  } else {
    ++bad_priors_;
  }
  return status;
}

CommandStatus FlightApp::take_attitude(Command& command, std::uint8_t& detail) {
  const CommandStatus status = judge_for_pair(command, detail);
  if (status == CommandStatus::kAccepted) {
    attitudes_.put(command.pair, command.attitude);
  } else {
    ++bad_attitudes_;
  }
  return status;
}

CommandStatus FlightApp::load_map(std::uint8_t& detail) {
  const hal::Bytes bank = hal::map_bank();
  const MapStatus map = validation_.start(bank.data, bank.size);
  validating_ = true;  // where it was refused at once, the first step is its end, and health tells of it
  map_status_ = map;
  detail = static_cast<std::uint8_t>(map);
  return map == MapStatus::kChecking ? CommandStatus::kAccepted : CommandStatus::kRefused;
}

CommandStatus FlightApp::begin_upload(const UploadPlan& plan, std::uint8_t& detail) {
  const hal::Room bank = hal::spare_map_bank();
  const BeginStatus status = transfer_.begin(plan, bank.data, bank.size);
  detail = static_cast<std::uint8_t>(status);
  report_upload();
  const bool good = status == BeginStatus::kBegun || status == BeginStatus::kUnderWay;
  return good ? CommandStatus::kAccepted : CommandStatus::kRefused;
}

CommandStatus FlightApp::take_chunk(const Command& command, std::uint8_t& detail) {
  const ChunkStatus status = transfer_.accept(command.chunk, command.chunk_bytes);
  detail = static_cast<std::uint8_t>(status);
  const bool good = status == ChunkStatus::kTaken || status == ChunkStatus::kRepeated;
  return good ? CommandStatus::kAccepted : CommandStatus::kRefused;
}

/// The map was validated where it lies, so that there is no moment without one.
CommandStatus FlightApp::use_upload(std::uint32_t id, std::uint8_t& detail) {
  const bool ready = transfer_.status() == TransferStatus::kReady && transfer_.record().plan.id == id;
  const bool switched = ready && hal::switch_map_banks();
  if (switched) {
    validating_ = false;  // of the bank that is no longer the one in use
    localizer_.set_map(transfer_.result());
    map_status_ = MapStatus::kUsable;
    transfer_.leave();
    report_upload();
    report_health();
  }
  detail = static_cast<std::uint8_t>(transfer_.status());
  return switched ? CommandStatus::kAccepted : CommandStatus::kRefused;
}

/// Begins as soon as the last chunk is there.
bool FlightApp::verify_upload(WorkBudget& slice) {
  if (transfer_.status() == TransferStatus::kComplete) {
    const hal::Bytes base = hal::map_bank();
    static_cast<void>(transfer_.verify(base.data, base.size));
    report_upload();
  }
  if (transfer_.status() != TransferStatus::kVerifying) return false;
  if (go_on(transfer_, cfg::kMapWeight, slice) == Progress::kDone) report_upload();
  return true;
}

bool FlightApp::validate_map(WorkBudget& slice) {
  if (!validating_) return false;
  if (go_on(validation_, cfg::kMapWeight, slice) == Progress::kDone) {
    validating_ = false;
    map_status_ = validation_.status();
    const hal::Bytes bank = hal::map_bank();
    const bool stays = !may_be_used(map_status_) && localizer_.map().still_in(bank.data, bank.size);
    if (!stays) localizer_.set_map(validation_.result());
    report_health();  // tells the map's status
  }
  return true;
}

bool FlightApp::take_pair() {
  hal::StereoInfo info;
  if (localizer_.vo_open()) {
    // VO still reads the images: the new pair goes nowhere, and the minor frame is spent on the old one.
    if (!hal::camera_take({nullptr, nullptr, 0}, info)) return false;
    (void)executive_.begin_minor(localizer_, ImageU8(), ImageU8(), nullptr);
    return true;
  }
  const RawPairs* const raw = rectifier_.needed() ? &rectifier_.raw() : nullptr;
  const hal::StereoBuffer buffer = raw == nullptr
                                       ? hal::StereoBuffer{left_, right_, sizeof left_}
                                       : hal::StereoBuffer{raw->left, raw->right,
                                                           static_cast<std::size_t>(raw->width_px) *
                                                               static_cast<std::size_t>(raw->height_px)};
  if (!hal::camera_take(buffer, info)) return false;
  const auto view = [](const std::uint8_t* data, int width, int height) {
    const bool fits = width > 0 && height > 0 && width <= cfg::kImageWidth && height <= cfg::kImageHeight;
    return fits ? packed_view(data, width, height) : ImageU8();
  };
  const PairStatus order = pairs_.judge(info.number, info.t_capture_us);
  ++pair_counts_[static_cast<std::size_t>(order)];
  if (!to_be_used(order)) return true;
  if (order == PairStatus::kRenumbered) {
    priors_.let_go_all();
    attitudes_.let_go_all();
  }
  miss_pairs(info.number);
  any_pair_ = true;
  pair_number_ = info.number;
  pair_time_us_ = info.t_capture_us;
  if (raw == nullptr) {
    begin_pair(view(left_, info.left_width, info.left_height),
               view(right_, info.right_width, info.right_height));
  } else {
    rectifier_.start(info.left_width, info.left_height, info.right_width, info.right_height, left_, right_);
  }
  return true;
}

bool FlightApp::rectify_pair(WorkBudget& slice) {
  if (!rectifier_.busy()) return false;
  if (go_on(rectifier_, cfg::kRawPairWeight, slice) == Progress::kDone)
    begin_pair(rectifier_.left(), rectifier_.right());
  return true;
}

void FlightApp::begin_pair(const ImageU8& left, const ImageU8& right) {
  const LocalizerStatus status = executive_.begin_minor(localizer_, left, right, priors_.of(pair_number_));
  priors_.let_go(pair_number_);
  if (status != LocalizerStatus::kReady) end_minor();  // no start pose: the report says so, and nothing moves
}

void FlightApp::miss_pairs(std::uint32_t number) {
  constexpr std::uint32_t kMostPriors = MotionPriors::kRoom;
  const std::uint32_t missed = pairs_.missed();
  const std::uint32_t last_few = missed < kMostPriors ? missed : kMostPriors;
  missed_pairs_ += missed;
  localizer_.miss(missed - last_few, nullptr);
  for (std::uint32_t i = last_few; i > 0; --i) localizer_.miss(1, priors_.of(number - i));
}

/// An attitude is taken after all else, so that the result is the same however the work is sliced. Where VO
/// goes on in the next minor frame it waits with the pair.
void FlightApp::end_minor() {
  if (!localizer_.vo_open()) {
    if (const MeasuredAttitude* a = attitudes_.of(pair_number_)) {
      // What becomes of them is in the localizer's counts and in the report.
      if (a->sigma_tilt_rad > 0.0)
        (void)localizer_.take_gravity(Vec3(a->up_rover[0], a->up_rover[1], a->up_rover[2]),
                                      a->sigma_tilt_rad);
      if (a->sigma_yaw_rad > 0.0) (void)localizer_.take_heading(a->yaw_rad, a->sigma_yaw_rad);
    }
    attitudes_.let_go(pair_number_);
  }
  report_minor();
}

void FlightApp::report_minor() {
  const VoResult& vo = localizer_.vo().result();
  const ObserveCounts& seen = localizer_.observer().counts();
  FrameReport r;
  r.number = pair_number_;
  r.t_capture_us = pair_time_us_;
  r.pair_status = static_cast<std::uint8_t>(pairs_.status());
  r.missed_pairs = static_cast<std::uint16_t>(pairs_.missed() < UINT16_MAX ? pairs_.missed() : UINT16_MAX);
  r.pose_source = static_cast<std::uint8_t>(localizer_.pose_source());
  r.vo_status = static_cast<std::uint8_t>(localizer_.vo().status());
  r.boulder_status = static_cast<std::uint8_t>(localizer_.observer().status());
  r.watch = static_cast<std::uint8_t>(localizer_.watch());
  r.trust = static_cast<std::uint8_t>(localizer_.trust());
  r.gravity = static_cast<std::uint8_t>(localizer_.gravity_status());
  r.heading = static_cast<std::uint8_t>(localizer_.heading_status());
  r.T_map_cam_vo = localizer_.vo_T_map_cam();
  r.T_map_cam = localizer_.T_map_cam();
  r.sigma_xy_m = static_cast<float>(localizer_.fusion().sigma_xy_m());
  r.sigma_yaw_rad = static_cast<float>(localizer_.fusion().sigma_yaw_rad());
  r.sigma_tilt_rad = static_cast<float>(localizer_.tilt().sigma_tilt_rad());
  r.sigma_z_m = static_cast<float>(localizer_.tilt().sigma_z_m());
  r.features_left = static_cast<std::uint16_t>(vo.features_left);
  r.features_right = static_cast<std::uint16_t>(vo.features_right);
  r.stereo = static_cast<std::uint16_t>(vo.stereo);
  r.matches = static_cast<std::uint16_t>(vo.matches);
  r.own_points = static_cast<std::uint16_t>(vo.own_points);
  r.inliers = static_cast<std::uint16_t>(vo.inliers);
  r.rms_px = static_cast<float>(vo.rms_px);
  r.regions = static_cast<std::uint16_t>(seen.regions);
  r.evident_regions = static_cast<std::uint16_t>(seen.evident);
  r.boulders = static_cast<std::uint16_t>(localizer_.observer().result().size());
  r.boulders_matched = static_cast<std::uint16_t>(seen.matched);
  r.scale = static_cast<float>(localizer_.fusion().scale());
  r.turn_rad_per_m = static_cast<float>(localizer_.fusion().turn_rad_per_m());
  const MinorWork& work = executive_.work();
  r.vo_ops = work.ops[static_cast<int>(cfg::Task::kVo)];
  r.boulder_ops = work.ops[static_cast<int>(cfg::Task::kBoulders)];
  r.fix_ops = work.ops[static_cast<int>(cfg::Task::kFix)];
  send(r);
  if (executive_.fix_closed()) report_fix();
  if (localizer_.health().frames > 0 && executive_.minor() == cfg::kMinorFrames - 1) report_health();
}

void FlightApp::report_fix() {
  const FixRecord& fix = localizer_.last_fix();
  FixReport r;
  r.number = pair_number_;
  r.status = static_cast<std::uint8_t>(fix.status);
  r.map_window_full = fix.map_window_full ? 1 : 0;
  r.dx_m = fix.correction.x_m;
  r.dy_m = fix.correction.y_m;
  r.dyaw_rad = fix.correction.yaw_rad;
  r.scale = fix.scale;
  r.rms_m = static_cast<float>(fix.rms_m);
  r.sigma_xy_m = static_cast<float>(fix.sigma_xy_m);
  r.sigma_yaw_rad = static_cast<float>(fix.sigma_yaw_rad);
  r.local_boulders = fix.local_boulders;
  r.map_boulders = fix.map_boulders;
  r.pairs = fix.pairs;
  r.trimmed = fix.trimmed;
  r.gated = fix.gated;
  r.iterations = fix.iterations;
  r.snapshot = fix.frame;
  r.lost = fix.lost ? 1 : 0;
  r.chi2 = static_cast<float>(fix.chi2);
  r.log_ratio = static_cast<float>(fix.log_ratio);
  r.second_log_ratio = static_cast<float>(fix.second_log_ratio);
  r.chance_log = static_cast<float>(fix.chance_log);
  r.hypotheses = fix.hypotheses;
  r.windows = fix.windows;
  r.windows_log_ratio = static_cast<float>(fix.windows_log_ratio);
  send(r);
  for (const LocalBoulder& b : localizer_.local_map()) {
    const Vec2 p_map_m = localizer_.T_map_site() * b.p_site_m;
    send(BoulderReport{b.id, p_map_m.x(), p_map_m.y(), b.z_site_m, b.diameter_m, b.spread_m, b.sightings});
  }
}

void FlightApp::report_health() {
  const LocalizerHealth& health = localizer_.health();
  HealthReport r;
  r.frames = health.frames;
  r.vo = health.vo;
  r.watch = health.watch;
  r.boulders = health.boulders;
  r.fixes = health.fixes;
  r.gravity = health.gravity;
  r.headings = health.headings;
  r.overruns = executive_.counts().overruns;
  r.extrapolated = health.extrapolated;
  r.abandoned_boulders = health.abandoned_boulders;
  r.dropped_tracks = health.dropped_tracks;
  r.dropped_pairs = executive_.counts().dropped_pairs;
  r.pairs = pair_counts_;
  r.missed_pairs = missed_pairs_;
  r.bad_priors = health.bad_priors + bad_priors_ + priors_.unused();
  r.bad_attitudes = bad_attitudes_ + attitudes_.unused();
  r.commands = commands_;
  r.lost_packets = lost_packets_;
  r.map_status = static_cast<std::uint8_t>(map_status_);
  r.map_crc = localizer_.map().head_crc();
  r.halved = health.halved;
  const ImageOffset offset = localizer_.vo().offset();
  r.rows_px = static_cast<float>(offset.rows_px);
  r.columns_px = static_cast<float>(offset.columns_px);
  r.lens = static_cast<float>(offset.lens);
  const RectificationEstimator::Angles& angles = localizer_.vo().rectification().angles();
  r.turn_x_rad = static_cast<float>(angles[0]);
  r.turn_z_rad = static_cast<float>(angles[1]);
  r.baseline_y_rad = static_cast<float>(angles[2]);
  r.baseline_z_rad = static_cast<float>(angles[3]);
  r.heights = health.heights;
  send(r);
}

void FlightApp::report_upload() {
  const TransferRecord& record = transfer_.record();
  UploadReport r;
  r.status = static_cast<std::uint8_t>(record.status);
  r.detail = record.detail;
  r.kind = record.plan.kind;
  r.id = record.plan.id;
  r.bytes = record.plan.bytes;
  r.chunk_bytes = record.plan.chunk_bytes;
  r.chunks = record.chunks;
  r.taken = record.taken;
  const std::uint32_t first = transfer_.first_missing();
  r.first_missing = static_cast<std::uint16_t>(first);
  r.counts = record.counts;
  for (std::uint32_t n = 0; n < 8 * sizeof r.missing && first + n < record.chunks; ++n) {
    if (!transfer_.has(first + n))
      r.missing[n / 8] = static_cast<std::uint8_t>(r.missing[n / 8] | 0x80U >> n % 8);
  }
  send(r);
}

template <typename Report>
void FlightApp::send(const Report& report) {
  encode(report, sequence_++, packet_);
  if (!hal::telemetry_send(packet_.data(), packet_.size())) ++lost_packets_;
}

}  // namespace cairn::app
