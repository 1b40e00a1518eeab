#pragma once
// The laser scanner of a run that is over.

#include <memory>

#include <hil/world/recorded_scanner.hpp>

#include "runtime/contribution/world_record.hpp"

namespace hil::modules {

/// From the record that the module made of itself. Throws RecordError.
std::unique_ptr<RecordedScanner> recorded_laser_scanner(const contribution::ModuleRecord& record);

}  // namespace hil::modules
