/// What the timing model needs to know of an instruction, and decoders for the three processors.
#pragma once

#include <cstdint>

namespace cairn::profile {

/// Instructions of one cost. Names in timing.toml are those of `kClassNames`.
enum class Class : std::uint8_t {
  kInteger,
  kMultiply,
  kMultiplyUnsigned,
  kMultiplyShort,
  kDivide,
  kLoad,
  kLoadDouble,
  kStore,
  kStoreDouble,
  kLoadMultiple,
  kStoreMultiple,
  kFloat,
  kFloatMultiply,
  kFloatMultiplyDouble,
  kFloatFused,
  kFloatFusedDouble,
  kFloatDivide,
  kFloatDivideDouble,
  kFloatRoot,
  kFloatRootDouble,
  kFloatCompare,
  kFloatStatus,
  kBranch,
  kJump,
  kCondition,
  kSpecial,
  kWindow,
  kSystem,
};
inline constexpr int kClasses = 28;
inline constexpr const char* kClassNames[kClasses] = {"integer",
                                                      "multiply",
                                                      "multiply_unsigned",
                                                      "multiply_short",
                                                      "divide",
                                                      "load",
                                                      "load_double",
                                                      "store",
                                                      "store_double",
                                                      "load_multiple",
                                                      "store_multiple",
                                                      "float",
                                                      "float_multiply",
                                                      "float_multiply_double",
                                                      "float_fused",
                                                      "float_fused_double",
                                                      "float_divide",
                                                      "float_divide_double",
                                                      "float_root",
                                                      "float_root_double",
                                                      "float_compare",
                                                      "float_status",
                                                      "branch",
                                                      "jump",
                                                      "condition",
                                                      "special",
                                                      "window",
                                                      "system"};

/// How an instruction goes on.
enum class Flow : std::uint8_t {
  kNext,          ///< with the next one
  kBranch,        ///< direct, on a condition
  kJump,          ///< direct, always
  kIndirect,      ///< to an address in a register: a return, a switch, a call in the tail
  kCall,          ///< direct
  kIndirectCall,  ///< to an address in a register, and back
};

/// Registers as the scoreboard numbers them: 0 to 31 integer, 32 to 63 floating point, then these.
inline constexpr int kFloat0 = 32;
inline constexpr int kFlags = 64;       ///< condition register (PowerPC), icc (SPARC)
inline constexpr int kFloatFlags = 65;  ///< fcc (SPARC)
inline constexpr int kLink = 66;
inline constexpr int kCount = 67;
inline constexpr int kCarry = 68;  ///< XER (PowerPC), Y (SPARC)
inline constexpr int kRegisters = 69;

struct Instruction {
  Class kind = Class::kInteger;
  Flow flow = Flow::kNext;
  bool splits = false;       ///< may trap in the midst of ordinary code (SPARC save and restore)
  bool ends_trap = false;    ///< SPARC rett
  std::uint8_t bytes = 4;    ///< its own length
  std::uint8_t words = 0;    ///< of memory, 1 for a word or less
  std::uint8_t sources = 0;  ///< count
  std::uint8_t targets = 0;
  std::uint8_t source[5] = {};
  std::uint8_t target[3] = {};

  void reads(int reg) { source[sources++] = static_cast<std::uint8_t>(reg); }
  void writes(int reg) { target[targets++] = static_cast<std::uint8_t>(reg); }
};

Instruction decode_ppc(std::uint32_t word);
Instruction decode_sparc(std::uint32_t word);
/// A compressed instruction in the lower half.
Instruction decode_riscv(std::uint32_t word);

}  // namespace cairn::profile
