// The distance fields of the geometries in the pool.

#include <algorithm>
#include <string>
#include <utility>

#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/transfer.hpp"
#include "shaders/shared/field.h"

namespace rtstdb::accel {
namespace {

constexpr std::size_t texel_bytes = 16;

const Error lost{ErrorCode::device_lost, "the GPU stopped answering while a distance field was written"};

}  // namespace

std::uint32_t GeometryPool::root(std::uint32_t geometry) const noexcept {
  return geometries_.host_as<const shared::GeometryRecord>()[geometry].root;
}

void GeometryPool::remove_last() noexcept {
  RTSTDB_ASSERT(count_ > 0 && !kept_.back()->deforming);
  --count_;
  // The field of the geometry that was added last is the last one in the pool of texels.
  if (kept_.back()->field)
    field_texel_count_ = geometries_.host_as<const shared::GeometryRecord>()[count_].field;
  node_count_ = kept_.back()->part.node_base;
  triangle_count_ = kept_.back()->part.triangle_base;
  kept_.pop_back();
  bounds_.pop_back();
}

Result<void> GeometryPool::reserve_field_texels(gpu::Device& device, std::uint64_t texels, Submit& submit) {
  if (texels <= field_texel_capacity_) return {};
  const gpu::DeviceLimits& limits = device.limits();
  const std::uint64_t most =
      std::min<std::uint64_t>(limits.max_allocation_bytes / texel_bytes, limits.max_texel_elements);
  if (texels > most) {
    return Error{ErrorCode::capacity, "all distance fields together would need " +
                                          std::to_string(texel_bytes * texels) +
                                          " bytes in one buffer, and the device binds at most " +
                                          std::to_string(texel_bytes * most)};
  }
  const std::uint64_t generous = std::max<std::uint64_t>(texels, 2 * std::uint64_t{field_texel_capacity_});
  const auto target = static_cast<std::uint32_t>(std::min(generous, most));
  gpu::BufferOptions options{.name = "field pool", .size_bytes = target * texel_bytes};
  options.texel_uint4 = true;
  auto grown = device.create_buffer(options);
  if (!grown) return grown.error();
  if (field_texel_count_ > 0) {
    submit.begin();
    submit.recorder().copy(fields_, 0, grown.value(), 0, field_texel_count_ * texel_bytes);
    if (!submit.run()) return lost;
  }
  fields_ = std::move(grown).value();
  field_texel_capacity_ = target;
  ++generation_;
  return {};
}

Result<void> GeometryPool::attach_field(gpu::Device& device, std::uint32_t geometry,
                                        std::shared_ptr<const field::StoredField> field, Submit& submit) {
  RTSTDB_ASSERT(!kept_[geometry]->deforming && !kept_[geometry]->field);
  const std::vector<glm::uvec4> texels = field::device_texels(*field, field_texel_count_);
  if (auto reserved = reserve_field_texels(device, field_texel_count_ + texels.size(), submit); !reserved)
    return reserved;
  const auto bytes = std::as_bytes(std::span(texels));
  auto upload = Upload::create(device, bytes.size(), submit);
  if (!upload) return upload.error();
  if (!upload.value().put(fields_, field_texel_count_ * texel_bytes, bytes) || !upload.value().finish())
    return lost;
  geometries_.host_as<shared::GeometryRecord>()[geometry].field = field_texel_count_;
  field_texel_count_ += static_cast<std::uint32_t>(texels.size());
  ++fields_attached_;
  kept_[geometry]->field = std::move(field);
  return {};
}

bool GeometryPool::restore_field(std::uint32_t index, const field::StoredField& field, Upload& upload) {
  const std::vector<glm::uvec4> texels = field::device_texels(field, field_texel_count_);
  RTSTDB_ASSERT(field_texel_count_ + texels.size() <= field_texel_capacity_);
  geometries_.host_as<shared::GeometryRecord>()[index].field = field_texel_count_;
  const std::size_t offset_bytes = field_texel_count_ * texel_bytes;
  field_texel_count_ += static_cast<std::uint32_t>(texels.size());
  ++fields_attached_;
  return upload.put(fields_, offset_bytes, std::as_bytes(std::span(texels)));
}

}  // namespace rtstdb::accel
