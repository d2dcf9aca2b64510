/// Results of tiles as bytes: for the partial state on disk and for other processes of the same build. The
/// bytes never leave this kind of machine, so that numbers keep their form in memory.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include "base/tool_error.hpp"

namespace cairn::ground {

using Bytes = std::vector<std::uint8_t>;

class ByteWriter {
 public:
  explicit ByteWriter(Bytes& to) : to_(to) {}

  template <typename T>
  void put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>, "only plain data");
    put_bytes(&value, sizeof(T));
  }
  void put_bytes(const void* from, std::size_t count) {
    const std::size_t size = to_.size();
    to_.resize(size + count);
    if (count != 0) std::memcpy(to_.data() + size, from, count);
  }
  /// Small numbers in few bytes: seven bits each, the last with the top bit clear.
  void put_number(std::uint64_t value) {
    for (; value >= 128; value >>= 7) to_.push_back(static_cast<std::uint8_t>(value | 128));
    to_.push_back(static_cast<std::uint8_t>(value));
  }
  template <typename T>
  void put_all(const std::vector<T>& values) {
    put_number(values.size());
    for (const T& value : values) put(value);
  }
  /// Counts of which most are zero: of the others, the step from the one before, and the count.
  template <typename Counts>
  void put_counts(const Counts& counts) {
    std::uint64_t filled = 0;
    for (const auto count : counts) filled += count != 0 ? 1 : 0;
    put_number(filled);
    std::size_t last = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      if (counts[i] == 0) continue;
      put_number(i - last);
      put_number(counts[i]);
      last = i;
    }
  }

 private:
  Bytes& to_;
};

/// Reads what ByteWriter wrote. What does not fit is a fault of ours, as CRCs guard the bytes: ToolError.
class ByteReader {
 public:
  explicit ByteReader(const Bytes& from) : at_(from.data()), end_(from.data() + from.size()) {}

  std::size_t left() const { return static_cast<std::size_t>(end_ - at_); }
  template <typename T>
  T get() {
    static_assert(std::is_trivially_copyable_v<T>, "only plain data");
    need(sizeof(T));
    T value;
    std::memcpy(static_cast<void*>(&value), at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  std::uint64_t get_number() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      const auto byte = get<std::uint8_t>();
      value |= static_cast<std::uint64_t>(byte & 127U) << shift;
      if (byte < 128) return value;
    }
    throw ToolError("partial state: a number is too long; remove the file and run again");
  }
  template <typename T>
  std::vector<T> get_all() {
    const std::uint64_t count = get_number();
    if (count > static_cast<std::uint64_t>(end_ - at_) / sizeof(T)) need(static_cast<std::size_t>(-1));
    std::vector<T> values;
    values.reserve(count);
    for (std::uint64_t i = 0; i < count; ++i) values.push_back(get<T>());
    return values;
  }
  template <typename Counts>
  void add_counts(Counts& counts) {
    std::size_t i = 0;
    for (std::uint64_t left = get_number(); left > 0; --left) {
      i += static_cast<std::size_t>(get_number());
      if (i >= counts.size()) need(static_cast<std::size_t>(-1));
      counts[i] += static_cast<typename Counts::value_type>(get_number());
    }
  }

 private:
  void need(std::size_t bytes) const {
    if (bytes > static_cast<std::size_t>(end_ - at_))
      throw ToolError("partial state: a record is too short; remove the file and run again");
  }

  const std::uint8_t* at_;
  const std::uint8_t* end_;
};

}  // namespace cairn::ground
