#include "support/data.hpp"

#include <cstdio>
#include <cstdlib>

namespace cairn::test {

std::string data_dir() {
  const char* chosen = std::getenv("CAIRN_DATA");
  return chosen != nullptr ? chosen : std::string(CAIRN_SOURCE_DIR) + "/../shared/data";
}

std::string find_data(const std::string& relative) {
  const std::string path = data_dir() + "/" + relative;
  std::FILE* file = std::fopen(path.c_str(), "r");  // opens folders too
  if (file == nullptr) return {};
  std::fclose(file);
  return path;
}

}  // namespace cairn::test
