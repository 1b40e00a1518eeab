#pragma once
// Encodes and decodes the shape of a deforming geometry in records and checkpoints. Decoded shapes must
// satisfy the rules that every write satisfies.

#include <cstddef>
#include <span>
#include <vector>

#include <rtstdb/entity.hpp>

#include "rtstdb/log/bytes.hpp"

namespace rtstdb::log {

std::size_t shape_bytes(std::size_t positions) noexcept;
void put_shape(ByteWriter& writer, GeometryId geometry, std::span<const glm::vec3> positions_m) noexcept;
/// Appends the positions. Returns a description of the fault, or null.
[[nodiscard]] const char* get_shape(ByteReader& reader, GeometryId& geometry,
                                    std::vector<glm::vec3>& positions_m);

}  // namespace rtstdb::log
