#pragma once
// Searches of rays as a stage of a query: kernels, the choice of a kernel, and searches that pause and resume
// in a later dispatch. The rays and the hits are the query's.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "rtstdb/query/gpu_query.hpp"
#include "shaders/shared/query.h"

namespace rtstdb::query {

/// How the rays of a pass are searched.
struct RayPass {
  glm::uvec2 hits{0};  ///< address of the hits
  Faces faces = Faces::both;
  bool ignore_motion = false;  ///< RayQueryOptions::ignore_motion
  bool carried = false;        ///< some rays have a carrier
  bool coherent = false;       ///< see are_coherent; no answer depends on it
};

class RaySearch {
 public:
  /// `capacity`: rays of a pass.
  RaySearch(RayMode mode, std::uint32_t hits_per_ray, std::uint32_t capacity) noexcept
      : mode_(mode), hits_per_ray_(hits_per_ray), capacity_(capacity) {}

  /// Adds kernels and buffers; their names begin with `name`.
  void add_needs(DeviceNeeds& needs, const std::string& name, const gpu::DeviceLimits& limits);
  /// The bindings of each kernel that add_needs has added.
  std::vector<const gpu::Buffer*> bound_buffers(const gpu::Buffer& rays, std::uint32_t slot,
                                                const accel::GeometryPool& pool,
                                                const accel::Tlas& tlas) const;

  /// A pass over all rays begins.
  void begin() noexcept;
  /// Between passes. True: searches of the retry pass that ended have paused, and it is to be repeated.
  bool has_paused() noexcept;
  /// Another retry pass begins, of at most shared::paused_rays places.
  void begin_retries() noexcept { searched_contents_.fill(0); }
  std::uint32_t min_retry_batch(const gpu::DeviceLimits& limits) const noexcept;

  /// A dispatch: the number of its kernel in the query's needs, and its arguments.
  struct Dispatch {
    std::size_t kernel = 0;
    DispatchLayout layout;
    shared::RayArgs args;
  };
  /// The dispatch that searches a part. `retried`: the places of the retry pass.
  Dispatch dispatch(const BatchPart& part, std::span<const std::uint32_t> retried, const RayPass& pass,
                    const Recording& recording, const gpu::DeviceLimits& limits) noexcept;

  /// What kernels of other kinds write to leave a search incomplete (IncompleteBuffer in
  /// shaders/query/ray/ray_buffers.glsl).
  const gpu::Buffer& flags() const noexcept { return flags_; }

  /// Of the parts that are complete: some hit is marked incomplete; some hit may not have been written.
  /// A part in flight may raise them too early.
  bool some_incomplete() const noexcept;
  bool some_unanswered() const noexcept;

 private:
  void pack_retries(PlaceRange range, std::span<const std::uint32_t> retried,
                    const accel::TlasView& view) noexcept;
  std::size_t kernel_for(const RayPass& pass, const accel::TlasView& view) const noexcept;

  RayMode mode_;
  std::uint32_t hits_per_ray_, capacity_;
  std::size_t first_kernel_ = 0, kernel_count_ = 0;
  /// By place of the retry pass: the contents of the slot (TlasView::contents) that the paused search went
  /// through; 0: it begins.
  std::array<std::uint64_t, shared::paused_rays> searched_contents_{};
  /// Passes in which searches of the window began again, since their slot had other contents.
  std::uint32_t restarts_ = 0;
  bool some_restart_ = false;  // in the pass that runs
  gpu::Buffer retried_rays_, flags_, paused_;
};

}  // namespace rtstdb::query
