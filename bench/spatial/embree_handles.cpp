#include "bench/spatial/embree_handles.hpp"

#include <cstring>
#include <stdexcept>
#include <string>

#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

bool count_bytes(void* bytes, ssize_t change, bool /*already_done*/) {
  static_cast<EmbreeBytes*>(bytes)->fetch_add(change);
  return true;  // goes ahead
}

}  // namespace

std::string embree_version() {
  return "Embree " RTC_VERSION_STRING;
}

EmbreeDevice open_embree(EmbreeBytes* bytes) {
  EmbreeDevice device(rtcNewDevice(("threads=" + std::to_string(threads_per_side)).c_str()));
  if (device == nullptr) throw std::runtime_error("Embree gives no device");
  if (bytes != nullptr) rtcSetDeviceMemoryMonitorFunction(device.get(), count_bytes, bytes);
  return device;
}

void check_embree(RTCDevice device) {
  const RTCError error = rtcGetDeviceError(device);
  if (error != RTC_ERROR_NONE) throw std::runtime_error("Embree reports error " + std::to_string(error));
}

EmbreeGeometry embree_triangles(RTCDevice device, const rtstdb::TriangleMesh& mesh) {
  EmbreeGeometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
  void* const positions =
      rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(glm::vec3),
                              mesh.positions_m.size());
  void* const triangles = rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                  sizeof(glm::uvec3), mesh.triangles.size());
  check_embree(device);
  std::memcpy(positions, mesh.positions_m.data(), mesh.positions_m.size() * sizeof(glm::vec3));
  std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * sizeof(glm::uvec3));
  rtcCommitGeometry(geometry.get());
  return geometry;
}

EmbreeSceneHandle embree_mesh_scene(RTCDevice device, const rtstdb::TriangleMesh& mesh,
                                    RTCBuildQuality quality) {
  EmbreeSceneHandle scene(rtcNewScene(device));
  rtcSetSceneBuildQuality(scene.get(), quality);
  rtcAttachGeometry(scene.get(), embree_triangles(device, mesh).get());
  rtcCommitScene(scene.get());
  check_embree(device);
  return scene;
}

RTCRay embree_ray(const rtstdb::Ray& ray, float time) {
  RTCRay made;
  made.org_x = ray.origin_m.x;
  made.org_y = ray.origin_m.y;
  made.org_z = ray.origin_m.z;
  made.dir_x = ray.direction.x;
  made.dir_y = ray.direction.y;
  made.dir_z = ray.direction.z;
  made.tnear = ray.lambda_min;
  made.tfar = ray.lambda_max;
  made.time = time;
  made.mask = ~0u;
  made.id = 0;
  made.flags = 0;
  return made;
}

}  // namespace hil::bench
