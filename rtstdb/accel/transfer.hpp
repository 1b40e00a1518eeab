#pragma once
// Bytes between the host and memory that only the device sees, by way of a buffer that both see. Setup.

#include <cstddef>
#include <span>

#include "rtstdb/accel/submit.hpp"
#include "rtstdb/gpu/device.hpp"

namespace rtstdb::accel {

/// As many bytes as `to` has. Errors: out_of_memory, device_lost.
Result<void> read_back(gpu::Device& device, const gpu::BufferPart& from, std::span<std::byte> to,
                       Submit& submit);

/// Gathers what goes to the device, so that many small pieces are few submissions.
class Upload {
 public:
  /// For about so many bytes. `submit` is not begun, and the upload's until it is finished.
  static Result<Upload> create(gpu::Device& device, std::size_t expected_bytes, Submit& submit);

  /// False: the device is lost. Here and in finish.
  bool put(const gpu::Buffer& to, std::size_t offset_bytes, std::span<const std::byte> bytes);
  bool finish();

 private:
  bool flush();

  Submit* submit_ = nullptr;
  gpu::Buffer staging_;
  std::size_t used_bytes_ = 0;
};

}  // namespace rtstdb::accel
