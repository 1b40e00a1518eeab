#include "rtstdb/accel/tlas_passes.hpp"

#include <algorithm>
#include <cstddef>
#include <tuple>
#include <utility>
#include <vector>

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

glm::uvec2 words_of(WorldTime time) noexcept {
  const auto bits = static_cast<std::uint64_t>(time.time_since_epoch().count());
  return {static_cast<std::uint32_t>(bits), static_cast<std::uint32_t>(bits >> 32)};
}

/// The part that single precision does not represent.
glm::vec3 low_part(const glm::dvec3& v) noexcept {
  return glm::vec3(v - glm::dvec3(glm::vec3(v)));
}

shared::EntityRecord record_of(const EntityState& state) noexcept {
  const Motion& motion = state.row.motion;
  return {.p_world_m = glm::vec3(motion.p_world_m),
          .mask = state.row.mask,
          .q_world = glm::vec4(motion.q_world.x, motion.q_world.y, motion.q_world.z, motion.q_world.w),
          .v_world_mps = glm::vec3(motion.v_world_mps),
          .geometry = state.row.geometry.index,
          .w_world_radps = glm::vec3(motion.w_world_radps),
          .index = state.id.index,
          .scale = glm::vec3(state.row.scale),
          .material = state.row.material.index,
          .valid_from = words_of(motion.valid_from),
          .p_low_m = low_part(motion.p_world_m),
          .v_low_mps = low_part(motion.v_world_mps),
          .w_low_radps = low_part(motion.w_world_radps),
          .unused = 0};
}

/// Rounded up, so that it is never shorter than the window.
float window_seconds(WorldTime begin, WorldTime end) noexcept {
  return static_cast<float>(seconds_between(begin, end) * (1.0 + 1e-6));
}

}  // namespace

Result<TlasPasses> TlasPasses::create(gpu::Device& device, std::uint32_t max_entities) {
  TlasPasses passes;
  passes.max_entities_ = max_entities;
  // The instances of the late epoch begin at an offset that satisfies any storage alignment of up to 256
  // bytes.
  passes.late_base_ = (max_entities + 15) / 16 * 16;
  const std::pair<gpu::Pipeline*, gpu::ShaderId> pipelines[] = {
      {&passes.apply_rows_, gpu::ShaderId::apply_rows},
      {&passes.instances_pass_, gpu::ShaderId::instances},
      {&passes.small_build_, gpu::ShaderId::tlas_small},
      {&passes.refit_, gpu::ShaderId::tlas_refit},
      {&passes.cost_, gpu::ShaderId::tlas_cost}};
  for (const auto& [pipeline, shader] : pipelines) {
    auto made = device.create_pipeline(shader);
    if (!made) return made.error();
    *pipeline = std::move(made).value();
  }
  auto scratch = BuildScratch::create(device);
  if (!scratch) return scratch.error();
  passes.small_scratch_ = std::move(scratch).value();
  if (max_entities >= min_made_ahead) {
    auto large = TlasBuilder::create(device, max_entities);
    if (!large) return large.error();
    passes.large_build_ = std::move(large).value();
  }
  auto patch = TlasPatch::create(device, max_entities, wide_node_bound(max_entities, instances_per_leaf));
  if (!patch) return patch.error();
  passes.patch_ = std::move(patch).value();
  const std::size_t n = max_entities;
  const gpu::BufferRequest buffers[] = {
      {&passes.changed_rows_,
       {.name = "changed rows",
        .size_bytes = sizeof(shared::EntityRecord) * n,
        .memory = gpu::Memory::upload}},
      {&passes.bounds_, {.name = "TLAS bounds", .size_bytes = 24 * n}},
      {&passes.listed_places_,
       {.name = "listed places",
        .size_bytes = 4 * std::max<std::size_t>(n / renewed_share, fewest_patched),
        .memory = gpu::Memory::upload}},
  };
  if (auto made = device.create_buffers(buffers); !made) return made.error();
  return passes;
}

