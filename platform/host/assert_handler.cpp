// A failed flight assertion on the host: says where, then ends the program.
#include <cstdio>
#include <cstdlib>

#include "core/assert.hpp"

namespace cairn {

[[noreturn]] void assert_failed(const char* file, int line) {
  std::fprintf(stderr, "flight assertion failed at %s:%d\n", file, line);
  std::abort();
}

}  // namespace cairn
