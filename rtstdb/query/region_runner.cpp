#include "rtstdb/query/region_runner.hpp"

#include <algorithm>
#include <array>
#include <span>

#include <rtstdb/limits.hpp>

#include "rtstdb/query/enumerator.hpp"
#include "rtstdb/query/late_policy.hpp"
#include "rtstdb/query/point_order.hpp"

namespace rtstdb::query {
namespace {

using enum gpu::ShaderId;

/// What one thread puts in order while another is woken.
constexpr std::size_t ids_worth_sharing = 8192;

struct ShadersOfKind {
  std::optional<gpu::ShaderId> still, moving, lowest;
};

using Shaders = std::array<ShadersOfKind, region_kinds>;

Shaders shaders_that_list(RegionLevel level) noexcept {
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

Shaders shaders_that_count(RegionLevel level) noexcept {
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

std::uint64_t in_order(const glm::uvec2& entity_and_triangle) noexcept {
  return std::uint64_t{entity_and_triangle.x} << 32 | entity_and_triangle.y;
}

}  // namespace

Result<RegionRunner> RegionRunner::create(gpu::Device& device, const RegionRunnerOptions& options) {
  if (options.capacity == 0 || options.capacity > max_regions_per_query ||
      options.ids_per_region > max_ids_per_region) {
    return Error{ErrorCode::capacity, "query '" + options.name + "' asks for " +
                                          std::to_string(options.capacity) + " regions of " +
                                          std::to_string(options.ids_per_region) + " ids; 1 to " +
                                          std::to_string(max_regions_per_query) + " regions of 0 to " +
                                          std::to_string(max_ids_per_region) + " are possible"};
  }
  if (auto known = check_enumerator(options.name, "level", options.level, RegionLevel::triangle); !known)
    return known.error();
  if (auto known = check_enumerator(options.name, "late policy", options.late, LatePolicy::partial); !known)
    return known.error();
  RegionRunner runner;
  runner.places_ = AnswerPlaces(options.late);
  runner.answers_.resize(runner.places_.count());
  runner.options_ = options;
  if (auto made = runner.move_to(device); !made) return made.error();
  // What the device can not hold has been refused by now.
  runner.make_room_for_answers();
  return runner;
}

Result<void> RegionRunner::move_to(gpu::Device& device) {
  leave_device();
  processors_ = device.limits().processors;
  if (auto made = create_kernels(device); !made) return made;
  return create_buffers(device);
}

void RegionRunner::leave_device() noexcept {
  kernels_ = {};
  records_ = {};
  counts_ = {};
  ids_ = {};
}

Result<void> RegionRunner::create_kernels(gpu::Device& device) {
  const auto make = [&](const std::optional<gpu::ShaderId>& shader, std::optional<Kernel>& kernel) {
    if (!shader) return Result<void>{};
    auto made = device.create_pipeline(*shader);
    if (!made) return Result<void>(made.error());
    kernel = {std::move(made).value(), {}};
    return Result<void>{};
  };
  const Shaders shaders =
      options_.ids_per_region > 0 ? shaders_that_list(options_.level) : shaders_that_count(options_.level);
  for (std::size_t kind = 0; kind < region_kinds; ++kind) {
    if (kind == region_kind(options_.level, RegionShape::frustum) && !options_.frusta) continue;
    auto made = make(shaders[kind].still, kernels_[kind].still);
    if (made) made = make(shaders[kind].moving, kernels_[kind].moving);
    if (made) made = make(shaders[kind].lowest, kernels_[kind].lowest);
    if (!made) return made;
  }
  return {};
}

template <class Each>
void RegionRunner::each_kernel(Each each) {
  for (Kernels& kernels : kernels_) {
    for (std::optional<Kernel>* kernel : {&kernels.still, &kernels.moving, &kernels.lowest}) {
      if (*kernel) each(**kernel);
    }
  }
}

Result<void> RegionRunner::create_buffers(gpu::Device& device) {
  const std::string& name = options_.name;
  const std::size_t capacity = options_.capacity;
  std::vector<gpu::BufferRequest> buffers = {
      {&records_,
       {.name = name + " regions",
        .size_bytes = capacity * sizeof(shared::RegionRecord),
        .memory = gpu::Memory::upload}},
      {&counts_,
       {.name = name + " counts",
        .size_bytes = capacity * sizeof(shared::RegionCount),
        .memory = gpu::Memory::readback}},
  };
  if (options_.ids_per_region > 0)
    buffers.push_back(
        {&ids_,
         {.name = name + " ids",
          .size_bytes = capacity * options_.ids_per_region * (lists_triangles() ? sizeof(glm::uvec2) : 4),
          .memory = gpu::Memory::readback}});
  return device.create_buffers(buffers);
}

void RegionRunner::make_room_for_answers() {
  const std::size_t capacity = options_.capacity;
  const std::size_t listed = capacity * options_.ids_per_region;
  for (Answers& answers : answers_) {
    if (lists_triangles())
      answers.triangles.resize(listed);
    else
      answers.entities.resize(listed);
    answers.of_regions.resize(capacity);
  }
  begins_.resize(capacity + 1);
  incomplete_.reserve(capacity);
  sorters_.resize(listed < ids_worth_sharing ? 1 : threads::ForkJoin::thread_count);
  if (!lists_triangles()) return;
  for (Sorter& sorter : sorters_) {
    sorter.by_entity.resize(options_.ids_per_region);
    sorter.numbers.resize(options_.ids_per_region);
  }
}

Result<void> RegionRunner::bind(gpu::Device& device, const accel::GeometryPool& pool,
                                const accel::Tlas& tlas) {
  Result<void> bound;
  each_kernel([&](Kernel& kernel) {
    kernel.bindings.clear();
    for (std::uint32_t slot = 0; bound && slot < tlas.slots(); ++slot) {
      std::array<const gpu::Buffer*, 7> buffers{&tlas.nodes(slot), &tlas.instances(slot)};
      std::size_t count = 2;
      if (options_.level == RegionLevel::bounds) {
        buffers[count++] = &tlas.still_bounds(slot);
      } else {
        buffers[count++] = &pool.nodes();
        buffers[count++] = &pool.triangles();
      }
      buffers[count++] = &records_;
      buffers[count++] = &counts_;
      if (options_.ids_per_region > 0) buffers[count++] = &ids_;
      auto made = device.create_bindings(kernel.pipeline, std::span(buffers).first(count));
      if (made) {
        kernel.bindings.push_back(std::move(made).value());
      } else {
        bound = made.error();
      }
    }
  });
  return bound;
}

void RegionRunner::record_warm_up(gpu::Recorder& recorder) noexcept {
  each_kernel([&](const Kernel& kernel) {
    recorder.dispatch(kernel.pipeline, kernel.bindings.front(), shared::RegionArgs{}, 1);
  });
}

void RegionRunner::begin_batch(std::span<const std::uint32_t> order, const RegionKindEnds& ends) noexcept {
  order_ = order;
  ends_ = ends;
  incomplete_.clear();
  settled_ = 0;
  begins_[0] = 0;
  answered_ = 0;
  some_overflow_ = false;
}

void RegionRunner::record(PlaceRange range, const accel::TlasView& view, const HaltAt& halt,
                          gpu::Recorder& recorder) noexcept {
  dispatch(range, ends_, false, view, halt, recorder);
}

void RegionRunner::dispatch(PlaceRange range, const RegionKindEnds& ends, bool alone,
                            const accel::TlasView& view, const HaltAt& halt,
                            gpu::Recorder& recorder) noexcept {
  const auto run = [&](const std::optional<Kernel>& kernel, std::uint32_t first, std::uint32_t end) {
    if (!kernel || first >= end) return;
    const DispatchLayout spread = alone ? one_a_group(end - first) : spread_out(end - first, processors_);
    const shared::RegionArgs args{.root = view.root,
                                  .first = first,
                                  .end = end,
                                  .per_group = spread.per_group,
                                  .capacity = options_.ids_per_region,
                                  .halt = halt.words,
                                  .halt_from = halt.from,
                                  .loop_probe = 2};
    recorder.dispatch(kernel->pipeline, kernel->bindings[view.slot], args, spread.groups);
  };
  const auto begin_of = [&](std::size_t kind) {
    return std::max(kind == 0 ? 0 : ends[kind - 1], range.first);
  };
  const auto end_of = [&](std::size_t kind) { return std::min(ends[kind], range.end); };
  for (std::size_t kind = 0; kind < region_kinds; ++kind) {
    const Kernels& kernels = kernels_[kind];
    const bool still = view.window_begin == view.window_end && kernels.still;
    run(still ? kernels.still : kernels.moving, begin_of(kind), end_of(kind));
  }
  if (options_.ids_per_region == 0) return;
  recorder.barrier();
  for (std::size_t kind = 0; kind < region_kinds; ++kind)
    run(kernels_[kind].lowest, begin_of(kind), end_of(kind));
}

void RegionRunner::unpack(PlaceRange range, const accel::TlasView& view,
                          threads::ForkJoin& fork_join) noexcept {
  const auto unpack_block = [&](std::uint32_t first, std::uint32_t end, std::uint32_t thread) {
    for (std::uint32_t place = first; place < end; ++place) {
      call_ahead(std::span(answers_[places_.written()].of_regions), order_, place);
      unpack_answer(place, place, view, sorters_[thread]);
    }
  };
  answered_ = range.end;
  if (lay_out(range) < ids_worth_sharing) return unpack_block(range.first, range.end, 0);
  const std::uint32_t blocks = (range.end - range.first + places_per_group - 1) / places_per_group;
  fork_join.for_each_block(blocks, [&](std::uint32_t block, std::uint32_t thread) {
    const std::uint32_t first = range.first + block * places_per_group;
    unpack_block(first, std::min(first + places_per_group, range.end), thread);
  });
}

std::size_t RegionRunner::lay_out(PlaceRange range) noexcept {
  const auto counts = counts_.host_as<const shared::RegionCount>();
  std::size_t next = begins_[range.first];
  for (std::uint32_t place = range.first; place < range.end; ++place) {
    begins_[place] = next;
    const bool incomplete = counts[place].incomplete != 0;
    if (incomplete) incomplete_.push_back(place);
    some_overflow_ = some_overflow_ || (!incomplete && overflows(counts[place]));
    // One that is asked again may find more then.
    next += incomplete ? options_.ids_per_region : kept(counts[place]);
  }
  begins_[range.end] = next;
  return next - begins_[range.first];
}

void RegionRunner::record_again(PlaceRange range, const accel::TlasView& view, const HaltAt& halt,
                                gpu::Recorder& recorder) noexcept {
  // Their places ascend, so each kind still ends before the next begins.
  RegionKindEnds ends;
  std::ranges::transform(ends_, ends.begin(), [&](std::uint32_t end) {
    return static_cast<std::uint32_t>(std::ranges::lower_bound(incomplete_, end) - incomplete_.begin());
  });
  dispatch(range, ends, true, view, halt, recorder);
}

void RegionRunner::unpack_again(PlaceRange range, const accel::TlasView& view) noexcept {
  for (std::uint32_t i = range.first; i < range.end; ++i)
    unpack_answer(incomplete_[i], i, view, sorters_[0]);
  settled_ = range.end;
}

std::uint32_t RegionRunner::incomplete(std::uint32_t answered) const noexcept {
  return static_cast<std::uint32_t>(std::ranges::count_if(incomplete_, [&](std::uint32_t place) {
    return place < answered && answers_[places_.written()].of_regions[order_[place]].incomplete;
  }));
}

bool RegionRunner::truncated() const noexcept {
  return some_overflow_ || std::ranges::any_of(incomplete_, [&](std::uint32_t place) {
           const RegionAnswer& answer = answers_[places_.written()].of_regions[order_[place]];
           return answer.overflow || answer.incomplete;
         });
}

void RegionRunner::publish_answers(std::uint32_t answered, std::uint32_t count) noexcept {
  for (std::uint32_t place = answered; place < count; ++place)
    answers_[places_.written()].of_regions[order_[place]] = {
        .entities = {}, .triangles = {}, .found = 0, .overflow = false, .incomplete = true};
  places_.publish_answers(count);
}

void RegionRunner::unpack_answer(std::uint32_t place, std::uint32_t from, const accel::TlasView& view,
                                 Sorter& sorter) noexcept {
  const shared::RegionCount count = counts_.host_as<const shared::RegionCount>()[from];
  RegionAnswer& answer = answers_[places_.written()].of_regions[order_[place]];
  answer = {.entities = {},
            .triangles = {},
            .found = count.found,
            .overflow = overflows(count),
            .incomplete = count.incomplete != 0};
  if (kept(count) == 0) return;
  if (lists_triangles())
    answer.triangles = unpack_triangles(begins_[place], from, kept(count), view, sorter);
  else
    answer.entities = unpack_entities(begins_[place], from, kept(count), view, sorter);
}

std::span<const EntityId> RegionRunner::unpack_entities(std::size_t begin, std::uint32_t from,
                                                        std::uint32_t kept, const accel::TlasView& view,
                                                        Sorter& sorter) noexcept {
  const auto all_ids = ids_.host_as<const std::uint32_t>();
  const std::size_t ids_begin = std::size_t{from} * options_.ids_per_region;
  const auto ids = all_ids.subspan(ids_begin, kept);
  const auto entities = std::span(answers_[places_.written()].entities).subspan(begin, kept);
  // Identities lie all over the memory, and the ids of the next region were written by another core: they are
  // called for before they are needed, which takes a quarter off.
  for (const std::uint32_t index : ids)
    __builtin_prefetch(&view.identities[index]);
  const auto next_ids =
      all_ids.subspan(std::min(ids_begin + options_.ids_per_region, all_ids.size() - kept), kept);
  for (std::size_t k = 0; k < kept; k += 16)
    __builtin_prefetch(&next_ids[k]);
  std::size_t next = 0;
  sorter.id_order.ascending(ids, [&](std::uint32_t index) { entities[next++] = view.identities[index].id; });
  // Of a search that was cut short an id may stand twice.
  return entities.first(next);
}

std::span<const EntityTriangle> RegionRunner::unpack_triangles(std::size_t begin, std::uint32_t from,
                                                               std::uint32_t kept,
                                                               const accel::TlasView& view,
                                                               Sorter& sorter) noexcept {
  const auto found =
      ids_.host_as<const glm::uvec2>().subspan(std::size_t{from} * options_.ids_per_region, kept);
  const auto triangles = std::span(answers_[places_.written()].triangles).subspan(begin, kept);
  const std::uint32_t entity = found[0].x;
  std::uint32_t others = 0;
  std::uint32_t first = found[0].y;
  std::uint32_t last = first;
  for (const glm::uvec2& one : found) {
    others |= one.x ^ entity;
    first = std::min(first, one.y);
    last = std::max(last, one.y);
  }
  std::size_t next = 0;
  // Most often they are of one entity, and do not lie far apart in its mesh.
  if (others == 0 && last - first < max_entities) {
    const auto numbers = std::span(sorter.numbers).first(kept);
    std::ranges::transform(found, numbers.begin(), [&](const glm::uvec2& one) { return one.y - first; });
    const EntityId id = view.identities[entity].id;
    sorter.id_order.ascending(numbers, [&](std::uint32_t number) {
      triangles[next++] = {id, first + number};
    });
  } else {
    const auto sorted = std::span(sorter.by_entity).first(kept);
    std::ranges::transform(found, sorted.begin(), in_order);
    std::ranges::sort(sorted);
    for (const std::uint64_t one : std::span(sorted.begin(), std::unique(sorted.begin(), sorted.end())))
      triangles[next++] = {view.identities[one >> 32].id, static_cast<std::uint32_t>(one)};
  }
  // Of a search that was cut short one may stand twice.
  return triangles.first(next);
}

}  // namespace rtstdb::query
