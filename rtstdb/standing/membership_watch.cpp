#include "rtstdb/standing/membership_watch.hpp"

#include <algorithm>

namespace rtstdb::standing {

void MembershipWatch::reevaluate_all(std::int64_t now_ns, EventCause cause) {
  for (std::uint32_t index = 0; index < index_limit(); ++index)
    examine(index, now_ns, cause);
}

void MembershipWatch::reevaluate(std::span<const std::uint32_t> indices, std::int64_t now_ns,
                                 EventCause cause) {
  for (const std::uint32_t index : indices)
    examine(index, now_ns, cause);
}

void MembershipWatch::examine(std::uint32_t index, std::int64_t now_ns, EventCause cause) {
  const EntityState* state = considered_state(index);
  Entry& entry = entries_[index];
  const bool same_one = state != nullptr && entry.considered && entry.generation == state->id.generation;
  if (entry.member && !same_one) set_member(index, false, now_ns, cause);
  entry.considered = state != nullptr;
  if (state == nullptr) {
    ++entry.stamp;
    return;
  }
  entry.generation = state->id.generation;
  entry.doublings = 0;
  const MembershipPredictor now = predictor(*state);
  const MembershipPredictor::Membership place = now.membership_at(now_ns);
  // An entity on the border keeps its state.
  const bool member = place.certain || !same_one ? place.inside : entry.member;
  if (member != entry.member) set_member(index, member, now_ns, cause);
  schedule(index, now.next(now_ns, initial_look_ahead_ns, member));
}

void MembershipWatch::on_due(const Certificate& certificate) {
  Entry& entry = entries_[certificate.index];
  entry.doublings = certificate.changes ? std::uint8_t{0}
                                        : std::min<std::uint8_t>(
                                              max_doublings, static_cast<std::uint8_t>(entry.doublings + 1));
  if (certificate.changes) set_member(certificate.index, !entry.member, certificate.ns, EventCause::motion);
  const EntityState& state = *considered_state(certificate.index);
  schedule(certificate.index,
           predictor(state).next(certificate.ns, initial_look_ahead_ns << entry.doublings, entry.member));
}

}  // namespace rtstdb::standing
