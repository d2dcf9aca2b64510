// cairn fix: one local map of boulders looked for in a map.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "base/output_file.hpp"
#include "base/tool_error.hpp"
#include "commands/cmd_map.hpp"
#include "commands/commands.hpp"
#include "commands/number_list.hpp"
#include "localizer/localizer.hpp"
#include "replay/one_fix.hpp"
#include "replay/status_names.hpp"

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

/// The command worked, and the flight module does not believe any pose: exit status 3. 1 is an error.
constexpr int kDeclined = 3;
constexpr double kMostCoordinate_m = 1.0e8;  // of a map
constexpr double kMostYaw_deg = 3600.0;      // more turns are a slip

struct FixOptions {
  fs::path map;
  fs::path boulders;
  std::string prior;
  std::string sigma;
  std::string sector;
  bool lost = false;
  bool json = false;
};

/// What the flight module found out, in one sentence.
const char* words_of(MapFixStatus status) {
  switch (status) {
    case MapFixStatus::kAccepted: return "the boulders are these of the map, and it is proved";
    case MapFixStatus::kNoMap: return "the map holds nothing to be used";
    case MapFixStatus::kNoMapBoulders: return "the map has no boulder where it was looked for them";
    case MapFixStatus::kNoLocalBoulders:
      return "the local map has too few boulders, or all of them lie in one spot";
    case MapFixStatus::kNoSearchRoom:
      return "the map has more boulders there than a search has room for; give a prior, or a better one";
    case MapFixStatus::kNoHypothesis: return "no pose agrees well enough to be weighed";
    case MapFixStatus::kInconsistent: return "what agrees is not where the prior says";
    case MapFixStatus::kTooLittleEvidence: return "unrelated boulders could agree as well by chance";
    case MapFixStatus::kAmbiguous: return "another pose agrees nearly as well";
    case MapFixStatus::kViewDisagrees: return "boulders in view agree with nothing";
    case MapFixStatus::kChanceAgreement: return "this map agrees as well at poses that are wrong";
    case MapFixStatus::kWeakGeometry: return "the boulders that agree leave the pose too uncertain";
    case MapFixStatus::kIdle:
    case MapFixStatus::kRunning:
    case MapFixStatus::kBadInput: break;
  }
  return "the input is out of range";
}

std::optional<LocalPrior> parse_prior(const FixOptions& options) {
  if (options.prior.empty()) {
    if (options.sigma.empty()) return std::nullopt;
    throw ToolError("--sigma: says how sure --prior is, and that is missing; give both, or --lost");
  }
  if (options.lost) throw ToolError("--lost: cannot be combined with --prior; leave one out");
  if (options.sigma.empty())
    throw ToolError("--prior: give --sigma SX,SY,SYAW, too: what the prior is uncertain by");
  const std::vector<double> pose = parse_numbers(
      options.prior, 3, "--prior", "give X,Y,YAW of the local frame in the map (metres, degrees)");
  const std::vector<double> sigma =
      parse_numbers(options.sigma, 3, "--sigma", "give SX,SY,SYAW: standard deviations (metres, degrees)");
  LocalPrior prior;
  for (const int k : {0, 1}) {
    check_range("--prior", pose[k], -kMostCoordinate_m, kMostCoordinate_m);
    check_range("--sigma", sigma[k], kLeastSigma_m, kMostSigma_m);
  }
  check_range("--prior", pose[2], -kMostYaw_deg, kMostYaw_deg);
  check_range("--sigma", sigma[2], kLeastSigma_rad * kDegPerRad, 180.0);
  prior.T_map_local = {pose[0], pose[1], std::remainder(pose[2], 360.0) * kRadPerDeg};
  prior.sigma_x_m = sigma[0];
  prior.sigma_y_m = sigma[1];
  prior.sigma_yaw_rad = sigma[2] * kRadPerDeg;
  return prior;
}

std::optional<Sector> parse_sector(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const std::string mend = "give A,B: headings of the local frame in the map, from A anticlockwise to B";
  const std::vector<double> v = parse_numbers(text, 2, "--sector", mend + " (degrees)");
  double width_deg = v[1] - v[0];
  if (width_deg < 0.0) width_deg += 360.0;
  if (!(width_deg * kRadPerDeg >= kLeastSector_rad && width_deg <= 360.0)) {
    throw ToolError("--sector: '{}' is {} degrees wide; {}, {:.1f} to 360 degrees wide", text, width_deg,
                    mend, std::ceil(10.0 * kLeastSector_rad * kDegPerRad) / 10.0);
  }
  return Sector{std::remainder(v[0], 360.0) * kRadPerDeg, width_deg * kRadPerDeg};
}

