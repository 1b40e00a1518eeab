#include "bench/spatial/embree_scene.hpp"

#include "bench/spatial/embree_handles.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

constexpr std::size_t rays_per_chunk = 4096;

}  // namespace

struct EmbreeScene::Impl {
  EmbreeBytes bytes = 0;
  EmbreeDevice device = open_embree(&bytes);
  EmbreeSceneHandle scene;
};

EmbreeScene::EmbreeScene(const rtstdb::TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  impl_->scene = embree_mesh_scene(impl_->device.get(), mesh, RTC_BUILD_QUALITY_MEDIUM);
}

EmbreeScene::~EmbreeScene() = default;

std::size_t EmbreeScene::bytes() const {
  return static_cast<std::size_t>(impl_->bytes.load());
}

void EmbreeScene::closest(std::span<const rtstdb::Ray> rays, std::span<PeerHit> hits) const {
  over_chunks(rays.size(), rays_per_chunk, [&](std::size_t begin, std::size_t end) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (std::size_t i = begin; i < end; ++i) {
      RTCRayHit one;
      one.ray = embree_ray(rays[i], 0.0f);
      one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(impl_->scene.get(), &context, &one);
      hits[i] =
          one.hit.geomID == RTC_INVALID_GEOMETRY_ID ? PeerHit{} : PeerHit{one.ray.tfar, one.hit.primID, 0};
    }
  });
}

void EmbreeScene::any(std::span<const rtstdb::Ray> rays, std::span<PeerHit> hits) const {
  over_chunks(rays.size(), rays_per_chunk, [&](std::size_t begin, std::size_t end) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (std::size_t i = begin; i < end; ++i) {
      RTCRay ray = embree_ray(rays[i], 0.0f);
      rtcOccluded1(impl_->scene.get(), &context, &ray);
      hits[i] = ray.tfar < 0.0f ? PeerHit{0.0f, 0, 0} : PeerHit{};
    }
  });
}

}  // namespace hil::bench
