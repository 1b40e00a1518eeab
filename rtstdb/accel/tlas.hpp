#pragma once
// Top-level structures (paper, Section 4.1): a few slots, each with its own copy of the rows, the instances
// made from them, and a wide BVH over what every instance covers at the begin and at the end of the slot's
// window. A slot stands for one version and one window of time. A later version is reached
//   by a patch   few rows changed, and the window holds the new times: only their boxes and those above are made
//   by a renewal more changed than a patch is good for, and the window holds the new times: only the instances that
//                changed are made, then all boxes above
//   by a refit   the tree stays and all its boxes are made anew, for a new window
//   by a build   entities came, went, got or lost their geometry, or the tree's cost by the surface area
//                heuristic has grown by rebuild_growth since it was built
// A batch that is small beside the world gets a window that reaches ahead, so that those that follow it in time
// need a patch at the most; a large one gets a window as short as its times, in which it is answered sooner. Before a window
// that reaches ahead ends, the slot for the next one is made, a part with each batch (tlas_ahead.cpp): no batch waits for
// a refit of all, or a build.
//
// Threads: one. prepare is the tick's and does not allocate; the rest is setup.

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <rtstdb/limits.hpp>

#include "rtstdb/accel/build_scratch.hpp"
#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/tlas_builder.hpp"
#include "rtstdb/accel/tlas_patch.hpp"
#include "rtstdb/store/row_source.hpp"
#include "shaders/shared/entity.h"

namespace rtstdb::accel {

struct TlasOptions {
  std::uint32_t max_entities = 0;
  std::uint32_t slots = 4;
  bool refits = true;   ///< false: every tree is built anew, to measure that
  bool patches = true;  ///< false: windows reach no further than their times, to measure refits
};

/// Instants at which rows are written down in single precision lie this far apart; see shaders/shared/entity.h.
inline constexpr Nanoseconds epoch_length{shared::epoch_length_ns};
static_assert(epoch_length.count() >= max_query_window_ns, "a window meets at most two epochs");

/// A tree that costs more than this times what it did when it was built is built anew.
inline constexpr float rebuild_growth = 1.3f;
/// The same where that is done ahead, a part with each batch, within so much time; and what is too much even for that.
inline constexpr Nanoseconds rebuilt_ahead_within{125'000'000};
inline constexpr float rebuild_growth_ahead = 1.1f;
inline constexpr float max_growth_ahead = 4.0f;
/// Smaller worlds are refitted, and built, when a window ends.
inline constexpr std::uint32_t min_made_ahead = 256;
/// Where a tree that was kept went bad, so many are built before one is kept again.
inline constexpr std::uint32_t rebuilds_ahead = 4;

/// How far the window of a small batch reaches ahead: beside what a refit of all takes, few of them; and boxes of bodies that
/// turn are still of use.
inline constexpr Nanoseconds window_ahead{250'000'000};
static_assert(window_ahead.count() <= max_query_window_ns);
/// A batch is small when the world has so many entities for each of its elements.
inline constexpr std::uint32_t entities_per_small_element = 4;
/// A slot's nodes are all made anew when this share of its entities has been patched, for its tree knows nothing of where they went.
inline constexpr std::uint32_t patched_share = 8;
/// As the share of a small world.
inline constexpr std::uint32_t fewest_patched = 8;
/// Where more than this share changes from version to version, all instances are made anew: a window that reaches ahead would
/// spare little.
inline constexpr std::uint32_t renewed_share = 4;

/// An instant as the device is told of it.
struct Moment {
  std::int32_t t_ns = 0;            ///< since its epoch
  std::uint32_t instance_base = 0;  ///< where that epoch's instances begin
  float share = 0.0f;               ///< of the window that has passed
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
  std::uint32_t entities = 0;            ///< in the tree
  WorldTime epoch{};
  std::uint32_t late_base = 0;
  WorldTime window_begin{}, window_end{};
  std::uint64_t contents = 0;  ///< another one than any before it, whenever something in a slot has changed
  /// For instants in the slot's window.
  Moment moment(WorldTime t) const noexcept;
};

class Tlas {
 public:
  static Result<Tlas> create(gpu::Device& device, const TlasOptions& options);
  /// Connects to the pool; again whenever the pool's generation changed.
  Result<void> bind(gpu::Device& device, const GeometryPool& pool);

