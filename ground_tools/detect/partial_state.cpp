#include "detect/partial_state.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "base/tool_error.hpp"
#include "core/crc32.hpp"

namespace cairn::ground {
namespace {

constexpr char kMagic[] = "CAIRNPART1\n";
constexpr std::size_t kMagicSize = sizeof kMagic - 1;
constexpr std::size_t kHeadSize = 4 + 4 + 1 + 4;
constexpr std::uint8_t kAboutBuild = 0;

struct Head {
  std::uint32_t size = 0;
  std::uint32_t crc = 0;
  std::uint8_t round = 0;
  std::uint32_t tile = 0;
};

/// Up to `size` bytes; fewer at the end of the file.
std::size_t read_at(int file, std::uint64_t at, std::uint8_t* to, std::size_t size) {
  std::size_t got = 0;
  while (got < size) {
    const ssize_t n = ::pread(file, to + got, size - got, static_cast<off_t>(at + got));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    got += static_cast<std::size_t>(n);
  }
  return got;
}

Bytes record_of(std::uint8_t round, std::uint32_t tile, const Bytes& content) {
  Bytes guarded;
  ByteWriter writer(guarded);
  writer.put(round);
  writer.put(tile);
  writer.put_bytes(content.data(), content.size());
  Bytes record;
  ByteWriter head(record);
  head.put(static_cast<std::uint32_t>(content.size()));
  head.put(crc32(guarded.data(), guarded.size()));
  head.put_bytes(guarded.data(), guarded.size());
  return record;
}

/// The record at `at`, where it is whole.
bool read_record(int file, std::uint64_t at, std::uint64_t end, Head& head, Bytes& content) {
  Bytes first(kHeadSize);
  if (read_at(file, at, first.data(), kHeadSize) != kHeadSize) return false;
  ByteReader reader(first);
  head.size = reader.get<std::uint32_t>();
  head.crc = reader.get<std::uint32_t>();
  head.round = reader.get<std::uint8_t>();
  head.tile = reader.get<std::uint32_t>();
  if (head.size > end - at - kHeadSize) return false;
  content.resize(head.size);
  if (read_at(file, at + kHeadSize, content.data(), content.size()) != content.size()) return false;
  const std::uint32_t crc = crc32(first.data() + 8, kHeadSize - 8);
  return crc32(content.data(), content.size(), crc) == head.crc;
}

}  // namespace

PartialState::PartialState(std::filesystem::path path, const std::string& build) : path_(std::move(path)) {
  if (path_.empty()) return;
  file_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (file_ < 0) {
    throw ToolError("{}: cannot write here ({}); choose a folder that exists and is writable", path_.string(),
                    std::strerror(errno));
  }
  if (::flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    ::close(file_);
    throw ToolError("{}: another run is building this map; wait for it, or choose another --output",
                    path_.string());
  }
  try {
    load(build);
  } catch (...) {
    ::close(file_);
    throw;
  }
}

PartialState::~PartialState() {
  if (file_ < 0) return;
  if (places_.empty()) remove();
  if (file_ >= 0) ::close(file_);
}

void PartialState::load(const std::string& build) {
  const off_t length = ::lseek(file_, 0, SEEK_END);
  const std::uint64_t end = length > 0 ? static_cast<std::uint64_t>(length) : 0;
  char magic[kMagicSize];
  const bool ours = read_at(file_, 0, reinterpret_cast<std::uint8_t*>(magic), kMagicSize) == kMagicSize &&
                    std::memcmp(magic, kMagic, kMagicSize) == 0;
  if (end > 0 && !ours) {
    throw ToolError("{}: exists and is not a partial state of cairn; move it, or choose another --output",
                    path_.string());
  }
  Head head;
  Bytes content;
  std::uint64_t at = kMagicSize;
  bool same = false;
  while (ours && read_record(file_, at, end, head, content)) {
    if (at == kMagicSize) {
      same = head.round == kAboutBuild && std::string(content.begin(), content.end()) == build;
      if (!same) break;
    } else {
      places_[{head.round, head.tile}] = {at + kHeadSize, head.size};
    }
    at += kHeadSize + head.size;
  }
  if (!same) {
    found_ = end > kMagicSize ? Found::kOtherBuild : Found::kNothing;
    start_over(build);
    return;
  }
  found_ = places_.empty() ? Found::kNothing : Found::kSameBuild;
  cut_to(at);
}

void PartialState::start_over(const std::string& build) {
  places_.clear();
  cut_to(0);
  Bytes begin(kMagic, kMagic + kMagicSize);
  const Bytes record = record_of(kAboutBuild, 0, Bytes(build.begin(), build.end()));
  begin.insert(begin.end(), record.begin(), record.end());
  append(begin);
}

void PartialState::cut_to(std::uint64_t size) {
  if (::ftruncate(file_, static_cast<off_t>(size)) != 0)
    throw ToolError("{}: cannot be truncated ({}); remove it and run again", path_.string(),
                    std::strerror(errno));
  size_ = size;
}

void PartialState::append(const Bytes& bytes) {
  std::size_t put = 0;
  while (put < bytes.size()) {
    const ssize_t n =
        ::pwrite(file_, bytes.data() + put, bytes.size() - put, static_cast<off_t>(size_ + put));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      const int error = n < 0 ? errno : ENOSPC;
      cut_to(size_);
      throw ToolError("{}: writing failed ({}); free some disk space and run again to resume", path_.string(),
                      std::strerror(error));
    }
    put += static_cast<std::size_t>(n);
  }
  size_ += put;
}

bool PartialState::has(std::uint8_t round, std::uint32_t tile) const {
  return places_.count({round, tile}) != 0 || kept_.count({round, tile}) != 0;
}

void PartialState::add(std::uint8_t round, std::uint32_t tile, const Bytes& content) {
  if (in_memory()) {
    kept_[{round, tile}] = content;
    return;
  }
  const std::uint64_t at = size_ + kHeadSize;
  append(record_of(round, tile, content));
  places_[{round, tile}] = {at, static_cast<std::uint32_t>(content.size())};
}

Bytes PartialState::get(std::uint8_t round, std::uint32_t tile) const {
  if (in_memory()) return kept_.at({round, tile});
  const Place& place = places_.at({round, tile});
  Bytes content(place.size);
  if (read_at(file_, place.at, content.data(), content.size()) != content.size())
    throw ToolError("{}: cannot be read back; remove it and run again", path_.string());
  return content;
}

void PartialState::remove() {
  places_.clear();
  kept_.clear();
  if (file_ < 0) return;
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
  ::close(file_);
  file_ = -1;
}

}  // namespace cairn::ground
