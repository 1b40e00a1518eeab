#pragma once
// The peer of the log: a file to which pieces are appended in the simplest way.

#include <cstdint>
#include <filesystem>
#include <span>

namespace hil::bench {

/// pwrite through the page cache, and fdatasync. Throws std::system_error on failure.
class PlainFile {
 public:
  static constexpr const char* name = "pwrite + fdatasync";

  /// Creates the file with this many bytes preallocated, as the log does.
  PlainFile(const std::filesystem::path& path, std::uint64_t bytes);
  ~PlainFile();
  PlainFile(const PlainFile&) = delete;
  PlainFile& operator=(const PlainFile&) = delete;

  /// The data is on disk when this returns.
  void append(std::span<const std::byte> bytes);

 private:
  int descriptor_;
  std::uint64_t offset_ = 0;
};

}  // namespace hil::bench
