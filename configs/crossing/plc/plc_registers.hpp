#pragma once
// The registers of the crossing's PLC, with the access of hil, as configs/crossing/crossing_plc.yaml lists
// them. A test compares the two.

#include "io/modbus/register_map.hpp"

namespace hil::crossing::plc {

namespace modbus = io::modbus;

/// Entries, by table:
///   holding         detector_ego, detector_cross_right, detector_cross_left, heartbeat_hil, override_mode,
///                   bench_time_ms
///   input           light_ego, light_cross, fault, green_remaining, scan_count, plc_time_ms
///   discrete_input  demand_ego, demand_cross
modbus::RegisterMap register_map();

/// Bits of `fault`.
inline constexpr std::uint16_t fault_watchdog = 1;

}  // namespace hil::crossing::plc
