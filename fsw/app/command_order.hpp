/// Which telecommand is new, by sequence number, so that one that comes twice, late or
/// overtaken changes nothing.
///
/// Each type of command is judged by itself: different types act on different things, and the order in which
/// they come does not matter. Of each type the newest command that was accepted is remembered; one that was
/// refused changed nothing, and may come again when what it waited for is there.
///   same number, same content    kRepeated, with the detail of the first answer
///   same number, other content   kContradicts
///   number before it             kStale
///   number after it              new
/// 'After' is by less than half of all numbers, so that numbers may wrap. Nothing is remembered at first: the
/// first command of a type is new whatever its number.
///
/// Content is compared by the packet's CRC-32. Where two contents share it (2^-32), the second is taken for a
/// repeat, and changes nothing either.
///
/// Not judged: chunks, which have numbers of their own and may come in any order (map_transfer.hpp), and
/// requests for a report, which change nothing.
#pragma once

#include <cstdint>

#include "app/telecommand.hpp"

namespace cairn::app {

class CommandOrder {
 public:
  /// kAccepted where the command is new, else kRepeated, kContradicts or kStale.
  CommandStatus judge(const Command& command) const;
  /// The command was new and has been carried out, with this detail in the answer.
  void accepted(const Command& command, std::uint8_t detail);

  /// Of the newest command of this type that was accepted: its number, 0 where there was none, ...
  std::uint32_t newest(CommandType type) const { return last_[index(type)].sequence; }
  /// ... and the detail of its answer.
  std::uint8_t detail(CommandType type) const { return last_[index(type)].detail; }

 private:
  struct Accepted {
    std::uint32_t sequence = 0;
    std::uint32_t crc = 0;
    std::uint8_t detail = 0;
    bool any = false;
  };
  static std::size_t index(CommandType type);

  Accepted last_[kCommandTypeCount + 1];  ///< by CommandType, which begins at 1
};

}  // namespace cairn::app
