#pragma once
// Page-aligned memory for direct I/O (DiskFile::write). Large buffers use huge pages, since direct I/O takes
// time for each page. All pages are touched by the constructor.

#include <cstddef>
#include <memory>
#include <span>

namespace rtstdb::log {

class PageBuffer {
 public:
  explicit PageBuffer(std::size_t bytes);

  /// The requested number of bytes.
  std::span<std::byte> bytes() const noexcept { return {start_.get(), count_}; }

 private:
  struct Delete {
    std::size_t alignment;
    void operator()(std::byte* start) const noexcept;
  };
  std::size_t count_;
  std::unique_ptr<std::byte[], Delete> start_;
};

}  // namespace rtstdb::log
