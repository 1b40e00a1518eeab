#pragma once
// Embree (package libembree-dev) as the peer: what its files share. Seen by embree_*.cpp only.

#include <embree3/rtcore.h>

#include <atomic>
#include <cstdint>
#include <memory>

#include <rtstdb/geometry.hpp>
#include <rtstdb/query.hpp>

#include "bench/spatial/embree_hit.hpp"

namespace hil::bench {

struct EmbreeRelease {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
  void operator()(RTCBVH tree) const { rtcReleaseBVH(tree); }
};
using EmbreeDevice = std::unique_ptr<RTCDeviceTy, EmbreeRelease>;
using EmbreeSceneHandle = std::unique_ptr<RTCSceneTy, EmbreeRelease>;
using EmbreeGeometry = std::unique_ptr<RTCGeometryTy, EmbreeRelease>;
using EmbreeTree = std::unique_ptr<RTCBVHTy, EmbreeRelease>;

/// What a device has allocated and not given back.
using EmbreeBytes = std::atomic<std::int64_t>;

/// With threads_per_side threads. `bytes` must outlive the device; null: nobody counts. Throws
/// std::runtime_error.
EmbreeDevice open_embree(EmbreeBytes* bytes = nullptr);
/// Throws std::runtime_error when any call on the device has failed since the last check.
void check_embree(RTCDevice device);
/// A copy of the mesh, committed.
EmbreeGeometry embree_triangles(RTCDevice device, const rtstdb::TriangleMesh& mesh);
/// One mesh that stands still, committed.
EmbreeSceneHandle embree_mesh_scene(RTCDevice device, const rtstdb::TriangleMesh& mesh,
                                    RTCBuildQuality quality);

/// `time` in [0, 1] of the scene's motion.
RTCRay embree_ray(const rtstdb::Ray& ray, float time);

}  // namespace hil::bench
