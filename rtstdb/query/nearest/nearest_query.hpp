#pragma once
// The nearest query on the GPU: shaders/query/nearest/nearest.comp searches, nearest_sign.comp gives
// distances their sign.

#include <span>
#include <vector>

#include "rtstdb/query/gpu_query.hpp"
#include "rtstdb/query/point_order.hpp"

namespace rtstdb::query {

class GpuNearestQuery final : public NearestQuery, public GpuQuery {
 public:
  /// The options have been checked.
  explicit GpuNearestQuery(const NearestQueryOptions& options);
  ~GpuNearestQuery() override { leave(); }

  std::span<Nearest> points() noexcept override { return points_; }
  std::span<const NearestAnswer> answers() const noexcept override {
    return {answers_[slots().read()].data(), slots().readable()};
  }
  const AnswerInfo& answer_info() const noexcept override { return info; }

  CostClass cost_class() const noexcept override { return CostClass::nearest; }
  std::optional<BadInput> check(std::uint32_t count, const RowSource& rows,
                                TimeSpan& times) const noexcept override;
  void record(const BatchPart& part, const Recording& recording) noexcept override;

  /// Allocates what the caller reads and writes. After the first move_to, which refuses what the device can
  /// not hold.
  void allocate_host_memory();

 private:
  DeviceNeeds device_needs(const gpu::DeviceLimits& limits) override;
  std::vector<const gpu::Buffer*> bound_buffers(gpu::ShaderId shader, std::uint32_t slot,
                                                const accel::GeometryPool& pool,
                                                const accel::Tlas& tlas) const override;
  void order_batch(std::uint32_t count) noexcept override;
  void unpack(const BatchPart& part, const accel::TlasView& view) noexcept override;
  bool is_incomplete(std::uint32_t place) const noexcept override { return written_answer(place).incomplete; }
  void mark_incomplete(std::uint32_t place) noexcept override {
    written_answer(place) = {.neighbors = {}, .incomplete = true};
  }

  NearestAnswer& written_answer(std::uint32_t place) noexcept {
    return answers_[slots().written()][order_.last()[place]];
  }
  const NearestAnswer& written_answer(std::uint32_t place) const noexcept {
    return answers_[slots().written()][order_.last()[place]];
  }
  /// Packs the point at a place to a record.
  void pack(std::uint32_t record, std::uint32_t place, const Recording& recording) noexcept;
  /// `per_place`: invocations for each of the part's places.
  void dispatch_part(const Kernel& kernel, const BatchPart& part, std::uint32_t per_place,
                     const Recording& recording) const noexcept;
  /// Fetches the neighbors at these places from a device that does not write host memory.
  void pull(std::uint32_t first_place, std::uint32_t end_place) const noexcept;
  /// False: the device left the search at that place incomplete.
  bool unpack_answer(std::uint32_t place) noexcept;

  NearestQueryOptions options_;
  std::vector<Nearest> points_;
  PointOrder order_;
  std::vector<gpu::HostMemory>
      neighbor_memory_;  // one per answer slot, in the device's order, k for each point
  std::vector<std::vector<NearestAnswer>> answers_;  // one per answer slot; they refer to neighbor_memory_
  gpu::Buffer records_, counts_;
  std::vector<gpu::Buffer> neighbors_;  // one per answer slot
};

}  // namespace rtstdb::query
