#pragma once
// Top-level acceleration structures (paper, Section 4.1). There are a few slots. A slot holds one version for
// one window of time: a copy of the rows, the instances made from them, and a wide BVH whose nodes have two
// sets of boxes, for the begin and the end of the window. A slot reaches a later version
//   by a patch    few rows changed and the window contains the new times: only their boxes and those above
//                 them are recomputed
//   by a renewal  more rows changed and the window contains the new times: only the changed instances are
//                 recomputed, then all node boxes
//   by a refit    the window does not contain the new times: all instances and node boxes are recomputed,
//                 the topology stays
//   by a build    entities were created or deleted, got or lost their geometry, or the tree's cost by the
//                 surface area heuristic has grown by the factor rebuild_growth since it was built
// A batch that is small compared with the world gets a long window, so that the batches after it need at most
// a patch. A large batch gets a window as short as its times, since tighter boxes make its searches faster.
// Before a long window ends, the slot for the next window is prepared in parts, one with each batch
// (tlas_ahead.cpp), so that no batch waits for a whole refit or build.
//
// Threads: one. prepare(), pin() and unpin() are called in the tick and do not allocate; the other functions
// are setup.

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
  bool refits = true;   ///< false: build every tree anew (to measure refits)
  bool patches = true;  ///< false: no long windows and no patches (to measure patches)
};

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
  std::uint32_t material = 0;
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

class Tlas {
 public:
  static Result<Tlas> create(gpu::Device& device, const TlasOptions& options);
  /// Binds the passes to the pool. Call again whenever the pool's generation has changed.
  Result<void> bind(gpu::Device& device, const GeometryPool& pool);

  /// Records an empty dispatch of every pass, since drivers compile at the first dispatch.
  void record_warm_up(gpu::Recorder& recorder);

  std::uint32_t slots() const noexcept { return static_cast<std::uint32_t>(slots_.size()); }
  /// tlas_node_texels texels per node, the root first; references count nodes of this buffer.
  const gpu::Buffer& nodes(std::uint32_t slot) const noexcept { return slots_[slot].nodes; }
  const gpu::Buffer& instances(std::uint32_t slot) const noexcept { return slots_[slot].instances; }
  /// One texel per entity index: id, mask and material of a row.
  const gpu::Buffer& identity_texels(std::uint32_t slot) const noexcept {
    return slots_[slot].identity_texels;
  }
  // If the slot's window is one instant: per instance, the centre of its bounds with the mask, and the bounds
  // (still_bounds_texels texels each).
  const gpu::Buffer& centers(std::uint32_t slot) const noexcept { return slots_[slot].centers; }
  const gpu::Buffer& still_bounds(std::uint32_t slot) const noexcept { return slots_[slot].still_bounds; }
  /// place_of() by entity index.
  const gpu::Buffer& places(std::uint32_t slot) const noexcept { return slots_[slot].places; }
  /// The position of the entity's instance in the slot. Instances with a geometry come first, by ascending
  /// entity index; nearest queries break ties by this order. Misuse: an entity that does not exist in the
  /// slot's version.
  std::uint32_t place_of(std::uint32_t slot, std::uint32_t entity) const noexcept {
    return slots_[slot].place[entity];
  }

  /// What a batch needs from a slot.
  struct Wanted {
    store::TimeSpan times;
    std::uint64_t elements = std::numeric_limits<std::uint64_t>::max();  ///< number of queries in the batch
    /// GeometryPool::shown() for this version. A slot that was made with another value is stale.
    std::uint64_t shapes = 0;
    /// The slot of the previous batch, which is tried first.
    std::optional<std::uint32_t> slot = {};
  };
  /// Provides a slot that holds `rows` over the requested times. Records the commands into the recorder of
  /// `submit`, which has begun; records nothing if a slot is ready. A build of a world above small_build_max
  /// instances submits and begins again. Empty: the device is lost.
  std::optional<TlasView> prepare(const store::RowSource& rows, const Wanted& wanted, Submit& submit);

