/// The processes that one `mpirun` started, as far as a tool that shares out tiles needs them: rank 0 leads,
/// prints and writes; the others get work from it and send results to it. All of MPI is in this file's .cpp.
#pragma once

#include "base/byte_stream.hpp"

namespace cairn::ground {

class MpiRanks {
 public:
  /// Joins the others where mpirun started this process; otherwise it is alone, and MPI is not even begun.
  /// At most one at a time, used by the thread that made it.
  MpiRanks();
  ~MpiRanks();
  MpiRanks(const MpiRanks&) = delete;
  MpiRanks& operator=(const MpiRanks&) = delete;

  /// True in a process that mpirun started and that is not the first; before any MpiRanks exists, too.
  static bool is_follower();

  int rank() const { return rank_; }
  int size() const { return size_; }
  /// How many of them run on this machine.
  int on_this_machine() const { return neighbours_; }

  /// Returns once every rank has called it.
  void meet() const;

  void send(int to, const Bytes& message) const;
  /// The next message from any rank, where one has arrived; does not wait.
  bool receive(Bytes& message, int& from) const;

 private:
  int rank_ = 0;
  int size_ = 1;
  int neighbours_ = 1;
};

}  // namespace cairn::ground
