#include "rtstdb/log/stored_shape.hpp"

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/row_check.hpp"

namespace rtstdb::log {

std::size_t shape_bytes(std::size_t positions) noexcept {
  return sizeof(StoredShape) + round_up(positions * sizeof(glm::vec3), 8);
}

void put_shape(ByteWriter& writer, GeometryId geometry, std::span<const glm::vec3> positions_m) noexcept {
  static_assert(sizeof(glm::vec3) == 12);
  writer.put(StoredShape{geometry.index, static_cast<std::uint32_t>(positions_m.size())});
  writer.put_bytes(std::as_bytes(positions_m));
  writer.pad_to(8);
}

const char* get_shape(ByteReader& reader, GeometryId& geometry, std::vector<glm::vec3>& positions_m) {
  StoredShape stored_shape;
  if (!reader.get(stored_shape)) return "a shape is cut short";
  if (stored_shape.geometry >= max_geometries) return "a geometry's index is beyond the limit";
  if (stored_shape.positions == 0) return "a shape has no position";
  geometry = {stored_shape.geometry};
  std::span<const std::byte> bytes;
  if (!reader.get_bytes(std::size_t{stored_shape.positions} * sizeof(glm::vec3), bytes))
    return "a shape is cut short";
  const std::size_t first = positions_m.size();
  positions_m.resize(first + stored_shape.positions);
  std::memcpy(static_cast<void*>(positions_m.data() + first), bytes.data(), bytes.size());
  if (check_positions(std::span(positions_m).subspan(first))) return "a shape has an invalid position";
  return reader.skip_padding(8) ? nullptr : "a shape is not padded with zeros";
}

}  // namespace rtstdb::log
