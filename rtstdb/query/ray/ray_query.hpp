#pragma once
// The ray query on the GPU. The device reads rays and writes hits where the caller has them
// (shaders/query/ray/ray_buffers.glsl), so nothing is packed or unpacked.

#include <span>
#include <vector>

#include "rtstdb/query/gpu_query.hpp"
#include "rtstdb/query/ray/ray_search.hpp"

namespace rtstdb::query {

class GpuRayQuery final : public RayQuery, public GpuQuery {
 public:
  /// The options have passed check_ray_options.
  explicit GpuRayQuery(const RayQueryOptions& options);
  ~GpuRayQuery() override { leave(); }

  std::span<Ray> rays() noexcept override { return ray_memory_.as<Ray>(); }
  std::span<const RayHit> hits() const noexcept override {
    return hit_memory_[slots().read()].as<const RayHit>().first(std::size_t{slots().readable()} *
                                                                options_.hits_per_ray);
  }
  const AnswerInfo& answer_info() const noexcept override { return info; }

  CostClass cost_class() const noexcept override;
  std::optional<BadInput> check(std::uint32_t count, const RowSource& rows,
                                TimeSpan& times) const noexcept override;
  std::uint32_t next_retry_batch() noexcept override;
  std::uint32_t min_retry_batch() const noexcept override { return search_.min_retry_batch(limits()); }
  void record(const BatchPart& part, const Recording& recording) noexcept override;

 private:
  DeviceNeeds device_needs(const gpu::DeviceLimits& limits) override;
  std::vector<const gpu::Buffer*> bound_buffers(gpu::ShaderId shader, std::uint32_t slot,
                                                const accel::GeometryPool& pool,
                                                const accel::Tlas& tlas) const override;
  void initialize_buffers() noexcept override;
  void order_batch(std::uint32_t /*count*/) noexcept override { search_.begin(); }
  void unpack(const BatchPart& part, const accel::TlasView& view) noexcept override;
  bool is_incomplete(std::uint32_t ray) const noexcept override {
    return written_hits()[std::size_t{ray} * options_.hits_per_ray].status == HitStatus::incomplete;
  }
  void mark_incomplete(std::uint32_t ray) noexcept override;

  std::span<RayHit> written_hits() const noexcept { return hit_memory_[slots().written()].as<RayHit>(); }
  /// Fetches the hits of these rays from a device that does not write host memory.
  void pull(std::uint32_t first_ray, std::uint32_t end_ray) const noexcept;

  RayQueryOptions options_;
  // What check found in the batch that is recorded next.
  mutable bool carried_ = false;
  mutable bool coherent_ = false;
  RaySearch search_;
  gpu::HostMemory ray_memory_;               // the caller's spans
  std::vector<gpu::HostMemory> hit_memory_;  // one per answer slot
  gpu::Buffer rays_;
  std::vector<gpu::Buffer> hits_;  // one per answer slot
};

}  // namespace rtstdb::query
