#pragma once
// The group that is written next: collects records, adds the header, and keeps both until they are on disk.
//
// Allocates only in the constructor.

#include <cstddef>
#include <cstdint>
#include <span>

#include <rtstdb/transaction.hpp>

#include "rtstdb/log/added_counts.hpp"
#include "rtstdb/log/format.hpp"
#include "rtstdb/log/page_buffer.hpp"

namespace rtstdb::log {

class Group {
 public:
  explicit Group(std::size_t payload_space);

  bool empty() const noexcept { return payload_bytes_ == 0 && !closing_; }
  std::size_t space() const noexcept;
  /// Appends records, starting with the first, as long as there is room; returns the number of bytes taken. A
  /// gap record is always the first of its group, so that all versions before the gap are in earlier groups.
  std::size_t take(std::span<const std::byte> records) noexcept;
  /// Makes it the closing group, which has no records.
  void make_closing() noexcept { closing_ = true; }
  void clear() noexcept;

  struct Place {
    std::uint64_t database_id = 0;
    std::uint64_t number = 0;
    std::uint64_t link = 0;
  };
  /// Completes the header; returns header, records and zeros up to a whole sector.
  std::span<const std::byte> seal(const Place& place, std::int64_t real_time_ns) noexcept;
  /// The link of the next group. After seal.
  std::uint64_t next_link() const noexcept { return header_.checksum; }

  std::uint32_t records() const noexcept { return header_.records; }
  /// The newest version in this group, including versions discarded and versions in gaps; 0: none.
  Version newest_version() const noexcept { return newest_version_; }
  /// The last version of the last gap in this group; 0: no gap.
  Version gap_to() const noexcept { return gap_to_; }
  /// The newest version in this and all earlier groups that was not discarded; that of `begin_at` if there
  /// is none.
  Version newest_valid() const noexcept { return valid_; }
  /// What this and all earlier groups add.
  const AddedCounts& added() const noexcept { return added_; }
  void begin_at(Version version, const AddedCounts& added) noexcept {
    valid_ = valid_before_ = version;
    added_ = added;
  }

 private:
  void note(RecordKind kind, std::span<const std::byte> body) noexcept;
  void note_commit(Version version) noexcept;

  PageBuffer pages_;
  std::span<std::byte> bytes_;  // starts with room for the header
  std::size_t payload_bytes_ = 0;
  GroupHeader header_;
  bool closing_ = false;
  Version newest_version_ = 0, gap_to_ = 0;
  Version valid_ = 0, valid_before_ = 0;
  AddedCounts added_;
};

}  // namespace rtstdb::log
