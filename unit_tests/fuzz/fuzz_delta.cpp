// Deltas: any base, any delta; what comes out is validated, and the base is only read.
//
// Input: options, size of the base, the base, the delta.
#include "fuzz/fuzz_support.hpp"

using namespace cairn;
using namespace cairn::fuzz;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static DeltaJob job;
  Input in(data, size);
  const std::uint8_t options = in.u8();
  const std::size_t room = in.u16();
  const std::size_t base_bytes = in.u16();
  Block base(in, base_bytes);
  Block delta(in, in.left());
  if ((options & 1U) == 0) repair_map(base.data(), base.size());
  MapShape shape;
  if ((options & 2U) == 0 && delta.size() >= delta::kHeadAt && shape.read(base.data(), base.size())) {
    // Names this base.
    be::put_u32(delta.data() + delta::kMagicAt, delta::kMagic);
    delta.data()[delta::kVersionAt] = delta::kVersion;
    delta.data()[delta::kZeroAt] = 0;
    be::put_u32(delta.data() + delta::kBaseBytesAt, shape.file_bytes);
    std::memcpy(delta.data() + delta::kBaseHeadCrcAt, base.data() + shape.head_bytes - cmap::kCrcBytes,
                cmap::kCrcBytes);
  }
  const Block base_before(base.data(), base.size());
  const std::uint32_t ops = (options & 4U) != 0 ? 1 : UINT32_MAX;

  Block out(room);
  const DeltaStatus started =
      job.start(delta.data(), delta.size(), base.data(), base.size(), out.data(), out.size());
  if (started == DeltaStatus::kApplying) run(job, ops);
  CAIRN_ASSERT(job.status() != DeltaStatus::kApplying);
  CAIRN_ASSERT(base.size() == 0 || std::memcmp(base.data(), base_before.data(), base.size()) == 0);
  if (job.status() != DeltaStatus::kApplied) return 0;
  CAIRN_ASSERT(job.result_bytes() <= out.size());
  Block result(out.data(), job.result_bytes());
  if ((options & 8U) == 0) repair_map(result.data(), result.size());
  OrbitalMap usable;
  static_cast<void>(validate(result, ops, usable));
  return 0;
}
