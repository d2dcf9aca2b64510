/// Progress of long work on stderr: per cent done and an estimate of what remains. Quiet when stderr
/// is no terminal.
#pragma once

#include <chrono>
#include <string>

namespace cairn::ground {

class ProgressLine {
 public:
  /// `what` names the work, e.g. "map build site.tif".
  explicit ProgressLine(std::string what);
  /// Clears the line.
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// Share done, 0 to 1. Call as often as convenient: it writes at most five times a second.
  void show(double share);
  /// Makes room for a line of results; the next `show` writes anew.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;

  std::string what_;
  Clock::time_point begun_ = Clock::now();
  Clock::time_point next_ = begun_;
  bool terminal_ = false;
  bool written_ = false;
};

}  // namespace cairn::ground
