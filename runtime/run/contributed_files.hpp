#pragma once
// The files of modules in the folder of a run, and those that modules contribute after the last tick.
//
// Threads: any; writes files and allocates.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <hil/contribution.hpp>

namespace hil::run {

/// The folders of modules in the folder of a run: of .png files, of .pcd files, and of any others.
std::filesystem::path image_folder(const std::filesystem::path& run_folder);
std::filesystem::path point_cloud_folder(const std::filesystem::path& run_folder);
std::filesystem::path other_folder(const std::filesystem::path& run_folder);

/// Why the file could not be written, as a sentence that names it; empty: it is complete.
std::string write_file(const std::filesystem::path& file, std::string_view content);

/// Writes images/<name>.png for each image, and files/<name> for each file; a folder only if it has a file.
/// Returns a sentence for each one that could not be written.
std::vector<std::string> write_files(const contribution::Contribution& contribution,
                                     const std::filesystem::path& run_folder);

}  // namespace hil::run
