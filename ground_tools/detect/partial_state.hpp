/// What a build has finished so far, tile by tile, so that one that was stopped goes on.
///
/// A file beside the output, only ever appended to: "CAIRNPART1\n", then records:
///   size of the content (u32), CRC-32 of what follows (u32), round (u8), tile (u32), content
/// The first record has round 0 and the build's parameters and input as text.
/// Whatever moment the process dies at, what is whole stays: on opening, the file is cut where a record is
/// torn. Numbers are in this machine's byte order; the file is not for other machines.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>

#include "base/byte_stream.hpp"

namespace cairn::ground {

class PartialState {
 public:
  enum class Found : std::uint8_t {
    kNothing,     ///< no such file, or nothing whole in it
    kSameBuild,   ///< to go on from
    kOtherBuild,  ///< of another input or other parameters: emptied
  };

  /// `path` empty: records are kept in memory. `build` says what is built from what; it must be the same for
  /// records to be of use. Throws ToolError: cannot be written, or another process is at it.
  PartialState(std::filesystem::path path, const std::string& build);
  /// Leaves the file where it is, unless nothing is in it.
  ~PartialState();
  PartialState(const PartialState&) = delete;
  PartialState& operator=(const PartialState&) = delete;

  Found found() const { return found_; }
  const std::filesystem::path& path() const { return path_; }
  bool in_memory() const { return path_.empty(); }
  std::size_t records() const { return places_.size() + kept_.size(); }

  bool has(std::uint8_t round, std::uint32_t tile) const;
  /// Throws ToolError: disk full. The file then ends with the record before.
  void add(std::uint8_t round, std::uint32_t tile, const Bytes& content);
  Bytes get(std::uint8_t round, std::uint32_t tile) const;
  /// The build is done: the file goes.
  void remove();

 private:
  struct Place {
    std::uint64_t at = 0;  ///< of the content
    std::uint32_t size = 0;
  };
  using Key = std::pair<std::uint8_t, std::uint32_t>;

  void load(const std::string& build);
  void start_over(const std::string& build);
  void cut_to(std::uint64_t size);
  void append(const Bytes& bytes);

  std::filesystem::path path_;
  int file_ = -1;
  std::uint64_t size_ = 0;  ///< up to the last whole record
  Found found_ = Found::kNothing;
  std::map<Key, Place> places_;
  std::map<Key, Bytes> kept_;  ///< in memory
};

}  // namespace cairn::ground
