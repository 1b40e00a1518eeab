// Messages of the validation layer are reported: all other tests rely on it.

#include <algorithm>

#include "tests/gpu/gpu_fixture.hpp"

namespace rtstdb::gpu::test {
namespace {

class ValidationTest : public GpuTest {};

/// Records a copy with overlapping ranges, which the recorder does not check.
void break_a_rule(Device& device, Buffer& words) {
  auto recorder = device.create_recorder();
  ASSERT_TRUE(recorder.ok()) << recorder.error().message;
  recorder.value().begin();
  recorder.value().copy(words, 0, words, 4, 16);
  recorder.value().end();
}

TEST_F(ValidationTest, ReportsABrokenRule) {
  Buffer words = make_buffer({.name = "overlapping words", .size_bytes = 64});
  EXPECT_TRUE(device().validation_messages().empty());
  break_a_rule(device(), words);
  break_a_rule(device(), words);
  const auto messages = take_messages();
  const auto about_copy = std::ranges::count_if(messages, [](const std::string& message) {
    return message.find("VUID-vkCmdCopyBuffer-pRegions-00117") != std::string::npos;
  });
  EXPECT_GE(about_copy, 1) << (messages.empty() ? "no message at all" : messages.front());
  EXPECT_EQ(static_cast<std::size_t>(about_copy), messages.size());
}

TEST(Validation, ReportsNothingIfItIsOff) {
  const auto device = Device::open(test_device_options(false));
  ASSERT_TRUE(device.ok()) << device.error().message;
  auto words = device.value()->create_buffer({.name = "words", .size_bytes = 64});
  ASSERT_TRUE(words.ok()) << words.error().message;
  break_a_rule(*device.value(), words.value());
  EXPECT_TRUE(device.value()->validation_messages().empty());
}

class ShaderCheckDeathTest : public GpuTest {};

TEST_F(ShaderCheckDeathTest, AbortsIfTheCodeOfAKernelDiffersFromTheTable) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  ShaderInfo wrong = test_shader_info(TestShader::add);
  wrong.group_size = 128;
  EXPECT_DEATH((void)device().create_pipeline(wrong),
               "shader add .*group size 128x1x1, the code says 64x1x1");
  wrong = test_shader_info(TestShader::add);
  wrong.spirv = wrong.spirv.first(5);  // a header and nothing else
  EXPECT_DEATH((void)device().create_pipeline(wrong), "shader add: its code is not one compute shader");
}

TEST_F(ShaderCheckDeathTest, CreatesAPipelineForEachKernel) {
  for (std::uint16_t i = 0; i < static_cast<std::uint16_t>(ShaderId::count); ++i) {
    const ShaderInfo& shader = shader_info(static_cast<ShaderId>(i));
    if (shader.stage() != ShaderStage::compute) continue;
    const auto pipeline = device().create_pipeline(static_cast<ShaderId>(i));
    ASSERT_TRUE(pipeline.ok()) << pipeline.error().message;
    EXPECT_EQ(pipeline.value().group_size(), shader.group_size);
  }
}

}  // namespace
}  // namespace rtstdb::gpu::test
