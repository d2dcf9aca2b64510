/// Text files of numbers: calibrations, poses, stamps, trajectories, tables.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace cairn::ground {

struct NumberRow {
  int line = 0;     ///< from 1, for messages
  std::string tag;  ///< "P0" of a row that starts with `P0:`, else empty
  std::vector<double> values;
};

/// Rows of finite numbers separated by blanks or commas. Empty lines and lines that start with '#' are left
/// out. Throws ToolError (file and line) where a word is no finite number, or the file cannot be read.
std::vector<NumberRow> read_number_rows(const std::filesystem::path& path);

/// As above, each row with `columns` numbers and no tag. `form` tells the user what a row holds.
std::vector<NumberRow> read_number_rows(const std::filesystem::path& path, std::size_t columns,
                                        const char* form);

/// A CSV table of numbers with one line of column names.
class CsvTable {
 public:
  /// Throws ToolError as `read_number_rows`, and where a row is shorter or longer than the names.
  explicit CsvTable(const std::filesystem::path& path);

  const std::vector<NumberRow>& rows() const { return rows_; }
  /// Index of a column; throws ToolError that lists what is there.
  std::size_t column(const std::string& name) const;

 private:
  std::filesystem::path path_;
  std::vector<std::string> names_;
  std::vector<NumberRow> rows_;
};

}  // namespace cairn::ground
