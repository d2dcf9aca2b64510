#include "base/boulder_table.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/number_table.hpp"
#include "base/tool_error.hpp"
#include "core/trig.hpp"

namespace cairn::ground {

bool is_crater(std::string_view kind) { return same_name(kind, "crater") || same_name(kind, "craters"); }

void check_boulder(const TableBoulder& boulder, const std::string& where) {
  if (!(boulder.diameter_m > 0.0))
    throw ToolError("{}: the diameter is not positive; correct or remove it", where);
  if (!(boulder.confidence >= 0.0 && boulder.confidence <= 1.0))
    throw ToolError("{}: a confidence of {} is no probability; give 0 to 1, per cent divided by 100", where,
                    boulder.confidence);
}

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

namespace {

void add_lines(std::string& text, const std::vector<TableBoulder>& boulders, const char* kind) {
  for (const TableBoulder& b : boulders) {
    const std::string contrast = b.contrast == 0.0 ? "" : fmt::format("{:.3f}", b.contrast);
    text += fmt::format("{:.4f},{:.4f},{:.4f},{:.6f},{},{:.2f},{:.3f},{:.3f},", b.p_map_m.x(), b.p_map_m.y(),
                        b.diameter_m, b.area_m2, contrast, b.elongation, b.height_m, b.confidence);
    if (std::isfinite(b.ground_z_m)) text += fmt::format("{:.3f}", b.ground_z_m);
    text += fmt::format(",{}\n", kind);
  }
}

}  // namespace

std::string to_csv(const std::vector<TableBoulder>& boulders, const std::vector<TableBoulder>& craters) {
  std::string text = "x_m,y_m,diameter_m,area_m2,contrast,elongation,height_m,confidence,ground_z_m,kind\n";
  add_lines(text, boulders, "boulder");
  add_lines(text, craters, "crater");
  return text;
}

namespace {

/// "POINT (1 2)", "Point Z(1 2 3)" and the like: of well-known text, the numbers of the
/// first two coordinates.
Vec2 point_of(const CsvTable& table, std::size_t row, std::size_t column, const std::filesystem::path& path) {
  const std::string_view text = table.word(row, column);
  const std::size_t open = text.find('(');
  const std::size_t close = text.find(')');
  if (open != std::string_view::npos && close != std::string_view::npos && open < close && text.size() >= 5 &&
      (text[1] == 'O' || text[1] == 'o')) {
    std::vector<std::string_view> words;
    for (const std::string_view word : split(text.substr(open + 1, close - open - 1), ' ')) {
      if (!word.empty()) words.push_back(word);
    }
    const std::optional<double> x = words.size() >= 2 ? to_finite(words[0]) : std::nullopt;
    const std::optional<double> y = words.size() >= 2 ? to_finite(words[1]) : std::nullopt;
    if (x && y) return {*x, *y};
  }
  throw ToolError("{}:{}: '{}' is not a point of well-known text; export points, or columns x and y",
                  path.string(), table.line(row), text);
}

}  // namespace

std::vector<TableBoulder> read_csv(const std::filesystem::path& path, double min_diameter_m) {
  const CsvTable table(path);
  const std::optional<std::size_t> point = table.find({"wkt", "wkt_geom", "geometry", "geom"});
  const bool wkt = point && !table.find({"x_m", "x"});
  const std::size_t x = wkt ? *point : table.column({"x_m", "x"});
  const std::size_t y = wkt ? *point : table.column({"y_m", "y"});
  const std::size_t diameter = table.column({"diameter_m", "diameter", "size"});
  const std::optional<std::size_t> kind = table.find({"kind"});
  struct Optional {
    std::optional<std::size_t> column;
    double TableBoulder::*member;
  };
  const Optional others[] = {{table.find({"area_m2"}), &TableBoulder::area_m2},
                             {table.find({"contrast"}), &TableBoulder::contrast},
                             {table.find({"elongation"}), &TableBoulder::elongation},
                             {table.find({"height_m"}), &TableBoulder::height_m},
                             {table.find({"confidence"}), &TableBoulder::confidence},
                             {table.find({"ground_z_m"}), &TableBoulder::ground_z_m}};

  std::vector<TableBoulder> boulders;
  for (std::size_t row = 0; row < table.size(); ++row) {
    if (kind && is_crater(table.word(row, *kind))) continue;
    TableBoulder b;
    b.p_map_m = wkt ? point_of(table, row, x, path) : Vec2(table.number(row, x), table.number(row, y));
    b.diameter_m = table.number(row, diameter);
    b.area_m2 = 0.25 * kPi * b.diameter_m * b.diameter_m;
    for (const Optional& other : others) {
      if (!other.column || table.word(row, *other.column).empty()) continue;
      b.*other.member = table.number(row, *other.column);
    }
    check_boulder(b, fmt::format("{}:{}", path.string(), table.line(row)));
    if (b.diameter_m >= min_diameter_m) boulders.push_back(b);
  }
  return boulders;
}

}  // namespace cairn::ground
