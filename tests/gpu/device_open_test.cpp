// Opening a device: its properties, refusals, and the state of the calling thread.

#include <pthread.h>
#include <sched.h>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

#include <algorithm>
#include <cerrno>
#include <cfenv>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <thread>

#include "tests/gpu/gpu_fixture.hpp"

namespace rtstdb::gpu::test {
namespace {

/// Sets an environment variable until the end of the scope.
class ScopedEnvironment {
 public:
  ScopedEnvironment(const char* name, const char* value) : name_(name) {
    const char* before = std::getenv(name);
    had_value_ = before != nullptr;
    if (had_value_) before_ = before;
    setenv(name, value, 1);
  }
  ScopedEnvironment(const ScopedEnvironment&) = delete;
  ScopedEnvironment& operator=(const ScopedEnvironment&) = delete;
  ~ScopedEnvironment() {
    if (had_value_) {
      setenv(name_, before_.c_str(), 1);
    } else {
      unsetenv(name_);
    }
  }

 private:
  const char* name_;
  bool had_value_ = false;
  std::string before_;
};

std::string refusal(const DeviceOptions& options) {
  const auto device = Device::open(options);
  if (device) {
    ADD_FAILURE() << "opened " << device.value()->info().name;
    return {};
  }
  EXPECT_EQ(device.error().code, ErrorCode::no_device);
  return device.error().message;
}

void expect_text(const std::string& message, const std::string& part) {
  EXPECT_NE(message.find(part), std::string::npos) << "\"" << part << "\" is missing in: " << message;
}

TEST(DeviceOpen, ReportsItsProperties) {
  const auto device = Device::open(test_device_options(false));
  ASSERT_TRUE(device.ok()) << device.error().message;
  const DeviceInfo& info = device.value()->info();
  EXPECT_FALSE(info.name.empty());
  EXPECT_FALSE(info.driver.empty());
  EXPECT_TRUE(info.api.starts_with("1.")) << info.api;
  EXPECT_FALSE(device.value()->lost());
  if (info.name.starts_with("llvmpipe")) {
    EXPECT_TRUE(info.software);
    EXPECT_TRUE(info.driver.starts_with("llvmpipe Mesa ")) << info.driver;
  }
  // The minimum of Vulkan 1.3.
  const DeviceLimits& limits = device.value()->limits();
  EXPECT_GE(limits.max_storage_range_bytes, std::size_t{1} << 27);
  EXPECT_GE(limits.max_texel_elements, std::size_t{1} << 16);
  EXPECT_GE(limits.max_groups, 65535u);
  EXPECT_GE(limits.max_allocation_bytes, std::size_t{1} << 30);
}

TEST(DeviceOpen, ReportsTheProcessorsOfASoftwareDevice) {
  const std::uint32_t all = std::max(std::thread::hardware_concurrency(), 1u);
  const auto processors = [](const char* threads) {
    const ScopedEnvironment limited("LP_NUM_THREADS", threads);
    const auto device = Device::open(test_device_options(false));
    EXPECT_TRUE(device.ok());
    EXPECT_EQ(device.value()->limits().processors > 0, device.value()->info().software);
    return device.value()->info().software ? device.value()->limits().processors : 0;
  };
  const std::uint32_t one = processors("1");
  if (one == 0) return;  // a GPU reports none
  EXPECT_EQ(one, 1u);
  EXPECT_EQ(processors("0"), 1u) << "the thread of the driver computes";
  EXPECT_EQ(processors("1000"), all);
}

TEST(DeviceOpen, AcceptsAnIndexAndPartOfAName) {
  const auto devices = Device::list();
  ASSERT_FALSE(devices.empty());
  for (std::size_t i = 0; i < devices.size(); ++i) {
    const auto by_index = Device::open({.select = std::to_string(i)});
    if (!by_index) {  // open() refuses an unsuitable device
      expect_text(by_index.error().message, "unsuitable");
      continue;
    }
    EXPECT_EQ(by_index.value()->info().name, devices[i].name);
    const auto by_name = Device::open({.select = devices[i].name.substr(0, 6)});
    ASSERT_TRUE(by_name.ok()) << by_name.error().message;
    EXPECT_EQ(by_name.value()->info().name.substr(0, 6), devices[i].name.substr(0, 6));
  }
}

TEST(DeviceOpen, RefusesAnUnknownDeviceWithTheList) {
  const auto devices = Device::list();
  ASSERT_FALSE(devices.empty());
  for (const char* select : {"no such device", "1000"}) {
    const std::string message = refusal({.select = select});
    expect_text(message, select);
    expect_text(message, devices.front().name);
  }
}

TEST(DeviceOpen, NamesThePackageOfAMissingDriver) {
  const ScopedEnvironment no_driver("VK_DRIVER_FILES", "/nonexistent");
  const std::string message = refusal({});
  expect_text(message, "no Vulkan device");
  expect_text(message, "found none");
  expect_text(message, "mesa-vulkan-drivers");
  EXPECT_TRUE(Device::list().empty());
}

TEST(DeviceOpen, NamesThePackageOfAMissingLoader) {
  const std::string message = refusal({.loader_library = "libno_such_vulkan_loader.so.1"});
  expect_text(message, "libno_such_vulkan_loader.so.1");
  expect_text(message, "libvulkan1");
}

TEST(DeviceOpen, RefusesALibraryThatIsNoVulkanLoader) {
  expect_text(refusal({.loader_library = "libm.so.6"}), "libm.so.6");
}

TEST(DeviceOpen, NamesThePackageOfAMissingValidationLayer) {
  const ScopedEnvironment no_layers("VK_LAYER_PATH", "/nonexistent");
  const std::string message = refusal({.validation = true});
  expect_text(message, "VK_LAYER_KHRONOS_validation");
  expect_text(message, "vulkan-validationlayers");
  EXPECT_TRUE(Device::open(test_device_options(false)).ok()) << "validation off needs no layer";
}

/// What a driver must not change.
struct ThreadState {
  int policy = 0;
  int priority = 0;
  cpu_set_t affinity{};
  sigset_t signals{};
  int rounding = 0;
  unsigned float_control = 0;
  std::string name;
};

ThreadState state_of_this_thread() {
  ThreadState state;
  sched_param parameters{};
  EXPECT_EQ(pthread_getschedparam(pthread_self(), &state.policy, &parameters), 0);
  state.priority = parameters.sched_priority;
  EXPECT_EQ(sched_getaffinity(0, sizeof(state.affinity), &state.affinity), 0);
  EXPECT_EQ(pthread_sigmask(SIG_BLOCK, nullptr, &state.signals), 0);
  state.rounding = std::fegetround();
#ifdef __SSE__
  constexpr unsigned exception_flags = 0x3f;  // results, not settings
  state.float_control = _mm_getcsr() & ~exception_flags;
#endif
  char name[16] = {};
  EXPECT_EQ(pthread_getname_np(pthread_self(), name, sizeof(name)), 0);
  state.name = name;
  return state;
}

std::map<std::string, std::string> affinity_of_other_threads() {
  std::map<std::string, std::string> affinity;
  const std::string this_thread = std::to_string(gettid());
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    if (task.path().filename() == this_thread) continue;
    std::ifstream status(task.path() / "status");
    for (std::string line; std::getline(status, line);) {
      if (line.starts_with("Cpus_allowed:")) affinity[task.path().filename()] = line;
    }
  }
  return affinity;
}

/// Creates a pipeline and waits for a dispatch.
void add_one_on(Device& device) {
  auto words = device.create_buffer({.name = "words", .size_bytes = 256, .memory = Memory::readback});
  auto add = device.create_pipeline(test_shader_info(TestShader::add));
  auto recorder = device.create_recorder();
  auto timeline = device.create_timeline();
  ASSERT_TRUE(words.ok() && add.ok() && recorder.ok() && timeline.ok());
  words.value().host_as<std::uint32_t>()[63] = 1;
  const Buffer* const buffers[] = {&words.value()};
  const auto bindings = device.create_bindings(add.value(), buffers);
  ASSERT_TRUE(bindings.ok()) << bindings.error().message;
  recorder.value().begin();
  recorder.value().dispatch(add.value(), bindings.value(),
                            shared::AddArgs{.first = 0, .count = 64, .amount = 1}, 1);
  recorder.value().end();
  const std::uint64_t number = timeline.value().submit(recorder.value());
  ASSERT_EQ(timeline.value().wait(number, test_timeout_ns), WaitResult::done);
  EXPECT_EQ(words.value().host_as<std::uint32_t>()[63], 2u);
}

TEST(DeviceOpen, DoesNotChangeTheCallingThread) {
  sigset_t blocked;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGUSR2);
  ASSERT_EQ(pthread_sigmask(SIG_BLOCK, &blocked, nullptr), 0);
  const ThreadState before = state_of_this_thread();
  {
    const auto device = Device::open(test_device_options(false));
    ASSERT_TRUE(device.ok()) << device.error().message;
    const ThreadState after = state_of_this_thread();
    EXPECT_EQ(after.policy, before.policy);
    EXPECT_EQ(after.priority, before.priority);
    EXPECT_TRUE(CPU_EQUAL(&after.affinity, &before.affinity));
    for (int signal = 1; signal < SIGRTMAX; ++signal) {
      EXPECT_EQ(sigismember(&after.signals, signal), sigismember(&before.signals, signal))
          << "signal " << signal;
    }
    EXPECT_EQ(after.rounding, before.rounding);
    EXPECT_EQ(after.float_control, before.float_control);
    EXPECT_EQ(after.name, before.name);
  }
}

/// If a thread sets its affinity after open, the threads of the driver keep theirs. (The validation layer
/// creates a thread at the first submission, but is off in real-time runs.)
TEST(DeviceOpen, CreatesAllThreadsOfLavapipe) {
  DeviceOptions options = test_device_options(false);
  options.select = "llvmpipe";
  const auto device = Device::open(options);
  ASSERT_TRUE(device.ok()) << device.error().message;
  const auto after_open = affinity_of_other_threads();
  cpu_set_t before;
  ASSERT_EQ(sched_getaffinity(0, sizeof(before), &before), 0);
  int first = 0;
  while (!CPU_ISSET(first, &before))
    ++first;
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(first, &one);
  ASSERT_EQ(sched_setaffinity(0, sizeof(one), &one), 0);
  add_one_on(*device.value());
  EXPECT_EQ(affinity_of_other_threads(), after_open);
  ASSERT_EQ(sched_setaffinity(0, sizeof(before), &before), 0);
}

}  // namespace
}  // namespace rtstdb::gpu::test
