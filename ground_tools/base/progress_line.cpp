#include "base/progress_line.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <utility>

namespace cairn::ground {

ProgressLine::ProgressLine(std::string what)
    : what_(std::move(what)), terminal_(::isatty(STDERR_FILENO) != 0) {}

ProgressLine::~ProgressLine() { clear(); }

void ProgressLine::clear() {
  if (!written_) return;
  fmt::print(stderr, "\r\033[K");
  std::fflush(stderr);
  written_ = false;
}

void ProgressLine::show(double share) {
  if (!terminal_) return;
  const Clock::time_point now = Clock::now();
  if (now < next_) return;
  next_ = now + std::chrono::milliseconds(200);
  const double spent_s = std::chrono::duration<double>(now - begun_).count();
  std::string remains;
  if (share > 0.02 && spent_s > 0.5)
    remains = fmt::format(", about {:.0f} s to go", spent_s * (1.0 - share) / share);
  fmt::print(stderr, "\r{}: {:3.0f} %{}\033[K", what_, 100.0 * share, remains);
  std::fflush(stderr);
  written_ = true;
}

}  // namespace cairn::ground
