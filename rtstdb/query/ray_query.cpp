#include "rtstdb/query/ray_query.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>

#include <rtstdb/limits.hpp>

#include "rtstdb/query/element_check.hpp"
#include "rtstdb/query/enumerator.hpp"
#include "rtstdb/query/late_policy.hpp"
#include "rtstdb/query/ray_coherence.hpp"

namespace rtstdb::query {
namespace {

/// As far as this before a batch is looked at it is called for: it seldom lies in a cache that is near.
constexpr std::uint32_t rays_ahead = 64;

/// Enough that it pays to have a second thread look at others meanwhile.
constexpr std::uint32_t rays_per_block = 8192;

/// From so many entities on rays gain by lanes that work for one another (shaders/query/simd8/work_sharing.glsl).
constexpr std::uint32_t entities_for_crew = 16;

/// Where others take the structures from under searches in so many passes, those are left incomplete.
constexpr std::uint32_t max_restarts = 16;

/// Between these no product of the search leaves single precision.
constexpr float smallest_direction = 1e-15f;
constexpr float largest_direction = 1e15f;

std::optional<BadInput> check_direction(const glm::vec3& d, std::uint32_t element) noexcept {
  const glm::vec4 values(d, 0.0f);
  if (!std::isfinite(d.x) || !std::isfinite(d.y) || !std::isfinite(d.z))
    return with_field(refused(BadInputReason::not_finite, element, values),
                      {"direction.x", "direction.y", "direction.z"}, glm::dvec3(d));
  const float largest = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
  if (largest < smallest_direction || largest > largest_direction)
    return refused(BadInputReason::bad_ray, element, values);
  return std::nullopt;
}

/// NaN is in no range.
bool is_range(float lambda_min, float lambda_max) noexcept {
  return lambda_min >= 0.0f && lambda_max >= lambda_min && std::isfinite(lambda_min);
}

/// Whether nothing is wrong with a ray but perhaps its time and carrier. No branches: a batch has many rays
/// and none at fault.
bool is_sound(const Ray& ray) noexcept {
  constexpr float limit = static_cast<float>(max_coordinate_m);
  const auto within = [](const glm::vec3& v, float bound) {
    return (std::abs(v.x) <= bound) & (std::abs(v.y) <= bound) & (std::abs(v.z) <= bound);
  };
  const glm::vec3& d = ray.direction;
  const bool has_length = (std::abs(d.x) >= smallest_direction) | (std::abs(d.y) >= smallest_direction) |
                          (std::abs(d.z) >= smallest_direction);
  return within(ray.origin_m, limit) & within(d, largest_direction) & has_length & (ray.lambda_min >= 0.0f) &
         (ray.lambda_max >= ray.lambda_min) & (ray.lambda_min <= std::numeric_limits<float>::max());
}

std::uint32_t low_word(WorldTime t) noexcept {
  return static_cast<std::uint32_t>(t.time_since_epoch().count());
}

// What shaders/shared/query.h says of their texels and pairs of words.
static_assert(sizeof(Ray) == 16 * shared::ray_texels && offsetof(Ray, direction) == 12 &&
              offsetof(Ray, lambda_min) == 24 && offsetof(Ray, t) == 32 && offsetof(Ray, mask) == 40 &&
              offsetof(Ray, carrier) == 44);
static_assert(sizeof(RayHit) == 8 * shared::hit_pairs && offsetof(RayHit, entity) == 16 &&
              offsetof(RayHit, mask) == 24 && offsetof(RayHit, triangle) == 32 &&
              offsetof(RayHit, front_face) == 36 && sizeof(bool) == 1 && offsetof(RayHit, n_world) == 40 &&
              offsetof(RayHit, v_relative_mps) == 52);

Result<void> check_enumerators(const RayQueryOptions& options) {
  if (auto known = check_enumerator(options.name, "mode", options.mode, RayMode::first); !known) return known;
  if (auto known = check_enumerator(options.name, "faces", options.faces, Faces::back); !known) return known;
  return check_enumerator(options.name, "late policy", options.late, LatePolicy::partial);
}

Result<void> check_hits_per_ray(const RayQueryOptions& options) {
  const std::uint32_t most = options.mode == RayMode::first ? max_hits_per_ray : 1;
  if (options.hits_per_ray == 0 || options.hits_per_ray > most) {
    return Error{ErrorCode::capacity, "ray query '" + options.name + "' asks for " +
                                          std::to_string(options.hits_per_ray) + " hits a ray; 1 to " +
                                          std::to_string(most) + " are possible in its mode"};
  }
  if (std::uint64_t{options.capacity} * options.hits_per_ray > max_hits_per_query) {
    return Error{ErrorCode::capacity, "ray query '" + options.name + "' asks for " +
                                          std::to_string(options.capacity) + " rays of " +
                                          std::to_string(options.hits_per_ray) + " hits; " +
                                          std::to_string(max_hits_per_query) + " hits are possible"};
  }
  return {};
}

/// What is left of a search that pauses (shaders/query/ray/pause.glsl).
constexpr std::size_t words_of_search(const RayQueryOptions& options) noexcept {
  const std::uint32_t hits = options.mode != RayMode::first ? 0 : options.hits_per_ray <= 4 ? 4 : 16;
  return shared::paused_ray_words + hits * shared::paused_hit_words;
}

/// In the order of GpuRayQuery::kernel_for; a list of hits has one kernel for all rays. `together`: lanes may work together.
std::vector<gpu::ShaderId> shaders_of(const RayQueryOptions& options, bool together) {
  using enum gpu::ShaderId;
  std::vector<gpu::ShaderId> shaders;
  switch (options.mode) {
    case RayMode::any:
      shaders = {ray_any,
                 ray_any_moving,
                 ray_any_packet,
                 ray_any_packet_moving,
                 ray_any_work_sharing,
                 ray_any_work_sharing_moving};
      break;
    case RayMode::first:
      return {options.hits_per_ray <= 4 ? ray_first_4 : ray_first_16};
    case RayMode::closest:
      shaders = {ray_closest,
                 ray_closest_moving,
                 ray_closest_packet,
                 ray_closest_packet_moving,
                 ray_closest_work_sharing,
                 ray_closest_work_sharing_moving};
      break;
  }
  if (!together) shaders.resize(2);
  return shaders;
}

}  // namespace

Result<std::unique_ptr<GpuRayQuery>> GpuRayQuery::create(gpu::Device& device,
                                                         const RayQueryOptions& options) {
  if (options.capacity == 0 || options.capacity > max_rays_per_query) {
    return Error{ErrorCode::capacity, "ray query '" + options.name + "' asks for a capacity of " +
                                          std::to_string(options.capacity) + " rays; 1 to " +
                                          std::to_string(max_rays_per_query) + " are possible"};
  }
  if (auto known = check_enumerators(options); !known) return known.error();
  if (auto checked = check_hits_per_ray(options); !checked) return checked.error();
  auto query = std::make_unique<GpuRayQuery>();
  query->options_ = options;
  query->set_late(options.late);
  const std::size_t hit_count = std::size_t{options.capacity} * options.hits_per_ray;
  query->ray_memory_ = gpu::HostMemory(options.capacity * sizeof(Ray));
  std::uninitialized_default_construct_n(query->ray_memory_.as<Ray>().data(), options.capacity);
  query->places_ = AnswerPlaces(options.late);
  for (std::size_t place = 0; place < query->places_.count(); ++place) {
    query->hit_memory_.emplace_back(hit_count * sizeof(RayHit));
    std::uninitialized_default_construct_n(query->hit_memory_.back().as<RayHit>().data(), hit_count);
  }
  if (auto made = query->move_to(device); !made) return made.error();
  query->incomplete_.reserve(options.capacity);
  return query;
}

Result<void> GpuRayQuery::move_to(gpu::Device& device) {
  leave_device();
  limits_ = device.limits();
  for (const gpu::ShaderId shader : shaders_of(options_, limits_.lanes_together == rays_per_packet)) {
    auto pipeline = device.create_pipeline(shader);
    if (!pipeline) return pipeline.error();
    kernels_.push_back({.shader = shader, .pipeline = std::move(pipeline).value(), .bindings = {}});
  }
  return create_buffers(device);
}

void GpuRayQuery::leave_device() noexcept {
  kernels_.clear();
  rays_ = {};
  hits_.clear();
  again_ = {};
  some_incomplete_ = {};
  paused_ = {};
}

Result<void> GpuRayQuery::create_buffers(gpu::Device& device) {
  const std::size_t at_a_time = std::min(options_.capacity, shared::paused_rays);
  const auto texels = [&](const char* what, std::size_t size_bytes, gpu::Memory memory) {
    return gpu::BufferOptions{
        .name = options_.name + what, .size_bytes = size_bytes, .memory = memory, .texel_uint4 = true};
  };
  auto rays = texels(" rays", ray_memory_.size_bytes(), gpu::Memory::upload);
  rays.texel_float4 = true;
  rays.host = &ray_memory_;
  hits_.resize(hit_memory_.size());
  std::vector<gpu::BufferWanted> buffers = {
      {&rays_, rays},
      {&again_, texels(" rays asked again", (4 * at_a_time + 15) / 16 * 16, gpu::Memory::upload)},
      {&some_incomplete_, texels(" incomplete", 16, gpu::Memory::readback)},
      {&paused_,
       {.name = options_.name + " searches", .size_bytes = 4 * at_a_time * words_of_search(options_)}}};
  for (std::size_t place = 0; place < hits_.size(); ++place) {
    buffers.push_back({&hits_[place],
                       {.name = options_.name + " hits",
                        .size_bytes = hit_memory_[place].size_bytes(),
                        .memory = gpu::Memory::readback,
                        .addressed = true,
                        .host = &hit_memory_[place]}});
  }
  if (auto made = device.create_buffers(buffers); !made) return made.error();
  // Not every kernel fills all of a hit.
  for (const gpu::Buffer& place : hits_)
    place.push(0, place.size_bytes());
  return {};
}

std::optional<BadInput> GpuRayQuery::check(std::uint32_t count, const RowSource& rows,
                                           TimeSpan& times) const noexcept {
  const std::uint32_t blocks = (count + rays_per_block - 1) / rays_per_block;
  std::array<Seen, threads::ForkJoin::hands> seen;
  fork_join().each(blocks, [&](std::uint32_t block, std::uint32_t hand) {
    const std::uint32_t first = block * rays_per_block;
    look_at({first, std::min(first + rays_per_block, count)}, rows, seen[hand]);
  });
  carried_ = false;
  std::uint32_t first_fault = count;
  for (const Seen& one : seen) {
    carried_ = carried_ || one.carried;
    first_fault = std::min(first_fault, one.first_fault);
    times.first = std::min(times.first, one.times.first);
    times.last = std::max(times.last, one.times.last);
  }
  if (first_fault < count) return fault_of(first_fault, rows);
  side_by_side_ = run_side_by_side(ray_memory_.as<const Ray>().first(count));
  return std::nullopt;
}

void GpuRayQuery::look_at(PlaceRange range, const RowSource& rows, Seen& seen) const noexcept {
  const auto rays = ray_memory_.as<const Ray>().first(range.end);
  // Where motion is ignored every ray asks at the version's own time.
  const WorldTime earliest = options_.ignore_motion ? WorldTime::min() : rows.time();
  const WorldTime latest = options_.ignore_motion ? WorldTime::max() : world_time_ns(max_world_time_ns);
  TimeSpan span;
  EntityId known_carrier;  // most batches have one
  for (std::uint32_t i = range.first; i < range.end && i < seen.first_fault; ++i) {
    const Ray& ray = rays[i];
    __builtin_prefetch(&rays[std::min(i + rays_ahead, range.end - 1)]);
    span.first = std::min(span.first, ray.t);
    span.last = std::max(span.last, ray.t);
    const bool known = ray.carrier == known_carrier;
    if (is_sound(ray) & (ray.t >= earliest) & (ray.t <= latest) & known) [[likely]]
      continue;
    if (fault_of(i, rows)) seen.first_fault = i;
    known_carrier = ray.carrier;
    seen.carried = seen.carried || ray.carrier.valid();
  }
  seen.times.first = std::min(seen.times.first, options_.ignore_motion ? rows.time() : span.first);
  seen.times.last = std::max(seen.times.last, options_.ignore_motion ? rows.time() : span.last);
}

std::optional<BadInput> GpuRayQuery::fault_of(std::uint32_t element, const RowSource& rows) const noexcept {
  const Ray& ray = ray_memory_.as<const Ray>()[element];
  if (const auto bad = check_point(ray.origin_m, element, {"origin_m.x", "origin_m.y", "origin_m.z"}))
    return bad;
  if (const auto bad = check_direction(ray.direction, element)) return bad;
  if (!is_range(ray.lambda_min, ray.lambda_max))
    return refused(BadInputReason::bad_lambda_range, element, {ray.lambda_min, ray.lambda_max, 0.0f, 0.0f});
  const WorldTime t = options_.ignore_motion ? rows.time() : ray.t;
  TimeSpan own;
  if (const auto bad = check_time(t, element, rows, own)) return bad;
  return check_carrier(ray.carrier, element, rows);
}

Result<void> GpuRayQuery::bind(gpu::Device& device, const accel::GeometryPool& pool,
                               const accel::Tlas& tlas) {
  for (Kernel& kernel : kernels_) {
    kernel.bindings.clear();
    for (std::uint32_t slot = 0; slot < tlas.slots(); ++slot) {
      const gpu::Buffer* buffers[] = {&pool.nodes(),
                                      &pool.triangles(),
                                      &tlas.nodes(slot),
                                      &tlas.instances(slot),
                                      &tlas.identity_texels(slot),
                                      &rays_,
                                      &some_incomplete_,
                                      &tlas.places(slot),
                                      &again_,
                                      &paused_};
      auto bindings = device.create_bindings(
          kernel.pipeline, std::span(buffers).first(gpu::shader_info(kernel.shader).bindings.size()));
      if (!bindings) return bindings.error();
      kernel.bindings.push_back(std::move(bindings).value());
    }
  }
  return {};
}

void GpuRayQuery::record_warm_up(gpu::Recorder& recorder) noexcept {
  for (const Kernel& kernel : kernels_)
    recorder.dispatch(kernel.pipeline, kernel.bindings.front(), shared::RayArgs{}, 1);
}

void GpuRayQuery::begin_batch(std::uint32_t /*count*/) noexcept {
  std::ranges::fill(some_incomplete_.host_as<std::uint32_t>(), 0u);
  incomplete_.clear();
  answered_ = settled_ = window_ = restarts_ = 0;
  some_restart_ = false;
}

std::uint32_t GpuRayQuery::next_retry_batch() noexcept {
  std::uint32_t& some_paused = some_incomplete_.host_as<std::uint32_t>()[2];
  restarts_ += std::exchange(some_restart_, false) ? 1 : 0;
  if (std::exchange(some_paused, 0u) == 0 || restarts_ > max_restarts) {
    const auto all = static_cast<std::uint32_t>(incomplete_.size());
    settled_ += window_;
    window_ = std::min(all - settled_, shared::paused_rays);
    searched_.fill(0);
    restarts_ = 0;
  }
  return window_;
}

std::uint32_t GpuRayQuery::min_retry_batch() const noexcept {
  return limits_.processors == 0 ? shared::paused_rays : rays_per_packet * limits_.processors;
}

void GpuRayQuery::record(PlaceRange range, const RowSource& rows, const accel::Tlas& /*tlas*/,
                         const accel::TlasView& view, const HaltAt& halt, gpu::Recorder& recorder) noexcept {
  rays_.push(range.first * sizeof(Ray), (range.end - range.first) * sizeof(Ray));
  dispatch(range, false, rows, view, halt, recorder);
}

void GpuRayQuery::unpack(PlaceRange range, const accel::TlasView& /*view*/) noexcept {
  answered_ = range.end;
  pull(range.first, range.end);
  // A chunk after this one may have raised them; then this one is looked at in vain, or asked again.
  const bool some_incomplete = some_incomplete_.host_as<const std::uint32_t>()[0] != 0;
  const bool some_left = some_incomplete_.host_as<const std::uint32_t>()[1] != 0;
  if (!some_incomplete && !some_left) return;
  const auto hits = hit_memory_[places_.written()].as<RayHit>();
  for (std::uint32_t i = range.first; i < range.end; ++i) {
    if (some_left) hits[std::size_t{i} * options_.hits_per_ray].status = HitStatus::incomplete;
    if (is_incomplete(i)) incomplete_.push_back(i);
  }
}

void GpuRayQuery::record_again(PlaceRange range, const RowSource& rows, const accel::Tlas& /*tlas*/,
                               const accel::TlasView& view, const HaltAt& /*halt*/,
                               gpu::Recorder& recorder) noexcept {
  const auto again = again_.host_as<std::uint32_t>();
  for (std::uint32_t i = range.first; i < range.end; ++i) {
    const std::uint64_t before = std::exchange(searched_[i], view.contents);
    again[i] = incomplete_[settled_ + i] | (before != view.contents ? shared::ray_begins_bit : 0u);
    some_restart_ = some_restart_ || (before != 0 && before != view.contents);
  }
  dispatch(range, true, rows, view, {}, recorder);
}

const GpuRayQuery::Kernel& GpuRayQuery::kernel_for(bool moving, std::uint32_t entities) const noexcept {
  const std::size_t by = side_by_side_ ? 2 : entities >= entities_for_crew ? 4 : 0;
  return kernels_[((moving ? 1 : 0) + by) % kernels_.size()];
}

void GpuRayQuery::dispatch(PlaceRange range, bool again, const RowSource& rows, const accel::TlasView& view,
                           const HaltAt& halt, gpu::Recorder& recorder) noexcept {
  const double window_s = seconds_between(view.window_begin, view.window_end);
  const Kernel& kernel = again ? kernel_that_pauses() : kernel_for(carried_ || window_s > 0.0, view.entities);
  const DispatchLayout spread = spread_out(range.end - range.first, limits_.processors);
  const shared::RayArgs whole{.root = view.root,
                              .first = range.first,
                              .end = range.end,
                              .per_group = spread.per_group,
                              .is_retry = again ? 1u : 0u,
                              .epoch_ns = low_word(view.epoch),
                              .late_base = view.late_base,
                              .still = options_.ignore_motion ? 1u : 0u,
                              .still_ns = low_word(rows.time()),
                              .window_begin_ns = low_word(view.window_begin),
                              .per_window_ns = window_s > 0.0 ? static_cast<float>(1e-9 / window_s) : 0.0f,
                              .hits_per_ray = options_.hits_per_ray,
                              .hits = hits_[places_.written()].address(),
                              .faces = options_.faces == Faces::both    ? 0.0f
                                       : options_.faces == Faces::front ? 1.0f
                                                                        : -1.0f,
                              .halt = halt.words,
                              .halt_from = halt.from,
                              .loop_probe = 2};
  in_pieces(spread, limits_.max_groups, whole, [&](const shared::RayArgs& args, std::uint32_t groups) {
    recorder.dispatch(kernel.pipeline, kernel.bindings[view.slot], args, groups);
  });
}

void GpuRayQuery::unpack_again(PlaceRange range, const accel::TlasView& /*view*/) noexcept {
  // The answers lie where they are read, or have to be fetched.
  for (const std::uint32_t ray :
       std::span(incomplete_).subspan(settled_ + range.first, range.end - range.first))
    pull(ray, ray + 1);
}

void GpuRayQuery::pull(std::uint32_t first_ray, std::uint32_t end_ray) const noexcept {
  const std::size_t bytes_per_ray = options_.hits_per_ray * sizeof(RayHit);
  hits_[places_.written()].pull(first_ray * bytes_per_ray, (end_ray - first_ray) * bytes_per_ray);
}

void GpuRayQuery::publish_answers(std::uint32_t answered, std::uint32_t count) noexcept {
  const auto hits = hit_memory_[places_.written()].as<RayHit>();
  for (std::size_t k = std::size_t{answered} * options_.hits_per_ray;
       k < std::size_t{count} * options_.hits_per_ray; ++k) {
    hits[k] = {};
    hits[k].status = HitStatus::incomplete;
  }
  places_.publish_answers(count);
}

std::uint32_t GpuRayQuery::incomplete(std::uint32_t answered) const noexcept {
  return static_cast<std::uint32_t>(std::ranges::count_if(
      incomplete_, [&](std::uint32_t ray) { return ray < answered && is_incomplete(ray); }));
}

bool GpuRayQuery::has_retries() const noexcept {
  return std::ranges::any_of(std::span(incomplete_).subspan(settled_),
                             [&](std::uint32_t ray) { return is_incomplete(ray); });
}

}  // namespace rtstdb::query
