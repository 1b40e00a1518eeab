#pragma once
// Host memory that a device can access in place (BufferOptions::host). It outlives the device: spans that
// callers hold into it stay valid when the device is lost and another one replaces it.

#include <cstddef>
#include <memory>
#include <new>
#include <span>

namespace rtstdb::gpu {

class HostMemory {
 public:
  /// Alignment and granularity at which devices import host memory; a device that needs more works on a copy.
  static constexpr std::size_t page_bytes = 4096;

  HostMemory() = default;
  /// Allocates whole pages with undefined contents. Throws std::bad_alloc.
  explicit HostMemory(std::size_t size_bytes);

  std::size_t size_bytes() const noexcept { return size_bytes_; }
  template <class T>
  std::span<T> as() const noexcept {
    return {reinterpret_cast<T*>(start_.get()), size_bytes_ / sizeof(T)};
  }
  /// The allocated bytes up to the end of the last page.
  std::span<std::byte> pages() const noexcept;

 private:
  struct Delete {
    void operator()(std::byte* start) const noexcept {
      ::operator delete (start, std::align_val_t{page_bytes});
    }
  };
  std::unique_ptr<std::byte, Delete> start_;
  std::size_t size_bytes_ = 0;
};

}  // namespace rtstdb::gpu
