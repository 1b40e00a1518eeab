// The corner normals and colours of the geometries in the pool.

#include "rtstdb/accel/corner_texels.hpp"
#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/transfer.hpp"
#include "shaders/shared/corner.h"

namespace rtstdb::accel {

Result<void> GeometryPool::reserve_attribute_texels(gpu::Device& device, std::uint64_t texels,
                                                    Submit& submit) {
  const auto reserved = attributes_.reserve(device, texels, submit);
  if (!reserved) return reserved.error();
  if (reserved.value()) ++generation_;
  return {};
}

Result<std::uint32_t> GeometryPool::add_attributes(gpu::Device& device, const TriangleMesh& mesh,
                                                   bool deforms, Submit& submit) {
  const std::uint32_t first = attributes_.used();
  const std::vector<glm::uvec4> texels = corner_texels(mesh, !deforms);
  if (texels.empty()) return shared::attributes_none;
  if (auto reserved = reserve_attribute_texels(device, texels.size(), submit); !reserved)
    return reserved.error();
  const auto bytes = std::as_bytes(std::span(texels));
  auto upload = Upload::create(device, bytes.size(), submit);
  if (!upload) return upload.error();
  if (!attributes_.append(bytes, upload.value()) || !upload.value().finish()) {
    attributes_.truncate(first);
    return Error{ErrorCode::device_lost,
                 "the GPU stopped answering while corner normals and colours were written"};
  }
  return first;
}

bool GeometryPool::restore_attributes(std::uint32_t index, const KeptGeometry& kept, Upload& upload) {
  const std::vector<glm::uvec4> texels = corner_texels(*kept.mesh, !kept.deforming);
  if (texels.empty()) return true;
  set_attributes(index, attributes_.used());
  return attributes_.append(std::as_bytes(std::span(texels)), upload);
}

void GeometryPool::set_attributes(std::uint32_t geometry, std::uint32_t texel) noexcept {
  attribute_texels_[geometry] = texel;
  geometries_.host_as<shared::GeometryRecord>()[geometry].attributes = texel;
}

}  // namespace rtstdb::accel
