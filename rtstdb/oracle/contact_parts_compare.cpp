// Judges the contacts of entities that consist of several convex parts.

#include <algorithm>
#include <cmath>

#include "rtstdb/oracle/contact_pair.hpp"
#include "rtstdb/oracle/judged.hpp"

namespace rtstdb::oracle {
namespace {

/// The point with triangles that count within the parts. False: the answer names triangles of other parts.
bool within_parts(const JudgedParts& parts, ContactPoint& point) {
  const auto first = std::ranges::find(parts.first_triangles, point.first_triangle);
  const auto second = std::ranges::find(parts.second_triangles, point.second_triangle);
  if (first == parts.first_triangles.end() || second == parts.second_triangles.end()) return false;
  point.first_triangle = static_cast<std::uint32_t>(first - parts.first_triangles.begin());
  point.second_triangle = static_cast<std::uint32_t>(second - parts.second_triangles.begin());
  return true;
}

Judgement judge_point(std::span<const JudgedParts> all, const ContactPoint& answered) {
  Judgement last = judged(Verdict::differs, "its triangles are of no two parts");
  for (const JudgedParts& parts : all) {
    ContactPoint point = answered;
    if (!within_parts(parts, point)) continue;
    ContactPair of_parts;
    of_parts.n_world = point.n_world;
    last = judge_contact(parts.pair, parts.truth, of_parts, point);
    if (last.verdict == Verdict::agrees)
      last = judge_direction(parts.pair, glm::dvec3(point.n_world),
                             parts.truth.distance_m - parts.truth.depth_tolerance_m());
    if (last.verdict == Verdict::agrees) return {};
  }
  return last;
}

}  // namespace

Judgement judge_parts(std::span<const JudgedParts> parts, const ContactSearch& search,
                      const ContactPair& answer) {
  const JudgedParts& nearest =
      *std::ranges::min_element(parts, {}, [](const JudgedParts& one) { return one.truth.distance_m; });
  PairTruth truth = nearest.truth;
  // The bounds may be those of parts that are nearly as near.
  for (const JudgedParts& one : parts)
    if (one.truth.distance_m <= truth.distance_m + one.truth.depth_tolerance_m())
      truth.precision_m = std::max(truth.precision_m, one.truth.precision_m);
  if (answer.status == PairStatus::undecided) return judge_undecided(truth, answer);
  Judgement status = judge_status(truth, search, answer);
  if (status.verdict == Verdict::differs) return status;
  if (Judgement distance = judge_distance(truth, answer); distance.verdict != Verdict::agrees)
    return distance;
  const bool is_right_normal = std::ranges::any_of(parts, [&](const JudgedParts& one) {
    return one.truth.distance_m <= truth.distance_m + truth.depth_tolerance_m() + one.truth.precision_m &&
           judge_direction(one.pair, glm::dvec3(answer.n_world), truth.distance_m - truth.depth_tolerance_m())
                   .verdict == Verdict::agrees;
  });
  if (!is_right_normal)
    return judged(Verdict::differs, "a normal that is right for none of the nearest parts");
  const bool needs_point = answer.status != PairStatus::separate;
  if (answer.point_count > answer.points.size() || needs_point != (answer.point_count > 0))
    return judged(Verdict::differs, "%u contact points", answer.point_count);
  if (!needs_point) return status;
  if (std::abs(answer.points[0].depth_m + answer.distance_m) > static_cast<float>(truth.depth_tolerance_m()))
    return judged(Verdict::differs, "the first contact point is %.9g m deep at a distance of %.9g m",
                  static_cast<double>(answer.points[0].depth_m), static_cast<double>(answer.distance_m));
  for (std::uint32_t i = 0; i < answer.point_count; ++i) {
    const Judgement one = judge_point(parts, answer.points[i]);
    if (one.verdict != Verdict::agrees)
      return judged(one.verdict, "contact point %u: %s", i, one.reason.c_str());
  }
  return status;
}

}  // namespace rtstdb::oracle
