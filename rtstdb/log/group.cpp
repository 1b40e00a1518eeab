#include "rtstdb/log/group.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include <rtstdb/result.hpp>

#include "rtstdb/log/bytes.hpp"

namespace rtstdb::log {

Group::Group(std::size_t payload_space)
    : pages_(round_up(sizeof(GroupHeader) + payload_space, sector_bytes)), bytes_(pages_.bytes()) {
  RTSTDB_ASSERT(payload_space <= max_payload_bytes, "the space is above max_payload_bytes");
}

std::size_t Group::space() const noexcept {
  return bytes_.size() - sizeof(GroupHeader) - payload_bytes_;
}

std::size_t Group::take(std::span<const std::byte> records) noexcept {
  RTSTDB_ASSERT(!closing_, "the group takes no more records");
  // Copies all bytes first and parses the copy: parsing in the ring would wait for a cache line of the other
  // processor at each record.
  const auto copied = bytes_.subspan(sizeof(GroupHeader) + payload_bytes_, std::min(records.size(), space()));
  if (copied.empty()) return 0;
  std::memcpy(copied.data(), records.data(), copied.size());
  std::size_t taken = 0;
  while (copied.size() - taken >= sizeof(RecordHeader)) {
    RecordHeader record;
    std::memcpy(&record, copied.data() + taken, sizeof record);
    RTSTDB_ASSERT(record.bytes >= sizeof record && record.bytes <= records.size() - taken,
                  "a record has an impossible size");
    if (record.bytes > copied.size() - taken) break;
    if (record.kind == RecordKind::gap && header_.records != 0) break;
    note(record.kind, copied.subspan(taken + sizeof record, record.bytes - sizeof record));
    taken += record.bytes;
  }
  payload_bytes_ += taken;
  return taken;
}

void Group::note(RecordKind kind, std::span<const std::byte> body) noexcept {
  ++header_.records;
  ByteReader reader(body);
  if (kind == RecordKind::commit) {
    CommitBody commit;
    RTSTDB_ASSERT(reader.get(commit), "a commit record is too short");
    note_commit(commit.version);
  } else if (kind == RecordKind::move) {
    MoveBody move;
    RTSTDB_ASSERT(reader.get(move), "a move record is too short");
    note_commit(move.version & max_move_version);
  } else if (kind == RecordKind::discarded) {
    DiscardBody discarded;
    RTSTDB_ASSERT(reader.get(discarded), "a discard record is too short");
    newest_version_ = std::max(newest_version_, discarded.version);
    if (valid_ == discarded.version) valid_ = valid_before_;
  } else if (kind == RecordKind::gap) {
    GapBody gap;
    RTSTDB_ASSERT(reader.get(gap), "a gap record is too short");
    newest_version_ = gap_to_ = valid_ = valid_before_ = gap.to;
  } else if (kind == RecordKind::geometry) {
    StoredGeometry geometry;
    RTSTDB_ASSERT(reader.get(geometry), "a geometry record is too short");
    added_.geometries = std::max<std::size_t>(added_.geometries, std::size_t{geometry.index} + 1);
  } else if (kind == RecordKind::material) {
    StoredDefinition material;
    RTSTDB_ASSERT(reader.get(material), "a material record is too short");
    added_.materials = std::max<std::size_t>(added_.materials, material.index);
  } else if (kind == RecordKind::light) {
    StoredDefinition light;
    RTSTDB_ASSERT(reader.get(light), "a light record is too short");
    added_.lights = std::max<std::size_t>(added_.lights, std::size_t{light.index} + 1);
  }
}

void Group::note_commit(Version version) noexcept {
  if (header_.first_version == 0) header_.first_version = version;
  header_.last_version = newest_version_ = version;
  valid_before_ = std::exchange(valid_, version);
}

void Group::clear() noexcept {
  payload_bytes_ = 0;
  closing_ = false;
  newest_version_ = gap_to_ = 0;
  header_ = {};
}

std::span<const std::byte> Group::seal(const Place& place, std::int64_t real_time_ns) noexcept {
  const auto payload = bytes_.subspan(sizeof(GroupHeader), payload_bytes_);
  header_.flags = closing_ ? closing_flag : 0;
  header_.number = place.number;
  header_.payload_bytes = static_cast<std::uint32_t>(payload_bytes_);
  header_.real_time_ns = real_time_ns;
  header_.link = place.link;
  header_.payload_checksum = checksum(payload, place.database_id);
  header_.checksum = header_checksum(header_, place.database_id);
  std::memcpy(bytes_.data(), &header_, sizeof header_);
  const std::size_t end = sizeof header_ + payload_bytes_;
  const std::size_t padded = round_up(end, sector_bytes);
  std::memset(bytes_.data() + end, 0, padded - end);
  return bytes_.first(padded);
}

}  // namespace rtstdb::log
