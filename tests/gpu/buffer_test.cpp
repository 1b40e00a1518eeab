// Buffers in each kind of memory and with each view, and refusals.

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

#include "tests/gpu/gpu_fixture.hpp"

namespace rtstdb::gpu::test {
namespace {

class BufferTest : public GpuTest {};
using BufferDeathTest = BufferTest;

constexpr std::array all_kinds{Memory::device, Memory::upload, Memory::readback};

TEST_F(BufferTest, IsCopiedFromAndToEachKindOfMemory) {
  constexpr std::size_t count = 1000;
  for (const Memory from : all_kinds) {
    for (const Memory to : all_kinds) {
      Buffer upload = make_buffer({.name = "upload", .size_bytes = 4 * count, .memory = Memory::upload});
      Buffer first = make_buffer({.name = "first", .size_bytes = 4 * count, .memory = from});
      Buffer second = make_buffer({.name = "second", .size_bytes = 4 * count, .memory = to});
      Buffer readback = make_words(count, 0);
      ASSERT_TRUE(upload && first && second && readback);
      const auto sent = upload.host_as<std::uint32_t>();
      std::iota(sent.begin(), sent.end(), 77u);
      run([&](Recorder& recorder) {
        recorder.copy(upload, 0, first, 0, 4 * count);
        recorder.barrier();
        recorder.copy(first, 0, second, 0, 4 * count);
        recorder.barrier();
        recorder.copy(second, 0, readback, 0, 4 * count);
      });
      EXPECT_TRUE(std::ranges::equal(readback.host_as<std::uint32_t>(), sent));
    }
  }
}

/// The device imports the memory, or works on a copy.
TEST(BufferInHostMemory, IsReadAndWrittenByTheDevice) {
  constexpr std::size_t count = 5000;  // not a multiple of a page
  for (const bool imports : {true, false}) {
    HostMemory memory(4 * count);
    const auto words = memory.as<std::uint32_t>();
    ASSERT_EQ(words.size(), count);
    std::iota(words.begin(), words.end(), 5u);
    {
      DeviceOptions options = test_device_options(true);
      options.imports_host_memory = imports;
      auto device = std::move(Device::open(options)).value();
      auto shared = device->create_buffer(
          {.name = "shared", .size_bytes = 4 * count, .memory = Memory::readback, .host = &memory});
      auto other =
          device->create_buffer({.name = "other", .size_bytes = 4 * count, .memory = Memory::readback});
      ASSERT_TRUE(shared.ok() && other.ok());
      EXPECT_EQ(shared.value().host().data(), memory.as<std::byte>().data());
      auto recorder = std::move(device->create_recorder()).value();
      auto timeline = std::move(device->create_timeline()).value();
      recorder.begin();
      recorder.copy(shared.value(), 0, other.value(), 0, 4 * count);
      recorder.barrier();
      recorder.fill(shared.value(), 4 * 7, 4, 99);
      recorder.end();
      shared.value().flush(0, 4 * count);
      ASSERT_EQ(timeline.wait(timeline.submit(recorder), test_timeout_ns), WaitResult::done);
      EXPECT_TRUE(std::ranges::equal(other.value().host_as<std::uint32_t>(), words.subspan(0),
                                     [&](auto a, auto b) { return a == b || (a == 12 && b == 99); }));
      shared.value().invalidate(4 * 7, 4);
      EXPECT_TRUE(device->validation_messages().empty());
    }
    EXPECT_EQ(words[6], 11u);
    EXPECT_EQ(words[7], 99u);
    EXPECT_EQ(words[8], 13u);
  }
}

TEST_F(BufferTest, IsReadAndWrittenByKernelsInEachKindOfMemory) {
  constexpr std::uint32_t count = 256;
  const Pipeline add = make_pipeline(TestShader::add);
  for (const Memory memory : all_kinds) {
    Buffer words = make_buffer({.name = "words", .size_bytes = 4 * count, .memory = memory});
    Buffer readback = make_words(count, 0);
    const Bindings bindings = make_bindings(add, {&words});
    run([&](Recorder& recorder) {
      recorder.fill(words, 0, 4 * count, 40);
      recorder.barrier();
      recorder.dispatch(add, bindings, shared::AddArgs{.first = 0, .count = count, .amount = 2}, count / 64);
      recorder.barrier();
      recorder.copy(words, 0, readback, 0, 4 * count);
    });
    for (const std::uint32_t word : readback.host_as<std::uint32_t>())
      ASSERT_EQ(word, 42u);
  }
}

TEST_F(BufferTest, IsReadAsUintsAndAsFloats) {
  constexpr std::uint32_t texels = 100;
  Buffer input = make_buffer({.name = "input",
                              .size_bytes = texels * 16,
                              .memory = Memory::upload,
                              .texel_uint4 = true,
                              .texel_float4 = true});
  Buffer output = make_words(texels * 8, 0);
  ASSERT_TRUE(input && output);
  const auto values = input.host_as<float>();
  std::iota(values.begin(), values.end(), 0.25f);
  const Pipeline read = make_pipeline(TestShader::read_texels);
  const Bindings bindings = make_bindings(read, {&input, &input, &output});
  run([&](Recorder& recorder) { recorder.dispatch(read, bindings, shared::CountArgs{.count = texels}, 2); });
  const auto read_back = output.host_as<std::uint32_t>();
  for (std::uint32_t i = 0; i < texels; ++i) {
    for (std::uint32_t part = 0; part < 4; ++part) {
      const auto expected = std::bit_cast<std::uint32_t>(values[4 * i + part]);
      ASSERT_EQ(read_back[8 * i + part], expected) << "as uints, texel " << i;
      ASSERT_EQ(read_back[8 * i + 4 + part], expected) << "as floats, texel " << i;
    }
  }
}

TEST_F(BufferTest, IsWrittenByAKernelAndReadAsTexels) {
  constexpr std::uint32_t texels = 64;
  Buffer words =
      make_buffer({.name = "words", .size_bytes = texels * 16, .texel_uint4 = true, .texel_float4 = true});
  Buffer output = make_words(texels * 8, 0);
  const Pipeline add = make_pipeline(TestShader::add);
  const Pipeline read = make_pipeline(TestShader::read_texels);
  const Bindings as_storage = make_bindings(add, {&words});
  const Bindings as_texels = make_bindings(read, {&words, &words, &output});
  run([&](Recorder& recorder) {
    recorder.fill(words, 0, texels * 16, 0x3f800000u);  // 1.0f
    recorder.barrier();
    recorder.dispatch(add, as_storage, shared::AddArgs{.first = 0, .count = texels * 4, .amount = 5},
                      texels * 4 / 64);
    recorder.barrier();
    recorder.dispatch(read, as_texels, shared::CountArgs{.count = texels}, 1);
  });
  for (const std::uint32_t word : output.host_as<std::uint32_t>())
    ASSERT_EQ(word, 0x3f800005u);
}

TEST_F(BufferTest, OutlivesItsDevice) {
  auto device = Device::open(test_device_options(true));
  ASSERT_TRUE(device.ok()) << device.error().message;
  auto buffer = device.value()->create_buffer({.name = "late", .size_bytes = 64, .memory = Memory::upload});
  ASSERT_TRUE(buffer.ok()) << buffer.error().message;
  device.value().reset();
  buffer.value().host()[63] = std::byte{1};
}

TEST_F(BufferTest, IsRefusedAboveTheAllocationLimit) {
  const std::size_t limit = device().limits().max_allocation_bytes;
  const auto buffer = device().create_buffer({.name = "too big", .size_bytes = limit + 1});
  ASSERT_FALSE(buffer.ok());
  EXPECT_EQ(buffer.error().code, ErrorCode::capacity);
  const std::string& message = buffer.error().message;
  EXPECT_NE(message.find("too big"), std::string::npos) << message;
  EXPECT_NE(message.find(std::to_string(limit)), std::string::npos) << message;
  EXPECT_NE(message.find(std::to_string(limit + 1)), std::string::npos) << message;
}

TEST_F(BufferTest, IsRefusedAboveTheTexelLimit) {
  const std::size_t limit = device().limits().max_texel_elements;
  const std::size_t size_bytes = (limit + 1) * 16;
  if (size_bytes > device().limits().max_allocation_bytes) {
    // The allocation limit comes first on such a device, as on lavapipe.
    const auto buffer =
        device().create_buffer({.name = "texels", .size_bytes = size_bytes, .texel_uint4 = true});
    ASSERT_FALSE(buffer.ok());
    EXPECT_EQ(buffer.error().code, ErrorCode::capacity);
    return;
  }
  const auto buffer =
      device().create_buffer({.name = "texels", .size_bytes = size_bytes, .texel_uint4 = true});
  ASSERT_FALSE(buffer.ok());
  EXPECT_EQ(buffer.error().code, ErrorCode::capacity);
  EXPECT_NE(buffer.error().message.find("texels in one view"), std::string::npos) << buffer.error().message;
}

TEST_F(BufferTest, IsNotBoundAboveTheStorageLimit) {
  const std::size_t range = device().limits().max_storage_range_bytes;
  if (range >= device().limits().max_allocation_bytes) {
    // This device binds each buffer that it can create.
    const auto refused = device().create_buffer({.name = "wide", .size_bytes = range + 16});
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::capacity);
    return;
  }
  const Buffer buffer = make_buffer({.name = "wide", .size_bytes = range + 16});
  ASSERT_TRUE(buffer);
  const Pipeline add = make_pipeline(TestShader::add);
  const Buffer* const buffers[] = {&buffer};
  const auto bindings = device().create_bindings(add, buffers);
  ASSERT_FALSE(bindings.ok());
  EXPECT_EQ(bindings.error().code, ErrorCode::capacity);
  EXPECT_NE(bindings.error().message.find(std::to_string(range)), std::string::npos)
      << bindings.error().message;
  EXPECT_NE(bindings.error().message.find("wide"), std::string::npos) << bindings.error().message;
}

TEST_F(BufferDeathTest, AbortsOnBadSizesAndUnmappedAccess) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_DEATH((void)device().create_buffer({.name = "empty"}), "the buffer has no bytes");
  EXPECT_DEATH((void)device().create_buffer({.name = "odd", .size_bytes = 20, .texel_uint4 = true}),
               "the size is not a multiple of that of a texel");
  const Buffer local = make_buffer({.name = "local", .size_bytes = 64});
  EXPECT_DEATH((void)local.host(), "its memory is not mapped");
}

TEST_F(BufferDeathTest, AbortsOnABindingWithoutTheView) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const Buffer uints = make_buffer({.name = "uints", .size_bytes = 64, .texel_uint4 = true});
  const Buffer floats = make_buffer({.name = "floats", .size_bytes = 64, .texel_float4 = true});
  const Pipeline read = make_pipeline(TestShader::read_texels);
  EXPECT_DEATH((void)make_bindings(read, {&floats, &floats, &uints}),
               "no view of the type that the shader reads");
  EXPECT_DEATH((void)make_bindings(read, {&uints, &uints, &uints}),
               "no view of the type that the shader reads");
  EXPECT_DEATH((void)make_bindings(read, {&uints, &floats}),
               "the number of buffers is not that of the bindings");
  EXPECT_TRUE(make_bindings(read, {&uints, &floats, &floats}));
}

}  // namespace
}  // namespace rtstdb::gpu::test
