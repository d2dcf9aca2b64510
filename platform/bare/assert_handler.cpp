// A failed flight assertion on a bare board: says where, then ends. A mission puts its safe state here.
#include "core/assert.hpp"

#include <cstdint>

#include "platform/bare/board.h"

namespace cairn {

[[noreturn]] void assert_failed(const char* file, int line) {
  board_put("\nflight assertion failed at ");
  board_put(file);
  board_put(" line ");
  board_put_hex(static_cast<std::uint32_t>(line));
  board_put("\n");
  board_exit(3);
}

}  // namespace cairn
