#include "runtime/modules/laser_scanner/object_list.hpp"

#include <glm/geometric.hpp>

#include <algorithm>

namespace hil::modules {
namespace {

/// Below this speed a body has no direction; its length is then its longer horizontal extent.
constexpr double standing_mps = 0.3;

double seconds(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<double>(to_ns - from_ns) * 1e-9;
}

}  // namespace

ObjectList::ObjectList(const Options& options) : options_(options), slots_(options.max_objects) {
  open_.reserve(options.max_open);
}

void ObjectList::add(rtstdb::EntityId entity, std::uint32_t column, std::int64_t time_ns,
                     const glm::dvec3& p_world_m, const glm::dvec3& v_world_mps) noexcept {
  auto found =
      std::find_if(open_.begin(), open_.end(), [&](const Open& open) { return open.entity == entity; });
  if (found == open_.end()) {
    if (open_.size() == options_.max_open) {
      ++ignored_hits_;
      return;
    }
    Open fresh;
    fresh.entity = entity;
    fresh.reference_ns = time_ns;
    fresh.low_m = glm::dvec3(1e300);
    fresh.high_m = glm::dvec3(-1e300);
    fresh.along_low_m = 1e300;
    fresh.along_high_m = -1e300;
    open_.push_back(fresh);
    found = open_.end() - 1;
  }
  const glm::dvec3 p = p_world_m - v_world_mps * seconds(found->reference_ns, time_ns);
  found->low_m = glm::min(found->low_m, p);
  found->high_m = glm::max(found->high_m, p);
  const double speed = glm::length(v_world_mps);
  if (speed > standing_mps) {
    const double along = glm::dot(p, v_world_mps) / speed;
    found->along_low_m = std::min(found->along_low_m, along);
    found->along_high_m = std::max(found->along_high_m, along);
  }
  found->velocity_sum += v_world_mps;
  found->last_column = column;
  ++found->hits;
}

void ObjectList::close(const Open& open, std::int64_t time_ns, const glm::dvec3& near_m) noexcept {
  if (open.hits < options_.min_hits) return;
  ScannedObject object;
  object.entity = open.entity;
  object.time_ns = time_ns;
  object.velocity_mps = open.velocity_sum / static_cast<double>(open.hits);
  object.center_m =
      0.5 * (open.low_m + open.high_m) + object.velocity_mps * seconds(open.reference_ns, time_ns);
  const glm::dvec3 extent = open.high_m - open.low_m;
  object.length_m = open.along_high_m >= open.along_low_m ? open.along_high_m - open.along_low_m
                                                          : std::max(extent.x, extent.y);
  object.hits = open.hits;

  auto slot =
      std::find_if(slots_.begin(), slots_.end(), [&](const auto& s) { return s.entity == object.entity; });
  if (slot == slots_.end())
    slot = std::find_if(slots_.begin(), slots_.end(), [](const auto& s) { return !s.entity.valid(); });
  if (slot == slots_.end()) {
    const auto distance = [&](const ScannedObject& o) { return glm::distance(o.center_m, near_m); };
    slot = std::max_element(slots_.begin(), slots_.end(),
                            [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
    if (distance(*slot) <= distance(object)) return;
  }
  *slot = object;
}

void ObjectList::advance(std::uint32_t column, std::int64_t time_ns, const glm::dvec3& near_m) noexcept {
  const auto passed = [&](const Open& open) { return open.last_column + options_.gap_columns < column; };
  for (const Open& open : open_) {
    if (passed(open)) close(open, time_ns, near_m);
  }
  open_.erase(std::remove_if(open_.begin(), open_.end(), passed), open_.end());
}

void ObjectList::end_sweep(std::int64_t time_ns, const glm::dvec3& near_m) noexcept {
  for (const Open& open : open_)
    close(open, time_ns, near_m);
  open_.clear();
}

void ObjectList::forget(std::int64_t time_ns) noexcept {
  for (ScannedObject& slot : slots_) {
    if (slot.entity.valid() && time_ns - slot.time_ns > options_.keep_ns) slot = {};
  }
}

}  // namespace hil::modules
