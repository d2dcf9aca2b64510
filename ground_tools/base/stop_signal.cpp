#include "base/stop_signal.hpp"

#include <csignal>

namespace cairn::ground {
namespace {

volatile std::sig_atomic_t stop_asked = 0;

void note_stop(int signal) {
  stop_asked = 1;
  std::signal(signal, SIG_DFL);  // a second one ends the program at once
}

}  // namespace

StopSignal::StopSignal() {
  stop_asked = 0;
  std::signal(SIGINT, note_stop);
  std::signal(SIGTERM, note_stop);
}

StopSignal::~StopSignal() {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

bool StopSignal::asked() const { return stop_asked != 0; }

}  // namespace cairn::ground
