#pragma once
// What went wrong on a CAN bus or with a Modbus unit, in words: one sentence per counter that is not zero.

#include <string>
#include <vector>

#include "runtime/report/run_record.hpp"

namespace hil::report {

/// What the run itself did not send, or not log, as it was told to. They belong on the console too.
std::vector<std::string> can_shortfalls(const CanBus& bus);

/// What else its counters tell beyond the columns of the page's table, injected faults among it.
std::vector<std::string> can_remarks(const CanBus& bus);

/// What its counters tell beyond requests and replies, for the page and the terminal.
std::vector<std::string> unit_shortfalls(const ModbusUnit& unit);

}  // namespace hil::report
