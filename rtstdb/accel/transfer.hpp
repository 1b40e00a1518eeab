#pragma once
// Copies between the host and device-only memory through a staging buffer. Setup.

#include <cstddef>
#include <span>

#include "rtstdb/accel/submit.hpp"
#include "rtstdb/gpu/device.hpp"

namespace rtstdb::accel {

/// Reads to.size() bytes. Errors: out_of_memory, device_lost.
Result<void> read_back(gpu::Device& device, const gpu::BufferPart& from, std::span<std::byte> to,
                       Submit& submit);

/// Collects writes to the device, so that many small pieces need few submissions.
class Upload {
 public:
  /// `expected_bytes` is an estimate. `submit` has not begun and is in use until finish(). Errors:
  /// out_of_memory, device_lost.
  static Result<Upload> create(gpu::Device& device, std::size_t expected_bytes, Submit& submit);

  /// Returns false when the device is lost, as does finish().
  bool put(const gpu::Buffer& to, std::size_t offset_bytes, std::span<const std::byte> bytes);
  bool finish();

 private:
  bool flush();

  Submit* submit_ = nullptr;
  gpu::Buffer staging_;
  std::size_t used_bytes_ = 0;
};

}  // namespace rtstdb::accel
