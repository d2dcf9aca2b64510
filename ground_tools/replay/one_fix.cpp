#include "replay/one_fix.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "base/number_table.hpp"
#include "base/statistics.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

constexpr double kMostCoordinate_m = 1.0e7;  // as the flight module's searches have it

Vec2 middle_of(const LocalMap& local) {
  Vec2 sum(0.0, 0.0);
  for (const LocalBoulder& b : local) sum += b.p_site_m;
  return local.empty() ? sum : sum / static_cast<double>(local.size());
}

double farthest_from(const Vec2& p, const LocalMap& local) {
  double far = 0.0;
  for (const LocalBoulder& b : local) far = std::max(far, (b.p_site_m - p).norm());
  return far;
}

/// Axis by axis, so that a few far ones do not move it.
Vec2 median_of(const LocalMap& local) {
  std::vector<double> x;
  std::vector<double> y;
  for (const LocalBoulder& b : local) {
    x.push_back(b.p_site_m.x());
    y.push_back(b.p_site_m.y());
  }
  return {median(std::move(x)), median(std::move(y))};
}

template <typename Keep>
std::size_t keep_only(LocalMap& local, const Keep& keep) {
  LocalMap kept;
  for (const LocalBoulder& b : local) {
    if (keep(b)) static_cast<void>(kept.push_back(b));
  }
  const std::size_t left_out = local.size() - kept.size();
  local = kept;
  return left_out;
}

/// A number of a column that need not be there, between 0 (not known) and `most`.
float optional_number(const CsvTable& table, std::size_t row, std::optional<std::size_t> column,
                      const std::filesystem::path& path, const char* what, double most) {
  if (!column || table.word(row, *column).empty()) return 0.0F;
  const double value = table.number(row, *column);
  if (!(value >= 0.0 && value <= most)) {
    throw ToolError("{}:{}: {} {} is not one; give 0 to {} m, or leave it empty where it is not known",
                    path.string(), table.line(row), what, value, most);
  }
  return static_cast<float>(value);
}

/// Where the local map is looked for at headings of `sector`: within the prior's reach, or anywhere.
SearchRegion region_of(const std::optional<LocalPrior>& prior, const Sector& sector, double reach_sigmas) {
  SearchRegion region;
  if (prior) {
    region.anywhere = false;
    region.centre_map_m = prior->T_map_local.translation();
    region.radius_m = std::max(0.01, reach_sigmas * std::hypot(prior->sigma_x_m, prior->sigma_y_m));
  }
  region.half_sector_rad = std::min(0.5 * sector.width_rad, kPi);
  region.yaw_rad = wrap_angle(sector.from_rad + region.half_sector_rad);
  return region;
}

/// T_map_local from what MapFix gives of the pivot.
void take(OneFix& fix, const Pose2& T_map_local_start, const Vec2& pivot_m, const Vec2& middle_m) {
  const Vec3& offset = fix.result.offset;
  const double yaw = wrap_angle(T_map_local_start.yaw_rad + offset.z());
  const Pose2 turn{0.0, 0.0, yaw};
  const Vec2 arm = fix.result.scale * (turn * pivot_m);
  const Vec2 origin = T_map_local_start * pivot_m + offset.head<2>() - arm;
  fix.T_map_local = {origin.x(), origin.y(), yaw};
  Mat3 J = Mat3::Identity();  // of the origin by the pivot
  J(0, 2) = arm.y();
  J(1, 2) = -arm.x();
  fix.covariance = J * fix.result.covariance * J.transpose();
  const double scale_error = fix.result.scale_sigma / fix.result.scale;
  fix.covariance.topLeftCorner<2, 2>() += scale_error * scale_error * arm * arm.transpose();
  // What the yaw's error does in second order: mean square of lever (1 - cos error).
  const Vec2 lever = turn * middle_m;
  const double variance = fix.covariance(2, 2);
  fix.covariance.topLeftCorner<2, 2>() += 0.75 * variance * variance * lever * lever.transpose();
}

}  // namespace

