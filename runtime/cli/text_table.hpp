#pragma once
// A table for the console. Each column is as wide as its longest cell; numbers are aligned to the right.

#include <string>
#include <vector>

namespace hil::cli {

class TextTable {
 public:
  struct Column {
    std::string title;
    bool right = false;
  };
  explicit TextTable(std::vector<Column> columns);

  /// As many cells as there are columns.
  void add(std::vector<std::string> cells);
  bool empty() const noexcept { return rows_.empty(); }
  /// The titles, then one line per row, without trailing blanks.
  std::string text() const;

 private:
  std::vector<Column> columns_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace hil::cli
