// A device that fails as real ones do: out of memory, lost. The faults come from fault_loader.cpp.

#include <dlfcn.h>

#include <limits>

#include "tests/gpu/gpu_test.hpp"

namespace rtstdb::gpu::test {
namespace {

// Vulkan's numbers, which this room alone may take from its headers.
constexpr int out_of_host_memory = -1;
constexpr int out_of_device_memory = -2;
constexpr int device_lost = -4;
constexpr int for_ever = std::numeric_limits<int>::max();

class FaultTest : public testing::Test {
 protected:
  void SetUp() override {
    DeviceOptions options = test_device_options(false);
    options.loader_library = FAULT_LOADER;
    auto device = Device::open(options);
    ASSERT_TRUE(device.ok()) << device.error().message;
    device_ = std::move(device).value();
    void* library = dlopen(FAULT_LOADER, RTLD_NOW | RTLD_LOCAL);
    ASSERT_NE(library, nullptr) << dlerror();
    set_fault_ = reinterpret_cast<SetFault*>(dlsym(library, "set_vulkan_fault"));
    ASSERT_NE(set_fault_, nullptr);
  }
  void TearDown() override {
    for (const char* function : {"vkAllocateMemory", "vkQueueSubmit2", "vkWaitSemaphores",
                                 "vkGetQueryPoolResults", "vkCreateComputePipelines"}) {
      set_fault(function, 0, 0);
    }
  }

  void set_fault(const char* function, int result, int times) {
    ASSERT_EQ(set_fault_(function, result, times), 0);
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

  using SetFault = int(const char*, int, int);
  std::unique_ptr<Device> device_;
  SetFault* set_fault_ = nullptr;
  Buffer words_;
  Recorder recorder_;
  Timeline timeline_;
};

TEST_F(FaultTest, WithoutAFaultItIsAnOrdinaryDevice) {
  make_work();
  const std::uint64_t number = timeline_.submit(recorder_);
  ASSERT_EQ(timeline_.wait(number, test_timeout_ns), WaitResult::done);
  EXPECT_EQ(words_.host_as<std::uint32_t>()[15], 5u);
}

TEST_F(FaultTest, NoMemoryForABufferIsAnErrorAndTheDeviceLivesOn) {
  for (const int result : {out_of_device_memory, out_of_host_memory}) {
    set_fault("vkAllocateMemory", result, for_ever);
    const auto refused = device().create_buffer({.name = "big one", .size_bytes = 4096});
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::out_of_memory);
    EXPECT_NE(refused.error().message.find("big one"), std::string::npos) << refused.error().message;
    EXPECT_NE(refused.error().message.find("4096"), std::string::npos) << refused.error().message;
    EXPECT_FALSE(device().lost());
    set_fault("vkAllocateMemory", 0, 0);
    const auto made = device().create_buffer({.name = "big one", .size_bytes = 4096});
    EXPECT_TRUE(made.ok()) << made.error().message;
  }
}

TEST_F(FaultTest, NoMemoryForAPipelineIsAnError) {
  set_fault("vkCreateComputePipelines", out_of_device_memory, 1);
  const auto refused = device().create_pipeline(test_shader_info(TestShader::add));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::out_of_memory);
  EXPECT_NE(refused.error().message.find("add"), std::string::npos) << refused.error().message;
  EXPECT_TRUE(device().create_pipeline(test_shader_info(TestShader::add)).ok());
}

TEST_F(FaultTest, LostAtSubmit) {
  make_work();
  set_fault("vkQueueSubmit2", device_lost, 1);
  EXPECT_EQ(timeline_.submit(recorder_), 0u);
  expect_lost_everywhere();
}

TEST_F(FaultTest, LostWhileWaiting) {
  make_work();
  const std::uint64_t number = timeline_.submit(recorder_);
  ASSERT_NE(number, 0u);
  // In truth the work is done; its memory must not go before that.
  ASSERT_EQ(timeline_.wait(number, test_timeout_ns), WaitResult::done);
  set_fault("vkWaitSemaphores", device_lost, 1);
  EXPECT_EQ(timeline_.wait(number, test_timeout_ns), WaitResult::lost);
  EXPECT_EQ(timeline_.elapsed_ns(recorder_, 0, 1), 0);
  expect_lost_everywhere();
}

TEST_F(FaultTest, LostWhenReadingTimestamps) {
  make_work();
  const std::uint64_t number = timeline_.submit(recorder_);
  ASSERT_EQ(timeline_.wait(number, test_timeout_ns), WaitResult::done);
  set_fault("vkGetQueryPoolResults", device_lost, 1);
  EXPECT_EQ(timeline_.elapsed_ns(recorder_, 0, 1), 0);
  expect_lost_everywhere();
}

TEST_F(FaultTest, LostWhenCreatingAPipeline) {
  make_work();
  set_fault("vkCreateComputePipelines", device_lost, 1);
  const auto refused = device().create_pipeline(test_shader_info(TestShader::add));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::device_lost);
  expect_lost_everywhere();
}

TEST_F(FaultTest, AfterALossANewDeviceWorks) {
  make_work();
  set_fault("vkQueueSubmit2", device_lost, 1);
  EXPECT_EQ(timeline_.submit(recorder_), 0u);
  recorder_ = Recorder{};
  timeline_ = Timeline{};
  words_ = Buffer{};
  DeviceOptions options = test_device_options(false);
  options.loader_library = FAULT_LOADER;
  auto again = Device::open(options);
  ASSERT_TRUE(again.ok()) << again.error().message;
  device_ = std::move(again).value();
  make_work();
  ASSERT_EQ(timeline_.wait(timeline_.submit(recorder_), test_timeout_ns), WaitResult::done);
  EXPECT_EQ(words_.host_as<std::uint32_t>()[0], 5u);
}

}  // namespace
}  // namespace rtstdb::gpu::test
