#pragma once
// Where a geometry's corners are, as it lies in records and checkpoints. What is read back is held to the rules that every write
// passes.

#include <cstddef>
#include <span>
#include <vector>

#include <rtstdb/entity.hpp>

#include "rtstdb/log/bytes.hpp"

namespace rtstdb::log {

std::size_t shape_bytes(std::size_t positions) noexcept;
void put_shape(ByteWriter& writer, GeometryId geometry, std::span<const glm::vec3> positions_m) noexcept;
/// Appends the positions. What is wrong, or null.
[[nodiscard]] const char* get_shape(ByteReader& reader, GeometryId& geometry,
                                    std::vector<glm::vec3>& positions_m);

}  // namespace rtstdb::log
