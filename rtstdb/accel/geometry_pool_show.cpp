// The pool's geometry that deforms: how it comes in, and how a version's shapes come to the device.

#include <algorithm>
#include <array>
#include <utility>

#include "rtstdb/accel/geometry_pool.hpp"

namespace rtstdb::accel {
namespace {

const Error lost{ErrorCode::device_lost, "the GPU stopped answering while a geometry was written"};

constexpr std::uint32_t aligned(std::uint32_t count) {
  constexpr std::uint32_t step = DeformingGeometry::alignment;
  return (count + step - 1) / step * step;
}

/// SplitMix64's finalizer.
constexpr std::uint64_t spread(std::uint64_t number) {
  number = (number ^ (number >> 30)) * 0xBF58476D1CE4E5B9u;
  number = (number ^ (number >> 27)) * 0x94D049BB133111EBu;
  return number ^ (number >> 31);
}

}  // namespace

Result<PoolPart> GeometryPool::add_deforming(gpu::Device& device, const TriangleMesh& mesh,
                                             const GeometryOptions& options, Submit& submit) {
  constexpr std::uint32_t places = DeformingGeometry::places;
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  const std::uint32_t alignment_loss = DeformingGeometry::alignment;
  if (auto room = check_room((places * count) + (places + 1) * alignment_loss); !room) return room.error();
  deforming_.reserve(deforming_.size() + 1);
  placings_.reserve(deforming_.size() + 1);
  const DeformingGeometry::Room room = DeformingGeometry::room_for(count);
  const BlasBuilder::Place first{aligned(node_count_), aligned(triangle_count_)};
  const BlasBuilder::Place second{first.node_base + room.nodes, first.leaf_base + room.triangles};
  const PoolPart part{first.node_base, second.node_base + room.nodes, first.leaf_base,
                      second.leaf_base + room.triangles};
  auto made = DeformingGeometry::create(device, GeometryId{count_}, mesh, options, {first, second});
  if (!made) return made.error();
  DeformingGeometry geometry = std::move(made).value();
  const auto built = builder_.build(device, mesh, submit);
  if (!built) return built.error();
  if (auto reserved = reserve(device, part, submit); !reserved) return reserved.error();
  if (auto bound = geometry.bind(device, refit_passes_, nodes_, triangles_); !bound) return bound.error();
  geometry.upload(mesh.positions_m);
  // The tree's cost, and the box, come out of a refit; and drivers compile at the first dispatch.
  for (std::size_t place = 0; place < places; ++place) {
    if (!builder_.write(geometry.at(place), nodes_, triangles_, submit) ||
        !builder_.write_order(geometry.order(place), submit))
      return lost;
    geometry.adopt_tree(place, builder_.levels());
    submit.begin();
    geometry.record_refit(place, refit_passes_, submit.recorder());
    if (!submit.run()) return lost;
    geometry.note_refit(place, 0, ++placing_count_);
  }
  const DeformingGeometry::Shown shown = geometry.shown();
  bounds_.push_back({});
  write_record(count_, extents_of(shown.bounds), shown.root, shown.closed);
  deforming_.push_back(std::move(geometry));
  builder_.keep_room_for(mesh.triangles.size(), mesh.positions_m.size());
  return part;
}

Result<void> GeometryPool::bind_deforming(gpu::Device& device) {
  for (DeformingGeometry& geometry : deforming_) {
    if (auto bound = geometry.bind(device, refit_passes_, nodes_, triangles_); !bound) return bound;
  }
  return {};
}

bool GeometryPool::show(gpu::Device& device, const store::RowSource& rows, Submit& submit) {
  if (!is_whole()) return false;
  placings_.clear();
  for (std::size_t i = 0; i < deforming_.size(); ++i) {
    DeformingGeometry& geometry = deforming_[i];
    const store::Shape shape = rows.shape(geometry.id());
    if (geometry.find(shape.version) != DeformingGeometry::places) continue;
    if (placings_.empty()) submit.begin();
    placings_.push_back({i, geometry.take_place(), shape.version});
    geometry.upload(shape.positions_m);
    geometry.record_refit(placings_.back().place, refit_passes_, submit.recorder());
  }
  if (!placings_.empty() && !submit.run()) return false;
  for (const Placing& placing : placings_) {
    DeformingGeometry& geometry = deforming_[placing.geometry];
    geometry.note_refit(placing.place, placing.shape, ++placing_count_);
    ++counts_.refits;
    if (geometry.wants_build(placing.place) && !build(device, geometry, placing, rows, submit)) return false;
  }
  // Of each set of places another number: refits are numbered, and a finalizer spreads the numbers over the word.
  shown_ = 0;
  for (const DeformingGeometry& geometry : deforming_) {
    const DeformingGeometry::Shown shown = geometry.shown();
    write_record(geometry.id().index, extents_of(shown.bounds), shown.root, shown.closed);
    shown_ += spread(shown.placing);
  }
  return true;
}

bool GeometryPool::pin(const store::RowSource& rows) noexcept {
  const auto refusing = std::ranges::find_if(deforming_, [&](DeformingGeometry& geometry) {
    return !geometry.pin(rows.shape(geometry.id()).version);
  });
  for (auto pinned = deforming_.begin(); refusing != deforming_.end() && pinned != refusing; ++pinned)
    pinned->unpin(rows.shape(pinned->id()).version);
  return refusing == deforming_.end();
}

void GeometryPool::unpin(const store::RowSource& rows) noexcept {
  for (DeformingGeometry& geometry : deforming_)
    geometry.unpin(rows.shape(geometry.id()).version);
}

bool GeometryPool::build(gpu::Device& device, DeformingGeometry& geometry, const Placing& placing,
                         const store::RowSource& rows, Submit& submit) {
  const std::vector<glm::uvec3>& triangles = geometry.triangles();
  // No room: a setup call could not get it back after a larger build. The old tree will do.
  if (!builder_.has_room_for(triangles.size(), geometry.position_count())) return true;
  const std::span positions_m = rows.shape(geometry.id()).positions_m;
  if (!builder_.build(device, {positions_m, triangles}, submit)) return false;
  if (!builder_.write(geometry.at(placing.place), nodes_, triangles_, submit) ||
      !builder_.write_order(geometry.order(placing.place), submit))
    return false;
  geometry.adopt_tree(placing.place, builder_.levels());
  submit.begin();
  geometry.record_refit(placing.place, refit_passes_, submit.recorder());
  if (!submit.run()) return false;
  geometry.note_refit(placing.place, placing.shape, ++placing_count_);
  ++counts_.builds;
  return true;
}

}  // namespace rtstdb::accel
