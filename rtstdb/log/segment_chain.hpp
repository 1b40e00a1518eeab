#pragma once
// Determines the segments that a log is read from, in order, and the groups that are valid in each.

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <rtstdb/result.hpp>

#include "rtstdb/log/disk.hpp"
#include "rtstdb/log/format.hpp"
#include "rtstdb/log/position.hpp"

namespace rtstdb::log {

inline constexpr std::uint64_t no_limit = std::numeric_limits<std::uint64_t>::max();

struct SegmentChain {
  struct Link {
    SegmentHeader header;
    std::uint64_t end_group = no_limit;  ///< groups from here on are in the next link
  };
  std::vector<Link> links;
  std::uint64_t database_id = 0;  ///< 0: no segment has a readable header
  // Empty: none.
  std::string damage_before;  ///< why the log cannot be read from the position on
  std::string damage_after;   ///< damage of a segment that is newer than all links
};

/// The id in the oldest segment with a readable header; 0: there is none.
Result<std::uint64_t> database_id_of(Disk& disk, const std::vector<std::uint64_t>& segments);

/// The chain for reading from position `from` on. Errors: file, for a segment of another database
/// (`database_id` 0: that of the segments), an unknown format, and a read error.
Result<SegmentChain> find_chain(Disk& disk, const std::vector<std::uint64_t>& segments,
                                std::uint64_t database_id, const Position& from);

}  // namespace rtstdb::log
