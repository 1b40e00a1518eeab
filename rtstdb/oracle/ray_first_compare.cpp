#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

#include "rtstdb/oracle/judged.hpp"
#include "rtstdb/oracle/oracle.hpp"

namespace rtstdb::oracle {
namespace {

/// The tolerance of lambda: the length of noise_m along a ray that meets the surface at this angle.
double lambda_slack(const Ray& ray, const RayTruth& hit) {
  const double length = glm::length(glm::dvec3(ray.direction));
  return lambda_relative_tolerance * hit.lambda +
         hit.noise_m / (length * std::max(hit.incidence_cosine, 1e-3));
}

/// Whether the hit remains when the ray moves by noise_m.
bool is_clear(const Ray& ray, const RayTruth& hit) {
  const double slack = lambda_slack(ray, hit);
  return hit.incidence_cosine > 1e-3 && hit.edge_distance_m > hit.noise_m &&
         hit.lambda > static_cast<double>(ray.lambda_min) + slack &&
         hit.lambda < static_cast<double>(ray.lambda_max) - slack;
}

/// Judges an answered hit by the neighbourhood of its lambda alone.
Judgement judge_alone(const World& world, const Ray& ray, bool ignore_motion, const RayHit& answer) {
  Ray around = ray;
  around.lambda_min = std::max(ray.lambda_min, answer.lambda * (1.0f - 1e-4f));
  around.lambda_max = std::min(ray.lambda_max, answer.lambda * (1.0f + 1e-4f));
  const auto same = [&](const RayTruth& hit) {
    return hit.entity == answer.entity && hit.triangle == answer.triangle;
  };
  const auto hits = trace_all(world, around, ignore_motion);
  const auto found = std::ranges::find_if(hits, same);
  const RayTruth truth = found != hits.end() ? *found : trace(world, around, RayMode::closest, ignore_motion);
  return compare(world, around, RayMode::first, ignore_motion, truth, answer);
}

}  // namespace

Judgement compare_first(const World& world, const Ray& ray, bool ignore_motion,
                        std::span<const RayTruth> truth, std::span<const RayHit> answers) {
  const auto end =
      std::ranges::find_if(answers, [](const RayHit& hit) { return hit.status != HitStatus::hit; });
  const auto hits = answers.first(static_cast<std::size_t>(end - answers.begin()));
  for (const RayHit& rest : answers.subspan(hits.size())) {
    if (rest.status != HitStatus::miss)
      return {Verdict::differs, "a hit behind a miss, or an incomplete answer"};
  }
  Judgement judgement;
  for (std::size_t k = 0; k < hits.size(); ++k) {
    if (k > 0 && hits[k].lambda < hits[k - 1].lambda) return {Verdict::differs, "hits are not in order"};
    const bool twice = std::ranges::any_of(hits.first(k), [&](const RayHit& before) {
      return before.entity == hits[k].entity && before.triangle == hits[k].triangle;
    });
    if (twice)
      return judged(Verdict::differs, "entity %u, triangle %u is hit twice", hits[k].entity.index,
                    hits[k].triangle);
    Judgement one = judge_alone(world, ray, ignore_motion, hits[k]);
    if (one.verdict == Verdict::differs) return one;
    if (one.verdict == Verdict::too_close) judgement = one;
  }
  const double limit = hits.size() < answers.size() ? static_cast<double>(ray.lambda_max)
                                                    : static_cast<double>(hits.back().lambda);
  for (const RayTruth& hit : truth) {
    const bool answered = std::ranges::any_of(hits, [&](const RayHit& answer) {
      return answer.entity == hit.entity && answer.triangle == hit.triangle;
    });
    if (answered || hit.lambda >= limit - lambda_slack(ray, hit)) continue;
    judgement =
        judged(is_clear(ray, hit) ? Verdict::differs : Verdict::too_close,
               "no hit of entity %u, triangle %u at lambda %.9g", hit.entity.index, hit.triangle, hit.lambda);
    if (judgement.verdict == Verdict::differs) return judgement;
  }
  return judgement;
}

}  // namespace rtstdb::oracle
