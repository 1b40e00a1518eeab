#pragma once
// Normals and colours of a mesh's corners in the layout of the device (shaders/shared/corner.h). Pure;
// allocates.

#include <glm/ext/vector_uint4.hpp>

#include <cstdint>
#include <vector>

#include <rtstdb/geometry.hpp>

namespace rtstdb::accel {

/// Number of texels; 0: the mesh has neither normals nor colours. Without `with_normals`, its normals do not
/// count.
std::uint64_t corner_texel_count(const TriangleMesh& mesh, bool with_normals) noexcept;

/// The mesh has passed validate().
std::vector<glm::uvec4> corner_texels(const TriangleMesh& mesh, bool with_normals);

}  // namespace rtstdb::accel
