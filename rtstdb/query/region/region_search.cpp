#include "rtstdb/query/region/region_search.hpp"

#include <algorithm>
#include <numeric>

#include <rtstdb/limits.hpp>

#include "rtstdb/query/enumerator.hpp"

namespace rtstdb::query {
namespace {

using enum gpu::ShaderId;

struct GroupShaders {
  std::optional<gpu::ShaderId> one_instant, moving, lowest;
};

using RegionShaders = std::array<GroupShaders, shape_groups>;

RegionShaders listing_shaders(RegionLevel level) noexcept {
  switch (level) {
    case RegionLevel::surface:
      return {{{{}, box_surfaces, box_surfaces_lowest},
               {{}, sphere_surfaces, sphere_surfaces_lowest},
               {{}, frustum_surfaces, frustum_surfaces_lowest}}};
    case RegionLevel::triangle:
      return {{{{}, box_triangles, box_triangles_lowest},
               {{}, sphere_triangles, sphere_triangles_lowest},
               {{}, frustum_triangles, frustum_triangles_lowest}}};
    case RegionLevel::bounds:
      break;
  }
  return {{{region, region_moving, region_lowest}, {}, {{}, frustum, frustum_lowest}}};
}

RegionShaders counting_shaders(RegionLevel level) noexcept {
  switch (level) {
    case RegionLevel::surface:
      return {
          {{{}, box_surfaces_count, {}}, {{}, sphere_surfaces_count, {}}, {{}, frustum_surfaces_count, {}}}};
    case RegionLevel::triangle:
      return {{{{}, box_triangles_count, {}},
               {{}, sphere_triangles_count, {}},
               {{}, frustum_triangles_count, {}}}};
    case RegionLevel::bounds:
      break;
  }
  return {{{region_count, region_count_moving, {}}, {}, {{}, frustum_count, {}}}};
}

}  // namespace

Result<void> check_region_search_options(const RegionSearchOptions& options) {
  if (options.capacity == 0 || options.capacity > max_regions_per_query ||
      options.ids_per_region > max_ids_per_region) {
    return Error{ErrorCode::capacity, "query '" + options.name + "' asks for " +
                                          std::to_string(options.capacity) + " regions of " +
                                          std::to_string(options.ids_per_region) + " ids; 1 to " +
                                          std::to_string(max_regions_per_query) + " regions of 0 to " +
                                          std::to_string(max_ids_per_region) + " are possible"};
  }
  return check_enumerator(options.name, "level", options.level, RegionLevel::triangle);
}

RegionSearch::RegionSearch(const RegionSearchOptions& options)
    : GpuQuery(options.capacity, options.late), options_(options) {
  answers_.resize(slots().count());
}

DeviceNeeds RegionSearch::device_needs(const gpu::DeviceLimits& /*limits*/) {
  DeviceNeeds needs;
  const auto add = [&](const std::optional<gpu::ShaderId>& shader) -> std::optional<std::size_t> {
    if (!shader) return std::nullopt;
    needs.kernels.push_back(kernel_need(*shader, shared::RegionArgs{}));
    return needs.kernels.size() - 1;
  };
  const RegionShaders shaders =
      options_.ids_per_region > 0 ? listing_shaders(options_.level) : counting_shaders(options_.level);
  for (std::size_t group = 0; group < shape_groups; ++group) {
    if (group == shape_group(options_.level, RegionShape::frustum) && !options_.frusta) continue;
    kernels_[group] = {.one_instant = add(shaders[group].one_instant),
                       .moving = add(shaders[group].moving),
                       .lowest = add(shaders[group].lowest)};
  }
  const std::size_t capacity = options_.capacity;
  needs.buffers = {
      {&records_,
       {.name = options_.name + " regions",
        .size_bytes = capacity * sizeof(shared::RegionRecord),
        .memory = gpu::Memory::upload}},
      {&counts_,
       {.name = options_.name + " counts",
        .size_bytes = capacity * sizeof(shared::RegionCount),
        .memory = gpu::Memory::readback}},
  };
  if (options_.ids_per_region > 0) {
    const std::size_t bytes_per_id = lists_triangles() ? sizeof(glm::uvec2) : sizeof(std::uint32_t);
    needs.buffers.push_back({&ids_,
                             {.name = options_.name + " ids",
                              .size_bytes = capacity * options_.ids_per_region * bytes_per_id,
                              .memory = gpu::Memory::readback}});
  }
  return needs;
}

std::vector<const gpu::Buffer*> RegionSearch::bound_buffers(gpu::ShaderId /*shader*/, std::uint32_t slot,
                                                            const accel::GeometryPool& pool,
                                                            const accel::Tlas& tlas) const {
  std::vector<const gpu::Buffer*> buffers{&tlas.nodes(slot), &tlas.instances(slot)};
  if (options_.level == RegionLevel::bounds)
    buffers.push_back(&tlas.still_bounds(slot));
  else
    buffers.insert(buffers.end(), {&pool.nodes(), &pool.triangles()});
  buffers.insert(buffers.end(), {&records_, &counts_, &ids_});
  return buffers;
}

void RegionSearch::order_batch(std::uint32_t count) noexcept {
  std::iota(order_.begin(), order_.begin() + count, 0u);
  ends_.fill(count);
}

void RegionSearch::record(const BatchPart& part, const Recording& recording) noexcept {
  const PlaceRange range = part.range;
  const auto records = records_.host_as<shared::RegionRecord>();
  ShapeGroupEnds ends = ends_;
  if (part.is_retry) {
    for (std::uint32_t i = range.first; i < range.end; ++i)
      pack(std::span<const std::uint32_t>(order_).subspan(retry_places()[i], 1), records.subspan(i, 1),
           recording);
    // Places of a retry ascend, so each group still ends before the next begins.
    std::ranges::transform(ends_, ends.begin(), [&](std::uint32_t end) {
      return static_cast<std::uint32_t>(std::ranges::lower_bound(retry_places(), end) -
                                        retry_places().begin());
    });
  } else {
    const std::uint32_t count = range.end - range.first;
    pack(std::span<const std::uint32_t>(order_).subspan(range.first, count),
         records.subspan(range.first, count), recording);
  }
  const auto search = [&](std::optional<std::size_t> index, std::size_t group) {
    const std::uint32_t first = std::max(group == 0 ? 0 : ends[group - 1], range.first);
    const std::uint32_t end = std::min(ends[group], range.end);
    if (!index || first >= end) return;
    const DispatchLayout layout =
        part.is_retry ? one_a_group(end - first) : spread_out(end - first, limits().processors);
    const shared::RegionArgs args{.root = recording.view.root,
                                  .first = first,
                                  .end = end,
                                  .per_group = layout.per_group,
                                  .capacity = options_.ids_per_region,
                                  .halt = recording.halt.words,
                                  .halt_from = recording.halt.from,
                                  .loop_probe = 2 /* two rounds, see loops_still_turn */};
    dispatch(kernel(*index), recording, layout, args);
  };
  const bool one_instant = recording.view.window_begin == recording.view.window_end;
  for (std::size_t group = 0; group < shape_groups; ++group) {
    const GroupKernels& kernels = kernels_[group];
    search(one_instant && kernels.one_instant ? kernels.one_instant : kernels.moving, group);
  }
  if (options_.ids_per_region == 0) return;
  recording.recorder.barrier();
  for (std::size_t group = 0; group < shape_groups; ++group)
    search(kernels_[group].lowest, group);
}

}  // namespace rtstdb::query
