#include "rtstdb/log/checkpoint_reader.hpp"

#include "rtstdb/log/bytes.hpp"
#include "rtstdb/log/directory.hpp"
#include "rtstdb/log/geometry_file.hpp"
#include "rtstdb/log/stored_row.hpp"
#include "rtstdb/log/stored_shape.hpp"
#include "rtstdb/log/whole_file.hpp"

namespace rtstdb::log {
namespace {

/// A description of the fault; empty: the header is valid.
std::string check_header(const CheckpointHeader& header, std::uint64_t number) {
  if (header.magic != checkpoint_magic) return "it is not a checkpoint";
  if (header.format != format_version) return refused_format(header.format);
  if (header.checksum != header_checksum(header, header.database_id)) return "its header is damaged";
  if (header.number != number) return "its header has another number";
  const bool possible = header.index_limit <= max_entities && header.next_version > header.version;
  if (!possible || check_time(header.world_time_ns) != nullptr) return "its header has invalid values";
  return {};
}

/// Reads the chunks of a checkpoint into a world.
class CheckpointReading {
 public:
  CheckpointReading(const CheckpointHeader& header, std::span<const std::byte> bytes)
      : header_(header), reader_(bytes) {
    world.latest = {header.version, world_time_ns(header.world_time_ns)};
    world.next_version = header.next_version;
  }

  World world;

  const char* chunk(bool& ended);
  const char* check_whole() const;
  std::size_t left() const { return reader_.left(); }

 private:
  const char* rows(ByteReader& payload, std::uint32_t entries);
  const char* row(ByteReader& payload);
  const char* shape(ByteReader& payload);

