#pragma once
// A run that never was, with something in every part of the record.

#include <cstdint>
#include <vector>

#include "runtime/buses/can/can_record.hpp"
#include "runtime/buses/modbus/unit_record.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::report::test {

/// Everything filled in: misses, degradation, a failed expectation, two buses, the crossing from above, three
/// scans.
RunRecord full_record();

BusGroup can_group(const std::vector<buses::can::CanFacts>& all);
BusGroup modbus_group(const std::vector<buses::modbus::UnitFacts>& all);

/// `count` samples around `middle_ns` with a long tail, as a histogram with bins an eighth of an octave wide.
Histogram tailed_histogram(std::int64_t middle_ns, std::uint64_t count, std::uint32_t seed);

}  // namespace hil::report::test
