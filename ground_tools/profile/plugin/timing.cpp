#include "profile/plugin/timing.hpp"

#include <toml++/toml.h>

#include <cmath>
#include <stdexcept>
#include <vector>

namespace cairn::profile {
namespace {

class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path) {
    try {
      root_ = toml::parse_file(path);
    } catch (const toml::parse_error& error) {
      throw std::runtime_error(path + ":" + std::to_string(error.source().begin.line) + ": " +
                               std::string(error.description()) + "; correct the line");
    }
  }

  const toml::table& table(const char* name) const {
    const toml::table* found = root_[name].as_table();
    if (found == nullptr) fail(std::string("no table [") + name + "]");
    return *found;
  }
  const toml::table& root() const { return root_; }
  int number(const toml::table& where, const char* name, int low, int high, const char* owner) const {
    const auto value = where[name].value<std::int64_t>();
    if (!value || *value < low || *value > high) {
      fail(std::string(owner) + ": " + name + " must be a whole number, " + std::to_string(low) + " to " +
           std::to_string(high));
    }
    return static_cast<int>(*value);
  }
  int number_or(const toml::table& where, const char* name, int low, int high, const char* owner,
                int other) const {
    return where.contains(name) ? number(where, name, low, high, owner) : other;
  }
  [[noreturn]] void fail(const std::string& why) const { throw std::runtime_error(path_ + ": " + why); }

 private:
  std::string path_;
  toml::table root_;
};

ClassCost class_cost(const Reader& file, const toml::table* other, const char* name,
                     std::vector<std::string>& units) {
  const toml::table* at = other != nullptr ? (*other)["class"][name].as_table() : nullptr;
  if (at == nullptr) at = file.table("class")[name].as_table();
  if (at == nullptr) file.fail(std::string("[class]: no '") + name + "'");
  ClassCost cost;
  cost.issue = file.number(*at, "issue", 0, 1000, name);
  cost.latency = file.number(*at, "latency", 1, 1000, name);
  cost.flags = file.number_or(*at, "flags", 1, 1000, name, cost.latency);
  cost.per_word = file.number_or(*at, "per_word", 0, 1000, name, 0);
  if (const auto unit = (*at)["unit"].value<std::string>()) {
    std::size_t index = 0;
    while (index < units.size() && units[index] != *unit) ++index;
    if (index == units.size()) units.push_back(*unit);
    if (units.size() > kUnits) file.fail("more than " + std::to_string(kUnits) + " units");
    cost.unit = static_cast<int>(index);
    cost.busy = file.number(*at, "busy", 1, 1000, name);
  }
  return cost;
}

bool power_of_two(std::uint32_t value) { return value != 0 && (value & (value - 1)) == 0; }

double factor(const Reader& file, const toml::table* variant, const char* name) {
  if (variant == nullptr || !variant->contains(name)) return 1.0;
  const double value = (*variant)[name].value_or(0.0);
  if (!(value >= 0.125 && value <= 8.0)) file.fail(std::string(name) + " of a variant must be 0.125 to 8");
  return value;
}

CacheShape shape(const Reader& file, const char* name, double times) {
  const toml::table& at = file.table(name);
  CacheShape out;
  out.bytes = static_cast<std::uint32_t>(std::lround(times * file.number(at, "bytes", 64, 1 << 26, name)));
  out.ways = static_cast<std::uint32_t>(file.number(at, "ways", 1, 64, name));
  out.line = static_cast<std::uint32_t>(file.number(at, "line", 8, 64, name));
  out.fill = static_cast<std::uint32_t>(
      file.number_or(at, "fill", 4, static_cast<int>(out.line), name, static_cast<int>(out.line)));
  out.write_back = at["write_back"].value_or(false);
  const std::uint32_t sets = out.bytes / out.ways / out.line;
  if (!power_of_two(out.line) || !power_of_two(out.fill) || !power_of_two(sets) ||
      sets * out.ways * out.line != out.bytes) {
    file.fail(std::string("[") + name + "]: line, fill and bytes / ways / line must be powers of two");
  }
  return out;
}

}  // namespace

