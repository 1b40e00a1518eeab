#include "bench/spatial/embree_builds.hpp"

#include <glm/gtc/quaternion.hpp>
#include <glm/mat4x3.hpp>

#include <cstring>
#include <vector>

#include "bench/spatial/embree_handles.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

constexpr std::size_t instances_per_chunk = 1024;

/// Stored by columns.
using Matrix = glm::mat4x3;

Matrix matrix_of(const rtstdb::Pose& pose) {
  const glm::mat3 turn(glm::mat3_cast(pose.q_world));
  return {turn[0], turn[1], turn[2], glm::vec3(pose.p_world_m)};
}

}  // namespace

struct EmbreeTlas::Impl {
  EmbreeDevice device = open_embree();
  EmbreeSceneHandle mesh;
  EmbreeSceneHandle scene;
  std::vector<EmbreeGeometry> instances;
  std::vector<Matrix> matrices;
};

EmbreeTlas::EmbreeTlas(const rtstdb::TriangleMesh& mesh, std::span<const rtstdb::Pose> places,
                       Quality quality)
    : impl_(std::make_unique<Impl>()) {
  RTCDevice const device = impl_->device.get();
  impl_->mesh = embree_mesh_scene(device, mesh, RTC_BUILD_QUALITY_MEDIUM);
  impl_->scene.reset(rtcNewScene(device));
  const bool refit = quality == Quality::refit;
  rtcSetSceneBuildQuality(impl_->scene.get(), refit ? RTC_BUILD_QUALITY_MEDIUM : RTC_BUILD_QUALITY_LOW);
  for (std::size_t i = 0; i < places.size(); ++i) {
    EmbreeGeometry instance(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE));
    if (refit) rtcSetGeometryBuildQuality(instance.get(), RTC_BUILD_QUALITY_REFIT);
    rtcSetGeometryInstancedScene(instance.get(), impl_->mesh.get());
    rtcAttachGeometryByID(impl_->scene.get(), instance.get(), static_cast<unsigned>(i));
    impl_->instances.push_back(std::move(instance));
  }
  place(places);
  update();
  check_embree(device);
}

EmbreeTlas::~EmbreeTlas() = default;

void EmbreeTlas::place(std::span<const rtstdb::Pose> places) {
  impl_->matrices.clear();
  for (const rtstdb::Pose& pose : places)
    impl_->matrices.push_back(matrix_of(pose));
}

void EmbreeTlas::update() {
  over_chunks(impl_->instances.size(), instances_per_chunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      RTCGeometry const instance = impl_->instances[i].get();
      rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, &impl_->matrices[i][0][0]);
      rtcCommitGeometry(instance);
    }
  });
  rtcCommitScene(impl_->scene.get());
}

struct EmbreeBlas::Impl {
  EmbreeDevice device = open_embree();
  EmbreeSceneHandle scene;
};

EmbreeBlas::EmbreeBlas() : impl_(std::make_unique<Impl>()) {}

EmbreeBlas::~EmbreeBlas() = default;

void EmbreeBlas::build(const rtstdb::TriangleMesh& mesh) {
  impl_->scene = embree_mesh_scene(impl_->device.get(), mesh, RTC_BUILD_QUALITY_MEDIUM);
}

struct EmbreeDeforming::Impl {
  EmbreeDevice device = open_embree();
  EmbreeSceneHandle scene;
  EmbreeGeometry mesh;
};

EmbreeDeforming::EmbreeDeforming(const rtstdb::TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  RTCDevice const device = impl_->device.get();
  impl_->scene.reset(rtcNewScene(device));
  // The quality of a geometry has an effect only in scenes of low quality.
  rtcSetSceneBuildQuality(impl_->scene.get(), RTC_BUILD_QUALITY_LOW);
  rtcSetSceneFlags(impl_->scene.get(), RTC_SCENE_FLAG_DYNAMIC);
  impl_->mesh = embree_triangles(device, mesh);
  rtcSetGeometryBuildQuality(impl_->mesh.get(), RTC_BUILD_QUALITY_REFIT);
  rtcCommitGeometry(impl_->mesh.get());
  rtcAttachGeometry(impl_->scene.get(), impl_->mesh.get());
  rtcCommitScene(impl_->scene.get());
  check_embree(device);
}

EmbreeDeforming::~EmbreeDeforming() = default;

void EmbreeDeforming::update(std::span<const glm::vec3> positions_m) {
  RTCGeometry const mesh = impl_->mesh.get();
  std::memcpy(rtcGetGeometryBufferData(mesh, RTC_BUFFER_TYPE_VERTEX, 0), positions_m.data(),
              positions_m.size_bytes());
  rtcUpdateGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0);
  rtcCommitGeometry(mesh);
  rtcCommitScene(impl_->scene.get());
}

}  // namespace hil::bench
