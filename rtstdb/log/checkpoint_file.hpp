#pragma once
// Writes a checkpoint, slice by slice, to a file with a temporary name. It gets its final name, and is valid,
// when it is completely on disk.

#include <memory>
#include <vector>

#include "rtstdb/log/added_counts.hpp"
#include "rtstdb/log/disk.hpp"
#include "rtstdb/log/position.hpp"
#include "rtstdb/log/world_source.hpp"

namespace rtstdb::log {

class CheckpointFile {
 public:
  /// Parameters of a new checkpoint.
  struct Begin {
    std::uint64_t database_id = 0;
    std::uint64_t number = 0;
    Position position;  ///< of the first group after its version
    std::int64_t real_time_ns = 0;
    std::uint32_t rows_per_slice = 4096;
  };
  static DiskResult<std::unique_ptr<CheckpointFile>> create(Disk& disk, const Begin& begin, WorldHead head);
  CheckpointFile(const CheckpointFile&) = delete;
  CheckpointFile& operator=(const CheckpointFile&) = delete;
  /// Removes the file if it was not published; ignores a fault.
  ~CheckpointFile();

  Version version() const noexcept { return head_.version.version; }
  AddedCounts added() const noexcept {
    return {head_.geometries.size(), head_.materials.size(), head_.lights.size()};
  }
  std::uint64_t bytes() const noexcept { return offset_; }

  /// not_kept: the source no longer has the version.
  enum class Progress : std::uint8_t { more, written, not_kept };
  /// Writes the next slice.
  DiskResult<Progress> write_slice(WorldSource& source);
  /// Syncs the file and gives it its final name.
  DiskFault publish();

 private:
  CheckpointFile(Disk& disk, std::unique_ptr<DiskFile> file, const Begin& begin, WorldHead head);
  DiskFault write_chunk(ChunkKind kind, std::uint32_t entries);
  template <class Value>
  DiskResult<Progress> write_definition(ChunkKind kind, const LoggedDefinition<Value>& definition);
  DiskResult<Progress> write_rows(WorldSource& source);
  DiskResult<Progress> write_shape(WorldSource& source);

  Disk& disk_;
  std::unique_ptr<DiskFile> file_;
  Begin begin_;
  WorldHead head_;
  std::uint64_t offset_ = 0;
  std::uint64_t chunks_ = 0;
  std::size_t next_geometry_ = 0, next_material_ = 0, next_light_ = 0, next_shape_ = 0;
  std::uint32_t next_index_ = 0;
  bool ended_ = false, published_ = false;
  std::vector<EntityState> states_;
  WorldSource::Shape shape_;
  std::vector<std::byte> chunk_;  // header and payload
};

}  // namespace rtstdb::log