  /// Dispatches of every pass that build nothing: drivers compile at the first dispatch.
  void record_warm_up(gpu::Recorder& recorder);

  std::uint32_t slots() const noexcept { return static_cast<std::uint32_t>(slots_.size()); }
  /// tlas_node_texels a node, the root first; references count in it.
  const gpu::Buffer& nodes(std::uint32_t slot) const noexcept { return slots_[slot].nodes; }
  const gpu::Buffer& instances(std::uint32_t slot) const noexcept { return slots_[slot].instances; }
  /// By entity index, a texel each: id, mask and material of a row.
  const gpu::Buffer& identity_texels(std::uint32_t slot) const noexcept {
    return slots_[slot].identity_texels;
  }
  // Where the slot's window is one instant, in the order of the instances: centres of the bounds with the mask, and the
  // bounds (still_bounds_texels each).
  const gpu::Buffer& centers(std::uint32_t slot) const noexcept { return slots_[slot].centers; }
  const gpu::Buffer& still_bounds(std::uint32_t slot) const noexcept { return slots_[slot].still_bounds; }
  /// By entity index: place_of.
  const gpu::Buffer& places(std::uint32_t slot) const noexcept { return slots_[slot].places; }
  /// Where the entity's instance stands in its slot: those with a geometry by ascending index, which nearest
  /// queries decide ties by. Misuse for an entity that is not alive in the slot's version.
  std::uint32_t place_of(std::uint32_t slot, std::uint32_t entity) const noexcept {
    return slots_[slot].place[entity];
  }

  /// What a slot is wanted for.
  struct Wanted {
    store::TimeSpan times;
    std::uint64_t elements = std::numeric_limits<std::uint64_t>::max();  ///< that will be asked
    /// GeometryPool::shown of that version; another one than a slot was made with makes it stale.
    std::uint64_t shapes = 0;
    /// Looked at before all others: the one that was there the last time.
    std::optional<std::uint32_t> slot = {};
  };
  /// Records what brings a slot to `rows` over the times wanted into the begun recorder of `submit`; nothing when a
  /// slot is there already. Scenes above small_build_max submit in between when their tree is
  /// built. Empty: the device is lost.
  std::optional<TlasView> prepare(const store::RowSource& rows, const Wanted& wanted, Submit& submit);

  /// Until unpin a slot stays as it is, and others are brought to what is asked meanwhile. Calls nest. False: it is the last one that is
  /// left for those, and it is not pinned.
  bool pin(std::uint32_t slot) noexcept;
  void unpin(std::uint32_t slot) noexcept;

  /// How slots came to their versions so far.
  struct Counts {
    std::uint64_t builds = 0, refits = 0, patches = 0;
    std::uint64_t rows = 0;         ///< written to the device
    std::uint64_t renewals = 0;     ///< of the refits
    std::uint64_t ahead = 0;        ///< slots made before they were asked for
    std::uint64_t ahead_built = 0;  ///< of them, those with a tree of their own
  };
  Counts counts() const noexcept { return counts_; }

 private:
  enum class Presence : std::uint8_t { absent, hidden, visible };
  /// What a slot's nodes are to its entities.
  enum class Tree : std::uint8_t {
    none,     ///< to be built
    unknown,  ///< built by the device alone: its levels stand in levels_readback once that is done
    known,
  };

