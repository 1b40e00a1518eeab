#pragma once
// Embree (package libembree-dev) as a peer: what the embree_*.cpp files share, and no others include.

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

/// The memory that a device currently has allocated.
using EmbreeBytes = std::atomic<std::int64_t>;

/// Opens a device with threads_per_side threads. `bytes` counts its memory and must outlive it; null: no
/// count. Throws std::runtime_error.
EmbreeDevice open_embree(EmbreeBytes* bytes = nullptr);
/// Throws std::runtime_error if any call on the device has failed since the last check.
void check_embree(RTCDevice device);
/// A copy of the mesh, committed.
EmbreeGeometry embree_triangles(RTCDevice device, const rtstdb::TriangleMesh& mesh);
/// One static mesh, committed.
EmbreeSceneHandle embree_mesh_scene(RTCDevice device, const rtstdb::TriangleMesh& mesh,
                                    RTCBuildQuality quality);

/// `time` in [0, 1] over the motion of the scene.
RTCRay embree_ray(const rtstdb::Ray& ray, float time);

}  // namespace hil::bench
