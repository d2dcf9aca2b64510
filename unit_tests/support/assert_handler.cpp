// Tests end at a failed flight assertion, with its place on stderr. test_assert of core expects it.
#include <cstdio>
#include <cstdlib>

#include "core/assert.hpp"

namespace cairn {

[[noreturn]] void assert_failed(const char* file, int line) {
  std::fprintf(stderr, "flight assertion failed at %s:%d\n", file, line);
  std::abort();
}

}  // namespace cairn
