#include "rtstdb/log/segment_walk.hpp"

#include "rtstdb/log/bytes.hpp"

namespace rtstdb::log {

bool SegmentWalk::header_at(std::uint64_t offset, GroupHeader& header) const noexcept {
  if (offset > bytes_.size() || !ByteReader(bytes_.subspan(offset)).get(header)) return false;
  return header.magic == group_magic && header.checksum == header_checksum(header, database_id_);
}

std::optional<SegmentWalk::Found> SegmentWalk::group_at(const Expected& expected,
                                                        const char*& fault) const noexcept {
  Found found;
  GroupHeader& header = found.header;
  if (!header_at(expected.offset, header)) {
    fault = "there is no valid group header";
    return std::nullopt;
  }
  if (header.number != expected.number || header.link != expected.link) {
    fault = "the group there does not follow the one before it";
    return std::nullopt;
  }
  const auto after_header = bytes_.subspan(expected.offset + sizeof header);
  const bool closing_has_records = header.flags == closing_flag && header.payload_bytes != 0;
  if (header.flags > closing_flag || closing_has_records || header.payload_bytes > max_payload_bytes) {
    fault = "its header has invalid values";
    return std::nullopt;
  }
  if (header.payload_bytes > after_header.size()) {
    fault = "its records extend beyond the end of the file";
    return std::nullopt;
  }
  found.payload = after_header.first(header.payload_bytes);
  if (checksum(found.payload, database_id_) != header.payload_checksum) {
    fault = "the checksum of its records is not that in its header";
    return std::nullopt;
  }
  return found;
}

std::optional<SegmentWalk::Later> SegmentWalk::later_group(std::uint64_t offset,
                                                           std::uint64_t number) const noexcept {
  for (offset = round_up(offset, sector_bytes); offset < bytes_.size(); offset += sector_bytes) {
    Later later{offset, {}};
    if (header_at(offset, later.header) && later.header.number >= number) return later;
  }
  return std::nullopt;
}

std::uint64_t SegmentWalk::bytes_in_use_from(std::uint64_t offset) const noexcept {
  std::uint64_t end = bytes_.size();
  while (end > offset && bytes_[end - 1] == std::byte{0})
    --end;
  return end > offset ? end - offset : 0;
}

}  // namespace rtstdb::log
