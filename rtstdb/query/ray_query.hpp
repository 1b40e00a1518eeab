#pragma once
// The ray query on the GPU. shaders/query/ray.glsl traces; this packs and unpacks.

#include <vector>

#include "rtstdb/query/gpu_query.hpp"

namespace rtstdb::query {

class GpuRayQuery final : public RayQuery, public GpuQuery {
 public:
  static Result<std::unique_ptr<GpuRayQuery>> create(gpu::Device& device, const RayQueryOptions& options);

  std::span<Ray> rays() noexcept override { return rays_; }
  std::span<const RayHit> hits() const noexcept override { return {hits_.data(), answered_}; }

  QueryKind kind() const noexcept override {
    return options_.mode == RayMode::any ? QueryKind::ray_any : QueryKind::ray_closest;
  }
  std::uint32_t capacity() const noexcept override { return options_.capacity; }
  std::optional<BadInput> check(std::uint32_t count, const RowSource& rows,
                                TimeSpan& times) const noexcept override;
  Result<void> bind(gpu::Device& device, const accel::GeometryPool& pool, const accel::Tlas& tlas) override;
  void record_warm_up(gpu::Recorder& recorder) noexcept override;
  void record(std::uint32_t count, const RowSource& rows, const accel::Tlas& tlas,
              const accel::TlasView& view, gpu::Recorder& recorder) noexcept override;
  void unpack(std::uint32_t count, const accel::TlasView& view) noexcept override;
  bool has_incomplete() const noexcept override { return !incomplete_.empty(); }
  void record_again(const accel::TlasView& view, gpu::Recorder& recorder) noexcept override;
  void unpack_again(const accel::TlasView& view) noexcept override;
  bool truncated() const noexcept override { return truncated_; }

 private:
  void dispatch(std::uint32_t count, bool alone, const accel::TlasView& view,
                gpu::Recorder& recorder) noexcept;
  /// The answer to the caller's ray from the device's record at `place`.
  void unpack_hit(std::uint32_t ray, std::uint32_t place, const accel::TlasView& view) noexcept;

  RayQueryOptions options_;
  std::vector<Ray> rays_;
  std::vector<RayHit> hits_;
  std::uint32_t answered_ = 0;
  bool truncated_ = false;
  std::vector<std::uint32_t> incomplete_;  // rays to be asked again; has room for all
  gpu::Pipeline pipeline_;
  gpu::Buffer ray_records_, hit_records_;
  std::vector<gpu::Bindings> bindings_;  // one per slot
};

}  // namespace rtstdb::query
