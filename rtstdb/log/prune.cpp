#include "rtstdb/log/prune.hpp"

#include "rtstdb/log/checkpoint_reader.hpp"
#include "rtstdb/log/directory.hpp"

namespace rtstdb::log {

DiskResult<std::uint64_t> prune_log(Disk& disk) {
  auto listing = list_log(disk);
  if (!listing) return listing.error();
  const auto& checkpoints = listing.value().checkpoints;
  if (checkpoints.size() < 2) return std::uint64_t{0};
  const auto oldest_kept = checkpoints.end() - 2;
  const auto header = read_checkpoint_header(disk, *oldest_kept);
  if (!header || !read_checkpoint_header(disk, checkpoints.back())) return std::uint64_t{0};

  for (auto number = checkpoints.begin(); number != oldest_kept; ++number)
    if (auto fault = disk.remove(checkpoint_name(*number))) return *fault;
  // A checkpoint without its segment is damage: the removal of the checkpoints is durable before segments go.
  if (oldest_kept != checkpoints.begin())
    if (auto fault = disk.sync_directory()) return *fault;
  // A later segment may repeat the first group of an earlier one. Removals become durable one by one, oldest
  // first, so that a crash never leaves an earlier segment without the later one that replaces its groups.
  std::uint64_t removed = 0;
  for (const std::uint64_t number : listing.value().segments) {
    if (number >= header.value().segment) break;
    if (auto fault = disk.remove(segment_name(number))) return *fault;
    if (auto fault = disk.sync_directory()) return *fault;
    ++removed;
  }
  return removed;
}

}  // namespace rtstdb::log