Json pose_json(const Pose2& p) {
  return {{"x_m", p.x_m}, {"y_m", p.y_m}, {"yaw_deg", p.yaw_rad * kDegPerRad}};
}

/// Rows and columns x, y, yaw; metres and degrees.
Json covariance_json(const Mat3& covariance) {
  const Vec3 unit(1.0, 1.0, kDegPerRad);
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) {
    Json row = Json::array();
    for (int k = 0; k < 3; ++k) row.push_back(covariance(i, k) * unit[i] * unit[k]);
    rows.push_back(row);
  }
  return rows;
}

Json input_json(const FixOptions& options, const LocalMap& local, const std::optional<LocalPrior>& prior,
                const std::optional<Sector>& sector) {
  Json json{{"map", options.map.string()},    {"boulders", options.boulders.string()},
            {"local_boulders", local.size()}, {"prior", nullptr},
            {"prior_sigma", nullptr},         {"sector_deg", nullptr}};
  if (prior) {
    json["prior"] = pose_json(prior->T_map_local);
    json["prior_sigma"] = pose_json({prior->sigma_x_m, prior->sigma_y_m, prior->sigma_yaw_rad});
  }
  if (sector) {
    const double from = sector->from_rad * kDegPerRad;
    json["sector_deg"] = {from, from + sector->width_rad * kDegPerRad};
  }
  return json;
}

/// By more than three sigmas.
bool scale_differs(const MapFixResult& r) { return std::fabs(r.scale - 1.0) > 3.0 * r.scale_sigma; }

Json fix_json(Json json, const OneFix& fix, double needed) {
  const MapFixResult& r = fix.result;
  const auto where = [](bool known, const Json& value) { return known ? value : Json(); };
  json["accepted"] = fix.accepted();
  json["status"] = map_fix_status_name(static_cast<std::uint8_t>(fix.status));
  json["verdict"] = words_of(fix.status);
  json["whole_search"] = fix.lost;
  const Mat3& c = fix.covariance;
  json["pose"] = where(fix.accepted(), pose_json(fix.T_map_local));
  json["sigma"] =
      where(fix.accepted(), pose_json({std::sqrt(c(0, 0)), std::sqrt(c(1, 1)), std::sqrt(c(2, 2))}));
  json["covariance"] = where(fix.accepted(), covariance_json(c));
  json["pairs"] = where(fix.weighed(), r.pairs);
  json["rms_m"] = where(fix.weighed(), r.rms_m);
  json["scale"] = where(fix.weighed() && r.scale_sigma > 0.0, r.scale);
  json["scale_sigma"] = where(fix.weighed() && r.scale_sigma > 0.0, r.scale_sigma);
  json["log_ratio"] = where(fix.weighed(), r.verdict.log_ratio);
  json["log_ratio_needed"] = needed;
  json["second_log_ratio"] = where(fix.has_second(), r.verdict.second_log_ratio);
  json["chance_log"] = where(fix.weighed() && r.verdict.chance_log < 1.0e3, r.verdict.chance_log);
  json["map_boulders"] = r.map_boulders;
  json["hypotheses"] = r.hypotheses;
  json["operations"] = fix.operations;
  return json;
}

