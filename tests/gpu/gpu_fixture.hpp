#pragma once
// Fixture of tests on a device: the device with the validation layer, each message of which fails the test,
// and the kernels of shaders/table.def. HIL_TEST_GPU selects the device (DeviceOptions::select).

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "rtstdb/gpu/device.hpp"
#include "tests/gpu/shaders/args.h"

namespace rtstdb::gpu::test {

enum class TestShader : std::uint8_t {
#define SHADER(name, source, defines, group_size, args, bindings) name,
#include "tests/gpu/shaders/table.def"
#undef SHADER
  count
};

const ShaderInfo& test_shader_info(TestShader shader);

/// On the device HIL_TEST_GPU or "auto".
DeviceOptions test_device_options(bool validation);
/// With validation; all tests of the process share the device.
DeviceOptions shared_device_options();

class GpuTest : public testing::Test {
 protected:
  void SetUp() override;
  /// Fails on any message of the validation layer.
  void TearDown() override;

  Device& device() { return *device_; }
  Buffer make_buffer(const BufferOptions& options);
  /// A buffer in readback memory with `count` equal words.
  Buffer make_words(std::size_t count, std::uint32_t word);
  Pipeline make_pipeline(TestShader shader);
  Bindings make_bindings(const Pipeline& pipeline, std::vector<const Buffer*> buffers);
  Recorder make_recorder();
  Timeline make_timeline();
  /// Records, submits and waits.
  void run(const std::function<void(Recorder&)>& record);

  /// The messages so far, which then do not fail the test.
  std::vector<std::string> take_messages();

 private:
  std::unique_ptr<Device> device_;
  std::size_t messages_taken_ = 0;
};

/// Long enough for the slowest machine, and shorter than the timeout of ctest.
inline constexpr std::int64_t test_timeout_ns = 60'000'000'000;

}  // namespace rtstdb::gpu::test
