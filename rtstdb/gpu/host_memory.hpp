#pragma once
// Memory of the host that a device reads and writes where it lies (BufferOptions::host), and that outlives the device:
// what callers hold spans of stays where it is when the device is lost and another one takes its place.

#include <cstddef>
#include <memory>
#include <new>
#include <span>

namespace rtstdb::gpu {

class HostMemory {
 public:
  /// Devices take memory in by pages of this size, or copy.
  static constexpr std::size_t page_bytes = 4096;

  HostMemory() = default;
  /// The bytes are not cleared. Throws std::bad_alloc.
  explicit HostMemory(std::size_t size_bytes);

  std::size_t size_bytes() const noexcept { return size_bytes_; }
  template <class T>
  std::span<T> as() const noexcept {
    return {reinterpret_cast<T*>(start_.get()), size_bytes_ / sizeof(T)};
  }
  /// With what follows up to the end of the last page.
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
