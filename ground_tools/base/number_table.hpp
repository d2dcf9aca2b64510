/// Text files of numbers: calibrations, poses, stamps, trajectories, tables.
#pragma once

#include <charconv>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cairn::ground {

/// The whole of `text` as a number, a leading plus allowed; nothing where it is none, or does not fit. Reals:
/// infinity and NaN, too.
template <typename T>
std::optional<T> to_number(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// The same for a finite real.
std::optional<double> to_finite(std::string_view text);

/// The same as spreadsheets of half of the world write it, 1,5, with blanks around it.
std::optional<double> to_table_number(std::string_view text);

/// But for small letters and capitals.
bool same_name(std::string_view a, std::string_view b);

/// The parts between separators, one more than there are separators.
std::vector<std::string_view> split(std::string_view text, char separator);

struct NumberRow {
  int line = 0;     ///< from 1, for messages
  std::string tag;  ///< "P0" of a row that starts with `P0:`, else empty
  std::vector<double> values;
};

/// Throws ToolError where a file is text of 16 bits a character, as some editors save it.
void refuse_wide_text(const std::filesystem::path& path, const std::vector<std::uint8_t>& bytes);

/// Rows of finite numbers separated by blanks or commas. Empty lines are left out, and what follows a '#'.
/// Throws ToolError (file and line) where a word is no finite number, or the file cannot be read.
std::vector<NumberRow> read_number_rows(const std::filesystem::path& path);

/// As above, each row with `columns` numbers and no tag. `form` tells the user what a row holds.
std::vector<NumberRow> read_number_rows(const std::filesystem::path& path, std::size_t columns,
                                        const char* form);

/// A CSV table: one line of column names, then rows with a field for each. Blanks and quotes around a field
/// do not belong to it; a line without a comma may separate fields by blanks; empty lines and lines that
/// start with '#' are left out. As spreadsheets write them, too: a byte order mark; semicolons or tabs
/// between fields, where the names have more of these than commas, or what a first line `sep=;` tells; a
/// comma for the decimal point; separators and line ends within quotes; rows of empty fields, left out.
/// Names are the same in small letters and capitals.
class CsvTable {
 public:
  /// `mend` ends the messages, for tables that nobody writes by hand. Throws ToolError: cannot be read,
  /// empty, a row with more or fewer fields than there are names.
  explicit CsvTable(std::filesystem::path path, std::string mend = {});
  CsvTable(CsvTable&&) = default;  // fields are views of the text
  CsvTable(const CsvTable&) = delete;
  CsvTable& operator=(const CsvTable&) = delete;

  std::size_t size() const { return lines_.size(); }
  int line(std::size_t row) const { return lines_[row]; }  ///< of the file, from 1
  /// The file does not end with a line end, so that its last line may be cut off.
  bool cut_off() const { return text_.back() != '\n'; }

  /// The first column that has one of these names.
  std::optional<std::size_t> find(std::initializer_list<const char*> names) const;
  /// As above; throws ToolError that lists what is there.
  std::size_t column(std::initializer_list<const char*> names) const;
  std::size_t column(const char* name) const { return column({name}); }

  std::string_view word(std::size_t row, std::size_t column) const {
    return fields_[row * names_.size() + column];
  }
  /// Throws ToolError (line) where the field is no finite number, or may be one of thousands: 500,123 between
  /// commas, or where other fields have a decimal point; 1.234 where others have decimal commas.
  double number(std::size_t row, std::size_t column) const;
  /// The same, infinity and NaN allowed.
  double any_number(std::size_t row, std::size_t column) const;

 private:
  std::string mend_or(const char* otherwise) const { return mend_.empty() ? otherwise : mend_; }
  [[noreturn]] void refuse(std::size_t row, std::size_t column) const;

  std::filesystem::path path_;
  std::string mend_;
  std::vector<std::uint8_t> text_;
  std::vector<std::string_view> names_;
  std::vector<std::string_view> fields_;  ///< row by row
  std::vector<int> lines_;                ///< of each row
  bool comma_is_separator_ = false;
  bool comma_is_decimal_ = false;  ///< in some field
  bool point_is_decimal_ = false;
};

}  // namespace cairn::ground
