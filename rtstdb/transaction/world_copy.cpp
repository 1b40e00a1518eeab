#include "rtstdb/transaction/world_copy.hpp"

#include <algorithm>
#include <variant>

#include <rtstdb/result.hpp>

namespace rtstdb::transaction {
namespace {

constexpr std::uint32_t rows_per_step = 512;
constexpr std::uint32_t growth_per_attempt = 16;
constexpr int attempts_in_slices = 3;

}  // namespace

void WorldCopy::add(const log::LoggedGeometry& geometry, std::size_t positions) {
  const std::lock_guard lock(known_mutex_);
  RTSTDB_ASSERT(geometry.id.index == known_.size(), "the geometry is not the next one of the log");
  known_.push_back({geometry, geometry.options.deforms ? positions : 0});
  copying_.geometries_known.store(known_.size(), std::memory_order_relaxed);
}

std::vector<log::LoggedGeometry> WorldCopy::geometries() const {
  const std::lock_guard lock(known_mutex_);
  std::vector<log::LoggedGeometry> geometries;
  for (const Known& known : known_)
    geometries.push_back(known.logged);
  return geometries;
}

void WorldCopy::add(const log::LoggedMaterial& material) {
  const std::lock_guard lock(known_mutex_);
  known_materials_.push_back(material);
  copying_.materials_known.store(known_materials_.size(), std::memory_order_relaxed);
}

void WorldCopy::add(const log::LoggedLight& light) {
  const std::lock_guard lock(known_mutex_);
  known_lights_.push_back(light);
  copying_.lights_known.store(known_lights_.size(), std::memory_order_relaxed);
}

// ---- the log's thread

void WorldCopy::allocate() {
  copying_.states.assign(copying_.max_entities, {});
  copying_.geometries.clear();
  copying_.shapes.clear();
  const std::lock_guard lock(known_mutex_);
  copying_.materials = known_materials_;
  copying_.lights = known_lights_;
  for (const Known& known : known_) {
    copying_.geometries.push_back(known.logged);
    copying_.shapes.push_back({0, std::vector<glm::vec3>(known.positions)});
  }
}

std::optional<log::WorldHead> WorldCopy::begin(Version) {
  if (!copying_.given) {
    allocate();
    copying_.begin_anew();
    copying_.attempts_ = 0;
    copying_.given = true;
    taker_->take_job(copying_);
  }
  if (!copying_.is_done()) return std::nullopt;
  copying_.given = false;
  if (copying_.outdated) return std::nullopt;
  log::WorldHead head;
  head.version = copying_.version;
  head.next_version = copying_.next_version;
  head.index_limit = copying_.index_limit;
  head.geometries = copying_.geometries;
  head.materials = copying_.materials;
  head.lights = copying_.lights;
  return head;
}

bool WorldCopy::rows(std::uint32_t first, std::span<EntityState> states) {
  std::ranges::copy(std::span(copying_.states).subspan(first, states.size()), states.begin());
  return true;
}

bool WorldCopy::shape(GeometryId geometry, Shape& shape) {
  shape = copying_.shapes[geometry.index];
  return true;
}

void WorldCopy::end() noexcept {
  copying_.states = {};
  copying_.shapes = {};
}

// ---- the engine thread

bool WorldCopy::Copying::still_kept(const store::Store& store) const noexcept {
  const auto found = store.read(ReadAt::pinned(version.version), store::ReadFor::rows_and_shapes);
  return std::holds_alternative<store::Snapshot>(found);
}

bool WorldCopy::Copying::restart(const store::Store& store) noexcept {
  outdated = geometries_known.load(std::memory_order_relaxed) != geometries.size() ||
             materials_known.load(std::memory_order_relaxed) != materials.size() ||
             lights_known.load(std::memory_order_relaxed) != lights.size();
  version = store.latest();
  next_version = store.next_version();
  index_limit = store.latest_snapshot().index_limit();
  ++attempts_;
  next_index_ = 0;
  next_shape_ = 0;
  return !outdated;
}

bool WorldCopy::Copying::step(const store::Store& store) noexcept {
  if (attempts_ == 0 || !still_kept(store)) {
    if (!restart(store)) return true;
  }
  const store::Snapshot snapshot(store, version);
  const bool in_slices = attempts_ <= attempts_in_slices;
  std::uint32_t rows = rows_per_step;
  for (int attempt = 1; attempt < attempts_ && in_slices; ++attempt)
    rows *= growth_per_attempt;
  const std::uint32_t end = in_slices ? std::min(index_limit, next_index_ + rows) : index_limit;
  for (; next_index_ < end; ++next_index_)
    states[next_index_] = snapshot.slot(next_index_);
  for (; next_index_ == index_limit && next_shape_ < shapes.size(); ++next_shape_) {
    copy_shape(snapshot, next_shape_);
    if (in_slices && !shapes[next_shape_].positions_m.empty()) {
      ++next_shape_;
      break;
    }
  }
  return next_index_ == index_limit && next_shape_ == shapes.size();
}

void WorldCopy::Copying::copy_shape(const store::Snapshot& snapshot, std::size_t geometry) noexcept {
  Shape& shape = shapes[geometry];
  if (shape.positions_m.empty()) return;
  const store::Shape found = snapshot.shape({static_cast<std::uint32_t>(geometry)});
  shape.version = found.version;
  std::ranges::copy(found.positions_m, shape.positions_m.begin());
}

}  // namespace rtstdb::transaction
