// The model behind `make profile`, without QEMU: caches walked by hand, instructions as the GNU assembler
// encodes them, issue times and call trees worked out by hand.
#include <cstdio>
#include <string>
#include <vector>

#include "ground_tools/scratch.hpp"
#include "profile/function_name.hpp"
#include "profile/plugin/block.hpp"
#include "profile/plugin/cache.hpp"
#include "profile/plugin/profiler.hpp"
#include "profile/profile.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::profile;
using Found = Cache::Found;

namespace {

const std::string kSource = CAIRN_SOURCE_DIR;
const test::Scratch scratch;
Timing ppc;
Timing leon;
Timing riscv;

constexpr CacheShape kWriteBack = {32768, 8, 32, 32, true};
constexpr CacheShape kSubBlocks = {16384, 4, 16, 4, false};

int misses_of_walk(Cache& cache, std::uint32_t bytes, std::uint32_t stride) {
  int misses = 0;
  for (std::uint32_t at = 0; at < bytes; at += stride)
    misses += cache.read(0x40000000U + at, 1) != Found::kHit;
  return misses;
}

void test_walks_through_a_cache(void**) {
  static Cache cache(kWriteBack);
  assert_int_equal(misses_of_walk(cache, 32768, 4), 1024);  // a miss a line
  assert_int_equal(misses_of_walk(cache, 32768, 4), 0);     // all of it fits
  assert_int_equal(misses_of_walk(cache, 65536, 32), 1024);
  // Twice what fits, and the least recently used goes: never a hit.
  assert_int_equal(misses_of_walk(cache, 65536, 32), 2048);
}

void test_least_recently_used_goes(void**) {
  static Cache cache(kWriteBack);
  constexpr std::uint32_t kWay = 32768 / 8;
  for (std::uint32_t i = 0; i < 8; ++i) assert_int_equal(cache.read(i * kWay, 1), Found::kMiss);
  assert_int_equal(cache.read(0, 1), Found::kHit);
  assert_int_equal(cache.read(8 * kWay, 1), Found::kMiss);
  assert_int_equal(cache.read(0, 1), Found::kHit);
  assert_int_equal(cache.read(1 * kWay, 1), Found::kMiss);
  assert_int_equal(cache.read(2 * kWay + 32, 1), Found::kMiss);  // the next set is another matter
}

void test_changed_lines_go_out(void**) {
  static Cache cache(kWriteBack);
  for (std::uint32_t at = 0; at < 32768; at += 32) assert_int_equal(cache.write(at), Found::kMiss);
  assert_int_equal(cache.write(4), Found::kHit);
  int cast_out = 0;
  for (std::uint32_t at = 32768; at < 65536; at += 32) cast_out += cache.read(at, 1) == Found::kMissCastOut;
  assert_int_equal(cast_out, 1024);
  assert_int_equal(cache.read(0, 1), Found::kMiss);  // what went in unchanged goes out without a word
}

void test_sub_blocks_and_write_through(void**) {
  static Cache cache(kSubBlocks);
  assert_int_equal(misses_of_walk(cache, 4096, 4), 1024);  // a miss a word
  assert_int_equal(misses_of_walk(cache, 4096, 4), 0);
  assert_int_equal(cache.write(0x1000), Found::kMiss);
  assert_int_equal(cache.read(0x1000, 1), Found::kMiss);  // a store does not bring the line
  assert_int_equal(cache.write(0x1000), Found::kHit);
  assert_int_equal(cache.read(0x1000, 2), Found::kMiss);  // the second word is not there yet
  assert_int_equal(cache.read(0x1000, 2), Found::kHit);
}

struct Expected {
  std::uint32_t word;
  Class kind;
  Flow flow;
  int words;
  std::vector<int> sources;
  std::vector<int> targets;
};

void check(const Expected& e, const Instruction& i) {
  const bool same = i.kind == e.kind && i.flow == e.flow && i.words == e.words &&
                    std::vector<int>(i.source, i.source + i.sources) == e.sources &&
                    std::vector<int>(i.target, i.target + i.targets) == e.targets;
  if (!same)
    fail_msg("%08x: decoded as %s, flow %d, %d words, %d sources, %d targets", e.word,
             kClassNames[static_cast<int>(i.kind)], static_cast<int>(i.flow), i.words, i.sources, i.targets);
}

void test_decodes_powerpc(void**) {
  constexpr int f = kFloat0;
  static const std::vector<Expected> table = {
      {0x84640004, Class::kLoad, Flow::kNext, 1, {4}, {3, 4}},              // lwzu r3,4(r4)
      {0x7ca6392e, Class::kStore, Flow::kNext, 1, {6, 5, 7}, {}},           // stwx r5,r6,r7
      {0xc8230008, Class::kLoadDouble, Flow::kNext, 2, {3}, {f + 1}},       // lfd f1,8(r3)
      {0xd0400000, Class::kStore, Flow::kNext, 1, {f + 2}, {}},             // stfs f2,0(0)
      {0x7c6429d6, Class::kMultiply, Flow::kNext, 0, {4, 5}, {3}},          // mullw r3,r4,r5
      {0x7c642816, Class::kMultiplyUnsigned, Flow::kNext, 0, {4, 5}, {3}},  // mulhwu r3,r4,r5
      {0x7c642b96, Class::kDivide, Flow::kNext, 0, {4, 5}, {3}},            // divwu r3,r4,r5
      {0x38600001, Class::kInteger, Flow::kNext, 0, {}, {3}},               // li r3,1
      {0x7c642a15, Class::kInteger, Flow::kNext, 0, {4, 5}, {3, kFlags}},   // add. r3,r4,r5
      {0x7c830e70, Class::kInteger, Flow::kNext, 0, {4}, {3, kCarry}},      // srawi r3,r4,1
      {0x5483000e, Class::kInteger, Flow::kNext, 0, {4}, {3}},              // clrrwi r3,r4,24
      {0x7c032000, Class::kInteger, Flow::kNext, 0, {3, 4}, {kFlags}},      // cmpw r3,r4
      // fmadd f1,f2,f3,f4
      {0xfc2220fa, Class::kFloatFusedDouble, Flow::kNext, 0, {f + 2, f + 4, f + 3}, {f + 1}},
      {0xec2200f2, Class::kFloatMultiply, Flow::kNext, 0, {f + 2, f + 3}, {f + 1}},      // fmuls f1,f2,f3
      {0xfc221824, Class::kFloatDivideDouble, Flow::kNext, 0, {f + 2, f + 3}, {f + 1}},  // fdiv f1,f2,f3
      {0xfc221828, Class::kFloat, Flow::kNext, 0, {f + 2, f + 3}, {f + 1}},              // fsub f1,f2,f3
      {0xfc011000, Class::kFloatCompare, Flow::kNext, 0, {f + 1, f + 2}, {kFlags}},      // fcmpu cr0,f1,f2
      {0x7c0803a6, Class::kSpecial, Flow::kNext, 0, {0}, {kLink}},                       // mtlr r0
      {0x4e800020, Class::kJump, Flow::kIndirect, 0, {kLink}, {}},                       // blr
      {0x4e800421, Class::kJump, Flow::kIndirectCall, 0, {kCount}, {kLink}},             // bctrl
      {0x48000001, Class::kBranch, Flow::kCall, 0, {}, {kLink}},                         // bl .
      {0x40820000, Class::kBranch, Flow::kBranch, 0, {}, {}},                            // bne .
      {0xbba10008, Class::kLoadMultiple, Flow::kNext, 3, {1}, {31}},                     // lmw r29,8(r1)
      {0x9421fff0, Class::kStore, Flow::kNext, 1, {1, 1}, {1}},                          // stwu r1,-16(r1)
  };
  for (const Expected& e : table) check(e, decode_ppc(e.word));
}

void test_decodes_sparc(void**) {
  constexpr int f = kFloat0;
  static const std::vector<Expected> table = {
      {0xd2022004, Class::kLoad, Flow::kNext, 1, {8}, {9}},                   // ld [%o0+4],%o1
      {0xc43ba040, Class::kStoreDouble, Flow::kNext, 2, {14, 2, 3}, {}},      // std %g2,[%sp+64]
      {0xc51a0000, Class::kLoadDouble, Flow::kNext, 2, {8}, {f + 2, f + 3}},  // ldd [%o0],%f2
      {0xc7220000, Class::kStore, Flow::kNext, 1, {8, f + 3}, {}},            // st %f3,[%o0]
      {0x92002001, Class::kInteger, Flow::kNext, 0, {}, {9}},                 // add %g0,1,%o1
      {0x80a2400a, Class::kInteger, Flow::kNext, 0, {9, 10}, {kFlags}},       // cmp %o1,%o2
      {0x9642400a, Class::kInteger, Flow::kNext, 0, {9, 10, kFlags}, {11}},   // addx %o1,%o2,%o3
      {0x965a400a, Class::kMultiply, Flow::kNext, 0, {9, 10}, {11, kCarry}},  // smul %o1,%o2,%o3
      {0x9672400a, Class::kDivide, Flow::kNext, 0, {9, 10, kCarry}, {11}},    // udiv %o1,%o2,%o3
      {0x89a00942,
       Class::kFloatMultiplyDouble,
       Flow::kNext,
       0,
       {f, f + 1, f + 2, f + 3},
       {f + 4, f + 5}},                                                                   // fmuld
      {0x85a00540, Class::kFloatRootDouble, Flow::kNext, 0, {f, f + 1}, {f + 2, f + 3}},  // fsqrtd %f0,%f2
      {0x87a049a2, Class::kFloatDivide, Flow::kNext, 0, {f + 1, f + 2}, {f + 3}},         // fdivs %f1,%f2,%f3
      {0x83a018c4, Class::kFloat, Flow::kNext, 0, {f + 4, f + 5}, {f + 1}},               // fdtos %f4,%f1
      {0x89a01901, Class::kFloat, Flow::kNext, 0, {f + 1}, {f + 4, f + 5}},               // fitod %f1,%f4
      // fcmpd %f0,%f2
      {0x81a80a42, Class::kFloatCompare, Flow::kNext, 0, {f, f + 1, f + 2, f + 3}, {kFloatFlags}},
      {0x09bfffff, Class::kBranch, Flow::kBranch, 0, {kFloatFlags}, {}},  // fbl
      {0x12800000, Class::kBranch, Flow::kBranch, 0, {kFlags}, {}},       // bne
      {0x10800000, Class::kBranch, Flow::kJump, 0, {}, {}},               // b
      {0x40000000, Class::kBranch, Flow::kCall, 0, {}, {15}},             // call
      {0x9de3bfa0, Class::kWindow, Flow::kNext, 0, {14}, {14}},           // save %sp,-96,%sp
      {0x81c3e008, Class::kJump, Flow::kIndirect, 0, {15}, {}},           // retl
      {0x9fc04000, Class::kJump, Flow::kIndirectCall, 0, {1}, {15}},      // call %g1
      {0x11048d15, Class::kInteger, Flow::kNext, 0, {}, {8}},             // sethi %hi(..),%o0
  };
  for (const Expected& e : table) check(e, decode_sparc(e.word));
}

void test_decodes_riscv(void**) {
  constexpr int f = kFloat0;
  static const std::vector<Expected> table = {
      {0x7cc6b823, Class::kStore, Flow::kNext, 1, {13, 12}, {}},                        // sd a2,2000(a3)
      {0x0642b187, Class::kLoad, Flow::kNext, 1, {5}, {f + 3}},                         // fld ft3,100(t0)
      {0x00c58533, Class::kInteger, Flow::kNext, 0, {11, 12}, {10}},                    // add a0,a1,a2
      {0x02c5853b, Class::kMultiply, Flow::kNext, 0, {11, 12}, {10}},                   // mulw a0,a1,a2
      {0x02c5d533, Class::kDivide, Flow::kNext, 0, {11, 12}, {10}},                     // divu a0,a1,a2
      {0x00005537, Class::kInteger, Flow::kNext, 0, {}, {10}},                          // lui a0,5
      {0x02c5f553, Class::kFloat, Flow::kNext, 0, {f + 11, f + 12}, {f + 10}},          // fadd.d fa0,fa1,fa2
      {0x10c5f553, Class::kFloatMultiply, Flow::kNext, 0, {f + 11, f + 12}, {f + 10}},  // fmul.s
      {0x1ac5f553, Class::kFloatDivideDouble, Flow::kNext, 0, {f + 11, f + 12}, {f + 10}},  // fdiv.d
      {0x5a05f553, Class::kFloatRootDouble, Flow::kNext, 0, {f + 11}, {f + 10}},            // fsqrt.d fa0,fa1
      // fmadd.d fa0,fa1,fa2,fa3
      {0x6ac5f543, Class::kFloatFusedDouble, Flow::kNext, 0, {f + 11, f + 12, f + 13}, {f + 10}},
      {0xa2c59553, Class::kFloatCompare, Flow::kNext, 0, {f + 11, f + 12}, {10}},      // flt.d a0,fa1,fa2
      {0xc205f553, Class::kFloatCompare, Flow::kNext, 0, {f + 11}, {10}},              // fcvt.w.d a0,fa1
      {0xd2058553, Class::kFloatCompare, Flow::kNext, 0, {11}, {f + 10}},              // fcvt.d.w fa0,a1
      {0x4015f553, Class::kFloatCompare, Flow::kNext, 0, {f + 11}, {f + 10}},          // fcvt.s.d fa0,fa1
      {0x22c58553, Class::kFloatCompare, Flow::kNext, 0, {f + 11, f + 12}, {f + 10}},  // fsgnj.d
      {0x00b50063, Class::kBranch, Flow::kBranch, 0, {10, 11}, {}},                    // beq a0,a1,.
      {0x000000ef, Class::kBranch, Flow::kCall, 0, {}, {1}},                           // jal ra,.
      {0x0000006f, Class::kBranch, Flow::kJump, 0, {}, {}},                            // j .
      {0x000780e7, Class::kJump, Flow::kIndirectCall, 0, {15}, {1}},                   // jalr ra,0(a5)
      {0x00008067, Class::kJump, Flow::kIndirect, 0, {1}, {}},                         // ret
      {0x0ff0000f, Class::kSystem, Flow::kNext, 0, {}, {}},                            // fence
      {0x00102573, Class::kSpecial, Flow::kNext, 0, {}, {10}},                         // frflags a0
      {0x41c8, Class::kLoad, Flow::kNext, 1, {11}, {10}},                              // lw a0,4(a1)
      {0x6442, Class::kLoad, Flow::kNext, 1, {2}, {8}},                                // ld s0,16(sp)
      {0x2508, Class::kLoad, Flow::kNext, 1, {10}, {f + 10}},                          // fld fa0,8(a0)
      {0xac22, Class::kStore, Flow::kNext, 1, {2, f + 8}, {}},                         // fsd fs0,24(sp)
      {0xf406, Class::kStore, Flow::kNext, 1, {2, 1}, {}},                             // sd ra,40(sp)
      {0xc1c8, Class::kStore, Flow::kNext, 1, {11, 10}, {}},                           // sw a0,4(a1)
      {0x0505, Class::kInteger, Flow::kNext, 0, {10}, {10}},                           // addi a0,a0,1
      {0x2505, Class::kInteger, Flow::kNext, 0, {10}, {10}},                           // addiw a0,a0,1
      {0x852e, Class::kInteger, Flow::kNext, 0, {11}, {10}},                           // mv a0,a1
      {0x952e, Class::kInteger, Flow::kNext, 0, {11, 10}, {10}},                       // add a0,a0,a1
      {0x8d0d, Class::kInteger, Flow::kNext, 0, {10, 11}, {10}},                       // sub a0,a0,a1
      {0x810d, Class::kInteger, Flow::kNext, 0, {10}, {10}},                           // srli a0,a0,3
      {0x7139, Class::kInteger, Flow::kNext, 0, {2}, {2}},                             // addi sp,sp,-64
      {0x0808, Class::kInteger, Flow::kNext, 0, {2}, {10}},                            // addi a0,sp,16
      {0x4505, Class::kInteger, Flow::kNext, 0, {}, {10}},                             // li a0,1
      {0x8082, Class::kJump, Flow::kIndirect, 0, {1}, {}},                             // ret
      {0x9782, Class::kJump, Flow::kIndirectCall, 0, {15}, {1}},                       // jalr a5
      {0xa001, Class::kBranch, Flow::kJump, 0, {}, {}},                                // j .
      {0xe101, Class::kBranch, Flow::kBranch, 0, {10}, {}},                            // bnez a0,.
  };
  for (const Expected& e : table) check(e, decode_riscv(e.word));
}

Block block_of(const Timing& timing, const std::vector<std::uint32_t>& words) {
  std::vector<Instruction> code;
  for (const std::uint32_t w : words)
    code.push_back(timing.isa == Isa::kSparc   ? decode_sparc(w)
                   : timing.isa == Isa::kRiscv ? decode_riscv(w)
                                               : decode_ppc(w));
  return make_block(timing, 0x1000, code);
}

void test_lengths_of_instructions(void**) {
  static Block b;
  b = block_of(riscv, {0x0505, 0x00c58533, 0x8082});  // addi, add, ret: 2, 4 and 2 bytes
  assert_int_equal(b.length, 3);
  assert_int_equal(b.last, 0x1006);
  assert_int_equal(b.end, 0x1008);
  b = block_of(ppc, {0x38600001, 0x4e800020});
  assert_int_equal(b.last, 0x1004);
  assert_int_equal(b.end, 0x1008);
}

void test_waits_for_operands_and_units(void**) {
  static Block b;
  // lwz r3 (ready after 2), add r4,r3,r3 in cycle 2, blr folded.
  b = block_of(ppc, {0x80630000, 0x7c831a14, 0x4e800020});
  assert_int_equal(b.issued[1], 2);
  assert_int_equal(b.cycles, 3);
  assert_true(b.pending.empty());
  // fdiv f1,f2,f3 keeps the unit for 31 cycles; the second one, then fsub f1,f2,f3 in cycle 62;
  // ready 3 after it.
  b = block_of(ppc, {0xfc221824, 0xfc221824, 0xfc221828});
  assert_int_equal(b.issued[1], 31);
  assert_int_equal(b.issued[2], 62);
  assert_int_equal(b.cycles, 63);
  assert_int_equal(b.pending.size(), 1);
  assert_int_equal(b.pending[0].resource, kFloat0 + 1);
  assert_int_equal(b.pending[0].cycles, 2);
  // cmp %o1,%o2 and at once bne: the branch sees the flags three cycles after (GRIP: branch interlock
  // of up to 2).
  b = block_of(leon, {0x80a2400a, 0x12800000, 0x01000000});
  assert_int_equal(b.issued[1], 3);
  assert_int_equal(b.cycles, 5);
}

void test_results_under_way_between_blocks(void**) {
  static Block load;
  static Block use;
  static Block other;
  static InFlight in_flight;
  load = block_of(ppc, {0x38600001, 0xfc221824});   // li r3,1; fdiv f1,f2,f3: f1 is ready 31 after cycle 1
  use = block_of(ppc, {0x38600001, 0xfc220828});    // li r3,1; fsub f1,f2,f1 in cycle 1
  other = block_of(ppc, {0x38600001, 0x38600001});  // nothing of it
  in_flight.after(load, 100);
  assert_int_equal(in_flight.wait(other, 100), 0);
  assert_int_equal(in_flight.wait(use, 100), 100 + 30 - 101);
  in_flight.after(other, 102);
  assert_int_equal(in_flight.wait(use, 102), 27);
  in_flight.after(other, 130);
  assert_int_equal(in_flight.wait(use, 130), 0);
}

Block at(std::uint32_t start, std::uint32_t length, int function, Flow flow, bool slot_missing = false) {
  Block b = make_block(leon, start, std::vector<Instruction>(length));
  b.function = function;
  b.flow = flow;
  b.slot_missing = slot_missing;
  b.first_line = start / 32;
  b.last_line = (b.end - 4) / 32;
  return b;
}

ground::Profile finished(Profiler& profiler, const std::vector<Block*>& blocks) {
  std::FILE* out = std::fopen(scratch.path("run.tsv").c_str(), "w");
  profiler.finish(out, blocks);
  std::fclose(out);
  return ground::read_profile(scratch.path("run.tsv"));
}

const ground::ProfileFunction& named(const ground::Profile& p, const std::string& name) {
  for (const ground::ProfileFunction& f : p.functions) {
    if (f.name == name) return f;
  }
  fail_msg("no function %s", name.c_str());
  return p.functions[0];
}

// `ret; restore` whose restore runs into a window underflow: the trap comes between the jump and its target.
void test_trap_in_a_delay_slot(void**) {
  static ground::Profile p;
  static std::vector<Block> b = {
      at(0x1000, 3, 2, Flow::kCall),            // caller: call callee; nop
      at(0x2000, 5, 3, Flow::kNext),            // callee
      at(0x2014, 1, 3, Flow::kIndirect, true),  // ret
      at(0x2018, 1, 3, Flow::kNext),            // restore
      at(0x0060, 4, 1, Flow::kIndirect),        // the trap table's entry
      at(0x3000, 9, 4, Flow::kIndirect),        // the handler, with rett
      at(0x100c, 2, 2, Flow::kNext),            // after the call
  };
  b[5].ends_trap = true;
  static Profiler profiler(leon,
                           {{0, 0, "(elsewhere)"},
                            {0x0, 0x1000, "_trap_table"},
                            {0x1000, 0x2000, "caller"},
                            {0x2000, 0x3000, "callee"},
                            {0x3000, 0x4000, "handler"}},
                           {{"callee"}, "caller", -1});
  for (const int i : {0, 1, 2, 3, 4, 5, 3, 6, 0, 1, 2, 3, 6}) profiler.enter(b[static_cast<std::size_t>(i)]);
  static std::vector<Block*> all;
  for (Block& block : b) all.push_back(&block);
  p = finished(profiler, all);
  assert_int_equal(named(p, "callee").calls, 2);
  assert_int_equal(named(p, "callee").inclusive.instructions, (5 + 1 + 1) + (4 + 9 + 1) + (5 + 1 + 1));
  assert_int_equal(named(p, "callee").longest.instructions, 7 + 14);
  assert_int_equal(named(p, "caller").self.instructions, 2 * (3 + 2));
  assert_int_equal(p.calls.size(), 2);
  assert_int_equal(p.calls[1].at, 3 + 21 + 2 + 3);
  assert_int_equal(p.total.instructions, 10 + 28);
}

void test_names(void**) {
  assert_string_equal(plain_name("_ZN5cairn9Localizer7step_voERNS_10WorkBudgetE").c_str(),
                      "cairn::Localizer::step_vo");
  assert_string_equal(short_name("_ZN5cairn9Localizer7step_voERNS_10WorkBudgetE").c_str(),
                      "Localizer::step_vo");
  assert_string_equal(short_name("_ZN5cairn12_GLOBAL__N_18describeERKi").c_str(), "describe");
  assert_string_equal(short_name("_ZN5cairn12_GLOBAL__N_18describeERKi.part.0").c_str(), "describe");
  // void cairn::sort<int, 3>(int*)
  assert_string_equal(short_name("_ZN5cairn4sortIiLi3EEEvPi").c_str(), "sort<..>");
  assert_string_equal(short_name("_ZNK5cairn5Pose3ltERKS0_").c_str(), "Pose3::operator<");
  assert_string_equal(short_name("_ZN5cairn4ModeclEi").c_str(), "Mode::operator()");
  assert_string_equal(short_name("memcpy").c_str(), "memcpy");
  assert_true(is_fragment("_ZN5cairn3fooEv.cold"));
  assert_false(is_fragment("_ZN5cairn3fooEv"));
}

std::string reason(const char* text) {
  try {
    static_cast<void>(read_timing(scratch.file("timing.toml", text).string()));
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

void test_refuses_bad_timing(void**) {
  static std::string why;
  why = reason("name = \"x\"\nisa = \"z80\"\n");
  assert_true(why.find("isa must be") != std::string::npos);
  why = reason("name = \"x\"\nisa = = \n");
  assert_true(why.find("timing.toml:2:") != std::string::npos);
  why =
      reason("isa = \"ppc\"\nclock_mhz = 1.0\n[branch]\ntaken = 1\nmispredicted = 1\nhistory_entries = 3\n");
  assert_true(why.find("history_entries must be a power of two") != std::string::npos);
  assert_true(why.find('\n') == std::string::npos);
}

// What a variant names changes, and nothing else.
void test_variant_of_a_board(void**) {
  const std::string path = kSource + "/platform/leon3/timing.toml";
  const Timing slow = read_timing(path, "slow_memory");
  assert_int_equal(slow.read_miss, 2 * leon.read_miss);
  assert_int_equal(slow.fetch_miss, 2 * leon.fetch_miss);
  assert_int_equal(slow.write, 2 * leon.write);
  assert_int_equal(slow.data_cache.bytes, leon.data_cache.bytes);
  assert_int_equal(slow.cost[0].latency, leon.cost[0].latency);
  const Timing small = read_timing(path, "small_cache");
  assert_int_equal(2 * small.data_cache.bytes, leon.data_cache.bytes);
  assert_int_equal(2 * small.instruction_cache.bytes, leon.instruction_cache.bytes);
  assert_int_equal(small.read_miss, leon.read_miss);
  const Timing lite = read_timing(path, "grfpu_lite");
  int changed = 0;
  for (int i = 0; i < kClasses; ++i) changed += lite.cost[i].latency > leon.cost[i].latency ? 1 : 0;
  assert_int_equal(changed, 8);
  assert_int_equal(lite.read_miss, leon.read_miss);
  static std::string why;
  try {
    static_cast<void>(read_timing(path, "warp"));
  } catch (const std::exception& error) {
    why = error.what();
  }
  assert_true(why.find("no table [variant.warp]") != std::string::npos);
}

int setup(void**) {
  ppc = read_timing(kSource + "/platform/ppc750/timing.toml");
  leon = read_timing(kSource + "/platform/leon3/timing.toml");
  riscv = read_timing(kSource + "/platform/riscv64/timing.toml");
  return 0;
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_walks_through_a_cache),
      cmocka_unit_test(test_least_recently_used_goes),
      cmocka_unit_test(test_changed_lines_go_out),
      cmocka_unit_test(test_sub_blocks_and_write_through),
      cmocka_unit_test(test_decodes_powerpc),
      cmocka_unit_test(test_decodes_sparc),
      cmocka_unit_test(test_decodes_riscv),
      cmocka_unit_test(test_lengths_of_instructions),
      cmocka_unit_test(test_waits_for_operands_and_units),
      cmocka_unit_test(test_results_under_way_between_blocks),
      cmocka_unit_test(test_trap_in_a_delay_slot),
      cmocka_unit_test(test_names),
      cmocka_unit_test(test_refuses_bad_timing),
      cmocka_unit_test(test_variant_of_a_board),
  };
  return cmocka_run_group_tests(tests, setup, nullptr);
}
