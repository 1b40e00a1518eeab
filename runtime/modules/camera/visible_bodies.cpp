#include "runtime/modules/camera/visible_bodies.hpp"

#include <algorithm>
#include <tuple>

namespace hil::modules {

VisibleBodies::VisibleBodies() : table_(table_size, no_body) {
  bodies_.reserve(max_bodies);
}

/// The place of the body in bodies_, which gets it if it is new; no_body: bodies_ is full.
std::uint32_t VisibleBodies::place_of(rtstdb::EntityId entity) noexcept {
  std::uint32_t slot = entity.index * 0x9E3779B1u % table_size;
  for (; table_[slot] != no_body; slot = (slot + 1) % table_size)
    if (bodies_[table_[slot]].entity == entity) return table_[slot];
  if (bodies_.size() == max_bodies) return no_body;
  table_[slot] = static_cast<std::uint32_t>(bodies_.size());
  bodies_.push_back({.entity = entity});
  return table_[slot];
}

void VisibleBodies::find(std::uint32_t width, std::span<const rtstdb::EntityId> entities,
                         std::span<const float> depth_m) noexcept {
  bodies_.clear();
  std::ranges::fill(table_, no_body);
  rtstdb::EntityId last{};
  std::uint32_t place = no_body;
  for (std::size_t pixel = 0; pixel < entities.size(); ++pixel) {
    const rtstdb::EntityId entity = entities[pixel];
    if (!entity.valid()) continue;
    if (entity != last) {
      place = place_of(entity);
      last = entity;
    }
    if (place == no_body) {
      ++ignored_pixels_;
      continue;
    }
    const auto x = static_cast<std::uint32_t>(pixel % width);
    const auto y = static_cast<std::uint32_t>(pixel / width);
    VisibleBody& body = bodies_[place];
    if (body.pixels++ == 0) {
      body = {entity, x, y, x + 1, y + 1, depth_m[pixel], 1};
      continue;
    }
    body.x_min = std::min(body.x_min, x);
    body.x_max = std::max(body.x_max, x + 1);
    body.y_max = y + 1;
    body.depth_m = std::min(body.depth_m, depth_m[pixel]);
  }
  std::ranges::sort(bodies_, [](const VisibleBody& a, const VisibleBody& b) {
    return std::tie(a.depth_m, a.entity.index) < std::tie(b.depth_m, b.entity.index);
  });
}

}  // namespace hil::modules
