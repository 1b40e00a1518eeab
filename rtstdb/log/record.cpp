#include "rtstdb/log/record.hpp"

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/row_check.hpp"
#include "rtstdb/log/bytes.hpp"
#include "rtstdb/log/stored_row.hpp"
#include "rtstdb/store/motion_words.hpp"

namespace rtstdb::log {
namespace {

using store::Write;
using store::WriteKind;

std::size_t write_bytes(WriteKind kind, std::uint16_t unchanged) noexcept {
  switch (kind) {
    case WriteKind::create:
    case WriteKind::update:
      return sizeof(StoredWrite) + row_bytes;
    case WriteKind::update_motion:
      return sizeof(StoredWrite) + changed_bytes(unchanged);
    case WriteKind::remove:
      break;
  }
  return sizeof(StoredWrite);
}

/// `unchanged`: of a write.
template <class Unchanged>
std::size_t bytes_of(const store::WriteSet& set, Unchanged unchanged) noexcept {
  std::size_t bytes = sizeof(RecordHeader) + sizeof(CommitBody);
  for (const Write& write : set.writes)
    bytes += write_bytes(write.kind, unchanged(write));
  for (const store::ShapeWrite& write : set.shapes)
    bytes += shape_bytes(write.positions_m.size());
  return bytes;
}

StoredWriteKind stored(WriteKind kind) noexcept {
  switch (kind) {
    case WriteKind::create:
      return StoredWriteKind::create;
    case WriteKind::update:
      return StoredWriteKind::update;
    case WriteKind::update_motion:
      return StoredWriteKind::update_motion;
    case WriteKind::remove:
      break;
  }
  return StoredWriteKind::remove;
}

void put_header(ByteWriter& writer, RecordKind kind, std::span<std::byte> room) noexcept {
  RTSTDB_ASSERT(room.size() <= max_record_bytes);
  writer.put(RecordHeader{kind, static_cast<std::uint32_t>(room.size())});
}

void put_write(ByteWriter& writer, const Write& write) noexcept {
  const bool whole = write.kind == WriteKind::create || write.kind == WriteKind::update;
  const bool moves = write.kind == WriteKind::update_motion;
  const EntityState& state = write.state;
  const std::uint32_t what = whole   ? state.row.geometry.index
                             : moves ? left_out(write.unchanged, write.follows)
                                     : 0;
  writer.put(stored(write.kind), state.id.index, state.id.generation, what);  // a StoredWrite
  if (whole) put_row(writer, state.row);
  if (moves) put_changed(writer, state.row.motion, write.unchanged);
}

const char* get_motion_write(ByteReader& reader, std::uint32_t what, Write& write) noexcept {
  write.unchanged = static_cast<std::uint16_t>(what);
  write.follows = static_cast<std::uint16_t>(what >> 16);
  if (write.unchanged == 0 && write.follows != 0) return "a motion follows another and leaves nothing out";
  if ((write.unchanged & ~store::all_motion_words) != 0) return "a motion leaves out what it does not have";
  Motion& motion = write.state.row.motion;
  return write.unchanged == 0 ? get_motion(reader, motion) : get_changed(reader, write.unchanged, motion);
}

const char* get_write(ByteReader& reader, Version version, Write& write) noexcept {
  StoredWrite stored_write;
  if (!reader.get(stored_write)) return "a write is cut short";
  write = Write(WriteKind::create, {{stored_write.index, stored_write.generation}, {}, version});
  if (stored_write.index >= max_entities) return "an entity's index is beyond the limit";
  switch (stored_write.kind) {
    case StoredWriteKind::create:
      write.kind = WriteKind::create;
      break;
    case StoredWriteKind::update:
      write.kind = WriteKind::update;
      break;
    case StoredWriteKind::update_motion:
      write.kind = WriteKind::update_motion;
      break;
    case StoredWriteKind::remove:
      write.kind = WriteKind::remove;
      break;
    default:
      return "a write is of no known kind";
  }
  if (write.kind == WriteKind::create || write.kind == WriteKind::update) {
    write.state.row.geometry = {stored_write.what};
    if (const char* fault = check_geometry_index(stored_write.what)) return fault;
    return get_row(reader, write.state.row);
  }
  if (write.kind == WriteKind::update_motion) return get_motion_write(reader, stored_write.what, write);
  return stored_write.what == 0 ? nullptr : "a write has a geometry that it can not have";
}

}  // namespace

// ---- commits

std::size_t commit_bytes(const store::WriteSet& set) noexcept {
  return bytes_of(set, [](const Write& write) { return write.unchanged; });
}

std::size_t most_commit_bytes(const store::WriteSet& set) noexcept {
  return bytes_of(set, [](const Write&) { return std::uint16_t{0}; });
}

void encode_commit(const store::WriteSet& set, std::span<std::byte> room) noexcept {
  ByteWriter writer(room);
  put_header(writer, RecordKind::commit, room);
  // A CommitBody, number by number (see put_motion).
  writer.put(std::uint64_t{set.version}, std::int64_t{set.time.time_since_epoch().count()},
             static_cast<std::uint32_t>(set.writes.size()), static_cast<std::uint32_t>(set.shapes.size()));
  for (const Write& write : set.writes)
    put_write(writer, write);
  for (const store::ShapeWrite& write : set.shapes)
    put_shape(writer, write.geometry, write.positions_m);
  RTSTDB_ASSERT(writer.count() == room.size());
}

const char* RecordDecoder::decode_commit(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  CommitBody body;
  if (!reader.get(body)) return "a commit is cut short";
  if (body.version == 0) return "a commit has no version";
  if (const char* fault = check_time(body.world_time_ns)) return fault;
  if (body.writes == 0 && body.shapes == 0) return "a commit writes nothing";
  if (body.writes > reader.left() / sizeof(StoredWrite) || body.shapes > reader.left() / sizeof(StoredShape))
    return "a commit has more writes than bytes";

  store::WriteSet& set = record_.commit;
  set.version = body.version;
  set.time = world_time_ns(body.world_time_ns);
  set.writes.resize(body.writes);
  for (Write& write : set.writes)
    if (const char* fault = get_write(reader, body.version, write)) return fault;
  set.shapes.clear();
  positions_m_.clear();
  for (std::uint32_t k = 0; k < body.shapes; ++k) {
    store::ShapeWrite shape;
    const std::size_t before = positions_m_.size();
    if (const char* fault = get_shape(reader, shape.geometry, positions_m_)) return fault;
    shape.given = shape.room = positions_m_.size() - before;
    set.shapes.push_back(shape);
  }
  if (reader.left() != 0) return "a commit has bytes left over";
  std::size_t first = 0;  // only now do the positions stay where they are
  for (store::ShapeWrite& shape : set.shapes) {
    shape.positions_m = std::span(positions_m_).subspan(first, shape.given);
    first += shape.given;
  }
  return nullptr;
}

// ---- shapes

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
  if (check_positions(std::span(positions_m).subspan(first)))
    return "a shape has a position that none can have";
  return reader.skip_padding(8) ? nullptr : "a shape is not padded with zeros";
}

