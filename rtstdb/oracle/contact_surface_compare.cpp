// Judges one pair of a contact answer of which a body does not consist of convex parts.

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>

#include "rtstdb/oracle/contact_pair.hpp"
#include "rtstdb/oracle/contact_surface.hpp"
#include "rtstdb/oracle/judged.hpp"
#include "rtstdb/oracle/nearest_point.hpp"

namespace rtstdb::oracle {
namespace {

Judgement judge_surface_status(const SurfaceTruth& truth, const ContactSearch& search,
                               const ContactPair& answer) {
  const auto margin_m = static_cast<double>(search.margin_m);
  const double low_m = truth.is_contact ? 0.0 : truth.distance_m - truth.precision_m;
  const double high_m = truth.is_contact ? truth.precision_m : truth.distance_m + truth.precision_m;
  bool is_right = false;
  bool is_possible = false;
  switch (answer.status) {
    case PairStatus::contact:
      is_right = truth.is_contact;
      is_possible = low_m <= 0.0;
      break;
    case PairStatus::near:
      is_right = !truth.is_contact && truth.distance_m <= margin_m;
      is_possible = !truth.is_certain_contact() && low_m <= margin_m;
      break;
    case PairStatus::separate:
      is_right = !truth.is_contact && truth.distance_m > margin_m && search.second.valid();
      is_possible = !truth.is_certain_contact() && high_m > margin_m && search.second.valid();
      break;
    default:
      break;
  }
  if (is_right) return {};
  return judged(is_possible ? Verdict::too_close : Verdict::differs,
                "status %s, where the surfaces are %.9g m apart and %.9g to %.9g m deep",
                to_string(answer.status), truth.distance_m, truth.min_depth_m, truth.max_depth_m);
}

Judgement judge_undecided_surfaces(const SurfaceTruth& truth, const ContactPair& answer) {
  const double low_m = truth.is_contact ? -truth.max_depth_m : truth.distance_m;
  const double high_m = truth.is_contact ? -truth.min_depth_m : truth.distance_m;
  const auto min_m = static_cast<double>(answer.min_distance_m);
  const auto max_m = static_cast<double>(answer.max_distance_m);
  if (!(min_m <= high_m + truth.precision_m && max_m >= low_m - truth.precision_m &&
        answer.distance_m >= answer.min_distance_m && answer.distance_m <= answer.max_distance_m))
    return judged(Verdict::differs, "undecided from %.9g to %.9g m, %.9g m, where it is %.9g to %.9g m",
                  min_m, max_m, static_cast<double>(answer.distance_m), low_m, high_m);
  if (answer.n_world != glm::vec3(0.0f)) return judged(Verdict::differs, "undecided with a normal");
  return judged(Verdict::too_close, "undecided from %.9g to %.9g m", min_m, max_m);
}

Judgement judge_surface_distance(const SurfaceTruth& truth, const ContactPair& answer) {
  const auto distance_m = static_cast<double>(answer.distance_m);
  const bool is_contact = answer.status == PairStatus::contact;
  if (is_contact) {
    // A contact between surfaces that are apart within the precision.
    const bool is_not_too_deep = -distance_m <= truth.max_depth_m + truth.precision_m && distance_m <= 0.0;
    if (!is_not_too_deep)
      return judged(Verdict::differs, "depth %.9g m, where it is %.9g to %.9g m", -distance_m,
                    truth.min_depth_m, truth.max_depth_m);
    if (!truth.has_depth && distance_m != 0.0)
      return judged(Verdict::differs, "depth %.9g m of bodies without an inside", -distance_m);
  } else if (!(std::abs(distance_m - truth.distance_m) <= truth.precision_m && distance_m >= 0.0)) {
    return judged(Verdict::differs, "distance %.9g m instead of %.9g m", distance_m, truth.distance_m);
  }
  if (is_contact && -distance_m < truth.min_depth_m - truth.depth_tolerance_m())
    return judged(Verdict::too_close, "a local depth of %.9g m", -distance_m);
  const double allowed_m = is_contact ? truth.depth_tolerance_m() : truth.precision_m;
  const auto min_m = static_cast<double>(answer.min_distance_m);
  const auto max_m = static_cast<double>(answer.max_distance_m);
  if (!(min_m <= distance_m && max_m >= distance_m && distance_m - min_m <= allowed_m &&
        max_m - distance_m <= allowed_m))
    return judged(Verdict::differs, "bounds %.9g to %.9g m of a distance of %.9g m", min_m, max_m,
                  distance_m);
  return {};
}

/// The normal of bodies that are separate.
Judgement judge_separate_normal(const SurfacePair& pair, const SurfaceTruth& truth, const glm::dvec3& n) {
  if (!(std::abs(glm::length(n) - 1.0) <= 1e-5))
    return judged(Verdict::differs, "a normal of length %.9g", glm::length(n));
  const SurfaceGap moved =
      surface_gap(pair.first_surface, pair.second_surface, -truth.distance_m * glm::normalize(n));
  if (moved.distance_m <= truth.precision_m + contact_surface_angle_rad * truth.distance_m) return {};
  return judged(Verdict::differs, "moved by the distance against the normal, they are %.9g m apart",
                moved.distance_m);
}

/// A place that the answer states: of one surface, with the named triangle, and the other body.
struct StatedPlace {
  const char* name;
  const SurfaceBody& surface;
  const SurfaceBody& other;
  glm::dvec3 p_m;
  std::uint32_t triangle;
};

Judgement judge_place(const StatedPlace& place, double precision_m) {
  if (place.triangle >= place.surface.triangles().size())
    return judged(Verdict::differs, "the %s body has no triangle %u", place.name, place.triangle);
  const SurfaceTriangle& triangle = place.surface.triangles()[place.triangle];
  const double off_m = glm::distance(nearest_on_triangle(triangle, place.p_m).point, place.p_m);
  if (off_m <= precision_m) return {};
  return judged(Verdict::differs, "it is %.3g m off triangle %u of the %s body", off_m, place.triangle,
                place.name);
}

/// Whether the distance of the place from the other surface is the depth, on the side of its sign.
bool is_as_deep(const StatedPlace& place, double depth_m, double precision_m) {
  if (place.other.nearest(place.p_m).distance_m < std::abs(depth_m) - precision_m) return false;
  if (depth_m > precision_m) return place.other.is_inside(place.p_m);
  return depth_m >= -precision_m || !place.other.is_inside(place.p_m);
}

Judgement judge_surface_point(const SurfacePair& pair, const SurfaceTruth& truth, double max_apart_m,
                              const ContactPair& answer, const ContactPoint& point) {
  const auto depth_m = static_cast<double>(point.depth_m);
  const glm::dvec3 n(point.n_world);
  if (!(std::abs(glm::length(n) - 1.0) <= 1e-5))
    return judged(Verdict::differs, "a normal of length %.9g", glm::length(n));
  if (!(depth_m <= static_cast<double>(answer.points[0].depth_m) + truth.precision_m))
    return judged(Verdict::differs, "depth %.9g m, deeper than the first point", depth_m);
  if (!(depth_m >= -max_apart_m - truth.precision_m))
    return judged(Verdict::differs, "%.9g m apart, beyond the margin", -depth_m);
  if (!truth.has_depth && depth_m > 0.0)
    return judged(Verdict::differs, "depth %.9g m of bodies without an inside", depth_m);
  const glm::dvec3 p(point.p_first_m);
  const std::array<StatedPlace, 2> places{StatedPlace{"first", pair.first_surface, pair.second_surface,
                                                      p - 0.5 * depth_m * n, point.first_triangle},
                                          StatedPlace{"second", pair.second_surface, pair.first_surface,
                                                      p + 0.5 * depth_m * n, point.second_triangle}};
  for (const StatedPlace& place : places)
    if (Judgement judgement = judge_place(place, truth.precision_m); judgement.verdict != Verdict::agrees)
      return judgement;
  const bool has_deep_place = std::ranges::any_of(
      places, [&](const StatedPlace& place) { return is_as_deep(place, depth_m, truth.precision_m); });
  if (!has_deep_place)
    return judged(Verdict::differs, "of neither surface a point at depth %.9g m in the other body", depth_m);
  return judge_velocity(pair.first, pair.second, point, truth.precision_m);
}

Judgement judge_surface_points(const SurfacePair& pair, const SurfaceTruth& truth,
                               const ContactSearch& search, const ContactPair& answer) {
  const auto depth_m = static_cast<double>(answer.points[0].depth_m);
  const auto distance_m = static_cast<double>(answer.distance_m);
  if (!(std::abs(depth_m + distance_m) <= truth.precision_m))
    return judged(Verdict::differs, "the first contact point is %.9g m deep at a distance of %.9g m", depth_m,
                  distance_m);
  if (answer.n_world != answer.points[0].n_world)
    return judged(Verdict::differs, "its normal is not that of the first point");
  const auto margin_m = static_cast<double>(search.margin_m);
  for (std::uint32_t i = 0; i < answer.point_count; ++i) {
    const Judgement judgement = judge_surface_point(pair, truth, margin_m, answer, answer.points[i]);
    if (judgement.verdict != Verdict::agrees)
      return judged(judgement.verdict, "contact point %u: %s", i, judgement.reason.c_str());
  }
  return {};
}

}  // namespace

Judgement judge_surface_pair(const SurfacePair& pair, const SurfaceTruth& truth, const ContactSearch& search,
                             const ContactPair& answer) {
  if (answer.has_depth != truth.has_depth)
    return judged(Verdict::differs, answer.has_depth ? "with depth, but neither body has an inside"
                                                     : "without depth, but a body has an inside");
  if (answer.status == PairStatus::undecided) return judge_undecided_surfaces(truth, answer);
  Judgement status = judge_surface_status(truth, search, answer);
  if (status.verdict == Verdict::differs) return status;
  if (Judgement distance = judge_surface_distance(truth, answer); distance.verdict != Verdict::agrees)
    return distance;
  const bool needs_point = answer.status != PairStatus::separate;
  if (answer.point_count > answer.points.size() || needs_point != (answer.point_count > 0))
    return judged(Verdict::differs, "%u contact points", answer.point_count);
  const Judgement rest = needs_point ? judge_surface_points(pair, truth, search, answer)
                                     : judge_separate_normal(pair, truth, glm::dvec3(answer.n_world));
  return rest.verdict == Verdict::agrees ? status : rest;
}

}  // namespace rtstdb::oracle