  struct Slot {
    gpu::Buffer rows, instances, centers, still_bounds, live, identity_texels, places, nodes, levels_readback,
        cost_readback, motion_boxes;
    gpu::Bindings apply_rows, instances_pass, small_build, refit, cost;
    TlasBuilder::Bound large_build;
    TlasPatch::Bound patch;
    std::vector<Presence> presence;    // by entity index
    std::vector<std::uint32_t> place;  // by entity index
    std::vector<Identity> identities;  // by entity index: a row of an older version takes long to find
    std::uint32_t live_count = 0, visible_count = 0;
    std::uint32_t patched = 0;  ///< rows since all boxes were made
    bool filled = false;
    bool made = true;            ///< false: not to the end, by make_ahead
    bool followed = false;       ///< what comes behind its window has been seen to, as far as it could be
    const Slot* next = nullptr;  ///< made ahead to be used in its place
    Version version = 0;
    std::uint64_t shapes = 0;
    WorldTime window_begin{}, window_end{}, epoch{};
    std::uint64_t last_used = 0;
    std::uint64_t contents = 0;  // see TlasView
    std::uint32_t pins = 0;
    Tree tree = Tree::none;
    std::vector<std::uint32_t> levels;  // first node of each, then the number of nodes
    float built_cost = 0.0f;            // 0: not known yet
    std::uint32_t rebuilds = 0;         ///< so many of the slots made behind it get a tree of their own
    std::uint32_t root() const noexcept;
    void take_window(WorldTime begin, WorldTime end) noexcept;
    /// There is another one now, made ahead, for what asks for this version.
    bool is_superseded(Version asked, const Wanted& wanted) const noexcept;
    /// Whatever its version.
    bool holds(const Wanted& wanted) const noexcept;
  };

  /// How a slot that is made ahead comes to its tree.
  enum class TreeAhead : std::uint8_t { copied, built };
  /// The slot that is made for the time behind another's window.
  struct Ahead {
    enum class Step : std::uint8_t { build, tree, rows, instances, boxes, parents, cost, verdict };
    Slot* slot = nullptr;    ///< none: nothing is being made
    Slot* source = nullptr;  ///< the one whose window ends; filled for another, it is none any more
    WorldTime begun{}, due{};
    Step step = Step::tree;
    std::uint32_t row_count = 0;
    TreeAhead tree = TreeAhead::copied;
    std::uint32_t next = 0;  ///< of what the step goes through
    std::size_t level = 0;   ///< that boxes are made of
    std::uint64_t done = 0;  ///< work
    std::uint64_t total = 0;
  };

