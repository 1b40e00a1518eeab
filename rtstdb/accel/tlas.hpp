#pragma once
// Top-level structures (paper, Section 4.1): a few slots, each with its own copy of the rows, the instances
// made from them, and a wide BVH over what every instance covers during the slot's window. A slot stands for
// one version and one window of time; a later version is reached by applying the rows that changed.
//
// Threads: one. prepare is the tick's and does not allocate; the rest is setup.

#include <cstdint>
#include <optional>
#include <vector>

#include <rtstdb/limits.hpp>

#include "rtstdb/accel/build_scratch.hpp"
#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/query/executor.hpp"
#include "shaders/shared/entity.h"

namespace rtstdb::accel {

struct TlasOptions {
  std::uint32_t max_entities = 0;
  std::uint32_t slots = 4;
};

/// Instants at which rows are written down in single precision lie this far apart, from the version's time
/// on; see shaders/shared/entity.h.
inline constexpr Nanoseconds epoch_length{shared::epoch_length_ns};
static_assert(epoch_length.count() >= max_query_window_ns, "a window meets at most two epochs");

/// An instant as the device is told of it.
struct Moment {
  float t_s = 0.0f;                 ///< since its epoch
  std::uint32_t instance_base = 0;  ///< where that epoch's instances begin
};

/// What answers say of an entity besides what the device found.
struct Identity {
  EntityId id;
  std::uint32_t mask = 0;
  std::uint32_t material = 0;
};

/// What a query needs to run on a slot.
struct TlasView {
  std::uint32_t slot = 0;
  const Identity* identities = nullptr;  ///< by entity index
  std::uint32_t root = 0;                ///< reference; none when nothing is visible
  WorldTime epoch{};
  std::uint32_t late_base = 0;
  /// For instants in the slot's window.
  Moment moment(WorldTime t) const noexcept;
};

class Tlas {
 public:
  static std::uint32_t nodes_needed(const TlasOptions& options) noexcept;
  /// The pool leaves nodes_needed nodes at its beginning.
  static Result<Tlas> create(gpu::Device& device, const TlasOptions& options);
  /// Connects to the pool; again whenever the pool's generation changed.
  Result<void> bind(gpu::Device& device, const GeometryPool& pool);

  /// Dispatches of every pass that build nothing: drivers compile at the first dispatch.
  void record_warm_up(gpu::Recorder& recorder);

  std::uint32_t slots() const noexcept { return static_cast<std::uint32_t>(slots_.size()); }
  const gpu::Buffer& instances(std::uint32_t slot) const noexcept { return slots_[slot].instances; }
  /// By entity index, a texel each: id, mask and material of a row.
  const gpu::Buffer& identity_texels(std::uint32_t slot) const noexcept {
    return slots_[slot].identity_texels;
  }
  /// By entity index: place_of.
  const gpu::Buffer& places(std::uint32_t slot) const noexcept { return slots_[slot].places; }
  /// Where the entity's instance stands in its slot: those with a geometry by ascending index, which nearest
  /// queries decide ties by. Misuse for an entity that is not alive in the slot's version.
  std::uint32_t place_of(std::uint32_t slot, std::uint32_t entity) const noexcept {
    return slots_[slot].place[entity];
  }

  /// Records what brings a slot to `rows` over `times` into the begun recorder of `submit`; nothing when a
  /// slot is there already. Scenes above small_build_max submit in between. Empty: the device is lost.
  std::optional<TlasView> prepare(const query::RowSource& rows, const query::TimeSpan& times, Submit& submit);

 private:
  enum class Presence : std::uint8_t { absent, hidden, visible };

  struct Slot {
    gpu::Buffer rows, instances, live, identity_texels, places;
    gpu::Bindings apply_rows, instances_pass, small_build;
    std::vector<Presence> presence;    // by entity index
    std::vector<std::uint32_t> place;  // by entity index
    std::vector<Identity> identities;  // by entity index: a row of an older version takes long to find
    std::uint32_t live_count = 0, visible_count = 0;
    bool filled = false;
    Version version = 0;
    WorldTime window_begin{}, window_end{}, epoch{};
    std::uint64_t last_used = 0;
    std::uint32_t node_base = 0;
    std::uint32_t root() const noexcept;
  };

  Slot* find(const query::RowSource& rows, const query::TimeSpan& times) noexcept;
  void upload_changes(Slot& slot, const query::RowSource& rows, gpu::Recorder& recorder);
  void list_live(Slot& slot, std::uint32_t index_limit);
  bool build(Slot& slot, Submit& submit);

  std::uint32_t max_entities_ = 0;
  std::uint64_t uses_ = 0;
  std::vector<Slot> slots_;
  std::vector<std::uint32_t> changed_;
  gpu::Buffer changed_rows_;
  BuildScratch scratch_;
  LargeBuild large_build_;
  gpu::Pipeline apply_rows_, instances_pass_, small_build_;
};

}  // namespace rtstdb::accel
