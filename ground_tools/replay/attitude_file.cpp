#include "replay/attitude_file.hpp"

#include <array>

#include "app/command_content.hpp"
#include "base/number_table.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

using app::ContentStatus;

const char* fault(ContentStatus status) {
  switch (status) {
    case ContentStatus::kNothing: return "has neither gravity nor heading; leave the row out";
    case ContentStatus::kUp: return "up is no unit vector; divide it by its length";
    case ContentStatus::kSigmaTilt: return "up_sigma_deg must be 0.0058 to 57";
    case ContentStatus::kSigmaYaw: return "yaw_sigma_deg must be 0.0058 to 57";
    case ContentStatus::kHeading: return "yaw_deg must be -360 to 360";
    default: return "a number is too small to have been measured";
  }
}

/// The columns of one part: all filled, or none.
template <std::size_t N>
bool read_part(const CsvTable& table, std::size_t row, const std::array<std::size_t, N>& columns,
               const std::string& place, std::array<double, N>& out) {
  std::size_t filled = 0;
  for (const std::size_t c : columns) filled += table.word(row, c).empty() ? 0U : 1U;
  if (filled == 0) return false;
  if (filled != N)
    throw ToolError("{}: a value or its sigma is missing; fill all of up, all of yaw, or none", place);
  for (std::size_t i = 0; i < N; ++i) out[i] = table.number(row, columns[i]);
  return true;
}

}  // namespace

AttitudeTable read_attitudes(const std::filesystem::path& path) {
  const CsvTable table(path);
  const std::size_t frame = table.column("frame");
  const std::array<std::size_t, 4> up = {table.column("up_x"), table.column("up_y"), table.column("up_z"),
                                         table.column("up_sigma_deg")};
  const std::array<std::size_t, 2> yaw = {table.column("yaw_deg"), table.column("yaw_sigma_deg")};
  if (table.size() == 0)
    throw ToolError("{}: has column names and no row; write what was measured, or leave it out",
                    path.string());
  AttitudeTable out;
  for (std::size_t row = 0; row < table.size(); ++row) {
    const std::string place = path.string() + ":" + std::to_string(table.line(row));
    const auto number = to_number<std::uint32_t>(table.word(row, frame));
    if (!number)
      throw ToolError("{}: frame '{}' is no number of a stereo pair", place, table.word(row, frame));
    app::Command command;
    command.type = app::CommandType::kAttitude;
    app::MeasuredAttitude& a = command.attitude;
    std::array<double, 4> of_up{};
    std::array<double, 2> of_yaw{};
    const auto given = [&](double sigma_deg) {  // 0 stands for 'not measured' in the telecommand alone
      return sigma_deg > 0.0 ? sigma_deg * kRadPerDeg : -1.0;
    };
    if (read_part(table, row, up, place, of_up)) {
      a.up_rover = {of_up[0], of_up[1], of_up[2]};
      a.sigma_tilt_rad = given(of_up[3]);
    }
    if (read_part(table, row, yaw, place, of_yaw)) {
      a.yaw_rad = of_yaw[0] * kRadPerDeg;
      a.sigma_yaw_rad = given(of_yaw[1]);
    }
    const ContentStatus status = app::judge_content(command);
    if (status != ContentStatus::kGood) throw ToolError("{}: {}", place, fault(status));
    if (!out.emplace(*number, a).second)
      throw ToolError("{}: frame {} is named twice; keep one row", place, *number);
  }
  return out;
}

}  // namespace cairn::ground
