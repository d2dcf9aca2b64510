// PowerPC, 32 bits: "PowerPC Microprocessor Family: The Programming Environments",
// appendix A (formats and opcodes).
#include "profile/plugin/instruction.hpp"

namespace cairn::profile {
namespace {

struct Fields {
  explicit Fields(std::uint32_t word)
      : op(static_cast<int>(word >> 26)),
        d(static_cast<int>(word >> 21 & 31)),
        a(static_cast<int>(word >> 16 & 31)),
        b(static_cast<int>(word >> 11 & 31)),
        c(static_cast<int>(word >> 6 & 31)),
        extended(static_cast<int>(word >> 1 & 0x3ff)),
        record((word & 1) != 0) {}
  int op;
  int d;  ///< also the source of stores and logical operations
  int a;
  int b;
  int c;
  int extended;
  bool record;  ///< sets the condition register; of a branch: sets the link register
};

/// Base register: 0 stands for the number 0.
void reads_base(Instruction& out, int reg) {
  if (reg != 0) out.reads(reg);
}

Instruction arithmetic(Class kind, int target, int first, int second = -1) {
  Instruction out;
  out.kind = kind;
  out.reads(first);
  if (second >= 0) out.reads(second);
  out.writes(target);
  return out;
}

void memory(Instruction& out, const Fields& f, bool store, bool real, bool update, int words) {
  out.kind = store ? (words == 2 ? Class::kStoreDouble : Class::kStore)
                   : (words == 2 ? Class::kLoadDouble : Class::kLoad);
  out.words = static_cast<std::uint8_t>(words);
  reads_base(out, f.a);
  const int data = real ? kFloat0 + f.d : f.d;
  if (store) {
    out.reads(data);
  } else {
    out.writes(data);
  }
  if (update) out.writes(f.a);
}

/// lwz 32 ... stfdu 55, and lmw, stmw.
Instruction memory_by_offset(const Fields& f) {
  Instruction out;
  if (f.op == 46 || f.op == 47) {
    out.kind = f.op == 46 ? Class::kLoadMultiple : Class::kStoreMultiple;
    out.words = static_cast<std::uint8_t>(32 - f.d);
    reads_base(out, f.a);
    if (f.op == 46) out.writes(31);
    return out;
  }
  const bool real = f.op >= 48;
  const bool store = real ? f.op >= 52 : (f.op >= 36 && f.op <= 39) || f.op >= 44;
  memory(out, f, store, real, (f.op & 1) != 0, real && (f.op & 2) != 0 ? 2 : 1);
  return out;
}

/// The indexed forms; false where it is none.
bool memory_by_index(const Fields& f, Instruction& out) {
  switch (f.extended) {
    case 23:
    case 87:
    case 279:
    case 343:
    case 20:
    case 534:
    case 790: memory(out, f, false, false, false, 1); break;
    case 55:
    case 119:
    case 311:
    case 375: memory(out, f, false, false, true, 1); break;
    case 535:
    case 567: memory(out, f, false, true, f.extended == 567, 1); break;
    case 599:
    case 631: memory(out, f, false, true, f.extended == 631, 2); break;
    case 151:
    case 215:
    case 407:
    case 150:
    case 662:
    case 918: memory(out, f, true, false, false, 1); break;
    case 183:
    case 247:
    case 439: memory(out, f, true, false, true, 1); break;
    case 663:
    case 695: memory(out, f, true, true, f.extended == 695, 1); break;
    case 727:
    case 759: memory(out, f, true, true, f.extended == 759, 2); break;
    case 983: memory(out, f, true, true, false, 1); break;
    default: return false;
  }
  out.reads(f.b);
  return true;
}

Instruction special(const Fields& f) {
  Instruction out;
  out.kind = Class::kSpecial;
  const int spr = f.a | f.b << 5;
  const int reg = spr == 8 ? kLink : spr == 9 ? kCount : kCarry;
  if (f.extended == 467) {
    out.reads(f.d);
    out.writes(reg);
  } else {
    out.reads(reg);
    out.writes(f.d);
  }
  return out;
}

Instruction opcode_31(const Fields& f) {
  Instruction out;
  if (memory_by_index(f, out)) return out;
  switch (f.extended) {
    case 0:
    case 32: {
      out.reads(f.a);
      out.reads(f.b);
      out.writes(kFlags);
      return out;
    }
    case 28:
    case 60:
    case 444:
    case 412:
    case 316:
    case 124:
    case 476:
    case 284:
    case 24:
    case 536: return arithmetic(Class::kInteger, f.a, f.d, f.b);
    case 792:
      out = arithmetic(Class::kInteger, f.a, f.d, f.b);
      out.writes(kCarry);
      return out;
    case 824:
      out = arithmetic(Class::kInteger, f.a, f.d);
      out.writes(kCarry);
      return out;
    case 26:
    case 954:
    case 922: return arithmetic(Class::kInteger, f.a, f.d);
    case 19:
      out.kind = Class::kSpecial;
      out.reads(kFlags);
      out.writes(f.d);
      return out;
    case 144:
      out.kind = Class::kSpecial;
      out.reads(f.d);
      out.writes(kFlags);
      return out;
    case 339:
    case 467:
    case 371: return special(f);
    case 598:
    case 854:
    case 982:
    case 83:
    case 146: out.kind = Class::kSystem; return out;
    case 86:
    case 54:
    case 278:
    case 246:
    case 1014:
      out.kind = Class::kStore;
      out.words = 1;
      reads_base(out, f.a);
      out.reads(f.b);
      return out;
    default: break;
  }
  switch (f.extended & 0x1ff) {  // arithmetic, whose first bit asks for overflow
    case 235:
    case 75: return arithmetic(Class::kMultiply, f.d, f.a, f.b);
    case 11: return arithmetic(Class::kMultiplyUnsigned, f.d, f.a, f.b);
    case 459:
    case 491: return arithmetic(Class::kDivide, f.d, f.a, f.b);
    case 8:
    case 10:
      out = arithmetic(Class::kInteger, f.d, f.a, f.b);
      out.writes(kCarry);
      return out;
    case 136:
    case 138:
    case 200:
    case 202:
    case 232:
    case 234:
      out = arithmetic(Class::kInteger, f.d, f.a, f.b);
      out.reads(kCarry);
      out.writes(kCarry);
      return out;
    default: return arithmetic(Class::kInteger, f.d, f.a, f.b);
  }
}

/// 59 single, 63 double precision.
Instruction floating(const Fields& f) {
  Instruction out;
  const bool twice = f.op == 63;
  out.kind = Class::kFloat;
  const auto read = [&](int reg) { out.reads(kFloat0 + reg); };
  switch (f.extended & 31) {  // forms with up to three operands
    case 18:
      out.kind = twice ? Class::kFloatDivideDouble : Class::kFloatDivide;
      read(f.a);
      read(f.b);
      break;
    case 20:
    case 21:
      read(f.a);
      read(f.b);
      break;
    case 22:
    case 24:
      out.kind = Class::kFloatRoot;
      read(f.b);
      break;
    case 26:
      out.kind = Class::kFloatRootDouble;
      read(f.b);
      break;
    case 25:
      out.kind = twice ? Class::kFloatMultiplyDouble : Class::kFloatMultiply;
      read(f.a);
      read(f.c);
      break;
    case 23:
      read(f.a);
      read(f.b);
      read(f.c);
      break;
    case 28:
    case 29:
    case 30:
    case 31:
      out.kind = twice ? Class::kFloatFusedDouble : Class::kFloatFused;
      read(f.a);
      read(f.b);
      read(f.c);
      break;
    default:
      switch (f.extended) {
        case 0:
        case 32:
          out.kind = Class::kFloatCompare;
          read(f.a);
          read(f.b);
          out.writes(kFlags);
          return out;
        case 583: out.kind = Class::kFloatStatus; break;
        case 711:
        case 134:
        case 70:
        case 38:
        case 64:
          out.kind = Class::kFloatStatus;
          read(f.b);
          return out;
        default: read(f.b); break;
      }
      break;
  }
  out.writes(kFloat0 + f.d);
  return out;
}

Instruction branch(const Fields& f, std::uint32_t word) {
  Instruction out;
  out.kind = Class::kBranch;
  if (f.op == 18) {
    out.flow = f.record ? Flow::kCall : Flow::kJump;
  } else {
    const bool always = (f.d & 0x14) == 0x14;
    if (f.op == 16) {
      out.flow = f.record ? Flow::kCall : always ? Flow::kJump : Flow::kBranch;
    } else {
      out.kind = Class::kJump;
      out.reads(f.extended == 16 ? kLink : kCount);
      // A conditional return may fall through: both are found by where it goes.
      out.flow = f.record ? Flow::kIndirectCall : Flow::kIndirect;
    }
  }
  if ((word & 1) != 0) out.writes(kLink);
  return out;
}

}  // namespace

Instruction decode_ppc(std::uint32_t word) {
  const Fields f(word);
  Instruction out;
  switch (f.op) {
    case 7: return arithmetic(Class::kMultiplyShort, f.d, f.a);
    case 8:
    case 12:
      out = arithmetic(Class::kInteger, f.d, f.a);
      out.writes(kCarry);
      break;
    case 13:
      out = arithmetic(Class::kInteger, f.d, f.a);
      out.writes(kCarry);
      out.writes(kFlags);
      break;
    case 3: out.reads(f.a); break;
    case 10:
    case 11:
      out.reads(f.a);
      out.writes(kFlags);
      break;
    case 14:
    case 15:
      reads_base(out, f.a);
      out.writes(f.d);
      break;
    case 16:
    case 18: return branch(f, word);
    case 17: out.kind = Class::kSystem; break;
    case 19:
      if (f.extended == 16 || f.extended == 528) return branch(f, word);
      out.kind = f.extended == 150 || f.extended == 50 ? Class::kSystem : Class::kCondition;
      if (f.extended == 50) out.flow = Flow::kIndirect;
      out.reads(kFlags);
      out.writes(kFlags);
      break;
    case 20: out = arithmetic(Class::kInteger, f.a, f.d, f.a); break;
    case 21:
    case 24:
    case 25:
    case 26:
    case 27: out = arithmetic(Class::kInteger, f.a, f.d); break;
    case 23: out = arithmetic(Class::kInteger, f.a, f.d, f.b); break;
    case 28:
    case 29:
      out = arithmetic(Class::kInteger, f.a, f.d);
      out.writes(kFlags);
      return out;
    case 31: out = opcode_31(f); break;
    case 59:
    case 63: return floating(f);
    default:
      if (f.op >= 32 && f.op <= 55) return memory_by_offset(f);
      return out;
  }
  const bool records = f.op == 31 || f.op == 20 || f.op == 21 || f.op == 23;
  if (records && f.record && out.words == 0 && out.targets < 3) out.writes(kFlags);
  return out;
}

}  // namespace cairn::profile
