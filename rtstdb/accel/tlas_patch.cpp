#include "rtstdb/accel/tlas_patch.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include <rtstdb/result.hpp>

namespace rtstdb::accel {

namespace {

// Rotations can make the trees of large worlds deeper than those that one workgroup builds.
constexpr std::size_t max_levels = 2 * std::size_t{shared::max_tlas_levels};

}  // namespace

Result<TlasPatch> TlasPatch::create(gpu::Device& device, std::uint32_t instances, std::uint32_t nodes) {
  TlasPatch patch;
  patch.instances_ = instances;
  patch.nodes_ = nodes;
  for (const auto& [pipeline, shader] : {std::pair{&patch.parents_, gpu::ShaderId::tlas_parents},
                                         std::pair{&patch.patch_, gpu::ShaderId::tlas_patch}}) {
    auto made = device.create_pipeline(shader);
    if (!made) return made.error();
    *pipeline = std::move(made).value();
  }
  const gpu::BufferRequest buffers[] = {
      {&patch.levels_,
       {.name = "patched levels", .size_bytes = 4 * max_levels, .memory = gpu::Memory::upload}},
      {&patch.climbers_, {.name = "patch climbers", .size_bytes = 4 * shared::max_patched}}};
  if (auto made = device.create_buffers(buffers); !made) return made.error();
  return patch;
}

Result<void> TlasPatch::bind(gpu::Device& device, const gpu::Buffer& nodes, const gpu::Buffer& motion_boxes,
                             const gpu::Buffer& places, Bound& bound) const {
  const gpu::BufferRequest buffers[] = {
      {&bound.parents, {.name = "TLAS parents", .size_bytes = 4 * (std::size_t{nodes_} + instances_)}},
      {&bound.stamps, {.name = "TLAS stamps", .size_bytes = 4 * std::size_t{nodes_}}}};
  if (!bound.stamps) {
    if (auto made = device.create_buffers(buffers); !made) return made.error();
  }
  const gpu::Buffer* up[] = {&nodes, &bound.parents};
  const gpu::Buffer* patched[] = {&motion_boxes, &nodes,  &bound.parents, &bound.stamps,
                                  &climbers_,    &places, &levels_};
  auto parents_pass = device.create_bindings(parents_, up);
  if (!parents_pass) return parents_pass.error();
  bound.parents_pass = std::move(parents_pass).value();
  auto patch_pass = device.create_bindings(patch_, patched);
  if (!patch_pass) return patch_pass.error();
  bound.patch_pass = std::move(patch_pass).value();
  return {};
}

void TlasPatch::record_warm_up(const Bound& bound, gpu::Recorder& recorder) const {
  recorder.dispatch(parents_, bound.parents_pass, shared::PatchArgs{}, 1);
  recorder.dispatch(patch_, bound.patch_pass, shared::PatchArgs{}, 1);
}

void TlasPatch::find_parents(std::uint32_t first, std::uint32_t count, Bound& bound,
                             gpu::Recorder& recorder) const {
  recorder.fill(bound.stamps, 4 * std::size_t{first}, 4 * std::size_t{count}, 0);
  recorder.dispatch(parents_, bound.parents_pass,
                    shared::PatchArgs{.first = first,
                                      .count = count,
                                      .visible_count = 0,
                                      .levels = 0,
                                      .leaf_parents = nodes_,
                                      .stamp = 0,
                                      .node_boxes = instances_},
                    (count + 63) / 64);
  recorder.barrier();
  bound.stamp = 1;
}

void TlasPatch::record(std::uint32_t listed, std::uint32_t visible_count,
                       std::span<const std::uint32_t> levels, Bound& bound, gpu::Recorder& recorder) const {
  RTSTDB_ASSERT(listed <= shared::max_patched && levels.size() >= 2 && levels.size() <= max_levels,
                "more instances than max_patched, or a number of levels below 2 or above max_levels");
  std::ranges::copy(levels, levels_.host_as<std::uint32_t>().begin());
  if (bound.stamp == 0 || bound.stamp == std::numeric_limits<std::uint32_t>::max())
    find_parents(0, levels.back(), bound, recorder);
  const shared::PatchArgs args{.first = 0,
                               .count = listed,
                               .visible_count = visible_count,
                               .levels = static_cast<std::uint32_t>(levels.size()) - 1,
                               .leaf_parents = nodes_,
                               .stamp = ++bound.stamp,
                               .node_boxes = instances_};
  recorder.dispatch(patch_, bound.patch_pass, args, 1);
  recorder.barrier();
}

}  // namespace rtstdb::accel
