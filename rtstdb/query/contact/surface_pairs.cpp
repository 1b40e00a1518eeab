#include "rtstdb/query/contact/surface_pairs.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <bit>
#include <initializer_list>
#include <limits>

#include "rtstdb/geometry/motion_bounds.hpp"
#include "shaders/shared/contact.h"

namespace rtstdb::query {
namespace {

constexpr std::uint32_t bits_per_word = 32;
/// With its depth in w.
const glm::vec4& depth_point(const shared::SurfaceDepth& depth, TrianglePoint point) noexcept {
  switch (point) {
    case corner_0:
      return depth.corner_0;
    case corner_1:
      return depth.corner_1;
    case corner_2:
      return depth.corner_2;
    default:
      return depth.deepest;
  }
}

/// The surface of one row against the body of another one.
shared::SurfaceSide side_of(const EntityRow& surface, const EntityRow& body, WorldTime t, float limit_m,
                            const accel::GeometryPool& pool) noexcept {
  const Pose surface_pose = pose_at(surface.motion, t);
  const Pose body_pose = pose_at(body.motion, t);
  const glm::dquat to_body = glm::conjugate(body_pose.q_world);
  const glm::dquat q = to_body * surface_pose.q_world;
  const glm::dvec3 origin_m = to_body * (surface_pose.p_world_m - body_pose.p_world_m);
  const double reach = std::max(reach_m(pool.bounds(surface.geometry.index), surface.scale),
                                reach_m(pool.bounds(body.geometry.index), body.scale));
  return {.q = glm::vec4(static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z),
                         static_cast<float>(q.w)),
          .origin_m = glm::vec3(origin_m),
          .surface = surface.geometry.index,
          .surface_scale = glm::vec3(surface.scale),
          .body = body.geometry.index,
          .body_scale = glm::vec3(body.scale),
          .triangles = pool.triangles_of(surface.geometry.index),
          .limit_m = limit_m,
          .rounding_m = static_cast<float>(reach) * 2.0f * std::numeric_limits<float>::epsilon(),
          .first_word = 0};
}

}  // namespace

// ---- memory

void SurfacePairs::reserve() {
  pairs_.reserve(max_pairs_);
  first_sides_.reserve(max_pairs_);
  second_sides_.reserve(max_pairs_);
  ranges_.reserve(2 * std::size_t{max_pairs_});
  named_.reserve(max_pairs_);
  near_.reserve(max_triangles_);
}

void SurfacePairs::add_buffers(const std::string& name, DeviceNeeds& needs) {
  const auto buffer = [&](gpu::Buffer& target, const char* what, std::size_t bytes, gpu::Memory memory) {
    needs.buffers.push_back({&target, {.name = name + what, .size_bytes = bytes, .memory = memory}});
  };
  const std::size_t pairs = max_pairs_;
  const std::size_t triangles = max_triangles_;
  buffer(sides_, " surfaces", 2 * pairs * sizeof(shared::SurfaceSide), gpu::Memory::upload);
  buffer(named_buffer_, " named surfaces", pairs * sizeof(std::uint32_t), gpu::Memory::upload);
  buffer(bounds_, " surface bounds", pairs * sizeof(float), gpu::Memory::readback);
  buffer(bits_, " near triangle bits", triangles * sizeof(std::uint32_t), gpu::Memory::readback);
  buffer(states_, " surface states", 2 * pairs * shared::surface_subtrees * sizeof(std::uint32_t),
         gpu::Memory::readback);
  buffer(near_buffer_, " near triangles", triangles * sizeof(shared::NearTriangle), gpu::Memory::upload);
  buffer(gaps_, " gaps", triangles * sizeof(shared::SurfaceGap), gpu::Memory::readback);
  buffer(depths_, " depths", triangles * sizeof(shared::SurfaceDepth), gpu::Memory::readback);
  buffer(active_, " active depths", triangles * sizeof(std::uint32_t), gpu::Memory::upload);
  buffer(points_, " surface points", 4 * pairs * sizeof(shared::SurfacePoint), gpu::Memory::upload);
  buffer(feet_, " feet", 4 * pairs * sizeof(shared::SurfaceFoot), gpu::Memory::readback);
}

