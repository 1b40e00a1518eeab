#include "bench/spatial/embree_instances.hpp"

#include <vector>

#include "bench/spatial/embree_handles.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

constexpr std::size_t rays_per_chunk = 4096;

RTCQuaternionDecomposition decomposed(const rtstdb::EntityRow& row, rtstdb::WorldTime t) {
  const rtstdb::Pose pose = rtstdb::pose_at(row.motion, t);
  const glm::vec3 place_m(pose.p_world_m), scale(row.scale);
  const glm::quat q(pose.q_world);
  RTCQuaternionDecomposition made;
  rtcInitQuaternionDecomposition(&made);
  rtcQuaternionDecompositionSetQuaternion(&made, q.w, q.x, q.y, q.z);
  rtcQuaternionDecompositionSetScale(&made, scale.x, scale.y, scale.z);
  rtcQuaternionDecompositionSetTranslation(&made, place_m.x, place_m.y, place_m.z);
  return made;
}

}  // namespace

struct EmbreeInstances::Impl {
  Window window;
  std::int64_t mesh_bytes = 0;
  EmbreeBytes bytes = 0;
  EmbreeDevice device = open_embree(&bytes);
  std::vector<EmbreeSceneHandle> meshes;
  EmbreeSceneHandle scene;
};

EmbreeInstances::EmbreeInstances(std::span<const rtstdb::TriangleMesh> meshes,
                                 std::span<const rtstdb::EntityRow> rows, const Window& window)
    : impl_(std::make_unique<Impl>()) {
  RTCDevice const device = impl_->device.get();
  impl_->window = window;
  for (const rtstdb::TriangleMesh& mesh : meshes)
    impl_->meshes.push_back(embree_mesh_scene(device, mesh, RTC_BUILD_QUALITY_MEDIUM));
  impl_->mesh_bytes = impl_->bytes.load();
  impl_->scene.reset(rtcNewScene(device));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const EmbreeGeometry instance(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE));
    rtcSetGeometryInstancedScene(instance.get(), impl_->meshes[rows[i].geometry.index].get());
    rtcSetGeometryTimeStepCount(instance.get(), 2);
    const RTCQuaternionDecomposition first = decomposed(rows[i], window.begin);
    const RTCQuaternionDecomposition last = decomposed(rows[i], window.end);
    rtcSetGeometryTransformQuaternion(instance.get(), 0, &first);
    rtcSetGeometryTransformQuaternion(instance.get(), 1, &last);
    rtcCommitGeometry(instance.get());
    rtcAttachGeometryByID(impl_->scene.get(), instance.get(), static_cast<unsigned>(i));
  }
  rtcCommitScene(impl_->scene.get());
  check_embree(device);
}

EmbreeInstances::~EmbreeInstances() = default;

std::size_t EmbreeInstances::bytes() const {
  return static_cast<std::size_t>(impl_->bytes.load() - impl_->mesh_bytes);
}

void EmbreeInstances::closest(std::span<const rtstdb::Ray> rays, std::span<PeerHit> hits) const {
  const double window_s = rtstdb::seconds_between(impl_->window.begin, impl_->window.end);
  over_chunks(rays.size(), rays_per_chunk, [&](std::size_t begin, std::size_t end) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (std::size_t i = begin; i < end; ++i) {
      const double since_begin_s = rtstdb::seconds_between(impl_->window.begin, rays[i].t);
      RTCRayHit one;
      one.ray = embree_ray(rays[i], static_cast<float>(since_begin_s / window_s));
      one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(impl_->scene.get(), &context, &one);
      hits[i] = one.hit.geomID == RTC_INVALID_GEOMETRY_ID
                    ? PeerHit{}
                    : PeerHit{one.ray.tfar, one.hit.primID, one.hit.instID[0]};
    }
  });
}

}  // namespace hil::bench
