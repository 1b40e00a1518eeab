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
// (tlas_next_slot.hpp), so that no batch waits for a whole refit or build.
//
// Threads: one. prepare(), pin() and unpin() are called in the tick and do not allocate; the other functions
// are setup.

#include <cstdint>
#include <optional>
#include <vector>

#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/tlas_next_slot.hpp"
#include "rtstdb/accel/tlas_passes.hpp"
#include "rtstdb/accel/tlas_slot.hpp"

namespace rtstdb::accel {

struct TlasOptions {
  std::uint32_t max_entities = 0;
  std::uint32_t slots = 4;
  bool refits = true;   ///< false: build every tree anew (to measure refits)
  bool patches = true;  ///< false: no long windows and no patches (to measure patches)
};

class Tlas {
 public:
  static Result<Tlas> create(gpu::Device& device, const TlasOptions& options);
  /// Binds the passes to the pool. Call again whenever the pool's generation has changed.
  Result<void> bind(gpu::Device& device, const GeometryPool& pool);

  /// Records an empty dispatch of every pass, since drivers compile at the first dispatch.
  void record_warm_up(gpu::Recorder& recorder) const { passes_.record_warm_up(slots_[0], recorder); }

  std::uint32_t slots() const noexcept { return slots_.size(); }
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

  /// Provides a slot that holds `rows` over the requested times. Records the commands into the recorder of
  /// `submit`, which has begun; records nothing if a slot is ready. A build of a world above small_build_max
  /// instances submits and begins again. Empty: the device is lost.
  std::optional<TlasView> prepare(const store::RowSource& rows, const TlasRequest& request, Submit& submit);

  /// Keeps a slot unchanged until unpin(). Calls nest. False: not pinned, since no unpinned slot would be
  /// left.
  bool pin(std::uint32_t slot) noexcept { return slots_.pin(slot); }
  void unpin(std::uint32_t slot) noexcept { slots_.unpin(slot); }

  /// How often slots were brought to a version, by method.
  struct Counts {
    std::uint64_t builds = 0, refits = 0, patches = 0;
    std::uint64_t rows = 0;         ///< rows uploaded to the device
    std::uint64_t renewals = 0;     ///< included in `refits`
    std::uint64_t ahead = 0;        ///< slots that were prepared ahead
    std::uint64_t ahead_built = 0;  ///< included in `ahead`: slots with a tree of their own
  };
  Counts counts() const noexcept {
    Counts counts = counts_;
    counts.ahead = next_slot_.prepared();
    counts.ahead_built = next_slot_.built();
    return counts;
  }

 private:
  TlasSlot* find(const store::RowSource& rows, const TlasRequest& request) noexcept;
  /// The slot that a patch or renewal can bring to `rows`, with its changes listed in changed_; null if there
  /// is none.
  TlasSlot* find_near(const store::RowSource& rows, const TlasRequest& request) noexcept;
  /// Whether the listed changes are few enough for a patch.
  bool is_patch(const TlasSlot& slot) const noexcept;
  /// Lists the changes up to `rows`. False: they are too many, or they change the set of instances.
  bool list_renewed(TlasSlot& slot, const store::RowSource& rows, const TlasRequest& request) noexcept;
  /// Applies the changes that list_renewed() listed.
  void renew(TlasSlot& slot, const store::RowSource& rows, gpu::Recorder& recorder);
  bool few_changed_lately(const store::RowSource& rows) noexcept;
  bool fill(TlasSlot& slot, const store::RowSource& rows, const TlasRequest& request, Submit& submit);
  void list_changes(TlasSlot& slot, const store::RowSource& rows);
  void upload_changes(TlasSlot& slot, const store::RowSource& rows, gpu::Recorder& recorder);
  bool may_refit(TlasSlot& slot, float max_growth = rebuild_growth) const {
    return refits_ && slot.may_refit(max_growth);
  }
  bool make_tree(TlasSlot& slot, Submit& submit);

  bool refits_ = true;
  bool patches_ = true;
  Version latest_version_ = 0;  // of the previous batch
  TlasSlots slots_;
  TlasPasses passes_;
  TlasNextSlot next_slot_;
  std::vector<std::uint32_t> changed_;
  Counts counts_;
};

}  // namespace rtstdb::accel
