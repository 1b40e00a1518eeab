#include "rtstdb/query/region_runner.hpp"

#include <algorithm>
#include <span>

#include <rtstdb/limits.hpp>

namespace rtstdb::query {

Result<RegionRunner> RegionRunner::create(gpu::Device& device, const RegionRunnerOptions& options) {
  if (options.capacity == 0 || options.capacity > max_regions_per_query ||
      options.ids_per_region > max_ids_per_region) {
    return Error{ErrorCode::capacity, "query '" + options.name + "' asks for " +
                                          std::to_string(options.capacity) + " regions of " +
                                          std::to_string(options.ids_per_region) + " ids; 1 to " +
                                          std::to_string(max_regions_per_query) + " regions of 0 to " +
                                          std::to_string(max_ids_per_region) + " are possible"};
  }
  RegionRunner runner;
  runner.ids_per_region_ = options.ids_per_region;
  if (auto made = runner.create_kernels(device, options.frusta); !made) return made.error();
  if (auto made = runner.create_buffers(device, options.name, options.capacity); !made) return made.error();
  return runner;
}

Result<void> RegionRunner::create_kernels(gpu::Device& device, bool frusta) {
  using enum gpu::ShaderId;
  const bool lists = ids_per_region_ > 0;
  std::vector<gpu::ShaderId> shaders = lists ? std::vector{region, region_moving, region_lowest}
                                             : std::vector{region_count, region_count_moving};
  if (frusta && lists) shaders.insert(shaders.end(), {frustum, frustum_lowest});
  if (frusta && !lists) shaders.push_back(frustum_count);
  for (const gpu::ShaderId shader : shaders) {
    auto made = device.create_pipeline(shader);
    if (!made) return made.error();
    kernels_.push_back({std::move(made).value(), {}});
  }
  return {};
}

Result<void> RegionRunner::create_buffers(gpu::Device& device, const std::string& name,
                                          std::size_t capacity) {
  const std::pair<gpu::Buffer*, gpu::BufferOptions> buffers[] = {
      {&records_,
       {.name = name + " regions",
        .size_bytes = capacity * sizeof(shared::RegionRecord),
        .memory = gpu::Memory::upload}},
      {&counts_,
       {.name = name + " counts",
        .size_bytes = capacity * sizeof(shared::RegionCount),
        .memory = gpu::Memory::readback}},
      {&ids_,
       {.name = name + " ids",
        .size_bytes = capacity * ids_per_region_ * 4,
        .memory = gpu::Memory::readback}},
  };
  for (const auto& [buffer, options] : buffers) {
    if (options.size_bytes == 0) continue;
    auto made = device.create_buffer(options);
    if (!made) return made.error();
    *buffer = std::move(made).value();
  }
  // What the device can not hold has been refused by now.
  entities_.resize(capacity * ids_per_region_);
  answers_.resize(capacity);
  incomplete_.reserve(capacity);
  return {};
}

RegionRunner::Kernels RegionRunner::solids() noexcept {
  return {&kernels_[0], &kernels_[1], ids_per_region_ > 0 ? &kernels_[2] : nullptr};
}

RegionRunner::Kernels RegionRunner::frusta() noexcept {
  return ids_per_region_ > 0 ? Kernels{nullptr, &kernels_[3], &kernels_[4]}
                             : Kernels{nullptr, &kernels_[2], nullptr};
}

Result<void> RegionRunner::bind(gpu::Device& device, const accel::GeometryPool& /*pool*/,
                                const accel::Tlas& tlas) {
  for (Kernel& kernel : kernels_) {
    kernel.bindings.clear();
    for (std::uint32_t slot = 0; slot < tlas.slots(); ++slot) {
      const gpu::Buffer* const buffers[] = {&tlas.nodes(slot), &tlas.instances(slot), &records_, &counts_,
                                            &ids_};
      auto made =
          device.create_bindings(kernel.pipeline, std::span(buffers).first(ids_per_region_ > 0 ? 5 : 4));
      if (!made) return made.error();
      kernel.bindings.push_back(std::move(made).value());
    }
  }
  return {};
}

void RegionRunner::record_warm_up(gpu::Recorder& recorder) noexcept {
  for (const Kernel& kernel : kernels_)
    recorder.dispatch(kernel.pipeline, kernel.bindings.front(), shared::RegionArgs{}, 1);
}

void RegionRunner::record(std::span<const std::uint32_t> order, std::uint32_t first_frustum,
                          const accel::TlasView& view, gpu::Recorder& recorder) noexcept {
  order_ = order;
  first_frustum_ = first_frustum;
  dispatch(static_cast<std::uint32_t>(order.size()), first_frustum, false, view, recorder);
}

void RegionRunner::dispatch(std::uint32_t count, std::uint32_t first_frustum, bool alone,
                            const accel::TlasView& view, gpu::Recorder& recorder) noexcept {
  const auto run = [&](const Kernel* kernel, std::uint32_t first, std::uint32_t end) {
    if (kernel == nullptr || first == end) return;
    const shared::RegionArgs args{.root = view.root,
                                  .count = end - first,
                                  .capacity = ids_per_region_,
                                  .alone = alone ? 1u : 0u,
                                  .first = first,
                                  .two = 2};
    recorder.dispatch(kernel->pipeline, kernel->bindings[view.slot], args,
                      alone ? end - first : (end - first + 63) / 64);
  };
  const bool still = view.window_begin == view.window_end;
  const Kernels of_solids = solids();
  run(still ? of_solids.still : of_solids.moving, 0, first_frustum);
  if (first_frustum < count) run(frusta().moving, first_frustum, count);
  if (ids_per_region_ == 0) return;
  recorder.barrier();
  run(of_solids.lowest, 0, first_frustum);
  if (first_frustum < count) run(frusta().lowest, first_frustum, count);
}

void RegionRunner::unpack(std::uint32_t count, const accel::TlasView& view) noexcept {
  incomplete_.clear();
  for (std::uint32_t i = 0; i < count; ++i) {
    unpack_answer(order_[i], i, view);
    if (answers_[order_[i]].incomplete) incomplete_.push_back(i);
  }
  answered_ = count;
}

void RegionRunner::record_again(const accel::TlasView& view, gpu::Recorder& recorder) noexcept {
  const auto all = records();
  for (std::uint32_t i = 0; i < incomplete_.size(); ++i)
    all[i] = all[incomplete_[i]];
  // Their places ascend, so the frusta are still the last.
  const auto first_frustum = std::ranges::lower_bound(incomplete_, first_frustum_) - incomplete_.begin();
  dispatch(static_cast<std::uint32_t>(incomplete_.size()), static_cast<std::uint32_t>(first_frustum), true,
           view, recorder);
}

void RegionRunner::unpack_again(const accel::TlasView& view) noexcept {
  for (std::uint32_t i = 0; i < incomplete_.size(); ++i)
    unpack_answer(order_[incomplete_[i]], i, view);
}

bool RegionRunner::truncated() const noexcept {
  return std::ranges::any_of(answers(),
                             [](const RegionAnswer& answer) { return answer.overflow || answer.incomplete; });
}

void RegionRunner::unpack_answer(std::uint32_t region, std::uint32_t place,
                                 const accel::TlasView& view) noexcept {
  const shared::RegionCount count = counts_.host_as<const shared::RegionCount>()[place];
  answers_[region] = {.entities = {},
                      .found = count.found,
                      .overflow = ids_per_region_ > 0 && count.found > ids_per_region_,
                      .incomplete = count.incomplete != 0};
  const std::uint32_t kept = std::min(count.found, ids_per_region_);
  if (kept == 0) return;
  const auto all_ids = ids_.host_as<const std::uint32_t>();
  const std::size_t begin = std::size_t{place} * ids_per_region_;
  const auto ids = all_ids.subspan(begin, kept);
  const auto entities = std::span(entities_).subspan(std::size_t{region} * ids_per_region_, kept);
  // Identities lie all over the memory, and the ids of the next region were written by another core: they are
  // called for before they are needed, which takes a quarter off.
  for (const std::uint32_t index : ids)
    __builtin_prefetch(&view.identities[index]);
  const auto next_ids = all_ids.subspan(std::min(begin + ids_per_region_, all_ids.size() - kept), kept);
  for (std::size_t k = 0; k < kept; k += 16)
    __builtin_prefetch(&next_ids[k]);
  std::size_t next = 0;
  id_order_.ascending(ids, [&](std::uint32_t index) { entities[next++] = view.identities[index].id; });
  // Of a search that was cut short an id may stand twice.
  answers_[region].entities = entities.first(next);
}

}  // namespace rtstdb::query
