#include "rtstdb/oracle/judge.hpp"

#include <algorithm>
#include <vector>

namespace rtstdb::oracle {
namespace {

/// Against all hits of the ray that the options admit.
Judgement judge_first_hits(const World& world, const Ray& ray, std::span<const RayHit> hits,
                           const RayQueryOptions& options) {
  auto truth = trace_all(world, ray, options.ignore_motion);
  if (options.faces != Faces::both) {
    const bool front = options.faces == Faces::front;
    std::erase_if(truth, [&](const RayTruth& hit) { return hit.front_face != front; });
    const bool hits_other_side = std::ranges::any_of(
        hits, [&](const RayHit& hit) { return hit.status == HitStatus::hit && hit.front_face != front; });
    if (hits_other_side) return {Verdict::differs, "the side of a triangle that the query leaves out"};
  }
  return compare_first(world, ray, options.ignore_motion, truth, hits);
}

/// `truth`: gaps of what may be in the answer. `lists`: the query does not only count.
template <class Gap>
Judgement judge_gaps(const std::vector<Gap>& truth, RegionAnswer answer, bool lists) {
  if (!lists) {
    if (!answer.entities.empty() || !answer.triangles.empty() || answer.overflow)
      return {Verdict::differs, "a query that only counts lists something"};
    answer.overflow = answer.found > 0;  // a list without capacity
  }
  return compare(truth, answer);
}

}  // namespace

Judgement judge(const World& world, const Ray& ray, std::span<const RayHit> of_element,
                const RayQueryOptions& options) {
  if (options.mode == RayMode::first || options.faces != Faces::both)
    return judge_first_hits(world, ray, of_element, options);
  const RayTruth truth = trace(world, ray, options.mode, options.ignore_motion);
  return compare(world, ray, options.mode, options.ignore_motion, truth, of_element.front());
}

Judgement judge(const World& world, const Region& region, std::span<const RegionAnswer> of_element,
                const RegionQueryOptions& options) {
  const bool lists = options.ids_per_region > 0;
  switch (options.level) {
    case RegionLevel::surface:
      return judge_gaps(surface_gaps(world, region), of_element.front(), lists);
    case RegionLevel::triangle:
      return judge_gaps(triangle_gaps(world, region), of_element.front(), lists);
    case RegionLevel::bounds:
      break;
  }
  return judge_gaps(gaps(world, region), of_element.front(), lists);
}

Judgement judge(const World& world, const Overlap& overlap, std::span<const OverlapAnswer> of_element,
                const OverlapQueryOptions& options) {
  return judge_gaps(gaps(world, overlap), of_element.front(), options.ids_per_entity > 0);
}

Judgement judge(const World& world, const Cone& cone, std::span<const ConeReturn> of_element,
                const ConeQueryOptions& options) {
  return compare(world, cone, options, contacts(world, cone, options.faces), of_element);
}

Judgement judge(const World& world, const Nearest& point, std::span<const NearestAnswer> of_element,
                const NearestQueryOptions& options) {
  return compare(world, point, options, nearest(world, point, options), of_element.front());
}

Judgement judge(const World& world, const ContactSearch& search, std::span<const ContactAnswer> of_element,
                const ContactQueryOptions& options) {
  return compare(world, search, options, contact_candidates(world, search), of_element.front());
}

}  // namespace rtstdb::oracle
