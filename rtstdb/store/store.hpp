#pragma once
// The rows of the world, the shapes of geometry that deforms, and their versions.
//
// A commit goes in steps, so that queries can be answered on a version before anybody else can read it:
//     stage(set)  -> the set is checked whole and becomes readable as staged_snapshot(); nothing else has
//     changed publish()   -> its version is the latest settle()    -> the set is copied into the store and
//     history; the caller may use the set's memory again discard()   -> instead of publish() or of settle():
//     as if it had never been staged; its version number is
//                    not given again
//
// Older versions are read from a bounded history of row changes, and one of shapes. Version 0 is the empty world and holds from
// -max_world_time_ns on.
//
// Ids: a create takes the lowest free index, so ids follow from the order of the writes. The generation of an
// index grows by one with each create (from 1; it wraps after 2^32 creates at one index).
//
// Threads: one, const calls too. Allocates in the constructor alone; keep_shapes takes memory that is there.

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include <rtstdb/database.hpp>

#include "rtstdb/store/change_history.hpp"
#include "rtstdb/store/discarded_rows.hpp"
#include "rtstdb/store/free_indices.hpp"
#include "rtstdb/store/shape_history.hpp"
#include "rtstdb/store/snapshot.hpp"
#include "rtstdb/store/version_history.hpp"
#include "rtstdb/store/write_set.hpp"

namespace rtstdb::store {

struct StoreOptions {
  std::uint32_t max_entities = 4096;          ///< 1 to rtstdb::max_entities
  std::uint32_t retained_changes = 1u << 16;  ///< at least 1
  /// Whether a geometry exists. Called while staging; must neither block nor throw.
  std::function<bool(GeometryId)> geometry_known;
  std::uint32_t max_geometries = 1024;
};

/// A world to go on from. Rows by index, an invalid id where no entity lives; the last generation of each of these indices.
struct RestoredRows {
  VersionInfo latest;
  Version next_version = 1;
  std::span<const EntityState> rows;
  std::span<const std::uint32_t> generations;
};

/// What a version is read for.
enum class ReadFor : std::uint8_t { rows, rows_and_shapes };

class Store {
 public:
  explicit Store(StoreOptions options);
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  /// Goes on from a world that was, as if its commits had been made here; older versions are too old. Before the first commit,
  /// after keep_shapes. Rows have been written by a store, at indices below max_entities (misuse).
  void restore(const RestoredRows& restored) noexcept;

  VersionInfo latest() const noexcept { return latest_; }
  Version oldest_kept() const noexcept {
    return std::max(changes_.oldest_kept(), versions_.oldest().version);
  }
  /// Whether a version that is kept now with its shapes will be after that commit.
  bool keeps_after(Version version, const WriteSet& set) const noexcept;

  /// The number that the next set gets which is staged.
  Version next_version() const noexcept { return next_version_; }
  Snapshot latest_snapshot() const noexcept { return {*this, latest_}; }
  /// Misuse unless a set is staged.
  Snapshot staged_snapshot() const noexcept;
  /// Refuses: beyond_history, values are the time asked for and ends_at (s); snapshot_too_old, unknown_version; values are the version asked for (-1: by time), the oldest
  /// kept version (that has its shapes, where they are wanted), the time asked for (s), the time of the oldest kept
  /// version (s).
  std::variant<Snapshot, BadInput> read(const ReadAt& read_at,
                                        ReadFor purpose = ReadFor::rows) const noexcept;

  /// A geometry deforms from now on. Setup.
  void keep_shapes(GeometryId geometry, std::unique_ptr<ShapeHistory::Kept> shapes) noexcept {
    shapes_.adopt(geometry, std::move(shapes));
  }

  /// Checks the whole set, which is not empty, in order, each write on what those before it left, then its shapes. The first
  /// fault is returned with its place and values, and nothing has changed; values:
  ///   world_time_goes_back  given (s), latest version's (s)
  ///   out_of_limits         a time beyond max_world_time_ns: given (s)
  ///   unknown_entity        none; `entity` is the one named
  ///   unknown_geometry      the geometry's index
  ///   too_many_entities     max_entities
  ///   those of row_check.hpp
  /// and of a shape, as Transaction::update_geometry says.
  /// The set must stay where it is and unchanged until settle() or discard().
  std::optional<BadInput> stage(WriteSet& set) noexcept;
  /// A set that a store staged and published once, with its version, its ids and its rows as they were then, on the world that it
  /// was staged on; versions that are passed over came to nothing. Misuse where it can not have been so. Then publish, settle.
  void stage_again(WriteSet& set) noexcept;
  /// The latest version holds up to there, and what came then is not known: reading as of that time or later is refused.
  void ends_at(WorldTime time) noexcept { ends_at_ = time; }
  void publish() noexcept;
  void settle() noexcept;
  void discard() noexcept;

 private:
  friend class Snapshot;
  enum class Progress : std::uint8_t { none, staged, published };

  const EntityState* row(Version version, std::uint32_t index) const noexcept;
  const EntityState& slot(Version version, std::uint32_t index) const noexcept;
  bool changed_between(Version version, Version other, std::vector<std::uint32_t>& indices) const noexcept;
  Shape shape(Version version, GeometryId geometry) const noexcept;
  bool keeps(Version version) const noexcept;
  bool is_staged(Version version) const noexcept {
    return progress_ != Progress::none && version == staged_->version;
  }

  std::optional<BadInput> check_time(WorldTime time) const noexcept;
  std::optional<BadInput> check_geometry(GeometryId geometry) const noexcept;
  /// The state as the staged writes so far leave it; null when there is no such entity.
  const EntityState* find_staged(EntityId id) const noexcept;
  std::optional<BadInput> stage_write(Write& write) noexcept;
  std::optional<BadInput> stage_create(Write& write) noexcept;
  std::optional<BadInput> stage_update(Write& write) noexcept;
  std::optional<BadInput> stage_update_motion(Write& write) noexcept;
  std::optional<BadInput> stage_shapes() noexcept;
  std::optional<BadInput> check_shape(const ShapeWrite& write) const noexcept;
  /// Takes back the first `count` writes of the staged set, last first.
  void unwind(std::size_t count) noexcept;
  /// Visits the last write of each index of the staged set.
  template <class Visit>
  void for_each_staged_row(Visit visit) const noexcept;

  StoreOptions options_;
  /// By index. Where there is no entity, the id has an invalid index and the generation that was given last.
  std::vector<EntityState> current_;
  std::vector<std::uint32_t> generations_;
  FreeIndices free_;
  std::uint32_t index_limit_ = 0;  ///< above every index that ever lived

  ChangeHistory changes_;
  VersionHistory versions_;
  DiscardedRows discarded_;
  ShapeHistory shapes_;

  WriteSet* staged_ = nullptr;
  Progress progress_ = Progress::none;
  std::vector<std::uint32_t> staged_write_;  ///< by index: ordinal + 1 of its last staged write; 0: none
  std::vector<std::uint32_t> staged_shape_;  ///< by geometry, in the same way

  VersionInfo latest_;
  Version next_version_ = 1;
  std::optional<WorldTime> ends_at_;

  // changed_between names each index once: an index with the current mark is in the list already.
  mutable std::vector<std::uint64_t> marks_;
  mutable std::uint64_t mark_ = 0;
};

}  // namespace rtstdb::store