std::vector<const gpu::Buffer*> SurfacePairs::bound_buffers(gpu::ShaderId shader,
                                                            const accel::GeometryPool& pool) const {
  using enum gpu::ShaderId;
  std::vector<const gpu::Buffer*> bound{&pool.nodes(), &pool.triangles(), &pool.geometries()};
  const auto add = [&](std::initializer_list<const gpu::Buffer*> more) { bound.insert(bound.end(), more); };
  switch (shader) {
    case surface_bounds:
      add({&sides_, &named_buffer_, &bounds_});
      break;
    case surface_near:
      add({&sides_, &bits_, &states_});
      break;
    case surface_gap:
      add({&sides_, &near_buffer_, &gaps_});
      break;
    case surface_inside:
      add({&sides_, &near_buffer_, &gaps_, &depths_});
      break;
    case surface_descent:
      add({&pool.fields(), &sides_, &near_buffer_, &gaps_, &depths_, &active_});
      break;
    default:
      add({&sides_, &near_buffer_, &points_, &feet_});
  }
  return bound;
}

// ---- stages

void SurfacePairs::clear() noexcept {
  pairs_.clear();
  first_sides_.clear();
  second_sides_.clear();
  ranges_.clear();
  near_.clear();
  named_.clear();
  feet_count_ = 0;
  words_ = 0;
}

std::optional<std::uint32_t> SurfacePairs::add(const EntityRow& first, const EntityRow& second, WorldTime t,
                                               float margin_m, bool is_named,
                                               const accel::GeometryPool& pool) noexcept {
  const auto words_of = [&](const EntityRow& row) {
    return (pool.triangles_of(row.geometry.index) + bits_per_word - 1) / bits_per_word;
  };
  const std::uint32_t first_words = words_of(first);
  const std::uint64_t end = words_ + first_words + words_of(second);
  if (pairs_.size() == max_pairs_ || end > max_triangles_) return std::nullopt;
  pairs_.push_back(
      {.poses = {first, second, t},
       .margin_m = margin_m,
       .has_depth = pool.has_inside(first.geometry.index) || pool.has_inside(second.geometry.index)});
  first_sides_.push_back(side_of(first, second, t, margin_m, pool));
  second_sides_.push_back(side_of(second, first, t, 0.0f, pool));
  first_sides_.back().first_word = static_cast<std::uint32_t>(words_);
  second_sides_.back().first_word = static_cast<std::uint32_t>(words_ + first_words);
  words_ = end;
  if (is_named) named_.push_back(count() - 1);
  return count() - 1;
}

std::uint32_t SurfacePairs::begin_bounds() noexcept {
  const auto sides = sides_.host_as<shared::SurfaceSide>();
  std::ranges::copy(first_sides_, sides.begin());
  std::ranges::copy(named_, named_buffer_.host_as<std::uint32_t>().begin());
  return static_cast<std::uint32_t>(named_.size());
}

std::uint32_t SurfacePairs::begin_near() noexcept {
  const auto bounds = bounds_.host_as<const float>();
  for (std::size_t i = 0; i < named_.size(); ++i) {
    pairs_[named_[i]].bound_is_incomplete = bounds[i] < 0.0f;
    float& limit_m = first_sides_[named_[i]].limit_m;
    limit_m = std::max(limit_m, bounds[i]);
  }
  const auto sides = sides_.host_as<shared::SurfaceSide>();
  std::ranges::copy(first_sides_, sides.begin());
  std::ranges::copy(second_sides_, sides.begin() + count());
  std::ranges::fill(bits_.host_as<std::uint32_t>().first(words_), 0u);
  return 2 * count() * shared::surface_subtrees;
}

std::uint32_t SurfacePairs::begin_gaps() noexcept {
  for (std::uint32_t side = 0; side < 2 * count(); ++side)
    list_near(side);
  std::ranges::copy(near_, near_buffer_.host_as<shared::NearTriangle>().begin());
  return begin_insides();
}

void SurfacePairs::list_near(std::uint32_t side) noexcept {
  const bool first = is_first_side(side);
  const std::uint32_t pair = first ? side : side - count();
  const shared::SurfaceSide& record = first ? first_sides_[pair] : second_sides_[pair];
  const auto begin = static_cast<std::uint32_t>(near_.size());
  const std::uint32_t words = (record.triangles + bits_per_word - 1) / bits_per_word;
  const auto bits = bits_.host_as<const std::uint32_t>().subspan(record.first_word, words);
  for (std::uint32_t word = 0; word < words && !pairs_[pair].exceeds_capacity; ++word) {
    for (std::uint32_t remaining = bits[word]; remaining != 0; remaining &= remaining - 1) {
      if (near_.size() == max_triangles_) {
        pairs_[pair].exceeds_capacity = true;
        break;
      }
      near_.push_back(
          {.side = side,
           .place = word * bits_per_word + static_cast<std::uint32_t>(std::countr_zero(remaining))});
    }
  }
  if (pairs_[pair].exceeds_capacity) near_.resize(begin);
  ranges_.push_back({begin, static_cast<std::uint32_t>(near_.size())});
}

