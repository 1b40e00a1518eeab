#include "bench/spatial/our_structures.hpp"

#include <memory>
#include <numeric>
#include <optional>
#include <vector>

#include "bench/spatial/side_by_side.hpp"
#include "rtstdb/accel/tlas.hpp"
#include "shaders/shared/entity.h"
#include "shaders/shared/node.h"

namespace hil::bench {
namespace {

using namespace rtstdb;

std::shared_ptr<const TriangleMesh> shared(const TriangleMesh& mesh) {
  return std::make_shared<const TriangleMesh>(mesh);
}

/// Every row differs between versions.
class MovedRows final : public store::RowSource {
 public:
  explicit MovedRows(std::size_t count) : states_(count) {
    for (std::uint32_t i = 0; i < count; ++i)
      states_[i].id = {i, 1};
  }
  void place(std::span<const Pose> places, GeometryId geometry) {
    ++version_;
    for (std::size_t i = 0; i < states_.size(); ++i) {
      EntityRow& row = states_[i].row;
      row.geometry = geometry;
      row.motion.p_world_m = places[i].p_world_m;
      row.motion.q_world = places[i].q_world;
      row.motion.valid_from = time();
    }
  }

  Version version() const noexcept override { return version_; }
  WorldTime time() const noexcept override {
    return world_time_ns(static_cast<std::int64_t>(version_) * 1'000'000);
  }
  std::uint32_t index_limit() const noexcept override { return static_cast<std::uint32_t>(states_.size()); }
  const EntityState* row(std::uint32_t index) const noexcept override { return &states_[index]; }
  bool changed_between(Version, std::vector<std::uint32_t>& indices) const noexcept override {
    const std::size_t before = indices.size();
    indices.resize(before + states_.size());
    std::iota(indices.begin() + static_cast<std::ptrdiff_t>(before), indices.end(), 0u);
    return true;
  }
  store::Shape shape(GeometryId /*geometry*/) const noexcept override { return {}; }

 private:
  std::vector<EntityState> states_;
  Version version_ = 0;
};

constexpr std::size_t texel_bytes = 16;
constexpr std::size_t node_bytes = texel_bytes * shared::node_texels;

void demand_alive(bool alive) {
  if (!alive) throw std::runtime_error("the GPU stopped answering while a structure was built");
}

}  // namespace

struct OurTlas::Impl {
  Impl(std::size_t count, bool refits)
      : device(must(gpu::Device::open({}))),
        options{.max_entities = static_cast<std::uint32_t>(count), .refits = refits},
        submit(must(accel::Submit::create(*device))),
        pool(must(accel::GeometryPool::create(*device, 1, submit))),
        tlas(must(accel::Tlas::create(*device, options))),
        rows(count) {}

  std::unique_ptr<gpu::Device> device;
  accel::TlasOptions options;
  accel::Submit submit;
  accel::GeometryPool pool;
  accel::Tlas tlas;
  MovedRows rows;
  GeometryId geometry;
};

OurTlas::OurTlas(const TriangleMesh& mesh, std::span<const Pose> places, bool refits)
    : impl_(std::make_unique<Impl>(places.size(), refits)) {
  impl_->geometry = {must(impl_->pool.add(*impl_->device, shared(mesh), impl_->submit))};
  must(impl_->tlas.bind(*impl_->device, impl_->pool));
  impl_->submit.begin();
  impl_->tlas.record_warm_up(impl_->submit.recorder());
  demand_alive(impl_->submit.run());
  // Fills every slot, so that each has a previous version.
  for (std::uint32_t slot = 0; slot < impl_->tlas.slots(); ++slot) {
    place(places);
    update();
  }
}

OurTlas::~OurTlas() = default;

void OurTlas::place(std::span<const Pose> places) {
  impl_->rows.place(places, impl_->geometry);
}

double OurTlas::update() {
  const store::TimeSpan now{impl_->rows.time(), impl_->rows.time()};
  impl_->submit.begin();
  demand_alive(impl_->tlas.prepare(impl_->rows, {.times = now}, impl_->submit).has_value());
  demand_alive(impl_->submit.run());
  return static_cast<double>(impl_->submit.take_gpu_ns()) * 1e-9;
}

struct OurDeforming::Impl {
  /// No entities; one shape per version.
  struct OneShape final : store::RowSource {
    store::Shape newest;
    Version version() const noexcept override { return newest.version; }
    WorldTime time() const noexcept override { return {}; }
    std::uint32_t index_limit() const noexcept override { return 0; }
    const EntityState* row(std::uint32_t /*index*/) const noexcept override { return nullptr; }
    bool changed_between(Version, std::vector<std::uint32_t>& /*indices*/) const noexcept override {
      return true;
    }
    store::Shape shape(GeometryId /*geometry*/) const noexcept override { return newest; }
  };

  std::unique_ptr<gpu::Device> device = must(gpu::Device::open({}));
  accel::Submit submit = must(accel::Submit::create(*device));
  accel::GeometryPool pool = must(accel::GeometryPool::create(*device, 1, submit));
  OneShape shape;
};

OurDeforming::OurDeforming(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  must(impl_->pool.add(*impl_->device, shared(mesh), impl_->submit, {.deforms = true}));
}

OurDeforming::~OurDeforming() = default;

double OurDeforming::update(std::span<const glm::vec3> positions_m) {
  impl_->submit.take_gpu_ns();
  impl_->shape.newest = {impl_->shape.newest.version + 1, positions_m};
  demand_alive(impl_->pool.show(*impl_->device, impl_->shape, impl_->submit));
  return static_cast<double>(impl_->submit.take_gpu_ns()) * 1e-9;
}

std::uint64_t OurDeforming::builds() const {
  return impl_->pool.counts().builds;
}

std::size_t our_mesh_bytes(const TriangleMesh& mesh) {
  const auto device = must(gpu::Device::open({}));
  auto submit = must(accel::Submit::create(*device));
  auto pool = must(accel::GeometryPool::create(*device, 2, submit));
  const std::uint32_t first = must(pool.add(*device, shared(mesh), submit));
  const std::uint32_t second = must(pool.add(*device, shared(make_box(glm::dvec3(1.0))), submit));
  // The structures lie one after the other.
  const auto records = pool.geometries().host_as<shared::GeometryRecord>();
  const std::size_t nodes = records[second].root - records[first].root;
  return nodes * node_bytes + mesh.triangles.size() * texel_bytes * shared::triangle_texels;
}

std::size_t our_version_bytes(std::uint32_t entities) {
  const auto device = must(gpu::Device::open({}));
  const accel::TlasOptions options{.max_entities = entities, .slots = 1};
  const accel::Tlas tlas = must(accel::Tlas::create(*device, options));
  std::size_t bytes = sizeof(shared::EntityRecord) * entities;
  for (const gpu::Buffer* buffer : {&tlas.instances(0), &tlas.nodes(0), &tlas.centers(0),
                                    &tlas.still_bounds(0), &tlas.identity_texels(0), &tlas.places(0)})
    bytes += buffer->size_bytes();
  return bytes;
}

}  // namespace hil::bench
