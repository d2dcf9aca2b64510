/// A vector with its memory inside and a capacity fixed at compile time.
///
/// Where data decide how much comes, `push_back` into a full vector is a returned `false` that the caller
/// counts. Where we have made sure that there is room, `append` says so, and asserts. An index out of range
/// is our fault, and asserts.
#pragma once

#include <cstddef>
#include <type_traits>

#include "core/assert.hpp"

namespace cairn {

template <typename T, std::size_t Capacity>
class FixedVector {
  static_assert(Capacity > 0, "a vector without room is a mistake in mission_cfg");
  static_assert(std::is_trivially_destructible_v<T>, "nothing here runs destructors");

 public:
  [[nodiscard]] bool push_back(const T& value) {
    if (size_ == Capacity) return false;
    items_[size_++] = value;
    return true;
  }
  void append(const T& value) {
    const bool fits = push_back(value);
    CAIRN_ASSERT(fits);
  }
  void clear() { size_ = 0; }
  /// Shortens to `size` items, or lengthens with items of unspecified (old) content.
  void resize(std::size_t size) {
    CAIRN_ASSERT(size <= Capacity);
    size_ = size;
  }

  T& operator[](std::size_t i) {
    CAIRN_ASSERT(i < size_);
    return items_[i];
  }
  const T& operator[](std::size_t i) const {
    CAIRN_ASSERT(i < size_);
    return items_[i];
  }
  T& back() { return (*this)[size_ - 1]; }
  const T& back() const { return (*this)[size_ - 1]; }

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  bool full() const { return size_ == Capacity; }
  static constexpr std::size_t capacity() { return Capacity; }

  T* begin() { return items_; }
  T* end() { return items_ + size_; }
  const T* begin() const { return items_; }
  const T* end() const { return items_ + size_; }
  T* data() { return items_; }
  const T* data() const { return items_; }

 private:
  std::size_t size_ = 0;
  T items_[Capacity] = {};
};

}  // namespace cairn
