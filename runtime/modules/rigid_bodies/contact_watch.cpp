#include "runtime/modules/rigid_bodies/contact_watch.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <utility>

#include <hil/numbers.hpp>

namespace hil::modules {
namespace {

/// Pairs of parts whose bounds may overlap, for each pair that an answer can list.
constexpr std::uint32_t candidates_per_pair = 64;

std::vector<std::string> names_of(const RigidBodiesOptions& options) {
  std::vector<std::string> names;
  for (const RigidBodyOptions& body : options.bodies)
    names.push_back(body.name);
  return names;
}

std::vector<BodySize> sizes_of(const RigidBodiesOptions& options, std::span<const PlacedBody> placed) {
  std::vector<BodySize> sizes;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const PlacedBody& body = placed[i];
    const std::optional<MassProperties>& properties = options.bodies[i].properties;
    sizes.push_back({.diagonal_m = body.diagonal_m(),
                     .reach_m = glm::length(glm::max(glm::abs(body.maximum_m), glm::abs(body.minimum_m))),
                     .mass_kg = properties ? properties->mass_kg : 0.0});
  }
  return sizes;
}

/// The largest overlap of two bodies at the start, as a share of the smaller one's diagonal.
constexpr double max_first_overlap = 0.02;

}  // namespace

ContactWatch::ContactWatch(World& world, EventLog& events, const std::string& caller,
                           const RigidBodiesOptions& options, std::vector<rtstdb::EntityId> entities,
                           std::span<const PlacedBody> placed)
    : database_(world.database()),
      entities_(std::move(entities)),
      margin_m_(static_cast<float>(options.margin_m)),
      contacts_(options.law, sizes_of(options, placed), options.max_pairs),
      touches_(names_of(options)),
      is_near_(entities_.size()) {
  for (std::uint32_t i = 0; i < entities_.size(); ++i) {
    const rtstdb::EntityId entity = entities_[i];
    body_of_entity_.resize(std::max<std::size_t>(body_of_entity_.size(), entity.index + 1), unlisted);
    body_of_entity_[entity.index] = i;
    all_mask_ |= placed[i].row.mask;
    moves_.push_back(options.bodies[i].properties.has_value());
    if (moves_.back()) {
      moving_mask_ |= placed[i].row.mask;
    } else {
      fixed_.push_back(i);
    }
  }
  auto query = database_.prepare(rtstdb::ContactQueryOptions{
      .name = caller,
      .capacity = 1,
      .pairs_per_search = options.max_pairs,
      .max_candidates = std::min(candidates_per_pair * options.max_pairs, rtstdb::max_contact_candidates)});
  if (!query) throw RefusedByDatabase(caller, query.error());
  query_ = std::move(query).value();
  transaction_ =
      database_.make_transaction({.max_queries = 1, .max_reads = static_cast<std::uint32_t>(fixed_.size())});
  touches_.add_kinds(events, moves_);
  overflow_ = events.add_kind(caller + ": {} pairs are near each other, and the " +
                                  std::to_string(options.max_pairs) +
                                  " of 'max_pairs' or the pieces of their shapes are more than are searched; "
                                  "bodies may pass through each other",
                              0);
  no_answer_ = events.add_kind(caller + ": a step has no answer to its contact query");
  undecided_ = events.add_kind(
      caller + ": of {} pairs it can not be decided where they touch; their earlier contacts stay", 0);
  late_ = events.add_kind(caller +
                              ": a pair touches by {} mm and was not near in the step before; use a faster "
                              "task or a larger margin",
                          3);
  check_first_overlaps(caller, options, placed);
}

void ContactWatch::check_first_overlaps(const std::string& caller, const RigidBodiesOptions& options,
                                        std::span<const PlacedBody> placed) {
  transaction_->begin({});
  query_->searches()[0] = {
      .first_mask = moving_mask_, .second_mask = all_mask_, .t = rtstdb::world_time_ns(0)};
  transaction_->add_query(*query_, 1);
  const rtstdb::Outcome& outcome = database_.execute(*transaction_);
  if (!outcome.done()) throw SetupError(caller + ": " + rtstdb::describe(outcome));
  const auto mass_kg = [&](std::uint32_t body) {
    return moves_[body] ? options.bodies[body].properties->mass_kg : 0.0;
  };
  for (const rtstdb::ContactPair& pair : std::as_const(*query_).answers()[0].pairs) {
    const std::uint32_t first = body_of(pair.first), second = body_of(pair.second);
    if (first == unlisted || second == unlisted || (!moves_[first] && !moves_[second])) continue;
    const double overlap_m = -static_cast<double>(pair.max_distance_m);
    const double rest_m = std::max(mass_kg(first), mass_kg(second)) * glm::length(options.gravity_mps2) /
                          options.law.stiffness_npm;
    const double smaller_m = std::min(placed[first].diagonal_m(), placed[second].diagonal_m());
    const double allowed_m = std::max(max_first_overlap * smaller_m, 2.0 * rest_m);
    if (overlap_m <= allowed_m) continue;
    throw SetupError(caller + ": " + place_and_name(options.bodies[first]) + " and '" +
                     options.bodies[second].name + "' overlap by " + config::format_number(overlap_m, 4) +
                     " m at the start, and at most " + config::format_number(allowed_m, 4) +
                     " m are allowed; move them apart");
  }
}

