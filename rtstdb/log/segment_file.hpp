#pragma once
// A segment while it is written.

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
  /// With its header, its first groups (whole sectors, or nothing) and its name on disk; it has its name when
  /// the rest is there, so that nobody reads on in it before that. `bytes` are allocated ahead; where the
  /// disk has no space for them nothing is, and the segment grows with each write. What was begun before a
  /// fault is removed where that can be done.
  static DiskResult<std::unique_ptr<SegmentFile>> create(Disk& disk, const Begin& begin,
                                                         std::span<const std::byte> first_groups,
                                                         std::uint64_t bytes);

  std::uint64_t number() const noexcept { return number_; }
  /// Where the next group goes.
  std::uint64_t offset() const noexcept { return offset_; }
  /// Whole sectors, on disk where there is no fault. After one nothing more is written here.
  DiskFault append(std::span<const std::byte> group);

 private:
  SegmentFile(std::unique_ptr<DiskFile> file, std::uint64_t number, std::uint64_t offset)
      : file_(std::move(file)), number_(number), offset_(offset) {}

  std::unique_ptr<DiskFile> file_;
  std::uint64_t number_;
  std::uint64_t offset_;
};

}  // namespace rtstdb::log