// ---- geometries

std::size_t stored_geometry_bytes(const LoggedGeometry& geometry) noexcept {
  return sizeof(StoredGeometry) + round_up(geometry.name.size(), 8);
}

void put_geometry(ByteWriter& writer, const LoggedGeometry& geometry) noexcept {
  RTSTDB_ASSERT(geometry.name.size() <= max_name_bytes);
  const GeometryOptions& options = geometry.options;
  writer.put(StoredGeometry{geometry.file, geometry.file_checksum, geometry.id.index,
                            options.deforms ? 1u : 0u, options.kept_shapes, options.rebuild_growth,
                            static_cast<std::uint32_t>(geometry.name.size()), 0});
  writer.put_bytes(std::as_bytes(std::span(geometry.name)));
  writer.pad_to(8);
}

const char* get_geometry(ByteReader& reader, LoggedGeometry& geometry) {
  StoredGeometry stored_geometry;
  if (!reader.get(stored_geometry)) return "a geometry is cut short";
  if (stored_geometry.index >= max_geometries) return "a geometry's index is beyond the limit";
  if (stored_geometry.deforms > 1 || stored_geometry.reserved != 0 || stored_geometry.file == 0)
    return "a geometry is none that can be added";
  geometry.id = {stored_geometry.index};
  geometry.file = stored_geometry.file;
  geometry.file_checksum = stored_geometry.file_checksum;
  geometry.options = {stored_geometry.deforms == 1, stored_geometry.kept_shapes,
                      stored_geometry.rebuild_growth};
  const bool options_possible = stored_geometry.kept_shapes >= 1 &&
                                stored_geometry.kept_shapes <= max_kept_shapes &&
                                stored_geometry.rebuild_growth >= 1.0f;
  if (geometry.options.deforms && !options_possible) return "a geometry's options are none that it can have";
  if (stored_geometry.name_bytes > max_name_bytes) return "a geometry's name is too long";
  std::span<const std::byte> name;
  if (!reader.get_bytes(stored_geometry.name_bytes, name)) return "a geometry's name is cut short";
  geometry.name.assign(reinterpret_cast<const char*>(name.data()), name.size());
  return reader.skip_padding(8) ? nullptr : "a geometry's name is not padded with zeros";
}