  /// Keeps a slot unchanged until unpin(). Calls nest. False: not pinned, since no unpinned slot would be
  /// left.
  bool pin(std::uint32_t slot) noexcept;
  void unpin(std::uint32_t slot) noexcept;

  /// How often slots were brought to a version, by method.
  struct Counts {
    std::uint64_t builds = 0, refits = 0, patches = 0;
    std::uint64_t rows = 0;         ///< rows uploaded to the device
    std::uint64_t renewals = 0;     ///< included in `refits`
    std::uint64_t ahead = 0;        ///< slots that were prepared ahead
    std::uint64_t ahead_built = 0;  ///< included in `ahead`: slots with a tree of their own
  };
  Counts counts() const noexcept { return counts_; }

 private:
  enum class Presence : std::uint8_t { absent, hidden, visible };
  /// State of a slot's tree.
  enum class Tree : std::uint8_t {
    none,     ///< to be built
    unknown,  ///< the device has built it; levels_readback holds its levels when the submission has finished
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
    std::vector<Identity> identities;  // by entity index; looking up a row of an older version would be slow
    std::uint32_t live_count = 0, visible_count = 0;
    std::uint32_t patched = 0;  ///< rows patched since all node boxes were recomputed
    bool filled = false;
    bool made = true;  ///< false: still being prepared ahead
    /// Whether the slot for the next window has been prepared, or tried as far as possible
    bool followed = false;
    const Slot* next = nullptr;  ///< the slot that was prepared to replace this one
    Version version = 0;
    std::uint64_t shapes = 0;
    WorldTime window_begin{}, window_end{}, epoch{};
    std::uint64_t last_used = 0;
    std::uint64_t contents = 0;  // see TlasView
    std::uint32_t pins = 0;
    Tree tree = Tree::none;
    std::vector<std::uint32_t> levels;  // first node of each level, then the number of nodes
    float built_cost = 0.0f;            // 0: not known yet
    std::uint32_t rebuilds = 0;         ///< number of successors that have to be built instead of copied
    std::uint32_t root() const noexcept;
    void take_window(WorldTime begin, WorldTime end) noexcept;
    /// A slot prepared ahead exists that serves this version and request.
    bool is_superseded(Version reader_version, const Wanted& wanted) const noexcept;
    /// Whether the slot serves the request, whatever its version.
    bool holds(const Wanted& wanted) const noexcept;
  };

  /// Where the tree of a slot that is prepared ahead comes from.
  enum class TreeAhead : std::uint8_t { copied, built };
  /// A slot that is being prepared for the time after the window of `source`.
  struct Ahead {
    enum class Step : std::uint8_t { build, tree, rows, instances, boxes, parents, cost, verdict };
    Slot* slot = nullptr;    ///< null: nothing is being prepared
    Slot* source = nullptr;  ///< the slot whose window ends; null once it has been refilled
    WorldTime begun{}, due{};
    Step step = Step::tree;
    std::uint32_t row_count = 0;
    TreeAhead tree = TreeAhead::copied;
    std::uint32_t next = 0;  ///< first element that the current step has not processed
    std::size_t level = 0;   ///< level whose boxes are computed
    std::uint64_t done = 0;  ///< work recorded so far
    std::uint64_t total = 0;
  };