Timing read_timing(const std::string& path, const std::string& variant) {
  const Reader file(path);
  const toml::table* const other = variant.empty() ? nullptr : file.root()["variant"][variant].as_table();
  if (other == nullptr && !variant.empty()) file.fail("no table [variant." + variant + "]");
  const double memory = factor(file, other, "memory"), cache = factor(file, other, "cache");
  const auto scaled = [memory](int value) { return static_cast<int>(std::lround(memory * value)); };
  const auto cycles = [&](const toml::table& at, const char* name, const char* owner) {
    return scaled(file.number(at, name, 0, 10000, owner));
  };
  const auto cycles_or_none = [&](const toml::table& at, const char* name, const char* owner) {
    return scaled(file.number_or(at, name, 0, 10000, owner, 0));
  };
  Timing out;
  out.name = file.root()["name"].value_or(std::string("unnamed"));
  const auto isa = file.root()["isa"].value_or(std::string());
  if (isa != "ppc" && isa != "sparc" && isa != "riscv")
    file.fail("isa must be \"ppc\", \"sparc\" or \"riscv\"");
  out.isa = isa == "ppc" ? Isa::kPpc : isa == "sparc" ? Isa::kSparc : Isa::kRiscv;
  out.clock_mhz = file.root()["clock_mhz"].value_or(0.0);
  if (!(out.clock_mhz > 0.0)) file.fail("clock_mhz must be greater than 0");
  const toml::table& branch = file.table("branch");
  out.taken = file.number(branch, "taken", 0, 100, "branch");
  out.mispredicted = file.number(branch, "mispredicted", 0, 100, "branch");
  out.history_entries = file.number(branch, "history_entries", 0, 1 << 20, "branch");
  if (out.history_entries != 0 && !power_of_two(static_cast<std::uint32_t>(out.history_entries)))
    file.fail("branch: history_entries must be a power of two, or 0");
  if (const toml::table* traps = file.root()["trap"].as_table()) {
    out.trap_table = (*traps)["table"].value_or(std::string());
    out.trap = file.number(*traps, "cycles", 0, 1000, "trap");
  }
  std::vector<std::string> units;
  for (int i = 0; i < kClasses; ++i) out.cost[i] = class_cost(file, other, kClassNames[i], units);
  const toml::table& fetch = file.table("instruction_cache");
  const toml::table& data = file.table("data_cache");
  out.instruction_cache = shape(file, "instruction_cache", cache);
  out.data_cache = shape(file, "data_cache", cache);
  out.fetch_miss = cycles(fetch, "miss", "instruction_cache");
  out.read_miss = cycles(data, "miss", "data_cache");
  out.read_miss_word = cycles_or_none(data, "miss_word", "data_cache");
  out.write_miss = cycles(data, "write_miss", "data_cache");
  out.cast_out = cycles(data, "cast_out", "data_cache");
  out.write = cycles_or_none(data, "write", "data_cache");
  out.write_word = cycles_or_none(data, "write_word", "data_cache");
  return out;
}

Watch read_watch(const std::string& path) {
  const Reader file(path);
  Watch out;
  out.frame = file.root()["frame"].value_or(std::string());
  const toml::array* jobs = file.root()["job"].as_array();
  if (out.frame.empty() || jobs == nullptr) file.fail("must have 'frame' and one [[job]] or more");
  for (const toml::node& job : *jobs) {
    const toml::table* table = job.as_table();
    const toml::array* calls = table == nullptr ? nullptr : (*table)["calls"].as_array();
    if (calls == nullptr) file.fail("[[job]]: no list 'calls'");
    for (const toml::node& call : *calls) out.calls.push_back(call.value_or(std::string()));
  }
  return out;
}

}  // namespace cairn::profile
