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

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// A field in quotes may hold line ends: where the line that begins `text` ends. A quote that begins no
/// field, or that nothing closes, is a mark like others.
std::size_t end_of_line(std::string_view text) {
  const std::size_t first_end = std::min(text.find('\n'), text.size());
  bool quoted = false;
  bool begins = true;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '\n' && !quoted) return i;
    if (c == '"' && (quoted || begins)) quoted = !quoted;
    begins = c == ',' || c == ';' || c == '\t' || c == '"' || (begins && c == ' ');  // "" is one in a field
  }
  return quoted ? first_end : text.size();
}

/// Without a byte order mark, empty lines and comments; the first line names the columns of a table.
enum class LineEnds : std::uint8_t { kAll, kOutsideQuotes };
std::vector<Line> lines_of(const std::vector<std::uint8_t>& bytes, LineEnds ends) {
  std::vector<Line> lines;
  int number = 1;
  std::string_view all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (all.substr(0, 3) == "\xEF\xBB\xBF") all.remove_prefix(3);
  while (!all.empty()) {
    const std::size_t begin = all.find_first_not_of(" \t\r,");
    const std::size_t first = all.find_first_not_of(" \t\r,;\"");
    const bool comment = begin != std::string_view::npos && all[begin] == '#';
    const std::size_t end =
        ends == LineEnds::kAll || comment ? std::min(all.find('\n'), all.size()) : end_of_line(all);
    if (!comment && first < end) lines.push_back({number, all.substr(0, end)});
    number +=
        static_cast<int>(std::count(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(end), '\n')) + 1;
    all.remove_prefix(std::min(end + 1, all.size()));
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

/// Of the line of names: semicolons or tabs where the comma is the decimal sign.
char separator_of(std::string_view names) {
  const auto parts = [&](char c) { return split_quoted(names, c).size(); };
  const char marks = parts(';') > parts(',') ? ';' : ',';
  return parts('\t') > parts(marks) ? '\t' : marks;
}

std::vector<std::string_view> fields_of(std::string_view line, char separator) {
  if (line.find(separator) == std::string_view::npos) return words_of(line);
  constexpr std::string_view kAround = " \t\r\n\"";
  std::vector<std::string_view> fields = split_quoted(line, separator);
  for (std::string_view& field : fields) {
    field.remove_prefix(std::min(field.find_first_not_of(kAround), field.size()));
    field = field.substr(0, field.find_last_not_of(kAround) + 1);
  }
  return fields;
}

/// "sep=;" before the names: what Excel is told, and tells.
std::optional<char> told_separator(std::string_view line) {
  line = line.substr(0, line.find_last_not_of(" \r\"") + 1);
  line.remove_prefix(std::min(line.find_first_not_of(" \""), line.size()));
  const bool told = line.size() == 5 && same_name(line.substr(0, 4), "sep=");
  return told ? std::optional<char>(line[4]) : std::nullopt;
}

/// As spreadsheets of half of the world write it: 1,5.
std::string with_point(std::string_view text) {
  std::string number(text);
  if (std::count(text.begin(), text.end(), ',') == 1 && text.find('.') == std::string_view::npos)
    number[number.find(',')] = '.';
  return number;
}

/// A sign or none, digits, one `mark`, digits: how many behind it; nothing where the text is anything else.
std::optional<std::size_t> digits_behind(std::string_view text, char mark) {
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) text.remove_prefix(1);
  const std::size_t at = text.find(mark);
  const auto digits = std::count_if(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (at == std::string_view::npos || digits == 0 || static_cast<std::size_t>(digits) + 1 != text.size())
    return std::nullopt;
  return text.size() - at - 1;
}

/// 500,123 and the like: three digits behind the mark, one to three before it, the first of them no 0.
bool is_thousands(std::string_view text, char mark) {
  const std::size_t first = text.find_first_not_of("+-");
  return digits_behind(text, mark) == std::size_t{3} && text[first] != '0' && text[first] != mark &&
         text.size() - first <= 7;
}

bool is_fraction(std::string_view text, char mark) {
  return digits_behind(text, mark) && !is_thousands(text, mark);
}

NumberRow parse_row(const std::filesystem::path& path, const Line& line) {
  NumberRow row;
  row.line = line.number;
  std::vector<std::string_view> words = words_of(line.text.substr(0, line.text.find('#')));
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

bool same_name(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower(x) == lower(y); });
}

std::optional<double> to_table_number(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  text.remove_prefix(std::min(text.find_first_not_of(kBlank), text.size()));
  return to_finite(with_point(text.substr(0, text.find_last_not_of(kBlank) + 1)));
}

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

void refuse_wide_text(const std::filesystem::path& path, const std::vector<std::uint8_t>& bytes) {
  if (bytes.size() > 1 && ((bytes[0] == 0xFF && bytes[1] == 0xFE) || (bytes[0] == 0xFE && bytes[1] == 0xFF)))
    throw ToolError("{}: is text of 16 bits a character; save it in UTF-8", path.string());
}

std::vector<NumberRow> read_number_rows(const std::filesystem::path& path) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  refuse_wide_text(path, bytes);
  std::vector<NumberRow> rows;
  for (const Line& line : lines_of(bytes, LineEnds::kAll)) rows.push_back(parse_row(path, line));
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
  refuse_wide_text(path_, text_);
  std::vector<Line> lines = lines_of(text_, LineEnds::kOutsideQuotes);
  const std::optional<char> told = lines.empty() ? std::nullopt : told_separator(lines[0].text);
  if (told) lines.erase(lines.begin());
  if (lines.empty()) throw ToolError("{}: is empty; its first line must name the columns", path_.string());
  const char separator = told.value_or(separator_of(lines[0].text));
  names_ = fields_of(lines[0].text, separator);
  for (std::size_t i = 1; i < lines.size(); ++i) {
    std::vector<std::string_view> fields = fields_of(lines[i].text, separator);
    if (separator == '\t' && fields.size() != names_.size())
      fields = words_of(lines[i].text);  // aligned by tabs
    if (fields.size() != names_.size()) {
      throw ToolError("{}:{}: {} fields under {} column names; {}", path_.string(), lines[i].number,
                      fields.size(), names_.size(), mend_or(kMendRow));
    }
    fields_.insert(fields_.end(), fields.begin(), fields.end());
    lines_.push_back(lines[i].number);
  }
  comma_is_decimal_ = std::any_of(fields_.begin(), fields_.end(), [](auto f) { return is_fraction(f, ','); });
  point_is_decimal_ = std::any_of(fields_.begin(), fields_.end(), [](auto f) { return is_fraction(f, '.'); });
  comma_is_separator_ = separator == ',';
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
  const double value = any_number(row, column);
  if (!std::isfinite(value)) refuse(row, column);
  return value;
}

double CsvTable::any_number(std::size_t row, std::size_t column) const {
  const std::string_view text = word(row, column);
  const bool comma =
      is_thousands(text, ',') && (point_is_decimal_ || (comma_is_separator_ && !comma_is_decimal_));
  if (comma || (is_thousands(text, '.') && comma_is_decimal_))
    throw ToolError(
        "{}:{}: '{}' in column '{}' may be a number of thousands or a fraction; write numbers "
        "without marks between thousands",
        path_.string(), lines_[row], text, names_[column]);
  const std::optional<double> value = to_number<double>(with_point(text));
  if (!value) refuse(row, column);
  return *value;
}

void CsvTable::refuse(std::size_t row, std::size_t column) const {
  throw ToolError("{}:{}: '{}' in column '{}' is not a number; {}", path_.string(), lines_[row],
                  word(row, column), names_[column], mend_or(kMendRow));
}

}  // namespace cairn::ground