std::uint32_t SurfacePairs::begin_samples(bool is_first_stage) noexcept {
  if (!is_first_stage) return list_active(active_count_);
  const auto active = active_.host_as<std::uint32_t>();
  for (std::uint32_t near = 0; near < near_.size(); ++near)
    active[near] = near;
  return list_active(begin_insides());
}

/// Drops those of the first `listed` active searches that have ended.
std::uint32_t SurfacePairs::list_active(std::uint32_t listed) noexcept {
  const auto depths = depths_.host_as<const shared::SurfaceDepth>();
  const auto active = active_.host_as<std::uint32_t>();
  active_count_ = 0;
  for (const std::uint32_t near : active.first(listed))
    if (depths[near].state == shared::surface_goes_on) active[active_count_++] = near;
  return active_count_;
}

float SurfacePairs::deepest_sample_m(std::uint32_t pair) const noexcept {
  const auto depths = depths_.host_as<const shared::SurfaceDepth>();
  float deepest_m = 0.0f;
  for (const std::uint32_t side : {pair, count() + pair})
    for (std::uint32_t near = ranges_[side].first; near < ranges_[side].end; ++near)
      if (depths[near].samples > 0) deepest_m = std::max(deepest_m, depths[near].deepest.w);
  return deepest_m;
}

std::uint32_t SurfacePairs::begin_descents(bool is_first_stage) noexcept {
  if (!is_first_stage) return list_active(active_count_);
  const auto depths = depths_.host_as<shared::SurfaceDepth>();
  const auto active = active_.host_as<std::uint32_t>();
  active_count_ = 0;
  for (std::uint32_t pair = 0; pair < count(); ++pair) {
    const float deepest_m = deepest_sample_m(pair);
    for (const std::uint32_t side : {pair, count() + pair}) {
      for (std::uint32_t near = ranges_[side].first; near < ranges_[side].end; ++near) {
        if (depths[near].samples < shared::descent_samples || depths[near].max_depth_m < deepest_m) continue;
        depths[near].state = shared::surface_goes_on;
        active[active_count_++] = near;
      }
    }
  }
  return active_count_;
}

std::uint32_t SurfacePairs::begin_refining(bool is_first_stage) noexcept {
  if (!is_first_stage) return list_active(active_count_);
  const auto depths = depths_.host_as<shared::SurfaceDepth>();
  const auto active = active_.host_as<std::uint32_t>();
  active_count_ = 0;
  for (const Pair& pair : pairs_) {
    for (const Chosen& chosen : std::span(pair.chosen).first(pair.chosen_count)) {
      if (chosen.point != deepest_point) continue;
      shared::SurfaceDepth& depth = depths[chosen.near];
      depth.samples = shared::descent_samples;
      depth.is_refined = 1;
      depth.state = shared::surface_goes_on;
      active[active_count_++] = chosen.near;
    }
  }
  return active_count_;
}

std::uint32_t SurfacePairs::begin_feet() noexcept {
  const auto depths = depths_.host_as<const shared::SurfaceDepth>();
  const auto points = points_.host_as<shared::SurfacePoint>();
  for (const Pair& pair : pairs_)
    for (const Chosen& chosen : std::span(pair.chosen).first(pair.chosen_count))
      if (chosen.point != gap_point)
        points[chosen.foot] = {.point_m = glm::vec3(depth_point(depths[chosen.near], chosen.point)),
                               .near = chosen.near};
  return feet_count_;
}

bool SurfacePairs::is_incomplete(gpu::ShaderId shader, std::uint32_t place) const noexcept {
  using enum gpu::ShaderId;
  switch (shader) {
    case surface_bounds:
      return bounds_.host_as<const float>()[place] < 0.0f;
    case surface_near:
      return states_.host_as<const std::uint32_t>()[place] == shared::surface_unfinished;
    case surface_gap:
      return gaps_.host_as<const shared::SurfaceGap>()[place].state == shared::surface_unfinished;
    case surface_inside:
      return depths_.host_as<const shared::SurfaceDepth>()[place].state == shared::surface_unfinished;
    case surface_descent:
      return is_unfinished(active_.host_as<const std::uint32_t>()[place]);
    default:
      return feet_.host_as<const shared::SurfaceFoot>()[place].state == shared::surface_unfinished;
  }
}

// ---- answers

