#pragma once
// The cone query on the GPU: shaders/query/cone/cone.comp searches the entities, cone_fractions.comp
// distributes the beam among them. Returns are written where the caller reads them.

#include <span>
#include <vector>

#include "rtstdb/query/gpu_query.hpp"

namespace rtstdb::query {

class GpuConeQuery final : public ConeQuery, public GpuQuery {
 public:
  /// The options have passed check_cone_options.
  explicit GpuConeQuery(const ConeQueryOptions& options);
  ~GpuConeQuery() override { leave(); }

  std::span<Cone> cones() noexcept override { return cones_; }
  std::span<const ConeReturn> returns() const noexcept override {
    return return_memory_[slots().read()].as<const ConeReturn>().first(std::size_t{slots().readable()} *
                                                                       options_.returns_per_cone);
  }
  const AnswerInfo& answer_info() const noexcept override { return info; }

  CostClass cost_class() const noexcept override {
    if (options_.mode == ConeMode::fast)
      return options_.fractions ? CostClass::cone_fast_fractions : CostClass::cone_fast;
    return options_.fractions ? CostClass::cone_fractions : CostClass::cone;
  }
  std::optional<BadInput> check(std::uint32_t count, const RowSource& rows,
                                TimeSpan& times) const noexcept override;
  void record(const BatchPart& part, const Recording& recording) noexcept override;

  /// Allocates what the caller reads and writes. Called after the first move_to, which refuses a query that
  /// the device can not hold.
  void allocate_host_memory();

 private:
  DeviceNeeds device_needs(const gpu::DeviceLimits& limits) override;
  std::vector<const gpu::Buffer*> bound_buffers(gpu::ShaderId shader, std::uint32_t slot,
                                                const accel::GeometryPool& pool,
                                                const accel::Tlas& tlas) const override;
  void unpack(const BatchPart& part, const accel::TlasView& view) noexcept override;
  bool is_incomplete(std::uint32_t cone) const noexcept override {
    return written_returns(cone).front().status == HitStatus::incomplete;
  }
  void mark_incomplete(std::uint32_t cone) noexcept override;

  std::span<ConeReturn> written_returns(std::uint32_t cone) const noexcept {
    return return_memory_[slots().written()].as<ConeReturn>().subspan(
        std::size_t{cone} * options_.returns_per_cone, options_.returns_per_cone);
  }
  void pack(std::uint32_t record, std::uint32_t cone, const Recording& recording) noexcept;
  /// Makes the returns that the device has written for these cones visible to the host.
  void pull(std::uint32_t first_cone, std::uint32_t end_cone) const noexcept;
  /// False: the device left the search incomplete.
  bool unpack_answer(std::uint32_t cone) noexcept;

  ConeQueryOptions options_;
  std::vector<Cone> cones_;
  std::vector<gpu::HostMemory> return_memory_;  // one per answer slot
  gpu::Buffer records_, counts_;
  gpu::Buffer contacts_;              // fractions
  std::vector<gpu::Buffer> returns_;  // one per answer slot
};

}  // namespace rtstdb::query
