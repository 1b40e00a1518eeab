#pragma once
// Rows of a CSV file, one after the other.
//
// Cells are separated by commas or by semicolons: by the one of them that the first line gives as "sep=;", or
// else that comes first in the first row, outside of quotes. Blanks around cells do not count, and neither do
// lines without text or that start with #. A cell may be in quotes ("): it then may have separators and
// blanks, and a doubled quote is a quote of its text. A cell ends in its line. Numbers have a decimal point
// and may begin with a plus or a minus. A byte order mark is skipped. A file whose cells are separated by
// tabs is refused.
//
// Threads: one.

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <hil/diagnostics.hpp>

namespace hil::config {

/// Larger files, and longer rows, are refused.
inline constexpr std::size_t max_csv_bytes = std::size_t{64} << 20;
inline constexpr std::size_t max_csv_columns = 10'000;

/// The text with a decimal point, if it begins with a number that has a decimal comma: "0,5 m" -> "0.5 m".
std::optional<std::string> with_decimal_point(std::string_view text);

/// The error text on such a number; empty: it has no decimal comma.
std::optional<std::string> decimal_comma_mistake(std::string_view text);

class CsvReader {
 public:
  /// `named_at`: where the file is named. A mistake when it is too large or can not be opened; there are no
  /// rows then.
  CsvReader(std::string path, const Place& named_at, Diagnostics& diagnostics);

  CsvReader(const CsvReader&) = delete;
  CsvReader& operator=(const CsvReader&) = delete;

  /// Whether there is a further row, which is then the current one. Each has as many cells as the first one;
  /// another number is a mistake, and so are a quote that does not close and an error while reading. After a
  /// mistake there are no rows.
  bool next();

  /// Of the current row, from 0.
  std::size_t columns() const noexcept { return cells_.size(); }
  std::string_view cell(std::size_t column) const { return cells_[column].text; }
  Place place(std::size_t column) const { return {path_, line_number_, cells_[column].column}; }
  /// Empty with a mistake at its place: an empty cell, or no finite number.
  std::optional<double> number(std::size_t column) const;
  /// Whether each cell of the current row is a finite number, also one with a decimal comma.
  bool has_only_numbers() const;
  /// Adds a mistake at the cell.
  void refuse(std::size_t column, std::string message) const;

  /// The column whose cell is `name`. Empty with a mistake: at `place`, or at the second one of the name.
  std::optional<std::size_t> find_column(const std::string& name, const Place& place) const;

 private:
  struct Cell {
    std::string_view text;
    std::uint32_t column = 1;  ///< in the line, from 1
  };
  /// False with a mistake.
  bool split_cells(std::size_t begin);
  /// The cell that begins at `begin`, which becomes the place of the separator behind it, or the length of
  /// the line. False with a mistake.
  bool take_cell(std::size_t& begin);
  bool take_quoted_cell(std::size_t& begin);
  /// Adds a mistake at a column of the current row, which is the last one. False.
  bool refuse_row(std::string mistake, std::size_t column = 1);

  std::string path_;
  Place named_at_;
  Diagnostics& diagnostics_;
  std::ifstream file_;
  std::string line_;
  std::uint32_t line_number_ = 0;
  char separator_ = 0;  ///< 0: before the first row
  std::vector<Cell> cells_;
  bool has_tab_ = false;  ///< a cell of the current row that is not in quotes has a tab inside
};

}  // namespace hil::config
