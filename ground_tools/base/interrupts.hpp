/// What SIGINT, SIGTERM and SIGHUP leave behind: nothing that is half done.
///
/// A thread waits for these signals. When one comes it removes what is unfinished, says so in a line, and
/// ends the program with 128 + the signal's number, as shells have it. No handler: there hardly anything may
/// be done. What a signal was ignored for (nohup) stays ignored.
#pragma once

#include <filesystem>

namespace cairn::ground {

/// Once, before any other thread: they inherit that these signals are not theirs.
void watch_interrupts();

/// Removed where the program is interrupted as long as this lives: a file, or a folder with all in it.
class Unfinished {
 public:
  explicit Unfinished(const std::filesystem::path& path);
  ~Unfinished();
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;

 private:
  std::filesystem::path path_;
};

/// A folder that was made for results: removed where the program is interrupted before anything is in it.
void made_folder(const std::filesystem::path& path);

/// Long work that ends in order: while this lives a first signal is a question that it asks now and then. It
/// is to end in an exception, and the program with `interrupted_status`. A second signal ends the program at
/// once. At most one at a time.
class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  bool asked() const;
};

/// 128 + the signal's number; 0 where none has come.
int interrupted_status();

/// Files that belong together come all or none: an interruption waits for as long as this lives. May be
/// nested. For what takes a moment, as renaming does.
class HoldInterrupts {
 public:
  HoldInterrupts();
  ~HoldInterrupts();
  HoldInterrupts(const HoldInterrupts&) = delete;
  HoldInterrupts& operator=(const HoldInterrupts&) = delete;
};

}  // namespace cairn::ground
