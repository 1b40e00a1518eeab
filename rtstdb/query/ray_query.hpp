#pragma once
// The ray query on the GPU. The caller's spans are what the device reads and writes: shaders/query/ray/ray_buffers.glsl reads
// rays and writes hits as they lie; this checks and dispatches.

#include <array>
#include <limits>
#include <vector>

#include "rtstdb/query/gpu_query.hpp"
#include "rtstdb/query/late_policy.hpp"
#include "shaders/shared/query.h"

namespace rtstdb::query {

class GpuRayQuery final : public RayQuery, public GpuQuery {
 public:
  ~GpuRayQuery() override { leave(); }

  static Result<std::unique_ptr<GpuRayQuery>> create(gpu::Device& device, const RayQueryOptions& options);

  std::span<Ray> rays() noexcept override { return ray_memory_.as<Ray>(); }
  std::span<const RayHit> hits() const noexcept override {
    return hit_memory_[places_.read()].as<const RayHit>().first(std::size_t{places_.readable()} *
                                                                options_.hits_per_ray);
  }
  const AnswerInfo& answer_info() const noexcept override { return info; }

  QueryKind kind() const noexcept override {
    switch (options_.mode) {
      case RayMode::any:
        return QueryKind::ray_any;
      case RayMode::first:
        return QueryKind::ray_first;
      case RayMode::closest:
        break;
    }
    return QueryKind::ray_closest;
  }
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
  std::uint32_t next_retry_batch() noexcept override;
  std::uint32_t min_retry_batch() const noexcept override;
  void record_again(PlaceRange range, const RowSource& rows, const accel::Tlas& tlas,
                    const accel::TlasView& view, const HaltAt& halt,
                    gpu::Recorder& recorder) noexcept override;
  void unpack_again(PlaceRange range, const accel::TlasView& view) noexcept override;
  bool truncated() const noexcept override { return incomplete(answered_) > 0; }
  std::uint32_t answered() const noexcept override { return answered_; }
  std::uint32_t incomplete(std::uint32_t answered) const noexcept override;
  bool has_retries() const noexcept override;
  void publish_answers(std::uint32_t answered, std::uint32_t count) noexcept override;
  void discard_answers() noexcept override { places_.discard_answers(); }

 private:
  struct Kernel {
    gpu::ShaderId shader;
    gpu::Pipeline pipeline;
    std::vector<gpu::Bindings> bindings;  // one per slot
  };

  /// `moving`: not all rays stand in the world and ask at one instant. Where there are fewer kernels, the one that
  /// answers the same.
  const Kernel& kernel_for(bool moving, std::uint32_t entities) const noexcept;
  /// The one that goes on with a search.
  const Kernel& kernel_that_pauses() const noexcept { return kernels_[1 % kernels_.size()]; }
  /// In pieces where the device runs fewer groups at once. `again`: the places are those of `again_`.
  void dispatch(PlaceRange range, bool again, const RowSource& rows, const accel::TlasView& view,
                const HaltAt& halt, gpu::Recorder& recorder) noexcept;
  bool is_incomplete(std::uint32_t ray) const noexcept {
    return hit_memory_[places_.written()]
               .as<const RayHit>()[std::size_t{ray} * options_.hits_per_ray]
               .status == HitStatus::incomplete;
  }
  Result<void> create_buffers(gpu::Device& device);
  void pull(std::uint32_t first_ray, std::uint32_t end_ray) const noexcept;
  /// What check has seen so far, on one of its threads.
  struct Seen {
    TimeSpan times;
    bool carried = false;
    std::uint32_t first_fault = std::numeric_limits<std::uint32_t>::max();
  };
  void look_at(PlaceRange range, const RowSource& rows, Seen& seen) const noexcept;
  std::optional<BadInput> fault_of(std::uint32_t element, const RowSource& rows) const noexcept;

  RayQueryOptions options_;
  std::uint32_t answered_ = 0;
  AnswerPlaces places_;
  // What check saw in the batch that is recorded next.
  mutable bool carried_ = false;
  mutable bool side_by_side_ = false;
  std::vector<std::uint32_t> incomplete_;  // rays to be asked again; has room for all
  std::uint32_t settled_ = 0;              // of them, those of which nothing is left to be asked
  std::uint32_t window_ = 0;               // so many behind those are asked again now,
  std::array<std::uint64_t, shared::paused_rays>
      searched_{};  // and what their searches go through (TlasView::contents); 0: they begin
  std::uint32_t restarts_ =
      0;  // passes in which some of those began again, since what they went through was gone
  bool some_restart_ = false;  // in the pass under way
  gpu::DeviceLimits limits_;
  std::vector<Kernel> kernels_;
  gpu::HostMemory ray_memory_;               // the caller's spans: they stay where they are
  std::vector<gpu::HostMemory> hit_memory_;  // of each place
  gpu::Buffer rays_, again_, some_incomplete_, paused_;
  std::vector<gpu::Buffer> hits_;  // of each place
};

}  // namespace rtstdb::query
