#include "rtstdb/query/region_runner.hpp"

#include <algorithm>
#include <span>

#include <rtstdb/limits.hpp>

namespace rtstdb::query {

Result<RegionRunner> RegionRunner::create(gpu::Device& device, const std::string& name,
                                          std::uint32_t capacity, std::uint32_t ids_per_region) {
  if (capacity == 0 || capacity > max_regions_per_query || ids_per_region == 0 ||
      ids_per_region > max_ids_per_region) {
    return Error{ErrorCode::capacity, "query '" + name + "' asks for " + std::to_string(capacity) +
                                          " regions of " + std::to_string(ids_per_region) + " ids; 1 to " +
                                          std::to_string(max_regions_per_query) + " regions of 1 to " +
                                          std::to_string(max_ids_per_region) + " are possible"};
  }
  RegionRunner runner;
  runner.ids_per_region_ = ids_per_region;
  using enum gpu::ShaderId;
  const std::pair<gpu::Pipeline*, gpu::ShaderId> pipelines[] = {
      {&runner.search_.still, region},
      {&runner.search_.moving, region_moving},
      {&runner.lowest_.still, region_lowest},
      {&runner.lowest_.moving, region_lowest_moving},
  };
  for (const auto& [pipeline, shader] : pipelines) {
    auto made = device.create_pipeline(shader);
    if (!made) return made.error();
    *pipeline = std::move(made).value();
  }
  const std::pair<gpu::Buffer*, gpu::BufferOptions> buffers[] = {
      {&runner.records_,
       {.name = name + " regions",
        .size_bytes = capacity * sizeof(shared::RegionRecord),
        .memory = gpu::Memory::upload}},
      {&runner.counts_,
       {.name = name + " counts",
        .size_bytes = capacity * sizeof(shared::RegionCount),
        .memory = gpu::Memory::readback}},
      {&runner.ids_,
       {.name = name + " ids",
        .size_bytes = std::size_t{capacity} * ids_per_region * 4,
        .memory = gpu::Memory::readback}},
  };
  for (const auto& [buffer, options] : buffers) {
    auto made = device.create_buffer(options);
    if (!made) return made.error();
    *buffer = std::move(made).value();
  }
  // What the device can not hold has been refused by now.
  runner.entities_.resize(std::size_t{capacity} * ids_per_region);
  runner.sorted_.resize(ids_per_region);
  runner.answers_.resize(capacity);
  runner.incomplete_.reserve(capacity);
  return runner;
}

Result<void> RegionRunner::bind(gpu::Device& device, const accel::GeometryPool& /*pool*/,
                                const accel::Tlas& tlas) {
  const auto bind_to_slots = [&](const gpu::Pipeline& pipeline,
                                 std::vector<gpu::Bindings>& bindings) -> Result<void> {
    bindings.clear();
    for (std::uint32_t slot = 0; slot < tlas.slots(); ++slot) {
      const gpu::Buffer* buffers[] = {&tlas.nodes(slot), &tlas.instances(slot), &records_, &counts_, &ids_};
      auto made = device.create_bindings(pipeline, buffers);
      if (!made) return made.error();
      bindings.push_back(std::move(made).value());
    }
    return {};
  };
  for (Kernel* const kernel : {&search_, &lowest_}) {
    if (auto bound = bind_to_slots(kernel->still, kernel->still_bindings); !bound) return bound;
    if (auto bound = bind_to_slots(kernel->moving, kernel->moving_bindings); !bound) return bound;
  }
  return {};
}

void RegionRunner::record_warm_up(gpu::Recorder& recorder) noexcept {
  for (const Kernel* const kernel : {&search_, &lowest_}) {
    recorder.dispatch(kernel->still, kernel->still_bindings.front(), shared::RegionArgs{}, 1);
    recorder.dispatch(kernel->moving, kernel->moving_bindings.front(), shared::RegionArgs{}, 1);
  }
}

void RegionRunner::record(std::span<const std::uint32_t> order, const accel::TlasView& view,
                          gpu::Recorder& recorder) noexcept {
  order_ = order;
  dispatch(static_cast<std::uint32_t>(order.size()), false, view, recorder);
}

void RegionRunner::dispatch(std::uint32_t count, bool alone, const accel::TlasView& view,
                            gpu::Recorder& recorder) noexcept {
  const shared::RegionArgs args{
      .root = view.root, .count = count, .capacity = ids_per_region_, .alone = alone ? 1u : 0u, .two = 2};
  const bool moving = view.window_begin != view.window_end;
  const auto run = [&](const Kernel& kernel) {
    recorder.dispatch(moving ? kernel.moving : kernel.still,
                      (moving ? kernel.moving_bindings : kernel.still_bindings)[view.slot], args,
                      alone ? count : (count + 63) / 64);
  };
  run(search_);
  recorder.barrier();
  run(lowest_);
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
  dispatch(static_cast<std::uint32_t>(incomplete_.size()), true, view, recorder);
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
  const auto ids = ids_.host_as<const std::uint32_t>().subspan(std::size_t{place} * ids_per_region_);
  const std::uint32_t kept = std::min(count.found, ids_per_region_);
  const auto entities = std::span(entities_).subspan(std::size_t{region} * ids_per_region_, kept);
  const auto sorted = std::span(sorted_).first(kept);
  std::ranges::copy(ids.first(kept), sorted.begin());
  id_order_.sort(sorted);
  std::ranges::transform(sorted, entities.begin(),
                         [&](std::uint32_t index) { return view.identities[index].id; });
  answers_[region] = {.entities = entities,
                      .found = count.found,
                      .overflow = count.found > ids_per_region_,
                      .incomplete = count.incomplete != 0};
}

}  // namespace rtstdb::query
