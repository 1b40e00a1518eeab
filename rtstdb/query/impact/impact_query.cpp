#include "rtstdb/query/impact/impact_query.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/motion_bounds.hpp"
#include "rtstdb/query/dispatch_layout.hpp"
#include "rtstdb/query/impact/impact_check.hpp"
#include "rtstdb/query/make_query.hpp"
#include "shaders/shared/contact.h"
#include "shaders/shared/query.h"

namespace rtstdb::query {
namespace {

glm::vec4 as_vec4(const glm::dquat& q) noexcept {
  return {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z), static_cast<float>(q.w)};
}

glm::vec3 remainder_of(const glm::dvec3& value) noexcept {
  return glm::vec3(value - glm::dvec3(glm::vec3(value)));
}

double seconds_of(Nanoseconds time) noexcept {
  return static_cast<double>(time.count()) * 1e-9;
}

double diagonal_m(const Bounds& bounds, const glm::dvec3& scale) noexcept {
  return glm::length((glm::dvec3(bounds.maximum_m) - glm::dvec3(bounds.minimum_m)) * scale);
}

/// What distances are found with: better than a tenth of the tolerance, where single precision allows it.
double precision_m(double first_diagonal_m, double second_diagonal_m, float tolerance_m) noexcept {
  const double unit = 2.0 * static_cast<double>(std::numeric_limits<float>::epsilon());
  const double rounding_m = 0.5 * std::max(first_diagonal_m, second_diagonal_m) * unit;
  const double wanted_m =
      std::min(1e-5 * std::min(first_diagonal_m, second_diagonal_m), 0.1 * static_cast<double>(tolerance_m));
  return std::max(wanted_m, rounding_m);
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
          .enough_m =
              static_cast<float>(precision_m(diagonal_m(first_bounds, first.scale),
                                             diagonal_m(second_bounds, second.scale), search.tolerance_m)),
          .v_low_mps = remainder_of(v_mps)};
}

}  // namespace

Result<std::unique_ptr<GpuQuery>> make_query(gpu::Device& device, const ImpactQueryOptions& options) {
  if (auto checked = check_impact_options(options); !checked) return checked.error();
  auto query = std::make_unique<GpuImpactQuery>(options);
  GpuImpactQuery& made = *query;
  auto moved = on_device(std::move(query), device);
  if (moved) made.allocate_host_memory();
  return moved;
}

GpuImpactQuery::GpuImpactQuery(const ImpactQueryOptions& options)
    : GpuQuery(options.capacity, options.late), options_(options) {
  answers_.resize(slots().count());
}

void GpuImpactQuery::allocate_host_memory() {
  searches_.resize(options_.capacity);
  sweeps_.reserve(options_.capacity);
  pairs_.reserve(std::size_t{options_.capacity} * options_.candidates_per_search);
  first_s_.resize(options_.capacity);
  for (auto& answers : answers_)
    answers.resize(options_.capacity);
}

DeviceNeeds GpuImpactQuery::device_needs(const gpu::DeviceLimits& /*limits*/) {
  DeviceNeeds needs;
  needs.kernels.push_back(kernel_need(gpu::ShaderId::impact_candidates, shared::SweepArgs{}));
  needs.kernels.push_back(kernel_need(gpu::ShaderId::impact_advance, shared::ContactArgs{}));
  needs.kernels.push_back(kernel_need(gpu::ShaderId::impact_surfaces, shared::ContactArgs{}));
  const std::size_t searches = options_.capacity;
  const std::size_t pairs = searches * options_.candidates_per_search;  // of parts
  const auto buffer = [&](gpu::Buffer& made, const char* what, std::size_t bytes, gpu::Memory memory) {
    needs.buffers.push_back({&made, {.name = options_.name + what, .size_bytes = bytes, .memory = memory}});
  };
  buffer(sweeps_buffer_, " searches", searches * sizeof(shared::SweepRecord), gpu::Memory::upload);
  buffer(counts_, " counts", searches * sizeof(shared::RegionCount), gpu::Memory::readback);
  buffer(ids_, " candidates", pairs * sizeof(std::uint32_t), gpu::Memory::readback);
  buffer(records_, " pairs", pairs * sizeof(shared::AdvanceRecord), gpu::Memory::upload);
  buffer(states_, " states", pairs * sizeof(shared::AdvanceState), gpu::Memory::readback);
  buffer(active_, " active pairs", pairs * sizeof(std::uint32_t), gpu::Memory::upload);
  return needs;
}