std::uint32_t ContactWatch::body_of(rtstdb::EntityId entity) const noexcept {
  return entity.index < body_of_entity_.size() ? body_of_entity_[entity.index] : unlisted;
}

void ContactWatch::take(WorldStep& context, BodySet& bodies, rtstdb::Version version) noexcept {
  transaction_->begin({.deadline_class = rtstdb::DeadlineClass::soft,
                       .deadline = context.deadline,
                       .importance = rtstdb::max_importance,
                       .world_time = {},
                       .read_at = rtstdb::ReadAt::pinned(std::max(context.version, version))});
  query_->searches()[0] = {
      .first_mask = moving_mask_, .second_mask = all_mask_, .t = context.world_time(), .margin_m = margin_m_};
  transaction_->add_query(*query_, 1);
  for (const std::uint32_t body : fixed_)
    transaction_->read(entities_[body]);
  if (!context.execute(database_, *transaction_).done()) {
    if (was_whole_) context.events->note(no_answer_, context.time_ns);
    was_whole_ = false;
    ++counts_.overflows;
    return;
  }
  for (std::uint32_t i = 0; i < fixed_.size(); ++i) {
    const rtstdb::EntityState* state = transaction_->state(i);
    if (state != nullptr) bodies.bodies()[fixed_[i]].row = state->row.motion;
  }
  freeze(context, bodies);
}

void ContactWatch::freeze(WorldStep& context, BodySet& bodies) noexcept {
  const rtstdb::ContactAnswer& answer = std::as_const(*query_).answers()[0];
  const bool is_whole = !answer.overflow && !answer.incomplete;
  if (!is_whole) ++counts_.overflows;
  if (was_whole_ && !is_whole) context.events->note(overflow_, context.time_ns, answer.found);
  was_whole_ = is_whole;

  const std::span<const BodyMotion> motions = bodies.motions_at(context.time_ns);
  std::fill(is_near_.begin(), is_near_.end(), char{0});
  std::uint32_t undecided = 0;
  contacts_.begin();
  for (const rtstdb::ContactPair& pair : answer.pairs) {
    const std::uint32_t first = body_of(pair.first), second = body_of(pair.second);
    if (first == unlisted || second == unlisted || (!moves_[first] && !moves_[second])) continue;
    is_near_[first] = is_near_[second] = 1;
    const bool was_near = contacts_.was_near(first, second);
    const bool has_points = pair.point_count > 0 && pair.status != rtstdb::PairStatus::undecided;
    if (!has_points || !contacts_.add(pair, first, second, motions, static_cast<double>(margin_m_))) {
      // An undecided pair is known to be apart if the lower bound of its distance is above 0.
      const bool is_apart = pair.status == rtstdb::PairStatus::undecided && pair.min_distance_m > 0.0f;
      undecided += is_apart ? 0u : 1u;
      contacts_.keep(first, second);
      continue;
    }
    if (pair.status != rtstdb::PairStatus::contact || is_first_ || was_near) continue;
    ++counts_.late;
    context.events->note(late_, context.time_ns, -1e3 * static_cast<double>(pair.distance_m));
  }
  contacts_.end();
  is_first_ = false;
  counts_.undecided += undecided;
  if (undecided > 0 && was_decided_) context.events->note(undecided_, context.time_ns, undecided);
  was_decided_ = undecided == 0;

  counts_.pressing = 0;
  counts_.depth_m = 0.0;
  for (const FrozenContact& point : contacts_.points()) {
    if (point.depth_m <= 0.0) continue;
    ++counts_.pressing;
    counts_.depth_m = std::max(counts_.depth_m, point.depth_m);
  }
}

}  // namespace hil::modules
