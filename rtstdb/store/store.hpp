#pragma once
// The rows of the world, the shapes of deforming geometry, and their versions.
//
// A commit takes several steps, so that queries can be executed on a version before anyone can read it:
//     stage(set)         checks the whole set; the new version is readable as staged_snapshot(), and nothing
//                        else changes
//     publish()          makes it the latest version
//     complete_commit()  copies the set into the store and the history; the caller may reuse the memory of
//                        the set
//     discard()          instead of publish() or complete_commit(): restores the state before stage(); the
//                        version number is not used again
//
// Older versions are read from a bounded history of row changes and one of shapes. Version 0 is the empty
// world and holds from -max_world_time_ns on.
//
// Ids: a create takes the lowest free index, so ids follow from the order of the writes. The generation of an
// index increases by one with each create (from 1; it wraps after 2^32 creates at one index).
//
// Threads: one, for const functions too. Allocates only in the constructor.

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
  /// Whether a geometry exists. Called during staging; must neither block nor throw.
  std::function<bool(GeometryId)> geometry_known;
  /// Whether a material exists, likewise. By default only the default material does.
  std::function<bool(MaterialId)> material_known = [](MaterialId id) { return id == MaterialId{}; };
  /// Whether a light exists, likewise. By default none does.
  std::function<bool(LightId)> light_known = [](LightId) { return false; };
  std::uint32_t max_geometries = 1024;
};

/// A recovered world. `rows` by index, with an invalid id where no entity lives; `generations`: the last
/// generation of each index.
struct RestoredRows {
  VersionInfo latest;
  Version next_version = 1;
  std::span<const EntityState> rows;
  std::span<const std::uint32_t> generations;
};

/// What a snapshot has to provide.
enum class ReadFor : std::uint8_t { rows, rows_and_shapes };

class Store {
 public:
  explicit Store(StoreOptions options);
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  /// Continues from a recovered world; older versions are not readable. To be called before the first commit
  /// and after keep_shapes. Misuse: rows that no store has written, or at indices beyond max_entities.
  void restore(const RestoredRows& restored) noexcept;

  VersionInfo latest() const noexcept { return latest_; }
  Version oldest_kept() const noexcept {
    return std::max(changes_.oldest_kept(), versions_.oldest().version);
  }
  /// Whether a version that is kept now, with its shapes, will still be kept after that commit.
  bool keeps_after(Version version, const WriteSet& set) const noexcept;

  /// The version number that the next staged set gets.
  Version next_version() const noexcept { return next_version_; }
  Snapshot latest_snapshot() const noexcept { return {*this, latest_}; }
  /// Misuse unless a set is staged.
  Snapshot staged_snapshot() const noexcept;
  /// The snapshot of a version. Refused with these values:
  ///   beyond_history                     the requested time (s), the end of the known history (s)
  ///   snapshot_too_old, unknown_version  the requested version (-1: by time), the oldest kept version (whose
  ///                                      shapes are kept too, with ReadFor::rows_and_shapes), the requested
  ///                                      time (s), the time of the oldest kept version (s)
  std::variant<Snapshot, BadInput> read(const ReadAt& read_at,
                                        ReadFor purpose = ReadFor::rows) const noexcept;

  /// Registers a deforming geometry with its first shape. Setup.
  void keep_shapes(GeometryId geometry, std::unique_ptr<ShapeHistory::Ring> shapes) noexcept {
    shapes_.adopt(geometry, std::move(shapes));
  }

  /// Checks the set, which must not be empty: each write in order, on the result of those before it, then its
  /// shapes. Returns the first fault with its place and values; then nothing has changed. Values:
  ///   world_time_goes_back  given (s), latest version's (s)
  ///   out_of_limits         a time beyond max_world_time_ns: given (s)
  ///   unknown_entity        none; `entity` is the unknown id
  ///   unknown_geometry      the geometry's index
  ///   unknown_material      the material's index
  ///   unknown_light         the light's index
  ///   too_many_entities     max_entities
  /// and those of row_check.hpp; for a shape, those of Transaction::update_geometry.
  /// The set must stay unchanged and at its address until complete_commit() or discard().
  std::optional<BadInput> stage(WriteSet& set) noexcept;
  /// Stages a set that was staged and published before, with its version, ids and rows, on the world that it
  /// was staged on then. Skipped version numbers are those of discarded versions. Misuse: a set that does not
  /// fit this world. Then publish and complete_commit.
  void restage(WriteSet& set) noexcept;
  /// Sets the end of the known history: reading AS OF this time or later is refused, since versions are
  /// missing from there on.
  void end_history_at(WorldTime time) noexcept { history_end_ = time; }
  void publish() noexcept;
  void complete_commit() noexcept;
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
  /// The state after the staged writes so far; null if there is no such entity.
  const EntityState* find_staged(EntityId id) const noexcept;
  std::optional<BadInput> stage_write(Write& write) noexcept;
  std::optional<BadInput> stage_create(Write& write) noexcept;
  std::optional<BadInput> stage_update(Write& write) noexcept;
  std::optional<BadInput> stage_update_motion(Write& write) noexcept;
  std::optional<BadInput> stage_shapes() noexcept;
  std::optional<BadInput> check_shape(const ShapeWrite& write) const noexcept;
  /// Undoes the first `count` writes of the staged set, last first, and its shapes.
  void unwind(std::size_t count) noexcept;
  /// Visits the last write of each index of the staged set.
  template <class Visit>
  void for_each_staged_row(Visit visit) const noexcept;

  StoreOptions options_;
  /// By index. If no entity lives there, the id has an invalid index and the last generation of that index.
  std::vector<EntityState> current_;
  std::vector<std::uint32_t> generations_;
  FreeIndices free_;
  std::uint32_t index_limit_ = 0;  ///< above every index used so far

  ChangeHistory changes_;
  VersionHistory versions_;
  DiscardedRows discarded_;
  ShapeHistory shapes_;

  WriteSet* staged_ = nullptr;
  Progress progress_ = Progress::none;
  std::vector<std::uint32_t> staged_write_;  ///< by index: ordinal + 1 of its last staged write; 0: none
  std::vector<std::uint32_t> staged_shape_;  ///< by geometry: ordinal + 1 of its last staged shape; 0: none

  VersionInfo latest_;
  Version next_version_ = 1;
  std::optional<WorldTime> history_end_;

  // For changed_between, which lists each index once: an index with the current mark is already in the list.
  mutable std::vector<std::uint64_t> marks_;
  mutable std::uint64_t mark_ = 0;
};

}  // namespace rtstdb::store
