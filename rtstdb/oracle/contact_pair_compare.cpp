// Judges one pair of a contact answer against the hulls of its bodies.

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "rtstdb/oracle/contact_pair.hpp"
#include "rtstdb/oracle/judged.hpp"
#include "rtstdb/oracle/nearest_point.hpp"

namespace rtstdb::oracle {
namespace {

PairStatus status_of(double distance_m, double margin_m) {
  if (distance_m <= 0.0) return PairStatus::contact;
  return distance_m <= margin_m ? PairStatus::near : PairStatus::separate;
}

}  // namespace

/// too_close: the distance is within its precision of the border between two statuses.
Judgement judge_status(const PairTruth& truth, const ContactSearch& search, const ContactPair& answer) {
  const auto margin_m = static_cast<double>(search.margin_m);
  if (answer.status == status_of(truth.distance_m, margin_m)) {
    if (answer.status == PairStatus::separate && !search.second.valid())
      return judged(Verdict::differs, "it is %.9g m apart, beyond the margin", truth.distance_m);
    return {};
  }
  const double low_m = truth.distance_m - truth.precision_m;
  const double high_m = truth.distance_m + truth.precision_m;
  bool is_possible = false;
  if (answer.status == PairStatus::contact) is_possible = low_m <= 0.0;
  if (answer.status == PairStatus::near) is_possible = high_m > 0.0 && low_m <= margin_m;
  if (answer.status == PairStatus::separate) is_possible = high_m > margin_m && search.second.valid();
  return judged(is_possible ? Verdict::too_close : Verdict::differs, "status %s at a distance of %.9g m",
                to_string(answer.status), truth.distance_m);
}

namespace {

/// Empty: the bounds contain the truth and the distance.
Judgement judge_bounds(const PairTruth& truth, const ContactPair& answer) {
  const auto min_m = static_cast<double>(answer.min_distance_m);
  const auto max_m = static_cast<double>(answer.max_distance_m);
  // Rounding of the oracle's double precision.
  const double rounding_m = 1e-6 * truth.ulp_m + 1e-12 * std::abs(truth.distance_m);
  if (min_m <= truth.distance_m + rounding_m && max_m >= truth.distance_m - rounding_m &&
      answer.distance_m >= answer.min_distance_m && answer.distance_m <= answer.max_distance_m)
    return {};
  return judged(Verdict::differs, "bounds from %.9g to %.9g m with %.9g m, where it is %.9g m", min_m, max_m,
                static_cast<double>(answer.distance_m), truth.distance_m);
}

}  // namespace

Judgement judge_undecided(const PairTruth& truth, const ContactPair& answer) {
  if (Judgement bounds = judge_bounds(truth, answer); bounds.verdict != Verdict::agrees) return bounds;
  if (answer.n_world != glm::vec3(0.0f)) return judged(Verdict::differs, "undecided with a normal");
  return judged(Verdict::too_close, "undecided from %.9g to %.9g m",
                static_cast<double>(answer.min_distance_m), static_cast<double>(answer.max_distance_m));
}

Judgement judge_distance(const PairTruth& truth, const ContactPair& answer) {
  if (Judgement bounds = judge_bounds(truth, answer); bounds.verdict != Verdict::agrees) return bounds;
  const double apart_m =
      static_cast<double>(answer.max_distance_m) - static_cast<double>(answer.min_distance_m);
  if (apart_m <= truth.depth_tolerance_m()) return {};
  return judged(Verdict::differs, "bounds that are %.9g m apart, where %.9g m are allowed", apart_m,
                truth.depth_tolerance_m());
}

Judgement judge_direction(const PosedPair& pair, const glm::dvec3& n, double at_least_m) {
  if (!(std::abs(glm::length(n) - 1.0) <= 1e-5))
    return judged(Verdict::differs, "a normal of length %.9g", glm::length(n));
  const double gap_m = gap_along_m(pair.first_body, pair.second_body, glm::normalize(n));
  if (gap_m >= at_least_m) return {};
  return judged(Verdict::differs, "a gap of %.9g m along the normal (%.6g, %.6g, %.6g), where it is %.9g m",
                gap_m, n.x, n.y, n.z, at_least_m);
}

Judgement judge_velocity(const PosedEntity& first, const PosedEntity& second, const ContactPoint& point,
                         double precision_m) {
  const Motion& of_first = first.state->row.motion;
  const Motion& of_second = second.state->row.motion;
  const glm::dvec3 from_first_m(point.p_first_m);
  const glm::dvec3 from_second_m = from_first_m + (first.pose.p_world_m - second.pose.p_world_m);
  const glm::dvec3 expected_mps = of_first.v_world_mps + glm::cross(of_first.w_world_radps, from_first_m) -
                                  of_second.v_world_mps - glm::cross(of_second.w_world_radps, from_second_m);
  const double first_radps = glm::length(of_first.w_world_radps);
  const double second_radps = glm::length(of_second.w_world_radps);
  const double speeds_mps = glm::length(of_first.v_world_mps) + glm::length(of_second.v_world_mps) +
                            first_radps * glm::length(from_first_m) +
                            second_radps * glm::length(from_second_m);
  const double tolerance_mps =
      velocity_relative_tolerance * speeds_mps + (first_radps + second_radps) * precision_m;
  const glm::dvec3 v(point.v_relative_mps);
  if (glm::distance(v, expected_mps) <= tolerance_mps) return {};
  return judged(Verdict::differs, "relative velocity (%.9g, %.9g, %.9g) instead of (%.9g, %.9g, %.9g)", v.x,
                v.y, v.z, expected_mps.x, expected_mps.y, expected_mps.z);
}

namespace {

/// Whether the point is within the tolerance of the named triangle, as it is of the surface of the body.
Judgement judge_triangle(const ConvexBody& body, std::uint32_t triangle, const glm::dvec3& surface_m,
                         double tolerance_m) {
  if (triangle >= body.triangles_m.size())
    return judged(Verdict::differs, "there is no triangle %u", triangle);
  const double off_m =
      glm::distance(nearest_on_triangle(body.triangles_m[triangle], surface_m).point, surface_m);
  if (off_m <= tolerance_m) return {};
  return judged(Verdict::differs, "it is %.3g m off triangle %u", off_m, triangle);
}

/// Whether the surface of the body at the point is the one that a line in this direction leaves it through.
bool is_exit(const ConvexBody& body, const glm::dvec3& surface_m, const glm::dvec3& direction,
             double tolerance_m) {
  return depth_inside_m(body, surface_m + 4.0 * tolerance_m * direction) <= tolerance_m;
}

}  // namespace

Judgement judge_contact(const PosedPair& pair, const PairTruth& truth, const ContactPair& answer,
                        const ContactPoint& point) {
  const double tolerance_m = truth.depth_tolerance_m();
  const auto depth_m = static_cast<double>(point.depth_m);
  if (!(depth_m <= -truth.distance_m + tolerance_m))
    return judged(Verdict::differs, "depth %.9g m, where the pair's is %.9g m", depth_m, -truth.distance_m);
  if (point.n_world != answer.n_world) return judged(Verdict::differs, "its normal is not the pair's");
  const glm::dvec3 p(point.p_first_m);
  const glm::dvec3 n(answer.n_world);
  struct Side {
    const ConvexBody& body;
    glm::dvec3 surface_m;
    glm::dvec3 outward;
    std::uint32_t triangle;
  };
  // Along the normal, the surface of the first body is below that of the second if they penetrate.
  const std::array<Side, 2> sides{Side{pair.first_body, p - 0.5 * depth_m * n, -n, point.first_triangle},
                                  Side{pair.second_body, p + 0.5 * depth_m * n, n, point.second_triangle}};
  for (const Side& side : sides) {
    const char* name = &side == sides.data() ? "first" : "second";
    const double off_m = surface_distance_m(side.body, side.surface_m);
    if (!(off_m <= tolerance_m))
      return judged(Verdict::differs, "it is %.3g m off the surface of the %s body", off_m, name);
    if (!is_exit(side.body, side.surface_m, side.outward, tolerance_m))
      return judged(Verdict::differs, "it is on the far side of the %s body", name);
    if (Judgement judgement = judge_triangle(side.body, side.triangle, side.surface_m, tolerance_m);
        judgement.verdict != Verdict::agrees)
      return judgement;
  }
  return judge_velocity(pair.first, pair.second, point, truth.precision_m);
}

namespace {

Judgement judge_points(const PosedPair& pair, const PairTruth& truth, double margin_m,
                       const ContactPair& answer) {
  const bool needs_point = answer.status != PairStatus::separate;
  if (answer.point_count > answer.points.size() || needs_point == (answer.point_count == 0))
    return judged(Verdict::differs, "%u contact points", answer.point_count);
  if (answer.point_count == 0) return {};
  const auto depth_m = static_cast<double>(answer.points[0].depth_m);
  const auto distance_m = static_cast<double>(answer.distance_m);
  if (!(std::abs(depth_m + distance_m) <= truth.depth_tolerance_m()))
    return judged(Verdict::differs, "the first contact point is %.9g m deep at a distance of %.9g m", depth_m,
                  distance_m);
  for (std::uint32_t i = 0; i < answer.point_count; ++i) {
    const auto apart_m = -static_cast<double>(answer.points[i].depth_m);
    if (!(apart_m <= margin_m + truth.precision_m))
      return judged(Verdict::differs,
                    "contact point %u: the bodies are %.9g m apart, beyond the margin %.9g m", i, apart_m,
                    margin_m);
    const Judgement one = judge_contact(pair, truth, answer, answer.points[i]);
    if (one.verdict != Verdict::agrees)
      return judged(one.verdict, "contact point %u: %s", i, one.reason.c_str());
  }
  return {};
}

}  // namespace

Judgement judge_pair(const PosedPair& pair, const PairTruth& truth, const ContactSearch& search,
                     const ContactPair& answer) {
  if (answer.status == PairStatus::undecided) return judge_undecided(truth, answer);
  Judgement status = judge_status(truth, search, answer);
  if (status.verdict == Verdict::differs) return status;
  if (Judgement judgement = judge_distance(truth, answer); judgement.verdict != Verdict::agrees)
    return judgement;
  const double gap_m = static_cast<double>(answer.min_distance_m) - 4.0 * truth.ulp_m;
  if (Judgement judgement = judge_direction(pair, glm::dvec3(answer.n_world), gap_m);
      judgement.verdict != Verdict::agrees)
    return judgement;
  if (Judgement judgement = judge_points(pair, truth, static_cast<double>(search.margin_m), answer);
      judgement.verdict != Verdict::agrees)
    return judgement;
  return status;
}

Judgement compare(const World& world, const ContactSearch& search, const PairTruth& truth,
                  const ContactPair& answer) {
  return judge_pair(posed_pair(world, answer.first, answer.second, search.t), truth, search, answer);
}

}  // namespace rtstdb::oracle
