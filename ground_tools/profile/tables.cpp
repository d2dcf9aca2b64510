#include "profile/tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace cairn::ground {
namespace {

double millions(std::uint64_t count) { return 1.0e-6 * static_cast<double>(count); }
double percent(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}
double ratio(std::uint64_t a, std::uint64_t b) {
  return b == 0 ? 0.0 : static_cast<double>(a) / static_cast<double>(b);
}
std::string cut(const std::string& text, std::size_t width) {
  return text.size() <= width ? text : text.substr(0, width - 2) + "..";
}

std::string jobs_text(const std::vector<JobReport>& jobs, double clock_mhz) {
  std::string out = fmt::format("  {:<16} {:>6} {:>19}  {:>19}  {:>17}  {:>6} {:>8}  {:>8}  {:>8}  {}\n", "",
                                "", "million instructions", "million cycles", "seconds", "", "share of", "",
                                "longest", "cycles");
  out += fmt::format("  {:<16} {:>6} {:>9} {:>10} {:>10} {:>9} {:>9} {:>8} {:>7} {:>8}  {:>8}  {:>8}  {}\n",
                     "job", "rounds", "mean", "longest", "mean", "longest", "mean", "longest", "budget",
                     "budget", "headroom", "in frame", "an op");
  for (const JobReport& job : jobs) {
    if (job.rounds.empty()) {
      out += fmt::format("  {:<16} {:>6}   never ran\n", job.budget.name, 0);
      continue;
    }
    const ProfileCost mean = job.mean();
    const JobRound longest = job.longest();
    const double seconds = job.longest_s(clock_mhz);
    out += fmt::format(
        "  {:<16} {:>6} {:>9.2f} {:>10.2f} {:>10.2f} {:>9.2f} {:>9.3f} {:>8.3f} {:>7.3f} {:>6.0f} %  "
        "{:>6.3f} s  {:>8}  {}{}\n",
        job.budget.name, job.rounds.size(), millions(mean.instructions), millions(longest.cost.instructions),
        millions(mean.cycles), millions(longest.cost.cycles), millions(mean.cycles) / clock_mhz, seconds,
        job.budget.budget_s, 100.0 * seconds / job.budget.budget_s, job.budget.budget_s - seconds,
        longest.frame, job.cycles_per_op() > 0.0 ? fmt::format("{:.2f}", job.cycles_per_op()) : "",
        job.broken(clock_mhz) ? "   BROKEN" : "");
  }
  return out;
}

template <typename Value>
std::vector<std::size_t> order(const Profile& profile, Value value) {
  std::vector<std::size_t> out(profile.functions.size());
  std::iota(out.begin(), out.end(), std::size_t{0});
  std::stable_sort(out.begin(), out.end(), [&](std::size_t a, std::size_t b) {
    return value(profile.functions[a]) > value(profile.functions[b]);
  });
  return out;
}

std::string functions_text(const Profile& p, std::size_t most) {
  std::string out = fmt::format("  {:<58} {:>9} {:>10} {:>10} {:>6} {:>6} {:>10} {:>10} {:>9}\n", "", "",
                                "self", "self", "self", "cycles", "inclusive", "longest", "data miss");
  out += fmt::format("  {:<58} {:>9} {:>10} {:>10} {:>6} {:>6} {:>10} {:>10} {:>9}\n", "function", "calls",
                     "M instr", "M cycles", "%", "/instr", "M cycles", "M cycles", "/1000 i");
  std::size_t shown = 0;
  for (const std::size_t i : order(p, [](const ProfileFunction& f) { return f.self.cycles; })) {
    const ProfileFunction& f = p.functions[i];
    if (shown++ == most || f.self.instructions == 0) break;
    out += fmt::format("  {:<58} {:>9} {:>10.2f} {:>10.2f} {:>6.2f} {:>6.2f} {:>10.2f} {:>10.3f} {:>9.2f}\n",
                       cut(f.name, 58), f.calls, millions(f.self.instructions), millions(f.self.cycles),
                       percent(f.self.cycles, p.total.cycles), ratio(f.self.cycles, f.self.instructions),
                       millions(f.inclusive.cycles), millions(f.longest.cycles),
                       1000.0 * ratio(f.data_misses, f.self.instructions));
  }
  return out;
}

std::string detail_text(const Profile& p, std::size_t most) {
  ProfileCost whole;
  for (const ProfileFunction& f : p.functions) whole += f.detail_self;
  std::string out =
      fmt::format("  {:<58} {:>9} {:>10} {:>10} {:>6}\n", "function", "calls", "M instr", "M cycles", "%");
  std::size_t shown = 0;
  for (const std::size_t i : order(p, [](const ProfileFunction& f) { return f.detail_self.cycles; })) {
    const ProfileFunction& f = p.functions[i];
    if (shown++ == most || f.detail_self.instructions == 0) break;
    out += fmt::format("  {:<58} {:>9} {:>10.3f} {:>10.3f} {:>6.2f}\n", cut(f.name, 58), f.detail_calls,
                       millions(f.detail_self.instructions), millions(f.detail_self.cycles),
                       percent(f.detail_self.cycles, whole.cycles));
  }
  return out;
}

/// A field of CSV.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

}  // namespace

