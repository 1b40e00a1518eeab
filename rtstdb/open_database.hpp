#pragma once
// Database::open with device options of the caller's choice: for tests, which inject device faults.

#include <memory>

#include <rtstdb/database.hpp>

#include "rtstdb/gpu/device.hpp"

namespace rtstdb {

/// DatabaseOptions override the corresponding members of `device`.
Result<std::unique_ptr<Database>> open_database(const DatabaseOptions& options, gpu::DeviceOptions device);

}  // namespace rtstdb
