/// Software-integrity assertions. Stay on in flight.
///
/// A fault in data (camera, map, command, prior) is a status of the module that met it and never an assert;
/// an assert means that our own code is wrong. The platform supplies the one handler. A condition has no side
/// effect: clang-tidy sees to it.
#pragma once

namespace cairn {

/// Ends the program (host) or hands over to the platform's safe state (target). Never returns.
/// Supplied by platform/<target>; `file` and `line` point into read-only data.
[[noreturn]] void assert_failed(const char* file, int line);

}  // namespace cairn

#define CAIRN_ASSERT(cond) ((cond) ? static_cast<void>(0) : ::cairn::assert_failed(__FILE__, __LINE__))
