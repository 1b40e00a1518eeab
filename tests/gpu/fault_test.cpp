// A device that runs out of memory or is lost; fault_loader.cpp causes the faults.

#include "tests/gpu/fault_loader.hpp"
#include "tests/gpu/gpu_fixture.hpp"

namespace rtstdb::gpu::test {
namespace {

class FaultTest : public testing::Test {
 protected:
  void SetUp() override {
    DeviceOptions options = test_device_options(false);
    options.loader_library = FAULT_LOADER;
    auto device = Device::open(options);
    ASSERT_TRUE(device.ok()) << device.error().message;
    device_ = std::move(device).value();
  }

  Device& device() { return *device_; }

  /// A recorder with a little work that takes timestamps 0 and 1, and a timeline.
  void make_work() {
    auto words = device().create_buffer({.name = "words", .size_bytes = 64, .memory = Memory::readback});
    auto recorder = device().create_recorder();
    auto timeline = device().create_timeline();
    ASSERT_TRUE(words.ok() && recorder.ok() && timeline.ok());
    words_ = std::move(words).value();
    recorder_ = std::move(recorder).value();
    timeline_ = std::move(timeline).value();
    recorder_.begin();
    recorder_.timestamp(0);
    recorder_.fill(words_, 0, 64, 5);
    recorder_.timestamp(1);
    recorder_.end();
  }
  void expect_lost_everywhere() {
    EXPECT_TRUE(device().lost());
    EXPECT_EQ(timeline_.submit(recorder_), 0u);
    EXPECT_EQ(timeline_.wait(0, 0), WaitResult::lost);
    const auto buffer = device().create_buffer({.name = "late", .size_bytes = 64});
    ASSERT_FALSE(buffer.ok());
    EXPECT_EQ(buffer.error().code, ErrorCode::device_lost);
    EXPECT_NE(buffer.error().message.find("late"), std::string::npos) << buffer.error().message;
    EXPECT_FALSE(device().create_recorder().ok());
    EXPECT_FALSE(device().create_timeline().ok());
  }

  FaultLoader loader_;
  std::unique_ptr<Device> device_;
  Buffer words_;
  Recorder recorder_;
  Timeline timeline_;
};

TEST_F(FaultTest, WithoutAFaultTheDeviceWorks) {
  make_work();
  const std::uint64_t number = timeline_.submit(recorder_);
  ASSERT_EQ(timeline_.wait(number, test_timeout_ns), WaitResult::done);
  EXPECT_EQ(words_.host_as<std::uint32_t>()[15], 5u);
}

TEST_F(FaultTest, NoMemoryForABufferIsAnErrorAndTheDeviceGoesOn) {
  for (const int result : {FaultLoader::out_of_device_memory, FaultLoader::out_of_host_memory}) {
    loader_.fail("vkAllocateMemory", result, FaultLoader::for_ever);
    const auto refused = device().create_buffer({.name = "big one", .size_bytes = 4096});
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::out_of_memory);
    EXPECT_NE(refused.error().message.find("big one"), std::string::npos) << refused.error().message;
    EXPECT_NE(refused.error().message.find("4096"), std::string::npos) << refused.error().message;
    EXPECT_FALSE(device().lost());
    loader_.fail("vkAllocateMemory", 0, 0);
    const auto made = device().create_buffer({.name = "big one", .size_bytes = 4096});
    EXPECT_TRUE(made.ok()) << made.error().message;
  }
}

TEST_F(FaultTest, HostMemoryThatCanNotBeImportedIsCopied) {
  constexpr std::size_t size_bytes = 8192;
  HostMemory memory(size_bytes);
  for (const auto& [function, result] :
       {std::pair{"vkGetMemoryHostPointerPropertiesEXT", FaultLoader::invalid_external_handle},
        {"vkAllocateMemory", FaultLoader::invalid_external_handle},
        {"vkAllocateMemory", FaultLoader::out_of_device_memory}}) {
    make_work();
    loader_.fail(function, result, 1);
    auto made = device().create_buffer(
        {.name = "shared", .size_bytes = size_bytes, .memory = Memory::readback, .host = &memory});
    ASSERT_TRUE(made.ok()) << made.error().message;
    const Buffer shared = std::move(made).value();
    memory.as<std::uint32_t>()[1] = 17;
    memory.as<std::uint32_t>()[2] = 0;
    shared.flush(0, size_bytes);
    recorder_.begin();
    recorder_.copy(shared, 4, shared, 8, 4);
    recorder_.end();
    ASSERT_EQ(timeline_.wait(timeline_.submit(recorder_), test_timeout_ns), WaitResult::done);
    EXPECT_EQ(memory.as<std::uint32_t>()[2], 0u) << "the memory is shared, not copied";
    shared.invalidate(0, size_bytes);
    EXPECT_EQ(memory.as<std::uint32_t>()[2], 17u);
  }
}

TEST_F(FaultTest, NoMemoryForAPipelineIsAnError) {
  loader_.fail("vkCreateComputePipelines", FaultLoader::out_of_device_memory, 1);
  const auto refused = device().create_pipeline(test_shader_info(TestShader::add));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::out_of_memory);
  EXPECT_NE(refused.error().message.find("add"), std::string::npos) << refused.error().message;
  EXPECT_TRUE(device().create_pipeline(test_shader_info(TestShader::add)).ok());
}

