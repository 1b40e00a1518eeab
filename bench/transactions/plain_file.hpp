#pragma once
// The peer of the log: a file written one piece behind the other, as plainly as can be.

#include <cstdint>
#include <filesystem>
#include <span>

namespace hil::bench {

/// pwrite, through the page cache, and fdatasync. Throws std::system_error when the disk refuses.
class PlainFile {
 public:
  static constexpr const char* name = "pwrite + fdatasync";

  /// A new one, with room for so many bytes allocated ahead, as the log does it.
  PlainFile(const std::filesystem::path& path, std::uint64_t bytes);
  ~PlainFile();
  PlainFile(const PlainFile&) = delete;
  PlainFile& operator=(const PlainFile&) = delete;

  /// On disk when it returns.
  void append(std::span<const std::byte> bytes);

 private:
  int descriptor_;
  std::uint64_t offset_ = 0;
};

}  // namespace hil::bench
