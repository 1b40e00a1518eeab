// A device draws triangles into a target.

#include "rtstdb/gpu/raster.hpp"

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <vector>

#include "tests/gpu/gpu_fixture.hpp"

namespace rtstdb::gpu::test {
namespace {

constexpr std::uint32_t width = 16, height = 8, pixels = width * height;
constexpr std::uint32_t nothing = 0xFFFFFFFFu;

class RasterTest : public GpuTest {
 protected:
  void SetUp() override {
    GpuTest::SetUp();
    ASSERT_GE(device().limits().max_raster_side, 1024u) << "the device can not draw";
  }
  /// Draws corners in clip coordinates; `commands` name them by vertex.
  void draw(const std::vector<glm::vec4>& corners, const std::vector<DrawCommand>& commands,
            bool with_words = true) {
    Buffer corner_buffer = make_buffer(
        {.name = "corners", .size_bytes = corners.size() * sizeof(glm::vec4), .memory = Memory::upload});
    std::ranges::copy(corners, corner_buffer.host_as<glm::vec4>().begin());
    Buffer command_buffer = make_buffer({.name = "commands",
                                         .size_bytes = commands.size() * sizeof(DrawCommand),
                                         .memory = Memory::upload,
                                         .indirect = true});
    std::ranges::copy(commands, command_buffer.host_as<DrawCommand>().begin());
    const ShaderInfo& fragment = test_shader_info(TestShader::identity);
    auto pipeline = device().create_raster_pipeline(test_shader_info(TestShader::triangles),
                                                    with_words ? &fragment : nullptr, beyond_);
    ASSERT_TRUE(pipeline) << pipeline.error().message;
    auto target = device().create_raster_target(
        {.name = "target", .width = width, .height = height, .words = with_words});
    ASSERT_TRUE(target) << target.error().message;
    const std::vector<const Buffer*> bound{&corner_buffer};
    auto bindings = device().create_bindings(pipeline.value(), bound);
    ASSERT_TRUE(bindings) << bindings.error().message;
    words_ = make_words(2 * pixels, 7);
    depth_ = make_words(pixels, 7);
    run([&](Recorder& recorder) {
      // Twice: the second draw begins with a clear target.
      for (int round = 0; round < 2; ++round) {
        recorder.draw(pipeline.value(), bindings.value(), {}, target.value(), command_buffer,
                      static_cast<std::uint32_t>(commands.size()));
        if (with_words) recorder.copy_words(target.value(), words_, 0);
        recorder.copy_depth(target.value(), depth_, 0);
        recorder.barrier();
      }
    });
  }
  glm::uvec2 words_at(std::uint32_t column, std::uint32_t row) const {
    return words_.host_as<const glm::uvec2>()[row * width + column];
  }
  float depth_at(std::uint32_t column, std::uint32_t row) const {
    return depth_.host_as<const float>()[row * width + column];
  }

  BeyondDepth beyond_ = BeyondDepth::clipped;

