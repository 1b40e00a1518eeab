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
  std::uint64_t removed = 0;
  for (const std::uint64_t number : listing.value().segments) {
    if (number >= header.value().segment) break;
    if (auto fault = disk.remove(segment_name(number))) return *fault;
    // Once the removal of the first segment is durable, a log begins with a checkpoint, whichever of the
    // other segments a crash leaves.
    if (++removed > 1) continue;
    if (auto fault = disk.sync_directory()) return *fault;
  }
  return removed;
}

}  // namespace rtstdb::log
