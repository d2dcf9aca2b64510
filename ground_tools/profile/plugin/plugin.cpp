// The door to QEMU: cuts translated code into blocks and hands over what runs.
//
//   qemu-... -plugin profile.so,elf=IMAGE,timing=FILE[,variant=NAME],out=FILE[,budget=FILE][,frame=N]
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <exception>
#include <stdexcept>
#include <string>

#include "profile/plugin/profiler.hpp"
#include "profile/plugin/qemu_plugin.hpp"

namespace cairn::profile {
namespace {

// QEMU calls C functions and gives each only a number, so the state is here. One processor: no locks. Nothing
// of it is ever destroyed: QEMU tells of the exit after the destructors of static objects.
Profiler* profiler = nullptr;
std::deque<Block>& blocks = *new std::deque<Block>;
std::FILE* output = nullptr;

void on_block(unsigned, void* data) { profiler->enter(*static_cast<Block*>(data)); }

/// Words and offset travel in the place of a pointer.
void* packed(std::uint32_t words, std::int32_t offset) {
  return reinterpret_cast<void*>(static_cast<std::intptr_t>(offset) * 256 +
                                 static_cast<std::intptr_t>(words));
}
void on_read(unsigned, qemu_plugin_meminfo_t, std::uint64_t address, void* data) {
  const auto bits = reinterpret_cast<std::intptr_t>(data);
  profiler->read(static_cast<std::uint32_t>(address), static_cast<std::uint32_t>(bits & 255),
                 static_cast<std::int32_t>(bits >> 8));
}
void on_write(unsigned, qemu_plugin_meminfo_t, std::uint64_t address, void* data) {
  const auto bits = reinterpret_cast<std::intptr_t>(data);
  profiler->write(static_cast<std::uint32_t>(address), static_cast<std::uint32_t>(bits & 255),
                  static_cast<std::int32_t>(bits >> 8));
}

void on_either(unsigned cpu, qemu_plugin_meminfo_t info, std::uint64_t address, void* data) {
  (qemu_plugin_mem_is_store(info) ? on_write : on_read)(cpu, info, address, data);
}
qemu_plugin_vcpu_mem_cb_t memory_call(Class kind) {
  switch (kind) {
    case Class::kLoad:
    case Class::kLoadDouble:
    case Class::kLoadMultiple: return on_read;
    case Class::kStore:
    case Class::kStoreDouble:
    case Class::kStoreMultiple: return on_write;
    default: return on_either;
  }
}

Instruction instruction_at(const qemu_plugin_tb* tb, std::size_t index, Isa isa) {
  const qemu_plugin_insn* at = qemu_plugin_tb_get_insn(tb, index);
  const auto* p = static_cast<const std::uint8_t*>(qemu_plugin_insn_data(at));
  if (isa == Isa::kRiscv) {
    std::uint32_t word = 0;
    for (std::size_t i = qemu_plugin_insn_size(at); i-- > 0;) word = word << 8 | p[i];
    return decode_riscv(word);
  }
  const std::uint32_t word =
      std::uint32_t{p[0]} << 24 | std::uint32_t{p[1]} << 16 | std::uint32_t{p[2]} << 8 | p[3];
  return isa == Isa::kSparc ? decode_sparc(word) : decode_ppc(word);
}

void set_flow(Block& block, const std::vector<Instruction>& code, Isa isa) {
  const std::size_t n = code.size();
  if (isa != Isa::kSparc) {
    block.flow = code[n - 1].flow;
  } else if (n >= 2 && code[n - 2].flow != Flow::kNext) {
    block.flow = code[n - 2].flow;
  } else {
    block.flow = code[n - 1].flow;
    block.slot_missing = block.flow != Flow::kNext && block.flow != Flow::kBranch;
  }
}

/// Instructions [from, end) as a block of their own. `first`: QEMU tells of it when
/// the whole translation begins.
void add_block(qemu_plugin_tb* tb, std::size_t from, const std::vector<Instruction>& code, bool first) {
  const Timing& timing = profiler->timing();
  const auto start = static_cast<std::uint32_t>(qemu_plugin_insn_vaddr(qemu_plugin_tb_get_insn(tb, from)));
  blocks.push_back(make_block(timing, start, code));
  Block& block = blocks.back();
  block.function = find_symbol(profiler->symbols(), start);
  block.first_line = profiler->fetch_line(start);
  block.last_line = profiler->fetch_line(block.end - 1);
  set_flow(block, code, timing.isa);
  if (first) {
    qemu_plugin_register_vcpu_tb_exec_cb(tb, on_block, QEMU_PLUGIN_CB_NO_REGS, &block);
  } else {
    qemu_plugin_register_vcpu_insn_exec_cb(qemu_plugin_tb_get_insn(tb, from), on_block,
                                           QEMU_PLUGIN_CB_NO_REGS, &block);
  }
  for (std::size_t i = 0; i < code.size(); ++i) {
    if (code[i].words == 0) continue;
    const bool many = code[i].kind == Class::kLoadMultiple || code[i].kind == Class::kStoreMultiple;
    void* data = packed(many ? 1 : code[i].words,
                        static_cast<std::int32_t>(block.issued[i]) - static_cast<std::int32_t>(block.cycles));
    // Asked for reads alone, QEMU 7.2 tells of none.
    qemu_plugin_register_vcpu_mem_cb(qemu_plugin_tb_get_insn(tb, from + i), memory_call(code[i].kind),
                                     QEMU_PLUGIN_CB_NO_REGS, QEMU_PLUGIN_MEM_RW, data);
  }
}

/// A block ends where QEMU's translation does, and after an instruction that may trap: the trap takes up
/// again with that instruction, and what follows it must not be counted twice. In a delay slot it is a block
/// alone, so that the jump is not taken for done.
void on_translation(qemu_plugin_id_t, qemu_plugin_tb* tb) {
  const std::size_t count = qemu_plugin_tb_n_insns(tb);
  std::vector<Instruction> code;
  std::size_t from = 0;
  const auto cut = [&](std::size_t end) {
    add_block(tb, from, code, from == 0);
    code.clear();
    from = end;
  };
  for (std::size_t i = 0; i < count; ++i) {
    const Instruction next = instruction_at(tb, i, profiler->timing().isa);
    if (next.splits && !code.empty() && code.back().flow != Flow::kNext) cut(i);
    code.push_back(next);
    if (i + 1 == count || next.splits) cut(i + 1);
  }
}

void on_exit(qemu_plugin_id_t, void*) {
  std::vector<Block*> all;
  for (Block& b : blocks) all.push_back(&b);
  profiler->finish(output, all);
  if (std::fclose(output) != 0) std::fprintf(stderr, "profile: the output is not whole; is the disk full?\n");
}

struct Arguments {
  std::string elf;
  std::string timing;
  std::string variant;
  std::string out;
  ProfilerOptions options;
};

Arguments parse(int argc, char** argv) {
  Arguments out;
  for (int i = 0; i < argc; ++i) {
    const std::string text = argv[i];
    const std::size_t at = text.find('=');
    const std::string key = text.substr(0, at);
    const std::string value = at == std::string::npos ? "" : text.substr(at + 1);
    if (key == "elf") {
      out.elf = value;
    } else if (key == "timing") {
      out.timing = value;
    } else if (key == "variant") {
      out.variant = value;
    } else if (key == "out") {
      out.out = value;
    } else if (key == "budget") {
      const Watch watch = read_watch(value);
      out.options.mark = watch.frame;
      out.options.watch = watch.calls;
    } else if (key == "frame") {
      out.options.frame = std::strtol(value.c_str(), nullptr, 10);
    } else {
      throw std::runtime_error("unknown argument '" + text + "'");
    }
  }
  if (out.elf.empty() || out.timing.empty() || out.out.empty())
    throw std::runtime_error("elf=IMAGE, timing=FILE and out=FILE must be given");
  return out;
}

void install(qemu_plugin_id_t id, const qemu_info_t& info, int argc, char** argv) {
  const Arguments arguments = parse(argc, argv);
  const Timing timing = read_timing(arguments.timing, arguments.variant);
  const char* const family = timing.isa == Isa::kPpc ? "ppc" : timing.isa == Isa::kSparc ? "sparc" : "riscv";
  if (std::string(info.target_name).rfind(family, 0) != 0)
    throw std::runtime_error(arguments.timing + ": is for another processor than " + info.target_name);
  if (info.system_emulation && info.system.smp_vcpus > 1)
    throw std::runtime_error("one processor only; run QEMU without -smp");
  profiler = new Profiler(timing, read_symbols(arguments.elf), arguments.options);
  output = std::fopen(arguments.out.c_str(), "w");
  if (output == nullptr) throw std::runtime_error(arguments.out + ": cannot be written");
  qemu_plugin_register_vcpu_tb_trans_cb(id, on_translation);
  qemu_plugin_register_atexit_cb(id, on_exit, nullptr);
}

}  // namespace
}  // namespace cairn::profile

extern "C" {

__attribute__((visibility("default"))) extern const int qemu_plugin_version;
const int qemu_plugin_version = 1;

__attribute__((visibility("default"))) int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t* info,
                                                               int argc, char** argv) {
  try {
    cairn::profile::install(id, *info, argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "profile: %s\n", error.what());
    return -1;
  }
  return 0;
}
}
