/// The program `cairn` as its users start it.
#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "base/output_file.hpp"
#include "ground_tools/scratch.hpp"
#include "support/cmocka.hpp"

namespace cairn::test {

struct Ended {
  int code = -1;       ///< -1 where it did not end by itself
  std::string errors;  ///< what it wrote on stderr
};

/// `cairn ARGUMENTS`, after `before` in the same shell. The program lies three folders above the test.
inline Ended run_cairn(const Scratch& scratch, const std::string& arguments, const std::string& before = "") {
  namespace fs = std::filesystem;
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / "../../../cairn";
  const std::string command = before + "'" + program.string() + "' " + arguments + " >'" +
                              scratch.path("stdout").string() + "' 2>'" + scratch.path("stderr").string() +
                              "'";
  const int how = std::system(command.c_str());
  const std::vector<std::uint8_t> bytes = ground::read_file(scratch.path("stderr"));
  return {WIFEXITED(how) ? WEXITSTATUS(how) : -1, std::string(bytes.begin(), bytes.end())};
}

inline bool is_one_line(const std::string& errors) {
  return errors.rfind("cairn: ", 0) == 0 && errors.find('\n') == errors.size() - 1;
}

/// One line, led by the program's name, that holds both words; exit code 1.
inline void check_refusal(const Scratch& scratch, const std::string& arguments, const char* what,
                          const char* mend) {
  const Ended ended = run_cairn(scratch, arguments);
  if (ended.code != 1 || !is_one_line(ended.errors) || ended.errors.find(what) == std::string::npos ||
      ended.errors.find(mend) == std::string::npos) {
    fail_msg("cairn %s: exit code %d; expected one line with '%s' and '%s', got:\n%s", arguments.c_str(),
             ended.code, what, mend, ended.errors.c_str());
  }
}

}  // namespace cairn::test
