#pragma once
// Bytes in whole pages of their own, which a disk takes from where they lie (see DiskFile::write); many of them in large pages, since
// each page is a thing to do for whoever brings it to the disk. All of them are touched.

#include <cstddef>
#include <memory>
#include <span>

namespace rtstdb::log {

class WholePages {
 public:
  explicit WholePages(std::size_t bytes);

  /// As many as were asked for.
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
