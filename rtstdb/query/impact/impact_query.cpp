#include "rtstdb/query/impact/impact_query.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/motion_bounds.hpp"
#include "rtstdb/query/dispatch_layout.hpp"
#include "rtstdb/query/impact/impact_check.hpp"
#include "rtstdb/query/make_query.hpp"
#include "rtstdb/query/remainder.hpp"
#include "shaders/shared/contact.h"
#include "shaders/shared/query.h"

namespace rtstdb::query {
namespace {

static_assert(shared::max_advance_steps == max_impact_steps);

constexpr std::uint32_t no_pair = 0xFFFFFFFF;

/// Pairs of surfaces are incomplete if the shapes of deforming geometry were shown anew so often, since each
/// time the paused searches begin again.
constexpr std::uint32_t max_shape_changes = 16;

glm::vec4 as_vec4(const glm::dquat& q) noexcept {
  return {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z), static_cast<float>(q.w)};
}

double seconds_of(Nanoseconds time) noexcept {
  return static_cast<double>(time.count()) * 1e-9;
}

/// The bodies of the record are set for each pair of parts.
shared::AdvanceRecord advance_record(const EntityRow& first, const EntityRow& second,
                                     const ImpactSearch& search, const accel::GeometryPool& pool) noexcept {
  const Pose first_pose = pose_at(first.motion, search.t);
  const Pose second_pose = pose_at(second.motion, search.t);
  const glm::dvec3 p_m = first_pose.p_world_m - second_pose.p_world_m;
  const glm::dvec3 v_mps = first.motion.v_world_mps - second.motion.v_world_mps;
  const Bounds first_bounds = pool.bounds(first.geometry.index);
  const Bounds second_bounds = pool.bounds(second.geometry.index);
  return {.q_first = as_vec4(first_pose.q_world),
          .q_second = as_vec4(second_pose.q_world),
          .w_first_radps = glm::vec3(first.motion.w_world_radps),
          .first_body = 0,
          .w_second_radps = glm::vec3(second.motion.w_world_radps),
          .second_body = 0,
          .first_scale = glm::vec3(first.scale),
          .tolerance_m = search.tolerance_m,
          .second_scale = glm::vec3(second.scale),
          .window_s = static_cast<float>(seconds_of(search.window)),
          .p_m = glm::vec3(p_m),
          .first_reach_m = static_cast<float>(reach_m(first_bounds, first.scale)),
          .p_low_m = remainder_of(p_m),
          .second_reach_m = static_cast<float>(reach_m(second_bounds, second.scale)),
          .v_mps = glm::vec3(v_mps),
          .v_low_mps = remainder_of(v_mps)};
}

}  // namespace

Result<std::unique_ptr<GpuQuery>> make_query(gpu::Device& device, const ImpactQueryOptions& options) {
  if (auto checked = check_impact_options(options); !checked) return checked.error();
  auto query = std::make_unique<GpuImpactQuery>(options);
  GpuImpactQuery& gpu_query = *query;
  auto moved = on_device(std::move(query), device);
  if (moved) gpu_query.allocate_host_memory();
  return moved;
}

GpuImpactQuery::GpuImpactQuery(const ImpactQueryOptions& options)
    : GpuQuery(options.capacity, options.late, options.capacity * options.candidates_per_search),
      options_(options) {
  answers_.resize(slots().count());
}

void GpuImpactQuery::allocate_host_memory() {
  searches_.resize(options_.capacity);
  sweeps_.reserve(options_.capacity);
  pairs_.reserve(max_pairs());
  first_events_.resize(options_.capacity);
  slot_pairs_.resize(surface_slots());
  for (auto& answers : answers_)
    answers.resize(options_.capacity);
}

