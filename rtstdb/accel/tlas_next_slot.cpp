#include "rtstdb/accel/tlas_next_slot.hpp"

#include <algorithm>
#include <utility>

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
constexpr double min_lead_fraction = 0.0625;
constexpr std::uint32_t skipped_windows = 16;
/// A preparation is abandoned for another one when its reader has not returned for this many batches of
/// others.
constexpr std::uint64_t max_patience = 32;

}  // namespace

TlasNextSlot::TlasNextSlot(bool enabled, std::uint32_t max_entities) : enabled_(enabled) {
  changed_.reserve(max_entities);
}

void TlasNextSlot::collect(TlasPasses& passes) noexcept {
  if (current_.slot != nullptr && current_.step == Step::verdict) judge();
  if (current_.slot != nullptr && current_.step == Step::build && passes.large_build().recorded())
    take_tree(passes);
}

std::uint64_t TlasNextSlot::prepare(TlasSlot& used, const store::RowSource& rows, const TlasRequest& request,
                                    TlasSlots& slots, TlasPasses& passes, gpu::Recorder& recorder) noexcept {
  if (!used.is_small(request)) return 0;
  if (current_.source != &used) {
    const auto tree = tree_to_begin(used, rows, request);
    if (!tree) return 0;
    if (current_.slot != nullptr) {
      if (slots.age_of(*current_.slot) < max_patience) return 0;
      abandon();
    }
    TlasSlot* const slot = slots.least_recently_used(&used);
    if (slot == nullptr) return 0;
    // If every slot has a reader, preparing one would take the slot of another reader.
    if (slot->filled && slot->next == nullptr && slots.age_of(*slot) < max_patience) return 0;
    begin(used, *slot, rows, request, *tree, slots, passes);
  }
  slots.note_use(*current_.slot);
  uploaded_rows_ = 0;
  const std::uint64_t due = due_work(request.times.last);
  for (std::uint64_t done = 0; done < due && current_.slot != nullptr;) {
    const std::uint64_t part = record_step(due - done, rows, passes, recorder);
    if (part == 0) break;
    done += part + per_dispatch;
    // The estimate of the total does not include the dispatches that dividing a step adds.
    const bool divides =
        current_.step == Step::build ? passes.large_build().is_within_pass() : current_.next != 0;
    current_.done += part + (divides ? 0 : per_dispatch);
  }
  return uploaded_rows_;
}

std::optional<TlasNextSlot::TreeSource> TlasNextSlot::tree_to_begin(
    TlasSlot& used, const store::RowSource& rows, const TlasRequest& request) const noexcept {
  if (!enabled_ || windows_to_skip_ > 0 || used.followed || used.tree == TlasSlot::Tree::none ||
      used.visible_count < min_made_ahead || used.window_end - used.window_begin < window_ahead ||
      request.times.last >= used.window_end)
    return std::nullopt;
  used.read_levels();
  const float growth = used.growth();
  const bool is_degraded = used.builds_due > 0 || growth > rebuild_growth_ahead;
  const TreeSource tree = is_degraded ? TreeSource::built : TreeSource::copied;
  const double min_lead = growth > rebuild_growth ? 1.0 : tree == TreeSource::built ? 0.5 : 0.25;
  const double wanted_lead =
      static_cast<double>(total_work(used, rows.index_limit(), tree)) / work_of_a_window;
  const double lead = std::clamp(wanted_lead, min_lead, std::max(min_lead, 0.75));
  const double left_s = seconds_between(request.times.last, used.window_end);
  return left_s <= lead * lead_fraction_ * 1e-9 * window_ahead.count() ? std::optional(tree) : std::nullopt;
}

void TlasNextSlot::note_failure(TlasSlot& source) noexcept {
  source.followed = false;
  lead_fraction_ *= 0.5;
  if (lead_fraction_ >= min_lead_fraction) return;
  lead_fraction_ = min_lead_fraction;
  windows_to_skip_ = skipped_windows;
}

