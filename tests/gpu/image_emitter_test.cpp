// Bodies that emit light, in real-time mode: the illuminance of small plates around them against a closed
// form.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <vector>

#include "rtstdb/query/image/emitter_zones.hpp"
#include "tests/gpu/image_fixture.hpp"
#include "tests/support/random.hpp"

namespace rtstdb::test {
namespace {

using std::numbers::pi;

constexpr double lamp_cdpm2 = 1000.0;
/// The size of a plate, as a share of the lamp's.
constexpr double plate_share = 0.001;

// ---- the closed form

/// The illuminance, per luminance, of a point with the normal n by a triangle (Lambert, 1760): by the part
/// above the plane of the point.
double illuminance(const std::array<glm::dvec3, 3>& triangle, const glm::dvec3& p, const glm::dvec3& n) {
  std::vector<glm::dvec3> above;
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3 a = triangle[k] - p, b = triangle[(k + 1) % 3] - p;
    const double height_a = glm::dot(a, n), height_b = glm::dot(b, n);
    if (height_a > 0.0) above.push_back(a);
    if ((height_a > 0.0) != (height_b > 0.0))
      above.push_back(a + (b - a) * (height_a / (height_a - height_b)));
  }
  glm::dvec3 sum(0.0);
  for (std::size_t k = 0; k < above.size(); ++k) {
    const glm::dvec3 a = above[k], b = above[(k + 1) % above.size()];
    const glm::dvec3 across = glm::cross(a, b);
    const double length = glm::length(across);
    if (length > 0.0) sum += across / length * std::atan2(length, glm::dot(a, b));
  }
  return 0.5 * std::abs(glm::dot(sum, n));
}

/// Illuminance of a convex body, or of a surface that is seen from both sides.
double illuminance(const std::vector<std::array<glm::dvec3, 3>>& body, const glm::dvec3& p,
                   const glm::dvec3& n, bool both_sides = false) {
  double volume = 0.0;
  for (const auto& [a, b, c] : body)
    volume += glm::dot(glm::cross(b - a, c - a), a - body[0][0]);
  const double outward = volume < 0.0 ? -1.0 : 1.0;
  double sum = 0.0;
  for (const auto& [a, b, c] : body)
    if (both_sides || outward * glm::dot(glm::cross(b - a, c - a), p - a) > 0.0)
      sum += illuminance({a, b, c}, p, n);
  return sum;
}

// ---- random bodies

/// Changes the order of the triangles, and of the corners of each.
void shuffle(TriangleMesh& mesh, Random& random) {
  std::ranges::shuffle(mesh.triangles, random.engine);
  for (glm::uvec3& t : mesh.triangles)
    for (std::size_t k = random.below(3); k > 0; --k)
      t = {t.y, t.z, t.x};
}

/// Splits edges at random points; the same triangle may be split many times. Corners are rounded, so a split
/// may turn an edge by a unit in the last place.
void split_edges(TriangleMesh& mesh, std::size_t count, Random& random) {
  for (std::size_t k = 0; k < count; ++k) {
    const int edge = random.integer(0, 2);
    const glm::uvec3 t = mesh.triangles[random.below(mesh.triangles.size())];
    const std::uint32_t a = t[edge], b = t[(edge + 1) % 3];
    const auto middle = static_cast<std::uint32_t>(mesh.positions_m.size());
    mesh.positions_m.push_back(
        glm::mix(mesh.positions_m[a], mesh.positions_m[b], random.uniform(0.02, 0.98)));
    const std::size_t triangles = mesh.triangles.size();
    for (std::size_t i = 0; i < triangles; ++i) {
      glm::uvec3& other = mesh.triangles[i];
      for (int corner = 0; corner < 3; ++corner) {
        const std::uint32_t x = other[corner], y = other[(corner + 1) % 3], z = other[(corner + 2) % 3];
        if (!((x == a && y == b) || (x == b && y == a))) continue;
        other = {x, middle, z};
        mesh.triangles.push_back({middle, y, z});
        break;
      }
    }
  }
}

struct Lamp {
  std::string name;
  TriangleMesh mesh;
  double diameter_m = 1.0;  // the largest distance of two points
};

Lamp random_lamp(std::uint32_t kind, Random& random) {
  Lamp lamp;
  if (kind == 0) {
    lamp = {"sphere", make_sphere(0.5, static_cast<std::uint32_t>(random.below(5))), 1.0};
  } else if (kind == 1) {
    const glm::dvec3 size(1.0, random.magnitude(1.0, 10.0), random.magnitude(1.0, 10.0));
    lamp = {"box", make_box(size), glm::length(size)};
  } else {
    const double height_m = random.below(4) == 0 ? 10.0 : random.magnitude(1.0, 100.0) / 10.0;
    const auto segments = static_cast<std::uint32_t>(3 + random.below(random.below(3) == 0 ? 14 : 300));
    lamp = {"cylinder", make_cylinder(0.5, height_m, segments), std::hypot(1.0, height_m)};
  }
  if (random.below(3) > 0) split_edges(lamp.mesh, random.below(400), random);
  shuffle(lamp.mesh, random);
  lamp.name += " of " + std::to_string(lamp.mesh.triangles.size()) + " triangles, diameter " +
               std::to_string(lamp.diameter_m);
  return lamp;
}

/// Bodies that are thin or small beside their distance; the fronts of some are inside.
Lamp random_thin_lamp(std::uint32_t kind, Random& random) {
  Lamp lamp;
  if (kind == 0) {
    const glm::dvec3 size(1.0, random.uniform(0.2, 1.0), random.magnitude(1e-3, 0.1));
    lamp = {"panel", make_box(size), glm::length(size)};
  } else if (kind == 1) {
    const double height_m = random.below(2) == 0 ? 10.0 : random.magnitude(2e-3, 1.0);
    lamp = {"cylinder", make_cylinder(0.5, height_m, static_cast<std::uint32_t>(3 + random.below(60))),
            std::hypot(1.0, height_m)};
  } else if (kind == 2) {
    lamp = {"cube", make_box(glm::dvec3(1.0)), std::sqrt(3.0)};
  } else {
    lamp = {"sphere", make_sphere(0.5, static_cast<std::uint32_t>(random.below(5))), 1.0};
  }
  const double size_m = random.magnitude(0.1, 1.0) / lamp.diameter_m;
  for (glm::vec3& p : lamp.mesh.positions_m)
    p *= static_cast<float>(size_m);
  lamp.diameter_m *= size_m;
  shuffle(lamp.mesh, random);
  if (random.below(4) == 0)
    for (glm::uvec3& t : lamp.mesh.triangles)
      t = {t.x, t.z, t.y};
  return lamp;
}

std::vector<std::array<glm::dvec3, 3>> placed(const TriangleMesh& mesh, const EntityRow& row) {
  std::vector<std::array<glm::dvec3, 3>> triangles;
  const auto world = [&](std::uint32_t corner) {
    return row.motion.p_world_m + row.motion.q_world * (glm::dvec3(mesh.positions_m[corner]) * row.scale);
  };
  for (const glm::uvec3& t : mesh.triangles)
    triangles.push_back({world(t.x), world(t.y), world(t.z)});
  return triangles;
}

// ---- plates

struct Plate {
  glm::dvec3 p_m;
  glm::dvec3 n;
};

glm::dquat rotation_between(const glm::dvec3& from, const glm::dvec3& to) {
  const glm::dvec3 across = std::abs(from.x) < 0.5 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
  if (glm::dot(from, to) < -0.9999) return glm::angleAxis(pi, glm::normalize(glm::cross(from, across)));
  return glm::normalize(glm::dquat(1.0 + glm::dot(from, to), glm::cross(from, to)));
}

class ImageOfEmitters : public ImageTest {
 protected:
  static constexpr std::uint32_t max_plates = 32;  // each is in a mask of its own, so none shades another

