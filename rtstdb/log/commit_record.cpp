#include "rtstdb/log/commit_record.hpp"

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/row_check.hpp"
#include "rtstdb/log/bytes.hpp"
#include "rtstdb/log/stored_row.hpp"
#include "rtstdb/log/stored_shape.hpp"

namespace rtstdb::log {
namespace {

using store::Write;
using store::WriteKind;

constexpr std::uint32_t follows_shift = 16;       // in StoredWrite::what
constexpr std::uint32_t move_follows_shift = 48;  // in MoveBody::version
static_assert(max_move_version == (std::uint64_t{1} << move_follows_shift) - 1);

std::int64_t in_ns(WorldTime time) noexcept {
  return time.time_since_epoch().count();
}

// ---- omitted words of a motion

std::uint16_t omitted_words_of(const Write& write, WorldTime world_time) noexcept {
  const std::uint16_t with_it = write.unchanged | valid_from_is_world_time;
  const bool as_before = (write.unchanged & valid_from_word) != 0;
  return !as_before && write.state.row.motion.valid_from == world_time ? with_it : write.unchanged;
}

/// The low bits of the version of the base row; 0 if no word depends on it.
std::uint16_t base_version_bits(const Write& write) noexcept {
  return write.unchanged == 0 ? std::uint16_t{0} : write.base_version_low;
}

const char* get_motion_write(ByteReader& reader, std::uint16_t omitted_words, std::uint16_t base_version_low,
                             WorldTime world_time, Write& write) noexcept {
  write.unchanged = omitted_words & unchanged_words;
  write.base_version_low = base_version_low;
  if (write.unchanged == 0 && base_version_low != 0) return "a motion has a base version and omits no word";
  Motion& motion = write.state.row.motion;
  if (const char* fault = get_partial_motion(reader, omitted_words, world_time, motion)) return fault;
  return write.unchanged == 0 ? check_stored(motion) : nullptr;
}

// ---- writes

std::size_t write_bytes(WriteKind kind, std::uint16_t omitted_words) noexcept {
  switch (kind) {
    case WriteKind::create:
    case WriteKind::update:
      return sizeof(StoredWrite) + row_bytes;
    case WriteKind::update_motion:
      return sizeof(StoredWrite) + partial_motion_bytes(omitted_words);
    case WriteKind::remove:
      break;
  }
  return sizeof(StoredWrite);
}

/// `omitted_words(write)`: the omitted words of a write.
template <class LeftOut>
std::size_t bytes_of(const store::WriteSet& set, LeftOut omitted_words) noexcept {
  std::size_t bytes = sizeof(RecordHeader) + sizeof(CommitBody);
  for (const Write& write : set.writes)
    bytes += write_bytes(write.kind, omitted_words(write));
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

void put_write(ByteWriter& writer, const Write& write, WorldTime world_time) noexcept {
  const bool whole = write.kind == WriteKind::create || write.kind == WriteKind::update;
  const bool moves = write.kind == WriteKind::update_motion;
  const EntityState& state = write.state;
  const std::uint16_t omitted_words = moves ? omitted_words_of(write, world_time) : std::uint16_t{0};
  const std::uint32_t what = whole ? state.row.geometry.index
                             : moves
                                 ? omitted_words | std::uint32_t{base_version_bits(write)} << follows_shift
                                 : 0;
  writer.put(stored(write.kind), state.id.index, state.id.generation, what);  // a StoredWrite
  if (whole) put_row(writer, state.row);
  if (moves) put_partial_motion(writer, state.row.motion, omitted_words);
}

const char* get_write(ByteReader& reader, Version version, WorldTime world_time, Write& write) noexcept {
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
      return "a write has an unknown kind";
  }
  const std::uint32_t what = stored_write.what;
  if (write.kind == WriteKind::create || write.kind == WriteKind::update) {
    write.state.row.geometry = {what};
    if (const char* fault = check_geometry_index(what)) return fault;
    return get_row(reader, write.state.row);
  }
  if (write.kind == WriteKind::update_motion)
    return get_motion_write(reader, static_cast<std::uint16_t>(what),
                            static_cast<std::uint16_t>(what >> follows_shift), world_time, write);
  return what == 0 ? nullptr : "a remove has a geometry";
}

bool is_move(const store::WriteSet& set) noexcept {
  return set.writes.size() == 1 && set.shapes.empty() && set.version <= max_move_version &&
         set.writes.front().kind == WriteKind::update_motion;
}

}  // namespace

CommitEncoding commit_record_encoding(const store::WriteSet& set) noexcept {
  return {.bytes = bytes_of(set, [&](const Write& write) { return omitted_words_of(write, set.time); })};
}

CommitEncoding encoding_of(const store::WriteSet& set,
                           const std::optional<WorldTime>& previous_time) noexcept {
  if (!is_move(set)) return commit_record_encoding(set);
  const std::uint16_t omitted_words = omitted_words_of(set.writes.front(), set.time);
  const std::size_t bytes = sizeof(RecordHeader) + sizeof(MoveBody) + partial_motion_bytes(omitted_words);
  if (previous_time == set.time)
    return {RecordKind::move, static_cast<std::uint16_t>(omitted_words | same_world_time), bytes};
  return {RecordKind::move, omitted_words, bytes + sizeof(std::int64_t)};
}

std::size_t max_commit_bytes(const store::WriteSet& set) noexcept {
  static_assert(sizeof(MoveBody) + sizeof(std::int64_t) <= sizeof(CommitBody) + sizeof(StoredWrite));
  return bytes_of(set, [](const Write&) { return std::uint16_t{0}; });
}

void encode_commit(const store::WriteSet& set, const CommitEncoding& form,
                   std::span<std::byte> space) noexcept {
  RTSTDB_ASSERT(space.size() == form.bytes && form.bytes <= max_record_bytes,
                "the space is not of the size of the record, or the record is above max_record_bytes");
  ByteWriter writer(space);
  // Headers and bodies are written member by member, for the reason given in put_motion.
  writer.put(form.kind, form.omitted_words, static_cast<std::uint32_t>(form.bytes));
  if (form.kind == RecordKind::move) {
    const Write& write = set.writes.front();
    const EntityId id = write.state.id;
    writer.put(set.version | std::uint64_t{base_version_bits(write)} << move_follows_shift, id.index,
               id.generation);
    if ((form.omitted_words & same_world_time) == 0) writer.put(in_ns(set.time));
    put_partial_motion(writer, write.state.row.motion, form.omitted_words & ~same_world_time);
  } else {
    writer.put(std::uint64_t{set.version}, in_ns(set.time), static_cast<std::uint32_t>(set.writes.size()),
               static_cast<std::uint32_t>(set.shapes.size()));
    for (const Write& write : set.writes)
      put_write(writer, write, set.time);
    for (const store::ShapeWrite& write : set.shapes)
      put_shape(writer, write.geometry, write.positions_m);
  }
  RTSTDB_ASSERT(writer.count() == space.size(), "the record does not fill its space");
}

const char* CommitDecoder::decode_commit(std::span<const std::byte> bytes, store::WriteSet& set) {
  ByteReader reader(bytes);
  CommitBody body;
  if (!reader.get(body)) return "a commit is cut short";
  if (body.version == 0) return "a commit has no version";
  if (const char* fault = check_time(body.world_time_ns)) return fault;
  if (body.writes == 0 && body.shapes == 0) return "a commit has no writes";
  if (body.writes > reader.left() / sizeof(StoredWrite) || body.shapes > reader.left() / sizeof(StoredShape))
    return "a commit has more writes than its length allows";

  set.version = body.version;
  set.time = world_time_ns(body.world_time_ns);
  previous_time_ = set.time;
  set.writes.resize(body.writes);
  for (Write& write : set.writes)
    if (const char* fault = get_write(reader, set.version, set.time, write)) return fault;
  set.shapes.clear();
  positions_m_.clear();
  for (std::uint32_t k = 0; k < body.shapes; ++k) {
    store::ShapeWrite shape;
    const std::size_t before = positions_m_.size();
    if (const char* fault = get_shape(reader, shape.geometry, positions_m_)) return fault;
    shape.given = shape.space = positions_m_.size() - before;
    set.shapes.push_back(shape);
  }
  if (reader.left() != 0) return "a commit has extra bytes";
  std::size_t first = 0;  // spans are set last, since positions_m_ may have reallocated
  for (store::ShapeWrite& shape : set.shapes) {
    shape.positions_m = std::span(positions_m_).subspan(first, shape.given);
    first += shape.given;
  }
  return nullptr;
}

const char* CommitDecoder::decode_move(std::uint16_t omitted_words, std::span<const std::byte> bytes,
                                       store::WriteSet& set) {
  ByteReader reader(bytes);
  MoveBody body;
  if (!reader.get(body)) return "a move is cut short";
  set.version = body.version & max_move_version;
  if (set.version == 0) return "a move has no version";
  if (body.index >= max_entities) return "an entity's index is beyond the limit";
  if ((omitted_words & same_world_time) == 0) {
    std::int64_t time_ns = 0;
    if (!reader.get(time_ns)) return "a move is cut short";
    if (const char* fault = check_time(time_ns)) return fault;
    previous_time_ = world_time_ns(time_ns);
  }
  if (!previous_time_) return "a move omits its world time, and the previous commit is unknown";
  set.time = *previous_time_;
  set.shapes.clear();
  set.writes.assign(1, Write(WriteKind::update_motion, {{body.index, body.generation}, {}, set.version}));
  const auto base_version_low = static_cast<std::uint16_t>(body.version >> move_follows_shift);
  const std::uint16_t of_motion = omitted_words & ~same_world_time;
  if (const char* fault = get_motion_write(reader, of_motion, base_version_low, set.time, set.writes.front()))
    return fault;
  return reader.left() == 0 ? nullptr : "a move has extra bytes";
}

}  // namespace rtstdb::log
