#include "rtstdb/query/nearest/nearest_query.hpp"

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include <rtstdb/limits.hpp>

#include "rtstdb/query/element_check.hpp"
#include "rtstdb/query/enumerator.hpp"
#include "rtstdb/query/make_query.hpp"
#include "shaders/shared/nearest.h"
#include "shaders/shared/query.h"

namespace rtstdb::query {
namespace {

static_assert(shared::list_size == max_neighbors);
// The caller reads neighbors where the device wrote them.
static_assert(sizeof(Neighbor) == sizeof(shared::NeighborRecord) && sizeof(bool) == 1 &&
              offsetof(Neighbor, mask) == offsetof(shared::NeighborRecord, mask) &&
              offsetof(Neighbor, material) == offsetof(shared::NeighborRecord, material) &&
              offsetof(Neighbor, triangle) == offsetof(shared::NeighborRecord, triangle) &&
              offsetof(Neighbor, distance_m) == offsetof(shared::NeighborRecord, distance_m) &&
              offsetof(Neighbor, u) == offsetof(shared::NeighborRecord, u) &&
              offsetof(Neighbor, v) == offsetof(shared::NeighborRecord, v) &&
              offsetof(Neighbor, has_sign) == offsetof(shared::NeighborRecord, has_sign) &&
              offsetof(Neighbor, p_world_m) == offsetof(shared::NeighborRecord, p_world_m) &&
              offsetof(Neighbor, v_relative_mps) == offsetof(shared::NeighborRecord, v_relative_mps));

bool searches_triangles(NearestTarget target) noexcept {
  return target == NearestTarget::surface || target == NearestTarget::triangle;
}

Result<void> check_nearest_options(const NearestQueryOptions& options) {
  if (auto known = check_enumerator(options.name, "target", options.target, NearestTarget::triangle); !known)
    return known;
  const std::string query = "query '" + options.name + "' asks for ";
  if (options.capacity == 0 || options.capacity > max_points_per_query || options.k == 0 ||
      options.k > max_neighbors) {
    return Error{ErrorCode::capacity, query + std::to_string(options.k) + " neighbors of " +
                                          std::to_string(options.capacity) + " points; 1 to " +
                                          std::to_string(max_neighbors) + " neighbors of 1 to " +
                                          std::to_string(max_points_per_query) + " points are possible"};
  }
  if (options.is_signed && !searches_triangles(options.target)) {
    return Error{ErrorCode::bad_input,
                 query + "a signed distance; only distances to surfaces and triangles have a sign"};
  }
  return {};
}

/// Which variant of a kernel has the shortest list that holds k neighbors.
std::size_t list_variant(const NearestQueryOptions& options) noexcept {
  return options.k == 1 ? 0 : options.k <= 8 ? 1 : 2;
}

gpu::ShaderId search_shader(const NearestQueryOptions& options) noexcept {
  using enum gpu::ShaderId;
  const std::size_t variant = list_variant(options);
  switch (options.target) {
    case NearestTarget::center:
      return std::array{nearest_center_1, nearest_center_8, nearest_center_32}[variant];
    case NearestTarget::bounds:
      return std::array{nearest_bounds_1, nearest_bounds_8, nearest_bounds_32}[variant];
    case NearestTarget::surface:
      // The one nearest surface is that of the one nearest triangle.
      return std::array{nearest_triangle_1, nearest_surface_8, nearest_surface_32}[variant];
    case NearestTarget::triangle:
      break;
  }
  return std::array{nearest_triangle_1, nearest_triangle_8, nearest_triangle_32}[variant];
}

/// Of batches whose points all have one instant.
std::optional<gpu::ShaderId> still_shader(const NearestQueryOptions& options) noexcept {
  using enum gpu::ShaderId;
  if (options.target != NearestTarget::center) return std::nullopt;
  return std::array{nearest_center_still_1, nearest_center_still_8,
                    nearest_center_still_32}[list_variant(options)];
}

std::uint32_t instance_of(EntityId entity, const Recording& recording) noexcept {
  return entity.valid() ? recording.tlas.place_of(recording.view.slot, entity.index) : shared::no_entity;
}

}  // namespace

Result<std::unique_ptr<GpuQuery>> make_query(gpu::Device& device, const NearestQueryOptions& options) {
  if (auto checked = check_nearest_options(options); !checked) return checked.error();
  auto query = std::make_unique<GpuNearestQuery>(options);
  GpuNearestQuery& nearest_query = *query;
  auto moved = on_device(std::move(query), device);
  if (moved) nearest_query.allocate_host_memory();
  return moved;
}

GpuNearestQuery::GpuNearestQuery(const NearestQueryOptions& options)
    : GpuQuery(options.capacity, options.late), options_(options) {
  for (std::size_t slot = 0; slot < slots().count(); ++slot)
    neighbor_memory_.emplace_back(std::size_t{options.capacity} * options.k * sizeof(Neighbor));
  answers_.resize(slots().count());
  neighbors_.resize(slots().count());
}

void GpuNearestQuery::allocate_host_memory() {
  for (const gpu::HostMemory& memory : neighbor_memory_)
    std::uninitialized_default_construct_n(memory.as<Neighbor>().data(), memory.as<Neighbor>().size());
  for (std::vector<NearestAnswer>& answers : answers_)
    answers.resize(options_.capacity);
  points_.resize(options_.capacity);
  order_ = PointOrder(options_.capacity);
}

DeviceNeeds GpuNearestQuery::device_needs(const gpu::DeviceLimits& /*limits*/) {
  // No place is searched; the number of neighbors is divided by.
  shared::NearestArgs idle{};
  idle.k = 1;
  DeviceNeeds needs;
  needs.kernels.push_back(kernel_need(search_shader(options_), idle));
  if (const auto still = still_shader(options_)) needs.kernels.push_back(kernel_need(*still, idle));
  if (options_.is_signed) needs.kernels.push_back(kernel_need(gpu::ShaderId::nearest_sign, idle));
  const std::size_t points = options_.capacity;
  needs.buffers = {
      {&records_,
       {.name = options_.name + " points",
        .size_bytes = points * sizeof(shared::NearestRecord),
        .memory = gpu::Memory::upload}},
      {&counts_,
       {.name = options_.name + " counts",
        .size_bytes = points * sizeof(shared::NearestCount),
        .memory = gpu::Memory::readback}},
  };
  for (std::size_t slot = 0; slot < neighbors_.size(); ++slot) {
    needs.buffers.push_back({&neighbors_[slot],
                             {.name = options_.name + " neighbors",
                              .size_bytes = neighbor_memory_[slot].size_bytes(),
                              .memory = gpu::Memory::readback,
                              .addressed = true,
                              .host = &neighbor_memory_[slot]}});
  }
  return needs;
}

std::vector<const gpu::Buffer*> GpuNearestQuery::bound_buffers(gpu::ShaderId shader, std::uint32_t slot,
                                                               const accel::GeometryPool& pool,
                                                               const accel::Tlas& tlas) const {
  if (shader == gpu::ShaderId::nearest_sign)
    return {&pool.nodes(), &tlas.instances(slot), &records_, &counts_, &pool.triangles(), &tlas.places(slot)};
  std::vector<const gpu::Buffer*> buffers{&tlas.nodes(slot), &tlas.instances(slot), &records_, &counts_,
                                          &tlas.identity_texels(slot)};
  if (searches_triangles(options_.target))
    buffers.insert(buffers.end(), {&pool.triangles(), &pool.nodes()});
  else
    buffers.push_back(&tlas.centers(slot));
  return buffers;
}

std::optional<BadInput> GpuNearestQuery::check(std::uint32_t count, const RowSource& rows,
                                               TimeSpan& times) const noexcept {
  for (std::uint32_t i = 0; i < count; ++i) {
    const Nearest& point = points_[i];
    if (const auto bad = check_point(point.point_m, i, {"point_m.x", "point_m.y", "point_m.z"})) return bad;
    if (!(point.radius_m >= 0.0f))
      return with_field(refused(BadInputReason::bad_nearest, i, {point.radius_m, 0.0f, 0.0f, 0.0f}),
                        "radius_m", static_cast<double>(point.radius_m), {.lowest = 0.0});
    if (const auto bad = check_time(point.t, i, rows, times)) return bad;
    if (const auto bad = check_carrier(point.carrier, i, rows)) return bad;
    if (const auto bad = check_carrier(point.excluded, i, rows)) return bad;
  }
  return std::nullopt;
}

void GpuNearestQuery::order_batch(std::uint32_t count) noexcept {
  order_.of(std::span(points_).first(count));
}

void GpuNearestQuery::pack(std::uint32_t record, std::uint32_t place, const Recording& recording) noexcept {
  const Nearest& point = points_[order_.last()[place]];
  const accel::Moment moment = recording.view.moment(point.t);
  records_.host_as<shared::NearestRecord>()[record] = {.point_m = point.point_m,
                                                       .radius_m = point.radius_m,
                                                       .t_ns = moment.t_ns,
                                                       .mask = point.mask,
                                                       .carrier = instance_of(point.carrier, recording),
                                                       .excluded = instance_of(point.excluded, recording),
                                                       .instance_base = moment.instance_base,
                                                       .share = moment.share,
                                                       .place = place};
}

void GpuNearestQuery::record(const BatchPart& part, const Recording& recording) noexcept {
  for (std::uint32_t i = part.range.first; i < part.range.end; ++i) {
    if (!part.is_retry) prefetch_ahead(std::span<const Nearest>(points_), order_.last(), i);
    pack(i, place_at(part, i), recording);
  }
  const bool one_instant = recording.view.window_begin == recording.view.window_end;
  dispatch_part(kernel(still_shader(options_) && one_instant ? 1 : 0), part, 1, recording);
  if (!options_.is_signed) return;
  recording.recorder.barrier();
  dispatch_part(kernel(kernel_count() - 1), part, options_.k, recording);
}

void GpuNearestQuery::dispatch_part(const Kernel& kernel, const BatchPart& part, std::uint32_t per_place,
                                    const Recording& recording) const noexcept {
  const std::uint32_t invocations = (part.range.end - part.range.first) * per_place;
  const DispatchLayout layout =
      part.is_retry ? one_a_group(invocations) : spread_out(invocations, limits().processors);
  const shared::NearestArgs args{.root = recording.view.root,
                                 .first = part.range.first * per_place,
                                 .end = part.range.end * per_place,
                                 .per_group = layout.per_group,
                                 .k = options_.k,
                                 .neighbors = neighbors_[slots().written()].address(),
                                 .halt = recording.halt.words,
                                 .halt_from = recording.halt.from,
                                 .loop_probe = 2 /* two rounds, see loops_still_turn */};
  dispatch(kernel, recording, layout, args);
}

void GpuNearestQuery::unpack(const BatchPart& part, const accel::TlasView& /*view*/) noexcept {
  if (part.is_retry) {
    for (std::uint32_t i = part.range.first; i < part.range.end; ++i) {
      const std::uint32_t place = place_at(part, i);
      pull(place, place + 1);
      unpack_answer(place);
    }
    return;
  }
  pull(part.range.first, part.range.end);
  for (std::uint32_t place = part.range.first; place < part.range.end; ++place) {
    prefetch_ahead(std::span(answers_[slots().written()]), order_.last(), place);
    if (!unpack_answer(place)) note_incomplete(place);
  }
}

void GpuNearestQuery::pull(std::uint32_t first_place, std::uint32_t end_place) const noexcept {
  const std::size_t bytes_per_point = options_.k * sizeof(Neighbor);
  neighbors_[slots().written()].invalidate(first_place * bytes_per_point,
                                           (end_place - first_place) * bytes_per_point);
}

bool GpuNearestQuery::unpack_answer(std::uint32_t place) noexcept {
  const shared::NearestCount count = counts_.host_as<const shared::NearestCount>()[place];
  const bool incomplete = count.incomplete != 0;
  const auto all = neighbor_memory_[slots().written()].as<const Neighbor>();
  written_answer(place) = {
      .neighbors = all.subspan(std::size_t{place} * options_.k, incomplete ? 0 : count.found),
      .incomplete = incomplete};
  return !incomplete;
}

}  // namespace rtstdb::query
