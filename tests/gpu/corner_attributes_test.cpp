// Corner normals and colours on the device: a kernel reads what was added, at corners and between them, also
// after the pool grew or was restored.

#include <glm/geometric.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include <rtstdb/srgb.hpp>

#include "shaders/shared/corner.h"
#include "tests/gpu/executor_fixture.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/gpu/structure_walk.hpp"

namespace rtstdb::test {
namespace {

struct TrianglePoint {
  std::uint32_t geometry = 0, triangle = 0;
  float u = 0.0f, v = 0.0f;
};

struct PointValues {
  glm::dvec3 normal, color;
};

glm::dvec3 encoded(const glm::dvec3& linear) {
  return {srgb_from_linear(linear.x), srgb_from_linear(linear.y), srgb_from_linear(linear.z)};
}

double angle_deg(const glm::dvec3& a, const glm::dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * 180.0 / 3.14159265358979;
}

double largest_part(const glm::dvec3& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

class CornerAttributes : public StructureTest {
 protected:
  TriangleMesh random_mesh(std::uint32_t triangles) {
    TriangleMesh mesh;
    for (std::uint32_t i = 0; i < triangles; ++i) {
      CornerValues& normals = mesh.corner_normals.emplace_back();
      CornerValues& colors = mesh.corner_colors.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        mesh.positions_m.emplace_back(random_.vector());
        normals[k] = glm::vec3(glm::normalize(random_.vector()));
        for (int part = 0; part < 3; ++part)
          colors[k][part] = static_cast<float>(random_.uniform(0.0, 1.0));
      }
      mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    return mesh;
  }

  std::vector<PointValues> values_at(const std::vector<TrianglePoint>& points) {
    return values_at(device(), pool_, submit_, points);
  }
  std::vector<PointValues> values_at(gpu::Device& device, const accel::GeometryPool& pool,
                                     accel::Submit& submit, const std::vector<TrianglePoint>& points) {
    auto pipeline =
        device.create_pipeline(gpu::test::test_shader_info(gpu::test::TestShader::corner_attributes));
    auto given = device.create_buffer(
        {.name = "points", .size_bytes = 16 * points.size(), .memory = gpu::Memory::upload});
    auto values = device.create_buffer(
        {.name = "values", .size_bytes = 24 * points.size(), .memory = gpu::Memory::readback});
    if (!pipeline || !given || !values) {
      ADD_FAILURE() << "the kernel can not be prepared";
      return {};
    }
    std::ranges::transform(points, given.value().host_as<glm::vec4>().begin(),
                           [](const TrianglePoint& point) {
                             return glm::vec4(std::bit_cast<float>(point.geometry),
                                              std::bit_cast<float>(point.triangle), point.u, point.v);
                           });
    const gpu::BufferPart parts[] = {
        {&pool.geometries()}, {&pool.attributes()}, {&given.value()}, {&values.value()}};
    auto bindings = device.create_bindings(pipeline.value(), parts);
    if (!bindings) {
      ADD_FAILURE() << bindings.error().message;
      return {};
    }
    const auto count = static_cast<std::uint32_t>(points.size());
    submit.begin();
    submit.recorder().dispatch(pipeline.value(), bindings.value(), shared::CountArgs{count},
                               (count + 63) / 64);
    EXPECT_TRUE(submit.run());
    std::vector<PointValues> read;
    const auto words = values.value().host_as<glm::vec3>();
    for (std::size_t i = 0; i < points.size(); ++i)
      read.push_back({glm::dvec3(words[2 * i]), glm::dvec3(words[2 * i + 1])});
    return read;
  }

  /// The values at all corners are those of the mesh, within the error of the encoding.
  void expect_corners(const std::vector<PointValues>& read, const TriangleMesh& mesh) {
    ASSERT_EQ(read.size(), 3 * mesh.triangles.size());
    double angle = 0.0, difference = 0.0;
    for (std::size_t i = 0; i < read.size(); ++i) {
      const glm::dvec3 color(mesh.corner_colors[i / 3][i % 3]);
      difference = std::max(difference, largest_part(encoded(read[i].color) - encoded(color)));
      if (mesh.corner_normals.empty()) {
        EXPECT_EQ(read[i].normal, glm::dvec3(0.0));
        continue;
      }
      angle = std::max(angle, angle_deg(read[i].normal, glm::dvec3(mesh.corner_normals[i / 3][i % 3])));
      EXPECT_NEAR(glm::length(read[i].normal), 1.0, 1e-6);
    }
    EXPECT_LT(angle, 0.01);
    EXPECT_LT(difference, 1.0 / 255.0);
  }
  static std::vector<TrianglePoint> corners_of(std::uint32_t geometry, const TriangleMesh& mesh) {
    std::vector<TrianglePoint> corners;
    for (std::uint32_t i = 0; i < 3 * mesh.triangles.size(); ++i)
      corners.push_back({geometry, i / 3, i % 3 == 1 ? 1.0f : 0.0f, i % 3 == 2 ? 1.0f : 0.0f});
    return corners;
  }
  void expect_on_device(std::uint32_t geometry, const TriangleMesh& mesh) {
    SCOPED_TRACE(geometry);
    expect_corners(values_at(corners_of(geometry, mesh)), mesh);
  }
  std::uint32_t first_texel_of(std::uint32_t geometry) {
    return pool_.geometries().host_as<shared::GeometryRecord>()[geometry].attributes;
  }

  Random random_{51};
};

TEST_F(CornerAttributes, AreThoseOfTheMesh) {
  const TriangleMesh mesh = random_mesh(5000);
  expect_on_device(add(mesh), mesh);
}

/// Of 256 bytes, each is the same after encoding and decoding, black and white exactly.
TEST_F(CornerAttributes, KeepEachByteOfAColour) {
  TriangleMesh mesh = random_mesh(256);
  for (std::size_t byte = 0; byte < 256; ++byte)
    mesh.corner_colors[byte].fill(
        glm::vec3(static_cast<float>(linear_from_srgb(static_cast<double>(byte) / 255.0))));
  const auto read = values_at(corners_of(add(mesh), mesh));
  for (std::size_t i = 0; i < read.size(); ++i) {
    const std::size_t byte = i / 3;
    EXPECT_NEAR(encoded(read[i].color).y * 255.0, static_cast<double>(byte), 1e-3);
  }
  EXPECT_EQ(read.front().color, glm::dvec3(0.0));
  EXPECT_NEAR(read.back().color.x, 1.0, 1e-6);
}

TEST_F(CornerAttributes, AreInterpolatedInLinearLight) {
  const TriangleMesh mesh = random_mesh(300);
  const std::uint32_t geometry = add(mesh);
  std::vector<TrianglePoint> points;
  for (std::uint32_t i = 0; i < 300; ++i) {
    const double u = random_.uniform(0.0, 1.0);
    points.push_back({geometry, i, static_cast<float>(u), static_cast<float>(random_.uniform(0.0, 1.0 - u))});
  }
  const auto read = values_at(points);
  for (std::size_t i = 0; i < read.size(); ++i) {
    const glm::dvec3 weights(1.0f - points[i].u - points[i].v, points[i].u, points[i].v);
    glm::dvec3 normal(0.0), color(0.0);
    for (std::size_t k = 0; k < 3; ++k) {
      normal += weights[static_cast<int>(k)] * glm::dvec3(mesh.corner_normals[i][k]);
      color += weights[static_cast<int>(k)] * glm::dvec3(mesh.corner_colors[i][k]);
    }
    // The steps of the encoding: half of at most 2.3/255 of light, near white, and 0.01 degrees.
    EXPECT_LT(largest_part(read[i].color - color), 1.2 / 255.0);
    EXPECT_LT(angle_deg(read[i].normal, normal) * glm::length(normal), 0.01);
  }
}

TEST_F(CornerAttributes, MayBeAbsent) {
  TriangleMesh plain = make_box({1.0, 1.0, 1.0});
  TriangleMesh colored = random_mesh(20), lit = random_mesh(20);
  colored.corner_normals.clear();
  lit.corner_colors.clear();
  const std::uint32_t of_plain = add(plain), of_colored = add(colored), of_lit = add(lit);
  EXPECT_EQ(first_texel_of(of_plain), shared::attributes_none);
  EXPECT_EQ(first_texel_of(of_colored), 0u);
  expect_on_device(of_colored, colored);
  lit.corner_colors.resize(20, {glm::vec3(1), glm::vec3(1), glm::vec3(1)});
  expect_on_device(of_lit, lit);
  const auto read = values_at({{of_plain, 3, 0.25f, 0.25f}});
  EXPECT_EQ(read[0].normal, glm::dvec3(0.0));
  EXPECT_EQ(read[0].color, glm::dvec3(1.0));
}

/// Halfway between opposite normals there is none. The length of the given ones does not count.
TEST_F(CornerAttributes, HaveNoNormalBetweenOppositeOnes) {
  TriangleMesh mesh = random_mesh(1);
  const glm::vec3 x(1, 0, 0);
  mesh.corner_normals[0] = {1e-30f * x, -3e38f * x, x};
  const std::uint32_t geometry = add(mesh);
  const auto read =
      values_at({{geometry, 0, 0.5f, 0.0f}, {geometry, 0, 0.75f, 0.0f}, {geometry, 0, 0.25f, 0.0f}});
  EXPECT_EQ(read[0].normal, glm::dvec3(0.0));
  EXPECT_EQ(read[1].normal, glm::dvec3(-1, 0, 0));
  EXPECT_EQ(read[2].normal, glm::dvec3(1, 0, 0));
}

TEST_F(CornerAttributes, StayWhenThePoolGrows) {
  std::vector<TriangleMesh> meshes{random_mesh(1), make_box({1.0, 1.0, 1.0}), random_mesh(30),
                                   random_mesh(3000)};
  std::uint32_t generation = pool_.generation();
  int growths = 0;
  for (const TriangleMesh& mesh : meshes) {
    const std::size_t size = pool_.attributes().size_bytes();
    add(mesh);
    if (pool_.attributes().size_bytes() != size) {
      EXPECT_GT(pool_.generation(), generation);
      ++growths;
    }
    generation = pool_.generation();
  }
  EXPECT_GE(growths, 2);
  for (std::uint32_t geometry = 0; geometry < meshes.size(); ++geometry)
    if (!meshes[geometry].corner_normals.empty()) expect_on_device(geometry, meshes[geometry]);
}

TEST_F(CornerAttributes, AreRemovedWithTheirGeometry) {
  const TriangleMesh kept = random_mesh(40), removed = random_mesh(50), next = random_mesh(60);
  const std::uint32_t first = add(kept);
  const std::uint32_t last = add(removed);
  const std::uint32_t texel = first_texel_of(last);
  pool_.remove_last();
  add(make_box({1.0, 1.0, 1.0}));
  pool_.remove_last();
  EXPECT_EQ(add(next), last);
  EXPECT_EQ(first_texel_of(last), texel);
  expect_on_device(first, kept);
  expect_on_device(last, next);
}

/// Its normals would not fit another shape.
TEST_F(CornerAttributes, OfDeformingGeometryAreItsColours) {
  TriangleMesh mesh = random_mesh(200);
  add(random_mesh(3));
  const std::uint32_t geometry = add(mesh, {.deforms = true});
  mesh.corner_normals.clear();
  expect_on_device(geometry, mesh);
  std::vector<glm::vec3> moved_m = mesh.positions_m;
  for (glm::vec3& p : moved_m)
    p *= 1.5f;
  ASSERT_TRUE(pool_.show(device(), FixedRows({}, 2, 2, moved_m), submit_));
  expect_on_device(geometry, mesh);
  TriangleMesh lit = random_mesh(10);
  lit.corner_colors.clear();
  EXPECT_EQ(first_texel_of(add(lit, {.deforms = true})), shared::attributes_none);
}

/// As after the loss of a device. What is added later is behind what was restored.
TEST_F(CornerAttributes, AreRestoredOnAnotherDevice) {
  std::vector<TriangleMesh> meshes{random_mesh(700), make_box({1.0, 1.0, 1.0}), random_mesh(90),
                                   random_mesh(80)};
  for (std::size_t i = 0; i < meshes.size(); ++i)
    add(meshes[i], {.deforms = i == 2});
  meshes[2].corner_normals.clear();
  auto other = gpu::Device::open(gpu::test::test_device_options(true));
  ASSERT_TRUE(other.ok()) << other.error().message;
  gpu::Device& device = *other.value();
  accel::Submit submit = accel::Submit::create(device).value();
  auto restored = accel::GeometryPool::create_restored(device, 8, pool_.kept(), submit);
  ASSERT_TRUE(restored.ok()) << restored.error().message;
  accel::GeometryPool& pool = restored.value();
  meshes.push_back(random_mesh(4000));
  ASSERT_TRUE(pool.add(device, std::make_shared<const TriangleMesh>(meshes.back()), submit).ok());
  for (std::uint32_t geometry = 0; geometry < meshes.size(); ++geometry) {
    SCOPED_TRACE(geometry);
    const auto record = pool.geometries().host_as<shared::GeometryRecord>()[geometry];
    if (geometry < 4) {
      EXPECT_EQ(record.attributes, first_texel_of(geometry));
    }
    if (meshes[geometry].corner_colors.empty()) continue;
    expect_corners(values_at(device, pool, submit, corners_of(geometry, meshes[geometry])), meshes[geometry]);
  }
  for (const std::string& message : device.validation_messages())
    ADD_FAILURE() << "validation layer: " << message;
}

}  // namespace
}  // namespace rtstdb::test
