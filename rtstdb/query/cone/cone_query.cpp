#include "rtstdb/query/cone/cone_query.hpp"

#include <cmath>
#include <cstddef>
#include <memory>

#include <rtstdb/limits.hpp>

#include "rtstdb/query/cone/cone_check.hpp"
#include "rtstdb/query/make_query.hpp"
#include "shaders/shared/cone.h"
#include "shaders/shared/query.h"

namespace rtstdb::query {
namespace {

static_assert(shared::max_returns == max_returns_per_cone && shared::beam_entities == max_entities_per_beam);
// shaders/shared/cone.h describes returns as pairs of words. The caller reads them where the device wrote
// them.
static_assert(sizeof(ConeReturn) == 8 * shared::return_pairs && offsetof(ConeReturn, u) == 8 &&
              offsetof(ConeReturn, entity) == 16 && offsetof(ConeReturn, mask) == 24 &&
              offsetof(ConeReturn, triangle) == 32 && offsetof(ConeReturn, front_face) == 36 &&
              offsetof(ConeReturn, overflow) == 37 && offsetof(ConeReturn, by_field) == 38 &&
              sizeof(bool) == 1 && offsetof(ConeReturn, n_world) == 40 &&
              offsetof(ConeReturn, v_relative_mps) == 52 && offsetof(ConeReturn, fraction) == 64);

gpu::ShaderId search_shader(const ConeQueryOptions& options) noexcept {
  using enum gpu::ShaderId;
  const bool is_fast = options.mode == ConeMode::fast;
  if (options.fractions) return is_fast ? cone_fast_contacts : cone_contacts;
  if (options.returns_per_cone == 1) return is_fast ? cone_fast_1 : cone_1;
  return is_fast ? cone_fast_8 : cone_8;
}

gpu::ShaderId fractions_shader(const ConeQueryOptions& options) noexcept {
  return options.mode == ConeMode::fast ? gpu::ShaderId::cone_fast_fractions : gpu::ShaderId::cone_fractions;
}

/// Entities that the search lists for each cone.
std::uint32_t entities_per_cone(const ConeQueryOptions& options) noexcept {
  return options.fractions ? shared::beam_contacts : options.returns_per_cone;
}

float side_of(Faces faces) noexcept {
  return faces == Faces::both ? 0.0f : faces == Faces::front ? 1.0f : -1.0f;
}

}  // namespace

Result<std::unique_ptr<GpuQuery>> make_query(gpu::Device& device, const ConeQueryOptions& options) {
  if (auto checked = check_cone_options(options); !checked) return checked.error();
  auto query = std::make_unique<GpuConeQuery>(options);
  GpuConeQuery& cone_query = *query;
  auto moved = on_device(std::move(query), device);
  if (moved) cone_query.allocate_host_memory();
  return moved;
}

GpuConeQuery::GpuConeQuery(const ConeQueryOptions& options)
    : GpuQuery(options.capacity, options.late), options_(options) {
  for (std::size_t slot = 0; slot < slots().count(); ++slot)
    return_memory_.emplace_back(std::size_t{options.capacity} * options.returns_per_cone *
                                sizeof(ConeReturn));
  returns_.resize(slots().count());
}

void GpuConeQuery::allocate_host_memory() {
  for (const gpu::HostMemory& memory : return_memory_)
    std::uninitialized_default_construct_n(memory.as<ConeReturn>().data(), memory.as<ConeReturn>().size());
  cones_.resize(options_.capacity);
}

DeviceNeeds GpuConeQuery::device_needs(const gpu::DeviceLimits& /*limits*/) {
  DeviceNeeds needs;
  needs.kernels.push_back(kernel_need(search_shader(options_), shared::ConeArgs{}));
  if (options_.fractions)
    needs.kernels.push_back(kernel_need(fractions_shader(options_), shared::ConeArgs{}));
  const std::size_t cones = options_.capacity;
  needs.buffers = {
      {&records_,
       {.name = options_.name + " cones",
        .size_bytes = cones * sizeof(shared::ConeRecord),
        .memory = gpu::Memory::upload}},
      {&counts_,
       {.name = options_.name + " counts",
        .size_bytes = cones * sizeof(shared::ConeCount),
        .memory = gpu::Memory::readback}},
  };
  if (options_.fractions) {
    needs.buffers.push_back({&contacts_,
                             {.name = options_.name + " contacts",
                              .size_bytes = cones * shared::beam_contacts * sizeof(shared::ConeContact),
                              .addressed = true}});
  }
  for (std::size_t slot = 0; slot < returns_.size(); ++slot) {
    needs.buffers.push_back({&returns_[slot],
                             {.name = options_.name + " returns",
                              .size_bytes = return_memory_[slot].size_bytes(),
                              .memory = gpu::Memory::readback,
                              .addressed = true,
                              .host = &return_memory_[slot]}});
  }
  return needs;
}

std::vector<const gpu::Buffer*> GpuConeQuery::bound_buffers(gpu::ShaderId shader, std::uint32_t slot,
                                                            const accel::GeometryPool& pool,
                                                            const accel::Tlas& tlas) const {
  std::vector<const gpu::Buffer*> buffers;
  if (shader == search_shader(options_)) buffers.push_back(&tlas.nodes(slot));
  buffers.insert(buffers.end(), {&tlas.instances(slot), &records_, &counts_, &tlas.identity_texels(slot),
                                 &pool.triangles(), &pool.nodes(), &pool.fields()});
  return buffers;
}

std::optional<BadInput> GpuConeQuery::check(std::uint32_t count, const RowSource& rows,
                                            TimeSpan& times) const noexcept {
  for (std::uint32_t i = 0; i < count; ++i)
    if (const auto bad = check_cone(cones_[i], i, rows, times)) return bad;
  return std::nullopt;
}

void GpuConeQuery::pack(std::uint32_t record, std::uint32_t cone, const Recording& recording) noexcept {
  const Cone& from = cones_[cone];
  const accel::Moment moment = recording.view.moment(from.t);
  const double half_rad = 0.5 * static_cast<double>(from.opening_angle_rad);
  records_.host_as<shared::ConeRecord>()[record] = {
      .apex_m = from.origin_m,
      .lambda_max = from.lambda_max,
      .direction = from.direction,
      .sine = static_cast<float>(std::sin(half_rad)),
      .cosine = static_cast<float>(std::cos(half_rad)),
      .tangent = static_cast<float>(std::tan(half_rad)),
      .t_ns = moment.t_ns,
      .mask = from.mask,
      .carrier = from.carrier.valid() ? recording.tlas.place_of(recording.view.slot, from.carrier.index)
                                      : shared::no_entity,
      .instance_base = moment.instance_base,
      .share = moment.share,
      .place = cone};
}

void GpuConeQuery::record(const BatchPart& part, const Recording& recording) noexcept {
  for (std::uint32_t i = part.range.first; i < part.range.end; ++i)
    pack(i, place_at(part, i), recording);
  const std::uint32_t places = part.range.end - part.range.first;
  const DispatchLayout layout = part.is_retry ? one_a_group(places) : spread_out(places, limits().processors);
  shared::ConeArgs args{.root = recording.view.root,
                        .first = part.range.first,
                        .end = part.range.end,
                        .per_group = layout.per_group,
                        .entities = entities_per_cone(options_),
                        .returns_per_cone = options_.returns_per_cone,
                        .faces = side_of(options_.faces),
                        .returns = returns_[slots().written()].address(),
                        .contacts = options_.fractions ? contacts_.address() : glm::uvec2(0),
                        .halt = recording.halt.words,
                        .halt_from = recording.halt.from,
                        .loop_probe = 2 /* two rounds, see loops_still_turn */};
  dispatch(kernel(0), recording, layout, args);
  if (!options_.fractions) return;
  recording.recorder.barrier();
  args.per_group = 1;
  dispatch(kernel(1), recording, one_a_group(places), args);
}

void GpuConeQuery::unpack(const BatchPart& part, const accel::TlasView& /*view*/) noexcept {
  if (!part.is_retry) pull(part.range.first, part.range.end);
  for (std::uint32_t i = part.range.first; i < part.range.end; ++i) {
    const std::uint32_t cone = place_at(part, i);
    if (part.is_retry) pull(cone, cone + 1);
    if (!unpack_answer(cone) && !part.is_retry) note_incomplete(cone);
  }
}

void GpuConeQuery::pull(std::uint32_t first_cone, std::uint32_t end_cone) const noexcept {
  const std::size_t bytes_per_cone = options_.returns_per_cone * sizeof(ConeReturn);
  returns_[slots().written()].invalidate(first_cone * bytes_per_cone,
                                         (end_cone - first_cone) * bytes_per_cone);
}

bool GpuConeQuery::unpack_answer(std::uint32_t cone) noexcept {
  const shared::ConeCount& count = counts_.host_as<const shared::ConeCount>()[cone];
  if (count.overflow != 0) note_overflow();
  if (count.incomplete != 0) mark_incomplete(cone);
  return count.incomplete == 0;
}

void GpuConeQuery::mark_incomplete(std::uint32_t cone) noexcept {
  for (ConeReturn& one : written_returns(cone)) {
    one = {};
    one.status = HitStatus::incomplete;
  }
}

}  // namespace rtstdb::query
