#pragma once
// Real meshes from public collections, which are no part of the project: a test that wants them exists only
// where they are found, in the folder that HIL_TEST_DATA names or in shared/data beside the checkout.

#include <cstdlib>
#include <filesystem>
#include <vector>

#include "tests/paths.h"

namespace hil::test {

/// One folder, or none: values for INSTANTIATE_TEST_SUITE_P.
inline std::vector<std::filesystem::path> real_mesh_folders() {
  const char* named = std::getenv("HIL_TEST_DATA");
  const std::filesystem::path data = named != nullptr
                                         ? std::filesystem::path(named)
                                         : std::filesystem::path(HIL_SOURCE_DIR) / ".." / "shared/data";
  if (!std::filesystem::is_directory(data / "meshes")) return {};
  return {data / "meshes"};
}

}  // namespace hil::test
