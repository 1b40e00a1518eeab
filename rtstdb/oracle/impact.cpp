// Judges first times of impact: by the exact distance at the time of the answer, and by a search in double
// precision for an earlier time at which the bodies were nearer: of surfaces by branch and bound over time
// and both trees (surface_approach.hpp), of convex bodies by the halving of intervals of time.

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "rtstdb/oracle/contact_pair.hpp"
#include "rtstdb/oracle/contact_surface.hpp"
#include "rtstdb/oracle/judged.hpp"
#include "rtstdb/oracle/oracle.hpp"
#include "rtstdb/oracle/posed_ray.hpp"
#include "rtstdb/oracle/surface_approach.hpp"

namespace rtstdb::oracle {
namespace {

double seconds_of(Nanoseconds time) {
  return static_cast<double>(time.count()) * 1e-9;
}

WorldTime after_s(WorldTime t, double seconds) {
  return t + Nanoseconds(static_cast<std::int64_t>(seconds * 1e9));
}

/// An entity that a search admits.
struct Other {
  EntityId id;
  double gap_m = 0.0;  ///< least one of the spheres around both origins in the window, minus the tolerance
  double noise_m = 0.0;
};

std::vector<Other> others_of(const World& world, const ImpactSearch& search) {
  const EntityState& first = *world.find(search.first);
  const PosedEntity at = posed(world, first, search.t, false);
  std::vector<Other> others;
  for (const EntityState& state : world.entities()) {
    if (state.id == search.first || !state.row.geometry.valid()) continue;
    if (search.second.valid() ? state.id != search.second : !visible(state, search.second_mask)) continue;
    const PosedEntity other = posed(world, state, search.t, false);
    const glm::dvec3 p_m = other.pose.p_world_m - at.pose.p_world_m;
    const glm::dvec3 v_mps = state.row.motion.v_world_mps - first.row.motion.v_world_mps;
    const double square = glm::dot(v_mps, v_mps);
    const double window_s = seconds_of(search.window);
    const double closest_s = square > 0.0 ? std::clamp(-glm::dot(p_m, v_mps) / square, 0.0, window_s) : 0.0;
    const double distance_m = glm::length(p_m + closest_s * v_mps);
    const double scale_m =
        glm::length(at.pose.p_world_m) + glm::length(p_m) +
        (glm::length(v_mps) + glm::length(state.row.motion.v_world_mps)) * (window_s + 1.0) + at.reach() +
        other.reach();
    others.push_back({state.id,
                      distance_m - at.reach() - other.reach() - static_cast<double>(search.tolerance_m),
                      1e-5 * scale_m});
  }
  return others;
}

/// The pair of parts that is nearest at the time, with its truth.
JudgedParts nearest_parts(const World& world, EntityId first, EntityId second, WorldTime t) {
  JudgedParts nearest;
  nearest.truth.distance_m = std::numeric_limits<double>::infinity();
  for (std::uint32_t a = 0; a < world.parts_of(*world.find(first)).size(); ++a) {
    for (std::uint32_t b = 0; b < world.parts_of(*world.find(second)).size(); ++b) {
      JudgedParts parts;
      parts.pair = posed_parts(world, first, a, second, b, t);
      parts.truth = pair_truth(parts.pair);
      if (parts.truth.distance_m < nearest.truth.distance_m) nearest = std::move(parts);
    }
  }
  return nearest;
}

/// Resolution of the positions of two surfaces in single precision: 4 units in the last place.
double rounding_m(const SurfaceBody& first, const SurfaceBody& second) {
  return 4.0 * double{std::numeric_limits<float>::epsilon()} *
         std::max(first.largest_coordinate_m(), second.largest_coordinate_m());
}

/// A time, up to `end_s` after the begin of the window, at which convex bodies are nearer than the level;
/// the first one but for a nanosecond. Empty: none. No point of one body moves faster than `speed_mps`
/// relative to the other, so the distance in the middle of an interval decides for the interval, or both
/// halves of it are searched.
std::optional<double> time_below(const World& world, const ImpactSearch& search, EntityId second,
                                 double level_m, double speed_mps, double begin_s, double end_s) {
  const double middle_s = 0.5 * (begin_s + end_s);
  const double distance_m =
      nearest_parts(world, search.first, second, after_s(search.t, middle_s)).truth.distance_m;
  const double half_s = 0.5 * (end_s - begin_s);
  if (distance_m - speed_mps * half_s >= level_m) return std::nullopt;
  if (half_s < 0.5e-9) return distance_m < level_m ? std::optional(middle_s) : std::nullopt;
  if (const auto earlier = time_below(world, search, second, level_m, speed_mps, begin_s, middle_s))
    return earlier;
  if (distance_m < level_m) return middle_s;
  return time_below(world, search, second, level_m, speed_mps, middle_s, end_s);
}

/// An earlier time than `end_s` at which the bodies are nearer than half the tolerance.
std::optional<double> earlier_impact(const World& world, const ImpactSearch& search, EntityId second,
                                     double end_s) {
  const double half_m = 0.5 * static_cast<double>(search.tolerance_m);
  if (is_surface_pair(world, search.first, second)) {
    const SurfacePair pair(world, search.first, second, search.t);
    return time_nearer_than(world, search, second,
                            half_m - rounding_m(pair.first_surface, pair.second_surface), end_s);
  }
  const Motion& a = world.find(search.first)->row.motion;
  const Motion& b = world.find(second)->row.motion;
  const double reach_a_m = posed(world, *world.find(search.first), search.t, false).reach();
  const double reach_b_m = posed(world, *world.find(second), search.t, false).reach();
  const double speed_mps = glm::length(a.v_world_mps - b.v_world_mps) +
                           glm::length(a.w_world_radps) * reach_a_m +
                           glm::length(b.w_world_radps) * reach_b_m;
  const double precision_m = nearest_parts(world, search.first, second, search.t).truth.precision_m;
  return time_below(world, search, second, half_m - precision_m, speed_mps, 0.0, end_s);
}

/// Judges the relative velocity of two entities that meet according to the answer.
Judgement judge_velocity(const World& world, const ImpactSearch& search, const ImpactAnswer& answer) {
  const PosedEntity first = posed(world, *world.find(search.first), search.t + answer.after, false);
  const PosedEntity second = posed(world, *world.find(answer.second), search.t + answer.after, false);
  const Motion& a = first.state->row.motion;
  const Motion& b = second.state->row.motion;
  const glm::dvec3 p_m(answer.p_first_m);
  const glm::dvec3 from_second_m = p_m + first.pose.p_world_m - second.pose.p_world_m;
  const glm::dvec3 v_mps = a.v_world_mps + glm::cross(a.w_world_radps, p_m) - b.v_world_mps -
                           glm::cross(b.w_world_radps, from_second_m);
  if (glm::distance(glm::dvec3(answer.v_relative_mps), v_mps) > 1e-3 * (1.0 + glm::length(v_mps)))
    return judged(Verdict::differs, "a wrong relative velocity");
  return {};
}

/// Whether a point of one surface lies in the other body.
bool is_point_within(const SurfaceBody& surface, const SurfaceBody& body, const glm::dvec3& p_m,
                     double slack_m) {
  return surface.nearest(p_m).distance_m <= slack_m &&
         (body.is_inside(p_m) || (body.has_inside() && body.nearest(p_m).distance_m <= slack_m));
}

/// Surfaces: the distance and the nearest points at the time of the answer.
Judgement judge_surfaces(const World& world, const ImpactSearch& search, const ImpactAnswer& answer) {
  const SurfacePair pair(world, search.first, answer.second, search.t + answer.after);
  const SurfaceBody& first = pair.first_surface;
  const SurfaceBody& second = pair.second_surface;
  const double distance_m = surface_gap(first, second).distance_m;
  const auto tolerance_m = static_cast<double>(search.tolerance_m);
  const auto answered_m = static_cast<double>(answer.distance_m);
  const double speed_mps = glm::length(glm::dvec3(answer.v_relative_mps));
  const double slack_m = 2.0 * rounding_m(first, second) + 2e-9 * speed_mps;
  const glm::dvec3 p_m(answer.p_first_m);
  const double off_m = std::max(first.nearest(p_m).distance_m, second.nearest(p_m).distance_m);
  const bool is_within = answered_m == 0.0 && answer.after.count() == 0 &&
                         (is_point_within(first, second, p_m, 2.0 * slack_m) ||
                          is_point_within(second, first, p_m, 2.0 * slack_m));
  if (is_within) return judge_velocity(world, search, answer);
  // The answered distance may be too large by a tenth.
  if (answered_m < distance_m - slack_m || answered_m > 1.1 * distance_m + slack_m)
    return judged(Verdict::differs, "distance %.9g m instead of %.9g m", answered_m, distance_m);
  if (distance_m > tolerance_m + slack_m)
    return judged(Verdict::differs, "surfaces that are %.9g m apart meet", distance_m);
  if (off_m > 0.55 * distance_m + 2.0 * slack_m)
    return judged(Verdict::differs, "the point is %.9g m off a surface at %.9g m", off_m, distance_m);
  if (distance_m > 20.0 * slack_m) {
    const glm::dvec3 n(answer.n_world);
    if (std::abs(glm::length(n) - 1.0) > 1e-4) return judged(Verdict::differs, "a normal that is not unit");
    const double apart_m = surface_gap(first, second, -answered_m * n).distance_m;
    if (apart_m > 2.0 * slack_m + 0.2 * distance_m)
      return judged(Verdict::differs, "moved along the normal they are %.9g m apart", apart_m);
  }
  return judge_velocity(world, search, answer);
}

Judgement judge_meeting(const World& world, const ImpactSearch& search, const ImpactAnswer& answer) {
  if (is_surface_pair(world, search.first, answer.second)) return judge_surfaces(world, search, answer);
  const JudgedParts nearest = nearest_parts(world, search.first, answer.second, search.t + answer.after);
  const PosedPair& pair = nearest.pair;
  const PairTruth& truth = nearest.truth;
  const auto tolerance_m = static_cast<double>(search.tolerance_m);
  const double speed_mps =
      glm::length(pair.first.state->row.motion.v_world_mps - pair.second.state->row.motion.v_world_mps);
  // The time is whole nanoseconds, and distances are found with a tenth of the tolerance.
  const double slack_m = truth.precision_m + 0.1 * tolerance_m + 2e-9 * speed_mps;
  if (truth.distance_m > tolerance_m + slack_m)
    return judged(Verdict::differs, "entities of %.3g and %.3g m are %.9g m apart after %.9g s, not %.9g m",
                  pair.first_body.diagonal_m, pair.second_body.diagonal_m, truth.distance_m,
                  seconds_of(answer.after), static_cast<double>(answer.distance_m));
  if (answer.after.count() > 0 && truth.distance_m < -slack_m)
    return judged(Verdict::differs, "they are %.9g m in one another then", -truth.distance_m);
  if (std::abs(std::max(truth.distance_m, 0.0) - static_cast<double>(answer.distance_m)) > slack_m)
    return judged(Verdict::differs, "distance %.9g m instead of %.9g m",
                  static_cast<double>(answer.distance_m), truth.distance_m);
  if (answer.distance_m == 0.0f) return {};
  const glm::dvec3 n(answer.n_world);
  if (std::abs(glm::length(n) - 1.0) > 1e-4) return judged(Verdict::differs, "a normal that is not unit");
  const double larger_m = std::max(pair.first_body.diagonal_m, pair.second_body.diagonal_m);
  const double n_error = 4.0 * double{std::numeric_limits<float>::epsilon()} * larger_m / truth.distance_m;
  if (gap_along_m(pair.first_body, pair.second_body, n) <
      truth.distance_m - slack_m - 0.02 * tolerance_m - n_error * larger_m)
    return judged(Verdict::differs, "the bodies are not that far apart along the normal");
  const glm::dvec3 p_m(answer.p_first_m);
  for (const ConvexBody* body : {&pair.first_body, &pair.second_body}) {
    const double off_m = surface_distance_m(*body, p_m);
    if (off_m > truth.distance_m + 2.0 * slack_m + tolerance_m)
      return judged(Verdict::differs, "the point is %.9g m off a surface", off_m);
  }
  return judge_velocity(world, search, answer);
}

}  // namespace

Judgement judge(const World& world, const ImpactSearch& search, std::span<const ImpactAnswer> of_element,
                const ImpactQueryOptions& options) {
  const ImpactAnswer& answer = of_element.front();
  if (answer.incomplete) return judged(Verdict::differs, "incomplete");
  const std::vector<Other> others = others_of(world, search);
  std::uint32_t certain = 0, possible = 0;
  for (const Other& other : others) {
    const bool is_certain = search.second.valid() || other.gap_m < -other.noise_m;
    const bool is_possible = search.second.valid() || other.gap_m <= other.noise_m;
    certain += is_certain ? 1 : 0;
    possible += is_possible ? 1 : 0;
  }
  if (answer.candidates < certain || answer.candidates > possible)
    return judged(Verdict::differs, "%u candidates, where there are %u to %u", answer.candidates, certain,
                  possible);
  if (answer.overflow != (answer.candidates > options.candidates_per_search))
    return judged(Verdict::differs, "overflow is wrong for %u candidates", answer.candidates);
  if ((answer.status == ImpactStatus::undecided) != (answer.reason != UndecidedReason::none))
    return judged(Verdict::differs, "%s for the reason %s", to_string(answer.status),
                  to_string(answer.reason));
  if ((answer.reason == UndecidedReason::capacity) !=
      (answer.status == ImpactStatus::undecided && !answer.second.valid()))
    return judged(Verdict::differs, "the pair with entity %u is undecided for the reason %s",
                  answer.second.index, to_string(answer.reason));
  if (answer.overflow) return judged(Verdict::too_close, "not all candidates were searched");
  const bool has_end = answer.status != ImpactStatus::none;
  const double end_s = seconds_of(has_end ? answer.after : search.window);
  if (answer.status == ImpactStatus::impact) {
    if (Judgement judgement = judge_meeting(world, search, answer); judgement.verdict != Verdict::agrees)
      return judgement;
  }
  for (const Other& other : others) {
    if (other.gap_m > other.noise_m || end_s <= 2e-9) continue;
    if (const auto earlier_s = earlier_impact(world, search, other.id, end_s - 2e-9))
      return judged(Verdict::differs, "entity %u is nearer after %.9g s, before %.9g s", other.id.index,
                    *earlier_s, end_s);
  }
  if (answer.status == ImpactStatus::undecided)
    return judged(Verdict::too_close, "undecided after %.9g s: %s", end_s, to_string(answer.reason));
  return {};
}

}  // namespace rtstdb::oracle
