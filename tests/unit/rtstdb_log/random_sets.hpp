#pragma once
// Random staged write sets of all kinds, with ids and values at their limits too.

#include <cmath>
#include <random>
#include <vector>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/row_check.hpp"
#include "rtstdb/store/motion_words.hpp"
#include "rtstdb/store/write_set.hpp"

namespace rtstdb::log::test {

class RandomSets {
 public:
  explicit RandomSets(std::uint64_t seed) : random_(seed) {}

  std::uint32_t below(std::uint32_t limit) { return static_cast<std::uint32_t>(random_() % limit); }

  EntityRow row() {
    EntityRow row;
    if (below(3) != 0) row.geometry = {below(max_geometries)};
    row.scale = {min_scale, 1.0 + below(9), max_scale};
    row.mask = static_cast<std::uint32_t>(random_());
    row.material = {static_cast<std::uint32_t>(random_() % rtstdb::max_materials)};
    if (below(2) == 0) row.light = {below(max_lights)};
    row.motion.p_world_m = {number(max_coordinate_m), -0.0, max_coordinate_m};
    row.motion.q_world = {number(1.0), number(1e-3), number(1e3), 1.0};
    row.motion.v_world_mps = {number(1e4), number(1e-300), 0.0};
    row.motion.w_world_radps = {number(1e3), 0.0, number(1.0)};
    row.motion.valid_from = world_time_ns(below(2) == 0 ? -max_world_time_ns : max_world_time_ns);
    return normalised(row);
  }

  /// A set that consists of one update_motion.
  store::WriteSet move() {
    store::WriteSet set{1 + random_() % 1000, world_time_ns(static_cast<std::int64_t>(random_() >> 2)), {}};
    const EntityId id{below(max_entities), static_cast<std::uint32_t>(random_())};
    set.writes.push_back({store::WriteKind::update_motion, {id, row(), set.version}});
    if (below(4) != 0) leave_out(set.writes.back());
    return set;
  }

  /// Its shapes point into this object.
  store::WriteSet set(std::uint32_t max_writes) {
    store::WriteSet set{1 + random_() % 1000, world_time_ns(static_cast<std::int64_t>(random_() >> 2)), {}};
    for (std::uint32_t k = below(max_writes + 1); k > 0; --k) {
      const auto kind = static_cast<store::WriteKind>(below(4));
      const EntityId id{below(max_entities), static_cast<std::uint32_t>(random_())};
      store::Write write{kind, {id, row(), set.version}};
      if (kind == store::WriteKind::update_motion && below(2) == 0) leave_out(write);
      set.writes.push_back(write);
    }
    shapes_.clear();
    shapes_.resize(set.writes.empty() ? 1 : below(3));
    for (std::vector<glm::vec3>& shape : shapes_) {
      for (std::uint32_t k = 1 + below(5); k > 0; --k)
        shape.emplace_back(static_cast<float>(number(1e5)), -0.0f, 1.0f);
      set.shapes.push_back({{below(max_geometries)}, shape.size(), shape.size(), shape});
    }
    return set;
  }

 private:
  void leave_out(store::Write& write) {
    write.unchanged = static_cast<std::uint16_t>(1 + below(store::all_motion_words));
    write.base_version_low = static_cast<std::uint16_t>(below(1 << 16));
    store::MotionWords words = store::words_of(write.state.row.motion);
    for (std::size_t k = 0; k < words.size(); ++k)
      if ((write.unchanged >> k & 1) != 0) words[k] = 0;
    write.state.row.motion = store::motion_of(words);
  }

  double number(double limit) { return std::uniform_real_distribution<double>(-limit, limit)(random_); }

  std::mt19937_64 random_;
  std::vector<std::vector<glm::vec3>> shapes_;
};

}  // namespace rtstdb::log::test