std::size_t geometry_bytes(const LoggedGeometry& geometry) noexcept {
  return sizeof(RecordHeader) + stored_geometry_bytes(geometry);
}

void encode_geometry(const LoggedGeometry& geometry, std::span<std::byte> room) noexcept {
  ByteWriter writer(room);
  put_header(writer, RecordKind::geometry, room);
  put_geometry(writer, geometry);
  RTSTDB_ASSERT(writer.count() == room.size());
}

const char* RecordDecoder::decode_geometry(std::span<const std::byte> body) {
  ByteReader reader(body);
  if (const char* fault = get_geometry(reader, record_.geometry)) return fault;
  return reader.left() == 0 ? nullptr : "a geometry has bytes left over";
}

// ---- versions that came to nothing, and such that are missing

void encode_taken_back(Version version, std::span<std::byte> room) noexcept {
  ByteWriter writer(room);
  put_header(writer, RecordKind::taken_back, room);
  writer.put(TakenBackBody{version});
}

void encode_gap(Version from, Version to, std::span<std::byte> room) noexcept {
  ByteWriter writer(room);
  put_header(writer, RecordKind::gap, room);
  writer.put(GapBody{from, to});
}

const char* RecordDecoder::decode(std::span<const std::byte> bytes) {
  bytes_ = 0;
  ByteReader reader(bytes);
  RecordHeader header;
  if (!reader.get(header)) return "a record is cut short";
  if (header.bytes < sizeof header || header.bytes > max_record_bytes || header.bytes % 8 != 0 ||
      header.bytes > bytes.size())
    return "a record has a length that it can not have";
  bytes_ = header.bytes;
  record_.kind = header.kind;
  const auto body = bytes.first(header.bytes).subspan(sizeof header);
  switch (header.kind) {
    case RecordKind::commit:
      return decode_commit(body);
    case RecordKind::geometry:
      return decode_geometry(body);
    case RecordKind::taken_back: {
      TakenBackBody taken_back;
      if (body.size() != sizeof taken_back || !reader.get(taken_back)) return "a record is cut short";
      record_.version = taken_back.version;
      return taken_back.version != 0 ? nullptr : "no version is taken back";
    }
    case RecordKind::gap: {
      GapBody gap;
      if (body.size() != sizeof gap || !reader.get(gap)) return "a record is cut short";
      record_.version = gap.from;
      record_.to = gap.to;
      return gap.from != 0 && gap.from <= gap.to ? nullptr : "a gap ends before it begins";
    }
    default:
      return "a record is of no known kind";
  }
}

}  // namespace rtstdb::log