  /// The end of a window that begins at `begin` and reaches ahead.
  static WorldTime ahead_of(WorldTime begin) noexcept;
  /// Of those that are not pinned; none where there is no other.
  Slot* min_used(const Slot* but) noexcept;
  Slot* find(const store::RowSource& rows, const Wanted& wanted) noexcept;
  /// The slot that a patch or a renewal brings there, whose changes are listed then; or none.
  Slot* find_near(const store::RowSource& rows, const Wanted& wanted) noexcept;
  /// It is not to be reached any more: the slot whose place it took is used again. False: there is none.
  bool step_aside(const Slot& made_ahead) noexcept;
  static std::uint32_t max_patched(const Slot& slot) noexcept;
  static std::uint32_t max_renewed(const Slot& slot) noexcept;
  /// Of what changed.
  bool is_patch(const Slot& slot) const noexcept;
  /// False: too much changed, or the tree itself has to.
  bool list_renewed(Slot& slot, const store::RowSource& rows, const Wanted& wanted) noexcept;
  /// With what list_renewed has listed.
  void renew(Slot& slot, const store::RowSource& rows, gpu::Recorder& recorder);
  bool few_changed_lately(const store::RowSource& rows) noexcept;
  bool fill(Slot& slot, const store::RowSource& rows, const Wanted& wanted, Submit& submit);
  static Presence presence_of(const EntityState* state) noexcept;
  void list_changes(Slot& slot, const store::RowSource& rows);
  void upload_changes(Slot& slot, const store::RowSource& rows, gpu::Recorder& recorder);
  void list_live(Slot& slot, std::uint32_t index_limit);
  void make_instances(const Slot& slot, gpu::Recorder& recorder) const {
    record_instances(slot, 0, slot.live_count, false, recorder);
  }
  /// From a place on, or of so many that are listed.
  void record_instances(const Slot& slot, std::uint32_t first, std::uint32_t count, bool listed,
                        gpu::Recorder& recorder) const;
  static void learn_levels(Slot& slot);
  /// What the slot's tree costs beside what it did when it was built.
  static float growth_of(Slot& slot) noexcept;
  bool may_refit(Slot& slot, float max_growth = rebuild_growth);
  void refit(const Slot& slot, gpu::Recorder& recorder) const;
  void refit_nodes(const Slot& slot, std::uint32_t first, std::uint32_t count, gpu::Recorder& recorder) const;
  bool build(Slot& slot, Submit& submit);
  void find_cost(const Slot& slot, gpu::Recorder& recorder) const;
  bool make_tree(Slot& slot, Submit& submit);
  static bool is_small(const Slot& slot, const Wanted& wanted) noexcept {
    return wanted.elements < slot.visible_count / entities_per_small_element;
  }
  /// A part of the slot that comes behind `used`, which answers a batch and was made for one before. Records; submits
  /// nothing.
  void make_ahead(Slot& used, const store::RowSource& rows, const Wanted& wanted,
                  gpu::Recorder& recorder) noexcept;
  /// Whether it is time to make the slot behind this one.
  std::optional<TreeAhead> tree_ahead(Slot& used, const store::RowSource& rows,
                                      const Wanted& wanted) const noexcept;
  /// What there is to do for the slot behind this one, in the weights of tlas_ahead.cpp.
  static std::uint64_t work_with_tree(const Slot& slot, std::uint32_t row_count) noexcept;
  static std::uint64_t work_ahead(const Slot& used, std::uint32_t row_count, TreeAhead tree) noexcept;
  void begin_ahead(Slot& used, Slot& slot, const store::RowSource& rows, const Wanted& wanted,
                   TreeAhead tree) noexcept;
  /// What was being made is of no use any more.
  void drop_ahead() noexcept;
  /// The slot behind this one can not be brought to the versions that came meanwhile.
  void was_in_vain(Slot& source) noexcept;
  /// The work that a batch at `now` has to do.
  std::uint64_t due_ahead(WorldTime now) const noexcept;
  /// Records so much, or what is left of a step; returns how much it was.
  std::uint64_t step_ahead(std::uint64_t most, const store::RowSource& rows,
                           gpu::Recorder& recorder) noexcept;
  void copy_rows_ahead(std::uint32_t first, std::uint32_t count, gpu::Recorder& recorder) noexcept;
  /// Brings what has been copied to the version of `rows`. False: too much changed, it is dropped.
  bool catch_up_ahead(const store::RowSource& rows, gpu::Recorder& recorder) noexcept;
  /// Once the device has built its tree.
  void take_tree_ahead() noexcept;
  /// Once the device has said what its tree costs: whether the slot is to be used.
  void judge_ahead() noexcept;
  Result<void> create_slot(gpu::Device& device, Slot& slot, const std::string& name);

  std::uint32_t max_entities_ = 0;
  std::uint32_t late_base_ = 0;
  bool refits_ = true;
  bool patches_ = true;
  bool makes_ahead_ = true;
  std::uint64_t uses_ = 0;
  std::uint64_t contents_ = 0;  // the last that a slot got
  double lead_share_ = 1.0;     // of the time before a window's end at which the slot behind it is begun
  std::uint32_t rests_ = 0;     // windows behind which none is made, since that was in vain
  Version latest_version_ = 0;  // of the batch before
  std::vector<Slot> slots_;
  Ahead ahead_;
  std::vector<std::uint32_t> changed_;
  std::uint32_t uploaded_ = 0;  // of changed_rows_, by the batch at hand
  gpu::Buffer changed_rows_;
  gpu::Buffer renewed_places_;
  BuildScratch small_scratch_;
  std::optional<TlasBuilder> large_build_;  // none where no world needs it
  TlasPatch patch_;
  gpu::Buffer bounds_;  // of the tree being made
  gpu::Pipeline apply_rows_, instances_pass_, small_build_, refit_, cost_;
  Counts counts_;
};

}  // namespace rtstdb::accel