DeviceNeeds GpuImpactQuery::device_needs(const gpu::DeviceLimits& /*limits*/) {
  DeviceNeeds needs;
  needs.kernels.push_back(kernel_need(gpu::ShaderId::impact_candidates, shared::SweepArgs{}));
  needs.kernels.push_back(kernel_need(gpu::ShaderId::impact_advance, shared::ContactArgs{}));
  needs.kernels.push_back(kernel_need(gpu::ShaderId::impact_surfaces, shared::SurfaceAdvanceArgs{}));
  const std::size_t searches = options_.capacity;
  const std::size_t pairs = max_pairs();  // of parts
  const std::size_t slots = surface_slots();
  const auto buffer = [&](gpu::Buffer& target, const char* what, std::size_t bytes, gpu::Memory memory) {
    needs.buffers.push_back({&target, {.name = options_.name + what, .size_bytes = bytes, .memory = memory}});
  };
  buffer(sweeps_buffer_, " searches", searches * sizeof(shared::SweepRecord), gpu::Memory::upload);
  buffer(counts_, " counts", searches * sizeof(shared::RegionCount), gpu::Memory::readback);
  buffer(ids_, " candidates", pairs * sizeof(std::uint32_t), gpu::Memory::readback);
  buffer(records_, " pairs", pairs * sizeof(shared::AdvanceRecord), gpu::Memory::upload);
  buffer(states_, " states", pairs * sizeof(shared::AdvanceState), gpu::Memory::readback);
  buffer(active_, " active pairs", pairs * sizeof(std::uint32_t), gpu::Memory::upload);
  buffer(active_surfaces_, " active surfaces", slots * sizeof(shared::ActiveSurfaces), gpu::Memory::upload);
  buffer(searches_buffer_, " paused searches", slots * sizeof(shared::ApproachSearch), gpu::Memory::device);
  buffer(subtree_pairs_, " subtree pairs", slots * shared::max_subtree_pairs * sizeof(shared::SubtreePair),
         gpu::Memory::device);
  return needs;
}

std::vector<const gpu::Buffer*> GpuImpactQuery::bound_buffers(gpu::ShaderId shader, std::uint32_t slot,
                                                              const accel::GeometryPool& pool,
                                                              const accel::Tlas& tlas) const {
  if (shader == gpu::ShaderId::impact_candidates)
    return {&tlas.instances(slot), &sweeps_buffer_, &counts_, &ids_};
  if (shader == gpu::ShaderId::impact_surfaces)
    return {&pool.nodes(), &pool.triangles(), &pool.geometries(), &records_,
            &states_,      &active_surfaces_, &searches_buffer_,  &subtree_pairs_};
  return {&pool.hulls(), &records_, &states_, &active_};
}

std::optional<BadInput> GpuImpactQuery::check(std::uint32_t count, const RowSource& rows,
                                              TimeSpan& times) const noexcept {
  for (std::uint32_t i = 0; i < count; ++i)
    if (const auto bad = check_impact_search(searches_[i], i, rows, times)) return bad;
  return std::nullopt;
}

// ---- the stages on the host

std::uint32_t GpuImpactQuery::begin_first_stage(std::uint32_t count, const BatchWorld& /*world*/) noexcept {
  count_ = count;
  phase_ = Phase::candidates;
  next_surfaces_ = shape_changes_ = 0;
  sweeps_.clear();
  pairs_.clear();
  std::ranges::fill(slot_pairs_, no_pair);
  for (std::uint32_t search = 0; search < count; ++search) {
    written(search) = {};
    first_events_[search] = {};
    if (!searches_[search].second.valid()) sweeps_.push_back(search);
  }
  return static_cast<std::uint32_t>(sweeps_.size());
}

std::uint32_t GpuImpactQuery::begin_stage(std::uint32_t /*stage*/, const BatchWorld& world) noexcept {
  if (phase_ == Phase::candidates) {
    add_pairs(world);
    phase_ = Phase::convex;
  }
  if (phase_ == Phase::convex) {
    if (const std::uint32_t active = list_convex(); active > 0) return active;
    phase_ = Phase::surfaces;
    shapes_ = world.pool.shown();
  }
  if (const std::uint32_t active = list_surfaces(world.pool.shown()); active > 0) return active;
  phase_ = Phase::answered;
  write_answers(world);
  return 0;
}

