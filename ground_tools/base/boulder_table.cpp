#include "base/boulder_table.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <sstream>
#include <string_view>

#include "base/output_file.hpp"
#include "base/tool_error.hpp"
#include "core/trig.hpp"

namespace cairn::ground {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\"";
  const std::size_t from = text.find_first_not_of(kBlank);
  if (from == std::string_view::npos) return {};
  return text.substr(from, text.find_last_not_of(kBlank) - from + 1);
}

std::vector<std::string> fields_of(std::string_view line) {
  std::vector<std::string> fields;
  std::size_t from = 0;
  while (true) {
    const std::size_t comma = line.find(',', from);
    fields.emplace_back(trimmed(line.substr(from, comma == std::string_view::npos ? comma : comma - from)));
    if (comma == std::string_view::npos) return fields;
    from = comma + 1;
  }
}

/// Looks columns up by name and numbers in lines; knows the file's name for its complaints.
class CsvColumns {
 public:
  CsvColumns(std::string name, const std::string& header)
      : name_(std::move(name)), header_(fields_of(header)) {}

  std::optional<std::size_t> find(std::initializer_list<const char*> names) const {
    for (const char* name : names) {
      const auto at = std::find(header_.begin(), header_.end(), name);
      if (at != header_.end()) return static_cast<std::size_t>(at - header_.begin());
    }
    return std::nullopt;
  }
  std::size_t need(std::initializer_list<const char*> names) const {
    const std::optional<std::size_t> column = find(names);
    if (!column) {
      throw ToolError(
          "{}: has no column '{}' in its first line; name the columns x, y and diameter (or x_m, y_m, "
          "diameter_m)",
          name_, *names.begin());
    }
    return *column;
  }
  double number(const std::vector<std::string>& fields, std::size_t column, std::size_t line) const {
    if (column >= fields.size()) {
      throw ToolError("{}:{}: has {} fields, the header {}; mend or remove the line", name_, line,
                      fields.size(), header_.size());
    }
    const std::string& text = fields[column];
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
      throw ToolError("{}:{}: '{}' in column '{}' is not a number; mend or remove the line", name_, line,
                      text, header_[column]);
    }
    return value;
  }

 private:
  std::string name_;
  std::vector<std::string> header_;
};

}  // namespace

MapExtent extent_of(const std::vector<TableBoulder>& boulders) {
  if (boulders.empty()) return {};
  constexpr double kRim = 0.01;
  const Vec2 first = boulders.front().p_map_m;
  MapExtent e{first.x(), first.y(), first.x(), first.y()};
  for (const TableBoulder& b : boulders) {
    e.min_x_m = std::min(e.min_x_m, b.p_map_m.x());
    e.min_y_m = std::min(e.min_y_m, b.p_map_m.y());
    e.max_x_m = std::max(e.max_x_m, b.p_map_m.x());
    e.max_y_m = std::max(e.max_y_m, b.p_map_m.y());
  }
  return {e.min_x_m - kRim, e.min_y_m - kRim, e.max_x_m + kRim, e.max_y_m + kRim};
}

std::string to_csv(const std::vector<TableBoulder>& boulders) {
  std::string text = "x_m,y_m,diameter_m,area_m2,contrast,elongation,height_m,confidence,ground_z_m\n";
  for (const TableBoulder& b : boulders) {
    text +=
        fmt::format("{:.4f},{:.4f},{:.4f},{:.6f},{:.3f},{:.2f},{:.3f},{:.3f},", b.p_map_m.x(), b.p_map_m.y(),
                    b.diameter_m, b.area_m2, b.contrast, b.elongation, b.height_m, b.confidence);
    if (std::isfinite(b.ground_z_m)) text += fmt::format("{:.3f}", b.ground_z_m);
    text += '\n';
  }
  return text;
}

std::vector<TableBoulder> read_csv(const std::filesystem::path& path, double min_diameter_m) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  std::istringstream text(std::string(bytes.begin(), bytes.end()));
  std::string line;
  if (!std::getline(text, line))
    throw ToolError("{}: is empty; give a table with a header line", path.string());
  const CsvColumns columns(path.string(), line);
  const std::size_t x = columns.need({"x_m", "x"});
  const std::size_t y = columns.need({"y_m", "y"});
  const std::size_t diameter = columns.need({"diameter_m", "diameter"});
  struct Optional {
    std::optional<std::size_t> column;
    double TableBoulder::*member;
  };
  const Optional others[] = {{columns.find({"area_m2"}), &TableBoulder::area_m2},
                             {columns.find({"contrast"}), &TableBoulder::contrast},
                             {columns.find({"elongation"}), &TableBoulder::elongation},
                             {columns.find({"height_m"}), &TableBoulder::height_m},
                             {columns.find({"confidence"}), &TableBoulder::confidence},
                             {columns.find({"ground_z_m"}), &TableBoulder::ground_z_m}};

  std::vector<TableBoulder> boulders;
  for (std::size_t number = 2; std::getline(text, line); ++number) {
    if (trimmed(line).empty()) continue;
    const std::vector<std::string> fields = fields_of(line);
    TableBoulder b;
    b.p_map_m = Vec2(columns.number(fields, x, number), columns.number(fields, y, number));
    b.diameter_m = columns.number(fields, diameter, number);
    if (!(b.diameter_m > 0.0)) {
      throw ToolError("{}:{}: the diameter is not positive; mend or remove the line", path.string(), number);
    }
    b.area_m2 = 0.25 * kPi * b.diameter_m * b.diameter_m;
    for (const Optional& other : others) {
      if (!other.column || (*other.column < fields.size() && fields[*other.column].empty())) continue;
      b.*other.member = columns.number(fields, *other.column, number);
    }
    if (b.diameter_m >= min_diameter_m) boulders.push_back(b);
  }
  return boulders;
}

}  // namespace cairn::ground
