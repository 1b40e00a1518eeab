#pragma once
// PNG files (libpng).
//
// Threads: any; writes files and allocates.

#include <filesystem>
#include <string>

#include <hil/png_image.hpp>

namespace hil::run {

using modules::PngImage;

/// Why the file could not be written, as a sentence that names it; empty: it is complete.
std::string write_png(const PngImage& image, const std::filesystem::path& file);

/// The bytes of such a file. Throws std::bad_alloc.
std::string png_bytes(const PngImage& image);

}  // namespace hil::run