/// Work that remains once the slot has its tree.
std::uint64_t TlasNextSlot::work_with_tree(const TlasSlot& slot, std::uint32_t row_count) noexcept {
  const std::uint64_t nodes = slot.levels.back();
  const std::uint64_t dispatches =
      slot.levels.size() + 4;  // rows, instances, boxes of each level, parents, cost
  return nodes * (per_node + per_parent) + row_count * per_row + slot.live_count * per_instance +
         dispatches * per_dispatch;
}

std::uint64_t TlasNextSlot::total_work(const TlasSlot& used, std::uint32_t row_count,
                                       TreeSource tree) noexcept {
  const std::uint64_t for_tree =
      tree == TreeSource::built
          ? TlasBuilder::work(used.visible_count) + TlasBuilder::passes(used.visible_count) * per_dispatch
          : used.levels.back() * per_copied_node + per_dispatch;
  return for_tree + work_with_tree(used, row_count);
}

void TlasNextSlot::abandon() noexcept {
  current_.slot->filled = false;
  current_ = {};
}

void TlasNextSlot::begin(TlasSlot& used, TlasSlot& slot, const store::RowSource& rows,
                         const TlasRequest& request, TreeSource tree, TlasSlots& slots,
                         TlasPasses& passes) noexcept {
  const bool builds = tree == TreeSource::built;
  used.followed = true;
  const std::uint32_t row_count = rows.index_limit();
  current_ = {
      .slot = &slot,
      .source = &used,
      .begun = request.times.last,
      .due = builds ? std::min(used.window_end, request.times.last + rebuilt_ahead_within) : used.window_end,
      .step = builds ? Step::build : Step::tree,
      .row_count = row_count,
      .tree = tree,
      .level = used.levels.size() - 2,
      .total = total_work(used, row_count, tree)};
  if (builds) passes.large_build().begin(used.visible_count);
  slot.filled = true;
  slot.ready = slot.followed = false;
  slots.note_change(slot);
  slot.shapes = used.shapes;
  slot.take_window(request.times.first, long_window_end(request.times.first));
  slot.live_count = used.live_count;
  slot.visible_count = used.visible_count;
  slot.patched = 0;
  slot.next = nullptr;
  slot.patch.stamp = 0;
  slot.tree = TlasSlot::Tree::known;
  slot.levels = used.levels;
  slot.built_cost = builds ? 0.0f : used.built_cost;
  slot.builds_due = used.builds_due > 0 ? used.builds_due - 1 : 0;
  slot.presence = used.presence;
}

/// The elapsed fraction of the available time times 1.5, in work.
std::uint64_t TlasNextSlot::due_work(WorldTime now) const noexcept {
  const double share =
      1.5 * seconds_between(current_.begun, now) / seconds_between(current_.begun, current_.due);
  const auto wanted =
      static_cast<std::uint64_t>(std::clamp(share, 0.0, 1.0) * static_cast<double>(current_.total));
  return std::max(wanted > current_.done ? wanted - current_.done : 0, min_share);
}

