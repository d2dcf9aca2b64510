/// JSON files.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace cairn::ground {

/// The object that a file holds. Throws ToolError: cannot be read; is none, told as `fault`.
nlohmann::ordered_json read_json(const std::filesystem::path& path, const char* fault);

}  // namespace cairn::ground
