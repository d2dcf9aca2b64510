#include "support/data.hpp"

#include <cstdlib>
#include <filesystem>

namespace cairn::test {

std::string data_dir() {
  const char* chosen = std::getenv("CAIRN_DATA");
  return chosen != nullptr ? chosen : std::string(CAIRN_SOURCE_DIR) + "/../shared/data";
}

std::string find_data(const std::string& relative) {
  const std::string path = data_dir() + "/" + relative;
  std::error_code ignored;
  return std::filesystem::exists(path, ignored) ? path : std::string();
}

}  // namespace cairn::test