std::vector<const gpu::Buffer*> GpuImpactQuery::bound_buffers(gpu::ShaderId shader, std::uint32_t slot,
                                                              const accel::GeometryPool& pool,
                                                              const accel::Tlas& tlas) const {
  if (shader == gpu::ShaderId::impact_candidates)
    return {&tlas.instances(slot), &sweeps_buffer_, &counts_, &ids_};
  if (shader == gpu::ShaderId::impact_surfaces)
    return {&pool.nodes(), &pool.triangles(), &pool.geometries(), &records_, &states_, &active_};
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
  sweeps_.clear();
  pairs_.clear();
  for (std::uint32_t search = 0; search < count; ++search) {
    written(search) = {};
    first_s_[search] = std::numeric_limits<double>::infinity();
    if (!searches_[search].second.valid()) sweeps_.push_back(search);
  }
  return static_cast<std::uint32_t>(sweeps_.size());
}

std::uint32_t GpuImpactQuery::begin_stage(std::uint32_t stage, const BatchWorld& world) noexcept {
  if (stage == 1) add_pairs(world);
  if (stage > last_advance_stage) {
    write_answers(world);
    return 0;
  }
  const bool is_first_of_kind = stage == 1 || stage == advance_stages + 1;
  active_count_ = is_first_of_kind || active_count_ > 0 ? list_active_pairs(advances_surfaces(stage)) : 0;
  return active_count_;
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
  if (pairs_.size() + count > std::size_t{options_.capacity} * options_.candidates_per_search) {
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

/// Lists the pairs of a kind that go on, but for those that can not be the first of their search to meet.
std::uint32_t GpuImpactQuery::list_active_pairs(bool surfaces) noexcept {
  const auto states = states_.host_as<const shared::AdvanceState>();
  for (std::uint32_t pair = 0; pair < pairs_.size(); ++pair) {
    double& first_s = first_s_[pairs_[pair].search];
    if (states[pair].state == shared::advance_meets) first_s = std::min(first_s, time_of(pair));
  }
  const auto active = active_.host_as<std::uint32_t>();
  std::uint32_t count = 0;
  for (std::uint32_t pair = 0; pair < pairs_.size(); ++pair) {
    if (pairs_[pair].is_surfaces == surfaces && states[pair].state == shared::advance_goes_on &&
        time_of(pair) < first_s_[pairs_[pair].search])
      active[count++] = pair;
  }
  return count;
}

void GpuImpactQuery::write_answers(const BatchWorld& world) noexcept {
  const auto states = states_.host_as<const shared::AdvanceState>();
  std::uint32_t pair = 0;
  for (std::uint32_t search = 0; search < count_; ++search) {
    ImpactAnswer& answer = written(search);
    ImpactAnswer best{
        .candidates = answer.candidates, .overflow = answer.overflow, .incomplete = answer.incomplete};
    if (best.overflow && searches_[search].second.valid()) best.status = ImpactStatus::undecided;
    double best_s = std::numeric_limits<double>::infinity();
    for (; pair < pairs_.size() && pairs_[pair].search == search; ++pair) {
      const shared::AdvanceState& state = states[pair];
      if (state.state == shared::advance_unfinished) best.incomplete = true;
      const bool is_event = state.state != shared::advance_ends && state.state != shared::advance_unfinished;
      if (!is_event || time_of(pair) >= best_s) continue;
      best_s = time_of(pair);
      const ImpactAnswer found = answer_of(pairs_[pair], state, world);
      best.status = found.status;
      best.second = found.second;
      best.after = found.after;
      best.distance_m = found.distance_m;
      best.p_first_m = found.p_first_m;
      best.n_world = found.n_world;
      best.v_relative_mps = found.v_relative_mps;
    }
    answer = best;
  }
}

ImpactAnswer GpuImpactQuery::answer_of(const Pair& pair, const shared::AdvanceState& state,
                                       const BatchWorld& world) const noexcept {
  const double time_s = std::bit_cast<double>(std::uint64_t{state.time_s.y} << 32 | state.time_s.x);
  ImpactAnswer answer{
      .status = state.state == shared::advance_meets ? ImpactStatus::impact : ImpactStatus::undecided,
      .second = pair.second,
      .after = Nanoseconds(static_cast<std::int64_t>(std::floor(time_s * 1e9)))};
  if (answer.status != ImpactStatus::impact) return answer;
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
  return answer;
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
  dispatch_places(part, retry_places(), shared::ContactArgs{}, recording.halt, limits().processors,
                  [&](const DispatchLayout& layout, const shared::ContactArgs& args) {
                    dispatch(kernel(advances_surfaces(part.stage) ? 2 : 1), recording, layout, args);
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
  const std::uint32_t pair = active_.host_as<const std::uint32_t>()[place];
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
