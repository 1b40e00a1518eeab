// The hulls of the convex parts of geometries in the pool.

#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/hull_texels.hpp"
#include "rtstdb/accel/transfer.hpp"
#include "shaders/shared/contact.h"

namespace rtstdb::accel {
namespace {

/// The hulls one after the other, and where each begins.
struct PartTexels {
  std::vector<glm::vec4> texels;
  std::vector<std::uint32_t> first;

  PartTexels(const ConvexParts& parts, std::uint32_t begin) {
    for (const ConvexHull& hull : parts) {
      const std::vector<glm::vec4> of_hull = hull_texels(hull);
      first.push_back(begin + static_cast<std::uint32_t>(texels.size()));
      texels.insert(texels.end(), of_hull.begin(), of_hull.end());
    }
  }
  std::span<const std::byte> bytes() const { return std::as_bytes(std::span(texels)); }
};

}  // namespace

GeometryPool::PooledHull GeometryPool::hull(std::uint32_t geometry, std::uint32_t part) const noexcept {
  const KeptGeometry& kept = *kept_[geometry];
  return {.texel = part_texels_[geometry][part], .hull = &(*kept.parts)[part], .mesh = kept.mesh.get()};
}

Result<void> GeometryPool::reserve_hull_texels(gpu::Device& device, std::uint64_t texels, Submit& submit) {
  const auto reserved = hulls_.reserve(device, texels, submit);
  if (!reserved) return reserved.error();
  if (reserved.value()) ++generation_;
  return {};
}

Result<std::vector<std::uint32_t>> GeometryPool::add_hulls(gpu::Device& device, const ConvexParts& parts,
                                                           Submit& submit) {
  const std::uint32_t first = hulls_.used();
  const PartTexels made(parts, first);
  if (auto reserved = reserve_hull_texels(device, made.texels.size(), submit); !reserved)
    return reserved.error();
  auto upload = Upload::create(device, made.bytes().size(), submit);
  if (!upload) return upload.error();
  if (!hulls_.append(made.bytes(), upload.value()) || !upload.value().finish()) {
    hulls_.truncate(first);
    return Error{ErrorCode::device_lost, "the GPU stopped answering while hulls were written"};
  }
  return made.first;
}

bool GeometryPool::restore_hulls(std::uint32_t index, const ConvexParts& parts, Upload& upload) {
  const PartTexels made(parts, hulls_.used());
  part_texels_[index] = made.first;
  return hulls_.append(made.bytes(), upload);
}

}  // namespace rtstdb::accel
