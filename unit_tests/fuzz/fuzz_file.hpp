/// For readers of files: an input as a file that no disk holds, and what may become of it.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include "base/tool_error.hpp"
#include "core/assert.hpp"

namespace cairn::fuzz {

/// A file of these bytes, until the next call.
inline std::filesystem::path file_of(const std::uint8_t* data, std::size_t size) {
  static const int file = ::memfd_create("fuzz", 0);
  CAIRN_ASSERT(file >= 0 && ::ftruncate(file, 0) == 0);
  CAIRN_ASSERT(::pwrite(file, data, size, 0) == static_cast<ssize_t>(size));
  return "/proc/self/fd/" + std::to_string(file);
}

/// A reader may refuse by a ToolError of one line; all else that it throws is a finding.
template <typename Read>
void refused_in_one_line(const Read& read) {
  try {
    read();
  } catch (const ground::ToolError& error) {
    const std::string words = error.what();
    CAIRN_ASSERT(!words.empty() && words.find('\n') == std::string::npos);
  }
}

}  // namespace cairn::fuzz
