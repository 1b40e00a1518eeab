#pragma once
// Reads PNG files with libpng's stream interface, which the program does not use.

#include <cstdint>
#include <filesystem>
#include <vector>

namespace hil::tests {

struct PngContent {
  std::uint32_t width = 0, height = 0;  ///< 0: the file can not be read
  int bits = 0;                         ///< of a sample
  int channels = 0;
  std::vector<std::uint16_t> samples{};  ///< row by row from the top left
};

PngContent read_png(const std::filesystem::path& file);

}  // namespace hil::tests
