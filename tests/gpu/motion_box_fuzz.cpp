#include "tests/gpu/motion_box_fuzz.hpp"

#include <glm/common.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "rtstdb/geometry/motion_bounds.hpp"
#include "shaders/shared/node.h"

namespace rtstdb::test {
namespace {

constexpr std::size_t node_words = 4 * shared::tlas_node_texels;

/// The box of a child at a fraction of the window, exactly.
WorldBox box_at(std::span<const std::uint32_t> node, std::uint32_t slot, double share) {
  WorldBox box;
  for (int axis = 0; axis < 3; ++axis) {
    const auto edge = [&](std::size_t texel, std::size_t pair) {
      const std::uint32_t word = node[4 * (texel + static_cast<std::size_t>(axis)) + pair + slot / 4];
      return static_cast<double>(word >> (8 * (slot % 4)) & 0xFFu);
    };
    const double origin_m = std::bit_cast<float>(node[static_cast<std::size_t>(axis)]);
    const double quantum_m = std::ldexp(1.0, static_cast<int>(node[3] >> (8 * axis) & 0xFFu) - 127);
    const auto mixed = [&](std::size_t pair) {
      return origin_m + quantum_m * (edge(1, pair) + share * (edge(6, pair) - edge(1, pair)));
    };
    box.minimum_m[axis] = mixed(0);
    box.maximum_m[axis] = mixed(2);
  }
  return box;
}

glm::dvec3 quanta_m(std::span<const std::uint32_t> node) {
  const auto quantum_m = [&](int axis) {
    return std::ldexp(1.0, static_cast<int>(node[3] >> (8 * axis) & 0xFFu) - 127);
  };
  return {quantum_m(0), quantum_m(1), quantum_m(2)};
}

/// The recorded overhang of oriented bounds over the boxes of the children.
glm::dvec3 overhang_m(std::span<const std::uint32_t> node) {
  const auto along = [&](std::size_t axis) {
    return static_cast<double>(std::bit_cast<float>(node[36 + axis]));
  };
  return {along(0), along(1), along(2)};
}

WorldBox grown(const WorldBox& box, const glm::dvec3& by_m) {
  return {box.minimum_m - by_m, box.maximum_m + by_m};
}

bool contains(const WorldBox& box, const glm::dvec3& point_m) {
  for (int axis = 0; axis < 3; ++axis) {
    if (point_m[axis] < box.minimum_m[axis] || point_m[axis] > box.maximum_m[axis]) return false;
  }
  return true;
}

glm::dvec3 corner_of(const Bounds& bounds, int corner) {
  return {corner & 1 ? bounds.maximum_m.x : bounds.minimum_m.x,
          corner & 2 ? bounds.maximum_m.y : bounds.minimum_m.y,
          corner & 4 ? bounds.maximum_m.z : bounds.minimum_m.z};
}

/// The smallest box that contains the triangles of an entity by its extents, exactly.
WorldBox box_within(const Extents& extents, const glm::dvec3& scale, const Pose& pose,
                    const WorldBox& around) {
  const glm::dmat3 to_world = glm::mat3_cast(pose.q_world);
  const glm::dvec3 center_m = 0.5 * (around.minimum_m + around.maximum_m);
  WorldBox box;
  for (int axis = 0; axis < 3; ++axis) {
    const glm::dvec3 u = scale * glm::dvec3(to_world[0][axis], to_world[1][axis], to_world[2][axis]);
    box.minimum_m[axis] = std::max(around.minimum_m[axis], center_m[axis] - extent_along(extents, -u));
    box.maximum_m[axis] = std::min(around.maximum_m[axis], center_m[axis] + extent_along(extents, u));
  }
  return box;
}

/// The allowed excess of the box of a leaf along each side: the curvature of the path of a corner that turns
/// by phi, and the turning of the bounds between the ends, at most what the sphere around them allows.
double slack_m(const EntityRow& row, double reach, double window_s) {
  const Motion& motion = row.motion;
  const double phi_rad = glm::length(motion.w_world_radps) * window_s;
  const double bend_m = std::min(reach * (2.0 * phi_rad + 0.25 * phi_rad * phi_rad), 4.0 * reach);
  const double distance_m = glm::length(motion.p_world_m) + 2.0 * glm::length(motion.v_world_mps) + reach;
  const double rounding_m = 8e-6 * (distance_m + 2.0 * reach * glm::length(motion.w_world_radps));
  return bend_m + rounding_m;
}

}  // namespace

void MotionBoxFuzz::SetUp() {
  GpuTest::SetUp();
  submit_ = accel::Submit::create(device()).value();
  meshes_ = mixed_meshes(random_);
  // A body far from the origin of its frame, around which it turns.
  meshes_.push_back(make_box({0.5, 0.1, 0.3}));
  for (glm::vec3& position_m : meshes_.back().positions_m)
    position_m += glm::vec3(3.0f, -2.0f, 1.0f);
  pool_ = accel::GeometryPool::create(device(), static_cast<std::uint32_t>(meshes_.size()), submit_).value();
  for (const TriangleMesh& mesh : meshes_) {
    ASSERT_TRUE(pool_.add(device(), std::make_shared<const TriangleMesh>(mesh), submit_).ok());
    bounds_.push_back(bounds_of(mesh));
    extents_.push_back(extents_of(mesh));
  }
  tlas_ = accel::Tlas::create(device(), {.max_entities = max_entities, .slots = 1}).value();
  ASSERT_TRUE(tlas_.bind(device(), pool_).ok());
  read_back_ = make_buffer(
      {.name = "read back", .size_bytes = tlas_.nodes(0).size_bytes(), .memory = gpu::Memory::readback});
}

EntityRow MotionBoxFuzz::row(const Scene& scene) {
  EntityRow row;
  row.geometry = {static_cast<std::uint32_t>(random_.below(meshes_.size()))};
  row.scale = {random_.magnitude(0.05, 20.0), random_.magnitude(0.05, 20.0), random_.magnitude(0.05, 20.0)};
  if (random_.one_in(4)) row.scale = glm::dvec3(random_.magnitude(0.05, 20.0));
  Motion& motion = row.motion;
  motion.p_world_m = scene.offset_m * glm::dvec3(1.0, -0.6, 0.3) + scene.radius_m * random_.vector();
  motion.q_world = random_.orientation();
  motion.valid_from = scene.time;
  if (!random_.one_in(8)) motion.v_world_mps = random_.magnitude(0.01, 500.0) * random_.direction();
  if (random_.one_in(8)) return row;
  // From nearly no turn to several in the window, within the limits of a row.
  const double turns = random_.magnitude(1e-4, 8.0);
  const double rate_radps = 2.0 * std::numbers::pi * turns / std::max(scene.window.seconds(), 1e-3);
  const glm::dvec3 axis = random_.one_in(4) ? glm::dvec3(0.0, 0.0, 1.0) : random_.direction();
  motion.w_world_radps = std::min(rate_radps, 9e3) * axis;
  row.motion =
      rebased(motion, scene.time - Nanoseconds(static_cast<std::int64_t>(random_.uniform(0.0, 60.0) * 1e9)));
  return row;
}

Bounds MotionBoxFuzz::random_triangle_of(const TriangleMesh& mesh) {
  const glm::uvec3 corners = mesh.triangles[random_.below(mesh.triangles.size())];
  const glm::vec3& a = mesh.positions_m[corners.x];
  const glm::vec3& b = mesh.positions_m[corners.y];
  const glm::vec3& c = mesh.positions_m[corners.z];
  return {glm::min(a, glm::min(b, c)), glm::max(a, glm::max(b, c))};
}

void MotionBoxFuzz::visit(std::uint32_t node, std::vector<Child>& above) {
  const auto words = read_back_.host_as<const std::uint32_t>().subspan(node * node_words, node_words);
  for (std::uint32_t slot = 0; slot < shared::node_width; ++slot) {
    if ((words[3] >> 24 >> slot & 1u) == 0) continue;
    above.push_back({node, slot});
    const std::uint32_t reference = words[16 + slot];
    if ((reference & shared::ref_leaf_bit) != 0) {
      std::vector<Child>& path = paths_.at(reference & shared::ref_instance_mask);
      EXPECT_TRUE(path.empty()) << "an entity in two leaves";
      path = above;
    } else {
      visit(reference, above);
    }
    above.pop_back();
  }
}

void MotionBoxFuzz::check(const EntityRow& row, const std::vector<Child>& boxes, WorldTime t,
                          const Window& window, float share) {
  const auto words = read_back_.host_as<const std::uint32_t>();
  const Bounds& bounds = bounds_[row.geometry.index];
  const Pose pose = pose_at(row.motion, t);
  const auto in_world = [&](const glm::dvec3& point_m) {
    return pose.p_world_m + pose.q_world * (row.scale * point_m);
  };
  // The corners of the bounds of the entity, and of the boxes of some triangles.
  std::vector<glm::dvec3> corners_m[2];
  const auto take_corners = [&](const Bounds& of, std::vector<glm::dvec3>& into) {
    for (int corner = 0; corner < 8; ++corner)
      into.push_back(in_world(corner_of(of, corner)));
  };
  take_corners(bounds, corners_m[0]);
  for (int k = 0; k < 4; ++k)
    take_corners(random_triangle_of(meshes_[row.geometry.index]), corners_m[1]);
  points_ += corners_m[0].size() + corners_m[1].size();
  const auto outside = [](const WorldBox& box, const std::vector<glm::dvec3>& points_m) {
    return static_cast<std::size_t>(
        std::ranges::count_if(points_m, [&](const glm::dvec3& point_m) { return !contains(box, point_m); }));
  };
  for (const Child& child : boxes) {
    const auto node = words.subspan(child.node * node_words, node_words);
    const WorldBox box = box_at(node, child.slot, static_cast<double>(share));
    outside_ += outside(grown(box, overhang_m(node)), corners_m[0]) + outside(box, corners_m[1]);
  }
  const auto leaf_words = words.subspan(boxes.back().node * node_words, node_words);
  const WorldBox leaf = box_at(leaf_words, boxes.back().slot, static_cast<double>(share));
  const WorldBox around = box_around(oriented_box(bounds, row.scale, pose));
  const WorldBox exact = box_within(extents_[row.geometry.index], row.scale, pose, around);
  const glm::dvec3 allowed_m =
      slack_m(row, reach_m(bounds, row.scale), window.seconds()) + 4.0 * quanta_m(leaf_words);
  for (int axis = 0; axis < 3; ++axis) {
    const bool large = exact.minimum_m[axis] - leaf.minimum_m[axis] > allowed_m[axis] ||
                       leaf.maximum_m[axis] - exact.maximum_m[axis] > allowed_m[axis];
    too_large_ += large ? 1 : 0;
  }
  const glm::dvec3 overhang =
      glm::max(exact.minimum_m - around.minimum_m, around.maximum_m - exact.maximum_m) + allowed_m;
  max_overhang_m_ = glm::max(max_overhang_m_, overhang);
}

void MotionBoxFuzz::check_all(const Window& window) {
  submit_.begin();
  const auto view = tlas_.prepare(rows_, {.times = {window.begin, window.end}}, submit_);
  ASSERT_TRUE(view.has_value());
  submit_.recorder().copy(tlas_.nodes(0), 0, read_back_, 0, read_back_.size_bytes());
  ASSERT_TRUE(submit_.run());
  std::vector<const EntityState*> states;
  for (std::uint32_t i = 0; i < rows_.index_limit(); ++i) {
    if (rows_.row(i) != nullptr) states.push_back(rows_.row(i));
  }
  paths_.assign(states.size(), {});
  std::vector<Child> above;
  visit(view->root, above);
  const Window of_slot{view->window_begin, view->window_end};
  max_overhang_m_ = glm::dvec3(0.0);
  // More instants for fewer entities.
  const std::size_t instants = std::max<std::size_t>(3, 400 / states.size());
  for (const EntityState* state : states) {
    const auto& path = paths_[tlas_.place_of(0, state->id.index)];
    ASSERT_FALSE(path.empty()) << "entity " << state->id.index << " is in no leaf";
    for (std::size_t k = 0; k < instants; ++k) {
      const double part = k == 0 ? 0.0 : k == 1 ? 1.0 : random_.uniform(0.0, 1.0);
      const WorldTime t =
          window.begin + Nanoseconds(static_cast<std::int64_t>(
                             part * static_cast<double>((window.end - window.begin).count())));
      check(state->row, path, t, of_slot, view->moment(t).share);
    }
  }
  const auto root = read_back_.host_as<const std::uint32_t>().subspan(view->root * node_words, node_words);
  const glm::dvec3 recorded_m = overhang_m(root);
  for (int axis = 0; axis < 3; ++axis)
    too_large_ += recorded_m[axis] > max_overhang_m_[axis] ? 1 : 0;
  ++versions_;
}

/// Some entities get other motions within the window.
void MotionBoxFuzz::patch(Scene& scene, std::vector<EntityRow>& rows) {
  const auto rest_ns = static_cast<double>((scene.window.end - scene.window.begin).count());
  scene.time =
      scene.window.begin + Nanoseconds(static_cast<std::int64_t>(random_.uniform(0.0, 0.5) * rest_ns));
  std::vector<std::uint32_t> changed(1 + random_.below(std::min<std::size_t>(rows.size(), 8)));
  for (std::uint32_t& index : changed) {
    index = static_cast<std::uint32_t>(random_.below(rows.size()));
    EntityRow next = row(scene);
    next.geometry = rows[index].geometry;
    rows[index] = next;
  }
  rows_.change(
      changed, [&](std::uint32_t i) { return std::optional(rows[i]); }, scene.time);
  check_all({scene.time, scene.window.end});
}

void MotionBoxFuzz::fuzz(std::uint64_t seed) {
  random_ = Random(seed);
  outside_ = too_large_ = 0;
  constexpr std::uint32_t counts[] = {1, 2, 9, 30, 60, 200, 30, 60, 9, 700};
  const std::uint32_t count = seed % 40 == 39 ? max_entities : counts[random_.below(std::size(counts))];
  Scene scene;
  scene.time = world_time_ns(static_cast<std::int64_t>(random_.uniform(-1e6, 1e6) * 1e9));
  scene.radius_m = random_.magnitude(0.1, 1e3);
  scene.offset_m = random_.one_in(3) ? random_.magnitude(10.0, 8e4) : 0.0;
  const auto window_ns = random_.one_in(8) ? 0 : static_cast<std::int64_t>(random_.magnitude(1e6, 1e9));
  const auto wait_ns = static_cast<std::int64_t>(random_.uniform(0.0, 3e9));
  std::vector<EntityRow> rows(count);
  // In the second version all entities continue with other motions: a refit, if the tree is cheap enough.
  for (const bool again : {false, true}) {
    if (again) scene.time += Nanoseconds(10'000'000);
    scene.window = {scene.time + Nanoseconds(wait_ns), scene.time + Nanoseconds(wait_ns + window_ns)};
    for (EntityRow& one : rows) {
      EntityRow next = row(scene);
      if (again) {
        next.geometry = one.geometry;
        next.motion.p_world_m +=
            pose_at(one.motion, scene.time).p_world_m - pose_at(next.motion, scene.time).p_world_m;
      }
      one = next;
    }
    rows_.next([&](std::uint32_t i) { return i < count ? std::optional(rows[i]) : std::nullopt; },
               scene.time);
    check_all(scene.window);
  }
  for (int k = 0; k < 2; ++k)
    patch(scene, rows);
  EXPECT_EQ(outside_, 0u) << "points outside; seed " << seed << ", " << count << " entities";
  EXPECT_EQ(too_large_, 0u) << "sides too far out; seed " << seed << ", " << count << " entities";
}

}  // namespace rtstdb::test
