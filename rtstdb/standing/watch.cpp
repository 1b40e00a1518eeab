#include "rtstdb/standing/watch.hpp"

#include <algorithm>
#include <utility>

#include <rtstdb/result.hpp>

namespace rtstdb::standing {
namespace {

struct Later {
  template <class Certificate>
  bool operator()(const Certificate& a, const Certificate& b) const {
    return a.ns != b.ns ? a.ns > b.ns : a.index > b.index;
  }
};

constexpr std::int64_t ns_of(WorldTime time) {
  return time.time_since_epoch().count();
}

}  // namespace

Watch::Watch(const QuerySpec& spec, const StandingOptions& options, const Mirror& mirror,
             threads::EventCount& follower_wake_up, WorkCounts& work)
    : spec_(spec),
      mirror_(mirror),
      follower_wake_up_(follower_wake_up),
      work_(work),
      name_(options.name),
      ring_(options.ring_capacity),
      progress_({}) {}

// ---- the user's side

std::size_t Watch::next_events(std::span<StandingEvent> events) noexcept {
  const std::size_t count = ring_.pop(events);
  // Pairs with publish_list by sequential consistency: either publish_list sees the room, or this sees that
  // it waits for room.
  if (count > 0 && waits_for_space_.load(std::memory_order_seq_cst)) follower_wake_up_.notify();
  return count;
}

Progress Watch::progress() const noexcept {
  const VersionInfo reached = progress_.get();
  return {reached.version, reached.time};
}

std::string Watch::reason() const {
  const std::lock_guard lock(reason_mutex_);
  return *reason_ == '\0' ? std::string() : "standing query '" + name_ + "': " + reason_;
}

// ---- versions

void Watch::grow_entries() {
  if (entries_.size() < mirror_.index_limit()) entries_.resize(mirror_.index_limit());
}

void Watch::begin() {
  grow_entries();
  version_info_ = mirror_.version();
  initializing_ = true;
  reevaluate_all(ns_of(version_info_.time), EventCause::list);
  initializing_ = false;
  progress_.set(version_info_);
}

void Watch::invalidate(std::span<const std::uint32_t> indices) noexcept {
  const bool by_carrier = spec_.carrier.valid() && std::ranges::binary_search(indices, spec_.carrier.index);
  if (by_carrier) {
    certificates_.clear();
    return;
  }
  for (const std::uint32_t index : indices)
    if (index < entries_.size()) ++entries_[index].stamp;
}

void Watch::advance(VersionInfo to) {
  version_info_ = to;
  while (!certificates_.empty() && certificates_.front().ns < ns_of(to.time)) {
    std::ranges::pop_heap(certificates_, Later{});
    const Certificate next = certificates_.back();
    certificates_.pop_back();
    if (is_current(next)) on_due(next);
  }
}

void Watch::follow(std::span<const std::uint32_t> changed, EventCause cause) {
  grow_entries();
  version_info_ = mirror_.version();
  const std::int64_t now_ns = ns_of(version_info_.time);
  const EntityId carrier = spec_.carrier;
  if (carrier.valid() && mirror_.find(carrier) == nullptr) {
    end(cause);
  } else if (carrier.valid() && std::ranges::binary_search(changed, carrier.index)) {
    reevaluate_all(now_ns, cause);
  } else {
    reevaluate(changed, now_ns, cause);
  }
  progress_.set(version_info_);
}

void Watch::end(EventCause cause) {
  for (std::uint32_t index = 0; index < entries_.size(); ++index)
    if (entries_[index].member) set_member(index, false, ns_of(version_info_.time), cause);
  certificates_.clear();
  const std::lock_guard lock(reason_mutex_);
  reason_ = "its carrier was removed";
  status_.store(StandingStatus::ended, std::memory_order_release);
}

void Watch::fail(const char* why) noexcept {
  // Releases its memory, which other queries may need.
  std::vector<Certificate>().swap(certificates_);
  std::vector<Entry>().swap(entries_);
  list_state_ = ListState::listed;
  waits_for_space_.store(false, std::memory_order_relaxed);
  const std::lock_guard lock(reason_mutex_);
  reason_ = why;
  status_.store(StandingStatus::failed, std::memory_order_release);
}

// ---- members and certificates

const EntityState* Watch::considered_state(std::uint32_t index) const noexcept {
  const EntityState* state = mirror_.row(index);
  return state != nullptr && spec_.considers(*state) ? state : nullptr;
}

MembershipPredictor Watch::predictor(const EntityState& state, const QuerySpec& spec) const noexcept {
  const EntityState* carrier = spec.carrier.valid() ? mirror_.find(spec.carrier) : nullptr;
  return {spec, carrier != nullptr ? carrier->row.motion : Motion{}, state.row.motion,
          mirror_.box(state, spec.target == StandingTarget::center)};
}

void Watch::schedule(std::uint32_t index, const MembershipPredictor::Next& next) {
  count_examination();
  const std::uint32_t stamp = ++entries_[index].stamp;
  if (next.what != MembershipPredictor::Next::What::never)
    push({next.ns, index, stamp, next.what == MembershipPredictor::Next::What::crossing});
}

void Watch::push(const Certificate& certificate) {
  // Invalid certificates are removed when they are the majority.
  if (certificates_.size() > 2 * entries_.size() + 64) {
    std::erase_if(certificates_, [this](const Certificate& old) { return !is_current(old); });
    std::ranges::make_heap(certificates_, Later{});
  }
  certificates_.push_back(certificate);
  std::ranges::push_heap(certificates_, Later{});
}

void Watch::set_member(std::uint32_t index, bool member, std::int64_t ns, EventCause cause) {
  Entry& entry = entries_[index];
  RTSTDB_ASSERT(entry.member != member, "the entity is a member already, or is none already");
  entry.member = member;
  publish(member ? EventKind::enter : EventKind::exit, cause, {index, entry.generation}, ns);
}

// ---- events

void Watch::publish(EventKind kind, EventCause cause, EntityId entity, std::int64_t ns) noexcept {
  if (initializing_) return;
  work_.events.fetch_add(1, std::memory_order_relaxed);
  if (list_state_ == ListState::members && entity.index >= listed_below_)
    return;  // the list will contain its state
  if (list_state_ == ListState::reset_pending || ring_.space() == 0) return count_lost();
  push_event({.kind = kind,
              .cause = cause,
              .entity = entity,
              .time = world_time_ns(ns),
              .version = version_info_.version});
}

void Watch::count_lost() noexcept {
  ++seq_;
  ++lost_since_reset_;
  all_lost_.fetch_add(1, std::memory_order_relaxed);
  list_state_ = ListState::reset_pending;
}

void Watch::push_event(StandingEvent event) noexcept {
  event.seq = ++seq_;
  ring_.push(event);
}

void Watch::publish_list() {
  const auto list = [&](EventKind kind, EntityId entity = {}) {
    push_event({.kind = kind,
                .entity = entity,
                .time = version_info_.time,
                .version = version_info_.version,
                .lost = kind == EventKind::reset ? lost_since_reset_ : 0});
  };
  while (list_state_ != ListState::listed) {
    // A reset waits until half of the ring is free, since a list that starts in a nearly full ring would be
    // lost again.
    const std::size_t needed =
        list_state_ == ListState::reset_pending ? std::max<std::size_t>(1, ring_.capacity() / 2) : 1;
    if (ring_.space() < needed) {
      waits_for_space_.store(true, std::memory_order_seq_cst);
      if (ring_.space() < needed) return;
    }
    if (list_state_ == ListState::reset_pending) {
      list(EventKind::reset);
      lost_since_reset_ = 0;
      listed_below_ = 0;
      list_state_ = ListState::members;
      continue;
    }
    while (listed_below_ < entries_.size() && !entries_[listed_below_].member)
      ++listed_below_;
    if (listed_below_ == entries_.size()) {
      list(EventKind::complete);
      list_state_ = ListState::listed;
    } else {
      list(EventKind::present, {listed_below_, entries_[listed_below_].generation});
      ++listed_below_;
    }
  }
  waits_for_space_.store(false, std::memory_order_relaxed);
}

}  // namespace rtstdb::standing
