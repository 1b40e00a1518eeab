// The distance fields of the geometries in the pool.

#include <utility>

#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/transfer.hpp"
#include "shaders/shared/corner.h"
#include "shaders/shared/field.h"

namespace rtstdb::accel {
namespace {

const Error lost{ErrorCode::device_lost, "the GPU stopped answering while a distance field was written"};

}  // namespace

std::uint32_t GeometryPool::root(std::uint32_t geometry) const noexcept {
  return geometries_.host_as<const shared::GeometryRecord>()[geometry].root;
}

bool GeometryPool::has_inside(std::uint32_t geometry) const noexcept {
  return geometries_.host_as<const shared::GeometryRecord>()[geometry].closed != 0;
}

void GeometryPool::remove_last() noexcept {
  RTSTDB_ASSERT(count_ > 0 && !kept_.back()->deforming, "the pool has no geometry, or its last one deforms");
  --count_;
  // The field of the geometry that was added last is the last one in the pool of texels.
  if (kept_.back()->field)
    fields_.truncate(geometries_.host_as<const shared::GeometryRecord>()[count_].field);
  if (!part_texels_.back().empty()) hulls_.truncate(part_texels_.back().front());
  part_texels_.pop_back();
  if (attribute_texels_[count_] != shared::attributes_none) attributes_.truncate(attribute_texels_[count_]);
  attribute_texels_.resize(count_);
  node_count_ = kept_.back()->part.node_base;
  triangle_count_ = kept_.back()->part.triangle_base;
  kept_.pop_back();
  bounds_.pop_back();
}

Result<void> GeometryPool::reserve_field_texels(gpu::Device& device, std::uint64_t texels, Submit& submit) {
  const auto reserved = fields_.reserve(device, texels, submit);
  if (!reserved) return reserved.error();
  if (reserved.value()) ++generation_;
  return {};
}

Result<void> GeometryPool::attach_field(gpu::Device& device, std::uint32_t geometry,
                                        std::shared_ptr<const field::StoredField> field, Submit& submit) {
  RTSTDB_ASSERT(!kept_[geometry]->deforming && !kept_[geometry]->field,
                "the geometry deforms, or has a field already");
  const std::uint32_t first = fields_.used();
  const std::vector<glm::uvec4> texels = field::device_texels(*field, first);
  if (auto reserved = reserve_field_texels(device, texels.size(), submit); !reserved) return reserved;
  const auto bytes = std::as_bytes(std::span(texels));
  auto upload = Upload::create(device, bytes.size(), submit);
  if (!upload) return upload.error();
  if (!fields_.append(bytes, upload.value()) || !upload.value().finish()) {
    fields_.truncate(first);
    return lost;
  }
  geometries_.host_as<shared::GeometryRecord>()[geometry].field = first;
  ++fields_attached_;
  kept_[geometry]->field = std::move(field);
  return {};
}

bool GeometryPool::restore_field(std::uint32_t index, const field::StoredField& field, Upload& upload) {
  const std::uint32_t first = fields_.used();
  const std::vector<glm::uvec4> texels = field::device_texels(field, first);
  geometries_.host_as<shared::GeometryRecord>()[index].field = first;
  ++fields_attached_;
  return fields_.append(std::as_bytes(std::span(texels)), upload);
}

}  // namespace rtstdb::accel
