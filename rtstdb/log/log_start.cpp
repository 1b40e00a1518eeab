#include "rtstdb/log/log_start.hpp"

#include <algorithm>
#include <iterator>

namespace rtstdb::log {
namespace {

std::uint64_t next_number(const std::vector<std::uint64_t>& numbers) {
  return numbers.empty() ? 1 : numbers.back() + 1;
}

}  // namespace

LogStart start_after(const Recovered& recovered, std::uint64_t new_database_id) {
  const RecoveryReport& report = recovered.report;
  LogStart start;
  start.database_id = report.database_id != 0 ? report.database_id : new_database_id;
  start.next_segment =
      std::max(next_number(recovered.listing.segments), next_number(recovered.listing.unfinished_segments));
  start.next_checkpoint = std::max({next_number(recovered.listing.checkpoints),
                                    next_number(recovered.listing.unfinished_checkpoints),
                                    next_number(recovered.listing.abandoned_checkpoints)});
  if (report.log.end == LogEnd::damaged)
    std::ranges::copy_if(recovered.listing.checkpoints, std::back_inserter(start.abandoned_checkpoints),
                         [&](std::uint64_t number) { return number > report.checkpoint; });
  start.next = report.log.next;
  start.last = report.log.last;
  start.last_bytes = report.log.last_bytes;
  start.version = recovered.world.latest.version;
  start.newest_version = recovered.world.next_version - 1;

  start.added = {recovered.world.geometries.size(), recovered.world.materials.size(),
                 recovered.world.lights.size()};
  start.version_of_groups = report.version_of_groups;
  start.replayed_bytes = report.log.bytes;
  return start;
}

}  // namespace rtstdb::log
