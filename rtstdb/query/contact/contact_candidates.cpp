#include "rtstdb/query/contact/contact_candidates.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>

namespace rtstdb::query {
namespace {

/// A sphere around a part of a body.
struct PartSphere {
  glm::dvec3 center_m{0.0};
  double radius_m = 0.0;

  PartSphere(const EntityRow& row, const Pose& pose, const ConvexHull& hull) noexcept
      : center_m(pose.p_world_m + pose.q_world * (row.scale * glm::dvec3(hull.center_m))),
        radius_m(glm::length(row.scale * glm::dvec3(hull.half_extent_m))) {}
};

}  // namespace

void ContactCandidates::reserve() {
  states_.resize(max_searches_);
  bodies_.reserve(max_bodies_);
  wide_bodies_.reserve(max_bodies_);
  candidates_.reserve(max_candidates_);
  part_pairs_.reserve(max_candidates_);
}

void ContactCandidates::list_bodies(std::span<const ContactSearch> searches,
                                    const BatchWorld& world) noexcept {
  searches_ = searches;
  bodies_.clear();
  wide_bodies_.clear();
  candidates_.clear();
  part_pairs_.clear();
  is_full_ = false;
  for (std::uint32_t search = 0; search < searches.size(); ++search) {
    states_[search] = {};
    list_bodies_of(search, world);
    states_[search].bodies_end = static_cast<std::uint32_t>(bodies_.size());
  }
  for (std::uint32_t i = 0; i < bodies_.size(); ++i)
    bodies_[i].begin = i * ids_per_body;
}

void ContactCandidates::list_bodies_of(std::uint32_t search, const BatchWorld& world) noexcept {
  const ContactSearch& from = searches_[search];
  if (from.second.valid()) return;
  if (from.first.valid()) {
    if (!add_body({.search = search, .entity = from.first.index, .mask = from.second_mask}))
      states_[search].overflow = true;
    return;
  }
  for (std::uint32_t index = 0; index < world.rows.index_limit(); ++index) {
    const EntityState* state = world.rows.row(index);
    if (state == nullptr || !state->row.geometry.valid()) continue;
    const std::uint32_t mask = state->row.mask;
    const std::uint32_t wanted = ((mask & from.first_mask) != 0 ? from.second_mask : 0) |
                                 ((mask & from.second_mask) != 0 ? from.first_mask : 0);
    if (wanted == 0) continue;
    if (!add_body({.search = search, .entity = index, .mask = wanted, .above = true})) {
      states_[search].overflow = true;
      return;
    }
  }
}

bool ContactCandidates::add_body(const Body& body) noexcept {
  if (bodies_.size() == max_bodies_) return false;
  bodies_.push_back(body);
  return true;
}

void ContactCandidates::list_wide_bodies(std::span<const shared::RegionCount> counts) noexcept {
  std::uint64_t next = std::uint64_t{max_bodies_} * ids_per_body;
  const std::uint64_t end = next + max_candidates_;
  for (std::uint32_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    body.found = counts[i].found;
    body.incomplete = counts[i].incomplete != 0;
    if (body.found <= ids_per_body || body.incomplete || next + body.found > end) continue;
    body.begin = static_cast<std::uint32_t>(next);
    wide_bodies_.push_back(i);
    next += body.found;
  }
}

void ContactCandidates::list_pairs(std::span<const shared::RegionCount> counts, std::span<std::uint32_t> ids,
                                   const BatchWorld& world, SurfacePairs& surfaces) noexcept {
  for (std::uint32_t i = 0; i < wide_bodies_.size(); ++i)
    bodies_[wide_bodies_[i]].incomplete = counts[i].incomplete != 0;
  std::uint32_t body = 0;
  for (std::uint32_t search = 0; search < searches_.size(); ++search) {
    const ContactSearch& from = searches_[search];
    if (from.second.valid()) {
      ++states_[search].candidates;
      if (has_space_for(search, 1))
        add_candidate({.search = search, .first = from.first, .second = from.second}, world, surfaces);
    }
    for (; body < states_[search].bodies_end; ++body)
      add_candidates_of(bodies_[body], ids, world, surfaces);
  }
}

bool ContactCandidates::has_space_for(std::uint32_t search, std::uint32_t count) noexcept {
  is_full_ = is_full_ || candidates_.size() + count > max_candidates_;
  states_[search].overflow = states_[search].overflow || is_full_;
  return !is_full_;
}

void ContactCandidates::add_candidates_of(const Body& body, std::span<std::uint32_t> all_ids,
                                          const BatchWorld& world, SurfacePairs& surfaces) noexcept {
  if (body.incomplete) {
    states_[body.search].incomplete = true;
    return;
  }
  states_[body.search].candidates += body.found;
  if (!has_space_for(body.search, body.found)) return;
  const auto ids = all_ids.subspan(body.begin, body.found);
  std::ranges::sort(ids);
  const EntityId own = world.rows.row(body.entity)->id;
  for (const std::uint32_t index : ids)
    add_candidate({.search = body.search, .first = own, .second = world.rows.row(index)->id}, world,
                  surfaces);
}

void ContactCandidates::add_candidate(Candidate candidate, const BatchWorld& world,
                                      SurfacePairs& surfaces) noexcept {
  if (is_full_) return;
  const ContactSearch& search = searches_[candidate.search];
  const EntityRow& first = world.rows.row(candidate.first.index)->row;
  const EntityRow& second = world.rows.row(candidate.second.index)->row;
  const auto has_parts = [&](const EntityRow& row) {
    return world.pool.convex_parts(row.geometry.index) > 0;
  };
  candidate.is_convex = has_parts(first) && has_parts(second);
  candidate.first_pair = static_cast<std::uint32_t>(part_pairs_.size());
  if (!candidate.is_convex) {
    candidate.surfaces =
        surfaces.add(first, second, search.t, search.margin_m, search.second.valid(), world.pool);
    if (!candidate.surfaces) states_[candidate.search].overflow = true;
  } else if (!add_part_pairs(candidate, world)) {
    part_pairs_.resize(candidate.first_pair);
    is_full_ = states_[candidate.search].overflow = true;
    return;
  }
  candidate.end_pair = static_cast<std::uint32_t>(part_pairs_.size());
  candidates_.push_back(candidate);
}

bool ContactCandidates::add_part_pairs(const Candidate& candidate, const BatchWorld& world) noexcept {
  const ContactSearch& search = searches_[candidate.search];
  const EntityRow& first = world.rows.row(candidate.first.index)->row;
  const EntityRow& second = world.rows.row(candidate.second.index)->row;
  const std::uint32_t first_parts = world.pool.convex_parts(first.geometry.index);
  const std::uint32_t second_parts = world.pool.convex_parts(second.geometry.index);
  const auto number = static_cast<std::uint32_t>(candidates_.size());
  const auto add = [&](std::uint32_t a, std::uint32_t b) {
    if (part_pairs_.size() == max_candidates_) return false;
    part_pairs_.push_back({number, static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(b)});
    return true;
  };
  if (first_parts * second_parts == 1) return add(0, 0);
  const Pose first_pose = pose_at(first.motion, search.t);
  const Pose second_pose = pose_at(second.motion, search.t);
  for (std::uint32_t a = 0; a < first_parts; ++a) {
    const PartSphere around_first(first, first_pose, *world.pool.hull(first.geometry.index, a).hull);
    for (std::uint32_t b = 0; b < second_parts; ++b) {
      const PartSphere around_second(second, second_pose, *world.pool.hull(second.geometry.index, b).hull);
      const double reach_m =
          around_first.radius_m + around_second.radius_m + static_cast<double>(search.margin_m);
      const bool is_near = glm::distance(around_first.center_m, around_second.center_m) <= 1.000001 * reach_m;
      if ((is_near || search.second.valid()) && !add(a, b)) return false;
    }
  }
  return true;
}

}  // namespace rtstdb::query
