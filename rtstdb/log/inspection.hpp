#pragma once
// Inspects and verifies the directory of a log; rtstdb/log.hpp describes the result. Nothing in the directory
// is changed.

#include <rtstdb/log.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/log/disk.hpp"

namespace rtstdb::log {

/// Errors: file for a directory without a log, and for one that cannot be listed.
Result<LogContents> inspect(Disk& disk);

}  // namespace rtstdb::log
