#pragma once
// The keys of a CAN bus in a scenario.

#include "runtime/config/schema.hpp"

namespace hil::buses::can {

/// Of one entry of the list `can`.
config::Schema can_schema();

}  // namespace hil::buses::can
