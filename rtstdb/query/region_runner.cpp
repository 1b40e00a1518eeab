#include "rtstdb/query/region_runner.hpp"

#include <algorithm>

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
  runner.entities_.resize(std::size_t{capacity} * ids_per_region);
  runner.answers_.resize(capacity);
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
  return runner;
}

Result<void> RegionRunner::bind(gpu::Device& device, const accel::GeometryPool& pool,
                                const accel::Tlas& tlas) {
  bindings_.clear();
  for (std::uint32_t slot = 0; slot < tlas.slots(); ++slot) {
    const gpu::Buffer* buffers[] = {&pool.nodes(), &tlas.instances(slot), &records_, &counts_, &ids_};
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
  const shared::RegionArgs args{.root = view.root, .count = count, .capacity = ids_per_region_};
  recorder.dispatch(pipeline_, bindings_[view.slot], args, (count + 63) / 64);
}

bool RegionRunner::unpack(std::uint32_t count, const RowSource& rows) noexcept {
  const auto counts = counts_.host_as<const shared::RegionCount>();
  const auto ids = ids_.host_as<const std::uint32_t>();
  bool truncated = false;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::size_t base = std::size_t{i} * ids_per_region_;
    const std::uint32_t kept = std::min(counts[i].found, ids_per_region_);
    for (std::uint32_t k = 0; k < kept; ++k)
      entities_[base + k] = rows.row(ids[base + k])->id;
    std::sort(entities_.begin() + base, entities_.begin() + base + kept);
    answers_[i] = {.entities = {entities_.data() + base, kept},
                   .found = counts[i].found,
                   .overflow = counts[i].found > ids_per_region_,
                   .incomplete = counts[i].incomplete != 0};
    truncated = truncated || answers_[i].overflow || answers_[i].incomplete;
  }
  answered_ = count;
  return truncated;
}

}  // namespace rtstdb::query