  void SetUp() override {
    ImageTest::SetUp();
    const auto prepared = [&](ImageMode mode, std::uint32_t points) {
      return prepare(ImageQueryOptions{.name = "cameras",
                                       .capacity = max_plates,
                                       .width = 2,
                                       .height = 2,
                                       .mode = mode,
                                       .outputs = linear_color,
                                       .samples_per_pixel = mode == ImageMode::real_time ? 1 : path_samples,
                                       .bounces = 1,
                                       .emitter_points = points});
    };
    with_16_ = prepared(ImageMode::real_time, 16);
    with_64_ = prepared(ImageMode::real_time, 64);
    path_traced_ = prepared(ImageMode::path_traced, 16);
    plate_ = add(make_rectangle(1.0, 1.0));
    white_ = add_material({.base_color = glm::dvec3(1.0), .refractive_index = 1.0});
    black_ = add_material({.base_color = glm::dvec3(0.0), .refractive_index = 1.0});
    emitting_ = add_material(
        {.base_color = glm::dvec3(0.0), .emission_cdpm2 = glm::dvec3(lamp_cdpm2), .refractive_index = 1.0});
  }
  EntityRow lamp_row(GeometryId geometry, const glm::dquat& q) const {
    EntityRow row = row_of(geometry, {3.0, -2.0, 1.0});
    row.motion.q_world = q;
    row.material = emitting_;
    return row;
  }
  /// The illuminance of plates, per luminance, as cameras above them see it.
  std::vector<double> illuminances(std::uint32_t points, std::span<const Plate> plates, double size_m) {
    return illuminances(points == 16 ? *with_16_ : *with_64_, plates, size_m, lamp_cdpm2);
  }
  std::vector<double> illuminances(ImageQuery& query, std::span<const Plate> plates, double size_m,
                                   double luminance_cdpm2) {
    std::vector<EntityRow> rows;
    for (std::size_t k = 0; k < plates.size(); ++k) {
      EntityRow row = row_of(plate_, plates[k].p_m);
      row.motion.q_world = rotation_between({0.0, 0.0, 1.0}, plates[k].n);
      row.scale = glm::dvec3(size_m);
      row.material = white_;
      row.mask = 1u << k;
      rows.push_back(row);
      query.cameras()[k] = {.p_m = glm::vec3(plates[k].p_m + 2.0 * size_m * plates[k].n),
                            .q = glm::quat(rotation_between({1.0, 0.0, 0.0}, -plates[k].n)),
                            .horizontal_angle_rad = 0.01f,
                            .near_m = 0.0002f,
                            .mask = 1u << k};
    }
    const std::vector<EntityId> ids = create(rows);
    const Outcome outcome = run(query, plates.size());
    EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
    std::vector<double> found;
    for (const Image& image : query.images())
      found.push_back(mean_color(image).x * pi / luminance_cdpm2);
    for (const EntityId id : ids)
      remove(id, {});
    return found;
  }
  /// Around a lamp, at a distance from its middle. A third of the plates face its middle; a third are turned,
  /// but have all of it above their plane; the planes of the rest may cut it.
  static std::vector<Plate> plates_around(const glm::dvec3& middle_m, double distance_m, double radius_m,
                                          const glm::dvec3& axis, Random& random) {
    std::vector<Plate> plates;
    for (std::uint32_t k = 0; k < max_plates; ++k) {
      glm::dvec3 u = random.direction();
      if (k % 4 == 1) u = glm::normalize(0.1 * u + (random.below(2) == 0 ? axis : -axis));
      if (k % 4 == 2) u = glm::normalize(u - 0.95 * glm::dot(u, axis) * axis);
      const double away_m = distance_m * (k % 2 == 0 ? 1.0 : random.uniform(1.0, 2.0));
      const glm::dvec3 side = glm::normalize(glm::cross(u, random.direction()));
      const double widest = 0.5 * pi + (k % 3 == 1 ? -1.0 : 0.8) * std::asin(radius_m / away_m);
      const double angle = k % 3 == 0 ? 0.0 : random.uniform(k % 3 == 1 ? 0.0 : 0.5 * pi - 0.4, widest);
      plates.push_back({middle_m + away_m * u, std::cos(angle) * -u + std::sin(angle) * side});
    }
    return plates;
  }
  /// Compares random lamps with the closed form: within a share of the illuminance or, where the plane of a
  /// plate cuts the lamp, of that of a plate that faces the lamp.
  void expect_lamps(std::uint32_t points, double diameters, double share) {
    for (std::uint32_t kind = 0; kind < 3; ++kind) {
      double worst = 0.0, sum = 0.0;
      std::string worst_lamp;
      constexpr std::uint32_t lamps = 24;
      for (std::uint32_t seed = 0; seed < lamps; ++seed) {
        Random random(1000 * kind + seed);
        const Lamp lamp = random_lamp(kind, random);
        const EntityRow row = lamp_row(add(lamp.mesh), random.orientation());
        const EntityId id = create(row);
        const auto body = placed(lamp.mesh, row);
        const glm::dvec3 middle_m = row.motion.p_world_m;
        const auto plates = plates_around(middle_m, diameters * lamp.diameter_m, 0.5 * lamp.diameter_m,
                                          row.motion.q_world * glm::dvec3(0.0, 0.0, 1.0), random);
        const auto found = illuminances(points, plates, plate_share * lamp.diameter_m);
        for (std::size_t k = 0; k < plates.size(); ++k) {
          const double expected = illuminance(body, plates[k].p_m, plates[k].n);
          const double facing = illuminance(body, plates[k].p_m, glm::normalize(middle_m - plates[k].p_m));
          const double off = (found[k] - expected) / (k % 3 == 2 ? facing : expected);
          EXPECT_LT(std::abs(off), share) << lamp.name << ", seed " << seed << ", plate " << k << ": "
                                          << found[k] << " instead of " << expected;
          sum += std::abs(off);
          if (std::abs(off) > std::abs(worst)) {
            worst = off;
            worst_lamp = lamp.name;
          }
        }
        remove(id, {});
      }
      std::cout << points << " points from " << diameters << " diameters: at most " << 100.0 * worst
                << " % off (" << worst_lamp << "), mean " << 100.0 * sum / (lamps * max_plates) << " %\n";
    }
  }

