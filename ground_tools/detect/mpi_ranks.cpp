#include "detect/mpi_ranks.hpp"

#define OMPI_SKIP_MPICXX 1
#include <mpi/mpi.h>

#include <algorithm>
#include <climits>
#include <cstdlib>

namespace cairn::ground {
namespace {

constexpr int kTag = 1;

/// What launchers put into the environment: Open MPI, then MPICH and Slurm's PMI.
int from_environment(const char* open_mpi, const char* pmi, int otherwise) {
  for (const char* name : {open_mpi, pmi}) {
    const char* const text = std::getenv(name);
    if (text != nullptr) return static_cast<int>(std::strtol(text, nullptr, 10));
  }
  return otherwise;
}

bool is_launched() { return from_environment("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", 1) > 1; }

}  // namespace

MpiRanks::MpiRanks() {
  if (!is_launched()) return;
  int given = MPI_THREAD_SINGLE;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &given);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
  neighbours_ = std::max(1, from_environment("OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS", 1));
}

MpiRanks::~MpiRanks() {
  int begun = 0;
  MPI_Initialized(&begun);
  if (begun != 0) MPI_Finalize();
}

bool MpiRanks::is_follower() {
  return is_launched() && from_environment("OMPI_COMM_WORLD_RANK", "PMI_RANK", 0) != 0;
}

void MpiRanks::meet() const {
  if (size_ > 1) MPI_Barrier(MPI_COMM_WORLD);
}

void MpiRanks::send(int to, const Bytes& message) const {
  if (message.size() > INT_MAX)
    throw ToolError("a tile's result is too large to send; choose a smaller --tile");
  MPI_Send(message.data(), static_cast<int>(message.size()), MPI_BYTE, to, kTag, MPI_COMM_WORLD);
}

bool MpiRanks::receive(Bytes& message, int& from) const {
  if (size_ == 1) return false;
  int arrived = 0;
  MPI_Status status;
  MPI_Iprobe(MPI_ANY_SOURCE, kTag, MPI_COMM_WORLD, &arrived, &status);
  if (arrived == 0) return false;
  int bytes = 0;
  MPI_Get_count(&status, MPI_BYTE, &bytes);
  message.resize(static_cast<std::size_t>(bytes));
  MPI_Recv(message.data(), bytes, MPI_BYTE, status.MPI_SOURCE, kTag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  from = status.MPI_SOURCE;
  return true;
}

}  // namespace cairn::ground
