#pragma once
// The options of a distance field as world.json records it.

#include <rtstdb/field.hpp>

#include "runtime/contribution/world_record.hpp"

namespace hil::modules {

/// An unknown sign is automatic.
rtstdb::FieldOptions field_options_of(const contribution::FieldRecord& record);

}  // namespace hil::modules
