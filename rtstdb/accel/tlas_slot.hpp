#pragma once
// One slot of the TLAS: a version of the world for one window of time, with its buffers, its tree and the
// limits that decide how it reaches a later version (tlas.hpp).

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <rtstdb/limits.hpp>

#include "rtstdb/accel/tlas_builder.hpp"
#include "rtstdb/accel/tlas_patch.hpp"
#include "rtstdb/store/row_source.hpp"
#include "shaders/shared/entity.h"

namespace rtstdb::accel {

/// Distance between epochs, the instants at which rows are stored in single precision; see
/// shaders/shared/entity.h.
inline constexpr Nanoseconds epoch_length{shared::epoch_length_ns};
static_assert(epoch_length.count() >= max_query_window_ns, "a window meets at most two epochs");

/// A tree is rebuilt when its cost exceeds the cost after its build by this factor.
inline constexpr float rebuild_growth = 1.3f;
/// A slot prepared ahead rebuilds its tree from this growth on, within this time; a growth above
/// max_growth_ahead makes the prepared slot useless.
inline constexpr Nanoseconds rebuilt_ahead_within{125'000'000};
inline constexpr float rebuild_growth_ahead = 1.1f;
inline constexpr float max_growth_ahead = 4.0f;
/// Smaller worlds are refitted or built when a window ends, and nothing is prepared ahead.
inline constexpr std::uint32_t min_made_ahead = 256;
/// When a copied tree has degraded, this many prepared slots are built before a tree is copied again.
inline constexpr std::uint32_t rebuilds_ahead = 4;

/// The length of a long window. Longer windows would save few refits, and the boxes of rotating bodies would
/// become loose.
inline constexpr Nanoseconds window_ahead{250'000'000};
static_assert(window_ahead.count() <= max_query_window_ns);
/// A batch is small when the world has at least this many entities for each of its elements.
inline constexpr std::uint32_t entities_per_small_element = 4;
/// All node boxes of a slot are recomputed after 1 / patched_share of its entities have been patched, since
/// the tree's topology does not follow their motion.
inline constexpr std::uint32_t patched_share = 8;
/// The least number of patched entities that leads to this, for small worlds.
inline constexpr std::uint32_t fewest_patched = 8;
/// When more than 1 / renewed_share of the entities change from version to version, all instances are
/// recomputed and windows are short, since long windows would save little.
inline constexpr std::uint32_t renewed_share = 4;

/// An instant in the form that shaders receive.
struct Moment {
  std::int32_t t_ns = 0;            ///< since the epoch that the instant belongs to
  std::uint32_t instance_base = 0;  ///< index of the first instance of that epoch
  float share = 0.0f;               ///< fraction of the window that has passed
};

/// Host data of an entity that results contain.
struct Identity {
  EntityId id;
  std::uint32_t mask = 0;
  MaterialId material{};
};

/// What a query needs to run on a slot.
struct TlasView {
  std::uint32_t slot = 0;
  const Identity* identities = nullptr;  ///< by entity index
  std::uint32_t root = 0;                ///< reference of the root; ref_none when the tree is empty
  std::uint32_t entities = 0;            ///< number of entities in the tree
  WorldTime epoch{};
  std::uint32_t late_base = 0;
  WorldTime window_begin{}, window_end{};
  std::uint64_t contents = 0;  ///< unique to this content of the slot
  /// `t` must lie in the slot's window.
  Moment moment(WorldTime t) const noexcept;
};

/// What a batch needs from a slot.
struct TlasRequest {
  store::TimeSpan times;
  std::uint64_t elements = std::numeric_limits<std::uint64_t>::max();  ///< number of queries in the batch
  /// GeometryPool::shown() for this version. A slot that was made with another value is stale.
  std::uint64_t shapes = 0;
  /// The slot of the previous batch, which is tried first.
  std::optional<std::uint32_t> slot = {};
};

enum class Presence : std::uint8_t { absent, hidden, visible };
/// `state`: null for an entity that does not exist. Entities without a geometry are hidden.
Presence presence_of(const EntityState* state) noexcept;

/// The end of a long window that begins at `begin`.
WorldTime long_window_end(WorldTime begin) noexcept;

struct TlasSlot {
  /// State of the tree.
  enum class Tree : std::uint8_t {
    none,     ///< to be built
    unknown,  ///< the device has built it; levels_readback holds its levels when the submission has finished
    known,
  };

