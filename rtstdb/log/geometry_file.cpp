#include "rtstdb/log/geometry_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>
#include <vector>

#include <rtstdb/limits.hpp>

#include "rtstdb/log/bytes.hpp"
#include "rtstdb/log/directory.hpp"
#include "rtstdb/log/whole_file.hpp"

namespace rtstdb::log {
namespace {

void put_solid(const std::optional<Solid>& solid, GeometryHeader& header) {
  if (!solid) return;
  header.solid_kind = static_cast<std::uint32_t>(solid->kind) + 1;
  StoredSolid& stored = header.solid;
  for (int i = 0; i < 3; ++i) {
    stored.size_m[i] = solid->size_m[i];
    stored.center_m[i] = solid->center_m[i];
  }
  stored.radius_m = solid->radius_m;
  stored.height_m = solid->height_m;
  const glm::dquat& q = solid->q_entity;
  std::ranges::copy(std::array{q.w, q.x, q.y, q.z}, stored.q_entity_wxyz);
}

std::optional<Solid> solid_of(const GeometryHeader& header) {
  if (header.solid_kind == 0) return std::nullopt;
  const StoredSolid& stored = header.solid;
  const double* const q = stored.q_entity_wxyz;
  return Solid{.kind = static_cast<SolidKind>(header.solid_kind - 1),
               .size_m = {stored.size_m[0], stored.size_m[1], stored.size_m[2]},
               .radius_m = stored.radius_m,
               .height_m = stored.height_m,
               .center_m = {stored.center_m[0], stored.center_m[1], stored.center_m[2]},
               .q_entity = {q[0], q[1], q[2], q[3]}};
}

std::vector<std::byte> encode(std::uint64_t database_id, std::uint64_t number, const TriangleMesh& mesh,
                              const GeometryOptions& options) {
  const ConvexPartPoints& convex_parts_m = options.convex_parts_m;
  const auto positions = std::as_bytes(std::span(mesh.positions_m));
  const auto triangles = std::as_bytes(std::span(mesh.triangles));
  std::size_t part_bytes = 0;
  for (const auto& points_m : convex_parts_m)
    part_bytes += sizeof(std::uint32_t) + points_m.size() * sizeof(glm::vec3);
  const auto normals = std::as_bytes(std::span(mesh.corner_normals));
  const auto colors = std::as_bytes(std::span(mesh.corner_colors));
  std::vector<std::byte> bytes(sizeof(GeometryHeader) + positions.size() + triangles.size() + part_bytes +
                               normals.size() + colors.size());
  const auto payload = std::span(bytes).subspan(sizeof(GeometryHeader));
  ByteWriter writer(payload);
  writer.put_bytes(positions);
  writer.put_bytes(triangles);
  for (const auto& points_m : convex_parts_m) {
    writer.put(static_cast<std::uint32_t>(points_m.size()));
    writer.put_bytes(std::as_bytes(std::span(points_m)));
  }
  writer.put_bytes(normals);
  writer.put_bytes(colors);

  GeometryHeader header;
  header.convex_parts = static_cast<std::uint32_t>(convex_parts_m.size());
  put_solid(options.solid, header);
  header.corner_values =
      (normals.empty() ? 0u : has_corner_normals) | (colors.empty() ? 0u : has_corner_colors);
  header.database_id = database_id;
  header.number = number;
  header.positions = static_cast<std::uint32_t>(mesh.positions_m.size());
  header.triangles = static_cast<std::uint32_t>(mesh.triangles.size());
  header.payload_checksum = checksum(payload, database_id);
  header.checksum = header_checksum(header, database_id);
  ByteWriter(bytes).put(header);
  return bytes;
}

DiskFault write_to(Disk& disk, DiskFile& file, std::span<const std::byte> bytes) {
  if (auto fault = file.write(0, bytes)) return fault;
  if (auto fault = file.sync()) return fault;
  return disk.sync_directory();
}

/// False: the file ends before the parts do, or a part has no points or too many.
bool read_parts(ByteReader& reader, std::uint32_t count, ConvexPartPoints& parts_m) {
  for (std::uint32_t part = 0; part < count; ++part) {
    std::uint32_t points = 0;
    std::span<const std::byte> bytes;
    if (!reader.get(points) || points == 0 || points > max_convex_part_points ||
        !reader.get_bytes(points * sizeof(glm::vec3), bytes))
      return false;
    parts_m.emplace_back(points);
    std::memcpy(static_cast<void*>(parts_m.back().data()), bytes.data(), bytes.size());
  }
  return true;
}

/// False: the file ends before the values do.
bool read_corner_values(ByteReader& reader, std::size_t triangles, std::vector<CornerValues>& values) {
  std::span<const std::byte> bytes;
  if (!reader.get_bytes(triangles * sizeof(CornerValues), bytes)) return false;
  values.resize(triangles);
  std::memcpy(static_cast<void*>(values.data()), bytes.data(), bytes.size());
  return true;
}

/// A description of the fault; empty: the file is valid.
std::string decode(std::span<const std::byte> bytes, const GeometryHeader& expected, StoredMesh& mesh) {
  ByteReader reader(bytes);
  GeometryHeader header;
  if (!reader.get(header)) return "it is shorter than its header";
  if (header.magic != geometry_magic) return "it is not a geometry file";
  if (header.format != format_version) return refused_format(header.format);
  if (header.database_id != expected.database_id) return "it belongs to another database";
  if (header.checksum != header_checksum(header, header.database_id)) return "its header is damaged";
  if (header.checksum != expected.checksum || header.number != expected.number)
    return "it is not the file that the record refers to";
  if (header.positions == 0 || header.triangles == 0) return "it has no triangle";
  const std::size_t position_bytes = std::size_t{header.positions} * sizeof(glm::vec3);
  const std::size_t triangle_bytes = std::size_t{header.triangles} * sizeof(glm::uvec3);
  if (header.solid_kind > 1 + static_cast<std::uint32_t>(SolidKind::cylinder))
    return "its solid is of an unknown kind";
  if ((header.corner_values & ~(has_corner_normals | has_corner_colors)) != 0)
    return "its corners have values of an unknown kind";
  if (reader.left() < position_bytes + triangle_bytes || header.convex_parts > max_convex_parts)
    return "its length is not that in its header";
  if (checksum(bytes.subspan(sizeof header), header.database_id) != header.payload_checksum)
    return "its mesh is damaged";
  mesh.solid = solid_of(header);
  mesh.positions_m.resize(header.positions);
  mesh.triangles.resize(header.triangles);
  const auto payload = bytes.subspan(sizeof header);
  std::memcpy(static_cast<void*>(mesh.positions_m.data()), payload.data(), position_bytes);
  std::memcpy(static_cast<void*>(mesh.triangles.data()), payload.data() + position_bytes, triangle_bytes);
  ByteReader behind(payload.subspan(position_bytes + triangle_bytes));
  const std::size_t triangles = header.triangles;
  const bool has_all = read_parts(behind, header.convex_parts, mesh.convex_parts_m) &&
                       ((header.corner_values & has_corner_normals) == 0 ||
                        read_corner_values(behind, triangles, mesh.corner_normals)) &&
                       ((header.corner_values & has_corner_colors) == 0 ||
                        read_corner_values(behind, triangles, mesh.corner_colors));
  return has_all && behind.left() == 0 ? std::string() : "its length is not that in its header";
}

}  // namespace

DiskResult<std::uint64_t> write_geometry_file(Disk& disk, std::uint64_t database_id, std::uint64_t number,
                                              const TriangleMesh& mesh, const GeometryOptions& options) {
  const std::vector<std::byte> bytes = encode(database_id, number, mesh, options);
  const std::string name = geometry_name(number);
  auto file = disk.create(name);
  if (!file) return file.error();
  if (auto fault = write_to(disk, *file.value(), bytes)) {
    disk.remove(name);  // if that fails, no record refers to the file
    return *fault;
  }
  GeometryHeader header;
  RTSTDB_ASSERT(ByteReader(bytes).get(header), "the file that was written has no header");
  return header.checksum;
}

Result<StoredMesh> read_geometry_file(Disk& disk, std::uint64_t database_id, std::uint64_t number,
                                      std::uint64_t file_checksum, bool* unreadable) {
  const std::string name = geometry_name(number);
  auto bytes = read_whole_file(disk, name);
  if (unreadable != nullptr) *unreadable = !bytes && bytes.error().number != ENOENT;
  if (!bytes) return Error{ErrorCode::file, bytes.error().describe()};
  GeometryHeader expected;
  expected.database_id = database_id;
  expected.number = number;
  expected.checksum = file_checksum;
  StoredMesh mesh;
  if (const std::string fault = decode(bytes.value(), expected, mesh); !fault.empty())
    return Error{ErrorCode::file, name + ": " + fault};
  if (auto valid = validate(mesh); !valid) return Error{ErrorCode::file, name + ": " + valid.error().message};
  return mesh;
}

}  // namespace rtstdb::log
