// SPARC V8: "The SPARC Architecture Manual, Version 8", appendices B and F.
#include "profile/plugin/instruction.hpp"

namespace cairn::profile {
namespace {

/// %g0 is always there and never set.
void reads(Instruction& out, int reg) {
  if (reg != 0) out.reads(reg);
}
void writes(Instruction& out, int reg) {
  if (reg != 0) out.writes(reg);
}
void reads_float(Instruction& out, int reg, bool twice) {
  out.reads(kFloat0 + reg);
  if (twice) out.reads(kFloat0 + (reg | 1));
}
void writes_float(Instruction& out, int reg, bool twice) {
  out.writes(kFloat0 + reg);
  if (twice) out.writes(kFloat0 + (reg | 1));
}

struct Fields {
  explicit Fields(std::uint32_t word)
      : d(static_cast<int>(word >> 25 & 31)),
        op3(static_cast<int>(word >> 19 & 63)),
        s1(static_cast<int>(word >> 14 & 31)),
        immediate((word >> 13 & 1) != 0),
        s2(static_cast<int>(word & 31)),
        opf(static_cast<int>(word >> 5 & 0x1ff)) {}
  int d;
  int op3;
  int s1;
  bool immediate;
  int s2;
  int opf;
};

void reads_operands(Instruction& out, const Fields& f) {
  reads(out, f.s1);
  if (!f.immediate) reads(out, f.s2);
}

Instruction branch_or_sethi(std::uint32_t word, const Fields& f) {
  Instruction out;
  const int op2 = static_cast<int>(word >> 22 & 7);
  if (op2 == 4) {
    writes(out, f.d);
  } else if (op2 == 2 || op2 == 6) {
    const int condition = static_cast<int>(word >> 25 & 15);
    out.kind = Class::kBranch;
    out.flow = condition == 8 ? Flow::kJump : Flow::kBranch;
    if (condition % 8 != 0) out.reads(op2 == 2 ? kFlags : kFloatFlags);
  }
  return out;
}

Instruction floating(const Fields& f) {
  Instruction out;
  out.kind = Class::kFloat;
  if (f.op3 == 0x35) {
    out.kind = Class::kFloatCompare;
    const bool twice = (f.opf & 3) == 2;
    reads_float(out, f.s1, twice);
    reads_float(out, f.s2, twice);
    out.writes(kFloatFlags);
    return out;
  }
  bool from_twice = (f.opf & 3) == 2;
  bool to_twice = from_twice;
  bool two = true;
  switch (f.opf) {
    case 0x01:
    case 0x05:
    case 0x09: two = false; break;  // move, negate, absolute
    case 0x29:
      out.kind = Class::kFloatRoot;
      two = false;
      break;
    case 0x2a:
      out.kind = Class::kFloatRootDouble;
      two = false;
      break;
    case 0x49: out.kind = Class::kFloatMultiply; break;
    case 0x4a: out.kind = Class::kFloatMultiplyDouble; break;
    case 0x69:
      out.kind = Class::kFloatMultiplyDouble;
      from_twice = false;
      to_twice = true;
      break;
    case 0x4d: out.kind = Class::kFloatDivide; break;
    case 0x4e: out.kind = Class::kFloatDivideDouble; break;
    case 0xc4:
    case 0xd1: two = from_twice = to_twice = false; break;  // fitos, fstoi
    case 0xc8:
    case 0xc9:
      two = from_twice = false;
      to_twice = true;
      break;  // fitod, fstod
    case 0xc6:
    case 0xd2:
      two = to_twice = false;
      from_twice = true;
      break;  // fdtos, fdtoi
    default: break;
  }
  if (two) reads_float(out, f.s1, from_twice);
  reads_float(out, f.s2, from_twice);
  writes_float(out, f.d, to_twice);
  return out;
}

Instruction arithmetic(const Fields& f) {
  Instruction out;
  const int base = f.op3 & 0x0f;
  reads_operands(out, f);
  writes(out, f.d);
  if (f.op3 < 0x20) {
    if (base == 8 || base == 12) out.reads(kFlags);  // addx, subx
    if (base == 10 || base == 11) out.kind = Class::kMultiply;
    if (base == 14 || base == 15) {
      out.kind = Class::kDivide;
      out.reads(kCarry);
    }
    if (base == 10 || base == 11) out.writes(kCarry);
    if (f.op3 >= 0x10) out.writes(kFlags);
    return out;
  }
  switch (f.op3) {
    case 0x20:
    case 0x21:
    case 0x22:
    case 0x23: out.writes(kFlags); break;
    case 0x24:
      out.reads(kCarry);
      out.writes(kCarry);
      out.writes(kFlags);
      break;
    case 0x28:
      out.kind = Class::kSpecial;
      out.reads(kCarry);
      break;
    case 0x29:
    case 0x2a:
    case 0x2b: out.kind = Class::kSpecial; break;
    case 0x30:
      out.kind = Class::kSpecial;
      out.targets = 0;
      out.writes(kCarry);
      break;
    case 0x31:
    case 0x32:
    case 0x33:
      out.kind = Class::kSpecial;
      out.targets = 0;
      break;
    case 0x38:
      out.kind = Class::kJump;
      out.flow = f.d == 15 ? Flow::kIndirectCall : Flow::kIndirect;
      break;
    case 0x39:
      out.kind = Class::kJump;
      out.flow = Flow::kIndirect;
      out.targets = 0;
      out.ends_trap = true;
      break;
    case 0x3a:
      out.kind = Class::kBranch;
      out.targets = 0;
      out.reads(kFlags);
      out.splits = true;
      break;
    case 0x3b:
      out.kind = Class::kSystem;
      out.targets = 0;
      break;
    case 0x3c:
    case 0x3d:
      out.kind = Class::kWindow;
      out.splits = true;
      break;
    default: break;
  }
  return out;
}

Instruction memory(const Fields& f) {
  Instruction out;
  reads_operands(out, f);
  out.words = 1;
  const int op3 = f.op3;
  if (op3 >= 0x20 && op3 < 0x30) {
    const bool store = (op3 & 4) != 0;
    const bool twice = (op3 & 3) == 3;
    if ((op3 & 3) == 1) {  // the status register
      out.kind = Class::kFloatStatus;
      return out;
    }
    out.words = twice ? 2 : 1;
    out.kind =
        store ? (twice ? Class::kStoreDouble : Class::kStore) : (twice ? Class::kLoadDouble : Class::kLoad);
    if (store) {
      reads_float(out, f.d, twice);
    } else {
      writes_float(out, f.d, twice);
    }
    return out;
  }
  const int base = op3 & 0x0f;  // alternate spaces as the ordinary one
  const bool twice = base == 3 || base == 7;
  out.words = twice ? 2 : 1;
  if (base >= 4 && base <= 7) {
    out.kind = twice ? Class::kStoreDouble : Class::kStore;
    reads(out, f.d);
    if (twice) reads(out, f.d | 1);
    return out;
  }
  out.kind = twice ? Class::kLoadDouble : base == 13 || base == 15 ? Class::kSystem : Class::kLoad;
  writes(out, f.d);
  if (twice) writes(out, f.d | 1);
  return out;
}

}  // namespace

Instruction decode_sparc(std::uint32_t word) {
  const Fields f(word);
  switch (word >> 30) {
    case 0: return branch_or_sethi(word, f);
    case 1: {
      Instruction out;
      out.kind = Class::kBranch;
      out.flow = Flow::kCall;
      out.writes(15);
      return out;
    }
    case 2: return f.op3 == 0x34 || f.op3 == 0x35 ? floating(f) : arithmetic(f);
    default: return memory(f);
  }
}

}  // namespace cairn::profile
