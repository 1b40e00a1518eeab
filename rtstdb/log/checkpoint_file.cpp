#include "rtstdb/log/checkpoint_file.hpp"

#include <algorithm>
#include <new>

#include "rtstdb/log/bytes.hpp"
#include "rtstdb/log/directory.hpp"
#include "rtstdb/log/stored_row.hpp"
#include "rtstdb/log/stored_shape.hpp"

namespace rtstdb::log {
namespace {

CheckpointHeader header_of(const CheckpointFile::Begin& begin, const WorldHead& head) {
  CheckpointHeader header;
  header.index_limit = head.index_limit;
  header.database_id = begin.database_id;
  header.number = begin.number;
  header.version = head.version.version;
  header.world_time_ns = head.version.time.time_since_epoch().count();
  header.next_version = head.next_version;
  header.segment = begin.position.segment;
  header.offset = begin.position.offset;
  header.group = begin.position.group;
  header.link = begin.position.link;
  header.real_time_ns = begin.real_time_ns;
  header.checksum = header_checksum(header, begin.database_id);
  return header;
}

}  // namespace

CheckpointFile::CheckpointFile(Disk& disk, std::unique_ptr<DiskFile> file, const Begin& begin, WorldHead head)
    : disk_(disk), file_(std::move(file)), begin_(begin), head_(std::move(head)) {}

CheckpointFile::~CheckpointFile() {
  if (published_) return;
  try {
    disk_.remove(unfinished_checkpoint_name(begin_.number));
  } catch (const std::bad_alloc&) {
    // The next start removes it.
  }
}

DiskResult<std::unique_ptr<CheckpointFile>> CheckpointFile::create(Disk& disk, const Begin& begin,
                                                                   WorldHead head) {
  auto file = disk.create(unfinished_checkpoint_name(begin.number));
  if (!file) return file.error();
  std::unique_ptr<CheckpointFile> made(
      new CheckpointFile(disk, std::move(file.value()), begin, std::move(head)));
  const CheckpointHeader header = header_of(begin, made->head_);
  if (auto fault = made->file_->write(0, std::as_bytes(std::span(&header, 1)))) return *fault;
  made->offset_ = sizeof header;
  return made;
}

DiskFault CheckpointFile::write_chunk(ChunkKind kind, std::uint32_t entries) {
  const auto payload = std::span(chunk_).subspan(sizeof(ChunkHeader));
  RTSTDB_ASSERT(payload.size() <= max_payload_bytes, "the payload of the chunk is above max_payload_bytes");
  ChunkHeader header;
  header.kind = kind;
  header.number = chunks_++;
  header.checkpoint = begin_.number;
  header.payload_bytes = static_cast<std::uint32_t>(payload.size());
  header.entries = entries;
  header.payload_checksum = checksum(payload, begin_.database_id);
  header.checksum = header_checksum(header, begin_.database_id);
  ByteWriter(chunk_).put(header);
  if (auto fault = file_->write(offset_, chunk_)) return fault;
  offset_ += chunk_.size();
  return std::nullopt;
}

DiskResult<CheckpointFile::Progress> CheckpointFile::write_slice(WorldSource& source) {
  if (ended_) return Progress::written;
  if (next_geometry_ < head_.geometries.size()) {
    const LoggedGeometry& geometry = head_.geometries[next_geometry_++];
    chunk_.resize(sizeof(ChunkHeader) + stored_geometry_bytes(geometry));
    ByteWriter writer{std::span(chunk_).subspan(sizeof(ChunkHeader))};
    put_geometry(writer, geometry);
    if (auto fault = write_chunk(ChunkKind::geometry, 1)) return *fault;
    return Progress::more;
  }
  if (next_material_ < head_.materials.size())
    return write_definition(ChunkKind::material, head_.materials[next_material_++]);
  if (next_light_ < head_.lights.size())
    return write_definition(ChunkKind::light, head_.lights[next_light_++]);
  if (next_index_ < head_.index_limit) return write_rows(source);
  if (next_shape_ < head_.geometries.size()) return write_shape(source);
  chunk_.resize(sizeof(ChunkHeader));
  if (auto fault = write_chunk(ChunkKind::end, 0)) return *fault;
  ended_ = true;
  return Progress::written;
}

template <class Value>
DiskResult<CheckpointFile::Progress> CheckpointFile::write_definition(
    ChunkKind kind, const LoggedDefinition<Value>& definition) {
  chunk_.resize(sizeof(ChunkHeader) + stored_definition_bytes(definition));
  ByteWriter writer{std::span(chunk_).subspan(sizeof(ChunkHeader))};
  put_definition(writer, definition);
  if (auto fault = write_chunk(kind, 1)) return *fault;
  return Progress::more;
}

DiskResult<CheckpointFile::Progress> CheckpointFile::write_rows(WorldSource& source) {
  const std::uint32_t count = std::min(begin_.rows_per_slice, head_.index_limit - next_index_);
  states_.assign(count, {});
  if (!source.rows(next_index_, states_)) return Progress::not_kept;
  chunk_.resize(sizeof(ChunkHeader) + count * (sizeof(StoredIndex) + row_bytes));
  ByteWriter writer{std::span(chunk_).subspan(sizeof(ChunkHeader))};
  for (const EntityState& state : states_) {
    const bool lives = state.id.valid();
    writer.put(StoredIndex{state.id.generation, lives ? 1u : 0u, lives ? state.written_by : 0,
                           lives ? state.row.geometry.index : 0, 0});
    if (lives) put_row(writer, state.row);
  }
  chunk_.resize(sizeof(ChunkHeader) + writer.count());
  if (auto fault = write_chunk(ChunkKind::rows, count)) return *fault;
  next_index_ += count;
  return Progress::more;
}

DiskResult<CheckpointFile::Progress> CheckpointFile::write_shape(WorldSource& source) {
  const LoggedGeometry& geometry = head_.geometries[next_shape_++];
  if (!geometry.options.deforms) return Progress::more;
  if (!source.shape(geometry.id, shape_)) return Progress::not_kept;
  if (shape_.version == 0) return Progress::more;  // the shape is that of the geometry file
  chunk_.resize(sizeof(ChunkHeader) + sizeof(std::uint64_t) + shape_bytes(shape_.positions_m.size()));
  ByteWriter writer{std::span(chunk_).subspan(sizeof(ChunkHeader))};
  writer.put(std::uint64_t{shape_.version});
  put_shape(writer, geometry.id, shape_.positions_m);
  if (auto fault = write_chunk(ChunkKind::shape, 1)) return *fault;
  return Progress::more;
}

DiskFault CheckpointFile::publish() {
  RTSTDB_ASSERT(ended_ && !published_, "the checkpoint is not complete, or was published already");
  if (auto fault = file_->sync()) return fault;
  if (auto fault = disk_.rename(unfinished_checkpoint_name(begin_.number), checkpoint_name(begin_.number)))
    return fault;
  published_ = true;
  return disk_.sync_directory();
}

}  // namespace rtstdb::log