TEST_F(FaultTest, ALossAtSubmitIsSeenByAllObjects) {
  make_work();
  loader_.fail("vkQueueSubmit2", FaultLoader::device_lost, 1);
  EXPECT_EQ(timeline_.submit(recorder_), 0u);
  expect_lost_everywhere();
}

TEST_F(FaultTest, ALossInAWaitIsSeenByAllObjects) {
  make_work();
  const std::uint64_t number = timeline_.submit(recorder_);
  ASSERT_NE(number, 0u);
  // The work completes first, since its memory is freed.
  ASSERT_EQ(timeline_.wait(number, test_timeout_ns), WaitResult::done);
  loader_.fail("vkWaitSemaphores", FaultLoader::device_lost, 1);
  EXPECT_EQ(timeline_.wait(number, test_timeout_ns), WaitResult::lost);
  EXPECT_EQ(timeline_.elapsed_ns(recorder_, 0, 1), 0);
  expect_lost_everywhere();
}

TEST_F(FaultTest, ALossAtTimestampsIsSeenByAllObjects) {
  make_work();
  const std::uint64_t number = timeline_.submit(recorder_);
  ASSERT_EQ(timeline_.wait(number, test_timeout_ns), WaitResult::done);
  loader_.fail("vkGetQueryPoolResults", FaultLoader::device_lost, 1);
  EXPECT_EQ(timeline_.elapsed_ns(recorder_, 0, 1), 0);
  expect_lost_everywhere();
}

TEST_F(FaultTest, ALossAtAPipelineIsSeenByAllObjects) {
  make_work();
  loader_.fail("vkCreateComputePipelines", FaultLoader::device_lost, 1);
  const auto refused = device().create_pipeline(test_shader_info(TestShader::add));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::device_lost);
  expect_lost_everywhere();
}

TEST_F(FaultTest, ALossAtTheFirstDispatchIsSeenByAllObjects) {
  make_work();
  device().compile_on_first_dispatch(true);
  auto add = device().create_pipeline(test_shader_info(TestShader::add));
  ASSERT_TRUE(add.ok());
  auto words = device().create_buffer({.name = "added", .size_bytes = 256, .memory = Memory::readback});
  const Buffer* const buffers[] = {&words.value()};
  auto bindings = device().create_bindings(add.value(), buffers);
  ASSERT_TRUE(bindings.ok());
  loader_.fail("vkCreateComputePipelines", FaultLoader::out_of_device_memory, 1);
  recorder_.begin();
  recorder_.dispatch(add.value(), bindings.value(), shared::AddArgs{}, 1);
  recorder_.end();
  expect_lost_everywhere();
}

TEST_F(FaultTest, ANewDeviceWorksAfterALoss) {
  make_work();
  loader_.fail("vkQueueSubmit2", FaultLoader::device_lost, 1);
  EXPECT_EQ(timeline_.submit(recorder_), 0u);
  recorder_ = Recorder{};
  timeline_ = Timeline{};
  words_ = Buffer{};
  DeviceOptions options = test_device_options(false);
  options.loader_library = FAULT_LOADER;
  auto reopened = Device::open(options);
  ASSERT_TRUE(reopened.ok()) << reopened.error().message;
  device_ = std::move(reopened).value();
  make_work();
  ASSERT_EQ(timeline_.wait(timeline_.submit(recorder_), test_timeout_ns), WaitResult::done);
  EXPECT_EQ(words_.host_as<std::uint32_t>()[0], 5u);
}

}  // namespace
}  // namespace rtstdb::gpu::test