std::uint64_t TlasNextSlot::record_step(std::uint64_t max_work, const store::RowSource& rows,
                                        TlasPasses& passes, gpu::Recorder& recorder) noexcept {
  TlasSlot& slot = *current_.slot;
  const std::uint32_t first = current_.next;
  // Takes as many elements as fit into `max_work`.
  const auto take = [&](std::uint32_t end, std::uint64_t weight) {
    const auto count =
        static_cast<std::uint32_t>(std::min<std::uint64_t>(end - first, max_work / weight + 1));
    current_.next += count;
    return count;
  };
  const auto done_at = [&](std::uint32_t end, Step next) {
    if (current_.next < end) return;
    current_.step = next;
    current_.next = 0;
    recorder.barrier();
  };
  switch (current_.step) {
    case Step::build:
      return passes.large_build().record(max_work, &current_.source->large_build, slot.large_build, recorder);
    case Step::tree: {
      const std::uint32_t count = take(slot.levels.back(), per_copied_node);
      constexpr std::size_t node_bytes = 16 * std::size_t{shared::tlas_node_texels};
      recorder.copy(current_.source->nodes, first * node_bytes, slot.nodes, first * node_bytes,
                    count * node_bytes);
      done_at(slot.levels.back(), Step::rows);
      return count * per_copied_node;
    }
    case Step::rows: {
      if (first > 0 && !catch_up(rows, passes, recorder)) return 0;
      slot.version = rows.version();
      const std::uint32_t count = take(current_.row_count, per_row);
      copy_rows(first, count, recorder);
      done_at(current_.row_count, Step::instances);
      return count * per_row;
    }
    case Step::instances: {
      const std::uint32_t count = take(slot.live_count, per_instance);
      passes.record_instances(slot, first, count, false, recorder);
      done_at(slot.live_count, Step::boxes);
      return count * per_instance;
    }
    case Step::boxes: {
      // From the deepest level up.
      const std::uint32_t begin = slot.levels[current_.level];
      const std::uint32_t nodes = slot.levels[current_.level + 1] - begin;
      const std::uint32_t count = take(nodes, per_node);
      passes.refit_nodes(slot, begin + first, count, recorder);
      const bool top = current_.level == 0;
      if (current_.next == nodes && !top) --current_.level;
      done_at(nodes, top ? Step::parents : Step::boxes);
      return count * per_node;
    }
    case Step::parents: {
      const std::uint32_t count = take(slot.levels.back(), per_parent);
      passes.find_parents(slot, first, count, recorder);
      done_at(slot.levels.back(), Step::cost);
      return count * per_parent;
    }
    case Step::cost:
      passes.find_cost(slot, recorder);
      current_.step = Step::verdict;
      return 1;
    case Step::verdict:
      break;
  }
  return 0;
}

void TlasNextSlot::copy_rows(std::uint32_t first, std::uint32_t count, gpu::Recorder& recorder) noexcept {
  const TlasSlot& source = *current_.source;
  TlasSlot& slot = *current_.slot;
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

bool TlasNextSlot::catch_up(const store::RowSource& rows, TlasPasses& passes,
                            gpu::Recorder& recorder) noexcept {
  TlasSlot& slot = *current_.slot;
  changed_.clear();
  const std::size_t max_changed = std::min<std::size_t>(slot.max_patched(), passes.upload_capacity());
  if (!rows.changed_between(slot.version, changed_) || changed_.size() > max_changed) {
    note_failure(*current_.source);
    abandon();
    return false;
  }
  if (!changed_.empty()) uploaded_rows_ += passes.upload(slot, changed_, rows, recorder);
  return true;
}

void TlasNextSlot::take_tree(TlasPasses& passes) noexcept {
  TlasSlot& slot = *current_.slot;
  if (!passes.large_build().take_levels(slot.levels)) return;
  current_.step = Step::rows;
  current_.level = slot.levels.size() - 2;
  current_.total = current_.done + work_with_tree(slot, current_.row_count);
}

/// A slot with a useless tree is not used; a tree is then built when the window ends. A slot with a degraded
/// tree is used while another one is prepared.
void TlasNextSlot::judge() noexcept {
  const Preparation made = std::exchange(current_, {});
  const float growth = made.slot->growth();
  if (growth > max_growth_ahead) return;
  if (growth > rebuild_growth_ahead) made.slot->builds_due = rebuilds_ahead;
  made.slot->ready = true;
  made.source->next = made.slot;
  lead_fraction_ = std::min(1.1 * lead_fraction_, 1.0);
  ++prepared_;
  built_ += made.tree == TreeSource::built ? 1 : 0;
}

void TlasNextSlot::note_fill(const TlasSlot& slot) noexcept {
  if (current_.slot == &slot || current_.source == &slot) abandon();
}

void TlasNextSlot::note_long_window() noexcept {
  if (windows_to_skip_ > 0) --windows_to_skip_;
}

void TlasNextSlot::abandon_build() noexcept {
  if (current_.slot != nullptr && current_.step == Step::build) abandon();
}

bool TlasNextSlot::retire(const TlasSlot& prepared, TlasSlots& slots) noexcept {
  bool any = false;
  for (TlasSlot& slot : slots.all()) {
    if (slot.next != &prepared) continue;
    slot.next = nullptr;
    note_failure(slot);
    any = true;
  }
  return any;
}

}  // namespace rtstdb::accel