LocalMap read_local_map(const std::filesystem::path& path) {
  const CsvTable table(path);
  const std::size_t x = table.column({"x_m", "x"});
  const std::size_t y = table.column({"y_m", "y"});
  const auto diameter = table.find({"diameter_m", "diameter", "size"});
  const auto sigma = table.find({"sigma_m", "sigma"});
  const auto height = table.find({"height_m", "height"});
  if (table.size() > cfg::kMaxLocalBoulders) {
    throw ToolError("{}: has {} boulders, and the flight module's local map holds {}; keep the surest ones",
                    path.string(), table.size(), cfg::kMaxLocalBoulders);
  }
  LocalMap local;
  for (std::size_t row = 0; row < table.size(); ++row) {
    LocalBoulder b;
    b.p_site_m = Vec2(table.number(row, x), table.number(row, y));
    if (!(b.p_site_m.cwiseAbs().maxCoeff() <= kMostCoordinate_m)) {
      throw ToolError("{}:{}: lies more than {} km from the origin; take an origin near the boulders",
                      path.string(), table.line(row), 1.0e-3 * kMostCoordinate_m);
    }
    b.diameter_m = optional_number(table, row, diameter, path, "diameter", 100.0);
    b.sigma_m = optional_number(table, row, sigma, path, "sigma", 100.0);
    static_cast<void>(optional_number(table, row, height, path, "height", 100.0));
    b.id = static_cast<std::uint32_t>(row + 1);
    b.sightings = 1;
    static_cast<void>(local.push_back(b));
  }
  if (farthest_from(middle_of(local), local) > kMostFromOrigin_m) {
    throw ToolError("{}: has boulders more than {} km from one another; are x and y metres?", path.string(),
                    1.0e-3 * kMostFromOrigin_m);
  }
  return local;
}

double farthest_from_origin(const LocalMap& local) { return farthest_from(Vec2(0.0, 0.0), local); }

LeftOut leave_out_useless(LocalMap& local) {
  LeftOut out;
  const auto sure = [](const LocalBoulder& b) { return static_cast<double>(b.sigma_m) <= kMostUseful_m; };
  out.vague = keep_only(local, sure);
  if (local.size() < 4) return out;
  const Vec2 middle_m = median_of(local);
  std::vector<double> far_m;
  for (const LocalBoulder& b : local) far_m.push_back((b.p_site_m - middle_m).norm());
  const double limit_m = kFarSpreads * median(far_m);
  const auto beyond = [&](double r) { return r > limit_m; };
  const auto strays = static_cast<std::size_t>(std::count_if(far_m.begin(), far_m.end(), beyond));
  // More of them are a place of their own.
  if (10 * strays > local.size()) return out;
  out.far = keep_only(local, [&](const LocalBoulder& b) { return !beyond((b.p_site_m - middle_m).norm()); });
  return out;
}

bool OneFix::weighed() const {
  return result.verdict.status != VerdictStatus::kNone &&
         result.verdict.status != VerdictStatus::kNoHypothesis;
}

bool OneFix::has_second() const { return weighed() && result.verdict.second_log_ratio > -1.0e3; }

OneFix fix_once(const MapFixParams& usual, const OrbitalMap& map, const LocalMap& local,
                const std::optional<LocalPrior>& prior, const std::optional<Sector>& sector) {
  MapFixParams params = usual;
  // Who gives diameters means them; on board they serve the search alone.
  if (std::any_of(local.begin(), local.end(), [](const LocalBoulder& b) { return b.diameter_m > 0.0F; }))
    params.search.evidence.size_sigma = params.lost.sigma_size;
  const auto job = std::make_unique<MapFix>();  // megabytes
  const Pose2 start = prior ? prior->T_map_local : Pose2();
  const Vec2 middle_m = middle_of(local);
  const Vec2 pivot_m = prior ? Vec2(0.0, 0.0) : middle_m;
  const double reach = params.search.reach_sigmas;
  OneFix fix;
  if (prior && !sector) {
    const Vec3 sigma(prior->sigma_x_m, prior->sigma_y_m, prior->sigma_yaw_rad);
    fix.status = job->start_tracked(params, map, local, start, pivot_m, sigma.cwiseAbs2().asDiagonal());
  } else {
    const SearchRegion region = region_of(prior, sector.value_or(Sector()), reach);
    fix.status = job->start_lost(params, map, local, start, pivot_m, region);
  }
  WorkBudget all = WorkBudget::unlimited();
  if (fix.status == MapFixStatus::kRunning) static_cast<void>(job->step(all));
  fix.status = job->status();
  fix.result = job->result();
  fix.lost = job->lost();
  fix.operations = all.spent();
  if (!fix.accepted()) return fix;
  take(fix, start, pivot_m, middle_m);
  const double turned = std::fabs(wrap_angle(fix.T_map_local.yaw_rad - start.yaw_rad));
  if (prior && turned > reach * prior->sigma_yaw_rad) fix.status = MapFixStatus::kInconsistent;
  return fix;
}

}  // namespace cairn::ground
