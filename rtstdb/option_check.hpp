#pragma once
// Checks of DatabaseOptions, DurabilityOptions and GeometryOptions.

#include <rtstdb/database.hpp>

namespace rtstdb {

/// Errors: the first option outside its limits, with its name, its value and the limits.
Result<void> check_options(const DatabaseOptions& options);
Result<void> check_options(const DurabilityOptions& options);
Result<void> check_options(const GeometryOptions& options);

}  // namespace rtstdb
