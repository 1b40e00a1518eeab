#pragma once
// The overlap query on the GPU: a region query whose box is the entity's own oriented bounds, carried by the
// entity.

#include <vector>

#include "rtstdb/query/region_runner.hpp"

namespace rtstdb::query {

class GpuOverlapQuery final : public OverlapQuery, public GpuQuery {
 public:
  ~GpuOverlapQuery() override { leave(); }

  static Result<std::unique_ptr<GpuOverlapQuery>> create(gpu::Device& device,
                                                         const OverlapQueryOptions& options);

  std::span<Overlap> overlaps() noexcept override { return overlaps_; }
  std::span<const OverlapAnswer> answers() const noexcept override { return runner_.answers(); }

  QueryKind kind() const noexcept override { return QueryKind::overlap; }
  std::uint32_t capacity() const noexcept override { return static_cast<std::uint32_t>(overlaps_.size()); }
  std::optional<BadInput> check(std::uint32_t count, const RowSource& rows,
                                TimeSpan& times) const noexcept override;
  Result<void> move_to(gpu::Device& device) override { return runner_.move_to(device); }
  void leave_device() noexcept override { runner_.leave_device(); }
  Result<void> bind(gpu::Device& device, const accel::GeometryPool& pool, const accel::Tlas& tlas) override;
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
  shared::RegionRecord packed(const Overlap& overlap, const RowSource& rows, const accel::Tlas& tlas,
                              const accel::TlasView& view) const noexcept;

  std::vector<Overlap> overlaps_;
  std::vector<std::uint32_t> order_;  // as they come
  RegionRunner runner_;
  const accel::GeometryPool* pool_ = nullptr;
};

}  // namespace rtstdb::query