/// Whether a search for the points of a near triangle reached the device's limits.
bool SurfacePairs::is_unfinished(std::uint32_t near) const noexcept {
  return gaps_.host_as<const shared::SurfaceGap>()[near].state == shared::surface_unfinished ||
         depths_.host_as<const shared::SurfaceDepth>()[near].state == shared::surface_unfinished;
}

SurfacePairs::Verdict SurfacePairs::verdict(std::uint32_t pair) const noexcept {
  const auto gaps = gaps_.host_as<const shared::SurfaceGap>();
  const auto depths = depths_.host_as<const shared::SurfaceDepth>();
  Verdict verdict{.distance_m = std::numeric_limits<float>::max(), .has_depth = pairs_[pair].has_depth};
  if (pairs_[pair].exceeds_capacity) {
    verdict.is_undecided = true;
    return verdict;
  }
  const auto states = states_.host_as<const std::uint32_t>();
  verdict.is_incomplete = pairs_[pair].bound_is_incomplete;
  bool is_inside = false;
  for (const std::uint32_t side : {pair, count() + pair}) {
    const auto subtrees = states.subspan(side * shared::surface_subtrees, shared::surface_subtrees);
    verdict.is_incomplete =
        verdict.is_incomplete || std::ranges::find(subtrees, shared::surface_unfinished) != subtrees.end();
    for (std::uint32_t near = ranges_[side].first; near < ranges_[side].end; ++near) {
      verdict.is_incomplete = verdict.is_incomplete || is_unfinished(near);
      is_inside = is_inside || depths[near].where == shared::triangle_inside;
      if (!is_first_side(side) || gaps[near].distance_m >= verdict.distance_m) continue;
      verdict.distance_m = gaps[near].distance_m;
      verdict.n_world = glm::vec3(pairs_[pair].poses.q_second * glm::dvec3(gaps[near].n));
    }
  }
  if (is_inside) verdict.distance_m = 0.0f;
  return verdict;
}

SurfacePairs::SidePoint SurfacePairs::side_point(const Pair& pair, bool first_side, const glm::vec3& point_m,
                                                 const glm::vec3& outwards) noexcept {
  const BodyPoses& poses = pair.poses;
  const glm::dvec3 p_m(point_m), n(outwards);
  if (first_side) return {glm::vec3(poses.second_m + poses.q_second * p_m), glm::vec3(poses.q_second * n)};
  return {glm::vec3(poses.q_first * p_m), glm::vec3(-(poses.q_first * n))};
}

/// Offers the points of a pair as `offer(number, position, normal, depth)`.
template <class Offer>
void SurfacePairs::offer_points(std::uint32_t pair, const Offer& offer) const noexcept {
  const auto gaps = gaps_.host_as<const shared::SurfaceGap>();
  const auto depths = depths_.host_as<const shared::SurfaceDepth>();
  const Pair& entry = pairs_[pair];
  for (const std::uint32_t side : {pair, count() + pair}) {
    const bool first = is_first_side(side);
    for (std::uint32_t near = ranges_[side].first; near < ranges_[side].end; ++near) {
      for (const TrianglePoint k : {corner_0, corner_1, corner_2, deepest_point}) {
        const glm::vec4 point = depth_point(depths[near], k);
        // The field may report that a triangle inside the other body is outside.
        const bool is_inside = k == deepest_point && depths[near].where == shared::triangle_inside;
        if (point.w <= 0.0f && !is_inside) continue;
        const SidePoint at = side_point(entry, first, glm::vec3(point), depths[near].outwards);
        offer(PointChoice::Number{near, k}, at.p_first_m, at.n_world, point.w);
      }
      if (!first) continue;
      const shared::SurfaceGap& gap = gaps[near];
      const bool is_between_bodies = gap.distance_m > 0.0f && depths[near].where == shared::triangle_outside;
      if (!is_between_bodies || gap.distance_m > entry.margin_m) continue;
      const SidePoint at = side_point(entry, first, gap.point_m, gap.n);
      offer(PointChoice::Number{near, gap_point}, at.p_first_m, at.n_world, -gap.distance_m);
    }
  }
}

