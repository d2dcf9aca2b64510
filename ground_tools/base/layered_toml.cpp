#include "base/layered_toml.hpp"

#include <fmt/ranges.h>

#include <algorithm>

#include "base/output_file.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

std::string one_line(std::string_view text) {
  std::string line(text);
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return c < ' '; }, ' ');
  return line;
}

std::string type_of(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table: return "a section";
    case toml::node_type::array: return "a list";
    case toml::node_type::string: return "text";
    case toml::node_type::integer:
    case toml::node_type::floating_point: return "a number";
    case toml::node_type::boolean: return "true or false";
    default: return "a date or time";
  }
}

std::string at(const TomlLayer& layer, const toml::node& node) {
  return layer.is_file ? fmt::format("{}:{}", layer.name, node.source().begin.line) : layer.name;
}

}  // namespace

TomlLayer read_toml(const std::filesystem::path& path) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  const std::string name = path.string();
  try {
    return {toml::parse(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()), name),
            name, true};
  } catch (const toml::parse_error& error) {
    throw ToolError("{}:{}: not TOML: {}; correct this line", name, error.source().begin.line,
                    one_line(error.description()));
  }
}

TomlLayer toml_setting(const std::string& set) {
  const std::string name = "--set " + one_line(set);
  const std::size_t equals = set.find('=');
  if (equals == std::string::npos || equals == 0 || one_line(set) != set) {
    throw ToolError("{}: expected section.key=value, as in traverse.length_m=20", name);
  }
  try {
    return {toml::parse(set, name), name, false};
  } catch (const toml::parse_error&) {
    const std::string value = set.substr(equals + 1);
    if (value.find('\'') != std::string::npos)
      throw ToolError("{}: this value is not TOML; correct it", name);
    try {
      return {toml::parse(set.substr(0, equals) + "='" + value + "'", name), name, false};
    } catch (const toml::parse_error& error) {
      throw ToolError("{}: not TOML: {}", name, one_line(error.description()));
    }
  }
}

void TomlKeys::refuse_others(const TomlLayer& layer) const {
  for (const auto& [name, node] : layer.table) {
    if (knows("", name.str())) continue;
    const auto section = name.str().empty() ? keys_.end() : keys_.find(std::string(name.str()));
    if (section == keys_.end()) {
      throw ToolError("{}: no key or section '{}'; there are {} and {}", at(layer, node),
                      one_line(name.str()), fmt::join(keys_.at(""), ", "), sections());
    }
    if (!node.is_table()) {
      throw ToolError("{}: {} is {}; it must be a section: [{}] with its keys below", at(layer, node),
                      section->first, type_of(node), section->first);
    }
    for (const auto& [key, value] : *node.as_table()) {
      if (knows(section->first, key.str())) continue;
      throw ToolError("{}: no key '{}.{}'; [{}] has {}", at(layer, value), section->first,
                      one_line(key.str()), section->first, fmt::join(section->second, ", "));
    }
  }
}

bool TomlKeys::knows(const std::string& section, std::string_view key) const {
  const std::vector<std::string>& keys = keys_.at(section);
  return std::find(keys.begin(), keys.end(), key) != keys.end();
}

std::string TomlKeys::sections() const {
  std::string names;
  for (const auto& entry : keys_) {
    if (!entry.first.empty()) names += fmt::format("{}[{}]", names.empty() ? "" : ", ", entry.first);
  }
  return names;
}

void LayeredToml::section(const char* name) {
  if (section_ != name) floor_ = 0;
  section_ = name;
}

LayeredToml::Found LayeredToml::find(const char* key) const {
  for (int i = static_cast<int>(layers_.size()) - 1; i >= floor_; --i) {
    const toml::table& root = layers_[static_cast<std::size_t>(i)].table;
    const toml::table* table = section_.empty() ? &root : root[section_].as_table();
    if (table != nullptr && table->get(key) != nullptr) return {table->get(key), i};
  }
  return {};
}

bool LayeredToml::number(const char* key, double& value, double low, double high) {
  const Found found = find(key);
  if (found.node == nullptr) return false;
  const auto number = found.node->value<double>();
  if (!number || !found.node->is_number()) refuse_type(found, key, "a number");
  if (!(*number >= low && *number <= high)) {
    fail(key, fmt::format("= {} is out of range; use {} to {}", *number, low, high));
  }
  value = *number;
  return true;
}

bool LayeredToml::number(const char* key, std::optional<double>& value, double low, double high) {
  double number_read = 0.0;
  if (!number(key, number_read, low, high)) return false;
  value = number_read;
  return true;
}

bool LayeredToml::read_whole(const char* key, std::int64_t& value, std::int64_t low,
                             std::int64_t high) const {
  const Found found = find(key);
  if (found.node == nullptr) return false;
  if (!found.node->is_integer()) refuse_type(found, key, "a whole number");
  const std::int64_t number = found.node->as_integer()->get();
  if (number < low || number > high)
    fail(key, fmt::format("= {} is out of range; use {} to {}", number, low, high));
  value = number;
  return true;
}

bool LayeredToml::flag(const char* key, bool& value) {
  const Found found = find(key);
  if (found.node == nullptr) return false;
  if (!found.node->is_boolean()) refuse_type(found, key, "true or false");
  value = found.node->as_boolean()->get();
  return true;
}

bool LayeredToml::text(const char* key, std::string& value) {
  const Found found = find(key);
  if (found.node == nullptr) return false;
  if (!found.node->is_string()) refuse_type(found, key, "text in quotes");
  value = found.node->as_string()->get();
  return true;
}

void LayeredToml::fail(const char* key, const std::string& why, const char* or_key) const {
  Found found = find(key);
  if (found.node == nullptr && or_key != nullptr) found = find(or_key);
  const std::string name = section_.empty() ? key : section_ + "." + key;
  if (found.node != nullptr)
    throw ToolError("{}: {} {}", at(layer(found.layer), *found.node), name, one_line(why));
  const TomlLayer* file = nullptr;
  for (const TomlLayer& layer : layers_) file = layer.is_file ? &layer : file;
  throw ToolError("{}: {} {}", file != nullptr ? file->name : "scene", name, one_line(why));
}

void LayeredToml::refuse_type(const Found& found, const char* key, const char* wanted) const {
  fail(key, fmt::format("is {}; it must be {}", type_of(*found.node), wanted));
}

}  // namespace cairn::ground