  GeometryId plate_;
  MaterialId white_, black_, emitting_;
  std::unique_ptr<ImageQuery> with_16_, with_64_, path_traced_;

 private:
  static constexpr std::uint32_t path_samples = 256;
};

/// Lamps of 10 cm to 1 m, up to 10,000 diameters away and up to 10 km from the origin of the world. Positions
/// are rounded as the database rounds them there.
class ImageOfFarEmitters : public ImageOfEmitters {
 protected:
  static constexpr double max_diameters = 10'000.0;  // plates are up to twice as far as the nearest one

  struct FarLamp {
    Lamp lamp;
    EntityRow row;
    double distance_m = 0.0;
    double luminance_cdpm2 = lamp_cdpm2;
    double plate_m = 0.0;  // the size of plates, which have to be larger than a unit in the last place
    std::vector<std::array<glm::dvec3, 3>> body;
  };
  FarLamp far_lamp(std::uint32_t kind, Random& random) {
    FarLamp far{.lamp = random_thin_lamp(kind, random), .row = {}, .body = {}};
    const double diameters = random.magnitude(2.0, max_diameters / 2.0);
    far.distance_m = diameters * far.lamp.diameter_m;
    while (far.luminance_cdpm2 < 5e8 && far.luminance_cdpm2 < lamp_cdpm2 * diameters * diameters)
      far.luminance_cdpm2 *= 10.0;
    far.row = lamp_row(add(far.lamp.mesh), random.orientation());
    far.row.material = add_material({.base_color = glm::dvec3(0.0),
                                     .emission_cdpm2 = glm::dvec3(far.luminance_cdpm2),
                                     .refractive_index = 1.0});
    constexpr double from_origin_m[] = {0.0, 100.0, 1e3, 1e4};
    const double offset_m = from_origin_m[random.below(4)];
    far.row.motion.p_world_m = rounded(offset_m * random.direction());
    far.plate_m = std::max(plate_share * far.lamp.diameter_m, 2e-6 * (offset_m + far.distance_m));
    far.body = placed(far.lamp.mesh, far.row);
    return far;
  }
  static glm::dvec3 rounded(const glm::dvec3& p_m) { return glm::dvec3(glm::vec3(p_m)); }
  std::vector<Plate> plates_of(const FarLamp& far, Random& random) {
    auto plates = plates_around(far.row.motion.p_world_m, far.distance_m, 0.5 * far.lamp.diameter_m,
                                far.row.motion.q_world * glm::dvec3(0.0, 0.0, 1.0), random);
    for (Plate& plate : plates)
      plate.p_m = rounded(plate.p_m);
    return plates;
  }
  static std::string name_of(const FarLamp& far) {
    return far.lamp.name + " of " + std::to_string(far.lamp.diameter_m) + " m at " +
           std::to_string(far.distance_m) + " m, " + std::to_string(glm::length(far.row.motion.p_world_m)) +
           " m from the origin";
  }
  struct Deviations {
    double worst = 0.0;  // of a plate
    double sum = 0.0;    // largest deviation of the sum over the plates of a lamp
  };
  /// Relative deviations from the closed form; plates whose planes may cut the lamp are left out.
  Deviations deviations(ImageQuery& query, std::uint32_t lamps) {
    Deviations all;
    for (std::uint32_t seed = 0; seed < lamps; ++seed) {
      Random random(5000 + seed);
      const FarLamp far = far_lamp(seed % 4, random);
      const EntityId id = create(far.row);
      const auto plates = plates_of(far, random);
      const auto found = illuminances(query, plates, far.plate_m, far.luminance_cdpm2);
      double worst = 0.0, found_sum = 0.0, expected_sum = 0.0;
      for (std::size_t k = 0; k < plates.size(); ++k) {
        if (k % 3 == 2) continue;
        const double expected = illuminance(far.body, plates[k].p_m, plates[k].n);
        worst = std::max(worst, std::abs(found[k] / expected - 1.0));
        found_sum += found[k];
        expected_sum += expected;
      }
      const double sum = std::abs(found_sum / expected_sum - 1.0);
      if (worst > all.worst || sum > all.sum)
        std::cout << name_of(far) << ", seed " << seed << ": " << 100.0 * worst << " % off, the sum "
                  << 100.0 * sum << " %\n";
      all = {std::max(all.worst, worst), std::max(all.sum, sum)};
      remove(id, {});
    }
    return all;
  }
};

TEST_F(ImageOfFarEmitters, AreRightAtAnyDistanceAndPlace) {
  EXPECT_LT(deviations(*with_16_, 160).worst, 0.1);
  EXPECT_LT(deviations(*with_64_, 40).worst, 0.1);
}

/// The sum over plates has little noise.
TEST_F(ImageOfFarEmitters, ArePathTracedAtAnyDistanceAndPlace) {
  EXPECT_LT(deviations(*path_traced_, 16).sum, 0.05);
}

/// A thing close in front of a panel hides it, except edges that are seen at a grazing angle; a thing close
/// behind it does not.
TEST_F(ImageOfFarEmitters, AreHiddenByShuttersCloseToThem) {
  for (std::uint32_t seed = 0; seed < 40; ++seed) {
    Random random(7000 + seed);
    const FarLamp far = far_lamp(0, random);
    const glm::dvec3 p_m = far.row.motion.p_world_m;
    const glm::dvec3 axis = far.row.motion.q_world * glm::dvec3(0.0, 0.0, 1.0);
    const glm::dvec3 u = glm::normalize(axis + 0.5 * random.direction());
    const Plate plate{rounded(p_m + far.distance_m * u), -u};
    const double half_thickness_m = std::abs(static_cast<double>(far.lamp.mesh.positions_m[0].z));
    const double gap_m =
        half_thickness_m + 1e-5 * (far.distance_m + far.lamp.diameter_m) + 2e-7 * glm::length(p_m);
    EntityRow shutter = row_of(add(make_rectangle(4.0 * far.lamp.diameter_m, 4.0 * far.lamp.diameter_m)), {});
    shutter.motion.q_world = far.row.motion.q_world;
    shutter.material = black_;
    const double unhidden = illuminance(far.body, plate.p_m, plate.n);
    const EntityId id = create(far.row);
    for (const double side : {1.0, -1.0}) {
      shutter.motion.p_world_m = p_m + side * gap_m * axis;
      const EntityId shutter_id = create(shutter);
      const auto found_by = [&](ImageQuery& query) {
        return illuminances(query, std::span(&plate, 1), far.plate_m, far.luminance_cdpm2)[0] / unhidden;
      };
      SCOPED_TRACE(name_of(far) + ", seed " + std::to_string(seed));
      EXPECT_NEAR(found_by(*with_16_), side > 0.0 ? 0.0 : 1.0, side > 0.0 ? 0.02 : 0.1);
      if (seed % 10 == 0) {
        EXPECT_NEAR(found_by(*path_traced_), side > 0.0 ? 0.0 : 1.0, side > 0.0 ? 0.02 : 0.2);
      }
      remove(shutter_id, {});
    }
    remove(id, {});
  }
}

/// A panel of two parallel sheets is not closed: the front sheet hides the other.
TEST_F(ImageOfFarEmitters, SheetsHideEachOther) {
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    Random random(8000 + seed);
    TriangleMesh mesh = make_rectangle(1.0, 0.5);
    const double diameters = random.magnitude(2.0, 100.0);
    const double gap_m = std::max(0.002, 1.5e-5 * diameters * std::hypot(1.0, 0.5));
    for (std::size_t k = 0; k < 4; ++k)
      mesh.positions_m.push_back(mesh.positions_m[k] - glm::vec3(0.0, 0.0, gap_m));
    for (std::size_t k = 0; k < 2; ++k)
      mesh.triangles.push_back(mesh.triangles[k] + 4u);
    EntityRow row = lamp_row(add(mesh), random.orientation());
    const EntityId id = create(row);
    const glm::dvec3 axis = row.motion.q_world * glm::dvec3(0.0, 0.0, random.below(2) == 0 ? 1.0 : -1.0);
    const glm::dvec3 u = glm::normalize(axis + 0.5 * random.direction());
    const Plate plate{row.motion.p_world_m + diameters * std::hypot(1.0, 0.5) * u, -u};
    const auto body = placed(mesh, row);
    const double both = illuminance(body, plate.p_m, plate.n, true);
    EXPECT_NEAR(illuminances(16, std::span(&plate, 1), 0.001)[0], 0.5 * both, 0.05 * both)
        << "seed " << seed << ", " << diameters << " diameters";
    remove(id, {});
  }
}

