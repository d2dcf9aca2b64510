#include "base/interrupts.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <thread>
#include <vector>

namespace cairn::ground {
namespace {

namespace fs = std::filesystem;

struct State {
  std::mutex guard;
  std::condition_variable released;
  std::vector<fs::path> unfinished;
  std::vector<fs::path> folders;  ///< made, parents first
  int holds = 0;
  int signal = 0;         ///< the first that came
  bool in_order = false;  ///< a StopSignal lives
  bool ending = false;
};

/// Never destroyed: the thread may wait for longer than static objects live.
State& state() {
  static State* const all = new State;
  return *all;
}

const char* name_of(int signal) {
  return signal == SIGINT ? "SIGINT" : signal == SIGTERM ? "SIGTERM" : "SIGHUP";
}

/// Others may still be writing into a folder, until the program ends.
void remove_all_of(const fs::path& path) {
  std::error_code failed;
  constexpr int kTries = 3;
  for (int i = 0; i < kTries && fs::exists(path, failed); ++i) fs::remove_all(path, failed);
}

int interrupted_status_of(int signal) {
  constexpr int kBySignal = 128;
  return kBySignal + signal;
}

/// Is somebody there to end in order?
bool asked_to_stop(int signal) {
  const std::lock_guard lock(state().guard);
  const bool first = state().signal == 0;
  state().signal = signal;
  return first && state().in_order;
}

[[noreturn]] void end_by(int signal) {
  State& all = state();
  std::unique_lock lock(all.guard);
  all.ending = true;
  all.released.wait(lock, [&] { return all.holds == 0; });
  for (const fs::path& path : all.unfinished) remove_all_of(path);
  std::error_code ignored;
  for (auto folder = all.folders.rbegin(); folder != all.folders.rend(); ++folder)
    fs::remove(*folder, ignored);  // only where it is empty
  fmt::print(stderr, "{}cairn: interrupted by {}; what was unfinished is removed\n",
             ::isatty(STDERR_FILENO) != 0 ? "\r\033[K" : "", name_of(signal));
  ::_exit(interrupted_status_of(signal));  // and the lock is kept: nobody begins another file
}

}  // namespace

void watch_interrupts() {
  sigset_t watched;
  sigemptyset(&watched);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction now = {};
    if (::sigaction(signal, nullptr, &now) == 0 && now.sa_handler != SIG_IGN) sigaddset(&watched, signal);
  }
  ::pthread_sigmask(SIG_BLOCK, &watched, nullptr);
  std::thread([watched] {
    int signal = 0;
    do {
      while (::sigwait(&watched, &signal) != 0) {
      }
    } while (asked_to_stop(signal));
    end_by(signal);
  }).detach();
}

Unfinished::Unfinished(const fs::path& path) : path_(fs::absolute(path)) {
  const std::lock_guard lock(state().guard);
  state().unfinished.push_back(path_);
}

Unfinished::~Unfinished() {
  const std::lock_guard lock(state().guard);
  std::vector<fs::path>& all = state().unfinished;
  all.erase(std::find(all.begin(), all.end(), path_));
}

void made_folder(const fs::path& path) {
  const std::lock_guard lock(state().guard);
  state().folders.push_back(fs::absolute(path));
}

StopSignal::StopSignal() {
  const std::lock_guard lock(state().guard);
  state().in_order = true;
}

StopSignal::~StopSignal() {
  const std::lock_guard lock(state().guard);
  state().in_order = false;
}

bool StopSignal::asked() const { return interrupted_status() != 0; }

int interrupted_status() {
  const std::lock_guard lock(state().guard);
  return state().signal == 0 ? 0 : interrupted_status_of(state().signal);
}

HoldInterrupts::HoldInterrupts() {
  State& all = state();
  std::unique_lock lock(all.guard);
  all.released.wait(lock, [&] { return !all.ending || all.holds > 0; });
  ++all.holds;
}

HoldInterrupts::~HoldInterrupts() {
  {
    const std::lock_guard lock(state().guard);
    --state().holds;
  }
  state().released.notify_all();
}

}  // namespace cairn::ground
