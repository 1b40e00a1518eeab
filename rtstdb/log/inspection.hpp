#pragma once
// Everything in a log's directory, looked at: rtstdb/log.hpp says what is told. It changes nothing in the directory.

#include <rtstdb/log.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/log/disk.hpp"

namespace rtstdb::log {

/// Errors: file for a directory without a database's log, and one that can not be listed.
Result<LogContents> inspect(Disk& disk);

}  // namespace rtstdb::log
