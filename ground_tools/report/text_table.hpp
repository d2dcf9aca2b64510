/// CSV tables of numbers and words, as `cairn run` writes them: one line of column names, no quotes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace cairn::ground {

class TextTable {
 public:
  /// Throws ToolError: cannot be read, empty, the last line cut off, a row with more or fewer fields than
  /// there are names.
  explicit TextTable(const std::filesystem::path& path);

  std::size_t size() const { return rows_.size(); }
  /// The column of that name; throws ToolError where there is none.
  std::vector<std::string> words(const std::string& column) const;
  /// The same as numbers, rounded to 1e-5 so that they take little room as text; throws ToolError (line)
  /// where one is none. NaN and infinity are numbers here.
  std::vector<double> numbers(const std::string& column) const;

 private:
  std::size_t index_of(const std::string& column) const;

  std::filesystem::path path_;
  std::vector<std::string> names_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace cairn::ground