  CheckpointHeader header_;
  ByteReader reader_;
  std::uint64_t chunks_ = 0;
};

const char* CheckpointReading::chunk(bool& ended) {
  ChunkHeader header;
  if (!reader_.get(header)) return "it ends before its last chunk";
  if (header.magic != chunk_magic || header.checksum != header_checksum(header, header_.database_id))
    return "a chunk's header is damaged";
  if (header.number != chunks_++ || header.checkpoint != header_.number)
    return "a chunk has the wrong number";
  std::span<const std::byte> bytes;
  if (!reader_.get_bytes(header.payload_bytes, bytes)) return "a chunk is cut short";
  if (checksum(bytes, header_.database_id) != header.payload_checksum) return "a chunk is damaged";
  ByteReader payload(bytes);
  const char* fault = nullptr;
  if (header.kind == ChunkKind::geometry) {
    LoggedGeometry geometry;
    fault = get_geometry(payload, geometry);
    if (fault == nullptr)
      fault = world.knows(geometry.id) ? "a geometry occurs twice" : world.add(geometry, {});
  } else if (header.kind == ChunkKind::material) {
    LoggedMaterial material;
    fault = get_definition(payload, material);
    if (fault == nullptr) fault = world.knows(material.id) ? "a material occurs twice" : world.add(material);
  } else if (header.kind == ChunkKind::light) {
    LoggedLight light;
    fault = get_definition(payload, light);
    if (fault == nullptr) fault = world.knows(light.id) ? "a light occurs twice" : world.add(light);
  } else if (header.kind == ChunkKind::rows) {
    fault = rows(payload, header.entries);
  } else if (header.kind == ChunkKind::shape) {
    fault = shape(payload);
  } else if (header.kind == ChunkKind::end) {
    ended = true;
  } else {
    fault = "a chunk has an unknown kind";
  }
  if (fault != nullptr) return fault;
  return payload.left() == 0 ? nullptr : "a chunk has extra bytes";
}

const char* CheckpointReading::rows(ByteReader& payload, std::uint32_t entries) {
  if (entries > header_.index_limit - world.rows.size()) return "it has more rows than its header says";
  for (std::uint32_t k = 0; k < entries; ++k)
    if (const char* fault = row(payload)) return fault;
  return nullptr;
}

const char* CheckpointReading::row(ByteReader& payload) {
  StoredIndex stored;
  if (!payload.get(stored)) return "a chunk of rows is cut short";
  EntityState state;
  if (stored.lives > 1 || stored.reserved != 0) return "a row has invalid values";
  if (stored.lives == 1) {
    state.id = {static_cast<std::uint32_t>(world.rows.size()), stored.generation};
    state.written_by = stored.written_by;
    state.row.geometry = {stored.geometry};
    if (stored.written_by > header_.version) return "a row is newer than the checkpoint";
    if (state.row.geometry.valid() && !world.knows(state.row.geometry))
      return "a row has an unknown geometry";
    if (const char* fault = get_row(payload, state.row)) return fault;
    if (!world.knows(state.row.material)) return "a row has an unknown material";
    if (state.row.light.valid() && !world.knows(state.row.light)) return "a row has an unknown light";
  } else if (stored.written_by != 0 || stored.geometry != 0) {
    return "a row has invalid values";
  }
  world.rows.push_back(state);
  world.generations.push_back(stored.generation);
  return nullptr;
}

const char* CheckpointReading::shape(ByteReader& payload) {
  std::uint64_t version = 0;
  GeometryId id;
  std::vector<glm::vec3> positions_m;
  if (!payload.get(version)) return "a shape is cut short";
  if (const char* fault = get_shape(payload, id, positions_m)) return fault;
  if (!world.knows(id) || !world.geometries[id.index].logged.options.deforms || version == 0 ||
      version > header_.version)
    return "a shape has invalid values";
  world.geometries[id.index].shape_version = version;
  world.geometries[id.index].positions_m = std::move(positions_m);
  return nullptr;
}

const char* CheckpointReading::check_whole() const {
  if (reader_.left() != 0) return "it has data after its end";
  return world.rows.size() == header_.index_limit ? nullptr : "it has fewer rows than its header says";
}

Error refusal(std::uint64_t number, std::size_t offset, const std::string& fault) {
  return {ErrorCode::file, checkpoint_name(number) + ", offset " + std::to_string(offset) + ": " + fault};
}

}  // namespace

Result<CheckpointHeader> read_checkpoint_header(Disk& disk, std::uint64_t number) {
  auto file = disk.open(checkpoint_name(number));
  if (!file) return Error{ErrorCode::file, file.error().describe()};
  CheckpointHeader header;
  auto count = file.value()->read(0, std::as_writable_bytes(std::span(&header, 1)));
  if (!count) return Error{ErrorCode::file, count.error().describe()};
  if (count.value() != sizeof header) return refusal(number, 0, "it is shorter than its header");
  if (const std::string fault = check_header(header, number); !fault.empty())
    return refusal(number, 0, fault);
  return header;
}

Result<Checkpoint> read_checkpoint(Disk& disk, std::uint64_t number, std::uint64_t database_id) {
  auto bytes = read_whole_file(disk, checkpoint_name(number));
  if (!bytes) return Error{ErrorCode::file, bytes.error().describe()};
  Checkpoint checkpoint;
  if (!ByteReader(bytes.value()).get(checkpoint.header))
    return refusal(number, 0, "it is shorter than its header");
  if (const std::string fault = check_header(checkpoint.header, number); !fault.empty())
    return refusal(number, 0, fault);
  if (checkpoint.header.database_id != database_id)
    return refusal(number, 0, "it belongs to another database");

  const auto chunks = std::span<const std::byte>(bytes.value()).subspan(sizeof checkpoint.header);
  CheckpointReading reading(checkpoint.header, chunks);
  const char* fault = nullptr;
  std::size_t offset = 0;
  for (bool ended = false; !ended && fault == nullptr;) {
    offset = bytes.value().size() - reading.left();
    fault = reading.chunk(ended);
  }
  if (fault == nullptr) fault = reading.check_whole();
  if (fault != nullptr) return refusal(number, offset, fault);
  checkpoint.world = std::move(reading.world);
  return checkpoint;
}

std::optional<Checkpoint> oldest_checkpoint(Disk& disk, const Listing& listing, Version not_before) {
  for (const std::uint64_t number : listing.checkpoints) {
    auto header = read_checkpoint_header(disk, number);
    if (!header || header.value().version < not_before) continue;
    auto checkpoint = read_checkpoint(disk, number, header.value().database_id);
    if (checkpoint) return std::move(checkpoint).value();
  }
  return std::nullopt;
}

Result<void> read_meshes(Disk& disk, std::uint64_t database_id, World& world) {
  for (WorldGeometry& geometry : world.geometries) {
    auto mesh = read_geometry_file(disk, database_id, geometry.logged.file, geometry.logged.file_checksum);
    if (!mesh) return mesh.error();
    geometry.mesh = std::move(mesh).value();
    if (!geometry.positions_m.empty() && geometry.positions_m.size() != geometry.mesh.positions_m.size())
      return Error{ErrorCode::file, geometry_name(geometry.logged.file) +
                                        ": the checkpoint has a shape with another number of positions"};
  }
  return {};
}

}  // namespace rtstdb::log
