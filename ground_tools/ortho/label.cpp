#include "ortho/label.hpp"

#include <cpl_minixml.h>
#include <fmt/format.h>
#include <gdal_priv.h>

#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>

#include "core/trig.hpp"

namespace cairn::ground {
namespace {

using Json = nlohmann::json;

std::string plain(std::string_view name) {
  if (const std::size_t colon = name.rfind(':'); colon != std::string_view::npos)
    name.remove_prefix(colon + 1);
  std::string text;
  for (const char c : name) {
    if (c >= 'a' && c <= 'z') text += static_cast<char>(c - 'a' + 'A');
    if ((c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9')) text += c;
  }
  return text;
}

/// PDS3's RADIX#DIGITS#; nothing where the text is none.
std::optional<double> based_number(std::string_view text) {
  const std::size_t first = text.find('#');
  if (first == std::string_view::npos || first == 0) return std::nullopt;
  const std::size_t second = text.find('#', first + 1);
  if (second == std::string_view::npos) return std::nullopt;
  int radix = 0;
  std::uint64_t value = 0;
  const char* const digits = text.data() + first + 1;
  if (std::from_chars(text.data(), text.data() + first, radix).ptr != text.data() + first || radix < 2 ||
      radix > 16 || std::from_chars(digits, text.data() + second, value, radix).ptr != text.data() + second)
    return std::nullopt;
  return static_cast<double>(value);
}

/// A number, and behind it nothing or a unit: "32.5", "32.5 <deg>", "\"32.5\"".
std::optional<double> number(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '"' || text.front() == '+'))
    text.remove_prefix(1);
  if (const std::optional<double> based = based_number(text)) return based;
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
  const std::string_view rest(end, static_cast<std::size_t>(text.data() + text.size() - end));
  if (!rest.empty() && std::string_view(" \t\r\"<").find(rest.front()) == std::string_view::npos)
    return std::nullopt;
  return rest.find("rad") != std::string_view::npos || rest.find("RAD") != std::string_view::npos
             ? value * kDegPerRad
             : value;
}

void note(Label& label, std::string_view name, std::string_view value) {
  if (const std::optional<double> found = number(value)) label.emplace(plain(name), *found);
}

// Labels nest a few deep; what is deeper is none.
constexpr int kDepth = 16;

void note_json(Label& label, const Json& at, int depth = 0) {
  if (!at.is_object() || depth > kDepth) return;
  for (const auto& [name, value] : at.items()) {
    if (value.is_number()) {
      label.emplace(plain(name), value.get<double>());
    } else if (value.is_string()) {
      note(label, name, value.get<std::string>());
    } else if (value.is_object() && value.contains("value") && value["value"].is_number()) {
      note(label, name,
           fmt::format("{} {}", value["value"].get<double>(), value.value("unit", std::string())));
    } else {
      note_json(label, value, depth + 1);
    }
  }
}

void note_xml(Label& label, const CPLXMLNode* node, int depth = 0) {
  if (depth > kDepth) return;
  for (; node != nullptr; node = node->psNext) {
    if (node->eType != CXT_Element) continue;
    const char* unit = CPLGetXMLValue(node, "unit", "");
    note(label, node->pszValue, fmt::format("{} {}", CPLGetXMLValue(node, "", ""), unit));
    note_xml(label, node->psChild, depth + 1);
  }
}

/// NAME = VALUE, line by line, up to END: PDS3 as text.
void note_text(Label& label, const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line;
  for (int lines = 0; lines < 10000 && std::getline(file, line); ++lines) {
    const std::size_t equals = line.find('=');
    if (equals != std::string::npos) note(label, line.substr(0, equals), line.substr(equals + 1));
    if (plain(line) == "END") return;
  }
}

/// The items of a metadata domain that holds one text, JSON or XML.
const char* whole_domain(GDALDataset& image, const char* domain) {
  char** const items = image.GetMetadata(domain);
  return items == nullptr ? nullptr : items[0];
}

Json json_label(GDALDataset& image, const char* domain) {
  const char* const text = whole_domain(image, domain);
  return text == nullptr ? Json() : Json::parse(text, nullptr, false);
}

}  // namespace

Label label_of(GDALDataset& image) {
  Label label;
  for (char** item = image.GetMetadata(); item != nullptr && *item != nullptr; ++item) {
    const std::string_view text(*item);
    const std::size_t equals = text.find('=');
    if (equals != std::string_view::npos) note(label, text.substr(0, equals), text.substr(equals + 1));
  }
  for (const char* domain : {"json:ISIS3", "json:PDS", "json:VICAR"})
    note_json(label, json_label(image, domain));
  if (const char* const text = whole_domain(image, "xml:PDS4")) {
    CPLXMLNode* const tree = CPLParseXMLString(text);
    note_xml(label, tree);
    CPLDestroyXMLNode(tree);
  }
  const std::filesystem::path file(image.GetDescription());
  for (const char* ending : {".LBL", ".lbl"}) {
    std::error_code none;
    const std::filesystem::path beside = std::filesystem::path(file).replace_extension(ending);
    if (std::filesystem::is_regular_file(beside, none)) note_text(label, beside);
  }
  return label;
}

std::optional<double> first_of(const Label& label, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    const auto found = label.find(name);
    if (found != label.end()) return found->second;
  }
  return std::nullopt;
}

}  // namespace cairn::ground