TEST_F(ImageOfEmitters, SixteenPointsAreEnoughFromTwoDiameters) {
  expect_lamps(16, 2.0, 0.1);
}

TEST_F(ImageOfEmitters, SixtyFourPointsAreEnoughFromOnePointTwoDiameters) {
  expect_lamps(64, 1.2, 0.1);
}

TEST_F(ImageOfEmitters, TheOrderOfTrianglesHasNoEffect) {
  for (std::uint32_t seed = 0; seed < 9; ++seed) {
    Random random(seed);
    Lamp lamp = random_lamp(seed % 3, random);
    const glm::dquat q = random.orientation();
    const auto plates = plates_around(lamp_row({}, q).motion.p_world_m, 2.0 * lamp.diameter_m,
                                      0.5 * lamp.diameter_m, glm::dvec3(0.0, 0.0, 1.0), random);
    std::vector<double> first;
    for (int turn = 0; turn < 3; ++turn) {
      const EntityId id = create(lamp_row(add(lamp.mesh), q));
      const auto found = illuminances(16, plates, plate_share * lamp.diameter_m);
      if (first.empty()) first = found;
      for (std::size_t k = 0; k < plates.size(); ++k)
        EXPECT_EQ(found[k], first[k]) << lamp.name << ", seed " << seed;
      remove(id, {});
      shuffle(lamp.mesh, random);
    }
  }
}

