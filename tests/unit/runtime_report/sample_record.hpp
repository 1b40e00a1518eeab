#pragma once

#include <vector>

#include "runtime/buses/can/can_record.hpp"
#include "runtime/buses/modbus/modbus_record.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::report::test {

/// A record of an imaginary run, with something in every part: misses, degradation, a failed expectation,
/// buses, the crossing from above, three scans.
RunRecord full_record();

BusGroup can_group(const std::vector<buses::can::CanRecord>& all);
BusGroup modbus_group(const std::vector<buses::modbus::UnitRecord>& all);

}  // namespace hil::report::test
