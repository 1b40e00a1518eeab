#include "rtstdb/standing/nearest_watch.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "rtstdb/standing/crossing.hpp"

namespace rtstdb::standing {
namespace {

/// A member is replaced only by an entity that is nearer by at least this.
constexpr double hysteresis_m = 1e-9;

}  // namespace

NearestWatch::NearestWatch(const QuerySpec& spec, const StandingOptions& options, const Mirror& mirror,
                           threads::EventCount& follower_wake_up, WorkCounts& work)
    : Watch(spec, options, mirror, follower_wake_up, work),
      guard_spec_(spec),
      guard_size_(2 * std::size_t{spec.k} + 8),
      max_candidates_(2 * guard_size_) {}

SquaredDistance NearestWatch::distance(const EntityState& state) const noexcept {
  const MembershipPredictor now = predictor(state);
  return {now.motion(), now.place_m(), now.box(), Measure::nearest};
}

bool NearestWatch::is_current(const Certificate& certificate) const noexcept {
  return certificate.index == order_index ? certificate.stamp == order_stamp_
                                          : Watch::is_current(certificate);
}

// ---- the guard

const EntityState* NearestWatch::update_considered(std::uint32_t index) {
  const EntityState* state = considered_state(index);
  Entry& entry = entries_[index];
  if (entry.considered) --considered_count_;
  entry.considered = state != nullptr;
  if (entry.considered) ++considered_count_;
  entry.doublings = 0;
  ++entry.stamp;
  return state;
}

void NearestWatch::set_candidate(std::uint32_t index, bool candidate) {
  if (entries_[index].candidate == candidate) return;
  entries_[index].candidate = candidate;
  if (candidate) {
    candidates_.push_back(index);
  } else {
    std::erase(candidates_, index);
  }
}

void NearestWatch::schedule_guard(std::uint32_t index, const EntityState& state, std::int64_t from_ns) {
  ++entries_[index].stamp;
  if (!std::isfinite(guard_spec_.radius_m)) return;
  const Entry& entry = entries_[index];
  schedule(
      index,
      predictor(state, guard_spec_).next(from_ns, initial_look_ahead_ns << entry.doublings, entry.candidate));
}

bool NearestWatch::needs_another_guard() const noexcept {
  const bool too_few = candidates_.size() < spec_.k && candidates_.size() < considered_count_ &&
                       guard_spec_.radius_m < spec_.radius_m;
  return too_few || candidates_.size() > max_candidates_;
}

void NearestWatch::choose_guard(std::int64_t now_ns) {
  ranking_.clear();
  for (std::uint32_t index = 0; index < index_limit(); ++index)
    if (entries_[index].considered)
      ranking_.push_back({std::sqrt(distance(*considered_state(index)).at(now_ns).value_m2), index});
  guard_spec_.radius_m = spec_.radius_m;
  if (ranking_.size() > guard_size_) {
    const auto first_beyond = ranking_.begin() + static_cast<std::ptrdiff_t>(guard_size_);
    std::ranges::nth_element(ranking_, first_beyond, {}, &Ranked::key_m);
    const double last_within_m =
        std::ranges::max(std::span(ranking_.begin(), first_beyond), {}, &Ranked::key_m).key_m;
    guard_spec_.radius_m = std::min(spec_.radius_m, std::midpoint(last_within_m, first_beyond->key_m));
  }
  candidates_.clear();
  for (const Ranked& ranked : ranking_) {
    Entry& entry = entries_[ranked.index];
    entry.candidate = false;
    entry.doublings = 0;
    set_candidate(ranked.index, ranked.key_m <= guard_spec_.radius_m);
    schedule_guard(ranked.index, *considered_state(ranked.index), now_ns);
  }
  // Many entities may have the same distance, so the guard may contain more than guard_size_.
  max_candidates_ = 2 * std::max(guard_size_, candidates_.size());
}

// ---- changes and certificates

void NearestWatch::invalidate(std::span<const std::uint32_t>) noexcept {
  clear_certificates();
}

void NearestWatch::reevaluate_all(std::int64_t now_ns, EventCause cause) {
  for (const std::uint32_t index : candidates_)
    entries_[index].candidate = false;
  candidates_.clear();
  for (std::uint32_t index = 0; index < index_limit(); ++index)
    update_considered(index);
  choose_guard(now_ns);
  rank(now_ns, cause);
}

void NearestWatch::reevaluate(std::span<const std::uint32_t> indices, std::int64_t now_ns, EventCause cause) {
  if (cause == EventCause::gap) return reevaluate_all(now_ns, cause);
  bool order_changed = false;
  for (const std::uint32_t index : indices) {
    Entry& entry = entries_[index];
    order_changed |= entry.candidate || entry.member;
    const bool was_considered = entry.considered;
    const EntityState* state = update_considered(index);
    if (state == nullptr) {
      set_candidate(index, false);
      continue;
    }
    bool within = true;
    if (std::isfinite(guard_spec_.radius_m)) {
      const MembershipPredictor::Membership place = predictor(*state, guard_spec_).membership_at(now_ns);
      within = place.certain || !was_considered ? place.inside : entry.candidate;
    }
    set_candidate(index, within);
    order_changed |= within;
    schedule_guard(index, *state, now_ns);
  }
  if (order_changed || needs_another_guard()) rank(now_ns, cause);
}

void NearestWatch::on_due(const Certificate& certificate) {
  if (certificate.index == order_index) {
    if (certificate.changes) return rank(certificate.ns, EventCause::motion);
    order_doublings_ = std::min<std::uint8_t>(max_doublings, static_cast<std::uint8_t>(order_doublings_ + 1));
    return schedule_order(certificate.ns);
  }
  Entry& entry = entries_[certificate.index];
  entry.doublings = certificate.changes ? std::uint8_t{0}
                                        : std::min<std::uint8_t>(
                                              max_doublings, static_cast<std::uint8_t>(entry.doublings + 1));
  if (certificate.changes) set_candidate(certificate.index, !entry.candidate);
  schedule_guard(certificate.index, *considered_state(certificate.index), certificate.ns);
  if (certificate.changes) rank(certificate.ns, EventCause::motion);
}

// ---- the order

void NearestWatch::rank(std::int64_t now_ns, EventCause cause) {
  if (needs_another_guard()) choose_guard(now_ns);
  ranking_.clear();
  for (const std::uint32_t index : candidates_) {
    const EntityState& state = *considered_state(index);
    const Entry& entry = entries_[index];
    const double distance_m = std::sqrt(distance(state).at(now_ns).value_m2);
    const bool holds = entry.member && entry.generation == state.id.generation;
    const double key_m =
        distance_m < touching_m ? 0.0 : std::max(distance_m - (holds ? hysteresis_m : 0.0), touching_m);
    ranking_.push_back({key_m, index});
  }
  const auto count = static_cast<std::ptrdiff_t>(std::min<std::size_t>(spec_.k, ranking_.size()));
  std::ranges::partial_sort(ranking_, ranking_.begin() + count, [](const Ranked& a, const Ranked& b) {
    return std::tie(a.key_m, a.index) < std::tie(b.key_m, b.index);
  });
  ranking_.resize(static_cast<std::size_t>(count));
  new_members_.clear();
  for (const Ranked& ranked : ranking_)
    new_members_.push_back(ranked.index);
  std::ranges::sort(new_members_);
  // Merge of the old and the new members, both by ascending index.
  auto before = members_.begin();
  auto after = new_members_.begin();
  while (before != members_.end() || after != new_members_.end()) {
    const bool was = before != members_.end() && (after == new_members_.end() || *before <= *after);
    const bool is = after != new_members_.end() && (before == members_.end() || *after <= *before);
    const std::uint32_t index = was ? *before : *after;
    if (was) ++before;
    if (is) ++after;
    Entry& entry = entries_[index];
    const EntityState* state = is ? considered_state(index) : nullptr;
    const bool certainly_stays = was && is && state->id.generation == entry.generation;
    if (was && !certainly_stays) set_member(index, false, now_ns, cause);
    if (!is || certainly_stays) continue;
    entry.generation = state->id.generation;
    set_member(index, true, now_ns, cause);
  }
  members_.swap(new_members_);
  order_doublings_ = 0;
  schedule_order(now_ns);
}

void NearestWatch::schedule_order(std::int64_t from_ns) {
  ++order_stamp_;
  if (candidates_.size() <= spec_.k || from_ns >= max_world_time_ns) return;
  const std::int64_t look_ahead_ns = initial_look_ahead_ns << order_doublings_;
  std::int64_t end_ns = std::min(max_world_time_ns - look_ahead_ns, from_ns) + look_ahead_ns;
  bool changes = false;
  for (const std::uint32_t member : members_) {
    const SquaredDistance holder = distance(*considered_state(member));
    for (const std::uint32_t other : candidates_) {
      if (entries_[other].member || end_ns <= from_ns) continue;
      count_examination();
      const SquaredDistance challenger = distance(*considered_state(other));
      const double noise_m = std::max(holder.noise_m(from_ns, end_ns), challenger.noise_m(from_ns, end_ns));
      const Crossing found =
          first_crossing(Nearer(challenger, holder, other < member, noise_m), from_ns, end_ns, false);
      if (found.what == Crossing::What::none) continue;
      changes = found.what == Crossing::What::crossing;
      end_ns = std::max(found.ns, from_ns + 1);  // later crossings are irrelevant
    }
  }
  push({end_ns, order_index, order_stamp_, changes});
}

}  // namespace rtstdb::standing
