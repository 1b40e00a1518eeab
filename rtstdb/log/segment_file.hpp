#pragma once
// Writes a segment.

#include <memory>
#include <span>

#include "rtstdb/log/disk.hpp"
#include "rtstdb/log/format.hpp"

namespace rtstdb::log {

class SegmentFile {
 public:
  struct Begin {
    std::uint64_t database_id = 0;
    std::uint64_t number = 0;
    std::uint64_t first_group = 0;
    std::uint64_t link = 0;
    std::uint64_t version_before = 0;
  };
  /// Creates a segment and brings its header, its first groups (whole sectors, or none) and its name to disk.
  /// It gets its final name last, so that a reader never continues in an incomplete segment. `bytes` are
  /// allocated ahead; if the disk has no space for them, nothing is allocated and the segment grows with each
  /// write. After a fault, the file is removed if possible.
  static DiskResult<std::unique_ptr<SegmentFile>> create(Disk& disk, const Begin& begin,
                                                         std::span<const std::byte> first_groups,
                                                         std::uint64_t bytes);

  std::uint64_t number() const noexcept { return number_; }
  /// Offset of the next group.
  std::uint64_t offset() const noexcept { return offset_; }
  /// Writes a group (whole sectors) and brings it to disk. After a fault, nothing more may be written to this
  /// segment.
  DiskFault append(std::span<const std::byte> group);

 private:
  SegmentFile(std::unique_ptr<DiskFile> file, std::uint64_t number, std::uint64_t offset)
      : file_(std::move(file)), number_(number), offset_(offset) {}

  std::unique_ptr<DiskFile> file_;
  std::uint64_t number_;
  std::uint64_t offset_;
};

}  // namespace rtstdb::log
