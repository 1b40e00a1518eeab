#include "rtstdb/accel/tlas.hpp"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

namespace rtstdb::accel {

Result<Tlas> Tlas::create(gpu::Device& device, const TlasOptions& options) {
  Tlas tlas;
  tlas.refits_ = options.refits;
  tlas.patches_ = options.refits && options.patches;
  tlas.next_slot_ = TlasNextSlot(tlas.patches_ && options.slots > 1, options.max_entities);
  tlas.changed_.reserve(options.max_entities);
  auto passes = TlasPasses::create(device, options.max_entities);
  if (!passes) return passes.error();
  tlas.passes_ = std::move(passes).value();
  tlas.slots_.resize(options.slots);
  for (std::uint32_t i = 0; i < options.slots; ++i) {
    auto created = tlas.passes_.create_slot(device, tlas.slots_[i], "slot " + std::to_string(i));
    if (!created) return created.error();
  }
  return tlas;
}

Result<void> Tlas::bind(gpu::Device& device, const GeometryPool& pool) {
  for (TlasSlot& slot : slots_.all()) {
    if (auto bound = passes_.bind(device, pool, slot); !bound) return bound;
  }
  return {};
}

void Tlas::upload_changes(TlasSlot& slot, const store::RowSource& rows, gpu::Recorder& recorder) {
  counts_.rows += passes_.upload(slot, changed_, rows, recorder);
}

TlasSlot* Tlas::find(const store::RowSource& rows, const TlasRequest& request) noexcept {
  const auto is_there = [&](const TlasSlot& slot) {
    return slot.version == rows.version() && slot.holds(request);
  };
  if (request.slot && is_there(slots_[*request.slot])) return &slots_[*request.slot];
  for (TlasSlot& slot : slots_.all()) {
    if (is_there(slot) && !slot.is_superseded(rows.version(), request)) return &slot;
  }
  return nullptr;
}

TlasSlot* Tlas::find_near(const store::RowSource& rows, const TlasRequest& request) noexcept {
  if (!patches_) return nullptr;
  while (true) {
    // Take the nearest earlier version, so that readers of different versions keep to their own slots.
    TlasSlot* nearest = nullptr;
    for (TlasSlot& slot : slots_.all()) {
      const bool before = slot.version <= rows.version() && slot.holds(request) &&
                          slot.tree != TlasSlot::Tree::none && slot.pins == 0;
      if (before && !slot.is_superseded(rows.version(), request) &&
          (nearest == nullptr || slot.version > nearest->version))
        nearest = &slot;
    }
    if (nearest == nullptr) return nullptr;
    if (list_renewed(*nearest, rows, request)) return nearest;
    if (!next_slot_.retire(*nearest, slots_)) return nullptr;
  }
}

bool Tlas::is_patch(const TlasSlot& slot) const noexcept {
  return changed_.size() <= shared::max_patched && slot.patched + changed_.size() <= slot.max_patched();
}

bool Tlas::list_renewed(TlasSlot& slot, const store::RowSource& rows, const TlasRequest& request) noexcept {
  changed_.clear();
  if (!rows.changed_between(slot.version, changed_) || changed_.size() > slot.max_renewed()) return false;
  const auto places = passes_.listed_places();
  for (std::size_t k = 0; k < changed_.size(); ++k) {
    const std::uint32_t entity = changed_[k];
    const EntityState* state = entity < rows.index_limit() ? rows.row(entity) : nullptr;
    if (presence_of(state) != slot.presence[entity] || state == nullptr) return false;
    places[k] = slot.place[entity];
  }
  // If a slot with another tree is prepared ahead, a degraded tree may be used until that is ready.
  const bool is_followed =
      next_slot_.enabled() && slot.visible_count >= min_made_ahead && slot.is_small(request);
  return is_patch(slot) || may_refit(slot, is_followed ? max_growth_ahead : rebuild_growth);
}

void Tlas::renew(TlasSlot& slot, const store::RowSource& rows, gpu::Recorder& recorder) {
  slot.read_levels();
  const auto listed = static_cast<std::uint32_t>(changed_.size());
  const bool few = is_patch(slot);
  slot.version = rows.version();
  slot.patched = few ? slot.patched + listed : 0;
  counts_.patches += few ? 1 : 0;
  counts_.refits += few ? 0 : 1;
  counts_.renewals += few ? 0 : 1;
  if (listed == 0) return;
  upload_changes(slot, rows, recorder);
  passes_.record_instances(slot, 0, listed, true, recorder);
  if (slot.visible_count == 0) return;
  if (few) {
    passes_.patch(slot, listed, recorder);
  } else {
    passes_.refit(slot, recorder);
    passes_.find_cost(slot, recorder);
  }
}

void Tlas::list_changes(TlasSlot& slot, const store::RowSource& rows) {
  changed_.clear();
  if (slot.filled && rows.changed_between(slot.version, changed_)) return;
  changed_.resize(rows.index_limit());
  std::iota(changed_.begin(), changed_.end(), 0u);
  std::fill(slot.presence.begin() + rows.index_limit(), slot.presence.end(), Presence::absent);
}

bool Tlas::make_tree(TlasSlot& slot, Submit& submit) {
  slot.patched = 0;
  passes_.record_instances(slot, 0, slot.live_count, false, submit.recorder());
  if (slot.visible_count == 0) return true;
  if (may_refit(slot)) {
    passes_.refit(slot, submit.recorder());
    passes_.find_cost(slot, submit.recorder());
    ++counts_.refits;
    if (!passes_.is_large(slot)) return true;
    // After a large change of the world the old topology is useless: check the cost before using it.
    if (!submit.run()) return false;
    submit.begin();
    if (may_refit(slot)) return true;
  }
  if (passes_.is_large(slot)) next_slot_.abandon_build();
  if (!passes_.build(slot, submit)) return false;
  passes_.find_cost(slot, submit.recorder());
  ++counts_.builds;
  return true;
}

/// Compares with the version of the previous batch, whichever slot it used.
bool Tlas::few_changed_lately(const store::RowSource& rows) noexcept {
  changed_.clear();
  return latest_version_ == 0 || latest_version_ >= rows.version() ||
         (rows.changed_between(latest_version_, changed_) &&
          changed_.size() <= std::max(rows.index_limit() / renewed_share, fewest_patched));
}

bool Tlas::fill(TlasSlot& slot, const store::RowSource& rows, const TlasRequest& request, Submit& submit) {
  next_slot_.note_fill(slot);
  // If many entities change with each version, the next one needs a refit in any case.
  const bool reaches_ahead = patches_ && few_changed_lately(rows);
  if (!slot.filled || slot.version != rows.version()) {
    list_changes(slot, rows);
    upload_changes(slot, rows, submit.recorder());
  }
  slot.filled = slot.ready = true;
  slot.followed = false;
  slot.builds_due = 0;
  slot.next = nullptr;
  slot.version = rows.version();
  slot.shapes = request.shapes;
  const auto [first, last] = request.times;
  const bool ahead = reaches_ahead && slot.is_small(request);
  slot.take_window(first, ahead ? std::max(last, long_window_end(first)) : last);
  if (ahead) next_slot_.note_long_window();
  if (make_tree(slot, submit)) return true;
  slot.filled = false;
  slot.tree = TlasSlot::Tree::none;
  return false;
}

std::optional<TlasView> Tlas::prepare(const store::RowSource& rows, const TlasRequest& request,
                                      Submit& submit) {
  passes_.begin_batch();
  next_slot_.collect(passes_);
  TlasSlot* slot = find(rows, request);
  if (slot == nullptr) {
    slot = find_near(rows, request);
    if (slot != nullptr) {
      renew(*slot, rows, submit.recorder());
      slots_.note_change(*slot);
    }
  }
  const bool found = slot != nullptr;
  if (!found) {
    slot = slots_.least_recently_used(nullptr);
    RTSTDB_ASSERT(slot != nullptr, "each slot of a TLAS is in use");
    if (!fill(*slot, rows, request, submit)) return std::nullopt;
    slots_.note_change(*slot);
  }
  slots_.note_use(*slot);
  latest_version_ = rows.version();
  if (found) counts_.rows += next_slot_.prepare(*slot, rows, request, slots_, passes_, submit.recorder());
  return TlasView{.slot = slots_.index_of(*slot),
                  .identities = slot->identities.data(),
                  .root = slot->root(),
                  .entities = slot->visible_count,
                  .epoch = slot->epoch,
                  .late_base = passes_.late_base(),
                  .window_begin = slot->window_begin,
                  .window_end = slot->window_end,
                  .contents = slot->contents};
}

}  // namespace rtstdb::accel
