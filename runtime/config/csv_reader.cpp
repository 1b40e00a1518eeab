#include "runtime/config/csv_reader.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <system_error>
#include <utility>

#include "runtime/config/trimmed.hpp"

namespace hil::config {
namespace {

constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";

std::optional<double> finite_number(std::string_view text) {
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool is_whole = error == std::errc() && end == text.data() + text.size();
  return is_whole && std::isfinite(number) ? std::optional(number) : std::nullopt;
}

}  // namespace

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

bool CsvReader::split_cells() {
  cells_.clear();
  const std::string_view line = line_;
  std::size_t begin = line_number_ == 1 && line.starts_with(byte_order_mark) ? byte_order_mark.size() : 0;
  while (cells_.size() < max_csv_columns) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    const std::string_view text = trimmed(line.substr(begin, end - begin));
    const std::size_t first = text.empty() ? begin : static_cast<std::size_t>(text.data() - line.data());
    cells_.push_back({text, static_cast<std::uint32_t>(first + 1)});
    if (end == line.size()) return true;
    begin = end + 1;
  }
  return false;
}

bool CsvReader::next() {
  const std::size_t columns = cells_.size();
  while (std::getline(file_, line_)) {
    ++line_number_;
    const bool is_whole = split_cells();
    if (cells_.size() == 1 && cells_[0].text.empty()) continue;
    if (cells_[0].text.starts_with('#')) continue;
    if (!is_whole)
      return refuse_row("the row has more cells than the limit of " + std::to_string(max_csv_columns) +
                        "; split the file");
    if (columns == 0 || cells_.size() == columns) return true;
    return refuse_row(std::to_string(cells_.size()) + " cells in a file of " + std::to_string(columns) +
                      " columns");
  }
  if (file_.bad())
    diagnostics_.add(named_at_, "the file can not be read after its line " + std::to_string(line_number_));
  file_.close();
  return false;
}

bool CsvReader::refuse_row(std::string mistake) {
  diagnostics_.add({path_, line_number_, 1}, std::move(mistake));
  file_.close();
  return false;
}

std::optional<double> CsvReader::number(std::size_t column) const {
  const std::string_view text = cell(column);
  if (const auto number = finite_number(text)) return number;
  refuse(column, text.empty() ? "an empty cell: a number is missing" : in_quotes(text) + " is not a number");
  return std::nullopt;
}

bool CsvReader::has_only_numbers() const {
  return std::ranges::all_of(cells_, [](const Cell& cell) { return finite_number(cell.text).has_value(); });
}

void CsvReader::refuse(std::size_t column, std::string message) const {
  diagnostics_.add(place(column), std::move(message));
}

std::optional<std::size_t> CsvReader::find_column(const std::string& name, const Place& place) const {
  std::vector<std::string> names;
  for (const Cell& cell : cells_)
    names.emplace_back(cell.text);
  const auto found = std::ranges::find(names, name);
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  diagnostics_.add(place, "the file has no column " + in_quotes(name) + suggestion(name, names));
  return std::nullopt;
}

}  // namespace hil::config
