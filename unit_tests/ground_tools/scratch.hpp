/// A folder of files for one test executable, removed at its end.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "base/tool_error.hpp"
#include "support/cmocka.hpp"

namespace cairn::test {

/// Static in a test file: a failed assertion skips destructors of automatic objects, not those of statics.
class Scratch {
 public:
  Scratch() : folder_(std::filesystem::temp_directory_path() / ("cairn-test-" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  std::filesystem::path path(const std::string& name) const {
    const std::filesystem::path file = folder_ / name;
    std::filesystem::create_directories(file.parent_path());
    return file;
  }
  std::filesystem::path file(const std::string& name, const std::string& text) const {
    std::ofstream(path(name), std::ios::binary) << text;
    return path(name);
  }

 private:
  std::filesystem::path folder_;
};

/// The message of the ToolError that `call` throws; empty where it throws none.
template <typename Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const ground::ToolError& error) {
    return error.what();
  }
  return {};
}

}  // namespace cairn::test

/// `call` must throw a ToolError of one line that names `word`.
#define assert_refused(call, word)                                                                       \
  do {                                                                                                   \
    static std::string refused_;                                                                         \
    refused_ = cairn::test::refusal([&] { static_cast<void>(call); });                                   \
    if (refused_.find(word) == std::string::npos || refused_.find('\n') != std::string::npos) {          \
      fail_msg("%s: expected a refusal of one line with '%s', got '%s'", #call, word, refused_.c_str()); \
    }                                                                                                    \
  } while (false)
