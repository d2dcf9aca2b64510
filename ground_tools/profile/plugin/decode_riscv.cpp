// RV64GC: "The RISC-V Instruction Set Manual, Volume I", 20191213, chapters 2, 5, 7, 11, 12, 16 and 24.
#include <initializer_list>

#include "profile/plugin/instruction.hpp"

namespace cairn::profile {
namespace {

constexpr int kReturnAddress = 1;
constexpr int kStack = 2;

/// x0 is always there and never set.
void reads(Instruction& out, int reg) {
  if (reg != 0) out.reads(reg);
}
void writes(Instruction& out, int reg) {
  if (reg != 0) out.writes(reg);
}

Instruction integer(int target, int first = 0, int second = 0) {
  Instruction out;
  reads(out, first);
  reads(out, second);
  writes(out, target);
  return out;
}

Instruction load(int target, int base) {
  Instruction out;
  out.kind = Class::kLoad;
  out.words = 1;
  reads(out, base);
  writes(out, target);
  return out;
}

Instruction store(int source, int base) {
  Instruction out;
  out.kind = Class::kStore;
  out.words = 1;
  reads(out, base);
  reads(out, source);
  return out;
}

Instruction branch(int first, int second = 0) {
  Instruction out = integer(0, first, second);
  out.kind = Class::kBranch;
  out.flow = Flow::kBranch;
  return out;
}

/// Direct: a call where it leaves its return address.
Instruction jump(int target) {
  Instruction out = integer(target);
  out.kind = Class::kBranch;
  out.flow = target == 0 ? Flow::kJump : Flow::kCall;
  return out;
}

Instruction jump_to(int base, int target) {
  Instruction out = integer(target, base);
  out.kind = Class::kJump;
  out.flow = target == 0 ? Flow::kIndirect : Flow::kIndirectCall;
  return out;
}

struct Fields {
  explicit Fields(std::uint32_t word)
      : d(static_cast<int>(word >> 7 & 31)),
        f3(static_cast<int>(word >> 12 & 7)),
        s1(static_cast<int>(word >> 15 & 31)),
        s2(static_cast<int>(word >> 20 & 31)),
        s3(static_cast<int>(word >> 27)),
        twice((word >> 25 & 3) == 1) {}
  int d;
  int f3;
  int s1;
  int s2;
  int s3;  ///< third source, or what kind of floating-point instruction
  bool twice;
};

Instruction floating(const Fields& f) {
  Instruction out;
  out.reads(kFloat0 + f.s1);
  switch (f.s3) {
    case 0x00:
    case 0x01:
      out.kind = Class::kFloat;
      out.reads(kFloat0 + f.s2);
      break;
    case 0x02:
      out.kind = f.twice ? Class::kFloatMultiplyDouble : Class::kFloatMultiply;
      out.reads(kFloat0 + f.s2);
      break;
    case 0x03:
      out.kind = f.twice ? Class::kFloatDivideDouble : Class::kFloatDivide;
      out.reads(kFloat0 + f.s2);
      break;
    case 0x0b: out.kind = f.twice ? Class::kFloatRootDouble : Class::kFloatRoot; break;
    case 0x04:
    case 0x05:  // sign, least and greatest
      out.kind = Class::kFloatCompare;
      out.reads(kFloat0 + f.s2);
      break;
    case 0x14:  // comparisons
      out.kind = Class::kFloatCompare;
      out.reads(kFloat0 + f.s2);
      writes(out, f.d);
      return out;
    case 0x18:
    case 0x1c:  // to an integer register
      out.kind = Class::kFloatCompare;
      writes(out, f.d);
      return out;
    case 0x1a:
    case 0x1e:  // from one
      out = integer(0, f.s1);
      out.kind = Class::kFloatCompare;
      break;
    default: out.kind = Class::kFloatCompare; break;  // from one size to the other
  }
  out.writes(kFloat0 + f.d);
  return out;
}

Instruction whole(std::uint32_t word) {
  const Fields f(word);
  Instruction out;
  switch (word & 0x7f) {
    case 0x03: return load(f.d, f.s1);
    case 0x07: return load(kFloat0 + f.d, f.s1);
    case 0x23: return store(f.s2, f.s1);
    case 0x27: return store(kFloat0 + f.s2, f.s1);
    case 0x13:
    case 0x1b: return integer(f.d, f.s1);
    case 0x17:
    case 0x37: return integer(f.d);
    case 0x33:
    case 0x3b:
      out = integer(f.d, f.s1, f.s2);
      if (word >> 25 == 1) out.kind = f.f3 < 4 ? Class::kMultiply : Class::kDivide;
      return out;
    case 0x43:
    case 0x47:
    case 0x4b:
    case 0x4f:
      out.kind = f.twice ? Class::kFloatFusedDouble : Class::kFloatFused;
      for (const int s : {f.s1, f.s2, f.s3}) out.reads(kFloat0 + s);
      out.writes(kFloat0 + f.d);
      return out;
    case 0x53: return floating(f);
    case 0x63: return branch(f.s1, f.s2);
    case 0x67: return jump_to(f.s1, f.d);
    case 0x6f: return jump(f.d);
    case 0x73:
      out = integer(f.d, f.f3 != 0 && f.f3 < 4 ? f.s1 : 0);
      out.kind = f.f3 == 0 ? Class::kSystem : Class::kSpecial;
      return out;
    default: out.kind = Class::kSystem; return out;  // fence, atomic
  }
}

Instruction compressed(std::uint32_t word) {
  const int high = static_cast<int>(word >> 7 & 31);  // registers of five bits
  const int low = static_cast<int>(word >> 2 & 31);
  const int high_short = 8 + (high & 7);  // and of three
  const int low_short = 8 + (low & 7);
  switch ((word & 3) << 3 | (word >> 13 & 7)) {
    case 000: return integer(low_short, kStack);             // addi4spn
    case 001: return load(kFloat0 + low_short, high_short);  // fld
    case 002:
    case 003: return load(low_short, high_short);             // lw, ld
    case 005: return store(kFloat0 + low_short, high_short);  // fsd
    case 006:
    case 007: return store(low_short, high_short);  // sw, sd
    case 010:
    case 011: return integer(high, high);                         // addi, addiw
    case 012: return integer(high);                               // li
    case 013: return integer(high, high == kStack ? kStack : 0);  // addi16sp, lui
    case 014: return integer(high_short, high_short, (word >> 10 & 3) == 3 ? low_short : 0);
    case 015: return jump(0);
    case 016:
    case 017: return branch(high_short);
    case 020: return integer(high, high);  // slli
    case 021: return load(kFloat0 + high, kStack);
    case 022:
    case 023: return load(high, kStack);
    case 024:
      if (low != 0) return integer(high, low, (word >> 12 & 1) != 0 ? high : 0);  // mv, add
      if (high != 0) return jump_to(high, (word >> 12 & 1) != 0 ? kReturnAddress : 0);
      break;  // ebreak
    case 025: return store(kFloat0 + low, kStack);
    case 026:
    case 027: return store(low, kStack);
    default: break;
  }
  Instruction out;
  out.kind = Class::kSystem;
  return out;
}

}  // namespace

Instruction decode_riscv(std::uint32_t word) {
  if ((word & 3) == 3) return whole(word);
  Instruction out = compressed(word);
  out.bytes = 2;
  return out;
}

}  // namespace cairn::profile
