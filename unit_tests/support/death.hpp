/// Does a call end in the flight assertion's handler? It runs in a forked child, whose end is looked at.
#pragma once

#include <csignal>
#include <cstdio>

#include <sys/wait.h>
#include <unistd.h>

namespace cairn::test {

/// True where `call` ended by abort(), which is what support/assert_failed.cpp does. Its line on stderr is
/// kept back.
template <typename Call>
bool asserts(Call call) {
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    if (std::freopen("/dev/null", "w", stderr) == nullptr) _exit(2);
    call();
    _exit(0);
  }
  int how = 0;
  return child > 0 && waitpid(child, &how, 0) == child && WIFSIGNALED(how) && WTERMSIG(how) == SIGABRT;
}

}  // namespace cairn::test
