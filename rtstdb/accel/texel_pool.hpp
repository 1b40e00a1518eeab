#pragma once
// A buffer on the device to which parts of texels (16 bytes each) are appended. When it grows, it becomes
// another buffer.
//
// Threads: one; setup.

#include <cstddef>
#include <cstdint>
#include <span>

#include "rtstdb/accel/transfer.hpp"

namespace rtstdb::accel {

class TexelPool {
 public:
  struct Options {
    const char* name = "";    ///< of the buffer
    const char* plural = "";  ///< of the parts, for error texts
    bool is_float = false;    ///< read as vec4; else as uvec4
  };
  static constexpr std::size_t texel_bytes = 16;

  TexelPool() = default;
  explicit TexelPool(const Options& options) : options_(options) {}

  /// Makes space for `texels` behind those that are used, with a reserve. True: the buffer is another one.
  /// `submit` has not begun. Errors: capacity, out_of_memory, device_lost; the pool is then unchanged.
  Result<bool> reserve(gpu::Device& device, std::uint64_t texels, Submit& submit);
  /// Writes a part, for which there is space, at used(). False: the device is lost, and nothing is used.
  bool append(std::span<const std::byte> texels, Upload& upload);
  /// Removes what lies behind the first `texels`.
  void truncate(std::uint32_t texels) noexcept { used_ = texels; }

  std::uint32_t used() const noexcept { return used_; }
  const gpu::Buffer& buffer() const noexcept { return buffer_; }

 private:
  Options options_;
  gpu::Buffer buffer_;
  std::uint32_t capacity_ = 0, used_ = 0;
};

}  // namespace rtstdb::accel