  gpu::Buffer rows, instances, centers, still_bounds, live, identity_texels, places, nodes, levels_readback,
      cost_readback, motion_boxes;
  gpu::Bindings apply_rows, instances_pass, small_build, refit, cost;
  TlasBuilder::Bound large_build;
  TlasPatch::Bound patch;
  std::vector<Presence> presence;    // by entity index
  std::vector<std::uint32_t> place;  // by entity index
  std::vector<Identity> identities;  // by entity index; looking up a row of an older version would be slow
  std::uint32_t live_count = 0, visible_count = 0;
  std::uint32_t patched = 0;  ///< rows patched since all node boxes were recomputed
  bool filled = false;
  bool ready = true;               ///< false: still being prepared for the time after another slot's window
  bool followed = false;           ///< whether its successor has been prepared, or tried as far as possible
  const TlasSlot* next = nullptr;  ///< the slot that was prepared to replace this one
  Version version = 0;
  std::uint64_t shapes = 0;
  WorldTime window_begin{}, window_end{}, epoch{};
  std::uint64_t last_used = 0;
  std::uint64_t contents = 0;  // see TlasView
  std::uint32_t pins = 0;
  Tree tree = Tree::none;
  std::vector<std::uint32_t> levels;  // first node of each level, then the number of nodes
  float built_cost = 0.0f;            // 0: not known yet
  std::uint32_t builds_due = 0;       ///< number of successors that have to be built instead of copied

  std::uint32_t root() const noexcept;
  void take_window(WorldTime begin, WorldTime end) noexcept;
  /// Whether the slot serves the request, whatever its version.
  bool holds(const TlasRequest& request) const noexcept;
  /// Whether a prepared successor serves this version and request.
  bool is_superseded(Version reader_version, const TlasRequest& request) const noexcept;
  bool is_small(const TlasRequest& request) const noexcept {
    return request.elements < visible_count / entities_per_small_element;
  }
  /// Limits on the changed entities of a patch and of a renewal.
  std::uint32_t max_patched() const noexcept;
  std::uint32_t max_renewed() const noexcept;
  /// Reads the levels of the last tree, whose build has finished.
  void read_levels();
  /// The tree's current cost divided by its cost after the build.
  float growth() noexcept;
  /// Whether the tree may be kept with new boxes.
  bool may_refit(float max_growth = rebuild_growth);
  /// Lists the live entities below `index_limit` in the order of their instances.
  void list_live(std::uint32_t index_limit);
};

/// The slots of a TLAS, with the order of their use.
class TlasSlots {
 public:
  void resize(std::uint32_t count) { slots_.resize(count); }
  std::vector<TlasSlot>& all() noexcept { return slots_; }
  const TlasSlot& operator[](std::uint32_t index) const noexcept { return slots_[index]; }
  TlasSlot& operator[](std::uint32_t index) noexcept { return slots_[index]; }
  std::uint32_t size() const noexcept { return static_cast<std::uint32_t>(slots_.size()); }
  std::uint32_t index_of(const TlasSlot& slot) const noexcept {
    return static_cast<std::uint32_t>(&slot - slots_.data());
  }

  /// The unpinned slot that was used longest ago, other than `except`; null if there is none.
  TlasSlot* least_recently_used(const TlasSlot* except) noexcept;
  void note_use(TlasSlot& slot) noexcept { slot.last_used = ++uses_; }
  /// How many uses of slots ago the slot was used.
  std::uint64_t age_of(const TlasSlot& slot) const noexcept { return uses_ - slot.last_used; }
  /// Gives the slot a contents number that no slot has had.
  void note_change(TlasSlot& slot) noexcept { slot.contents = ++contents_; }
  bool pin(std::uint32_t index) noexcept;
  void unpin(std::uint32_t index) noexcept;

 private:
  std::vector<TlasSlot> slots_;
  std::uint64_t uses_ = 0;
  std::uint64_t contents_ = 0;  // the last number given to a slot
};

}  // namespace rtstdb::accel
