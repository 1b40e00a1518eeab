#include "runtime/config/test_table_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "runtime/config/csv_reader.hpp"
#include "runtime/config/scenario.hpp"

namespace hil::config {
namespace {

enum Column : std::uint8_t {
  time_column,
  signal_column,
  value,
  fault,
  expectation,
  tolerance,
  comment,
  columns
};
constexpr std::array<const char*, columns> column_names{"time",        "signal",    "value",  "fault",
                                                        "expectation", "tolerance", "comment"};
/// Names in tables of other tools.
constexpr std::array<std::pair<std::string_view, Column>, 2> other_column_names{
    {{"timestamp", time_column}, {"channel", signal_column}}};

class TestTableReader {
 public:
  TestTableReader(const Value& path, const ScenarioTypes& types, Diagnostics& diagnostics)
      : path_(path),
        types_(types),
        diagnostics_(diagnostics),
        file_(path.text(), path.place(), diagnostics) {}

  std::optional<std::vector<TestTableRow>> read() {
    const std::size_t before = diagnostics_.count();
    if (file_.next() && find_columns()) {
      while (!diagnostics_.full() && file_.next()) {
        if (rows_.size() == max_test_table_rows) {
          file_.refuse(0, "the file has more rows than the limit of " + std::to_string(max_test_table_rows) +
                              "; split it");
          break;
        }
        read_row();
      }
    }
    if (diagnostics_.count() == before && rows_.empty())
      diagnostics_.add(path_.place(), "the file has no rows");
    if (diagnostics_.count() != before) return std::nullopt;
    return std::move(rows_);
  }

 private:
  bool find_columns() {
    const std::size_t before = diagnostics_.count();
    for (std::size_t i = 0; i < file_.columns(); ++i) {
      const auto other =
          std::ranges::find(other_column_names, file_.cell(i), &std::pair<std::string_view, Column>::first);
      const std::string name(other != other_column_names.end() ? column_names[other->second] : file_.cell(i));
      const auto found = std::ranges::find(column_names, name);
      if (found == column_names.end()) {
        file_.refuse(i, "a test table has no column " + in_quotes(name) +
                            all_known(name, {column_names.begin(), column_names.end()}));
        continue;
      }
      std::optional<std::size_t>& place = places_[static_cast<std::size_t>(found - column_names.begin())];
      if (place) file_.refuse(i, "there are two columns " + in_quotes(name));
      place = i;
    }
    for (const Column needed : {time_column, signal_column}) {
      if (!places_[needed] && diagnostics_.count() == before)
        file_.refuse(0, std::string("a test table needs a column '") + column_names[needed] + "'");
    }
    return diagnostics_.count() == before;
  }

  /// Of the current row; an empty text where there is no such column.
  Word cell(Column column) const {
    if (!places_[column]) return {"", file_.place(0)};
    const std::size_t i = *places_[column];
    return {std::string(file_.cell(i)), file_.place(i)};
  }
  std::optional<Expression> expression_in(Column column) {
    const Word text = cell(column);
    return text.text.empty() || has_decimal_comma(text) ? std::nullopt
                                                        : Expression::parse(text, diagnostics_);
  }
  /// Then with a mistake.
  bool has_decimal_comma(const Word& text) {
    const auto mistake = decimal_comma_mistake(text.text);
    if (mistake) diagnostics_.add(text.place, *mistake);
    return mistake.has_value();
  }

  void read_row() {
    TestTableRow row{.line = file_.place(0).line, .signal = cell(signal_column)};
    const std::size_t before = diagnostics_.count();
    read_time(row);
    if (row.signal.text.empty()) diagnostics_.add(row.signal.place, "an empty cell: a signal is missing");
    row.value = expression_in(value);
    read_fault(row);
    row.expectation = expression_in(expectation);
    row.tolerance = expression_in(tolerance);
    if (diagnostics_.count() != before) return;
    if (row.tolerance && !row.expectation)
      diagnostics_.add(cell(tolerance).place, "a tolerance without an expectation");
    if (!row.value && !row.fault && !row.fault_ends && !row.expectation)
      file_.refuse(0, "the row has neither a value nor a fault nor an expectation");
    if (diagnostics_.count() == before) rows_.push_back(std::move(row));
  }

  void read_time(TestTableRow& row) {
    const std::size_t column = *places_[time_column];
    const auto time_s = file_.number(column);
    if (!time_s) return;
    if (*time_s < 0.0 || *time_s > 1e9) return file_.refuse(column, "a time is from 0 s to 1e9 s");
    row.time_ns = std::llround(1e9 * *time_s);
    if (row.time_ns < last_ns_) file_.refuse(column, "a time before that of the row before");
    last_ns_ = row.time_ns;
  }

  void read_fault(TestTableRow& row) {
    const Word text = cell(fault);
    if (text.text.empty()) return;
    const std::size_t end = std::min(text.text.find_first_of(" \t"), text.text.size());
    const std::string name = text.text.substr(0, end);
    const std::size_t begin = std::min(text.text.find_first_not_of(" \t", end), text.text.size());
    const Word argument{
        text.text.substr(begin),
        {text.place.file, text.place.line, text.place.column + static_cast<std::uint32_t>(begin)}};
    if (name == "none" || name == "release") {
      if (!argument.text.empty()) diagnostics_.add(argument.place, in_quotes(name) + " has no value");
      row.fault_ends = text.place;
      return;
    }
    std::vector<std::string> names{"none", "release"};
    for (const FaultKind& kind : types_.faults) {
      if (kind.read_cell == nullptr) continue;
      if (kind.key == name) {
        row.fault =
            FaultSection{.name = {}, .place = text.place, .effect = read_effect(kind, text, argument)};
        return;
      }
      names.push_back(kind.key);
    }
    diagnostics_.add(text.place, in_quotes(name) + " is no state of a fault" + all_known(name, names));
  }

  std::shared_ptr<const FaultEffect> read_effect(const FaultKind& kind, const Word& cell,
                                                 const Word& argument) {
    if (has_decimal_comma(argument)) return nullptr;
    if (!argument.text.empty() || kind.cell_example.empty()) return kind.read_cell(argument, diagnostics_);
    diagnostics_.add(cell.place,
                     in_quotes(kind.key) + " needs its value, as " + in_quotes(kind.cell_example));
    return nullptr;
  }

  const Value& path_;
  const ScenarioTypes& types_;
  Diagnostics& diagnostics_;
  CsvReader file_;
  std::array<std::optional<std::size_t>, columns> places_;
  std::int64_t last_ns_ = 0;
  std::vector<TestTableRow> rows_;
};

}  // namespace

Schema test_tables_schema() {
  return Schema::list(Schema::record({
      Field::needed("name", Schema::name(),
                    "The prefix of the names of its stimuli, faults and expectations."),
      Field::needed(
          "file", Schema::file(),
          "A CSV file with the columns time (or timestamp; in seconds), signal (or channel), value, "
          "fault, expectation, tolerance and comment."),
  }));
}

std::optional<std::vector<TestTableRow>> read_test_table(const Value& path, const ScenarioTypes& types,
                                                         Diagnostics& diagnostics) {
  return TestTableReader(path, types, diagnostics).read();
}

}  // namespace hil::config
