#include "rtstdb/accel/tlas.hpp"

#include <algorithm>
#include <numeric>

#include "shaders/shared/node.h"

namespace rtstdb::accel {
namespace {

glm::uvec2 words_of(WorldTime time) noexcept {
  const auto bits = static_cast<std::uint64_t>(time.time_since_epoch().count());
  return {static_cast<std::uint32_t>(bits), static_cast<std::uint32_t>(bits >> 32)};
}

/// The part that single precision does not represent.
glm::vec3 low_part(const glm::dvec3& v) noexcept {
  return glm::vec3(v - glm::dvec3(glm::vec3(v)));
}

/// The last multiple of epoch_length that is not after `t`.
WorldTime epoch_of(WorldTime t) noexcept {
  const std::int64_t rest_ns = t.time_since_epoch().count() % epoch_length.count();
  return t - Nanoseconds(rest_ns < 0 ? rest_ns + epoch_length.count() : rest_ns);
}

shared::EntityRecord record_of(const EntityState& state) noexcept {
  const Motion& motion = state.row.motion;
  return {.p_world_m = glm::vec3(motion.p_world_m),
          .mask = state.row.mask,
          .q_world = glm::vec4(motion.q_world.x, motion.q_world.y, motion.q_world.z, motion.q_world.w),
          .v_world_mps = glm::vec3(motion.v_world_mps),
          .geometry = state.row.geometry.index,
          .w_world_radps = glm::vec3(motion.w_world_radps),
          .index = state.id.index,
          .scale = glm::vec3(state.row.scale),
          .material = state.row.material,
          .valid_from = words_of(motion.valid_from),
          .p_low_m = low_part(motion.p_world_m),
          .v_low_mps = low_part(motion.v_world_mps),
          .w_low_radps = low_part(motion.w_world_radps),
          .unused = 0};
}

/// Rounded up, so that it is never shorter than the window.
float window_seconds(WorldTime begin, WorldTime end) noexcept {
  return static_cast<float>(seconds_between(begin, end) * (1.0 + 1e-6));
}

}  // namespace

Moment TlasView::moment(WorldTime t) const noexcept {
  const WorldTime late_epoch = epoch + epoch_length;
  const bool late = t >= late_epoch;
  const double window_s = seconds_between(window_begin, window_end);
  return {.t_ns = static_cast<std::int32_t>((t - (late ? late_epoch : epoch)).count()),
          .instance_base = late ? late_base : 0,
          .share = window_s > 0.0 ? static_cast<float>(seconds_between(window_begin, t) / window_s) : 0.0f};
}

std::uint32_t Tlas::Slot::root() const noexcept {
  return visible_count == 0 ? shared::ref_none : 0;
}

void Tlas::Slot::take_window(WorldTime begin, WorldTime end) noexcept {
  window_begin = begin;
  window_end = end;
  epoch = epoch_of(begin);
}

bool Tlas::Slot::holds(const Wanted& wanted) const noexcept {
  return filled && made && shapes == wanted.shapes && window_begin <= wanted.times.first &&
         wanted.times.last <= window_end;
}

bool Tlas::Slot::is_superseded(Version reader_version, const Wanted& wanted) const noexcept {
  return next != nullptr && next->version <= reader_version && next->tree != Tree::none &&
         next->holds(wanted);
}

WorldTime Tlas::ahead_of(WorldTime begin) noexcept {
  constexpr WorldTime last = world_time_ns(max_world_time_ns);
  return last - begin < window_ahead ? last : begin + window_ahead;
}

Tlas::Slot* Tlas::min_used(const Slot* but) noexcept {
  Slot* least = nullptr;
  for (Slot& slot : slots_) {
    if (&slot != but && slot.pins == 0 && (least == nullptr || slot.last_used < least->last_used))
      least = &slot;
  }
  return least;
}

bool Tlas::pin(std::uint32_t slot) noexcept {
  const auto pinned = std::ranges::count_if(slots_, [](const Slot& one) { return one.pins > 0; });
  if (slots_[slot].pins == 0 && pinned + 2 > std::ssize(slots_)) return false;
  ++slots_[slot].pins;
  return true;
}

void Tlas::unpin(std::uint32_t slot) noexcept {
  RTSTDB_ASSERT(slots_[slot].pins > 0);
  --slots_[slot].pins;
}

Tlas::Slot* Tlas::find(const store::RowSource& rows, const Wanted& wanted) noexcept {
  const auto is_there = [&](const Slot& slot) {
    return slot.version == rows.version() && slot.holds(wanted);
  };
  if (wanted.slot && is_there(slots_[*wanted.slot])) return &slots_[*wanted.slot];
  for (Slot& slot : slots_) {
    if (is_there(slot) && !slot.is_superseded(rows.version(), wanted)) return &slot;
  }
  return nullptr;
}

Tlas::Slot* Tlas::find_near(const store::RowSource& rows, const Wanted& wanted) noexcept {
  if (!patches_) return nullptr;
  while (true) {
    // Take the nearest earlier version, so that readers of different versions keep to their own slots.
    Slot* nearest = nullptr;
    for (Slot& slot : slots_) {
      const bool before =
          slot.version <= rows.version() && slot.holds(wanted) && slot.tree != Tree::none && slot.pins == 0;
      if (before && !slot.is_superseded(rows.version(), wanted) &&
          (nearest == nullptr || slot.version > nearest->version))
        nearest = &slot;
    }
    if (nearest == nullptr) return nullptr;
    if (list_renewed(*nearest, rows, wanted)) return nearest;
    if (!step_aside(*nearest)) return nullptr;
  }
}

bool Tlas::step_aside(const Slot& made_ahead) noexcept {
  bool any = false;
  for (Slot& slot : slots_) {
    if (slot.next != &made_ahead) continue;
    slot.next = nullptr;
    was_in_vain(slot);
    any = true;
  }
  return any;
}

std::uint32_t Tlas::max_patched(const Slot& slot) noexcept {
  return std::max(slot.visible_count / patched_share, fewest_patched);
}

bool Tlas::is_patch(const Slot& slot) const noexcept {
  return changed_.size() <= shared::max_patched && slot.patched + changed_.size() <= max_patched(slot);
}

std::uint32_t Tlas::max_renewed(const Slot& slot) noexcept {
  return std::max(slot.visible_count / renewed_share, max_patched(slot));
}

bool Tlas::list_renewed(Slot& slot, const store::RowSource& rows, const Wanted& wanted) noexcept {
  changed_.clear();
  if (!rows.changed_between(slot.version, changed_) || changed_.size() > max_renewed(slot)) return false;
  const auto places = renewed_places_.host_as<std::uint32_t>();
  for (std::size_t k = 0; k < changed_.size(); ++k) {
    const std::uint32_t entity = changed_[k];
    const EntityState* state = entity < rows.index_limit() ? rows.row(entity) : nullptr;
    if (presence_of(state) != slot.presence[entity] || state == nullptr) return false;
    places[k] = slot.place[entity];
  }
  // If a slot with another tree is prepared ahead, a degraded tree may be used until that is ready.
  const bool is_followed = makes_ahead_ && slot.visible_count >= min_made_ahead && is_small(slot, wanted);
  return is_patch(slot) || may_refit(slot, is_followed ? max_growth_ahead : rebuild_growth);
}

void Tlas::renew(Slot& slot, const store::RowSource& rows, gpu::Recorder& recorder) {
  learn_levels(slot);
  const auto listed = static_cast<std::uint32_t>(changed_.size());
  const bool few = is_patch(slot);
  slot.version = rows.version();
  slot.patched = few ? slot.patched + listed : 0;
  counts_.patches += few ? 1 : 0;
  counts_.refits += few ? 0 : 1;
  counts_.renewals += few ? 0 : 1;
  if (listed == 0) return;
  upload_changes(slot, rows, recorder);
  record_instances(slot, 0, listed, true, recorder);
  if (slot.visible_count == 0) return;
  if (few) {
    patch_.record(listed, slot.visible_count, slot.levels, slot.patch, recorder);
  } else {
    refit(slot, recorder);
    find_cost(slot, recorder);
  }
}

void Tlas::list_live(Slot& slot, std::uint32_t index_limit) {
  const auto live = slot.live.host_as<std::uint32_t>();
  const auto places = slot.places.host_as<std::uint32_t>();
  slot.live_count = 0;
  for (const Presence wanted : {Presence::visible, Presence::hidden}) {
    for (std::uint32_t entity = 0; entity < index_limit; ++entity) {
      if (slot.presence[entity] != wanted) continue;
      slot.place[entity] = slot.live_count;
      places[entity] = slot.live_count;
      live[slot.live_count++] = entity;
    }
    if (wanted == Presence::visible) slot.visible_count = slot.live_count;
  }
}

Tlas::Presence Tlas::presence_of(const EntityState* state) noexcept {
  if (state == nullptr) return Presence::absent;
  return state->row.geometry.valid() ? Presence::visible : Presence::hidden;
}

void Tlas::list_changes(Slot& slot, const store::RowSource& rows) {
  changed_.clear();
  if (slot.filled && rows.changed_between(slot.version, changed_)) return;
  changed_.resize(rows.index_limit());
  std::iota(changed_.begin(), changed_.end(), 0u);
  std::fill(slot.presence.begin() + rows.index_limit(), slot.presence.end(), Presence::absent);
}

/// Uploads the rows of the entities in changed_.
void Tlas::upload_changes(Slot& slot, const store::RowSource& rows, gpu::Recorder& recorder) {
  const auto records = changed_rows_.host_as<shared::EntityRecord>().subspan(uploaded_);
  const auto identity_texels = slot.identity_texels.host_as<Identity>();
  std::uint32_t count = 0;
  bool in_a_row = true;  // the changed entities are consecutive
  bool list_changed = !slot.filled;
  for (const std::uint32_t entity : changed_) {
    const EntityState* state = entity < rows.index_limit() ? rows.row(entity) : nullptr;
    const Presence presence = presence_of(state);
    if (state != nullptr) {
      in_a_row = in_a_row && entity == changed_.front() + count;
      records[count++] = record_of(*state);
      slot.identities[entity] = {state->id, state->row.mask, state->row.material};
      identity_texels[entity] = slot.identities[entity];
    }
    list_changed = list_changed || presence != slot.presence[entity];
    slot.presence[entity] = presence;
  }
  counts_.rows += count;
  if (list_changed) {
    list_live(slot, max_entities_);
    slot.tree = Tree::none;
  }
  if (in_a_row && count != 0) {
    // All entities have typically changed then, and a copy is several times faster than the pass.
    constexpr std::size_t row_bytes = sizeof(shared::EntityRecord);
    recorder.copy(changed_rows_, uploaded_ * row_bytes, slot.rows, changed_.front() * row_bytes,
                  count * row_bytes);
  } else {
    recorder.dispatch(apply_rows_, slot.apply_rows, shared::ApplyRowsArgs{.first = uploaded_, .count = count},
                      (count + 63) / 64);
  }
  uploaded_ += count;
  recorder.barrier();
}

void Tlas::record_instances(const Slot& slot, std::uint32_t first, std::uint32_t count, bool listed,
                            gpu::Recorder& recorder) const {
  const WorldTime late_epoch = slot.epoch + epoch_length;
  const shared::InstanceArgs args{.epoch = words_of(slot.epoch),
                                  .late_epoch = words_of(late_epoch),
                                  .window_begin = words_of(slot.window_begin),
                                  .window_s = window_seconds(slot.window_begin, slot.window_end),
                                  .meets_late = slot.window_end >= late_epoch ? 1u : 0u,
                                  .first = first,
                                  .count = count,
                                  .visible_count = slot.visible_count,
                                  .listed = listed ? 1u : 0u};
  recorder.dispatch(instances_pass_, slot.instances_pass, args, (count + 63) / 64);
  recorder.barrier();
}

/// Reads the levels of the slot's last tree, whose build has finished.
void Tlas::learn_levels(Slot& slot) {
  if (slot.tree != Tree::unknown) return;
  const auto levels = slot.levels_readback.host_as<const std::uint32_t>();
  slot.levels.assign(levels.begin() + 1, levels.begin() + 2 + levels[0]);
  slot.tree = Tree::known;
}

float Tlas::growth_of(Slot& slot) noexcept {
  const float cost = slot.cost_readback.host_as<const float>()[0];
  if (slot.built_cost == 0.0f) slot.built_cost = cost;
  return cost > slot.built_cost ? cost / slot.built_cost : 1.0f;
}

bool Tlas::may_refit(Slot& slot, float max_growth) {
  if (slot.tree == Tree::none || !refits_) return false;
  learn_levels(slot);
  return growth_of(slot) <= max_growth;
}

/// From the deepest level up.
void Tlas::refit(const Slot& slot, gpu::Recorder& recorder) const {
  for (std::size_t level = slot.levels.size() - 1; level-- > 0;)
    refit_nodes(slot, slot.levels[level], slot.levels[level + 1] - slot.levels[level], recorder);
}

void Tlas::refit_nodes(const Slot& slot, std::uint32_t first, std::uint32_t count,
                       gpu::Recorder& recorder) const {
  const shared::RefitArgs args{.first = first, .count = count, .still = 0, .node_boxes = max_entities_};
  recorder.dispatch(refit_, slot.refit, args, (count + 63) / 64);
  recorder.barrier();
}

bool Tlas::build(Slot& slot, Submit& submit) {
  slot.built_cost = 0.0f;
  slot.patch.stamp = 0;
  if (slot.visible_count <= shared::small_build_max) {
    const shared::SmallBuildArgs args{
        .count = slot.visible_count, .half_size = BuildScratch::half_size, .node_boxes = max_entities_};
    submit.recorder().dispatch(small_build_, slot.small_build, args, 1);
    submit.recorder().barrier();
    slot.tree = Tree::unknown;
    return true;
  }
  if (ahead_.slot != nullptr && ahead_.step == Ahead::Step::build) drop_ahead();
  const bool built = large_build_->run(slot.visible_count, slot.large_build, submit, slot.levels);
  if (!built) return false;
  slot.tree = Tree::known;
  submit.begin();
  refit(slot, submit.recorder());
  return true;
}

void Tlas::find_cost(const Slot& slot, gpu::Recorder& recorder) const {
  // A tree of n leaves has at least n / 8 nodes. A fixed number of nodes makes the costs of one world
  // comparable.
  const std::uint32_t nodes = 1 + slot.visible_count / shared::node_width;
  const shared::RefitArgs args{.first = 0,
                               .count = std::min(nodes, shared::max_cost_nodes),
                               .still = slot.window_begin == slot.window_end ? 1u : 0u,
                               .node_boxes = max_entities_};
  recorder.dispatch(cost_, slot.cost, args, 1);
  recorder.barrier();
}

bool Tlas::make_tree(Slot& slot, Submit& submit) {
  slot.patched = 0;
  make_instances(slot, submit.recorder());
  if (slot.visible_count == 0) return true;
  if (may_refit(slot)) {
    refit(slot, submit.recorder());
    find_cost(slot, submit.recorder());
    ++counts_.refits;
    if (slot.visible_count <= shared::small_build_max) return true;
    // After a large change of the world the old topology is useless: check the cost before using it.
    if (!submit.run()) return false;
    submit.begin();
    if (may_refit(slot)) return true;
  }
  if (!build(slot, submit)) return false;
  find_cost(slot, submit.recorder());
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

bool Tlas::fill(Slot& slot, const store::RowSource& rows, const Wanted& wanted, Submit& submit) {
  if (ahead_.slot == &slot || ahead_.source == &slot) drop_ahead();
  // If many entities change with each version, the next one needs a refit in any case.
  const bool reaches_ahead = patches_ && few_changed_lately(rows);
  if (!slot.filled || slot.version != rows.version()) {
    list_changes(slot, rows);
    upload_changes(slot, rows, submit.recorder());
  }
  slot.filled = slot.made = true;
  slot.followed = false;
  slot.rebuilds = 0;
  slot.next = nullptr;
  slot.version = rows.version();
  slot.shapes = wanted.shapes;
  const auto [first, last] = wanted.times;
  const bool ahead = reaches_ahead && is_small(slot, wanted);
  slot.take_window(first, ahead ? std::max(last, ahead_of(first)) : last);
  if (ahead && rests_ > 0) --rests_;
  if (make_tree(slot, submit)) return true;
  slot.filled = false;
  slot.tree = Tree::none;
  return false;
}

std::optional<TlasView> Tlas::prepare(const store::RowSource& rows, const Wanted& wanted, Submit& submit) {
  uploaded_ = 0;
  if (ahead_.slot != nullptr && ahead_.step == Ahead::Step::verdict) judge_ahead();
  if (ahead_.slot != nullptr && ahead_.step == Ahead::Step::build && large_build_->recorded())
    take_tree_ahead();
  Slot* slot = find(rows, wanted);
  if (slot == nullptr) {
    slot = find_near(rows, wanted);
    if (slot != nullptr) {
      renew(*slot, rows, submit.recorder());
      slot->contents = ++contents_;
    }
  }
  const bool stands = slot != nullptr;
  if (!stands) {
    slot = min_used(nullptr);
    RTSTDB_ASSERT(slot != nullptr);
    if (!fill(*slot, rows, wanted, submit)) return std::nullopt;
    slot->contents = ++contents_;
  }
  slot->last_used = ++uses_;
  latest_version_ = rows.version();
  if (stands) make_ahead(*slot, rows, wanted, submit.recorder());
  return TlasView{.slot = static_cast<std::uint32_t>(slot - slots_.data()),
                  .identities = slot->identities.data(),
                  .root = slot->root(),
                  .entities = slot->visible_count,
                  .epoch = slot->epoch,
                  .late_base = late_base_,
                  .window_begin = slot->window_begin,
                  .window_end = slot->window_end,
                  .contents = slot->contents};
}

}  // namespace rtstdb::accel
