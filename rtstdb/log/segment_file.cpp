#include "rtstdb/log/segment_file.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <limits>

#include <rtstdb/result.hpp>

#include "rtstdb/log/bytes.hpp"
#include "rtstdb/log/directory.hpp"

namespace rtstdb::log {
namespace {

std::uint32_t sectors_of(std::uint64_t bytes) {
  const std::uint64_t sectors = bytes / sector_bytes;
  return sectors <= std::numeric_limits<std::uint32_t>::max() ? static_cast<std::uint32_t>(sectors) : 0;
}

bool is_no_space(const DiskError& fault) {
  return fault.number == ENOSPC || fault.number == EDQUOT;
}

/// A new file with `bytes` allocated ahead. Where the disk has no space for them, a file without them, and
/// `bytes` becomes 0.
DiskResult<std::unique_ptr<DiskFile>> create_file(Disk& disk, const std::string& name, std::uint64_t& bytes) {
  auto file = disk.create(name);
  if (!file) return file.error();
  auto fault = file.value()->preallocate(bytes);
  if (!fault) return file;
  disk.remove(name);  // frees what was allocated
  if (!is_no_space(*fault)) return *fault;
  bytes = 0;
  return disk.create(name);
}

DiskFault write_begin(DiskFile& file, SegmentHeader header, std::span<const std::byte> first_groups,
                      std::uint64_t bytes) {
  header.allocated_sectors = sectors_of(bytes);
  header.checksum = header_checksum(header, header.database_id);
  std::array<std::byte, sector_bytes> sector{};
  std::memcpy(sector.data(), &header, sizeof header);
  if (auto fault = file.write(0, sector)) return fault;
  if (!first_groups.empty()) {
    if (auto fault = file.write(sector_bytes, first_groups)) return fault;
  }
  return file.sync();
}

}  // namespace

DiskResult<std::unique_ptr<SegmentFile>> SegmentFile::create(Disk& disk, const Begin& begin,
                                                             std::span<const std::byte> first_groups,
                                                             std::uint64_t bytes) {
  RTSTDB_ASSERT(first_groups.size() % sector_bytes == 0, "the groups are not whole sectors");
  SegmentHeader header;
  header.database_id = begin.database_id;
  header.number = begin.number;
  header.first_group = begin.first_group;
  header.link = begin.link;
  header.version_before = begin.version_before;

  const std::string unfinished = unfinished_segment_name(begin.number);
  const std::string name = segment_name(begin.number);
  auto file = create_file(disk, unfinished, bytes);
  if (!file) return file.error();
  if (auto fault = write_begin(*file.value(), header, first_groups, bytes)) {
    disk.remove(unfinished);
    return *fault;
  }
  if (auto fault = disk.rename(unfinished, name)) {
    disk.remove(unfinished);
    return *fault;
  }
  if (auto fault = disk.sync_directory()) {
    disk.remove(name);  // if that fails, a later segment replaces its groups
    return *fault;
  }
  return std::unique_ptr<SegmentFile>(
      new SegmentFile(std::move(file.value()), begin.number, sector_bytes + first_groups.size()));
}

DiskFault SegmentFile::append(std::span<const std::byte> group) {
  RTSTDB_ASSERT(group.size() % sector_bytes == 0, "the group is not whole sectors");
  auto fault = file_->write(offset_, group);
  if (!fault) fault = file_->sync();
  if (fault) {
    fault->file = segment_name(number_);  // the file was opened under another name
    return fault;
  }
  offset_ += group.size();
  return std::nullopt;
}

}  // namespace rtstdb::log
