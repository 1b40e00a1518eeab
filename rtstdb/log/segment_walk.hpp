#pragma once
// Parses the bytes of one segment group by group, and classifies bytes that are no valid group.

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "rtstdb/log/format.hpp"

namespace rtstdb::log {

class SegmentWalk {
 public:
  /// `bytes`: the whole file.
  SegmentWalk(std::span<const std::byte> bytes, std::uint64_t database_id)
      : bytes_(bytes), database_id_(database_id) {}

  std::uint64_t bytes() const noexcept { return bytes_.size(); }

  struct Expected {
    std::uint64_t offset = sector_bytes;
    std::uint64_t number = 1;
    std::uint64_t link = 0;
  };
  struct Found {
    GroupHeader header;
    std::span<const std::byte> payload;
  };
  /// The expected group; none: `fault` describes what is there instead.
  std::optional<Found> group_at(const Expected& expected, const char*& fault) const noexcept;

  /// The first valid group header of this database at or after `offset` whose number is at least `number`.
  struct Later {
    std::uint64_t offset = 0;
    GroupHeader header;
  };
  std::optional<Later> later_group(std::uint64_t offset, std::uint64_t number) const noexcept;

  /// Number of bytes from `offset` to the last byte that is not zero; 0: there is none.
  std::uint64_t bytes_in_use_from(std::uint64_t offset) const noexcept;

 private:
  bool header_at(std::uint64_t offset, GroupHeader& header) const noexcept;

  std::span<const std::byte> bytes_;
  std::uint64_t database_id_;
};

/// Bytes that a group occupies in its segment.
constexpr std::uint64_t group_bytes(const GroupHeader& header) {
  return round_up(sizeof(GroupHeader) + header.payload_bytes, sector_bytes);
}

}  // namespace rtstdb::log
