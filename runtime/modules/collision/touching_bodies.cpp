#include "runtime/modules/collision/touching_bodies.hpp"

#include <algorithm>
#include <utility>

namespace hil::modules {
namespace {

/// A body whose contact is undecided and possible counts as touching.
bool touches(const rtstdb::ContactPair& pair) noexcept {
  return pair.status == rtstdb::PairStatus::contact ||
         (pair.status == rtstdb::PairStatus::undecided && pair.min_distance_m <= 0.0f);
}

}  // namespace

rtstdb::Result<std::unique_ptr<TouchingBodies>> TouchingBodies::prepare(
    rtstdb::Database& database, const TouchingBodiesOptions& options) {
  std::unique_ptr<TouchingBodies> bodies(new TouchingBodies(options));
  if (!options.by_bodies) {
    auto query = database.prepare(
        rtstdb::OverlapQueryOptions{.name = options.name, .capacity = 1, .ids_per_entity = options.max_hits});
    if (!query) return query.error();
    bodies->bounds_ = std::move(query).value();
    return bodies;
  }
  auto contacts = database.prepare(rtstdb::ContactQueryOptions{.name = options.name,
                                                               .capacity = 1,
                                                               .pairs_per_search = options.max_hits,
                                                               .max_candidates = max_part_pairs,
                                                               .max_bodies = 1});
  if (!contacts) return contacts.error();
  bodies->contacts_ = std::move(contacts).value();
  if (options.impact_window.count() == 0) return bodies;
  auto impacts = database.prepare(rtstdb::ImpactQueryOptions{
      .name = options.name + " impacts", .capacity = 1, .candidates_per_search = max_impact_candidates});
  if (!impacts) return impacts.error();
  bodies->impacts_ = std::move(impacts).value();
  return bodies;
}

void TouchingBodies::add_to(rtstdb::Transaction& transaction, rtstdb::WorldTime t) noexcept {
  if (bounds_) {
    bounds_->overlaps()[0] = {.entity = options_.entity, .t = t, .mask = options_.mask};
    return transaction.add_query(*bounds_, 1);
  }
  contacts_->searches()[0] = {.first = options_.entity, .second_mask = options_.mask, .t = t};
  transaction.add_query(*contacts_, 1);
  if (!impacts_) return;
  impacts_->searches()[0] = {
      .first = options_.entity, .second_mask = options_.mask, .t = t, .window = options_.impact_window};
  transaction.add_query(*impacts_, 1);
}

Touching TouchingBodies::take(std::vector<rtstdb::EntityId>& entities) const noexcept {
  Touching touching;
  if (bounds_) {
    const rtstdb::OverlapAnswer& answer = std::as_const(*bounds_).answers()[0];
    entities.insert(entities.end(), answer.entities.begin(), answer.entities.end());
    touching.found = answer.found;
    touching.is_known = !answer.incomplete;
    return touching;
  }
  const rtstdb::ContactAnswer& answer = std::as_const(*contacts_).answers()[0];
  for (const rtstdb::ContactPair& pair : answer.pairs) {
    if (!touches(pair)) continue;
    ++touching.found;
    entities.push_back(pair.second);
    if (pair.status == rtstdb::PairStatus::contact)
      touching.depth_m = std::max(touching.depth_m, -static_cast<double>(pair.distance_m));
  }
  touching.is_known = !answer.overflow && !answer.incomplete;
  return touching;
}

const rtstdb::ContactPair* TouchingBodies::pair_with(rtstdb::EntityId other) const noexcept {
  if (!contacts_) return nullptr;
  const std::span<const rtstdb::ContactPair> pairs = std::as_const(*contacts_).answers()[0].pairs;
  const auto found = std::ranges::find(pairs, other, &rtstdb::ContactPair::second);
  return found == pairs.end() ? nullptr : &*found;
}

const rtstdb::ImpactAnswer& TouchingBodies::first_impact() const noexcept {
  return std::as_const(*impacts_).answers()[0];
}

}  // namespace hil::modules
