// Prepares the slot for the window after a long one while that window lasts. Each batch of the last part of
// the window records a share, so that the slot is ready in time and no batch waits for the whole. The new
// slot copies the tree of the slot in use, or, if that tree has degraded, gets one that is built over the
// instances at the end of the window in use. It then gets instances and boxes for its own window. Rows are
// copied over several batches. Rows that change meanwhile are uploaded again by each batch, so that the
// copied rows are always those of one version, which may be one that was discarded.

#include <algorithm>
#include <utility>

#include "rtstdb/accel/tlas.hpp"
#include "shaders/shared/node.h"

namespace rtstdb::accel {
namespace {

// Work of a step per element that it processes, relative to the copy of a row.
constexpr std::uint64_t per_copied_node = 1;
constexpr std::uint64_t per_row = 1;
constexpr std::uint64_t per_instance = 4;
constexpr std::uint64_t per_node = 16;
constexpr std::uint64_t per_parent = 6;
/// Additional work of any dispatch.
constexpr std::uint64_t per_dispatch = 1'500;
/// The least work of a batch; less would hardly take less time.
constexpr std::uint64_t min_share = 3'000;
/// Preparation begins in the last quarter of a window, earlier for more work than this, at most in its last
/// three quarters. A preparation with a build begins in the last half, since the host has to read the levels
/// in between; with a badly degraded tree, at once.
constexpr double work_of_a_window = 1e6;
/// If more rows change during a preparation than a renewal can apply, the next preparation begins later, down
/// to this fraction of a window. If that also fails, this many windows pass without preparation.
constexpr double min_lead_share = 0.0625;
constexpr std::uint32_t rests_in_vain = 16;
/// A preparation is abandoned for another one when its reader has not returned for this many batches of
/// others.
constexpr std::uint64_t max_patience = 32;

}  // namespace

void Tlas::make_ahead(Slot& used, const store::RowSource& rows, const Wanted& wanted,
                      gpu::Recorder& recorder) noexcept {
  if (!is_small(used, wanted)) return;
  if (ahead_.source != &used) {
    const auto tree = tree_ahead(used, rows, wanted);
    if (!tree) return;
    if (ahead_.slot != nullptr) {
      if (uses_ - ahead_.slot->last_used < max_patience) return;
      drop_ahead();
    }
    Slot* const slot = min_used(&used);
    if (slot == nullptr) return;
    // If every slot has a reader, preparing one would take the slot of another reader.
    if (slot->filled && slot->next == nullptr && uses_ - slot->last_used < max_patience) return;
    begin_ahead(used, *slot, rows, wanted, *tree);
  }
  ahead_.slot->last_used = ++uses_;
  const std::uint64_t due = due_ahead(wanted.times.last);
  for (std::uint64_t done = 0; done < due && ahead_.slot != nullptr;) {
    const std::uint64_t part = step_ahead(due - done, rows, recorder);
    if (part == 0) break;
    done += part + per_dispatch;
    // The estimate of the total does not include the dispatches that dividing a step adds.
    const bool divides =
        ahead_.step == Ahead::Step::build ? large_build_->is_within_pass() : ahead_.next != 0;
    ahead_.done += part + (divides ? 0 : per_dispatch);
  }
}

std::optional<Tlas::TreeAhead> Tlas::tree_ahead(Slot& used, const store::RowSource& rows,
                                                const Wanted& wanted) const noexcept {
  if (!makes_ahead_ || rests_ > 0 || used.followed || used.tree == Tree::none ||
      used.visible_count < min_made_ahead || used.window_end - used.window_begin < window_ahead ||
      wanted.times.last >= used.window_end)
    return std::nullopt;
  learn_levels(used);
  const float growth = growth_of(used);
  const bool is_degraded = used.rebuilds > 0 || growth > rebuild_growth_ahead;
  const TreeAhead tree = is_degraded ? TreeAhead::built : TreeAhead::copied;
  const double min_lead = growth > rebuild_growth ? 1.0 : tree == TreeAhead::built ? 0.5 : 0.25;
  const double wanted_lead =
      static_cast<double>(work_ahead(used, rows.index_limit(), tree)) / work_of_a_window;
  const double lead = std::clamp(wanted_lead, min_lead, std::max(min_lead, 0.75));
  const double left_s = seconds_between(wanted.times.last, used.window_end);
  return left_s <= lead * lead_share_ * 1e-9 * window_ahead.count() ? std::optional(tree) : std::nullopt;
}

void Tlas::was_in_vain(Slot& source) noexcept {
  source.followed = false;
  lead_share_ *= 0.5;
  if (lead_share_ >= min_lead_share) return;
  lead_share_ = min_lead_share;
  rests_ = rests_in_vain;
}

/// Work that remains once the slot has its tree.
std::uint64_t Tlas::work_with_tree(const Slot& slot, std::uint32_t row_count) noexcept {
  const std::uint64_t nodes = slot.levels.back();
  const std::uint64_t dispatches =
      slot.levels.size() + 4;  // rows, instances, boxes of each level, parents, cost
  return nodes * (per_node + per_parent) + row_count * per_row + slot.live_count * per_instance +
         dispatches * per_dispatch;
}

std::uint64_t Tlas::work_ahead(const Slot& used, std::uint32_t row_count, TreeAhead tree) noexcept {
  const std::uint64_t for_tree =
      tree == TreeAhead::built
          ? TlasBuilder::work(used.visible_count) + TlasBuilder::passes(used.visible_count) * per_dispatch
          : used.levels.back() * per_copied_node + per_dispatch;
  return for_tree + work_with_tree(used, row_count);
}

void Tlas::drop_ahead() noexcept {
  ahead_.slot->filled = false;
  ahead_ = {};
}

void Tlas::begin_ahead(Slot& used, Slot& slot, const store::RowSource& rows, const Wanted& wanted,
                       TreeAhead tree) noexcept {
  const bool builds = tree == TreeAhead::built;
  used.followed = true;
  const std::uint32_t row_count = rows.index_limit();
  ahead_ = {
      .slot = &slot,
      .source = &used,
      .begun = wanted.times.last,
      .due = builds ? std::min(used.window_end, wanted.times.last + rebuilt_ahead_within) : used.window_end,
      .step = builds ? Ahead::Step::build : Ahead::Step::tree,
      .row_count = row_count,
      .tree = tree,
      .level = used.levels.size() - 2,
      .total = work_ahead(used, row_count, tree)};
  if (builds) large_build_->begin(used.visible_count);
  slot.filled = true;
  slot.made = slot.followed = false;
  slot.contents = ++contents_;
  slot.shapes = used.shapes;
  slot.take_window(wanted.times.first, ahead_of(wanted.times.first));
  slot.live_count = used.live_count;
  slot.visible_count = used.visible_count;
  slot.patched = 0;
  slot.next = nullptr;
  slot.patch.stamp = 0;
  slot.tree = Tree::known;
  slot.levels = used.levels;
  slot.built_cost = builds ? 0.0f : used.built_cost;
  slot.rebuilds = used.rebuilds > 0 ? used.rebuilds - 1 : 0;
  slot.presence = used.presence;
}

/// The elapsed fraction of the available time times 1.5, in work.
std::uint64_t Tlas::due_ahead(WorldTime now) const noexcept {
  const double share = 1.5 * seconds_between(ahead_.begun, now) / seconds_between(ahead_.begun, ahead_.due);
  const auto wanted =
      static_cast<std::uint64_t>(std::clamp(share, 0.0, 1.0) * static_cast<double>(ahead_.total));
  return std::max(wanted > ahead_.done ? wanted - ahead_.done : 0, min_share);
}

std::uint64_t Tlas::step_ahead(std::uint64_t most, const store::RowSource& rows,
                               gpu::Recorder& recorder) noexcept {
  Slot& slot = *ahead_.slot;
  const std::uint32_t first = ahead_.next;
  // Takes as many elements as fit into `most`.
  const auto take = [&](std::uint32_t end, std::uint64_t weight) {
    const auto count = static_cast<std::uint32_t>(std::min<std::uint64_t>(end - first, most / weight + 1));
    ahead_.next += count;
    return count;
  };
  const auto done_at = [&](std::uint32_t end, Ahead::Step next) {
    if (ahead_.next < end) return;
    ahead_.step = next;
    ahead_.next = 0;
    recorder.barrier();
  };
  switch (ahead_.step) {
    case Ahead::Step::build:
      return large_build_->record(most, &ahead_.source->large_build, slot.large_build, recorder);
    case Ahead::Step::tree: {
      const std::uint32_t count = take(slot.levels.back(), per_copied_node);
      constexpr std::size_t node_bytes = 16 * std::size_t{shared::tlas_node_texels};
      recorder.copy(ahead_.source->nodes, first * node_bytes, slot.nodes, first * node_bytes,
                    count * node_bytes);
      done_at(slot.levels.back(), Ahead::Step::rows);
      return count * per_copied_node;
    }
    case Ahead::Step::rows: {
      if (first > 0 && !catch_up_ahead(rows, recorder)) return 0;
      slot.version = rows.version();
      const std::uint32_t count = take(ahead_.row_count, per_row);
      copy_rows_ahead(first, count, recorder);
      done_at(ahead_.row_count, Ahead::Step::instances);
      return count * per_row;
    }
    case Ahead::Step::instances: {
      const std::uint32_t count = take(slot.live_count, per_instance);
      record_instances(slot, first, count, false, recorder);
      done_at(slot.live_count, Ahead::Step::boxes);
      return count * per_instance;
    }
    case Ahead::Step::boxes: {
      // From the deepest level up.
      const std::uint32_t begin = slot.levels[ahead_.level];
      const std::uint32_t nodes = slot.levels[ahead_.level + 1] - begin;
      const std::uint32_t count = take(nodes, per_node);
      refit_nodes(slot, begin + first, count, recorder);
      const bool top = ahead_.level == 0;
      if (ahead_.next == nodes && !top) --ahead_.level;
      done_at(nodes, top ? Ahead::Step::parents : Ahead::Step::boxes);
      return count * per_node;
    }
    case Ahead::Step::parents: {
      const std::uint32_t count = take(slot.levels.back(), per_parent);
      patch_.find_parents(first, count, slot.patch, recorder);
      done_at(slot.levels.back(), Ahead::Step::cost);
      return count * per_parent;
    }
    case Ahead::Step::cost:
      find_cost(slot, recorder);
      ahead_.step = Ahead::Step::verdict;
      return 1;
    case Ahead::Step::verdict:
      break;
  }
  return 0;
}

void Tlas::copy_rows_ahead(std::uint32_t first, std::uint32_t count, gpu::Recorder& recorder) noexcept {
  const Slot& source = *ahead_.source;
  Slot& slot = *ahead_.slot;
  constexpr std::size_t row_bytes = sizeof(shared::EntityRecord);
  recorder.copy(source.rows, first * row_bytes, slot.rows, first * row_bytes, count * row_bytes);
  const auto live = slot.live.host_as<std::uint32_t>();
  const auto places = slot.places.host_as<std::uint32_t>();
  const auto identity_texels = slot.identity_texels.host_as<Identity>();
  for (std::uint32_t entity = first; entity < first + count; ++entity) {
    if (slot.presence[entity] == Presence::absent) continue;
    slot.place[entity] = places[entity] = source.place[entity];
    live[slot.place[entity]] = entity;
    slot.identities[entity] = identity_texels[entity] = source.identities[entity];
  }
}

bool Tlas::catch_up_ahead(const store::RowSource& rows, gpu::Recorder& recorder) noexcept {
  Slot& slot = *ahead_.slot;
  changed_.clear();
  const std::size_t most = std::min(max_patched(slot), max_entities_ - uploaded_);
  if (!rows.changed_between(slot.version, changed_) || changed_.size() > most) {
    was_in_vain(*ahead_.source);
    drop_ahead();
    return false;
  }
  if (!changed_.empty()) upload_changes(slot, rows, recorder);
  return true;
}

void Tlas::take_tree_ahead() noexcept {
  Slot& slot = *ahead_.slot;
  if (!large_build_->take_levels(slot.levels)) return;
  ahead_.step = Ahead::Step::rows;
  ahead_.level = slot.levels.size() - 2;
  ahead_.total = ahead_.done + work_with_tree(slot, ahead_.row_count);
}

/// A slot with a useless tree is not used; a tree is then built when the window ends. A slot with a degraded
/// tree is used while another one is prepared.
void Tlas::judge_ahead() noexcept {
  const Ahead made = std::exchange(ahead_, {});
  const float growth = growth_of(*made.slot);
  if (growth > max_growth_ahead) return;
  if (growth > rebuild_growth_ahead) made.slot->rebuilds = rebuilds_ahead;
  made.slot->made = true;
  made.source->next = made.slot;
  lead_share_ = std::min(1.1 * lead_share_, 1.0);
  ++counts_.ahead;
  counts_.ahead_built += made.tree == TreeAhead::built ? 1 : 0;
}

}  // namespace rtstdb::accel
