/// Output that is whole or absent: written beside its final name, renamed when complete.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace cairn::ground {

class OutputFile {
 public:
  /// Opens `<path>.part<pid>`; throws ToolError where the folder is missing or not writable.
  explicit OutputFile(const std::filesystem::path& path);
  /// Removes the unfinished file unless `commit` succeeded.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::string_view text);
  void write(const std::vector<std::uint8_t>& bytes);
  /// Flushes, checks that everything reached the disk, renames. Throws ToolError (disk full, ...).
  void commit();

 private:
  void write_bytes(const void* data, std::size_t size);

  std::filesystem::path path_;
  std::filesystem::path part_;
  std::FILE* file_ = nullptr;
};

/// The whole of a file in one call.
void write_file(const std::filesystem::path& path, std::string_view text);

/// Reads a whole file; throws ToolError that names it.
std::vector<std::uint8_t> read_file(const std::filesystem::path& path);

/// Makes a folder (with parents); throws ToolError that names it.
void make_folder(const std::filesystem::path& path);

}  // namespace cairn::ground
