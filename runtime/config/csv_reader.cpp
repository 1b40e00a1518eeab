#include "runtime/config/csv_reader.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <system_error>
#include <utility>

#include "runtime/contract/trimmed.hpp"

namespace hil::config {
namespace {

constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
constexpr std::string_view separator_key = "sep=";

constexpr const char* separated_by_tabs =
    "the cells are separated by tabs; separate them by ',' or ';' (a tab inside a cell needs quotes)";

std::optional<double> finite_number(std::string_view text) {
  double number = 0.0;
  // from_chars takes no plus. A sign behind it is no number.
  if (text.starts_with('+') && !text.substr(1).starts_with('-')) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool is_whole = error == std::errc() && end == text.data() + text.size();
  return is_whole && std::isfinite(number) ? std::optional(number) : std::nullopt;
}

/// The one that comes first in a row, outside of quotes; 0: there is none.
char separator_of(std::string_view row) {
  bool is_quoted = false;
  for (const char letter : row) {
    if (letter == '"') is_quoted = !is_quoted;
    if (!is_quoted && (letter == ',' || letter == ';')) return letter;
  }
  return 0;
}

}  // namespace

std::optional<std::string> with_decimal_point(std::string_view text) {
  constexpr std::string_view digits = "0123456789";
  const std::size_t begin = text.starts_with('-') || text.starts_with('+') ? 1 : 0;
  const std::size_t comma = std::min(text.find_first_not_of(digits, begin), text.size());
  if (comma == begin || comma == text.size() || text[comma] != ',') return std::nullopt;
  const std::size_t end = std::min(text.find_first_not_of(digits, comma + 1), text.size());
  if (end == comma + 1 || (end < text.size() && (text[end] == ',' || text[end] == '.'))) return std::nullopt;
  std::string changed(text);
  changed[comma] = '.';
  return text.starts_with('+') ? changed.substr(1) : changed;
}

std::optional<std::string> decimal_comma_mistake(std::string_view text) {
  const auto with_point = with_decimal_point(text);
  if (!with_point) return std::nullopt;
  return in_quotes(std::string(text)) + " has a decimal comma; write " + *with_point;
}

CsvReader::CsvReader(std::string path, const Place& named_at, Diagnostics& diagnostics)
    : path_(std::move(path)), named_at_(named_at), diagnostics_(diagnostics) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path_, error);
  if (!error && bytes > max_csv_bytes) {
    diagnostics.add(named_at, "the file has " + std::to_string(bytes) + " bytes, more than the limit of " +
                                  std::to_string(max_csv_bytes) + "; split it");
    return;
  }
  file_.open(path_, std::ios::binary);
  if (!file_.is_open()) diagnostics.add(named_at, "the file " + in_quotes(path_) + " can not be opened");
}

bool CsvReader::split_cells(std::size_t begin) {
  cells_.clear();
  has_tab_ = false;
  while (cells_.size() < max_csv_columns) {
    if (!take_cell(begin)) return false;
    if (begin == line_.size()) return true;
    ++begin;
  }
  return refuse_row("the row has more cells than the limit of " + std::to_string(max_csv_columns) +
                    "; split the file");
}

bool CsvReader::take_cell(std::size_t& begin) {
  const std::string_view line = line_;
  const std::size_t end = std::min(line.find(separator_, begin), line.size());
  const std::string_view text = trimmed(line.substr(begin, end - begin));
  const std::size_t first = text.empty() ? begin : static_cast<std::size_t>(text.data() - line.data());
  begin = first;
  if (text.starts_with('"')) return take_quoted_cell(begin);
  has_tab_ |= text.find('\t') != std::string_view::npos;
  cells_.push_back({text, static_cast<std::uint32_t>(first + 1)});
  begin = end;
  return true;
}

