#pragma once
// Tables of the page: a scrolling frame, a head, rows of cells. On a phone a row is a list of cells, each
// beside its column's title.

#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include "runtime/report/markup.hpp"

namespace hil::report {

struct Column {
  std::string title;
  bool numeric = false;
};

struct Cell {
  std::string text;
  const char* css_class = "";

  Cell(std::string content, const char* css = "") : text(std::move(content)), css_class(css) {}
  Cell(const char* content, const char* css = "") : text(content), css_class(css) {}
};

class Table {
 public:
  /// Opens the table. `end` closes it.
  Table(Markup& out, std::vector<Column> columns);
  /// One cell per column; an empty one shows a dash.
  Table& row(std::initializer_list<Cell> cells) { return row(std::span(cells.begin(), cells.size())); }
  Table& row(std::span<const Cell> cells);
  /// A row whose last column the caller fills with markup between this and close_row.
  Table& open_row(std::initializer_list<Cell> cells, const char* css_class_of_last);
  Table& close_row();
  void end();

 private:
  /// The column's title, shown beside each cell where the page is too narrow for columns.
  std::string label(std::size_t column) const;
  void cells(std::span<const Cell> cells);
  Markup& out_;
  std::vector<Column> columns_;
};

/// "n" for numbers, plus a tone when the count should be zero and is not.
Cell count_cell(std::uint64_t count, bool should_be_zero);

}  // namespace hil::report
