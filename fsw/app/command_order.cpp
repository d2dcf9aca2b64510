#include "app/command_order.hpp"

namespace cairn::app {
namespace {

bool has_an_order(CommandType type) {
  return type != CommandType::kMapChunk && type != CommandType::kReportUpload;
}

}  // namespace

std::size_t CommandOrder::index(CommandType type) {
  const auto i = static_cast<std::size_t>(type);
  CAIRN_ASSERT(i <= kCommandTypeCount);
  return i;
}

CommandStatus CommandOrder::judge(const Command& command) const {
  const Accepted& last = last_[index(command.type)];
  if (!last.any || !has_an_order(command.type)) return CommandStatus::kAccepted;
  const std::uint32_t ahead = command.sequence - last.sequence;
  if (ahead == 0) return command.crc == last.crc ? CommandStatus::kRepeated : CommandStatus::kContradicts;
  return ahead < 0x80000000U ? CommandStatus::kAccepted : CommandStatus::kStale;
}

void CommandOrder::accepted(const Command& command, std::uint8_t detail) {
  if (has_an_order(command.type)) last_[index(command.type)] = {command.sequence, command.crc, detail, true};
}

}  // namespace cairn::app
