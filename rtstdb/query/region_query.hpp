#pragma once
// The region query on the GPU.

#include <vector>

#include "rtstdb/query/point_order.hpp"
#include "rtstdb/query/region_runner.hpp"

namespace rtstdb::query {

class GpuRegionQuery final : public RegionQuery, public GpuQuery {
 public:
  ~GpuRegionQuery() override { leave(); }

  static Result<std::unique_ptr<GpuRegionQuery>> create(gpu::Device& device,
                                                        const RegionQueryOptions& options);

  std::span<Region> regions() noexcept override { return regions_; }
  std::span<const RegionAnswer> answers() const noexcept override { return runner_.answers(); }

  QueryKind kind() const noexcept override;
  std::uint32_t capacity() const noexcept override { return static_cast<std::uint32_t>(regions_.size()); }
  std::optional<BadInput> check(std::uint32_t count, const RowSource& rows,
                                TimeSpan& times) const noexcept override;
  Result<void> bind(gpu::Device& device, const accel::GeometryPool& pool, const accel::Tlas& tlas) override {
    return runner_.bind(device, pool, tlas);
  }
  void record_warm_up(gpu::Recorder& recorder) noexcept override { runner_.record_warm_up(recorder); }
  void record(std::uint32_t count, const RowSource& rows, const accel::Tlas& tlas,
              const accel::TlasView& view, gpu::Recorder& recorder) noexcept override;
  void unpack(std::uint32_t count, const accel::TlasView& view) noexcept override {
    runner_.unpack(count, view);
  }
  bool has_incomplete() const noexcept override { return runner_.has_incomplete(); }
  void record_again(const accel::TlasView& view, gpu::Recorder& recorder) noexcept override {
    runner_.record_again(view, recorder);
  }
  void unpack_again(const accel::TlasView& view) noexcept override { runner_.unpack_again(view); }
  bool truncated() const noexcept override { return runner_.truncated(); }

 private:
  /// Fills order_ with the first `count` regions, kind after kind.
  RegionKindEnds arrange(std::uint32_t count) noexcept;

  RegionLevel level_ = RegionLevel::bounds;
  std::vector<Region> regions_;
  PointOrder point_order_;
  std::vector<std::uint32_t> order_;  // in which the device has the regions
  RegionRunner runner_;
};

}  // namespace rtstdb::query
