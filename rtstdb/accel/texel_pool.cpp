#include "rtstdb/accel/texel_pool.hpp"

#include <algorithm>
#include <string>
#include <utility>

namespace rtstdb::accel {

Result<bool> TexelPool::reserve(gpu::Device& device, std::uint64_t texels, Submit& submit) {
  const std::uint64_t needed = used_ + texels;
  if (needed <= capacity_) return false;
  const gpu::DeviceLimits& limits = device.limits();
  const std::uint64_t most =
      std::min<std::uint64_t>(limits.max_allocation_bytes / texel_bytes, limits.max_texel_elements);
  if (needed > most) {
    return Error{ErrorCode::capacity, std::string("all ") + options_.plural + " together would need " +
                                          std::to_string(texel_bytes * needed) +
                                          " bytes in one buffer, and the device binds at most " +
                                          std::to_string(texel_bytes * most)};
  }
  const std::uint64_t generous = std::max<std::uint64_t>(needed, 2 * std::uint64_t{capacity_});
  const auto target = static_cast<std::uint32_t>(std::min(generous, most));
  gpu::BufferOptions options{.name = options_.name, .size_bytes = target * texel_bytes};
  options.texel_uint4 = !options_.is_float;
  options.texel_float4 = options_.is_float;
  auto grown = device.create_buffer(options);
  if (!grown) return grown.error();
  if (used_ > 0) {
    submit.begin();
    submit.recorder().copy(buffer_, 0, grown.value(), 0, used_ * texel_bytes);
    if (!submit.run())
      return Error{ErrorCode::device_lost,
                   std::string("the GPU stopped answering while the ") + options_.name + " grew"};
  }
  buffer_ = std::move(grown).value();
  capacity_ = target;
  return true;
}

bool TexelPool::append(std::span<const std::byte> texels, Upload& upload) {
  const auto count = static_cast<std::uint32_t>(texels.size() / texel_bytes);
  RTSTDB_ASSERT(used_ + count <= capacity_, "the pool has no space for the texels");
  if (!upload.put(buffer_, used_ * texel_bytes, texels)) return false;
  used_ += count;
  return true;
}

}  // namespace rtstdb::accel
