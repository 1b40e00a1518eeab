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
  Result<void> move_to(gpu::Device& device) override { return runner_.move_to(device); }
  void leave_device() noexcept override { runner_.leave_device(); }
  Result<void> bind(gpu::Device& device, const accel::GeometryPool& pool, const accel::Tlas& tlas) override {
    return runner_.bind(device, pool, tlas);
  }
  void record_warm_up(gpu::Recorder& recorder) noexcept override { runner_.record_warm_up(recorder); }
  void begin_batch(std::uint32_t count) noexcept override;
  void record(PlaceRange range, const RowSource& rows, const accel::Tlas& tlas, const accel::TlasView& view,
              const HaltAt& halt, gpu::Recorder& recorder) noexcept override;
  void unpack(PlaceRange range, const accel::TlasView& view) noexcept override {
    runner_.unpack(range, view, fork_join());
  }
  std::uint32_t next_retry_batch() noexcept override { return runner_.next_retry_batch(); }
  std::uint32_t min_retry_batch() const noexcept override { return runner_.min_retry_batch(); }
  void record_again(PlaceRange range, const RowSource& rows, const accel::Tlas& tlas,
                    const accel::TlasView& view, const HaltAt& halt,
                    gpu::Recorder& recorder) noexcept override;
  void unpack_again(PlaceRange range, const accel::TlasView& view) noexcept override {
    runner_.unpack_again(range, view);
  }
  bool truncated() const noexcept override { return runner_.truncated(); }
  std::uint32_t answered() const noexcept override { return runner_.answered(); }
  std::uint32_t incomplete(std::uint32_t answered) const noexcept override {
    return runner_.incomplete(answered);
  }
  bool has_retries() const noexcept override { return runner_.has_retries(); }
  void publish_answers(std::uint32_t answered, std::uint32_t count) noexcept override {
    runner_.publish_answers(answered, count);
  }
  void discard_answers() noexcept override { runner_.discard_answers(); }
  const AnswerInfo& answer_info() const noexcept override { return info; }

 private:
  shared::RegionRecord packed(const Region& region, const accel::Tlas& tlas,
                              const accel::TlasView& view) const noexcept;

  RegionLevel level_ = RegionLevel::bounds;
  std::vector<Region> regions_;
  PointOrder point_order_;
  std::vector<std::uint32_t> order_;  // in which the device has the regions, kind after kind
  RegionRunner runner_;
};

}  // namespace rtstdb::query
