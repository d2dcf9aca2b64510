/// Does a call end in the flight assertion's handler? It is left by a jump from the handler: flight code
/// holds nothing that would have to be destroyed.
#pragma once

#include <csetjmp>

namespace cairn::test {

/// Where the handler (assert_handler.cpp) jumps to; null: it ends the program.
extern std::jmp_buf* assertion_expected;

/// True where `call` came to the handler.
template <typename Call>
bool asserts(Call call) {
  std::jmp_buf here;
  assertion_expected = &here;
  const bool asserted = setjmp(here) != 0;
  if (!asserted) call();
  assertion_expected = nullptr;
  return asserted;
}

}  // namespace cairn::test
