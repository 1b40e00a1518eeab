#pragma once
// What lies in the directory of a database with a log (durability.hpp): which files there are, whether all of them are whole, and what
// they tell, commit by commit. For looking on from outside: no device is needed, nothing in the directory is changed, and a
// database may be writing there meanwhile.
//
// Threads: setup. All of it reads files, allocates and blocks.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <rtstdb/entity.hpp>
#include <rtstdb/geometry.hpp>
#include <rtstdb/history.hpp>
#include <rtstdb/result.hpp>

namespace rtstdb {

/// Abandoned: a checkpoint of a course that a salvage has left.
enum class LogFileKind : std::uint8_t { segment, checkpoint, geometry, unfinished, abandoned };
const char* to_string(LogFileKind kind) noexcept;

struct LogFile {
  std::string name{};
  LogFileKind kind = LogFileKind::segment;
  std::uint64_t bytes = 0;
  /// Segment: of the commits that stand in it and could be read; checkpoint: its own. 0: none.
  Version first = 0, last = 0;
  /// What is worth knowing and no fault: of a geometry its name, of an unfinished file why it is there.
  std::string note{};
  /// What is wrong with it, with the place; empty: nothing.
  std::string damage{};
};

struct LogContents {
  std::uint64_t database_id = 0;
  std::uint32_t format = 0;
  std::vector<LogFile> files{};  ///< by kind, then by number
  /// `damage` is that of the groups of commits alone.
  HistoryExtent extent{};
  std::uint64_t groups = 0;  ///< that were read
  std::uint64_t bytes = 0;   ///< of them
  /// Recorded behind a gap, where no world is known to add them to; not among extent.commits.
  std::uint64_t unresolved_commits = 0;
  std::uint64_t row_writes = 0;  ///< of commits that stand, as the next
  std::uint64_t shape_writes = 0;
  std::uint64_t entities = 0;              ///< that live in the last version
  std::uint64_t compared_checkpoints = 0;  ///< with the world that the commits before them lead to
  /// What was being written when the log ended, and is cut off by the next open; empty: nothing.
  std::string torn{};
  /// Everything that is wrong, each with its file; empty: the log is whole.
  std::vector<std::string> damage{};
  /// Whether a database would open here without salvage, and the version that it would go on from; else why not, and whether it
  /// would by salvage.
  bool opens = false;
  Version opens_at = 0;
  std::string refusal{};
  bool opens_by_salvage = false;
};

/// Reads every byte that counts: checksums, the chain of groups, each commit held to the world before it, each checkpoint to the world
/// that the commits lead to. What is damaged is told in the contents. Errors: file for a directory without a database's log, or
/// one that can not be read; out_of_memory.
Result<LogContents> inspect_log(const std::filesystem::path& directory);

/// As in a transaction. `state` is the entity as this write leaves it, which others of the commit may follow; of a remove, `state.id` alone means
/// something.
struct LogWrite {
  enum class Kind : std::uint8_t { create, update, update_motion, remove };
  Kind kind = Kind::create;
  EntityState state{};
};
const char* to_string(LogWrite::Kind kind) noexcept;

/// The corners of a geometry that deforms, from this version on.
struct LogShape {
  GeometryId geometry{};
  std::span<const glm::vec3> positions_m{};
};

/// Told in the order of versions; what is passed belongs to the caller.
class LogListener {
 public:
  virtual ~LogListener() = default;
  /// What the log begins with, and what it goes on with behind a gap: all geometries (as geometry) come first, then this. Entities by
  /// ascending index.
  virtual void world(const VersionInfo& at, std::span<const EntityState> entities) = 0;
  /// `mesh` as it stands then.
  virtual void geometry(GeometryId id, std::string_view name, const GeometryOptions& options,
                        const TriangleMesh& mesh) = 0;
  virtual void commit(const VersionInfo& version, std::span<const LogWrite> writes,
                      std::span<const LogShape> shapes) = 0;
  /// These were not recorded; up to the next `world`, or to the end, nothing can be said of the world.
  virtual void gap(Version first, Version last) = 0;
  /// Behind a gap, before the next `world`: from `first` to `last` so many commits were recorded, and there is no world to add them to.
  virtual void unresolved(Version first, Version last, std::uint64_t commits) = 0;
};

/// Salvage: of a damaged log what comes before the damage, which is the answer, in words; else that is empty. Errors: file, as
/// inspect_log, and for damage without salvage; what came before it has been told by then. out_of_memory.
Result<std::string> read_log(const std::filesystem::path& directory, LogListener& listener,
                             bool salvage = false);

}  // namespace rtstdb
