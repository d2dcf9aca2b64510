#include "base/json_file.hpp"

#include <cmath>

#include "base/output_file.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {

nlohmann::ordered_json read_json(const std::filesystem::path& path, const char* fault) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  nlohmann::ordered_json json = nlohmann::ordered_json::parse(bytes.begin(), bytes.end(), nullptr, false);
  if (!json.is_object()) throw ToolError("{}: {}", path.string(), fault);
  return json;
}

double rounded(double v) { return std::round(v * 1.0e4) / 1.0e4; }

std::string to_text(const nlohmann::ordered_json& object) {
  return object.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace cairn::ground
