#pragma once
// Computes distances of points to a geometry in the pool, from which its distance field is built
// (rtstdb/field/field_build.hpp).
//
// Threads: one. Setup.

#include <array>
#include <cstdint>
#include <span>

#include <rtstdb/field.hpp>

#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/submit.hpp"
#include "rtstdb/gpu/device.hpp"
#include "shaders/shared/field.h"

namespace rtstdb::accel {

class FieldSampler {
 public:
  /// The largest number of points of one call.
  static constexpr std::uint32_t max_points = 16384;

  /// Errors: out_of_memory, device_lost.
  static Result<FieldSampler> create(gpu::Device& device);

  /// Computes the distances of at most max_points points, with the sign that `sign` names; `none`: without.
  /// A search that visits too many nodes is repeated; its distance may be too large by a twentieth of it.
  /// `front_sign`: 1 if the fronts of a closed geometry are outside, else -1. `submit` has not begun.
  /// Errors: capacity, if a repeated search visits too many nodes; out_of_memory; device_lost.
  Result<void> sample(gpu::Device& device, const GeometryPool& pool, std::uint32_t geometry, FieldSign sign,
                      float front_sign, std::span<const shared::FieldPoint> points,
                      std::span<shared::FieldSample> samples, Submit& submit);

 private:
  enum PassIndex : std::size_t { distances_pass, winding_pass, ray_ratio_pass, pass_count };
  struct Pass {
    gpu::Pipeline pipeline;
    gpu::Bindings bindings;
  };
  Result<void> bind(gpu::Device& device, const GeometryPool& pool);
  /// Computes the first `count` of points_. False: the device is lost.
  bool run(shared::FieldArgs args, FieldSign sign, std::uint32_t count, std::uint32_t per_group,
           Submit& submit);

  std::array<Pass, pass_count> passes_;
  gpu::Buffer points_, samples_;
  std::uint32_t bound_generation_ = 0;
  bool bound_ = false;
};

/// 1 if the fronts of a closed mesh are outside, -1 if they are inside: by the sign of its volume.
float front_sign_of(const TriangleMesh& mesh) noexcept;

}  // namespace rtstdb::accel
