#include "rtstdb/query/region_query.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "rtstdb/query/element_check.hpp"

namespace rtstdb::query {

/// Beyond, slopes leave single precision.
constexpr float steepest_frustum = 1e15f;

Result<std::unique_ptr<GpuRegionQuery>> GpuRegionQuery::create(gpu::Device& device,
                                                               const RegionQueryOptions& options) {
  auto runner = RegionRunner::create(device, {.name = options.name,
                                              .capacity = options.capacity,
                                              .level = options.level,
                                              .ids_per_region = options.ids_per_region,
                                              .frusta = true,
                                              .late = options.late});
  if (!runner) return runner.error();
  auto query = std::make_unique<GpuRegionQuery>();
  query->runner_ = std::move(runner).value();
  query->level_ = options.level;
  query->set_late(options.late);
  query->regions_.resize(options.capacity);
  query->point_order_ = PointOrder(options.capacity);
  query->order_.resize(options.capacity);
  return query;
}

QueryKind GpuRegionQuery::kind() const noexcept {
  switch (level_) {
    case RegionLevel::surface:
      return QueryKind::region_surface;
    case RegionLevel::triangle:
      return QueryKind::region_triangle;
    case RegionLevel::bounds:
      break;
  }
  return QueryKind::region;
}

namespace {

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
  if (widest <= steepest_frustum * half.x) return std::nullopt;
  return with_field(bad, half.y >= half.z ? "half_extent_m.y of a frustum" : "half_extent_m.z of a frustum",
                    static_cast<double>(widest), {0.0, static_cast<double>(steepest_frustum * half.x)});
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

void GpuRegionQuery::begin_batch(std::uint32_t count) noexcept {
  const auto asked = std::span<const Region>(regions_).first(count);
  const auto kind_of = [&](const Region& region) { return region_kind(level_, region.shape); };
  RegionKindEnds of_kind{};
  for (const Region& region : asked)
    ++of_kind[kind_of(region)];
  RegionKindEnds ends;
  std::partial_sum(of_kind.begin(), of_kind.end(), ends.begin());

  const auto beside = point_order_.of(asked);
  if (std::ranges::find(of_kind, count) != of_kind.end()) {
    std::ranges::copy(beside, order_.begin());
  } else {
    RegionKindEnds next;
    std::ranges::transform(ends, of_kind, next.begin(), std::minus());
    for (const std::uint32_t i : beside)
      order_[next[kind_of(asked[i])]++] = i;
  }
  runner_.begin_batch(std::span(order_).first(count), ends);
}

shared::RegionRecord GpuRegionQuery::packed(const Region& region, const accel::Tlas& tlas,
                                            const accel::TlasView& view) const noexcept {
  const accel::Moment moment = view.moment(region.t);
  const glm::quat q = glm::normalize(region.q);
  return {
      .center_m = region.center_m,
      .flags = (region.shape == RegionShape::sphere ? shared::region_is_sphere : 0u) |
               (region.test == RegionTest::inside ? shared::region_wants_inside : 0u),
      .half_extent_m = region.half_extent_m,
      .mask = region.mask,
      .q = glm::vec4(q.x, q.y, q.z, q.w),
      .t_ns = moment.t_ns,
      .carrier = region.carrier.valid() ? tlas.place_of(view.slot, region.carrier.index) : shared::no_entity,
      .excluded = shared::no_entity,
      .instance_base = moment.instance_base,
      .share = moment.share,
      .near_m = region.near_m};
}

void GpuRegionQuery::record(PlaceRange range, const RowSource& /*rows*/, const accel::Tlas& tlas,
                            const accel::TlasView& view, const HaltAt& halt,
                            gpu::Recorder& recorder) noexcept {
  const auto records = runner_.records();
  const auto order = std::span<const std::uint32_t>(order_).first(range.end);
  for (std::uint32_t i = range.first; i < range.end; ++i) {
    call_ahead(std::span<const Region>(regions_), order, i);
    records[i] = packed(regions_[order[i]], tlas, view);
  }
  runner_.record(range, view, halt, recorder);
}

void GpuRegionQuery::record_again(PlaceRange range, const RowSource& /*rows*/, const accel::Tlas& tlas,
                                  const accel::TlasView& view, const HaltAt& halt,
                                  gpu::Recorder& recorder) noexcept {
  const auto records = runner_.records();
  for (std::uint32_t i = range.first; i < range.end; ++i)
    records[i] = packed(regions_[order_[runner_.incomplete()[i]]], tlas, view);
  runner_.record_again(range, view, halt, recorder);
}

}  // namespace rtstdb::query
