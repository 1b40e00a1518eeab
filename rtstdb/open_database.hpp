#pragma once
// Database::open on a device of the caller's making: for tests, which have it fail.

#include <memory>

#include <rtstdb/database.hpp>

#include "rtstdb/gpu/device.hpp"

namespace rtstdb {

/// What DatabaseOptions say goes before what `device` does.
Result<std::unique_ptr<Database>> open_database(const DatabaseOptions& options, gpu::DeviceOptions device);

}  // namespace rtstdb