std::string profile_text(const Profile& p, const std::vector<JobReport>& jobs, double clock_mhz,
                         std::size_t most) {
  std::string out = fmt::format(
      "{} at {:g} MHz: {} frames, {:.1f} million instructions, {:.1f} million model cycles\n\n", p.processor,
      clock_mhz, p.frames.size(), millions(p.total.instructions), millions(p.total.cycles));
  out += jobs_text(jobs, clock_mhz);
  out += fmt::format("\nFunctions by what they spend themselves\n{}", functions_text(p, most));
  if (p.detail_frame >= 0) {
    const ProfileCost& frame = p.frames[static_cast<std::size_t>(p.detail_frame)].cost;
    out +=
        fmt::format("\nFrame {} in detail: {:.1f} million instructions, {:.1f} million cycles, {:.3f} s\n{}",
                    p.detail_frame, millions(frame.instructions), millions(frame.cycles),
                    millions(frame.cycles) / clock_mhz, detail_text(p, most / 2));
  }
  return out;
}

std::string jobs_csv(const std::vector<JobReport>& jobs, double clock_mhz) {
  std::string out =
      "job,rounds,mean_instructions,longest_instructions,mean_cycles,longest_cycles,longest_frame,clock_mhz,"
      "longest_s,"
      "budget_s,broken\n";
  for (const JobReport& job : jobs) {
    const ProfileCost mean = job.mean();
    const JobRound longest = job.longest();
    out += fmt::format("{},{},{},{},{},{},{},{:g},{:.6f},{:g},{}\n", quoted(job.budget.name),
                       job.rounds.size(), mean.instructions, longest.cost.instructions, mean.cycles,
                       longest.cost.cycles, longest.frame, clock_mhz, job.longest_s(clock_mhz),
                       job.budget.budget_s, job.broken(clock_mhz) ? 1 : 0);
  }
  return out;
}

std::string rounds_csv(const std::vector<JobReport>& jobs, double clock_mhz) {
  std::string out = "job,frame,instructions,cycles,seconds\n";
  for (const JobReport& job : jobs) {
    for (const JobRound& round : job.rounds) {
      out += fmt::format("{},{},{},{},{:.6f}\n", quoted(job.budget.name), round.frame,
                         round.cost.instructions, round.cost.cycles, millions(round.cost.cycles) / clock_mhz);
    }
  }
  return out;
}

std::string functions_csv(const Profile& p) {
  std::string out =
      "function,calls,self_instructions,self_cycles,inclusive_instructions,inclusive_cycles,longest_"
      "instructions,"
      "longest_cycles,fetch_misses,data_misses,stalled_cycles,detail_calls,detail_self_instructions,detail_"
      "self_cycles";
  for (const std::string& name : p.classes) out += "," + name;
  out += '\n';
  for (const std::size_t i : order(p, [](const ProfileFunction& f) { return f.self.cycles; })) {
    const ProfileFunction& f = p.functions[i];
    out += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{}", quoted(f.name), f.calls,
                       f.self.instructions, f.self.cycles, f.inclusive.instructions, f.inclusive.cycles,
                       f.longest.instructions, f.longest.cycles, f.fetch_misses, f.data_misses,
                       f.stalled_cycles, f.detail_calls, f.detail_self.instructions, f.detail_self.cycles);
    for (const std::uint64_t count : f.counts) out += fmt::format(",{}", count);
    out += '\n';
  }
  return out;
}

}  // namespace cairn::ground
