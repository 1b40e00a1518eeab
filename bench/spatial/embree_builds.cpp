#include "bench/spatial/embree_builds.hpp"

#include <glm/gtc/quaternion.hpp>
#include <glm/mat4x3.hpp>

#include <vector>

#include "bench/spatial/embree_handles.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

constexpr std::size_t instances_per_chunk = 1024;

/// Columns, one after the other.
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

}  // namespace hil::bench