bool CsvReader::take_quoted_cell(std::size_t& begin) {
  const std::size_t first = begin + 1;
  std::size_t length = 0;  // of the text, whose doubled quotes become single ones in place
  std::size_t next = first;
  for (;; ++next) {
    if (next == line_.size())
      return refuse_row("the quote of this cell does not close in its line; close it there", begin + 1);
    if (line_[next] == '"') {
      if (next + 1 == line_.size() || line_[next + 1] != '"') break;
      ++next;
    }
    line_[first + length++] = line_[next];
  }
  const std::size_t end = std::min(line_.find(separator_, ++next), line_.size());
  const std::string_view rest = std::string_view(line_).substr(next, end - next);
  if (!trimmed(rest).empty() && rest.find('\t') != std::string_view::npos)
    return refuse_row(separated_by_tabs, next + 1);
  if (!trimmed(rest).empty())
    return refuse_row("text follows the closing quote; write a quote inside a cell twice", next + 1);
  cells_.push_back({std::string_view(line_).substr(first, length), static_cast<std::uint32_t>(first + 1)});
  begin = end;
  return true;
}

bool CsvReader::next() {
  const std::size_t columns = cells_.size();
  while (std::getline(file_, line_)) {
    ++line_number_;
    const std::size_t begin =
        line_number_ == 1 && line_.starts_with(byte_order_mark) ? byte_order_mark.size() : 0;
    const std::string_view text = trimmed(std::string_view(line_).substr(begin));
    if (text.empty() || text.starts_with('#')) continue;
    if (line_number_ == 1 && text.starts_with(separator_key)) {
      const std::string_view separator = text.substr(separator_key.size());
      if (separator.empty() && line_.find('\t') != std::string::npos) return refuse_row(separated_by_tabs);
      if (separator != "," && separator != ";")
        return refuse_row("cells are separated by ',' or ';', not by " + in_quotes(separator));
      separator_ = separator.front();
      continue;
    }
    const char first_separator = separator_of(text);
    if (separator_ == 0) separator_ = first_separator == 0 ? ',' : first_separator;
    if (!split_cells(begin)) return false;
    const bool has_all_cells = columns == 0 || cells_.size() == columns;
    if (has_tab_ && (columns == 0 || !has_all_cells)) return refuse_row(separated_by_tabs);
    if (has_all_cells) return true;
    const bool has_other_separator = cells_.size() == 1 && first_separator != 0;
    return refuse_row("the row has " + std::to_string(cells_.size()) +
                      (cells_.size() == 1 ? " cell" : " cells") + " and the file " + std::to_string(columns) +
                      (columns == 1 ? " column" : " columns") +
                      (has_other_separator ? std::string("; the separator of the header is '") + separator_ +
                                                 "', and this row has '" + first_separator + "'"
                       : cells_.size() < columns ? "; give each column a cell"
                       : separator_ == ',' ? "; put a cell with a comma in quotes, and write 0.5, not 0,5"
                                           : "; put a cell with a semicolon in quotes"));
  }
  if (file_.bad())
    diagnostics_.add(named_at_, "the file can not be read after its line " + std::to_string(line_number_));
  file_.close();
  return false;
}

bool CsvReader::refuse_row(std::string mistake, std::size_t column) {
  diagnostics_.add({path_, line_number_, static_cast<std::uint32_t>(column)}, std::move(mistake));
  file_.close();
  return false;
}

std::optional<double> CsvReader::number(std::size_t column) const {
  const std::string_view text = cell(column);
  if (const auto number = finite_number(text)) return number;
  refuse(column, text.empty() ? "an empty cell: a number is missing"
                              : decimal_comma_mistake(text).value_or(in_quotes(text) + " is not a number"));
  return std::nullopt;
}

bool CsvReader::has_only_numbers() const {
  return std::ranges::all_of(cells_, [](const Cell& cell) {
    return finite_number(cell.text) || finite_number(with_decimal_point(cell.text).value_or(""));
  });
}

void CsvReader::refuse(std::size_t column, std::string message) const {
  diagnostics_.add(place(column), std::move(message));
}

std::optional<std::size_t> CsvReader::find_column(const std::string& name, const Place& place) const {
  std::vector<std::string> names;
  for (const Cell& cell : cells_)
    names.emplace_back(cell.text);
  const auto found = std::ranges::find(names, name);
  if (found != names.end()) {
    const auto second = std::find(found + 1, names.end(), name);
    if (second == names.end()) return static_cast<std::size_t>(found - names.begin());
    refuse(static_cast<std::size_t>(second - names.begin()), "there are two columns " + in_quotes(name));
    return std::nullopt;
  }
  diagnostics_.add(place, "the file has no column " + in_quotes(name) + suggestion(name, names));
  return std::nullopt;
}

}  // namespace hil::config
