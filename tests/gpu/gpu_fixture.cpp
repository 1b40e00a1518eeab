#include "tests/gpu/gpu_fixture.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

namespace rtstdb::gpu::test {
namespace {

#include "gpu_test_generated/words.inc"

template <class T>
T take(Result<T> result) {
  if (!result) {
    ADD_FAILURE() << result.error().message;
    return T{};
  }
  return std::move(result).value();
}

}  // namespace

const ShaderInfo& test_shader_info(TestShader shader) {
  using namespace shared;  // NOLINT(google-build-using-namespace): the table names structs without a prefix
  static constexpr std::array table{
#define SHADER(name, source, defines, group_size, args, bindings) \
  make_shader_info<args>(#name, source, defines, group_size, bindings, name##_words),
#include "tests/gpu/shaders/table.def"
#undef SHADER
  };
  return table.at(static_cast<std::size_t>(shader));
}

DeviceOptions test_device_options(bool validation) {
  const char* select = std::getenv("HIL_TEST_GPU");
  DeviceOptions options;
  if (select != nullptr) options.select = select;
  options.validation = validation;
  return options;
}

DeviceOptions shared_device_options() {
  DeviceOptions options = test_device_options(true);
  options.shared = true;
  return options;
}

void GpuTest::SetUp() {
  auto device = Device::open(shared_device_options());
  ASSERT_TRUE(device.ok()) << device.error().message;
  device_ = std::move(device).value();
  messages_taken_ = device_->validation_messages().size();
}

void GpuTest::TearDown() {
  if (!device_) return;
  const auto messages = device_->validation_messages();
  for (std::size_t i = messages_taken_; i < messages.size(); ++i) {
    ADD_FAILURE() << "validation layer: " << messages[i];
  }
}

Buffer GpuTest::make_buffer(const BufferOptions& options) {
  return take(device_->create_buffer(options));
}

Buffer GpuTest::make_words(std::size_t count, std::uint32_t word) {
  Buffer buffer = make_buffer({.name = "words",
                               .size_bytes = count * sizeof(word),
                               .memory = Memory::readback,
                               .texel_uint4 = count % 4 == 0});
  if (buffer) std::ranges::fill(buffer.host_as<std::uint32_t>(), word);
  return buffer;
}

Pipeline GpuTest::make_pipeline(TestShader shader) {
  return take(device_->create_pipeline(test_shader_info(shader)));
}

Bindings GpuTest::make_bindings(const Pipeline& pipeline, std::vector<const Buffer*> buffers) {
  return take(device_->create_bindings(pipeline, buffers));
}

Recorder GpuTest::make_recorder() {
  return take(device_->create_recorder());
}
Timeline GpuTest::make_timeline() {
  return take(device_->create_timeline());
}

void GpuTest::run(const std::function<void(Recorder&)>& record) {
  Recorder recorder = make_recorder();
  Timeline timeline = make_timeline();
  recorder.begin();
  record(recorder);
  recorder.end();
  const std::uint64_t number = timeline.submit(recorder);
  ASSERT_EQ(number, 1u);
  ASSERT_EQ(timeline.wait(number, test_timeout_ns), WaitResult::done);
}

std::vector<std::string> GpuTest::take_messages() {
  auto messages = device_->validation_messages();
  messages.erase(messages.begin(), messages.begin() + static_cast<std::ptrdiff_t>(messages_taken_));
  messages_taken_ += messages.size();
  return messages;
}

}  // namespace rtstdb::gpu::test
