#include "runtime/report/html/table.hpp"

#include <utility>

#include "runtime/report/quantities.hpp"

namespace hil::report {

Table::Table(Markup& out, std::vector<Column> columns) : out_(out), columns_(std::move(columns)) {
  out_.open("div", {{"class", "scroll"}}).open("table").open("thead").open("tr");
  for (const Column& column : columns_) {
    out_.element("th", {{"scope", "col"}, {"class", column.numeric ? "n" : ""}}, column.title);
  }
  out_.close().close().open("tbody");
}

std::string Table::label(std::size_t column) const {
  return column < columns_.size() ? columns_[column].title : std::string();
}

void Table::cells(std::span<const Cell> cells) {
  std::size_t index = 0;
  for (const Cell& cell : cells) {
    const bool numeric = index < columns_.size() && columns_[index].numeric;
    out_.element("td",
                 {{"class", std::string(numeric ? "n " : "") + cell.css_class}, {"data-label", label(index)}},
                 cell.text.empty() ? dash : cell.text);
    ++index;
  }
}

Table& Table::row(std::span<const Cell> row_cells) {
  out_.open("tr");
  cells(row_cells);
  out_.close();
  return *this;
}

Table& Table::open_row(std::initializer_list<Cell> row_cells, const char* css_class_of_last) {
  out_.open("tr");
  cells(std::span(row_cells.begin(), row_cells.size()));
  out_.open("td", {{"class", css_class_of_last}, {"data-label", label(columns_.size() - 1)}});
  return *this;
}

Table& Table::close_row() {
  out_.close().close();
  return *this;
}

void Table::end() {
  out_.close().close().close();
}

Cell count_cell(std::uint64_t count, bool should_be_zero) {
  return {count_text(count), should_be_zero && count > 0 ? "tone bad" : ""};
}

}  // namespace hil::report
