// Judges an image: the first hit of the ray through the middle of each pixel. Colours are judged by the
// closed forms of the tests.

#include <algorithm>
#include <cmath>
#include <string>

#include "rtstdb/oracle/judge.hpp"
#include "rtstdb/oracle/judged.hpp"

namespace rtstdb::oracle {
namespace {

RayHit hit_at(const Image& image, std::size_t pixel, const RayTruth& truth) {
  RayHit hit;
  hit.entity = image.entities[pixel];
  hit.status = hit.entity.valid() ? HitStatus::hit : HitStatus::miss;
  if (hit.status == HitStatus::miss) return hit;
  hit.lambda = image.depth_m[pixel];
  hit.triangle = image.triangles[pixel];
  // An image has no weights and no velocity, and its normals are toward the camera.
  hit.u = static_cast<float>(truth.u);
  hit.v = static_cast<float>(truth.v);
  hit.front_face = truth.front_face;
  hit.n_world = truth.front_face ? image.normals[pixel] : -image.normals[pixel];
  hit.v_relative_mps = glm::vec3(truth.v_relative_mps);
  return hit;
}

/// The rasteriser may leave out a triangle whose edge is near the middle of the pixel: then a hit behind
/// it, or none, is right too.
bool is_hit_behind(const World& world, const Ray& ray, const RayHit& hit) {
  if (hit.status == HitStatus::miss) return true;
  return std::ranges::any_of(trace_all(world, ray), [&](const RayTruth& truth) {
    const double off = std::abs(truth.lambda - static_cast<double>(hit.lambda));
    return truth.entity == hit.entity && truth.triangle == hit.triangle &&
           off <= lambda_relative_tolerance * truth.lambda + truth.noise_m;
  });
}

}  // namespace

Judgement judge(const World& world, const Camera& camera, std::span<const Image> of_element,
                const ImageQueryOptions& options) {
  const Image& image = of_element.front();
  if (!image.missing_tiles.empty() || image.incomplete_pixels > 0)
    return judged(Verdict::differs, "%zu tiles are missing, %u pixels are incomplete",
                  image.missing_tiles.size(), image.incomplete_pixels);
  if (image.width != options.width || image.height != options.height)
    return judged(Verdict::differs, "%u x %u pixels", image.width, image.height);
  if (image.entities.empty() || image.depth_m.empty() || image.normals.empty()) return {};
  Judgement worst;
  for (std::uint32_t row = 0; row < image.height; ++row) {
    for (std::uint32_t column = 0; column < image.width; ++column) {
      const Ray ray = pixel_ray(camera, image.width, image.height, column, row);
      const RayTruth truth = trace(world, ray);
      const RayHit hit = hit_at(image, std::size_t{row} * image.width + column, truth);
      const Judgement judgement = compare(world, ray, RayMode::closest, false, truth, hit);
      if (judgement.verdict == Verdict::agrees) continue;
      const bool is_near_edge = options.first_hits == FirstHits::rasterised && is_hit_behind(world, ray, hit);
      worst = judged(is_near_edge ? Verdict::too_close : judgement.verdict, "pixel %u, %u: %s", column, row,
                     judgement.reason.c_str());
      if (worst.verdict == Verdict::differs) return worst;
    }
  }
  return worst;
}

}  // namespace rtstdb::oracle