/// The scale of an entity, and the shape of a geometry that deforms, change from version to version.
TEST_F(ImageOfEmitters, PointsFollowTheScaleAndTheShapeOfTheBody) {
  TriangleMesh mesh = make_cylinder(0.5, 1.0);
  const auto cylinder = database().add_geometry(mesh, "cylinder", {.deforms = true});
  ASSERT_TRUE(cylinder) << cylinder.error().message;
  Random random(5);
  EntityRow row = lamp_row(cylinder.value(), random.orientation());
  const EntityId id = create(row);
  double diameter_m = std::sqrt(2.0);
  const auto expect_light = [&](const char* what) {
    const auto body = placed(mesh, row);
    const auto plates = plates_around(row.motion.p_world_m, 2.0 * diameter_m, 0.5 * diameter_m,
                                      row.motion.q_world * glm::dvec3(0.0, 0.0, 1.0), random);
    const auto found = illuminances(16, plates, plate_share * diameter_m);
    for (std::size_t k = 0; k < plates.size(); ++k) {
      if (k % 3 == 2) continue;
      const double expected = illuminance(body, plates[k].p_m, plates[k].n);
      EXPECT_NEAR(found[k], expected, 0.1 * expected) << what << ", plate " << k;
    }
  };
  expect_light("at first");
  row.scale = {0.3, 0.3, 3.0};
  diameter_m = std::hypot(0.3, 3.0);
  execute([&](Transaction& transaction) { transaction.update(id, row); });
  expect_light("scaled");
  for (glm::vec3& p : mesh.positions_m)
    p *= glm::vec3(4.0f, 4.0f, 0.1f);
  diameter_m = std::hypot(1.2, 0.3);
  const auto transaction = database().make_transaction({.max_geometry_updates = 1, .max_positions = 1000});
  transaction->begin(terms_at({}));
  transaction->update_geometry(cylinder.value(), mesh.positions_m);
  ASSERT_EQ(database().execute(*transaction).status, Status::committed);
  expect_light("deformed");
}

