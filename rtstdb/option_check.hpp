#pragma once
// What DatabaseOptions, DurabilityOptions and GeometryOptions permit.

#include <rtstdb/database.hpp>

namespace rtstdb {

/// Refuses options outside their limits: an Error with the option's name, its value and its limits.
Result<void> check_options(const DatabaseOptions& options);
Result<void> check_options(const DurabilityOptions& options);
Result<void> check_options(const GeometryOptions& options);

}  // namespace rtstdb