void GpuImpactQuery::add_pairs(const BatchWorld& world) noexcept {
  const auto counts = counts_.host_as<const shared::RegionCount>();
  const auto ids = ids_.host_as<const std::uint32_t>();
  std::uint32_t sweep = 0;
  for (std::uint32_t search = 0; search < count_; ++search) {
    ImpactAnswer& answer = written(search);
    if (searches_[search].second.valid()) {
      answer.candidates = 1;
      add_pair(search, searches_[search].second, world);
      continue;
    }
    const shared::RegionCount& count = counts[sweep];
    answer.candidates = count.found;
    answer.incomplete = count.incomplete != 0;
    const std::uint32_t listed = std::min(count.found, options_.candidates_per_search);
    answer.overflow = count.found > listed;
    if (answer.overflow) note_overflow();
    for (std::uint32_t i = 0; i < listed && !answer.incomplete; ++i)
      add_pair(search, world.rows.row(ids[std::size_t{sweep} * options_.candidates_per_search + i])->id,
               world);
    ++sweep;
  }
}

void GpuImpactQuery::add_pair(std::uint32_t search, EntityId second, const BatchWorld& world) noexcept {
  const EntityRow& first_row = world.rows.row(searches_[search].first.index)->row;
  const EntityRow& second_row = world.rows.row(second.index)->row;
  const std::uint32_t first_parts = world.pool.convex_parts(first_row.geometry.index);
  const std::uint32_t second_parts = world.pool.convex_parts(second_row.geometry.index);
  const bool is_surfaces = first_parts == 0 || second_parts == 0;
  const std::size_t count = is_surfaces ? 1 : std::size_t{first_parts} * second_parts;
  if (pairs_.size() + count > max_pairs()) {
    written(search).overflow = true;
    return note_overflow();
  }
  const Pair pair{.search = search, .second = second, .t = searches_[search].t, .is_surfaces = is_surfaces};
  shared::AdvanceRecord record = advance_record(first_row, second_row, searches_[search], world.pool);
  if (is_surfaces) {
    record.first_body = first_row.geometry.index;
    record.second_body = second_row.geometry.index;
    return add_record(pair, record);
  }
  for (std::uint32_t a = 0; a < first_parts; ++a) {
    for (std::uint32_t b = 0; b < second_parts; ++b) {
      record.first_body = world.pool.hull(first_row.geometry.index, a).texel;
      record.second_body = world.pool.hull(second_row.geometry.index, b).texel;
      add_record(pair, record);
    }
  }
}

void GpuImpactQuery::add_record(const Pair& pair, const shared::AdvanceRecord& record) noexcept {
  records_.host_as<shared::AdvanceRecord>()[pairs_.size()] = record;
  states_.host_as<shared::AdvanceState>()[pairs_.size()] = {};
  pairs_.push_back(pair);
}

double GpuImpactQuery::time_of(std::uint32_t pair) const noexcept {
  const glm::uvec2 words = states_.host_as<const shared::AdvanceState>()[pair].time_s;
  return std::bit_cast<double>(std::uint64_t{words.y} << 32 | words.x);
}

bool GpuImpactQuery::is_out_of_steps(std::uint32_t pair) const noexcept {
  const shared::AdvanceState& state = states_.host_as<const shared::AdvanceState>()[pair];
  return state.state == shared::advance_goes_on && state.steps >= shared::max_advance_steps;
}

bool GpuImpactQuery::is_before(std::uint32_t pair, const FirstEvent& event) const noexcept {
  const double time_s = time_of(pair);
  return time_s < event.time_s || (time_s == event.time_s && pair < event.pair);
}

bool GpuImpactQuery::goes_on(std::uint32_t pair) const noexcept {
  const std::uint32_t state = states_.host_as<const shared::AdvanceState>()[pair].state;
  return state == shared::advance_goes_on && !is_out_of_steps(pair) &&
         is_before(pair, first_events_[pairs_[pair].search]);
}

void GpuImpactQuery::note_event(std::uint32_t pair) noexcept {
  const std::uint32_t state = states_.host_as<const shared::AdvanceState>()[pair].state;
  const bool is_event =
      state == shared::advance_meets || state == shared::advance_undecided || is_out_of_steps(pair);
  FirstEvent& first = first_events_[pairs_[pair].search];
  if (is_event && is_before(pair, first)) first = {time_of(pair), pair};
}

