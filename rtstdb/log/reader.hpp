#pragma once
// All records of a log from a position on, in order, each checked before it is given away. It changes nothing in the directory.
//
// Where whole groups end, what comes next tells what happened: nothing, the end of data; bytes that make no
// group and no whole group behind them, a tear, which is cut; a whole group behind them, damage. A last
// segment that is shorter than its allocated length and has no closing group is damage, too, since a crash
// does not shorten a file. A log that is damaged is refused, unless it is read to be salvaged.

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

/// Where a record was found.
struct RecordPlace {
  std::uint64_t segment = 0;
  std::uint64_t offset = 0;  ///< of its group
  const GroupHeader* group = nullptr;
};

class RecordVisitor {
 public:
  virtual ~RecordVisitor() = default;
  /// What is wrong with it after those before it, or null: then the next one follows. It may be changed.
  virtual const char* record(Record& record, const RecordPlace& place) = 0;
  /// Asked after each record.
  virtual bool enough() const { return false; }
};

enum class LogEnd : std::uint8_t {
  closed,       ///< by a closing group
  end_of_data,  ///< nothing behind the last group
  torn,         ///< behind the last group something that was being written
  stopped,      ///< the visitor had enough
  damaged,      ///< salvage alone: see `damage`
};
const char* to_string(LogEnd end) noexcept;

struct ReadReport {
  LogEnd end = LogEnd::end_of_data;
  std::uint64_t segments = 0, groups = 0, records = 0, bytes = 0;
  std::uint64_t database_id = 0;  ///< 0: nothing tells
  std::uint32_t format = 0;       ///< the newest of its segments; 0: there is none
  std::string damage;

  // Torn: what was cut.
  std::string cut_file;
  std::uint64_t cut_offset = 0, cut_bytes = 0;
  std::string cut_why;

  /// Where the log goes on: the group that would follow. A closing group is not counted, and would be followed by none.
  Position next;
  /// The last group that was read, where one was: it alone may not be on disk yet.
  std::optional<Position> last;
  std::uint64_t last_bytes = 0;
};

struct ReadOptions {
  std::uint64_t database_id = 0;  ///< 0: the segments' own
  Position from;
  /// Of the world that the reading begins with, which need not be the one that the position leads to: what is told of versions that
  /// the world has already may have a wrong time then.
  std::optional<WorldTime> time_before{};
  bool salvage = false;
};

/// `segments`: numbers of all there are, ascending. Refuses, as ErrorCode::file: damage with file, offset, group, versions and
/// what was found; what find_chain refuses.
Result<ReadReport> read_log(Disk& disk, const std::vector<std::uint64_t>& segments,
                            const ReadOptions& options, RecordVisitor& visitor);

}  // namespace rtstdb::log
