// Creation of the slots and passes, and their bindings.

#include <algorithm>
#include <cstddef>
#include <string>
#include <tuple>

#include "rtstdb/accel/tlas.hpp"
#include "shaders/shared/node.h"
#include "shaders/shared/query.h"

namespace rtstdb::accel {
namespace {

constexpr std::uint32_t instances_per_leaf = 1;
constexpr std::size_t instance_bytes = 16 * shared::instance_texels;
static_assert(instance_bytes * 16 % 256 == 0);
static_assert(sizeof(shared::EntityRecord) == 16 * shared::row_texels);
// Shaders read it as one texel.
static_assert(sizeof(Identity) == 16 && offsetof(Identity, mask) == 8 && offsetof(Identity, material) == 12);

}  // namespace

Result<Tlas> Tlas::create(gpu::Device& device, const TlasOptions& options) {
  Tlas tlas;
  tlas.max_entities_ = options.max_entities;
  // The instances of the late epoch begin at an offset that satisfies any storage alignment of up to 256
  // bytes.
  tlas.late_base_ = (options.max_entities + 15) / 16 * 16;
  tlas.refits_ = options.refits;
  tlas.patches_ = options.refits && options.patches;
  tlas.makes_ahead_ = tlas.patches_ && options.slots > 1;
  tlas.changed_.reserve(options.max_entities);
  const std::pair<gpu::Pipeline*, gpu::ShaderId> pipelines[] = {
      {&tlas.apply_rows_, gpu::ShaderId::apply_rows},
      {&tlas.instances_pass_, gpu::ShaderId::instances},
      {&tlas.small_build_, gpu::ShaderId::tlas_small},
      {&tlas.refit_, gpu::ShaderId::tlas_refit},
      {&tlas.cost_, gpu::ShaderId::tlas_cost}};
  for (const auto& [pipeline, shader] : pipelines) {
    auto made = device.create_pipeline(shader);
    if (!made) return made.error();
    *pipeline = std::move(made).value();
  }
  auto scratch = BuildScratch::create(device);
  if (!scratch) return scratch.error();
  tlas.small_scratch_ = std::move(scratch).value();
  if (options.max_entities >= min_made_ahead) {
    auto large = TlasBuilder::create(device, options.max_entities);
    if (!large) return large.error();
    tlas.large_build_ = std::move(large).value();
  }
  auto patch = TlasPatch::create(device, options.max_entities,
                                 wide_node_bound(options.max_entities, instances_per_leaf));
  if (!patch) return patch.error();
  tlas.patch_ = std::move(patch).value();
  const std::size_t n = options.max_entities;
  const gpu::BufferRequest buffers[] = {
      {&tlas.changed_rows_,
       {.name = "changed rows",
        .size_bytes = sizeof(shared::EntityRecord) * n,
        .memory = gpu::Memory::upload}},
      {&tlas.bounds_, {.name = "TLAS bounds", .size_bytes = 24 * n}},
      {&tlas.renewed_places_,
       {.name = "renewed places",
        .size_bytes = 4 * std::max<std::size_t>(n / renewed_share, fewest_patched),
        .memory = gpu::Memory::upload}},
  };
  if (auto made = device.create_buffers(buffers); !made) return made.error();
  tlas.slots_.resize(options.slots);
  for (std::uint32_t i = 0; i < options.slots; ++i) {
    if (auto made = tlas.create_slot(device, tlas.slots_[i], "slot " + std::to_string(i)); !made)
      return made.error();
  }
  return tlas;
}

Result<void> Tlas::create_slot(gpu::Device& device, Slot& slot, const std::string& name) {
  const std::size_t n = max_entities_;
  slot.presence.assign(n, Presence::absent);
  slot.place.assign(n, shared::no_entity);
  slot.identities.resize(n);
  slot.levels.reserve(2 * shared::max_tlas_levels);  // rotations make large trees deeper
  gpu::BufferOptions rows{.name = name + " rows", .size_bytes = sizeof(shared::EntityRecord) * n};
  rows.texel_uint4 = true;
  gpu::BufferOptions instances{.name = name + " instances", .size_bytes = 2 * instance_bytes * late_base_};
  instances.texel_float4 = true;
  instances.texel_uint4 = true;
  instances.texel_image = true;
  gpu::BufferOptions centers{.name = name + " centers", .size_bytes = 16 * shared::still_center_texels * n};
  centers.texel_float4 = true;
  gpu::BufferOptions still_bounds{.name = name + " still bounds",
                                  .size_bytes = 16 * shared::still_bounds_texels * n};
  still_bounds.texel_float4 = true;
  gpu::BufferOptions identities{
      .name = name + " identities", .size_bytes = sizeof(Identity) * n, .memory = gpu::Memory::upload};
  identities.texel_uint4 = true;
  const std::size_t nodes_count = wide_node_bound(max_entities_, instances_per_leaf);
  gpu::BufferOptions nodes{.name = name + " nodes",
                           .size_bytes = 16 * shared::tlas_node_texels * nodes_count};
  nodes.texel_uint4 = true;
  nodes.texel_image = true;
  gpu::BufferOptions motion_boxes{.name = name + " motion boxes",
                                  .size_bytes = 16 * shared::motion_box_texels * (n + nodes_count)};
  motion_boxes.texel_uint4 = true;
  const gpu::BufferRequest buffers[] = {
      {&slot.rows, rows},
      {&slot.instances, instances},
      {&slot.centers, centers},
      {&slot.still_bounds, still_bounds},
      {&slot.live, {.name = name + " live", .size_bytes = 4 * n, .memory = gpu::Memory::upload}},
      {&slot.identity_texels, identities},
      {&slot.places, {.name = name + " places", .size_bytes = 4 * n, .memory = gpu::Memory::upload}},
      {&slot.nodes, nodes},
      {&slot.levels_readback,
       {.name = name + " levels",
        .size_bytes = 4 * (shared::max_tlas_levels + 2),
        .memory = gpu::Memory::readback}},
      {&slot.cost_readback, {.name = name + " cost", .size_bytes = 16, .memory = gpu::Memory::readback}},
      {&slot.motion_boxes, motion_boxes},
  };
  return device.create_buffers(buffers);
}

Result<void> Tlas::bind(gpu::Device& device, const GeometryPool& pool) {
  for (Slot& slot : slots_) {
    const auto common = small_scratch_.bindings(bounds_, slot.nodes);
    const gpu::Buffer* rows[] = {&changed_rows_, &slot.rows};
    const std::size_t half_bytes = instance_bytes * late_base_;
    const gpu::BufferPart instances[] = {{&slot.rows},
                                         {&pool.geometries()},
                                         {&slot.live},
                                         {&slot.instances, 0, half_bytes},
                                         {&slot.instances, half_bytes, half_bytes},
                                         {&bounds_},
                                         {&slot.motion_boxes},
                                         {&slot.centers},
                                         {&renewed_places_},
                                         {&slot.still_bounds}};
    auto instances_bindings = device.create_bindings(instances_pass_, instances);
    if (!instances_bindings) return instances_bindings.error();
    slot.instances_pass = std::move(instances_bindings).value();
    std::vector<const gpu::Buffer*> small(common.begin(), common.end());
    small.insert(small.end(), {&slot.motion_boxes, &slot.levels_readback});
    const gpu::Buffer* refit[] = {&slot.motion_boxes, &slot.motion_boxes, &slot.nodes, &slot.nodes};
    const gpu::Buffer* cost[] = {&slot.motion_boxes, &slot.cost_readback};
    const std::tuple<gpu::Bindings*, gpu::Pipeline*, std::span<const gpu::Buffer* const>> wanted[] = {
        {&slot.apply_rows, &apply_rows_, rows},
        {&slot.small_build, &small_build_, small},
        {&slot.refit, &refit_, refit},
        {&slot.cost, &cost_, cost}};
    for (const auto& [bindings, pipeline, buffers] : wanted) {
      auto made = device.create_bindings(*pipeline, buffers);
      if (!made) return made.error();
      *bindings = std::move(made).value();
    }
    if (auto bound = patch_.bind(device, slot.nodes, slot.motion_boxes, renewed_places_, slot.patch); !bound)
      return bound.error();
    if (!large_build_) continue;
    auto large = large_build_->bind(device, bounds_, slot.motion_boxes, slot.nodes);
    if (!large) return large.error();
    slot.large_build = std::move(large).value();
  }
  return {};
}

void Tlas::record_warm_up(gpu::Recorder& recorder) {
  const Slot& slot = slots_.front();
  recorder.dispatch(apply_rows_, slot.apply_rows, shared::ApplyRowsArgs{}, 1);
  recorder.dispatch(instances_pass_, slot.instances_pass, shared::InstanceArgs{}, 1);
  recorder.dispatch(small_build_, slot.small_build, shared::SmallBuildArgs{}, 1);
  recorder.dispatch(refit_, slot.refit, shared::RefitArgs{}, 1);
  recorder.dispatch(cost_, slot.cost, shared::RefitArgs{}, 1);
  patch_.record_warm_up(slot.patch, recorder);
  if (large_build_) large_build_->record_warm_up(slot.large_build, recorder);
}

}  // namespace rtstdb::accel
