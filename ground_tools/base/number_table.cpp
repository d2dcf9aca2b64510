#include "base/number_table.hpp"

#include <algorithm>
#include <cmath>

#include "base/output_file.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

constexpr const char* kMendRow = "correct or remove this line";

struct Line {
  int number;
  std::string_view text;
};

/// Without a byte order mark, empty lines and comments.
std::vector<Line> lines_of(const std::vector<std::uint8_t>& bytes) {
  std::vector<Line> lines;
  int number = 0;
  std::string_view all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (all.substr(0, 3) == "\xEF\xBB\xBF") all.remove_prefix(3);
  for (const std::string_view text : split(all, '\n')) {
    ++number;
    const std::size_t first = text.find_first_not_of(" \t\r,");
    if (first != std::string_view::npos && text[first] != '#') lines.push_back({number, text});
  }
  return lines;
}

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  constexpr std::string_view kBlank = " \t\r,";
  for (std::size_t at = text.find_first_not_of(kBlank); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(kBlank, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = text.find_first_not_of(kBlank, end);
  }
  return words;
}

/// Of the line of names: semicolons where the comma is the decimal sign.
char separator_of(std::string_view names) {
  const auto count = [&](char c) { return std::count(names.begin(), names.end(), c); };
  return count(';') > count(',') ? ';' : ',';
}

/// Separators within quotes part nothing.
std::vector<std::string_view> split_quoted(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  bool quoted = false;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"') quoted = !quoted;
    if (line[i] != separator || quoted) continue;
    fields.push_back(line.substr(begin, i - begin));
    begin = i + 1;
  }
  fields.push_back(line.substr(begin));
  return fields;
}

std::vector<std::string_view> fields_of(std::string_view line, char separator) {
  if (line.find(separator) == std::string_view::npos) return words_of(line);
  constexpr std::string_view kAround = " \t\r\"";
  std::vector<std::string_view> fields = split_quoted(line, separator);
  for (std::string_view& field : fields) {
    field.remove_prefix(std::min(field.find_first_not_of(kAround), field.size()));
    field = field.substr(0, field.find_last_not_of(kAround) + 1);
  }
  return fields;
}

/// As spreadsheets of half of the world write it: 1,5.
std::string with_point(std::string_view text) {
  std::string number(text);
  if (std::count(text.begin(), text.end(), ',') == 1 && text.find('.') == std::string_view::npos)
    number[number.find(',')] = '.';
  return number;
}

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool same_name(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower(x) == lower(y); });
}

NumberRow parse_row(const std::filesystem::path& path, const Line& line) {
  NumberRow row;
  row.line = line.number;
  std::vector<std::string_view> words = words_of(line.text);
  if (words[0].back() == ':') {
    row.tag = words[0].substr(0, words[0].size() - 1);
    words.erase(words.begin());
  }
  for (const std::string_view word : words) {
    const std::optional<double> value = to_finite(word);
    if (!value)
      throw ToolError("{}:{}: '{}' is not a finite number; correct this line", path.string(), line.number,
                      word);
    row.values.push_back(*value);
  }
  return row;
}

}  // namespace

std::optional<double> to_finite(std::string_view text) {
  const std::optional<double> value = to_number<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  while (true) {
    const std::size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

std::vector<NumberRow> read_number_rows(const std::filesystem::path& path) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  std::vector<NumberRow> rows;
  for (const Line& line : lines_of(bytes)) rows.push_back(parse_row(path, line));
  return rows;
}

std::vector<NumberRow> read_number_rows(const std::filesystem::path& path, std::size_t columns,
                                        const char* form) {
  std::vector<NumberRow> rows = read_number_rows(path);
  for (const NumberRow& row : rows) {
    if (row.values.size() != columns || !row.tag.empty()) {
      throw ToolError("{}:{}: {} numbers in this line; it needs {}: {}", path.string(), row.line,
                      row.values.size(), columns, form);
    }
  }
  return rows;
}

CsvTable::CsvTable(std::filesystem::path path, std::string mend)
    : path_(std::move(path)), mend_(std::move(mend)), text_(read_file(path_)) {
  if (text_.size() > 1 && ((text_[0] == 0xFF && text_[1] == 0xFE) || (text_[0] == 0xFE && text_[1] == 0xFF)))
    throw ToolError("{}: is text of 16 bits a character; save it as CSV in UTF-8", path_.string());
  const std::vector<Line> lines = lines_of(text_);
  if (lines.empty()) throw ToolError("{}: is empty; its first line must name the columns", path_.string());
  const char separator = separator_of(lines[0].text);
  names_ = fields_of(lines[0].text, separator);
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::vector<std::string_view> fields = fields_of(lines[i].text, separator);
    if (fields.size() != names_.size()) {
      throw ToolError("{}:{}: {} fields under {} column names; {}", path_.string(), lines[i].number,
                      fields.size(), names_.size(), mend_or(kMendRow));
    }
    fields_.insert(fields_.end(), fields.begin(), fields.end());
    lines_.push_back(lines[i].number);
  }
}

std::optional<std::size_t> CsvTable::find(std::initializer_list<const char*> names) const {
  for (const char* name : names) {
    const auto at = std::find_if(names_.begin(), names_.end(),
                                 [&](std::string_view there) { return same_name(there, name); });
    if (at != names_.end()) return static_cast<std::size_t>(at - names_.begin());
  }
  return std::nullopt;
}

std::size_t CsvTable::column(std::initializer_list<const char*> names) const {
  const std::optional<std::size_t> at = find(names);
  if (!at) {
    throw ToolError("{}: no column '{}' in its first line (it has {}); {}", path_.string(),
                    fmt::join(names, "' or '"), fmt::join(names_, ", "), mend_or("name it there"));
  }
  return *at;
}

double CsvTable::number(std::size_t row, std::size_t column) const {
  const std::optional<double> value = to_finite(with_point(word(row, column)));
  if (!value) refuse(row, column);
  return *value;
}

double CsvTable::any_number(std::size_t row, std::size_t column) const {
  const std::optional<double> value = to_number<double>(with_point(word(row, column)));
  if (!value) refuse(row, column);
  return *value;
}

void CsvTable::refuse(std::size_t row, std::size_t column) const {
  throw ToolError("{}:{}: '{}' in column '{}' is not a number; {}", path_.string(), lines_[row],
                  word(row, column), names_[column], mend_or(kMendRow));
}

}  // namespace cairn::ground
