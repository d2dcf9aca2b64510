/// Where tests find input that is not part of the repository. It may be absent: a test then skips
/// and says so.
#pragma once

#include <string>

namespace cairn::test {

/// The folder of independent data sets: $CAIRN_DATA, else ../shared/data beside the project's root.
std::string data_dir();

/// Path of a file or folder in it; empty where it is absent.
std::string find_data(const std::string& relative);

}  // namespace cairn::test

/// Leaves the test as skipped, telling what is missing. For use inside a CMocka test.
#define SKIP_WITHOUT(path_string, relative)                                              \
  do {                                                                                   \
    if ((path_string).empty()) {                                                         \
      print_message("skipped: no %s (set CAIRN_DATA to the data folder)\n", (relative)); \
      skip();                                                                            \
    }                                                                                    \
  } while (false)
