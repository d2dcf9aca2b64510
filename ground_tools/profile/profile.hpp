/// What the plugin of `make profile` wrote of one run.
///
/// The file: lines of fields separated by tabs, the first its kind. Costs are instructions, then cycles
/// of the model.
///   cairn-profile 1
///   processor NAME | clock_mhz F | total COST | classes NAME...
///   function  ID LINKED_NAME CALLS INCLUSIVE LONGEST FETCH_MISSES DATA_MISSES STALLED_CYCLES COUNT...
///             (inclusive and longest of its outermost calls; one count a class)
///   node      ID PARENT FUNCTION CALLS SELF DETAIL_CALLS DETAIL_SELF      (calling contexts; 0 is the root)
///   frame     AT COST          (one after the other; AT: instructions executed before)
///   call      FUNCTION AT COST (of a watched function, by when it ended)
///   detail    FRAME            (which one DETAIL means; -1 for none)
///   end
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace cairn::ground {

struct ProfileCost {
  std::uint64_t instructions = 0;
  std::uint64_t cycles = 0;
  ProfileCost& operator+=(const ProfileCost& other) {
    instructions += other.instructions;
    cycles += other.cycles;
    return *this;
  }
};

struct ProfileFunction {
  std::string name;  ///< short
  std::string plain;
  std::uint64_t calls = 0;
  ProfileCost self;
  ProfileCost inclusive;
  ProfileCost longest;  ///< of one call
  ProfileCost detail_self;
  std::uint64_t detail_calls = 0;
  std::uint64_t fetch_misses = 0;
  std::uint64_t data_misses = 0;
  std::uint64_t stalled_cycles = 0;   ///< by misses and write buffer
  std::vector<std::uint64_t> counts;  ///< instructions by class
};

struct ProfileNode {
  std::size_t parent = 0;
  std::size_t function = 0;  ///< index
  std::uint64_t calls = 0;
  ProfileCost self;
  std::uint64_t detail_calls = 0;
  ProfileCost detail_self;
};

/// A stretch of the run: a frame, or a call of a watched function.
struct ProfileSpan {
  std::size_t function = 0;  ///< index; of calls
  std::uint64_t at = 0;      ///< instructions executed before
  ProfileCost cost;
};

struct Profile {
  std::string processor;
  double clock_mhz = 0.0;
  ProfileCost total;
  std::vector<std::string> classes;
  std::vector<ProfileFunction> functions;
  std::vector<ProfileNode> nodes;  ///< parents before children
  std::vector<ProfileSpan> frames;
  std::vector<ProfileSpan> calls;  ///< by when they began
  long detail_frame = -1;
};

/// Throws ToolError: cannot be read, cut off, not of this form.
Profile read_profile(const std::filesystem::path& path);

}  // namespace cairn::ground
