/// SIGINT and SIGTERM as a question that long work asks now and then, so that it can end in order.
#pragma once

namespace cairn::ground {

/// While it lives, the two signals do not end the program; a second one does. At most one at a time.
class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  bool asked() const;
};

}  // namespace cairn::ground
