#include "rtstdb/accel/tlas_slot.hpp"

#include <algorithm>

#include "shaders/shared/node.h"

namespace rtstdb::accel {
namespace {

/// The last multiple of epoch_length that is not after `t`.
WorldTime epoch_of(WorldTime t) noexcept {
  const std::int64_t rest_ns = t.time_since_epoch().count() % epoch_length.count();
  return t - Nanoseconds(rest_ns < 0 ? rest_ns + epoch_length.count() : rest_ns);
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

Presence presence_of(const EntityState* state) noexcept {
  if (state == nullptr) return Presence::absent;
  return state->row.geometry.valid() ? Presence::visible : Presence::hidden;
}

WorldTime long_window_end(WorldTime begin) noexcept {
  constexpr WorldTime last = world_time_ns(max_world_time_ns);
  return last - begin < window_ahead ? last : begin + window_ahead;
}

std::uint32_t TlasSlot::root() const noexcept {
  return visible_count == 0 ? shared::ref_none : 0;
}

void TlasSlot::take_window(WorldTime begin, WorldTime end) noexcept {
  window_begin = begin;
  window_end = end;
  epoch = epoch_of(begin);
}

bool TlasSlot::holds(const TlasRequest& request) const noexcept {
  return filled && ready && shapes == request.shapes && window_begin <= request.times.first &&
         request.times.last <= window_end;
}

bool TlasSlot::is_superseded(Version reader_version, const TlasRequest& request) const noexcept {
  return next != nullptr && next->version <= reader_version && next->tree != Tree::none &&
         next->holds(request);
}

std::uint32_t TlasSlot::max_patched() const noexcept {
  return std::max(visible_count / patched_share, fewest_patched);
}

std::uint32_t TlasSlot::max_renewed() const noexcept {
  return std::max(visible_count / renewed_share, max_patched());
}

void TlasSlot::read_levels() {
  if (tree != Tree::unknown) return;
  const auto words = levels_readback.host_as<const std::uint32_t>();
  levels.assign(words.begin() + 1, words.begin() + 2 + words[0]);
  tree = Tree::known;
}

float TlasSlot::growth() noexcept {
  const float cost_now = cost_readback.host_as<const float>()[0];
  if (built_cost == 0.0f) built_cost = cost_now;
  return cost_now > built_cost ? cost_now / built_cost : 1.0f;
}

bool TlasSlot::may_refit(float max_growth) {
  if (tree == Tree::none) return false;
  read_levels();
  return growth() <= max_growth;
}

void TlasSlot::list_live(std::uint32_t index_limit) {
  const auto live_entities = live.host_as<std::uint32_t>();
  const auto device_places = places.host_as<std::uint32_t>();
  live_count = 0;
  for (const Presence listed : {Presence::visible, Presence::hidden}) {
    for (std::uint32_t entity = 0; entity < index_limit; ++entity) {
      if (presence[entity] != listed) continue;
      place[entity] = live_count;
      device_places[entity] = live_count;
      live_entities[live_count++] = entity;
    }
    if (listed == Presence::visible) visible_count = live_count;
  }
}

TlasSlot* TlasSlots::least_recently_used(const TlasSlot* except) noexcept {
  TlasSlot* oldest = nullptr;
  for (TlasSlot& slot : slots_) {
    if (&slot != except && slot.pins == 0 && (oldest == nullptr || slot.last_used < oldest->last_used))
      oldest = &slot;
  }
  return oldest;
}

bool TlasSlots::pin(std::uint32_t index) noexcept {
  const auto pinned = std::ranges::count_if(slots_, [](const TlasSlot& slot) { return slot.pins > 0; });
  if (slots_[index].pins == 0 && pinned + 2 > std::ssize(slots_)) return false;
  ++slots_[index].pins;
  return true;
}

void TlasSlots::unpin(std::uint32_t index) noexcept {
  RTSTDB_ASSERT(slots_[index].pins > 0, "the slot is not in use");
  --slots_[index].pins;
}

}  // namespace rtstdb::accel
