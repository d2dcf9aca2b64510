// Tests end at a failed flight assertion, with its place, unless they expect it.
#include <cstdio>
#include <cstdlib>

#include "core/assert.hpp"
#include "support/death.hpp"

namespace cairn {

std::jmp_buf* test::assertion_expected = nullptr;

[[noreturn]] void assert_failed(const char* file, int line) {
  if (test::assertion_expected != nullptr) std::longjmp(*test::assertion_expected, 1);
  std::printf("flight assertion failed at %s:%d\n", file, line);
  std::abort();
}

}  // namespace cairn
