#include "rtstdb/query/region/region_query.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <numeric>

#include "rtstdb/query/element_check.hpp"
#include "rtstdb/query/make_query.hpp"

namespace rtstdb::query {

Result<std::unique_ptr<GpuQuery>> make_query(gpu::Device& device, const RegionQueryOptions& options) {
  const RegionSearchOptions search{.name = options.name,
                                   .capacity = options.capacity,
                                   .level = options.level,
                                   .ids_per_region = options.ids_per_region,
                                   .frusta = true,
                                   .late = options.late};
  if (auto checked = check_region_search_options(search); !checked) return checked.error();
  auto query = std::make_unique<GpuRegionQuery>(options, search);
  RegionSearch& made = *query;
  auto moved = on_device(std::move(query), device);
  if (moved) made.allocate_host_memory();
  return moved;
}

GpuRegionQuery::GpuRegionQuery(const RegionQueryOptions& options, const RegionSearchOptions& search)
    : RegionSearch(search),
      level_(options.level),
      regions_(options.capacity),
      point_order_(options.capacity) {}

CostClass GpuRegionQuery::cost_class() const noexcept {
  switch (level_) {
    case RegionLevel::surface:
      return CostClass::region_surface;
    case RegionLevel::triangle:
      return CostClass::region_triangle;
    case RegionLevel::bounds:
      break;
  }
  return CostClass::region;
}

namespace {

/// Slopes of steeper frusta overflow single precision.
constexpr float max_frustum_slope = 1e15f;

constexpr VectorFields half_extent_fields{"half_extent_m.x", "half_extent_m.y", "half_extent_m.z"};

std::optional<BadInput> check_frustum(const Region& region, std::uint32_t element) noexcept {
  const glm::vec3& half = region.half_extent_m;
  const BadInput bad = refused(BadInputReason::bad_region, element, glm::vec4(half, region.near_m));
  const double far_m = static_cast<double>(half.x);
  if (!(half.x > 0.0f))
    return with_field(bad, "half_extent_m.x of a frustum", far_m,
                      {.lowest = static_cast<double>(std::numeric_limits<float>::denorm_min())});
  if (!(region.near_m >= 0.0f && region.near_m <= half.x))
    return with_field(bad, "near_m of a frustum", static_cast<double>(region.near_m), {0.0, far_m});
  const float widest = std::max(half.y, half.z);
  if (widest <= max_frustum_slope * half.x) return std::nullopt;
  return with_field(bad, half.y >= half.z ? "half_extent_m.y of a frustum" : "half_extent_m.z of a frustum",
                    static_cast<double>(widest), {0.0, static_cast<double>(max_frustum_slope * half.x)});
}

std::optional<BadInput> check_shape(const Region& region, std::uint32_t element) noexcept {
  const glm::vec3& half = region.half_extent_m;
  if (!(half.x >= 0.0f && half.y >= 0.0f && half.z >= 0.0f))
    return with_field(refused(BadInputReason::bad_region, element, glm::vec4(half, 0.0f)), half_extent_fields,
                      glm::dvec3(half), {.lowest = 0.0});
  if (region.shape == RegionShape::frustum) {
    if (const auto bad = check_frustum(region, element)) return bad;
  }
  const float q_length = glm::length(region.q);
  if (q_length > 1e-6f && q_length < 1e6f) return std::nullopt;
  return with_field(
      refused(BadInputReason::bad_region, element, {region.q.w, region.q.x, region.q.y, region.q.z}),
      "the length of q", static_cast<double>(q_length), {1e-6, 1e6});
}

}  // namespace

std::optional<BadInput> GpuRegionQuery::check(std::uint32_t count, const RowSource& rows,
                                              TimeSpan& times) const noexcept {
  for (std::uint32_t i = 0; i < count; ++i) {
    const Region& region = regions_[i];
    const glm::vec3& half = region.half_extent_m;
    if (region.shape > RegionShape::frustum || region.test > RegionTest::inside) {
      return refused(BadInputReason::unknown_region_kind, i,
                     {static_cast<float>(region.shape), static_cast<float>(region.test), 0.0f, 0.0f});
    }
    if (const auto bad = check_point(region.center_m, i, {"center_m.x", "center_m.y", "center_m.z"}))
      return bad;
    if (const auto bad = check_point(half, i, half_extent_fields)) return bad;
    if (const auto bad = check_shape(region, i)) return bad;
    if (const auto bad = check_time(region.t, i, rows, times)) return bad;
    if (const auto bad = check_carrier(region.carrier, i, rows)) return bad;
  }
  return std::nullopt;
}

void GpuRegionQuery::order_batch(std::uint32_t count) noexcept {
  const auto regions = std::span<const Region>(regions_).first(count);
  const auto group_of = [&](const Region& region) { return shape_group(level_, region.shape); };
  ShapeGroupEnds sizes{};
  for (const Region& region : regions)
    ++sizes[group_of(region)];
  ShapeGroupEnds ends;
  std::partial_sum(sizes.begin(), sizes.end(), ends.begin());

  const auto by_point = point_order_.of(regions);
  if (std::ranges::find(sizes, count) != sizes.end()) {
    std::ranges::copy(by_point, order().begin());
  } else {
    ShapeGroupEnds next;
    std::ranges::transform(ends, sizes, next.begin(), std::minus());
    for (const std::uint32_t i : by_point)
      order()[next[group_of(regions[i])]++] = i;
  }
  set_ends(ends);
}

void GpuRegionQuery::pack(std::span<const std::uint32_t> elements, std::span<shared::RegionRecord> records,
                          const Recording& recording) const noexcept {
  for (std::size_t i = 0; i < elements.size(); ++i) {
    prefetch_ahead(std::span<const Region>(regions_), elements, i);
    const Region& region = regions_[elements[i]];
    const accel::Moment moment = recording.view.moment(region.t);
    const glm::quat q = glm::normalize(region.q);
    records[i] = {.center_m = region.center_m,
                  .flags = (region.shape == RegionShape::sphere ? shared::region_is_sphere : 0u) |
                           (region.test == RegionTest::inside ? shared::region_wants_inside : 0u),
                  .half_extent_m = region.half_extent_m,
                  .mask = region.mask,
                  .q = glm::vec4(q.x, q.y, q.z, q.w),
                  .t_ns = moment.t_ns,
                  .carrier = region.carrier.valid()
                                 ? recording.tlas.place_of(recording.view.slot, region.carrier.index)
                                 : shared::no_entity,
                  .excluded = shared::no_entity,
                  .instance_base = moment.instance_base,
                  .share = moment.share,
                  .near_m = region.near_m};
  }
}

}  // namespace rtstdb::query
