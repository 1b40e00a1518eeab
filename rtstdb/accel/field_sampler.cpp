#include "rtstdb/accel/field_sampler.hpp"

#include <glm/ext/vector_double3.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <rtstdb/limits.hpp>

namespace rtstdb::accel {
namespace {

constexpr gpu::ShaderId pass_shaders[] = {gpu::ShaderId::field_distances, gpu::ShaderId::field_winding,
                                          gpu::ShaderId::field_ray_ratio};
constexpr std::uint32_t places_per_group = 64;
// A part of the distance that is larger than the leaves of a dense mesh, so that one of them is enough.
constexpr float retry_slack = 0.05f;

static_assert(shared::field_sign_directions == field_sign_rays);

const Error lost{ErrorCode::device_lost, "the GPU stopped answering while a distance field was built"};

bool is_cut_short(const shared::FieldSample& sample) noexcept {
  return sample.gradient == glm::vec3(0.0f);
}

}  // namespace

Result<FieldSampler> FieldSampler::create(gpu::Device& device) {
  FieldSampler sampler;
  for (std::size_t i = 0; i < pass_count; ++i) {
    auto pipeline = device.create_pipeline(pass_shaders[i]);
    if (!pipeline) return pipeline.error();
    sampler.passes_[i].pipeline = std::move(pipeline).value();
  }
  const gpu::BufferRequest wanted[] = {{&sampler.points_,
                                        {.name = "field points",
                                         .size_bytes = max_points * sizeof(shared::FieldPoint),
                                         .memory = gpu::Memory::upload}},
                                       {&sampler.samples_,
                                        {.name = "field samples",
                                         .size_bytes = max_points * sizeof(shared::FieldSample),
                                         .memory = gpu::Memory::readback}}};
  if (auto made = device.create_buffers(wanted); !made) return made.error();
  return sampler;
}

Result<void> FieldSampler::bind(gpu::Device& device, const GeometryPool& pool) {
  if (bound_ && bound_generation_ == pool.generation()) return {};
  bound_ = false;
  const std::array<const gpu::Buffer*, 4> buffers{&pool.nodes(), &pool.triangles(), &points_, &samples_};
  for (Pass& pass : passes_) {
    auto bindings = device.create_bindings(pass.pipeline, buffers);
    if (!bindings) return bindings.error();
    pass.bindings = std::move(bindings).value();
  }
  bound_ = true;
  bound_generation_ = pool.generation();
  return {};
}

bool FieldSampler::run(shared::FieldArgs args, FieldSign sign, std::uint32_t count, std::uint32_t per_group,
                       Submit& submit) {
  args.first = 0;
  args.end = count;
  args.per_group = per_group;
  const std::uint32_t groups = (count + per_group - 1) / per_group;
  submit.begin();
  const auto dispatch = [&](PassIndex pass) {
    submit.recorder().dispatch(passes_[pass].pipeline, passes_[pass].bindings, args, groups);
  };
  dispatch(distances_pass);
  if (sign != FieldSign::none) {
    submit.recorder().barrier();
    dispatch(sign == FieldSign::winding ? winding_pass : ray_ratio_pass);
  }
  return submit.run();
}

Result<void> FieldSampler::sample(gpu::Device& device, const GeometryPool& pool, std::uint32_t geometry,
                                  FieldSign sign, float front_sign,
                                  std::span<const shared::FieldPoint> points,
                                  std::span<shared::FieldSample> samples, Submit& submit) {
  RTSTDB_ASSERT(points.size() <= max_points && points.size() == samples.size(),
                "more points than max_points, or another number of samples than of points");
  if (auto bound = bind(device, pool); !bound) return bound;
  shared::FieldArgs args{.root = pool.root(geometry),
                         .first = 0,
                         .end = 0,
                         .per_group = 0,
                         .front_sign = front_sign,
                         .slack = 0.0f,
                         .inside_ratio = static_cast<float>(field_inside_ratio),
                         .loop_probe = 2 /* two rounds, see loops_still_turn */};
  std::ranges::copy(points, points_.host_as<shared::FieldPoint>().begin());
  if (!run(args, sign, static_cast<std::uint32_t>(points.size()), places_per_group, submit)) return lost;
  std::ranges::copy(samples_.host_as<const shared::FieldSample>().first(points.size()), samples.begin());

  // On lavapipe the searches of a workgroup share one limit of rounds (shaders/common/loops.glsl): searches
  // that were cut short are repeated, each in a workgroup of its own. With slack, since a point that has
  // nearly the same distance to very many triangles, such as the centre of a sphere, would visit all of them.
  std::vector<std::size_t> again;
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (is_cut_short(samples[i])) again.push_back(i);
  if (again.empty()) return {};
  args.slack = retry_slack;
  for (std::size_t k = 0; k < again.size(); ++k)
    points_.host_as<shared::FieldPoint>()[k] = points[again[k]];
  if (!run(args, sign, static_cast<std::uint32_t>(again.size()), 1, submit)) return lost;
  for (std::size_t k = 0; k < again.size(); ++k) {
    samples[again[k]] = samples_.host_as<const shared::FieldSample>()[k];
    if (is_cut_short(samples[again[k]])) {
      return Error{ErrorCode::capacity,
                   "the distance of a point to the geometry needs a search of more nodes"
                   " than the device completes"};
    }
  }
  return {};
}

float front_sign_of(const TriangleMesh& mesh) noexcept {
  double volume = 0.0;
  for (const glm::uvec3& triangle : mesh.triangles) {
    const glm::dvec3 a(mesh.positions_m[triangle.x]);
    const glm::dvec3 b(mesh.positions_m[triangle.y]);
    const glm::dvec3 c(mesh.positions_m[triangle.z]);
    volume += glm::dot(a, glm::cross(b, c));
  }
  return volume < 0.0 ? -1.0f : 1.0f;
}

}  // namespace rtstdb::accel
