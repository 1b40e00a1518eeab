#pragma once
// Database::open with device options and a time of polling of the caller's choice: for tests, which inject
// device faults, and benchmarks, which measure what polling gains.

#include <memory>

#include <rtstdb/database.hpp>

#include "rtstdb/gpu/device.hpp"
#include "rtstdb/transaction/spin.hpp"

namespace rtstdb {

/// DatabaseOptions override the corresponding members of `device`. `spin`: how long a waiting thread polls
/// before it sleeps; zero: it never polls.
Result<std::unique_ptr<Database>> open_database(const DatabaseOptions& options, gpu::DeviceOptions device,
                                                Nanoseconds spin = transaction::default_spin);

}  // namespace rtstdb