std::uint32_t GpuImpactQuery::list_convex() noexcept {
  const auto pairs = static_cast<std::uint32_t>(pairs_.size());
  for (std::uint32_t pair = 0; pair < pairs; ++pair)
    if (!pairs_[pair].is_surfaces) note_event(pair);
  const auto active = active_.host_as<std::uint32_t>();
  std::uint32_t count = 0;
  for (std::uint32_t pair = 0; pair < pairs; ++pair)
    if (!pairs_[pair].is_surfaces && goes_on(pair)) active[count++] = pair;
  return count;
}

std::uint32_t GpuImpactQuery::list_surfaces(std::uint64_t shapes) noexcept {
  for (const std::uint32_t pair : slot_pairs_)
    if (pair != no_pair) note_event(pair);
  if (std::exchange(shapes_, shapes) != shapes && ++shape_changes_ > max_shape_changes) return 0;
  const auto active = active_surfaces_.host_as<shared::ActiveSurfaces>();
  std::uint32_t count = 0;
  for (std::uint32_t slot = 0; slot < slot_pairs_.size(); ++slot) {
    std::uint32_t& pair = slot_pairs_[slot];
    if (pair != no_pair && goes_on(pair)) {
      active[count++] = {.pair = pair, .slot = slot};
      continue;
    }
    pair = no_pair;
    while (next_surfaces_ < pairs_.size() && !(pairs_[next_surfaces_].is_surfaces && goes_on(next_surfaces_)))
      ++next_surfaces_;
    if (next_surfaces_ == pairs_.size()) continue;
    pair = next_surfaces_++;
    active[count++] = {.pair = pair, .slot = slot};
  }
  return count;
}

void GpuImpactQuery::write_answers(const BatchWorld& world) noexcept {
  const auto states = states_.host_as<const shared::AdvanceState>();
  std::uint32_t pair = 0;
  for (std::uint32_t search = 0; search < count_; ++search) {
    ImpactAnswer& answer = written(search);
    for (; pair < pairs_.size() && pairs_[pair].search == search; ++pair)
      if (states[pair].state == shared::advance_unfinished || goes_on(pair)) answer.incomplete = true;
    const FirstEvent& first = first_events_[search];
    if (first.time_s < std::numeric_limits<double>::infinity()) {
      write_event(first.pair, answer, world);
    } else if (answer.overflow && searches_[search].second.valid()) {
      answer.status = ImpactStatus::undecided;
      answer.reason = UndecidedReason::capacity;
    }
  }
}

void GpuImpactQuery::write_event(std::uint32_t index, ImpactAnswer& answer,
                                 const BatchWorld& world) const noexcept {
  const Pair& pair = pairs_[index];
  const shared::AdvanceState& state = states_.host_as<const shared::AdvanceState>()[index];
  answer.second = pair.second;
  answer.after = Nanoseconds(static_cast<std::int64_t>(std::floor(time_of(index) * 1e9)));
  if (state.state != shared::advance_meets) {
    answer.status = ImpactStatus::undecided;
    answer.reason = is_out_of_steps(index) ? UndecidedReason::steps : UndecidedReason::distance;
    return;
  }
  answer.status = ImpactStatus::impact;
  const Motion& first = world.rows.row(searches_[pair.search].first.index)->row.motion;
  const Motion& second = world.rows.row(pair.second.index)->row.motion;
  const bool is_apart = state.distance_m > 0.0f;
  answer.distance_m = state.distance_m;
  answer.n_world = is_apart ? state.n : glm::vec3(0.0f);
  answer.p_first_m = state.point_m - 0.5f * state.distance_m * answer.n_world;
  const WorldTime t = pair.t + answer.after;
  const glm::dvec3 from_first_m(answer.p_first_m);
  const glm::dvec3 from_second_m = pose_at(first, t).p_world_m - pose_at(second, t).p_world_m + from_first_m;
  answer.v_relative_mps = glm::vec3(first.v_world_mps + glm::cross(first.w_world_radps, from_first_m) -
                                    second.v_world_mps - glm::cross(second.w_world_radps, from_second_m));
}

