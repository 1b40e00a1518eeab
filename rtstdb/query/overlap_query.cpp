#include "rtstdb/query/overlap_query.hpp"

#include <numeric>

#include "rtstdb/query/element_check.hpp"

namespace rtstdb::query {

Result<std::unique_ptr<GpuOverlapQuery>> GpuOverlapQuery::create(gpu::Device& device,
                                                                 const OverlapQueryOptions& options) {
  auto runner = RegionRunner::create(device, {.name = options.name,
                                              .capacity = options.capacity,
                                              .ids_per_region = options.ids_per_entity,
                                              .late = options.late});
  if (!runner) return runner.error();
  auto query = std::make_unique<GpuOverlapQuery>();
  query->runner_ = std::move(runner).value();
  query->set_late(options.late);
  query->overlaps_.resize(options.capacity);
  query->order_.resize(options.capacity);
  std::iota(query->order_.begin(), query->order_.end(), 0u);
  return query;
}

std::optional<BadInput> GpuOverlapQuery::check(std::uint32_t count, const RowSource& rows,
                                               TimeSpan& times) const noexcept {
  for (std::uint32_t i = 0; i < count; ++i) {
    const EntityState* state = rows.find(overlaps_[i].entity);
    if (state == nullptr || !state->row.geometry.valid()) {
      return BadInput{
          .reason = state == nullptr ? BadInputReason::unknown_entity : BadInputReason::no_geometry,
          .element = i,
          .entity = overlaps_[i].entity};
    }
    if (const auto bad = check_time(overlaps_[i].t, i, rows, times)) return bad;
  }
  return std::nullopt;
}

Result<void> GpuOverlapQuery::bind(gpu::Device& device, const accel::GeometryPool& pool,
                                   const accel::Tlas& tlas) {
  pool_ = &pool;
  return runner_.bind(device, pool, tlas);
}

void GpuOverlapQuery::begin_batch(std::uint32_t count) noexcept {
  runner_.begin_batch(std::span(order_).first(count), {count, count, count});
}

shared::RegionRecord GpuOverlapQuery::packed(const Overlap& overlap, const RowSource& rows,
                                             const accel::Tlas& tlas,
                                             const accel::TlasView& view) const noexcept {
  const accel::Moment moment = view.moment(overlap.t);
  const EntityRow& row = rows.find(overlap.entity)->row;
  const Bounds bounds = pool_->bounds(row.geometry.index);
  const glm::vec3 scale(row.scale);
  return {.center_m = 0.5f * (bounds.minimum_m + bounds.maximum_m) * scale,
          .flags = 0,
          .half_extent_m = 0.5f * (bounds.maximum_m - bounds.minimum_m) * scale,
          .mask = overlap.mask,
          .q = glm::vec4(0.0f, 0.0f, 0.0f, 1.0f),
          .t_ns = moment.t_ns,
          .carrier = tlas.place_of(view.slot, overlap.entity.index),
          .excluded = overlap.entity.index,
          .instance_base = moment.instance_base,
          .share = moment.share,
          .near_m = 0.0f};
}

void GpuOverlapQuery::record(PlaceRange range, const RowSource& rows, const accel::Tlas& tlas,
                             const accel::TlasView& view, const HaltAt& halt,
                             gpu::Recorder& recorder) noexcept {
  const auto records = runner_.records();
  for (std::uint32_t i = range.first; i < range.end; ++i)
    records[i] = packed(overlaps_[i], rows, tlas, view);
  runner_.record(range, view, halt, recorder);
}

void GpuOverlapQuery::record_again(PlaceRange range, const RowSource& rows, const accel::Tlas& tlas,
                                   const accel::TlasView& view, const HaltAt& halt,
                                   gpu::Recorder& recorder) noexcept {
  const auto records = runner_.records();
  for (std::uint32_t i = range.first; i < range.end; ++i)
    records[i] = packed(overlaps_[runner_.incomplete()[i]], rows, tlas, view);
  runner_.record_again(range, view, halt, recorder);
}

}  // namespace rtstdb::query
