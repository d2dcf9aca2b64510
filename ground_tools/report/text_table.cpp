#include "report/text_table.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "base/output_file.hpp"
#include "base/tool_error.hpp"

namespace cairn::ground {
namespace {

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields(1);
  for (const char c : line) {
    if (c == ',') {
      fields.emplace_back();
    } else if (c != '\r') {
      fields.back() += c;
    }
  }
  return fields;
}

}  // namespace

TextTable::TextTable(const std::filesystem::path& path) : path_(path) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  if (bytes.empty()) throw ToolError("{}: is empty; run `cairn run` again", path.string());
  if (bytes.back() != '\n')
    throw ToolError("{}: its last line is cut off; run `cairn run` again", path.string());
  std::string line;
  int number = 0;
  for (const std::uint8_t byte : bytes) {
    if (byte != '\n') {
      line += static_cast<char>(byte);
      continue;
    }
    ++number;
    std::vector<std::string> fields = fields_of(line);
    line.clear();
    if (number == 1) {
      names_ = std::move(fields);
    } else if (fields.size() != names_.size()) {
      throw ToolError("{}:{}: {} fields under {} column names; run `cairn run` again", path.string(), number,
                      fields.size(), names_.size());
    } else {
      rows_.push_back(std::move(fields));
    }
  }
}

std::size_t TextTable::index_of(const std::string& column) const {
  const auto at = std::find(names_.begin(), names_.end(), column);
  if (at == names_.end()) {
    throw ToolError("{}: no column '{}'; an older `cairn run` wrote it, run again", path_.string(), column);
  }
  return static_cast<std::size_t>(at - names_.begin());
}

std::vector<std::string> TextTable::words(const std::string& column) const {
  const std::size_t index = index_of(column);
  std::vector<std::string> words;
  for (const auto& row : rows_) words.push_back(row[index]);
  return words;
}

std::vector<double> TextTable::numbers(const std::string& column) const {
  const std::size_t index = index_of(column);
  std::vector<double> numbers;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const std::string& word = rows_[i][index];
    double value = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) {
      throw ToolError("{}:{}: '{}' under '{}' is no number; run `cairn run` again", path_.string(), i + 2,
                      word, column);
    }
    numbers.push_back(std::round(value * 1.0e5) / 1.0e5);
  }
  return numbers;
}

}  // namespace cairn::ground