void SurfacePairs::choose_points(std::uint32_t pair) noexcept {
  Pair& entry = pairs_[pair];
  float deepest_m = -std::numeric_limits<float>::infinity();
  glm::vec3 n(0.0f);
  offer_points(pair,
               [&](const PointChoice::Number&, const glm::vec3&, const glm::vec3& n_world, float depth_m) {
                 if (depth_m <= deepest_m) return;
                 deepest_m = depth_m;
                 n = n_world;
               });
  PointChoice choice(n, 0.0f);
  for (PointChoice::Step step = choice.begin(); step != PointChoice::Step::done; step = choice.next()) {
    offer_points(pair, [&](const PointChoice::Number& number, const glm::vec3& p_first_m, const glm::vec3&,
                           float depth_m) {
      // A triangle's deepest point is at least as deep as its corners, and is searched once more.
      if (step == PointChoice::Step::deepest && number.k < deepest_point) return;
      choice.offer(number, p_first_m, depth_m);
    });
  }
  const auto gaps = gaps_.host_as<const shared::SurfaceGap>();
  for (std::uint32_t near = ranges_[pair].first; near < ranges_[pair].end; ++near)
    if (!entry.nearest_gap || gaps[near].distance_m < gaps[*entry.nearest_gap].distance_m)
      entry.nearest_gap = near;
  for (const PointChoice::Number& number : choice.chosen()) {
    Chosen& chosen = entry.chosen[entry.chosen_count++];
    chosen = {.near = number.place, .point = static_cast<TrianglePoint>(number.k)};
    if (chosen.point != gap_point) chosen.foot = feet_count_++;
  }
}

ContactPoint SurfacePairs::contact_of(const Pair& pair, const Chosen& chosen) const noexcept {
  const bool first = is_first_side(near_[chosen.near].side);
  ContactPoint contact;
  SidePoint at;
  std::uint32_t surface_triangle = 0;
  std::uint32_t body_triangle = 0;
  if (chosen.point == gap_point) {
    const shared::SurfaceGap& gap = gaps_.host_as<const shared::SurfaceGap>()[chosen.near];
    at = side_point(pair, first, gap.point_m, gap.n);
    contact.depth_m = -gap.distance_m;
    surface_triangle = gap.surface_triangle;
    body_triangle = gap.body_triangle;
  } else {
    const shared::SurfaceFoot& foot = feet_.host_as<const shared::SurfaceFoot>()[chosen.foot];
    const glm::vec3 point_m = points_.host_as<const shared::SurfacePoint>()[chosen.foot].point_m;
    at = side_point(pair, first, 0.5f * (point_m + foot.foot_m), foot.outwards);
    contact.depth_m = foot.depth_m;
    surface_triangle = depths_.host_as<const shared::SurfaceDepth>()[chosen.near].surface_triangle;
    body_triangle = foot.body_triangle;
  }
  contact.p_first_m = at.p_first_m;
  contact.n_world = at.n_world;
  contact.first_triangle = first ? surface_triangle : body_triangle;
  contact.second_triangle = first ? body_triangle : surface_triangle;
  contact.v_relative_mps = pair.poses.v_relative_at_mps(at.p_first_m);
  return contact;
}

bool SurfacePairs::write_points(std::uint32_t pair, bool retry_follows, ContactPair& answer) const noexcept {
  const Pair& entry = pairs_[pair];
  answer.point_count = 0;
  for (const Chosen& chosen : std::span(entry.chosen).first(entry.chosen_count)) {
    if (is_unfinished(chosen.near)) return false;
    if (chosen.point != gap_point && is_incomplete(gpu::ShaderId::surface_feet, chosen.foot))
      return retry_follows;
    const ContactPoint contact = contact_of(entry, chosen);
    // A distance field may give a depth to a point that lies outside of the body.
    if (-contact.depth_m > entry.margin_m) continue;
    answer.points[answer.point_count++] = contact;
  }
  const auto has_depth = [](const ContactPoint& point) { return point.depth_m >= 0.0f; };
  const auto written = std::span(answer.points).first(answer.point_count);
  const bool crosses =
      entry.nearest_gap && gaps_.host_as<const shared::SurfaceGap>()[*entry.nearest_gap].distance_m == 0.0f;
  const bool needs_gap =
      crosses ? std::ranges::none_of(written, has_depth) : entry.nearest_gap && written.empty();
  if (needs_gap) {
    // No point of either surface is known to lie in the other body.
    answer.point_count = std::min(answer.point_count, shared::max_contact_points - 1) + 1;
    answer.points[answer.point_count - 1] =
        contact_of(entry, {.near = *entry.nearest_gap, .point = gap_point});
  }
  const auto points = std::span(answer.points).first(answer.point_count);
  const auto deepest = std::ranges::max_element(points, {}, &ContactPoint::depth_m);
  if (deepest == points.end()) return true;
  std::swap(points.front(), *deepest);
  answer.n_world = points.front().n_world;
  if (answer.status == PairStatus::contact) {
    answer.distance_m = -std::max(points.front().depth_m, 0.0f);
    answer.min_distance_m = answer.max_distance_m = answer.distance_m;
  }
  return true;
}

}  // namespace rtstdb::query
