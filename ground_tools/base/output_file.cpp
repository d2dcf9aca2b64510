#include "base/output_file.hpp"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <deque>

#include "base/number_table.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

/// What runs that were killed have left beside `path`: nobody of their number lives.
void remove_abandoned_parts(const std::filesystem::path& path) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  const std::string stem = path.filename().string() + ".part";
  std::error_code failed;
  for (std::filesystem::directory_iterator at(folder, failed), end; !failed && at != end;
       at.increment(failed)) {
    const std::string name = at->path().filename().string();
    if (name.rfind(stem, 0) != 0) continue;
    const std::optional<int> owner = to_number<int>(std::string_view(name).substr(stem.size()));
    std::error_code ignored;
    if (owner && *owner > 0 && ::kill(*owner, 0) != 0 && errno == ESRCH)
      std::filesystem::remove_all(at->path(), ignored);
  }
}

}  // namespace

OutputFile::OutputFile(const std::filesystem::path& path)
    : path_(path), part_(path.string() + ".part" + std::to_string(::getpid())), unfinished_(part_) {
  remove_abandoned_parts(path_);
  file_ = std::fopen(part_.c_str(), "wb");
  if (file_ == nullptr) {
    throw ToolError("{}: cannot write here ({}); choose a folder that exists and is writable", path_.string(),
                    std::strerror(errno));
  }
}

OutputFile::~OutputFile() {
  if (file_ != nullptr) std::fclose(file_);
  std::error_code ignored;
  std::filesystem::remove(part_, ignored);  // already renamed after commit: nothing to remove
}

void OutputFile::write(std::string_view text) { write_bytes(text.data(), text.size()); }

void OutputFile::write(const std::vector<std::uint8_t>& bytes) { write_bytes(bytes.data(), bytes.size()); }

void OutputFile::write_bytes(const void* data, std::size_t size) {
  if (size != 0 && std::fwrite(data, 1, size, file_) != size) {
    throw ToolError("{}: writing failed ({}); free some disk space and run again", path_.string(),
                    std::strerror(errno));
  }
}

void OutputFile::commit() {
  const bool flushed = std::fflush(file_) == 0 && ::fsync(fileno(file_)) == 0;
  const int error = errno;
  const bool closed = std::fclose(file_) == 0;
  file_ = nullptr;
  if (!flushed || !closed) {
    throw ToolError("{}: writing failed ({}); free some disk space and run again", path_.string(),
                    std::strerror(error));
  }
  std::error_code failed;
  std::filesystem::rename(part_, path_, failed);
  if (failed) throw ToolError("{}: cannot rename the finished file ({})", path_.string(), failed.message());
}

OutputByName::OutputByName(const std::filesystem::path& path)
    : path_(path), part_(path.string() + ".part" + std::to_string(::getpid())), unfinished_(part_) {
  remove_abandoned_parts(path_);
  std::error_code failed;
  if (std::filesystem::is_directory(path_)) failed = std::make_error_code(std::errc::is_a_directory);
  if (!failed) std::filesystem::create_directory(part_, failed);
  if (failed) {
    throw ToolError("{}: cannot write here ({}); choose a folder that exists and is writable", path_.string(),
                    failed.message());
  }
}

OutputByName::~OutputByName() {
  std::error_code ignored;
  std::filesystem::remove_all(part_, ignored);
}

void OutputByName::commit(const std::vector<std::string>& suffixes) {
  std::vector<std::string> names;
  for (const std::string& suffix : suffixes) names.push_back(path_.filename().string() + suffix);
  names.push_back(path_.filename().string());
  for (const std::string& name : names) {
    const int file = ::open((part_ / name).c_str(), O_RDONLY);
    const bool on_disk = file >= 0 && ::fsync(file) == 0;
    const int error = errno;
    if (file >= 0) ::close(file);
    if (!on_disk) {
      throw ToolError("{}: writing failed ({}); free some disk space and run again", path_.string(),
                      std::strerror(error));
    }
  }
  for (const std::string& name : names) {
    std::error_code failed;
    std::filesystem::rename(part_ / name, path_.parent_path() / name, failed);
    if (failed) throw ToolError("{}: cannot rename the finished file ({})", path_.string(), failed.message());
  }
}

void write_file(const std::filesystem::path& path, std::string_view text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

bool same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code failed;
  if (std::filesystem::exists(a, failed) && std::filesystem::exists(b, failed))
    return std::filesystem::is_regular_file(a, failed) && std::filesystem::equivalent(a, b, failed);
  return std::filesystem::absolute(a).lexically_normal() == std::filesystem::absolute(b).lexically_normal();
}

std::vector<std::uint8_t> read_file(const std::filesystem::path& path) {
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr)
    throw ToolError("{}: cannot be read ({}); check the name", path.string(), std::strerror(errno));
  std::vector<std::uint8_t> bytes;
  std::uint8_t block[65536];
  std::size_t got = 0;
  while ((got = std::fread(block, 1, sizeof block, file)) > 0) bytes.insert(bytes.end(), block, block + got);
  const bool failed = std::ferror(file) != 0;
  std::fclose(file);
  if (failed) throw ToolError("{}: cannot be read ({}); is it a file?", path.string(), std::strerror(EIO));
  return bytes;
}

void make_folder(const std::filesystem::path& path) {
  std::error_code failed;
  std::deque<std::filesystem::path> made;
  for (std::filesystem::path at = std::filesystem::absolute(path).lexically_normal();
       at != at.root_path() && !std::filesystem::exists(at, failed); at = at.parent_path())
    made.push_front(at);
  for (const std::filesystem::path& folder : made) made_folder(folder);
  std::filesystem::create_directories(path, failed);
  if (failed || !std::filesystem::is_directory(path)) {
    throw ToolError("{}: cannot make this folder ({}); choose another", path.string(), failed.message());
  }
}

}  // namespace cairn::ground
