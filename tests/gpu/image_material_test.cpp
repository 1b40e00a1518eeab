// Materials in images: mixtures of metal, opaque dielectric and glass. Both modes have to find the same.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "tests/gpu/image_fixture.hpp"

namespace rtstdb::test {
namespace {

using std::numbers::pi;

constexpr double sky_cdpm2 = 1000.0;
constexpr double spacing_m = 100.0;

glm::dquat pitched(double pitch_rad) {
  return glm::angleAxis(pitch_rad, glm::dvec3(0.0, 1.0, 0.0));
}

/// All combinations of some values, and random ones.
std::vector<Material> white_materials() {
  std::vector<Material> white;
  const auto add = [&](double metallic, double roughness, double transmission, double index) {
    white.push_back({.base_color = glm::dvec3(1.0),
                     .metallic = metallic,
                     .roughness = roughness,
                     .transmission = transmission,
                     .refractive_index = index});
  };
  for (const double metallic : {0.0, 0.1, 0.5, 0.9, 1.0})
    for (const double roughness : {0.0, 0.1, 0.3, 0.6, 1.0})
      for (const double transmission : {0.0, 0.5, 1.0})
        add(metallic, roughness, transmission, 1.5);
  std::mt19937 random(73);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int k = 0; k < 45; ++k) {
    const double metallic = share(random), roughness = share(random), transmission = share(random);
    add(metallic, roughness, transmission, 1.0 + 1.5 * share(random));
  }
  return white;
}

class ImageOfMaterials : public ImageTest, public testing::WithParamInterface<ImageMode> {
 protected:
  /// Mean colours of cameras.
  std::vector<double> means_of(const std::vector<Camera>& cameras, std::uint32_t samples,
                               std::uint32_t bounces, std::uint32_t side = 8) {
    const auto query =
        prepare(ImageQueryOptions{.name = "cameras",
                                  .capacity = static_cast<std::uint32_t>(cameras.size()),
                                  .width = side,
                                  .height = side,
                                  .mode = GetParam(),
                                  .outputs = linear_color,
                                  .samples_per_pixel = GetParam() == ImageMode::real_time ? 1u : samples,
                                  .bounces = bounces});
    std::ranges::copy(cameras, query->cameras().begin());
    const Outcome outcome = run(*query, static_cast<std::uint32_t>(cameras.size()));
    EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
    std::vector<double> means;
    for (const Image& image : query->images())
      means.push_back(mean_color(image).x);
    return means;
  }
  void expect_furnace(const std::vector<Material>& materials, const std::vector<Camera>& cameras,
                      std::uint32_t bounces, double share = 0.01, std::uint32_t samples = 256,
                      std::uint32_t side = 8) {
    const std::vector<double> means = means_of(cameras, samples, bounces, side);
    for (std::size_t k = 0; k < means.size(); ++k) {
      const Material& m = materials[k];
      EXPECT_NEAR(means[k], sky_cdpm2, share * sky_cdpm2)
          << "metallic " << m.metallic << ", roughness " << m.roughness << ", transmission " << m.transmission
          << ", index " << m.refractive_index;
    }
  }
  void create_uniform_sky() {
    const glm::dvec3 all(sky_cdpm2);
    create_light({.kind = LightKind::sky, .zenith_cdpm2 = all, .horizon_cdpm2 = all, .ground_cdpm2 = all});
  }
};

/// A plate that absorbs nothing is as bright as the uniform sky around it, at any angle.
TEST_P(ImageOfMaterials, AWhitePlateIsAsBrightAsTheSky) {
  create_uniform_sky();
  const std::vector<Material> materials = white_materials();
  const GeometryId plate = add(make_rectangle(2.0, 2.0));
  for (const double angle_rad : {1.4, 0.6, 0.15}) {  // between the plate and the ray
    std::vector<Camera> cameras;
    std::vector<EntityId> plates;
    for (std::size_t k = 0; k < materials.size(); ++k) {
      const glm::dvec3 p_m(0.0, spacing_m * static_cast<double>(k), 0.0);
      plates.push_back(create_body(plate, p_m, materials[k]));
      const glm::dvec3 from = p_m + 5.0 * glm::dvec3(-std::cos(angle_rad), 0.0, std::sin(angle_rad));
      cameras.push_back(
          {.p_m = glm::vec3(from), .q = glm::quat(pitched(angle_rad)), .horizontal_angle_rad = 0.01f});
    }
    SCOPED_TRACE(angle_rad);
    expect_furnace(materials, cameras, 4);
    for (const EntityId id : plates)
      remove(id, {});
  }
}

/// A sphere has all angles of incidence.
TEST_P(ImageOfMaterials, AWhiteOpaqueSphereIsAsBrightAsTheSky) {
  create_uniform_sky();
  const GeometryId sphere = add(make_sphere(1.0, 4));
  std::vector<Material> materials = white_materials();
  for (Material& material : materials)
    material.transmission = 0.0;
  std::vector<Camera> cameras;
  for (std::size_t k = 0; k < materials.size(); ++k) {
    const double y_m = spacing_m * static_cast<double>(k);
    create_body(sphere, {5.0, y_m, 0.0}, materials[k]);
    cameras.push_back({.p_m = {0.0f, static_cast<float>(y_m), 0.0f}, .horizontal_angle_rad = 0.3f});
  }
  expect_furnace(materials, cameras, 4);
}

/// Light is reflected within a sphere that is clear in part until it passes through the clear part. Spheres
/// with little of it, or with a high index, reflect light within more often than an image allows.
TEST_P(ImageOfMaterials, AWhiteClearSphereIsAsBrightAsTheSky) {
  create_uniform_sky();
  const GeometryId sphere = add(make_sphere(1.0, 4));
  std::vector<Material> materials;
  for (const double index : {1.2, 1.5})
    for (const double roughness : {0.0, 1.0})
      for (const double metallic : {0.0, 0.5})
        materials.push_back({.base_color = glm::dvec3(1.0),
                             .metallic = metallic,
                             .roughness = roughness,
                             .transmission = 1.0,
                             .refractive_index = index});
  std::vector<Camera> cameras;
  for (std::size_t k = 0; k < materials.size(); ++k) {
    const double y_m = spacing_m * static_cast<double>(k);
    create_body(sphere, {5.0, y_m, 0.0}, materials[k]);
    cameras.push_back({.p_m = {0.0f, static_cast<float>(y_m), 0.0f}, .horizontal_angle_rad = 0.3f});
  }
  expect_furnace(materials, cameras, 64, 0.02, 8, 48);
}

/// A path that a mirror sends into the surface is lost, and the remaining paths weigh more. Within a body
/// that repeats at each bounce and adds noise, so a rough mirror must lose few paths.
TEST_F(ImageTest, ARoughMirrorLosesFewPaths) {
  const glm::dvec3 all(sky_cdpm2);
  create_light({.kind = LightKind::sky, .zenith_cdpm2 = all, .horizon_cdpm2 = all, .ground_cdpm2 = all});
  create_body(add(make_rectangle(4.0, 4.0)), {}, {.base_color = glm::dvec3(1.0), .metallic = 1.0});
  for (const double angle_rad : {1.5, 0.8, 0.4}) {  // between the plate and the ray
    const glm::dvec3 from = 5.0 * glm::dvec3(-std::cos(angle_rad), 0.0, std::sin(angle_rad));
    const Image& image =
        image_of({.p_m = glm::vec3(from), .q = glm::quat(pitched(angle_rad)), .horizontal_angle_rad = 0.1f},
                 {.width = 64, .height = 64, .outputs = linear_color, .samples_per_pixel = 1, .bounces = 1});
    double square = 0.0;
    std::uint32_t dark = 0;
    for (std::uint32_t row = 0; row < 64; ++row)
      for (std::uint32_t column = 0; column < 64; ++column) {
        const double share = color_at(image, column, row).x / sky_cdpm2;
        square += share * share / (64.0 * 64.0);
        if (share == 0.0) ++dark;
      }
    EXPECT_LT(square, 1.3) << angle_rad;
    EXPECT_LT(dark, 41u) << angle_rad;
  }
}

// ---- the light of a lamp

double lambda_of(double cosine, double alpha) {
  return 0.5 * (std::sqrt(1.0 + alpha * alpha * (1.0 / (cosine * cosine) - 1.0)) - 1.0);
}

double schlick(double normal_share, double cosine) {
  return normal_share + (std::min(50.0 * normal_share, 1.0) - normal_share) * std::pow(1.0 - cosine, 5.0);
}

glm::dvec3 direction_at(double cosine, double angle) {
  const double sine = std::sqrt(1.0 - cosine * cosine);
  return {sine * std::cos(angle), sine * std::sin(angle), cosine};
}

/// The share of uniform light that microfacets reflect once: an integral over their normals, by the density
/// of normals.
double reflected_once(double normal_share, const glm::dvec3& o, double alpha) {
  constexpr int side = 160;
  double sum = 0.0;
  for (int row = 0; row < side; ++row) {
    const double u = (row + 0.5) / side;
    const double cosine = 1.0 / std::sqrt(1.0 + alpha * alpha * u / (1.0 - u));
    for (int column = 0; column < side; ++column) {
      const glm::dvec3 h = direction_at(cosine, 2.0 * pi * (column + 0.5) / side);
      const glm::dvec3 i = 2.0 * glm::dot(o, h) * h - o;
      if (glm::dot(o, h) <= 0.0 || i.z <= 0.0) continue;
      const double both = 1.0 + lambda_of(o.z, alpha) + lambda_of(i.z, alpha);
      sum += schlick(normal_share, glm::dot(o, h)) * glm::dot(o, h) / (o.z * h.z * both);
    }
  }
  return sum / (side * side);
}

/// The light per illuminance that a mirror above a matt base reflects: a metal with base = 0.
double reflected(double normal_share, double base, const glm::dvec3& o, const glm::dvec3& i, double alpha) {
  const glm::dvec3 h = glm::normalize(i + o);
  const double root = h.x * h.x / (alpha * alpha) + h.y * h.y / (alpha * alpha) + h.z * h.z;
  const double density = 1.0 / (pi * alpha * alpha * root * root);
  const double both = 1.0 + lambda_of(o.z, alpha) + lambda_of(i.z, alpha);
  const double gain = 1.0 + normal_share * (1.0 / reflected_once(1.0, o, alpha) - 1.0);
  const double mirror = schlick(normal_share, glm::dot(o, h)) * gain * density / (4.0 * o.z * i.z * both);
  return mirror + base * (1.0 - gain * reflected_once(normal_share, o, alpha)) / pi;
}

/// A plate of a random mixture under a lamp has the sum of the luminances of its shares.
TEST_P(ImageOfMaterials, AMixtureReflectsAsItsKindsAlone) {
  std::mt19937 random(91);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const GeometryId plate = add(make_rectangle(1.0, 1.0));
  for (int k = 0; k < 60; ++k) {
    const double metallic = k % 6 == 0 ? 0.0 : k % 6 == 1 ? 1.0 : share(random);
    const double roughness = 0.15 + 0.85 * share(random);
    const double transmission = k % 2 == 0 ? 0.0 : share(random);
    const double color = share(random), index = 1.0 + share(random);
    const glm::dvec3 o = direction_at(0.2 + 0.8 * share(random), pi);
    const glm::dvec3 i = direction_at(0.2 + 0.8 * share(random), 2.0 * pi * share(random));
    const EntityId body = create_body(plate, {},
                                      {.base_color = glm::dvec3(color),
                                       .metallic = metallic,
                                       .roughness = roughness,
                                       .transmission = transmission,
                                       .refractive_index = index});
    const EntityId lamp = create_light({.kind = LightKind::point, .intensity_cd = 1e5}, 10.0 * i);
    const std::vector<double> found = means_of({{.p_m = glm::vec3(20.0 * o),
                                                 .q = glm::quat(pitched(std::asin(o.z))),
                                                 .horizontal_angle_rad = 0.0002f}},
                                               4, 1);
    const double alpha = roughness * roughness;
    const double at_normal = std::pow((index - 1.0) / (index + 1.0), 2.0);
    const double metal = reflected(color, 0.0, o, i, alpha);
    const double dielectric = reflected(at_normal, color, o, i, alpha);
    const double mixture = metallic * metal + (1.0 - metallic) * (1.0 - transmission) * dielectric;
    const double expected = 1e5 / 100.0 * i.z * mixture;
    EXPECT_NEAR(found[0], expected, 0.01 * expected)
        << "metallic " << metallic << ", roughness " << roughness << ", transmission " << transmission
        << ", base color " << color << ", index " << index << ", to camera " << o.z << ", to lamp " << i.z;
    remove(body, {});
    remove(lamp, {});
  }
}

INSTANTIATE_TEST_SUITE_P(Both, ImageOfMaterials,
                         testing::Values(ImageMode::path_traced, ImageMode::real_time),
                         [](const auto& mode) { return std::string(to_string(mode.param)); });

}  // namespace
}  // namespace rtstdb::test
