/// Whether the build has the sanitizers.
#pragma once

namespace cairn::test {

/// With the sanitizers everything takes ten times as long: tests then do with fewer frames, draws and
/// directions, and leave what only many draws can tell to the plain build.
#ifdef __SANITIZE_ADDRESS__
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace cairn::test