TEST_F(ImageOfEmitters, PanelsShineFromBothSides) {
  Random random(8);
  for (const glm::dvec2& size : {glm::dvec2(1.0, 1.0), glm::dvec2(1.0, 8.0)}) {
    TriangleMesh mesh = make_rectangle(size.x, size.y);
    split_edges(mesh, 50, random);
    const EntityRow row = lamp_row(add(mesh), random.orientation());
    const EntityId id = create(row);
    const auto body = placed(mesh, row);
    const auto plates = plates_around(row.motion.p_world_m, 2.0 * glm::length(size), 0.5 * glm::length(size),
                                      row.motion.q_world * glm::dvec3(0.0, 1.0, 0.0), random);
    const auto found = illuminances(16, plates, plate_share * glm::length(size));
    for (std::size_t k = 0; k < plates.size(); ++k) {
      if (k % 3 == 2) continue;
      const double expected = illuminance(body, plates[k].p_m, plates[k].n, true);
      EXPECT_NEAR(found[k], expected, 0.05 * expected + 1e-4) << "plate " << k;
    }
    remove(id, {});
  }
}

/// All directions have the same luminance, so the illuminance is pi times as large.
TEST_F(ImageOfEmitters, AHollowBodyLightsWhatIsInIt) {
  Random random(9);
  for (const TriangleMesh& mesh : {make_sphere(1.0, 4), make_box({2.0, 2.0, 2.0})}) {
    const EntityRow row = lamp_row(add(mesh), random.orientation());
    const EntityId id = create(row);
    std::vector<Plate> plates;
    for (std::uint32_t k = 0; k < max_plates; ++k)
      plates.push_back({row.motion.p_world_m + 0.3 * random.direction(), random.direction()});
    const auto found = illuminances(64, plates, 0.001);
    for (const double illuminance : found)
      EXPECT_NEAR(illuminance, pi, 0.1 * pi);
    remove(id, {});
  }
}