void print_fix(const OneFix& fix, std::size_t local_boulders, double needed) {
  const MapFixResult& r = fix.result;
  fmt::print("{} ({}): {}\n", fix.accepted() ? "accepted" : "declined",
             map_fix_status_name(static_cast<std::uint8_t>(fix.status)), words_of(fix.status));
  if (fix.accepted()) {
    const Mat3& c = fix.covariance;
    const Vec3 sigma = c.diagonal().cwiseSqrt();
    fmt::print("pose         x {:.4f} m, y {:.4f} m, yaw {:.4f} degrees (of the local frame in the map)\n",
               fix.T_map_local.x_m, fix.T_map_local.y_m, fix.T_map_local.yaw_rad * kDegPerRad);
    fmt::print("sigma        x {:.4f} m, y {:.4f} m, yaw {:.4f} degrees\n", sigma.x(), sigma.y(),
               sigma.z() * kDegPerRad);
    fmt::print("correlation  x, y {:+.3f}; x, yaw {:+.3f}; y, yaw {:+.3f}\n",
               c(0, 1) / (sigma.x() * sigma.y()), c(0, 2) / (sigma.x() * sigma.z()),
               c(1, 2) / (sigma.y() * sigma.z()));
  }
  if (fix.weighed()) {
    fmt::print("pairs        {:.1f} of {} boulders, {:.3f} m apart (rms)\n", r.pairs, local_boulders,
               r.rms_m);
    if (r.scale_sigma > 0.0)
      fmt::print("scale        {:.4f} +- {:.4f}: lengths of the map over those of the boulders{}\n", r.scale,
                 r.scale_sigma, scale_differs(r) ? "; the map's metre is not a metre" : "");
    fmt::print("log ratio    {:.1f} nats for 'same ground' against 'chance'; {:.1f} are asked for\n",
               r.verdict.log_ratio, needed);
    fmt::print("second best  {}\n", fix.has_second() ? fmt::format("{:.1f} nats", r.verdict.second_log_ratio)
                                                     : std::string("none"));
  }
  fmt::print("looked at    {} poses over {} boulders of the map, {}; {} operations\n", r.hypotheses,
             r.map_boulders, fix.lost ? "as when lost" : "near the prior", fix.operations);
}

void say(const std::filesystem::path& boulders, const LeftOut& out) {
  const auto warn = [&](std::size_t n, const std::string& why) {
    if (n == 0) return;
    fmt::print(stderr, "cairn: warning: {}: {} boulder{} left out; check {}\n", boulders.string(), n,
               n == 1 ? " is" : "s are", why);
  };
  warn(out.far, "coordinates: the others lie close together, far from there");
  warn(out.vague, fmt::format("sigma: a place known to {} m or worse proves nothing", kMostUseful_m));
}

void fix(const FixOptions& options) {
  const std::optional<LocalPrior> prior = parse_prior(options);
  const std::optional<Sector> sector = parse_sector(options.sector);
  const std::vector<std::uint8_t> bytes = read_file(options.map);
  OrbitalMap map;
  const MapStatus status = validate_cmap(bytes, &map);
  if (status != MapStatus::kUsable) throw ToolError("{}: {}", options.map.string(), explain(status));
  LocalMap local = read_local_map(options.boulders);
  say(options.boulders, leave_out_useless(local));
  if (prior && farthest_from_origin(local) > kMostFromOrigin_m) {
    throw ToolError(
        "{}: lies more than {} km from the origin of its frame, which --prior speaks of; take one "
        "near the boulders",
        options.boulders.string(), 1.0e-3 * kMostFromOrigin_m);
  }
  const MapFixParams params = LocalizerParams().map_fix;
  const OneFix made = fix_once(params, map, local, prior, sector);
  if (made.status == MapFixStatus::kBadInput) {
    throw ToolError("{}: cannot be searched with these numbers; check its frame, --prior and --sigma",
                    options.boulders.string());
  }
  const double needed = params.search.verdict.ln_threshold - params.search.verdict.calibration;
  if (options.json) {
    print_json(fix_json(input_json(options, local, prior, sector), made, needed));
  } else {
    print_fix(made, local.size(), needed);
  }
  if (!made.accepted()) throw Answer{kDeclined};
}

}  // namespace

void add_fix_command(Command app) {
  const auto options = std::make_shared<FixOptions>();
  Command command = app.add_command("fix",
                                    "Look for one local map of boulders in a map, with the flight module's "
                                    "search and verdict; exit status 0: accepted, 3: declined");
  command.add_option("MAP", options->map, "map (.cmap)").required();
  command
      .add_option(
          "--boulders", options->boulders,
          "the local map: CSV with columns x, y and, where known, diameter, height, sigma; metres, in "
          "any frame of its own")
      .required();
  command.add_option("--prior", options->prior,
                     "where the local frame is thought to lie in the map: X,Y,YAW (metres, degrees)");
  command.add_option("--sigma", options->sigma,
                     "what the prior is uncertain by: SX,SY,SYAW (metres, degrees)");
  command.add_flag("--lost", options->lost, "no prior: anywhere in the map (so without --prior)");
  command.add_option("--sector", options->sector,
                     "headings that are possible: A,B, from A anticlockwise to B (degrees)");
  command.add_flag("--json", options->json, "print one JSON object");
  command.on_run([options] { fix(*options); });
}

}  // namespace cairn::ground