Result<void> TlasPasses::create_slot(gpu::Device& device, TlasSlot& slot, const std::string& name) const {
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

Result<void> TlasPasses::bind(gpu::Device& device, const GeometryPool& pool, TlasSlot& slot) {
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
                                       {&listed_places_},
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
  if (auto bound = patch_.bind(device, slot.nodes, slot.motion_boxes, listed_places_, slot.patch); !bound)
    return bound.error();
  if (!large_build_) return {};
  auto large = large_build_->bind(device, bounds_, slot.motion_boxes, slot.nodes);
  if (!large) return large.error();
  slot.large_build = std::move(large).value();
  return {};
}

void TlasPasses::record_warm_up(const TlasSlot& slot, gpu::Recorder& recorder) const {
  recorder.dispatch(apply_rows_, slot.apply_rows, shared::ApplyRowsArgs{}, 1);
  recorder.dispatch(instances_pass_, slot.instances_pass, shared::InstanceArgs{}, 1);
  recorder.dispatch(small_build_, slot.small_build, shared::SmallBuildArgs{}, 1);
  recorder.dispatch(refit_, slot.refit, shared::RefitArgs{}, 1);
  recorder.dispatch(cost_, slot.cost, shared::RefitArgs{}, 1);
  patch_.record_warm_up(slot.patch, recorder);
  if (large_build_) large_build_->record_warm_up(slot.large_build, recorder);
}

std::uint32_t TlasPasses::upload(TlasSlot& slot, std::span<const std::uint32_t> entities,
                                 const store::RowSource& rows, gpu::Recorder& recorder) {
  const auto records = changed_rows_.host_as<shared::EntityRecord>().subspan(uploaded_);
  const auto identity_texels = slot.identity_texels.host_as<Identity>();
  std::uint32_t count = 0;
  bool in_a_row = true;  // the changed entities are consecutive
  bool list_changed = !slot.filled;
  for (const std::uint32_t entity : entities) {
    const EntityState* state = entity < rows.index_limit() ? rows.row(entity) : nullptr;
    const Presence presence = presence_of(state);
    if (state != nullptr) {
      in_a_row = in_a_row && entity == entities.front() + count;
      records[count++] = record_of(*state);
      slot.identities[entity] = {state->id, state->row.mask, state->row.material};
      identity_texels[entity] = slot.identities[entity];
    }
    list_changed = list_changed || presence != slot.presence[entity];
    slot.presence[entity] = presence;
  }
  if (list_changed) {
    slot.list_live(max_entities_);
    slot.tree = TlasSlot::Tree::none;
  }
  if (in_a_row && count != 0) {
    // All entities have typically changed then, and a copy is several times faster than the pass.
    constexpr std::size_t row_bytes = sizeof(shared::EntityRecord);
    recorder.copy(changed_rows_, uploaded_ * row_bytes, slot.rows, entities.front() * row_bytes,
                  count * row_bytes);
  } else {
    recorder.dispatch(apply_rows_, slot.apply_rows, shared::ApplyRowsArgs{.first = uploaded_, .count = count},
                      (count + 63) / 64);
  }
  uploaded_ += count;
  recorder.barrier();
  return count;
}

void TlasPasses::record_instances(const TlasSlot& slot, std::uint32_t first, std::uint32_t count, bool listed,
                                  gpu::Recorder& recorder) const {
  const WorldTime late_epoch = slot.epoch + epoch_length;
  const shared::InstanceArgs args{.epoch = words_of(slot.epoch),
                                  .late_epoch = words_of(late_epoch),
                                  .window_begin = words_of(slot.window_begin),
                                  .window_s = window_seconds(slot.window_begin, slot.window_end),
                                  .meets_late = slot.window_end >= late_epoch ? 1u : 0u,
                                  .first = first,
                                  .count = count,
                                  .visible_count = slot.visible_count,
                                  .listed = listed ? 1u : 0u};
  recorder.dispatch(instances_pass_, slot.instances_pass, args, (count + 63) / 64);
  recorder.barrier();
}

void TlasPasses::patch(TlasSlot& slot, std::uint32_t listed, gpu::Recorder& recorder) const {
  patch_.record(listed, slot.visible_count, slot.levels, slot.patch, recorder);
}

/// From the deepest level up.
void TlasPasses::refit(const TlasSlot& slot, gpu::Recorder& recorder) const {
  for (std::size_t level = slot.levels.size() - 1; level-- > 0;)
    refit_nodes(slot, slot.levels[level], slot.levels[level + 1] - slot.levels[level], recorder);
}

void TlasPasses::refit_nodes(const TlasSlot& slot, std::uint32_t first, std::uint32_t count,
                             gpu::Recorder& recorder) const {
  const shared::RefitArgs args{.first = first, .count = count, .still = 0, .node_boxes = max_entities_};
  recorder.dispatch(refit_, slot.refit, args, (count + 63) / 64);
  recorder.barrier();
}

bool TlasPasses::build(TlasSlot& slot, Submit& submit) {
  slot.built_cost = 0.0f;
  slot.patch.stamp = 0;
  if (!is_large(slot)) {
    const shared::SmallBuildArgs args{
        .count = slot.visible_count, .half_size = BuildScratch::half_size, .node_boxes = max_entities_};
    submit.recorder().dispatch(small_build_, slot.small_build, args, 1);
    submit.recorder().barrier();
    slot.tree = TlasSlot::Tree::unknown;
    return true;
  }
  const bool built = large_build_->run(slot.visible_count, slot.large_build, submit, slot.levels);
  if (!built) return false;
  slot.tree = TlasSlot::Tree::known;
  submit.begin();
  refit(slot, submit.recorder());
  return true;
}

void TlasPasses::find_cost(const TlasSlot& slot, gpu::Recorder& recorder) const {
  // A tree of n leaves has at least n / 8 nodes. A fixed number of nodes makes the costs of one world
  // comparable.
  const std::uint32_t nodes = 1 + slot.visible_count / shared::node_width;
  const shared::RefitArgs args{.first = 0,
                               .count = std::min(nodes, shared::max_cost_nodes),
                               .still = slot.window_begin == slot.window_end ? 1u : 0u,
                               .node_boxes = max_entities_};
  recorder.dispatch(cost_, slot.cost, args, 1);
  recorder.barrier();
}

}  // namespace rtstdb::accel
