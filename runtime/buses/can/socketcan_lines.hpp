#pragma once
// What this machine offers for CAN buses of the kernel.

#include <vector>

#include "runtime/buses/bus.hpp"

namespace hil::buses::can {

/// For `hil doctor`: whether the kernel has SocketCAN, and the CAN interfaces.
std::vector<DoctorLine> socketcan_lines();

}  // namespace hil::buses::can
