#pragma once
// The region shader with its buffers, used by the region and the overlap query: both ask which oriented
// bounds meet a box or a sphere at one instant.

#include <span>
#include <string>
#include <vector>

#include "rtstdb/query/gpu_query.hpp"
#include "rtstdb/query/id_order.hpp"
#include "shaders/shared/query.h"

namespace rtstdb::query {

class RegionRunner {
 public:
  static Result<RegionRunner> create(gpu::Device& device, const std::string& name, std::uint32_t capacity,
                                     std::uint32_t ids_per_region);
  Result<void> bind(gpu::Device& device, const accel::GeometryPool& pool, const accel::Tlas& tlas);

  std::span<shared::RegionRecord> records() const noexcept {
    return records_.host_as<shared::RegionRecord>();
  }
  void record_warm_up(gpu::Recorder& recorder) noexcept;
  /// Answers what stands in records(). `order`: whose record stands at each place.
  void record(std::span<const std::uint32_t> order, const accel::TlasView& view,
              gpu::Recorder& recorder) noexcept;
  void unpack(std::uint32_t count, const accel::TlasView& view) noexcept;
  bool has_incomplete() const noexcept { return !incomplete_.empty(); }
  void record_again(const accel::TlasView& view, gpu::Recorder& recorder) noexcept;
  void unpack_again(const accel::TlasView& view) noexcept;
  bool truncated() const noexcept;
  std::span<const RegionAnswer> answers() const noexcept { return {answers_.data(), answered_}; }

 private:
  /// One of the shaders, for regions that all ask at one instant and for others.
  struct Kernel {
    gpu::Pipeline still, moving;
    std::vector<gpu::Bindings> still_bindings, moving_bindings;  // one per slot
  };
  void dispatch(std::uint32_t count, bool alone, const accel::TlasView& view,
                gpu::Recorder& recorder) noexcept;
  /// The answer to the caller's region from what the device left at `place`.
  void unpack_answer(std::uint32_t region, std::uint32_t place, const accel::TlasView& view) noexcept;

  std::uint32_t ids_per_region_ = 0;
  std::uint32_t answered_ = 0;
  Kernel search_;
  Kernel lowest_;  // asks those again that found more than they have room for
  gpu::Buffer records_, counts_, ids_;
  std::span<const std::uint32_t> order_;  // the caller's region of each record
  IdOrder id_order_;
  std::vector<std::uint32_t> sorted_;  // ids of one region
  std::vector<EntityId> entities_;
  std::vector<RegionAnswer> answers_;
  std::vector<std::uint32_t> incomplete_;  // places to be asked again; has room for all
};

}  // namespace rtstdb::query
