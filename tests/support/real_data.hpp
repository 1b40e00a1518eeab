#pragma once
// Meshes from public collections, which are not part of the project: in the folder that HIL_TEST_DATA names,
// or in shared/data beside the checkout. Tests of them exist only where the folder does.

#include <cstdlib>
#include <filesystem>
#include <vector>

#include "tests/paths.h"

namespace hil::tests {

/// One folder or none, for INSTANTIATE_TEST_SUITE_P.
inline std::vector<std::filesystem::path> real_mesh_folders() {
  const char* named = std::getenv("HIL_TEST_DATA");
  const std::filesystem::path data = named != nullptr
                                         ? std::filesystem::path(named)
                                         : std::filesystem::path(HIL_SOURCE_DIR) / ".." / "shared/data";
  if (!std::filesystem::is_directory(data / "meshes")) return {};
  return {data / "meshes"};
}

}  // namespace hil::tests
