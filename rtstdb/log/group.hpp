#pragma once
// Records that go to the disk together: gathered, given their header, and kept until they are on disk for sure.
//
// Allocates in the constructor alone.

#include <cstddef>
#include <cstdint>
#include <span>

#include <rtstdb/transaction.hpp>

#include "rtstdb/log/format.hpp"
#include "rtstdb/log/whole_pages.hpp"

namespace rtstdb::log {

class Group {
 public:
  explicit Group(std::size_t payload_room);

  bool empty() const noexcept { return payload_bytes_ == 0 && !closing_; }
  std::size_t room() const noexcept;
  /// The longest run of whole records, from the first one on, that has room; so many bytes. A gap is the first record of its group, so
  /// that all before it are in groups that lead up to it.
  std::size_t take(std::span<const std::byte> records) noexcept;
  /// It says that nothing is to follow; it has no records.
  void make_closing() noexcept { closing_ = true; }
  void clear() noexcept;

  struct Place {
    std::uint64_t database_id = 0;
    std::uint64_t number = 0;
    std::uint64_t link = 0;
  };
  /// Header and records, and zeros to the next sector.
  std::span<const std::byte> seal(const Place& place, std::int64_t real_time_ns) noexcept;
  /// The link of the group after it, once it is sealed.
  std::uint64_t next_link() const noexcept { return header_.checksum; }

  std::uint32_t records() const noexcept { return header_.records; }
  /// The newest version that it tells of, taken back or missing ones too; 0: of none.
  Version newest_version() const noexcept { return newest_version_; }
  /// The end of the last gap that it tells of; 0: of none.
  Version gap_to() const noexcept { return gap_to_; }
  /// The newest version that was appended and not taken back, in groups that were cleared too; `begin_at` before any.
  Version newest_standing() const noexcept { return standing_; }
  /// So many geometries have been added, by groups that were cleared too.
  std::size_t geometries() const noexcept { return geometries_; }
  void begin_at(Version version, std::size_t geometries) noexcept {
    standing_ = standing_before_ = version;
    geometries_ = geometries;
  }

 private:
  void note(RecordKind kind, std::span<const std::byte> body) noexcept;
  void note_commit(Version version) noexcept;

  WholePages pages_;
  std::span<std::byte> bytes_;  // room for the header first
  std::size_t payload_bytes_ = 0;
  GroupHeader header_;
  bool closing_ = false;
  Version newest_version_ = 0, gap_to_ = 0;
  Version standing_ = 0, standing_before_ = 0;
  std::size_t geometries_ = 0;
};

}  // namespace rtstdb::log
