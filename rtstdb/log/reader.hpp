#pragma once
// Reads all records of a log from a position on, in order, and checks each one before it is passed on.
// Nothing in the directory is changed.
//
// What follows the last valid group decides how the log ended:
//   end of data  only zeros
//   torn         bytes that are no valid group, and no valid group after them: an incomplete write, which is
//                cut off
//   damaged      a valid group after invalid bytes; or a last segment that is shorter than its allocated
//                length and has no closing group, since a crash does not shorten a file
// A damaged log is refused unless it is salvaged.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <rtstdb/result.hpp>

#include "rtstdb/log/disk.hpp"
#include "rtstdb/log/format.hpp"
#include "rtstdb/log/position.hpp"
#include "rtstdb/log/record.hpp"

namespace rtstdb::log {

/// The place of a record.
struct RecordPlace {
  std::uint64_t segment = 0;
  std::uint64_t offset = 0;  ///< of the record's group
  const GroupHeader* group = nullptr;
};

class RecordVisitor {
 public:
  virtual ~RecordVisitor() = default;
  /// Receives the next record, which it may modify. Returns what is wrong with it after the records before
  /// it, or null to continue.
  virtual const char* record(Record& record, const RecordPlace& place) = 0;
  /// Whether to stop reading. Called after each record.
  virtual bool is_done() const { return false; }
};

enum class LogEnd : std::uint8_t {
  closed,       ///< with a closing group
  end_of_data,  ///< nothing follows the last group
  torn,         ///< an incomplete write follows the last group
  stopped,      ///< by the visitor
  damaged,      ///< only with salvage: see `damage`
};
const char* to_string(LogEnd end) noexcept;

struct ReadReport {
  LogEnd end = LogEnd::end_of_data;
  std::uint64_t segments = 0, groups = 0, records = 0, bytes = 0;
  std::uint64_t database_id = 0;  ///< 0: unknown
  std::string damage;

  // Torn: what is cut off.
  std::string cut_file;
  std::uint64_t cut_offset = 0, cut_bytes = 0;
  std::string cut_why;

  /// Position of the next group. A closing group does not count.
  Position next;
  /// The last group read, if any. Only this one may not be on disk yet.
  std::optional<Position> last;
  std::uint64_t last_bytes = 0;
};

struct ReadOptions {
  std::uint64_t database_id = 0;  ///< 0: that of the segments
  Position from;
  /// World time of the latest version of the initial world, for omitted world times (same_world_time).
  /// The world may be newer than the position; then records of versions that it already contains may be
  /// decoded with a wrong time.
  std::optional<WorldTime> previous_time{};
  bool salvage = false;
};

/// `segments`: the numbers of all segments, ascending. Errors: file, for damage (with file, offset, group,
/// versions and fault), and those of find_chain.
Result<ReadReport> read_log(Disk& disk, const std::vector<std::uint64_t>& segments,
                            const ReadOptions& options, RecordVisitor& visitor);

}  // namespace rtstdb::log
