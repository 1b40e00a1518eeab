#pragma once
// The nearest query on the GPU. shaders/query/nearest/nearest.comp searches, nearest_sign.comp gives distances their
// sign.

#include <vector>

#include "rtstdb/query/gpu_query.hpp"
#include "rtstdb/query/late_policy.hpp"
#include "rtstdb/query/point_order.hpp"

namespace rtstdb::query {

class GpuNearestQuery final : public NearestQuery, public GpuQuery {
 public:
  ~GpuNearestQuery() override { leave(); }

  static Result<std::unique_ptr<GpuNearestQuery>> create(gpu::Device& device,
                                                         const NearestQueryOptions& options);

  std::span<Nearest> points() noexcept override { return points_; }
  std::span<const NearestAnswer> answers() const noexcept override {
    return {answers_[places_.read()].data(), places_.readable()};
  }
  const AnswerInfo& answer_info() const noexcept override { return info; }

  QueryKind kind() const noexcept override { return QueryKind::nearest; }
  std::uint32_t capacity() const noexcept override { return options_.capacity; }
  std::optional<BadInput> check(std::uint32_t count, const RowSource& rows,
                                TimeSpan& times) const noexcept override;
  Result<void> move_to(gpu::Device& device) override;
  void leave_device() noexcept override;
  Result<void> bind(gpu::Device& device, const accel::GeometryPool& pool, const accel::Tlas& tlas) override;
  void record_warm_up(gpu::Recorder& recorder) noexcept override;
  void begin_batch(std::uint32_t count) noexcept override;
  void record(PlaceRange range, const RowSource& rows, const accel::Tlas& tlas, const accel::TlasView& view,
              const HaltAt& halt, gpu::Recorder& recorder) noexcept override;
  void unpack(PlaceRange range, const accel::TlasView& view) noexcept override;
  std::uint32_t next_retry_batch() noexcept override {
    return static_cast<std::uint32_t>(incomplete_.size()) - settled_;
  }
  std::uint32_t min_retry_batch() const noexcept override { return groups_at_once(processors_); }
  void record_again(PlaceRange range, const RowSource& rows, const accel::Tlas& tlas,
                    const accel::TlasView& view, const HaltAt& halt,
                    gpu::Recorder& recorder) noexcept override;
  void unpack_again(PlaceRange range, const accel::TlasView& view) noexcept override;
  bool truncated() const noexcept override { return incomplete(answered_) > 0; }
  std::uint32_t answered() const noexcept override { return answered_; }
  std::uint32_t incomplete(std::uint32_t answered) const noexcept override;
  bool has_retries() const noexcept override { return settled_ < incomplete_.size(); }
  void publish_answers(std::uint32_t answered, std::uint32_t count) noexcept override;
  void discard_answers() noexcept override { places_.discard_answers(); }

 private:
  Result<void> create_pipelines(gpu::Device& device);
  Result<void> create_buffers(gpu::Device& device);
  /// The neighbors of one point.
  std::span<const Neighbor> neighbors_at(std::uint32_t place) const noexcept {
    return neighbor_memory_[places_.written()].as<const Neighbor>().subspan(std::size_t{place} * options_.k,
                                                                            options_.k);
  }
  /// To the record at `at`.
  void pack(std::uint32_t at, std::uint32_t place, const accel::Tlas& tlas,
            const accel::TlasView& view) noexcept;
  void dispatch(PlaceRange range, bool alone, const accel::TlasView& view, const HaltAt& halt,
                gpu::Recorder& recorder) noexcept;
  /// To the point at that place. False: the device did not come to an end with it.
  bool take_answer(std::uint32_t place) noexcept;

  NearestQueryOptions options_;
  std::vector<Nearest> points_;
  std::uint32_t answered_ = 0;
  std::uint32_t processors_ = 0;  // see DeviceLimits
  AnswerPlaces places_;
  PointOrder order_;                       // in which the device has the points
  std::vector<std::uint32_t> incomplete_;  // places to be asked again; has room for all
  std::uint32_t settled_ = 0;              // of them, those that have been asked again
  gpu::Pipeline search_, still_, sign_;    // still_: of centres alone; sign_: of signed queries alone
  std::vector<gpu::HostMemory>
      neighbor_memory_;  // of each place; the answers look into it: it stays where it is
  // In the device's order; k neighbors for each point.
  gpu::Buffer point_records_, counts_;
  std::vector<gpu::Buffer> neighbors_;                                           // of each place
  std::vector<std::vector<NearestAnswer>> answers_;                              // in each place
  std::vector<gpu::Bindings> search_bindings_, still_bindings_, sign_bindings_;  // one per slot
};

}  // namespace rtstdb::query
