#pragma once
// Inspection of the directory of a log (durability.hpp): which files there are, whether they are whole, and
// what they contain, commit by commit. No device is needed and nothing in the directory is changed; a
// database may be writing to it at the same time.
//
// Threads: setup. Both functions read files, allocate and block.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <rtstdb/entity.hpp>
#include <rtstdb/geometry.hpp>
#include <rtstdb/history.hpp>
#include <rtstdb/light.hpp>
#include <rtstdb/material.hpp>
#include <rtstdb/result.hpp>

namespace rtstdb {

/// unfinished: a file that was being written; abandoned: a checkpoint that a salvage set aside.
enum class LogFileKind : std::uint8_t { segment, checkpoint, geometry, unfinished, abandoned };
const char* to_string(LogFileKind kind) noexcept;

struct LogFile {
  std::string name{};
  LogFileKind kind = LogFileKind::segment;
  std::uint64_t bytes = 0;
  /// Segment: first and last version of its readable commits; checkpoint: its version, twice. 0: none.
  Version first = 0, last = 0;
  /// Information that is no fault: the name of a geometry, the reason for an unfinished file.
  std::string note{};
  /// A sentence on what is damaged, with its place in the file; empty: nothing.
  std::string damage{};
};

/// The result of an inspection.
struct LogContents {
  std::uint64_t database_id = 0;
  std::uint32_t format = 0;
  std::vector<LogFile> files{};  ///< by kind, then by number
  /// Here `extent.damage` covers the groups of commits only.
  HistoryExtent extent{};
  std::uint64_t groups = 0;  ///< number of readable groups
  std::uint64_t bytes = 0;   ///< of these groups
  /// Commits after a gap and before the next checkpoint: the world that they apply to is not known. Not
  /// included in extent.commits.
  std::uint64_t unresolved_commits = 0;
  std::uint64_t row_writes = 0;  ///< in extent.commits; so is shape_writes
  std::uint64_t shape_writes = 0;
  std::uint64_t entities = 0;              ///< alive in the last version
  std::uint64_t compared_checkpoints = 0;  ///< compared with the world before them
  /// A sentence on an incomplete last write, which the next open cuts off; empty: none.
  std::string torn{};
  /// One sentence for each fault, with its file; empty: the log is whole.
  std::vector<std::string> damage{};
  /// `opens`: a database would open without salvage, at version `opens_at`. Else `refusal` says why not, and
  /// `opens_by_salvage` whether it would open with salvage.
  bool opens = false;
  Version opens_at = 0;
  std::string refusal{};
  bool opens_by_salvage = false;
};

/// Verifies a log: all checksums, the chain of groups, each commit against the world before it, each
/// checkpoint against the world that results from the commits. Damage is part of the contents, not an error.
/// Errors: file for a directory without a log or one that cannot be read; out_of_memory.
Result<LogContents> inspect_log(const std::filesystem::path& directory);

/// A write of a commit. `state` is the entity after this write; a later write of the same commit may change
/// it again. For a remove, only `state.id` is meaningful.
struct LogWrite {
  enum class Kind : std::uint8_t { create, update, update_motion, remove };
  Kind kind = Kind::create;
  EntityState state{};
};
const char* to_string(LogWrite::Kind kind) noexcept;

/// The positions of a deforming geometry from this version on. Valid during the call.
struct LogShape {
  GeometryId geometry{};
  std::span<const glm::vec3> positions_m{};
};

/// Receives the contents of a log in the order of versions. Spans and references are valid during the call
/// only.
class LogListener {
 public:
  virtual ~LogListener() = default;
  /// The world at which the log begins, and the one with which it continues after a gap. Calls of geometry,
  /// material and light for all geometries, added materials and lights precede it. Entities by ascending
  /// index.
  virtual void world(const VersionInfo& at, std::span<const EntityState> entities) = 0;
  /// A geometry that was added, or that the next world has. `mesh` has its positions of that time.
  virtual void geometry(GeometryId id, std::string_view name, const GeometryOptions& options,
                        const TriangleMesh& mesh) = 0;
  /// A material that was added, or that the next world has.
  virtual void material(MaterialId id, std::string_view name, const Material& material) = 0;
  /// A light that was added, or that the next world has.
  virtual void light(LightId id, std::string_view name, const Light& light) = 0;
  /// The writes of one version, in their order.
  virtual void commit(const VersionInfo& version, std::span<const LogWrite> writes,
                      std::span<const LogShape> shapes) = 0;
  /// These versions were not recorded. The world is unknown up to the next call of `world`, or to the end.
  virtual void gap(Version first, Version last) = 0;
  /// After a gap and before the next `world`: number of recorded commits from `first` to `last`, whose world
  /// is unknown.
  virtual void unresolved(Version first, Version last, std::uint64_t commits) = 0;
};

/// Passes the contents of a log to the listener. With `salvage`, a damaged log is read up to the damage; the
/// result is a sentence on the damage, empty if there is none.
/// Errors: file as in inspect_log, and for damage without salvage, after the contents before it were passed;
/// out_of_memory.
Result<std::string> read_log(const std::filesystem::path& directory, LogListener& listener,
                             bool salvage = false);

}  // namespace rtstdb
