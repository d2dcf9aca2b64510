/// JSON files.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace cairn::ground {

/// The object that a file holds. Throws ToolError: cannot be read; is none, told as `fault`.
nlohmann::ordered_json read_json(const std::filesystem::path& path, const char* fault);

/// To four decimals, a tenth of a millimetre: short text.
double rounded(double v);

/// A file's text of an object, for people, too; what is no UTF-8 in it is replaced.
std::string to_text(const nlohmann::ordered_json& object);

}  // namespace cairn::ground
