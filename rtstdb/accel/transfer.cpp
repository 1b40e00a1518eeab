#include "rtstdb/accel/transfer.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace rtstdb::accel {
namespace {

constexpr std::size_t max_at_once_bytes = std::size_t{16} << 20;

Result<gpu::Buffer> make_staging(gpu::Device& device, std::size_t size_bytes, gpu::Memory memory) {
  return device.create_buffer({.name = "staging",
                               .size_bytes = std::clamp<std::size_t>(size_bytes, 1, max_at_once_bytes),
                               .memory = memory});
}

}  // namespace

Result<void> read_back(gpu::Device& device, const gpu::BufferPart& from, std::span<std::byte> to,
                       Submit& submit) {
  RTSTDB_ASSERT(to.size() == from.size_bytes, "the destination has another size than the source");
  auto staging = make_staging(device, to.size(), gpu::Memory::readback);
  if (!staging) return staging.error();
  const std::span<const std::byte> seen = staging.value().host();
  for (std::size_t done = 0; done < to.size();) {
    const std::size_t size = std::min(to.size() - done, seen.size());
    submit.begin();
    submit.recorder().copy(*from.buffer, from.offset_bytes + done, staging.value(), 0, size);
    if (!submit.run())
      return Error{ErrorCode::device_lost, "the GPU stopped answering while a geometry was read back"};
    std::memcpy(to.data() + done, seen.data(), size);
    done += size;
  }
  return {};
}

Result<Upload> Upload::create(gpu::Device& device, std::size_t expected_bytes, Submit& submit) {
  auto staging = make_staging(device, expected_bytes, gpu::Memory::upload);
  if (!staging) return staging.error();
  Upload upload;
  upload.submit_ = &submit;
  upload.staging_ = std::move(staging).value();
  submit.begin();
  return upload;
}

bool Upload::put(const gpu::Buffer& to, std::size_t offset_bytes, std::span<const std::byte> bytes) {
  const std::span<std::byte> staging = staging_.host();
  while (!bytes.empty()) {
    if (used_bytes_ == staging.size()) {
      if (!flush()) return false;
      submit_->begin();
    }
    const std::size_t size = std::min(bytes.size(), staging.size() - used_bytes_);
    std::memcpy(staging.data() + used_bytes_, bytes.data(), size);
    submit_->recorder().copy(staging_, used_bytes_, to, offset_bytes, size);
    used_bytes_ += size;
    offset_bytes += size;
    bytes = bytes.subspan(size);
  }
  return true;
}

bool Upload::finish() {
  return flush();
}

bool Upload::flush() {
  used_bytes_ = 0;
  return submit_->run();
}

}  // namespace rtstdb::accel
