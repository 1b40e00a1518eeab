#include "rtstdb/query/nearest_query.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>

#include <rtstdb/limits.hpp>

#include "rtstdb/query/element_check.hpp"
#include "rtstdb/query/enumerator.hpp"
#include "rtstdb/query/late_policy.hpp"
#include "shaders/shared/nearest.h"
#include "shaders/shared/query.h"

namespace rtstdb::query {
namespace {

static_assert(shared::list_size == max_neighbors);
// Neighbors are read where the device wrote them.
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

/// Workgroups that every device takes in one dispatch.
constexpr std::uint32_t max_groups = 65'535;

bool looks_at_triangles(NearestTarget target) noexcept {
  return target == NearestTarget::surface || target == NearestTarget::triangle;
}

Result<void> check_options(const NearestQueryOptions& options) {
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
  if (options.is_signed && !looks_at_triangles(options.target)) {
    return Error{ErrorCode::bad_input,
                 query + "a signed distance; only distances to surfaces and triangles have a sign"};
  }
  return check_enumerator(options.name, "late policy", options.late, LatePolicy::partial);
}

/// Which of the shaders of a target has the shortest list that holds k.
std::size_t list_of(const NearestQueryOptions& options) noexcept {
  return options.k == 1 ? 0 : options.k <= 8 ? 1 : 2;
}

gpu::ShaderId shader_of(const NearestQueryOptions& options) noexcept {
  using enum gpu::ShaderId;
  const std::size_t list = list_of(options);
  switch (options.target) {
    case NearestTarget::center:
      return std::array{nearest_center_1, nearest_center_8, nearest_center_32}[list];
    case NearestTarget::bounds:
      return std::array{nearest_bounds_1, nearest_bounds_8, nearest_bounds_32}[list];
    case NearestTarget::surface:
      // The one nearest surface is that of the one nearest triangle.
      return std::array{nearest_triangle_1, nearest_surface_8, nearest_surface_32}[list];
    case NearestTarget::triangle:
      break;
  }
  return std::array{nearest_triangle_1, nearest_triangle_8, nearest_triangle_32}[list];
}

std::uint32_t place_of(EntityId entity, const accel::Tlas& tlas, const accel::TlasView& view) noexcept {
  return entity.valid() ? tlas.place_of(view.slot, entity.index) : shared::no_entity;
}

}  // namespace

Result<std::unique_ptr<GpuNearestQuery>> GpuNearestQuery::create(gpu::Device& device,
                                                                 const NearestQueryOptions& options) {
  if (auto checked = check_options(options); !checked) return checked.error();
  auto query = std::make_unique<GpuNearestQuery>();
  query->options_ = options;
  query->set_late(options.late);
  const std::size_t neighbors = std::size_t{options.capacity} * options.k;
  query->places_ = AnswerPlaces(options.late);
  for (std::size_t place = 0; place < query->places_.count(); ++place)
    query->neighbor_memory_.emplace_back(neighbors * sizeof(Neighbor));
  query->answers_.resize(query->neighbor_memory_.size());
  if (auto made = query->move_to(device); !made) return made.error();
  // What the device can not hold has been refused by now.
  for (const gpu::HostMemory& place : query->neighbor_memory_)
    std::uninitialized_default_construct_n(place.as<Neighbor>().data(), neighbors);
  for (std::vector<NearestAnswer>& place : query->answers_)
    place.resize(options.capacity);
  query->points_.resize(options.capacity);
  query->incomplete_.reserve(options.capacity);
  query->order_ = PointOrder(options.capacity);
  return query;
}

Result<void> GpuNearestQuery::move_to(gpu::Device& device) {
  leave_device();
  processors_ = device.limits().processors;
  if (auto made = create_pipelines(device); !made) return made;
  return create_buffers(device);
}

void GpuNearestQuery::leave_device() noexcept {
  search_bindings_.clear();
  still_bindings_.clear();
  sign_bindings_.clear();
  search_ = {};
  still_ = {};
  sign_ = {};
  point_records_ = {};
  counts_ = {};
  neighbors_.clear();
}

Result<void> GpuNearestQuery::create_pipelines(gpu::Device& device) {
  auto search = device.create_pipeline(shader_of(options_));
  if (!search) return search.error();
  search_ = std::move(search).value();
  if (options_.target == NearestTarget::center) {
    using enum gpu::ShaderId;
    constexpr std::array shaders{nearest_center_still_1, nearest_center_still_8, nearest_center_still_32};
    auto still = device.create_pipeline(shaders[list_of(options_)]);
    if (!still) return still.error();
    still_ = std::move(still).value();
  }
  if (options_.is_signed) {
    auto sign = device.create_pipeline(gpu::ShaderId::nearest_sign);
    if (!sign) return sign.error();
    sign_ = std::move(sign).value();
  }
  return {};
}

Result<void> GpuNearestQuery::create_buffers(gpu::Device& device) {
  const std::size_t points = options_.capacity;
  neighbors_.resize(neighbor_memory_.size());
  std::vector<gpu::BufferRequest> buffers = {
      {&point_records_,
       {.name = options_.name + " points",
        .size_bytes = points * sizeof(shared::NearestRecord),
        .memory = gpu::Memory::upload}},
      {&counts_,
       {.name = options_.name + " counts",
        .size_bytes = points * sizeof(shared::NearestCount),
        .memory = gpu::Memory::readback}},
  };
  for (std::size_t place = 0; place < neighbors_.size(); ++place) {
    buffers.push_back({&neighbors_[place],
                       {.name = options_.name + " neighbors",
                        .size_bytes = neighbor_memory_[place].size_bytes(),
                        .memory = gpu::Memory::readback,
                        .addressed = true,
                        .host = &neighbor_memory_[place]}});
  }
  return device.create_buffers(buffers);
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

Result<void> GpuNearestQuery::bind(gpu::Device& device, const accel::GeometryPool& pool,
                                   const accel::Tlas& tlas) {
  search_bindings_.clear();
  still_bindings_.clear();
  sign_bindings_.clear();
  for (std::uint32_t slot = 0; slot < tlas.slots(); ++slot) {
    const gpu::Buffer* searched[] = {&tlas.nodes(slot), &tlas.instances(slot),       &point_records_,
                                     &counts_,          &tlas.identity_texels(slot), &pool.triangles(),
                                     &pool.nodes()};
    const std::span all(searched);
    auto search = device.create_bindings(search_, looks_at_triangles(options_.target) ? all : all.first(5));
    if (!search) return search.error();
    search_bindings_.push_back(std::move(search).value());
    if (still_) {
      searched[5] = &tlas.centers(slot);
      auto still = device.create_bindings(still_, all.first(6));
      if (!still) return still.error();
      still_bindings_.push_back(std::move(still).value());
    }
    if (!sign_) continue;
    const gpu::Buffer* const signs[] = {&pool.nodes(), &tlas.instances(slot), &point_records_,
                                        &counts_,      &pool.triangles(),     &tlas.places(slot)};
    auto sign = device.create_bindings(sign_, signs);
    if (!sign) return sign.error();
    sign_bindings_.push_back(std::move(sign).value());
  }
  return {};
}

void GpuNearestQuery::record_warm_up(gpu::Recorder& recorder) noexcept {
  shared::NearestArgs nothing{};
  nothing.k = 1;
  recorder.dispatch(search_, search_bindings_.front(), nothing, 1);
  if (still_) recorder.dispatch(still_, still_bindings_.front(), nothing, 1);
  if (sign_) recorder.dispatch(sign_, sign_bindings_.front(), nothing, 1);
}

void GpuNearestQuery::begin_batch(std::uint32_t count) noexcept {
  order_.of(std::span(points_).first(count));
  incomplete_.clear();
  settled_ = 0;
  answered_ = 0;
}

void GpuNearestQuery::pack(std::uint32_t at, std::uint32_t place, const accel::Tlas& tlas,
                           const accel::TlasView& view) noexcept {
  const Nearest& point = points_[order_.last()[place]];
  const accel::Moment moment = view.moment(point.t);
  point_records_.host_as<shared::NearestRecord>()[at] = {.point_m = point.point_m,
                                                         .radius_m = point.radius_m,
                                                         .t_ns = moment.t_ns,
                                                         .mask = point.mask,
                                                         .carrier = place_of(point.carrier, tlas, view),
                                                         .excluded = place_of(point.excluded, tlas, view),
                                                         .instance_base = moment.instance_base,
                                                         .share = moment.share,
                                                         .place = place};
}

void GpuNearestQuery::record(PlaceRange range, const RowSource& /*rows*/, const accel::Tlas& tlas,
                             const accel::TlasView& view, const HaltAt& halt,
                             gpu::Recorder& recorder) noexcept {
  for (std::uint32_t place = range.first; place < range.end; ++place) {
    call_ahead(std::span<const Nearest>(points_), order_.last(), place);
    pack(place, place, tlas, view);
  }
  dispatch(range, false, view, halt, recorder);
}

void GpuNearestQuery::dispatch(PlaceRange range, bool alone, const accel::TlasView& view, const HaltAt& halt,
                               gpu::Recorder& recorder) noexcept {
  const auto run = [&](const gpu::Pipeline& pipeline, const gpu::Bindings& bindings,
                       std::uint32_t places_per_point) {
    const std::uint32_t count = (range.end - range.first) * places_per_point;
    const DispatchLayout spread = alone ? one_a_group(count) : spread_out(count, processors_);
    const shared::NearestArgs whole{.root = view.root,
                                    .first = range.first * places_per_point,
                                    .end = range.end * places_per_point,
                                    .per_group = spread.per_group,
                                    .k = options_.k,
                                    .neighbors = neighbors_[places_.written()].address(),
                                    .halt = halt.words,
                                    .halt_from = halt.from,
                                    .loop_probe = 2};
    in_pieces(spread, max_groups, whole, [&](const shared::NearestArgs& args, std::uint32_t groups) {
      recorder.dispatch(pipeline, bindings, args, groups);
    });
  };
  const bool still = still_ && view.window_begin == view.window_end;
  if (still)
    run(still_, still_bindings_[view.slot], 1);
  else
    run(search_, search_bindings_[view.slot], 1);
  if (!sign_) return;
  recorder.barrier();
  run(sign_, sign_bindings_[view.slot], options_.k);
}

void GpuNearestQuery::unpack(PlaceRange range, const accel::TlasView& /*view*/) noexcept {
  answered_ = range.end;
  const std::size_t bytes_per_point = options_.k * sizeof(Neighbor);
  neighbors_[places_.written()].invalidate(range.first * bytes_per_point,
                                           (range.end - range.first) * bytes_per_point);
  for (std::uint32_t place = range.first; place < range.end; ++place) {
    call_ahead(std::span(answers_[places_.written()]), order_.last(), place);
    if (!take_answer(place)) incomplete_.push_back(place);
  }
}

void GpuNearestQuery::record_again(PlaceRange range, const RowSource& /*rows*/, const accel::Tlas& tlas,
                                   const accel::TlasView& view, const HaltAt& halt,
                                   gpu::Recorder& recorder) noexcept {
  for (std::uint32_t i = range.first; i < range.end; ++i)
    pack(i, incomplete_[i], tlas, view);
  dispatch(range, true, view, halt, recorder);
}

void GpuNearestQuery::unpack_again(PlaceRange range, const accel::TlasView& /*view*/) noexcept {
  const std::size_t bytes_per_point = options_.k * sizeof(Neighbor);
  for (std::uint32_t i = range.first; i < range.end; ++i) {
    neighbors_[places_.written()].invalidate(incomplete_[i] * bytes_per_point, bytes_per_point);
    take_answer(incomplete_[i]);
  }
  settled_ = range.end;
}

std::uint32_t GpuNearestQuery::incomplete(std::uint32_t answered) const noexcept {
  return static_cast<std::uint32_t>(std::ranges::count_if(incomplete_, [&](std::uint32_t place) {
    return place < answered && answers_[places_.written()][order_.last()[place]].incomplete;
  }));
}

void GpuNearestQuery::publish_answers(std::uint32_t answered, std::uint32_t count) noexcept {
  for (std::uint32_t place = answered; place < count; ++place)
    answers_[places_.written()][order_.last()[place]] = {.neighbors = {}, .incomplete = true};
  places_.publish_answers(count);
}

bool GpuNearestQuery::take_answer(std::uint32_t place) noexcept {
  const shared::NearestCount count = counts_.host_as<const shared::NearestCount>()[place];
  const bool incomplete = count.incomplete != 0;
  const auto neighbors = neighbors_at(place).first(incomplete ? 0 : count.found);
  answers_[places_.written()][order_.last()[place]] = {.neighbors = neighbors, .incomplete = incomplete};
  return !incomplete;
}

}  // namespace rtstdb::query
