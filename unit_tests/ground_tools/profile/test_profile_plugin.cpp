// The plugin of `make profile` under QEMU's user mode, on two tiny programs whose counts are known by hand.
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "ground_tools/scratch.hpp"
#include "profile/budget.hpp"
#include "profile/profile.hpp"
#include "support/cmocka.hpp"

using namespace cairn;
using namespace cairn::ground;

namespace {

const std::string kSource = CAIRN_SOURCE_DIR;
const test::Scratch scratch;

struct Function {
  std::string name;
  std::vector<std::uint32_t> words;
};

class BigEndian {
 public:
  void u32(std::uint32_t v) {
    u16(v >> 16);
    u16(v & 0xffff);
  }
  void u16(std::uint32_t v) { bytes += {static_cast<char>(v >> 8 & 255), static_cast<char>(v & 255)}; }
  std::string bytes;
};

/// An ELF file of these functions, one after the other at `base` + 0x1000, and zeros up to `base` + 0x20000.
std::string elf(std::uint32_t machine, std::uint32_t base, const std::vector<Function>& functions) {
  BigEndian code;
  BigEndian symbols;
  std::string names(1, '\0');
  for (int i = 0; i < 4; ++i) symbols.u32(0);
  for (const Function& f : functions) {
    symbols.u32(static_cast<std::uint32_t>(names.size()));
    symbols.u32(base + 0x1000 + static_cast<std::uint32_t>(code.bytes.size()));
    symbols.u32(static_cast<std::uint32_t>(4 * f.words.size()));
    symbols.u32(0x12000001);  // global function in section 1
    names += f.name + '\0';
    for (const std::uint32_t w : f.words) code.u32(w);
  }
  const auto code_size = static_cast<std::uint32_t>(code.bytes.size());
  const auto symbols_size = static_cast<std::uint32_t>(symbols.bytes.size());
  const std::uint32_t symbols_at = 0x1000 + code_size;
  const std::uint32_t names_at = symbols_at + symbols_size;
  const auto names_size = static_cast<std::uint32_t>(names.size());
  BigEndian out;
  out.bytes = std::string("\177ELF\1\2\1", 7) + std::string(9, '\0');
  out.u16(2);
  out.u16(machine);
  for (const std::uint32_t v : {1U, base + 0x1000, 52U, 84U, 0U}) out.u32(v);
  for (const std::uint32_t v : {52U, 32U, 1U, 40U, 4U, 3U}) out.u16(v);
  for (const std::uint32_t v : {1U, 0U, base, base, 0x1000 + code_size, 0x20000U, 7U, 0x1000U}) out.u32(v);
  const std::vector<std::vector<std::uint32_t>> sections = {
      std::vector<std::uint32_t>(10, 0),
      {0, 1, 6, base + 0x1000, 0x1000, code_size, 0, 0, 4, 0},
      {0, 2, 0, 0, symbols_at, symbols_size, 3, 1, 4, 16},
      {0, 3, 0, 0, names_at, names_size, 0, 0, 1, 0},
  };
  for (const auto& section : sections) {
    for (const std::uint32_t v : section) out.u32(v);
  }
  out.bytes.resize(0x1000, '\0');
  return out.bytes + code.bytes + symbols.bytes + names;
}

const char* const kBudget =
    "frame = \"leaf\"\n[[job]]\nname = \"leaf\"\nbegins = \"leaf\"\ncalls = [\"leaf\"]\nbudget_s = { any = "
    "1.0 }\n";

bool have(const std::string& program) {
  return std::system(("command -v " + program + " >'" + scratch.path("which").string() + "'").c_str()) == 0;
}

std::string text_of(const std::string& name) {
  std::ifstream in(scratch.path(name), std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string errors;

/// Runs `image` under the plugin; false with `errors` where QEMU ends with another code than 0.
bool run(const std::string& qemu, const std::string& image, const std::string& target,
         const std::string& more = "") {
  scratch.file("image", image);
  scratch.file("budget.toml", kBudget);
  const std::string command =
      "chmod +x '" + scratch.path("image").string() + "' && " + qemu + " -plugin '" + kSource +
      "/build/profiler.so',elf='" + scratch.path("image").string() + "',timing='" + kSource + "/platform/" +
      target + "/timing.toml',budget='" + scratch.path("budget.toml").string() + "',out='" +
      scratch.path("run.tsv").string() + "'" + more + " '" + scratch.path("image").string() + "' 2>'" +
      scratch.path("errors").string() + "'";
  const bool good = std::system(command.c_str()) == 0;
  errors = text_of("errors");
  return good;
}

const ProfileFunction& named(const Profile& p, const std::string& name) {
  for (const ProfileFunction& f : p.functions) {
    if (f.name == name) return f;
  }
  fail_msg("no function %s", name.c_str());
  return p.functions[0];
}

std::string powerpc_program() {
  return elf(20, 0x10000000,
             {{"_start",
               {0x429f0005,                                      // bcl 20,31,.+4: no call
                0x386003e8, 0x7c6903a6, 0x38840001, 0x4200fffc,  // 1000 times: addi; bdnz
                0x48000015, 0x48000011,                          // bl leaf, twice
                0x38000001, 0x38600000, 0x44000002}},            // exit(0)
              {"leaf",
               {0x3ca01001, 0x38a50000, 0x38600040, 0x7c6903a6,  // r5 = 0x10010000; 64 times:
                0x80c50000, 0x38a50020, 0x4200fff8,              // lwz r6,0(r5); addi r5,r5,32; bdnz
                0x4e800020}}});                                  // blr
}

void test_powerpc(void**) {
  if (!have("qemu-ppc")) {
    print_message("skipped: no qemu-ppc\n");
    skip();
  }
  static Profile p;
  if (!run("qemu-ppc -cpu 750", powerpc_program(), "ppc750")) fail_msg("QEMU failed: %s", errors.c_str());
  p = read_profile(scratch.path("run.tsv"));
  assert_int_equal(p.total.instructions, 3 + 2000 + 2 + 3 + 2 * (4 + 3 * 64 + 1));
  assert_int_equal(named(p, "_start").self.instructions, 2008);
  assert_int_equal(named(p, "_start").calls, 1);
  assert_int_equal(named(p, "leaf").calls, 2);
  assert_int_equal(named(p, "leaf").longest.instructions, 197);
  assert_int_equal(named(p, "leaf").data_misses, 64);  // a line each; the second walk finds them all
  assert_int_equal(p.frames.size(), 2);
  assert_int_equal(p.detail_frame, 0);
  assert_int_equal(p.calls.size(), 2);
  // The first call also fetches its two lines of code and mispredicts its first branch.
  // 42 and 5 cycles: timing.toml.
  assert_int_equal(p.calls[0].cost.cycles - p.calls[1].cost.cycles, (64 + 2) * 42 + 5);
  // bl taken 1; lis, addi (which waits for nothing), li, mtctr 4; 64 times lwz, addi and 63 taken branches;
  // the last one, not taken, is mispredicted 5; blr taken 1 counts for the caller.
  assert_int_equal(p.calls[1].cost.cycles, 201);
  static std::string first;
  first = text_of("run.tsv");
  assert_true(run("qemu-ppc -cpu 750", powerpc_program(), "ppc750"));
  assert_true(first == text_of("run.tsv"));  // the same counts on each run
  assert_true(run("qemu-ppc -cpu 750", powerpc_program(), "ppc750", ",frame=1"));
  p = read_profile(scratch.path("run.tsv"));
  assert_int_equal(p.detail_frame, 1);
  assert_int_equal(named(p, "leaf").detail_self.instructions, 197);
  assert_int_equal(named(p, "leaf").detail_calls, 1);
}

// Delay slots, a function that returns a struct, register windows, a call in the tail.
void test_sparc(void**) {
  if (!have("qemu-sparc")) {
    print_message("skipped: no qemu-sparc\n");
    skip();
  }
  static Profile p;
  const std::uint32_t nop = 0x01000000;
  const std::string program =
      elf(2, 0x10000,
          {{"_start",
            {0xa0102064, 0xa0a42001, 0x12bfffff, nop,  // 100 times: deccc; bne; nop
             0x4000000e, nop, 0x4000000c, nop,         // call leaf, twice
             0x40000013, nop,                          // call frame
             0x40000016, nop, 0x00000008,              // call pair; unimp 8: it returns a struct
             0x40000015, nop,                          // call tail
             0x82102001, 0x90100000, 0x91d02010}},     // exit(0)
           {"leaf",
            {0x13000080, 0x92126000, 0x94102040,              // o1 = 0x20000; 64 times:
             0xd6024000, 0x94a2a001, 0x12bffffe, 0x92026004,  // ld [%o1],%o3; deccc; bne; add %o1,4,%o1
             0x81c3e008, nop}},                               // retl
           {"frame", {0x9de3bfa0, 0x7ffffff6, nop, 0x81c7e008, 0x81e80000}},  // save; call leaf; ret; restore
           {"pair", {0x81c3e00c, nop}},                                       // jmp %o7+12
           {"tail", {0x8210000f, 0x10bfffef, 0x9e100001}}});  // b leaf, which returns to the caller of tail
  if (!run("qemu-sparc -cpu LEON3", program, "leon3")) fail_msg("QEMU failed: %s", errors.c_str());
  p = read_profile(scratch.path("run.tsv"));
  assert_int_equal(named(p, "leaf").calls, 4);
  assert_int_equal(named(p, "leaf").longest.instructions, 3 + 4 * 64 + 2);
  assert_int_equal(named(p, "leaf").data_misses, 64);  // a word each
  assert_int_equal(named(p, "pair").inclusive.instructions, 2);
  assert_int_equal(named(p, "tail").inclusive.instructions, 3 + 261);
  // `restore` runs twice: QEMU's user mode has kept no window, so that the first one underflows.
  assert_int_equal(named(p, "frame").inclusive.instructions, 5 + 261 + 1);
  assert_int_equal(named(p, "_start").self.instructions, 1 + 300 + 10 + 3);
  std::map<std::string, std::string> called_by;
  for (std::size_t i = 1; i < p.nodes.size(); ++i) {
    std::string& list = called_by[p.functions[p.nodes[i].function].name];
    list += (list.empty() ? "" : " ") + p.functions[p.nodes[p.nodes[i].parent].function].name;
  }
  assert_string_equal(called_by["leaf"].c_str(), "_start frame tail");
  assert_string_equal(called_by["pair"].c_str(), "_start");
  assert_string_equal(called_by["tail"].c_str(), "_start");
}

void test_refuses(void**) {
  if (!have("qemu-ppc")) {
    print_message("skipped: no qemu-ppc\n");
    skip();
  }
  assert_false(run("qemu-ppc -cpu 750", powerpc_program(), "leon3"));
  assert_true(errors.find("is for another processor than ppc") != std::string::npos);
  assert_false(run("qemu-ppc -cpu 750", powerpc_program(), "ppc750", ",colour=red"));
  assert_true(errors.find("unknown argument 'colour=red'") != std::string::npos);
  assert_false(run("qemu-ppc -cpu 750", powerpc_program(), "no_such_board"));
  assert_true(errors.find("timing.toml") != std::string::npos);
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_powerpc),
      cmocka_unit_test(test_sparc),
      cmocka_unit_test(test_refuses),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
