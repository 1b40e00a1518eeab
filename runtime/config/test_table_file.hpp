#pragma once
// A test table: a CSV file with a row for each change, in the order of time.
//
//   time,signal,value,fault,expectation,tolerance
//   0,tank.inflow,2 l/s,,,
//   3,tank.level,,stuck,,
//   3.5,control.valve,,,1,0
//   5,tank.level,,none,,
//
// The first row names the columns. `time` is the run time in seconds; `signal` names a signal; both are
// needed. `value` drives the signal from then on. `fault` is the state of its fault from then on: "none" ends
// it; a kind of fault of a signal with its value begins it: "stuck" (at the last value), "offset 2 cm",
// "delay 50 ms" (FaultKind::read_cell). `expectation` is what the signal has to be at this instant, within
// `tolerance`. An empty cell changes nothing. `comment` is not read. As in tables of other tools, `time` may
// be called `timestamp`, `signal` `channel`, and "none" "release".
//
// Threads: the one that reads the scenario.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>

#include "runtime/config/expression.hpp"
#include "runtime/config/fault_section.hpp"

namespace hil::config {

inline constexpr std::size_t max_test_table_rows = 10'000;
/// All of them are updated in each tick.
inline constexpr std::size_t max_test_table_faults = 1000;

/// A row. Expressions that are empty were empty cells.
struct TestTableRow {
  std::uint32_t line = 0;
  std::int64_t time_ns = 0;
  Word signal;
  std::optional<Expression> value{};
  std::optional<FaultSection> fault{};  ///< only its effect and the place of that
  std::optional<Place> fault_ends{};    ///< of "none"
  std::optional<Expression> expectation{}, tolerance{};
};

/// Empty with mistakes, all of them, at their places.
std::optional<std::vector<TestTableRow>> read_test_table(const Value& path, const ScenarioTypes& types,
                                                         Diagnostics& diagnostics);

Schema test_tables_schema();

}  // namespace hil::config
