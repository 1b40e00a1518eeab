#pragma once
// The images of modules, as PNG files in the folder of a run.
//
// Threads: any; writes files and allocates.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "runtime/contribution/contribution.hpp"

namespace hil::run {

/// The folder of the images in the folder of a run.
std::filesystem::path image_folder(const std::filesystem::path& run_folder);

/// Writes <folder>/<name>.png for each image. Makes the folder if there is an image. Returns a sentence for
/// each one that could not be written.
std::vector<std::string> write_images(std::span<const contribution::Image> images,
                                      const std::filesystem::path& folder);

/// Depths as samples of a grey image, in units of `step_m`: 0 for an infinite depth, 65535 for this depth or
/// more.
std::vector<std::uint16_t> depth_samples(std::span<const float> depth_m, double step_m);

}  // namespace hil::run
