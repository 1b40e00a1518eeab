#pragma once
// Errors about the directory of a log.

#include <filesystem>

#include <rtstdb/result.hpp>

namespace rtstdb {

/// "DIRECTORY: MESSAGE".
inline Error with_directory(const std::filesystem::path& directory, const Error& error) {
  return {error.code, directory.string() + ": " + error.message};
}

}  // namespace rtstdb
