/// TOML in layers: a file, then settings of the command line, each of which replaces values. What is wrong
/// with a value is told with the place where it stands, in one line.
///
/// Keys are named once, by a visitor with section(name), number(key, value, low, high), whole(...) and
/// flag(key, value): TomlKeys gathers them, LayeredToml reads them.
#pragma once

#include <toml++/toml.h>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cairn::ground {

/// One source of values. Later ones replace earlier.
struct TomlLayer {
  toml::table table;
  std::string name;
  bool is_file = false;
};

/// Throws ToolError: cannot be read, not TOML (line).
TomlLayer read_toml(const std::filesystem::path& path);

/// "section.key=value" of an option --set; a value that is no TOML is taken as text. Throws ToolError.
TomlLayer toml_setting(const std::string& text);

/// The keys that there are, by section; "" before the first.
class TomlKeys {
 public:
  void section(const char* name) { section_ = name; }
  void add(const char* key) { keys_[section_].emplace_back(key); }
  template <typename T>
  void number(const char* key, const T&, double, double) {
    add(key);
  }
  void whole(const char* key, int, int, int) { add(key); }
  void flag(const char* key, bool) { add(key); }

  /// Throws ToolError at the first key or section that is none of these.
  void refuse_others(const TomlLayer& layer) const;

 private:
  bool knows(const std::string& section, std::string_view key) const;
  std::string sections() const;

  std::string section_;
  std::map<std::string, std::vector<std::string>> keys_;
};

/// Takes values out of layers; each function leaves `value` as it is where no layer has the key, and tells
/// whether one has. Throws ToolError where the type or the range is wrong.
class LayeredToml {
 public:
  explicit LayeredToml(std::vector<TomlLayer> layers) : layers_(std::move(layers)) {}

  void section(const char* name);
  /// Of this section, values of layers before `floor` do not count.
  void ignore_before(int floor) { floor_ = floor; }

  bool number(const char* key, double& value, double low, double high);
  bool number(const char* key, std::optional<double>& value, double low, double high);
  template <typename Int>
  bool whole(const char* key, Int& value, std::int64_t low, std::int64_t high) {
    std::int64_t number = 0;
    if (!read_whole(key, number, low, high)) return false;
    value = static_cast<Int>(number);
    return true;
  }
  bool flag(const char* key, bool& value);
  bool text(const char* key, std::string& value);

  struct Found {
    const toml::node* node = nullptr;
    int layer = -1;
  };
  /// The value that counts.
  Found find(const char* key) const;
  int layer_of(const char* key) const { return find(key).layer; }
  const TomlLayer& layer(int index) const { return layers_[static_cast<std::size_t>(index)]; }

  /// Refuses a value; where it is not given, `or_key` tells where to look.
  [[noreturn]] void fail(const char* key, const std::string& why, const char* or_key = nullptr) const;
  [[noreturn]] void refuse_type(const Found& found, const char* key, const char* wanted) const;

 private:
  bool read_whole(const char* key, std::int64_t& value, std::int64_t low, std::int64_t high) const;

  std::vector<TomlLayer> layers_;
  std::string section_;
  int floor_ = 0;
};

}  // namespace cairn::ground
