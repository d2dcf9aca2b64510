/// Output that is whole or absent: written beside its final name, renamed when complete.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/interrupts.hpp"

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
  Unfinished unfinished_;
  std::FILE* file_ = nullptr;
};

/// The same for a file that a library writes by its name, and for what it puts beside it: they are made in a
/// folder `<path>.part<pid>` and moved out when complete.
class OutputByName {
 public:
  /// Throws ToolError where the folder is missing or not writable.
  explicit OutputByName(const std::filesystem::path& path);
  /// Removes what is unfinished.
  ~OutputByName();
  OutputByName(const OutputByName&) = delete;
  OutputByName& operator=(const OutputByName&) = delete;

  /// What the library is to write: the final name in that folder.
  std::filesystem::path file() const { return part_ / path_.filename(); }
  /// Moves the file, after those named as it with one of `suffixes` behind; others are dropped. Throws
  /// ToolError where one is missing or did not reach the disk.
  void commit(const std::vector<std::string>& suffixes = {});

 private:
  std::filesystem::path path_;
  std::filesystem::path part_;
  Unfinished unfinished_;
};

/// The whole of a file in one call.
void write_file(const std::filesystem::path& path, std::string_view text);

/// Two names of one file, there already or not; what is no plain file, /dev/null say, is never one.
bool same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// Reads a whole file; throws ToolError that names it.
std::vector<std::uint8_t> read_file(const std::filesystem::path& path);

/// Makes a folder (with parents); throws ToolError that names it. An interrupted program leaves none
/// that is empty.
void make_folder(const std::filesystem::path& path);

}  // namespace cairn::ground
