#include "runtime/signals/csv_profile.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

namespace hil::signals {
namespace {

using config::Place;

struct Cell {
  std::string_view text;
  std::uint32_t column = 1;  ///< in the line, from 1
};

std::string_view trimmed(std::string_view text) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && is_blank(text.front()))
    text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back()))
    text.remove_suffix(1);
  return text;
}

std::vector<Cell> cells_of(std::string_view line) {
  std::vector<Cell> cells;
  std::size_t begin = 0;
  for (;;) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    const std::string_view text = line.substr(begin, end - begin);
    cells.push_back({trimmed(text), static_cast<std::uint32_t>(begin + 1)});
    if (end == line.size()) return cells;
    begin = end + 1;
  }
}

std::optional<double> number_in(std::string_view text) {
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(number)) return std::nullopt;
  return number;
}

/// The index of a column; empty with a mistake.
std::optional<std::size_t> index_of(const std::vector<Cell>& header, const std::string& name,
                                    const Place& place, config::Diagnostics& diagnostics) {
  std::vector<std::string> names;
  for (const Cell& cell : header)
    names.emplace_back(cell.text);
  const auto found = std::ranges::find(names, name);
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  diagnostics.add(place,
                  "the file has no column " + config::in_quotes(name) + config::suggestion(name, names));
  return std::nullopt;
}

/// The index of the only column besides the time; empty with a mistake.
std::optional<std::size_t> only_value(const std::vector<Cell>& header, std::optional<std::size_t> time,
                                      const Place& place, config::Diagnostics& diagnostics) {
  if (!time) return std::nullopt;
  if (header.size() == 2) return 1 - *time;
  diagnostics.add(place, header.size() < 2 ? std::string("the file has no column of values")
                                           : "the file has " + std::to_string(header.size() - 1) +
                                                 " columns of values; 'column' has to name one");
  return std::nullopt;
}

}  // namespace

std::optional<CsvProfile> CsvProfile::read(const std::string& path, const Place& named_at,
                                           const config::Word& column, bool is_linear,
                                           config::Diagnostics& diagnostics) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (!error && bytes > max_csv_bytes) {
    diagnostics.add(named_at, "the file has " + std::to_string(bytes) + " bytes; at most " +
                                  std::to_string(max_csv_bytes) + " are read");
    return std::nullopt;
  }
  std::ifstream file(path, std::ios::binary);
  CsvProfile profile;
  profile.is_linear_ = is_linear;
  std::optional<std::size_t> time, value;
  std::size_t columns = 0;
  std::string line;
  for (std::uint32_t number = 1; std::getline(file, line); ++number) {
    const std::string_view text = trimmed(line);
    if (text.empty() || text.front() == '#') continue;
    const std::vector<Cell> cells = cells_of(line);
    const auto refuse = [&](std::uint32_t at, const std::string& message) {
      diagnostics.add({path, number, at}, message);
      return std::nullopt;
    };
    if (columns == 0) {
      columns = cells.size();
      const bool has_time_s = std::ranges::find(cells, "time_s", &Cell::text) != cells.end();
      time = index_of(cells, has_time_s ? "time_s" : "time", {path, number, 1}, diagnostics);
      value = column.text.empty() ? only_value(cells, time, column.place, diagnostics)
                                  : index_of(cells, column.text, column.place, diagnostics);
      if (!time || !value) return std::nullopt;
      continue;
    }
    if (cells.size() != columns)
      return refuse(
          1, std::to_string(cells.size()) + " cells in a file of " + std::to_string(columns) + " columns");
    for (const std::size_t i : {*time, *value}) {
      if (number_in(cells[i].text)) continue;
      return refuse(cells[i].column, cells[i].text.empty()
                                         ? "an empty cell: a number is missing"
                                         : config::in_quotes(cells[i].text) + " is not a number");
    }
    const double time_s = *number_in(cells[*time].text);
    if (std::abs(time_s) > 1e9) return refuse(cells[*time].column, "a time beyond 1e9 s");
    const auto time_ns = static_cast<std::int64_t>(std::llround(1e9 * time_s));
    if (!profile.times_ns_.empty() && time_ns <= profile.times_ns_.back())
      return refuse(cells[*time].column, "times rise, but this one is not after that of the row before");
    profile.times_ns_.push_back(time_ns);
    profile.values_.push_back(*number_in(cells[*value].text));
  }
  if (file.bad() || profile.times_ns_.empty()) {
    diagnostics.add(named_at, "the file has no rows");
    return std::nullopt;
  }
  return profile;
}

double CsvProfile::at(std::int64_t time_ns) noexcept {
  while (next_ < times_ns_.size() && times_ns_[next_] <= time_ns)
    ++next_;
  if (next_ == 0) return values_.front();
  if (next_ == times_ns_.size() || !is_linear_) return values_[next_ - 1];
  const double share = static_cast<double>(time_ns - times_ns_[next_ - 1]) /
                       static_cast<double>(times_ns_[next_] - times_ns_[next_ - 1]);
  return values_[next_ - 1] + share * (values_[next_] - values_[next_ - 1]);
}

}  // namespace hil::signals