 private:
  Buffer words_, depth_;
};

/// A square of two triangles, in clip coordinates, at this depth.
std::vector<glm::vec4> square(glm::vec2 low, glm::vec2 high, float depth) {
  const auto at = [&](float x, float y) { return glm::vec4(x, y, depth, 1.0f); };
  return {at(low.x, low.y), at(high.x, low.y),  at(high.x, high.y),
          at(low.x, low.y), at(high.x, high.y), at(low.x, high.y)};
}

TEST_F(RasterTest, DrawsInstancesAndLeavesTheRestClear) {
  const auto left = square({-1.0f, -1.0f}, {0.0f, 1.0f}, 0.5f);
  draw(left, {{.vertices = 6, .instances = 1, .first_vertex = 0, .first_instance = 5}});
  for (std::uint32_t row = 0; row < height; ++row) {
    for (std::uint32_t column = 0; column < width; ++column) {
      const bool covered = column < width / 2;
      EXPECT_EQ(words_at(column, row).x, covered ? 5u : nothing);
      EXPECT_EQ(depth_at(column, row), covered ? 0.5f : 0.0f);
    }
  }
}

TEST_F(RasterTest, RowZeroIsAtTheTop) {
  draw(square({-1.0f, -1.0f}, {1.0f, -0.75f}, 0.5f),
       {{.vertices = 6, .instances = 1, .first_vertex = 0, .first_instance = 0}});
  EXPECT_EQ(words_at(3, 0).x, 0u);
  EXPECT_EQ(words_at(3, 1).x, nothing);
}

/// From both sides, in either order of the draws.
TEST_F(RasterTest, KeepsTheLargestDepth) {
  std::vector<glm::vec4> corners = square({-1.0f, -1.0f}, {1.0f, 1.0f}, 0.25f);
  const auto nearer = square({1.0f, -1.0f}, {0.0f, 1.0f}, 0.75f);
  corners.insert(corners.end(), nearer.begin(), nearer.end());
  const DrawCommand far{.vertices = 6, .instances = 1, .first_vertex = 0, .first_instance = 1};
  const DrawCommand near{.vertices = 6, .instances = 1, .first_vertex = 6, .first_instance = 2};
  for (const auto& commands : {std::vector{far, near}, std::vector{near, far}}) {
    draw(corners, commands);
    EXPECT_EQ(words_at(1, 1).x, 1u);
    EXPECT_EQ(words_at(14, 1).x, 2u);
    EXPECT_EQ(depth_at(14, 1), 0.75f);
  }
}

TEST_F(RasterTest, OfEqualDepthsTheFirstStays) {
  const auto corners = square({-1.0f, -1.0f}, {1.0f, 1.0f}, 0.25f);
  draw(corners, {{.vertices = 6, .instances = 1, .first_vertex = 0, .first_instance = 8},
                 {.vertices = 6, .instances = 0, .first_vertex = 0, .first_instance = 4},
                 {.vertices = 6, .instances = 1, .first_vertex = 0, .first_instance = 3}});
  EXPECT_EQ(words_at(5, 5).x, 8u);
}

TEST_F(RasterTest, DrawsDepthAlone) {
  draw(square({-1.0f, -1.0f}, {0.0f, 1.0f}, 0.5f),
       {{.vertices = 6, .instances = 1, .first_vertex = 0, .first_instance = 0}}, false);
  EXPECT_EQ(depth_at(0, 0), 0.5f);
  EXPECT_EQ(depth_at(15, 0), 0.0f);
}

TEST_F(RasterTest, ClipsOrClampsWhatIsBeyondTheDepths) {
  for (const BeyondDepth beyond : {BeyondDepth::clipped, BeyondDepth::clamped}) {
    beyond_ = beyond;
    draw(square({-1.0f, -1.0f}, {0.0f, 1.0f}, 1.5f),
         {{.vertices = 6, .instances = 1, .first_vertex = 0, .first_instance = 0}});
    EXPECT_EQ(depth_at(0, 0), beyond == BeyondDepth::clamped ? 1.0f : 0.0f);
    EXPECT_EQ(words_at(0, 0).x, beyond == BeyondDepth::clamped ? 0u : nothing);
  }
}

TEST_F(RasterTest, RefusesATargetLargerThanTheDeviceCanDraw) {
  const std::uint32_t side = device().limits().max_raster_side + 1;
  const auto target = device().create_raster_target({.name = "target", .width = side, .height = 1});
  ASSERT_FALSE(target);
  EXPECT_EQ(target.error().code, ErrorCode::capacity);
  EXPECT_NE(target.error().message.find(std::to_string(side) + " x 1 pixels"), std::string::npos);
}

TEST(RasterOptions, ADeviceThatDoesNotDrawHasNoRasterSide) {
  DeviceOptions options = test_device_options(false);
  options.draws = false;
  const auto device = Device::open(options);
  ASSERT_TRUE(device) << device.error().message;
  EXPECT_EQ(device.value()->limits().max_raster_side, 0u);
}

}  // namespace
}  // namespace rtstdb::gpu::test
