/// Proof that a count is that of an enumeration: one enumerator more fails the build instead of being written
/// beyond the end of an array.
///
///   enum class FixStatus : std::uint8_t { kNone, ..., kLate };
///   inline constexpr std::size_t kFixStatusCount = 12;
///   static_assert(enum_has<FixStatus, kFixStatusCount>());
///
/// C++17 has no question for it; GCC and Clang spell a template argument that is an enumerator by its name,
/// and any other value as a cast, "(FixStatus)12". For static_assert alone: nothing of it is in the program.
#pragma once

#include <cstddef>

namespace cairn {

/// True where an enumerator of E has the value `Value`.
template <typename E, E Value>
constexpr bool is_enumerator() {
  for (const char* p = __PRETTY_FUNCTION__; *p != '\0'; ++p) {
    if (p[0] == ')' && p[1] >= '0' && p[1] <= '9') return false;
  }
  return true;
}

/// True where the enumerators of E, numbered from 0 without a gap, are `Count`.
template <typename E, std::size_t Count>
constexpr bool enum_has() {
  return is_enumerator<E, static_cast<E>(Count - 1)>() && !is_enumerator<E, static_cast<E>(Count)>();
}

}  // namespace cairn
