#pragma once
// The records of buses in report.json: a list for each type of bus, under the key that the type has in a
// scenario. Their keys are those of the records; `faults` and `remarks` hold their sentences.

#include <nlohmann/json.hpp>

#include <vector>

#include "runtime/report/json_cursor.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::report {

/// Adds the list of each group to the file.
void add_bus_lists(const std::vector<BusGroup>& groups, nlohmann::ordered_json& file);

/// Reads the list of each group. Throws ReportError with the place.
void read_bus_lists(const JsonCursor& file, std::vector<BusGroup>& groups);

}  // namespace hil::report
