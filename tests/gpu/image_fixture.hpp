#pragma once
// Fixture of tests of images: one image of one camera, and its colours.

#include <glm/gtc/packing.hpp>

#include <memory>
#include <string>
#include <vector>

#include "tests/gpu/database_fixture.hpp"

namespace rtstdb::test {

inline constexpr ImageOutputs first_hits{
    .srgb = false, .depth = true, .identity = true, .normal = true, .motion = true};
inline constexpr ImageOutputs linear_color{.color = true, .srgb = false};

inline glm::dvec3 color_at(const Image& image, std::uint32_t column, std::uint32_t row) {
  const HalfColor& color = image.color[std::size_t{row} * image.width + column];
  return {glm::unpackHalf1x16(color[0]), glm::unpackHalf1x16(color[1]), glm::unpackHalf1x16(color[2])};
}

/// Of the pixels from `first` to before `end` in both directions.
inline glm::dvec3 mean_color(const Image& image, glm::uvec2 first, glm::uvec2 end) {
  glm::dvec3 sum(0.0);
  for (std::uint32_t row = first.y; row < end.y; ++row)
    for (std::uint32_t column = first.x; column < end.x; ++column)
      sum += color_at(image, column, row);
  return sum / static_cast<double>((end.x - first.x) * (end.y - first.y));
}

inline glm::dvec3 mean_color(const Image& image) {
  return mean_color(image, {0, 0}, {image.width, image.height});
}

class ImageTest : public DatabaseTest {
 protected:
  /// The image of one camera. It is valid until the next call.
  const Image& image_of(const Camera& camera, ImageQueryOptions options) {
    options.name = "camera";
    query_ = prepare(options);
    query_->cameras()[0] = camera;
    const Outcome outcome = run(*query_, 1);
    EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
    return query_->images()[0];
  }
  /// Of a query with these options; empty: it is accepted.
  std::string refusal(const ImageQueryOptions& options) {
    const auto query = database().prepare(options);
    return query ? std::string() : query.error().message;
  }
  MaterialId add_material(const Material& material) {
    const auto added = database().add_material(material, "material");
    EXPECT_TRUE(added) << added.error().message;
    return added ? added.value() : MaterialId{};
  }
  LightId add_light(const Light& light) {
    const auto added = database().add_light(light, "light");
    EXPECT_TRUE(added) << added.error().message;
    return added ? added.value() : LightId{};
  }
  EntityId create_light(const Light& light, const glm::dvec3& p_m = glm::dvec3(0.0),
                        const glm::dquat& q = glm::dquat(1.0, 0.0, 0.0, 0.0)) {
    EntityRow row;
    row.light = add_light(light);
    row.motion.p_world_m = p_m;
    row.motion.q_world = q;
    return create(row);
  }
  EntityId create_body(GeometryId geometry, const glm::dvec3& p_m, const Material& material) {
    EntityRow row = row_of(geometry, p_m);
    row.material = add_material(material);
    return create(row);
  }

 private:
  std::unique_ptr<ImageQuery> query_;
};

}  // namespace rtstdb::test
