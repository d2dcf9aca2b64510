/// `enum class CAIRN_NODISCARD SomeStatus : std::uint8_t {`: a status that nobody looks at is an error.
///
/// A macro because clang-format takes the colon after `[[nodiscard]] SomeStatus` for an initialiser's, and
/// lays the enum out as one. Functions need none of it: they say [[nodiscard]].
#pragma once

#define CAIRN_NODISCARD [[nodiscard]]
