#include "rtstdb/query/overlap/overlap_query.hpp"

#include <memory>

#include "rtstdb/query/element_check.hpp"
#include "rtstdb/query/make_query.hpp"

namespace rtstdb::query {

Result<std::unique_ptr<GpuQuery>> make_query(gpu::Device& device, const OverlapQueryOptions& options) {
  const RegionSearchOptions search{.name = options.name,
                                   .capacity = options.capacity,
                                   .ids_per_region = options.ids_per_entity,
                                   .late = options.late};
  if (auto checked = check_region_search_options(search); !checked) return checked.error();
  auto query = std::make_unique<GpuOverlapQuery>(search);
  RegionSearch& region_search = *query;
  auto moved = on_device(std::move(query), device);
  if (moved) region_search.allocate_host_memory();
  return moved;
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

void GpuOverlapQuery::pack(std::span<const std::uint32_t> elements, std::span<shared::RegionRecord> records,
                           const Recording& recording) const noexcept {
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const Overlap& overlap = overlaps_[elements[i]];
    const accel::Moment moment = recording.view.moment(overlap.t);
    const EntityRow& row = recording.rows.find(overlap.entity)->row;
    const Bounds bounds = recording.pool.bounds(row.geometry.index);
    const glm::vec3 scale(row.scale);
    records[i] = {.center_m = 0.5f * (bounds.minimum_m + bounds.maximum_m) * scale,
                  .flags = 0,
                  .half_extent_m = 0.5f * (bounds.maximum_m - bounds.minimum_m) * scale,
                  .mask = overlap.mask,
                  .q = glm::vec4(0.0f, 0.0f, 0.0f, 1.0f),
                  .t_ns = moment.t_ns,
                  .carrier = recording.tlas.place_of(recording.view.slot, overlap.entity.index),
                  .excluded = overlap.entity.index,
                  .instance_base = moment.instance_base,
                  .share = moment.share,
                  .near_m = 0.0f};
  }
}

}  // namespace rtstdb::query
