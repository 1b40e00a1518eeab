#pragma once
// The Disk of a directory in a POSIX file system.

#include <filesystem>

#include "rtstdb/log/disk.hpp"

namespace rtstdb::log {

/// Creates the directory if it does not exist; its parent must exist. The Disk must outlive its files and its
/// lock.
DiskResult<std::unique_ptr<Disk>> open_directory(const std::filesystem::path& directory);
/// For reading: the directory must exist.
DiskResult<std::unique_ptr<Disk>> open_existing_directory(const std::filesystem::path& directory);

/// A random id for a new log, not zero.
std::uint64_t new_database_id();

}  // namespace rtstdb::log