  /// The end of a long window that begins at `begin`.
  static WorldTime ahead_of(WorldTime begin) noexcept;
  /// The unpinned slot that was used longest ago, other than `but`; null if there is none.
  Slot* min_used(const Slot* but) noexcept;
  Slot* find(const store::RowSource& rows, const Wanted& wanted) noexcept;
  /// The slot that a patch or renewal can bring to `rows`, with its changes listed in changed_; null if there
  /// is none.
  Slot* find_near(const store::RowSource& rows, const Wanted& wanted) noexcept;
  /// Stops using a slot that was prepared ahead, in favour of the slot that it replaced. False: there is no
  /// such slot.
  bool step_aside(const Slot& made_ahead) noexcept;
  static std::uint32_t max_patched(const Slot& slot) noexcept;
  static std::uint32_t max_renewed(const Slot& slot) noexcept;
  /// Whether the listed changes are few enough for a patch.
  bool is_patch(const Slot& slot) const noexcept;
  /// Lists the changes up to `rows`. False: they are too many, or they change the set of instances.
  bool list_renewed(Slot& slot, const store::RowSource& rows, const Wanted& wanted) noexcept;
  /// Applies the changes that list_renewed() listed.
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
  /// Records the instances pass for `count` instances from `first` on, or for those that renewed_places_
  /// lists.
  void record_instances(const Slot& slot, std::uint32_t first, std::uint32_t count, bool listed,
                        gpu::Recorder& recorder) const;
  static void learn_levels(Slot& slot);
  /// The tree's current cost divided by its cost after the build.
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
  /// Records a part of the preparation of the slot that follows `used`, which serves a batch without having
  /// been filled for it. Submits nothing.
  void make_ahead(Slot& used, const store::RowSource& rows, const Wanted& wanted,
                  gpu::Recorder& recorder) noexcept;
  /// Whether to begin preparing the slot that follows this one, and with which tree.
  std::optional<TreeAhead> tree_ahead(Slot& used, const store::RowSource& rows,
                                      const Wanted& wanted) const noexcept;
  /// Remaining work for the following slot once it has its tree, in the weights of tlas_ahead.cpp.
  static std::uint64_t work_with_tree(const Slot& slot, std::uint32_t row_count) noexcept;
  static std::uint64_t work_ahead(const Slot& used, std::uint32_t row_count, TreeAhead tree) noexcept;
  void begin_ahead(Slot& used, Slot& slot, const store::RowSource& rows, const Wanted& wanted,
                   TreeAhead tree) noexcept;
  /// Abandons the preparation.
  void drop_ahead() noexcept;
  /// Notes that preparing the slot that follows this one failed, since too many rows changed meanwhile.
  void was_in_vain(Slot& source) noexcept;
  /// The work that a batch at `now` has to do.
  std::uint64_t due_ahead(WorldTime now) const noexcept;
  /// Records about `most` work, at most the rest of the current step. Returns the recorded work.
  std::uint64_t step_ahead(std::uint64_t most, const store::RowSource& rows,
                           gpu::Recorder& recorder) noexcept;
  void copy_rows_ahead(std::uint32_t first, std::uint32_t count, gpu::Recorder& recorder) noexcept;
  /// Brings the rows that have been copied to the version of `rows`. False: too many changed, and the
  /// preparation was abandoned.
  bool catch_up_ahead(const store::RowSource& rows, gpu::Recorder& recorder) noexcept;
  /// Takes the levels of a tree that the device has built.
  void take_tree_ahead() noexcept;
  /// Takes the cost of the finished tree and decides whether the slot will be used.
  void judge_ahead() noexcept;
  Result<void> create_slot(gpu::Device& device, Slot& slot, const std::string& name);

  std::uint32_t max_entities_ = 0;
  std::uint32_t late_base_ = 0;
  bool refits_ = true;
  bool patches_ = true;
  bool makes_ahead_ = true;
  std::uint64_t uses_ = 0;
  std::uint64_t contents_ = 0;  // the last number given to TlasView::contents
  double lead_share_ = 1.0;     // fraction of a window, before its end, at which preparation begins
  std::uint32_t rests_ = 0;  // number of windows still to pass before the next preparation, after failed ones
  Version latest_version_ = 0;  // of the previous batch
  std::vector<Slot> slots_;
  Ahead ahead_;
  std::vector<std::uint32_t> changed_;
  std::uint32_t uploaded_ = 0;  // number of changed_rows_ used by the current batch
  gpu::Buffer changed_rows_;
  gpu::Buffer renewed_places_;
  BuildScratch small_scratch_;
  std::optional<TlasBuilder> large_build_;  // absent when every possible world is small
  TlasPatch patch_;
  gpu::Buffer bounds_;  // of the tree being built
  gpu::Pipeline apply_rows_, instances_pass_, small_build_, refit_, cost_;
  Counts counts_;
};

}  // namespace rtstdb::accel
