#include "base/number_table.hpp"

#include <charconv>
#include <cmath>
#include <string_view>

#include "base/output_file.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

struct Line {
  int number;
  std::vector<std::string> words;
};

std::vector<std::string> split_words(std::string_view text) {
  std::vector<std::string> words;
  constexpr std::string_view kBlank = " \t\r,";
  for (std::size_t at = text.find_first_not_of(kBlank); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(kBlank, at), text.size());
    words.emplace_back(text.substr(at, end - at));
    at = text.find_first_not_of(kBlank, end);
  }
  return words;
}

std::vector<Line> read_lines(const std::filesystem::path& path) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::vector<Line> lines;
  int number = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    Line line{++number, split_words(text.substr(at, end - at))};
    if (!line.words.empty() && line.words[0][0] != '#') lines.push_back(std::move(line));
    at = end + 1;
  }
  return lines;
}

NumberRow parse_row(const std::filesystem::path& path, const Line& line) {
  NumberRow row;
  row.line = line.number;
  std::size_t first = 0;
  if (line.words[0].back() == ':') {
    row.tag = line.words[0].substr(0, line.words[0].size() - 1);
    first = 1;
  }
  for (std::size_t i = first; i < line.words.size(); ++i) {
    const std::string& word = line.words[i];
    double value = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) {
      throw ToolError("{}:{}: '{}' is not a finite number; mend this line", path.string(), line.number, word);
    }
    row.values.push_back(value);
  }
  return row;
}

}  // namespace

std::vector<NumberRow> read_number_rows(const std::filesystem::path& path) {
  std::vector<NumberRow> rows;
  for (const Line& line : read_lines(path)) rows.push_back(parse_row(path, line));
  return rows;
}

std::vector<NumberRow> read_number_rows(const std::filesystem::path& path, std::size_t columns,
                                        const char* form) {
  std::vector<NumberRow> rows = read_number_rows(path);
  for (const NumberRow& row : rows) {
    if (row.values.size() != columns || !row.tag.empty()) {
      throw ToolError("{}:{}: {} numbers in this line; it wants {}: {}", path.string(), row.line,
                      row.values.size(), columns, form);
    }
  }
  return rows;
}

CsvTable::CsvTable(const std::filesystem::path& path) : path_(path) {
  const std::vector<Line> lines = read_lines(path);
  if (lines.empty()) throw ToolError("{}: empty; its first line names the columns", path.string());
  names_ = lines[0].words;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    rows_.push_back(parse_row(path, lines[i]));
    if (rows_.back().values.size() != names_.size()) {
      throw ToolError("{}:{}: {} numbers under {} column names; mend this line", path.string(),
                      lines[i].number, rows_.back().values.size(), names_.size());
    }
  }
}

std::size_t CsvTable::column(const std::string& name) const {
  for (std::size_t i = 0; i < names_.size(); ++i) {
    if (names_[i] == name) return i;
  }
  throw ToolError("{}: no column '{}' (it has {}); name it in the first line", path_.string(), name,
                  fmt::format("{}", fmt::join(names_, ", ")));
}

}  // namespace cairn::ground
