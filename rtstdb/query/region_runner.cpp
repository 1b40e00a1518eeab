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
  auto pipeline = device.create_pipeline(gpu::ShaderId::region);
  if (!pipeline) return pipeline.error();
  runner.pipeline_ = std::move(pipeline).value();
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
  runner.answers_.resize(capacity);
  runner.incomplete_.reserve(capacity);
  return runner;
}

Result<void> RegionRunner::bind(gpu::Device& device, const accel::GeometryPool& /*pool*/,
                                const accel::Tlas& tlas) {
  bindings_.clear();
  for (std::uint32_t slot = 0; slot < tlas.slots(); ++slot) {
    const gpu::Buffer* buffers[] = {&tlas.nodes(slot), &tlas.instances(slot), &records_, &counts_, &ids_};
    auto bindings = device.create_bindings(pipeline_, buffers);
    if (!bindings) return bindings.error();
    bindings_.push_back(std::move(bindings).value());
  }
  return {};
}

void RegionRunner::record_warm_up(gpu::Recorder& recorder) noexcept {
  recorder.dispatch(pipeline_, bindings_.front(), shared::RegionArgs{}, 1);
}

void RegionRunner::record(std::uint32_t count, const accel::TlasView& view,
                          gpu::Recorder& recorder) noexcept {
  dispatch(count, false, view, recorder);
}

void RegionRunner::dispatch(std::uint32_t count, bool alone, const accel::TlasView& view,
                            gpu::Recorder& recorder) noexcept {
  const shared::RegionArgs args{
      .root = view.root, .count = count, .capacity = ids_per_region_, .alone = alone ? 1u : 0u, .two = 2};
  recorder.dispatch(pipeline_, bindings_[view.slot], args, alone ? count : (count + 63) / 64);
}

void RegionRunner::unpack(std::uint32_t count, const accel::TlasView& view) noexcept {
  incomplete_.clear();
  for (std::uint32_t i = 0; i < count; ++i) {
    unpack_answer(i, i, view);
    if (answers_[i].incomplete) incomplete_.push_back(i);
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
    unpack_answer(incomplete_[i], i, view);
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
  for (std::uint32_t k = 0; k < kept; ++k)
    entities[k] = view.identities[ids[k]].id;
  std::ranges::sort(entities, {}, &EntityId::index);
  answers_[region] = {.entities = entities,
                      .found = count.found,
                      .overflow = count.found > ids_per_region_,
                      .incomplete = count.incomplete != 0};
}

}  // namespace rtstdb::query
