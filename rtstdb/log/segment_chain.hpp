#pragma once
// Which segments of a directory a log is read from, in order, and which groups count in each.

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
    std::uint64_t end_group = no_limit;  ///< groups from here on are those of the next link
  };
  std::vector<Link> links;
  std::uint64_t database_id = 0;  ///< 0: no segment tells
  // Empty where there is none.
  std::string damage_before;  ///< why nothing can be read from the position on
  std::string damage_behind;  ///< of a segment that is newer than all links
};

/// What the oldest segment with a header says; 0: there is none.
Result<std::uint64_t> database_id_of(Disk& disk, const std::vector<std::uint64_t>& segments);

/// The chain for reading from `from` on. Refused, as ErrorCode::file: a segment of another database (`database_id` 0: the
/// segments' own), an unknown format, a disk that does not read.
Result<SegmentChain> find_chain(Disk& disk, const std::vector<std::uint64_t>& segments,
                                std::uint64_t database_id, const Position& from);

}  // namespace rtstdb::log
