#pragma once
// A read-only database that holds a range of versions of a log (rtstdb/history.hpp).

#include <memory>

#include <rtstdb/database.hpp>

#include "rtstdb/log/version_range.hpp"

namespace rtstdb {

/// The options must have room for the range.
Result<std::unique_ptr<Database>> open_history_range(const DatabaseOptions& options, log::VersionRange range);

}  // namespace rtstdb