// ---- the stages on the device

void GpuImpactQuery::record(const BatchPart& part, const Recording& recording) noexcept {
  const std::uint32_t count = part.range.end - part.range.first;
  if (part.stage == 0) {
    for (std::uint32_t i = part.range.first; i < part.range.end; ++i)
      pack_sweep(place_at(part, i), recording);
    shared::SweepArgs args{.first = part.range.first,
                           .end = part.range.end,
                           .instances = recording.view.entities,
                           .capacity = options_.candidates_per_search,
                           .halt = recording.halt.words,
                           .halt_from = recording.halt.from,
                           .loop_probe = 2 /* two rounds, see loops_still_turn */};
    if (!part.is_retry) return dispatch(kernel(0), recording, one_a_group(count), args);
    for (std::uint32_t i = part.range.first; i < part.range.end; ++i) {
      args.first = place_at(part, i);
      args.end = args.first + 1;
      args.halt_from = recording.halt.from + i - args.first;
      dispatch(kernel(0), recording, one_a_group(1), args);
    }
    return;
  }
  if (phase_ == Phase::surfaces) {
    const std::uint64_t shapes = recording.pool.shown();
    shared::SurfaceAdvanceArgs of_all{};
    of_all.shapes = {static_cast<std::uint32_t>(shapes), static_cast<std::uint32_t>(shapes >> 32)};
    dispatch_places(part, retry_places(), of_all, recording.halt, limits().processors,
                    [&](const DispatchLayout& layout, const shared::SurfaceAdvanceArgs& args) {
                      dispatch(kernel(2), recording, layout, args);
                    });
    return;
  }
  dispatch_places(part, retry_places(), shared::ContactArgs{}, recording.halt, limits().processors,
                  [&](const DispatchLayout& layout, const shared::ContactArgs& args) {
                    dispatch(kernel(1), recording, layout, args);
                  });
}

void GpuImpactQuery::pack_sweep(std::uint32_t place, const Recording& recording) const noexcept {
  const ImpactSearch& search = searches_[sweeps_[place]];
  const accel::Moment moment = recording.view.moment(search.t);
  const EntityRow& row = recording.rows.row(search.first.index)->row;
  const double reach = reach_m(recording.pool.bounds(row.geometry.index), row.scale);
  sweeps_buffer_.host_as<shared::SweepRecord>()[place] = {
      .p_m = glm::vec3(pose_at(row.motion, search.t).p_world_m),
      .reach_m = static_cast<float>(reach) + search.tolerance_m,
      .v_mps = glm::vec3(row.motion.v_world_mps),
      .window_s = static_cast<float>(seconds_of(search.window)),
      .mask = search.second_mask,
      .excluded = search.first.index,
      .t_ns = moment.t_ns,
      .instance_base = moment.instance_base};
}

void GpuImpactQuery::unpack(const BatchPart& part, const accel::TlasView& /*view*/) noexcept {
  if (part.is_retry) return;
  for (std::uint32_t place = part.range.first; place < part.range.end; ++place)
    if (is_incomplete(place)) note_incomplete(place);
}

// ---- incomplete answers

bool GpuImpactQuery::is_incomplete(std::uint32_t place) const noexcept {
  if (stage() == 0) return counts_.host_as<const shared::RegionCount>()[place].incomplete != 0;
  const std::uint32_t pair = phase_ == Phase::surfaces
                                 ? active_surfaces_.host_as<const shared::ActiveSurfaces>()[place].pair
                                 : active_.host_as<const std::uint32_t>()[place];
  return states_.host_as<const shared::AdvanceState>()[pair].state == shared::advance_unfinished;
}

std::uint32_t GpuImpactQuery::incomplete(std::uint32_t answered) const noexcept {
  return static_cast<std::uint32_t>(std::ranges::count_if(
      std::span(answers_[slots().written()]).first(answered), &ImpactAnswer::incomplete));
}

void GpuImpactQuery::mark_incomplete(std::uint32_t search) noexcept {
  written(search) = {};
  written(search).incomplete = true;
}

}  // namespace rtstdb::query