/// A triangle of almost no area, of which there are as many as others, makes no side.
TEST(EmitterZones, EachFlatSideHasZonesOfItsOwn) {
  for (std::uint32_t seed = 0; seed < 60; ++seed) {
    Random random(seed);
    const auto segments = static_cast<std::uint32_t>(3 + random.below(12));
    const bool is_box = seed % 2 == 0;
    TriangleMesh mesh = is_box ? make_box({1.0, random.magnitude(1.0, 100.0), random.magnitude(1.0, 100.0)})
                               : make_cylinder(0.5, random.magnitude(1.0, 10.0), segments);
    const std::uint32_t sides = is_box ? 6 : segments + 2;
    split_edges(mesh, random.below(300), random);
    shuffle(mesh, random);
    constexpr std::uint32_t count = 16;
    query::EmitterZones divider(count, 10'000);
    std::vector<shared::EmitterZone> zones(count);
    std::vector<shared::EmitterPoint> points(count * shared::points_per_zone);
    divider.divide(mesh.triangles, mesh.positions_m, glm::dvec3(1.0), zones, points);
    std::vector<glm::vec3> normals;
    double area = 0.0;
    for (const shared::EmitterZone& zone : zones) {
      EXPECT_GT(zone.area_m2, 0.0f);
      area += static_cast<double>(zone.area_m2);
      if (sides > count) continue;
      EXPECT_NEAR(glm::length(zone.n), 1.0f, 1e-3f) << "seed " << seed;
      if (std::ranges::none_of(normals, [&](const glm::vec3& n) { return glm::dot(n, zone.n) > 0.999f; }))
        normals.push_back(zone.n);
    }
    if (sides <= count) {
      EXPECT_EQ(normals.size(), sides) << "seed " << seed;
    }
    double expected = 0.0;
    for (const glm::uvec3& t : mesh.triangles) {
      const glm::dvec3 a(mesh.positions_m[t.x]), b(mesh.positions_m[t.y]), c(mesh.positions_m[t.z]);
      expected += 0.5 * glm::length(glm::cross(b - a, c - a));
    }
    EXPECT_NEAR(area, expected, 1e-5 * expected);
  }
}

}  // namespace
}  // namespace rtstdb::test
