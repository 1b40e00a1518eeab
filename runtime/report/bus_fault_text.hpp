#pragma once
// Sentences on the faults of a CAN bus or a Modbus unit: one for each counter that is not zero.

#include <string>
#include <vector>

#include "runtime/report/run_record.hpp"

namespace hil::report {

/// Output values and frames that were changed, not sent or not logged. Shown on the console, too.
std::vector<std::string> can_shortfalls(const CanBus& bus);

/// Further counters that have no column in the table of the page, injected faults included.
std::vector<std::string> can_remarks(const CanBus& bus);

/// Counters other than requests and replies, for the page and the console.
std::vector<std::string> unit_shortfalls(const ModbusUnit& unit);

}  // namespace hil::report
