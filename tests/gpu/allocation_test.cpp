// The real-time path: recording, submitting, waiting and reading timestamps allocate nothing of ours.

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <new>

#include "tests/gpu/gpu_test.hpp"

namespace {

/// Allocations of C++ on the counting thread. The driver below is C and does what it does.
thread_local bool counting = false;
thread_local std::size_t allocations = 0;

void* counted_allocation_or_null(std::size_t size) noexcept {
  if (counting) ++allocations;
  return std::malloc(size != 0 ? size : 1);
}

void* counted_allocation(std::size_t size) {
  void* memory = counted_allocation_or_null(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t size) {
  return counted_allocation(size);
}
void* operator new[](std::size_t size) {
  return counted_allocation(size);
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return counted_allocation_or_null(size);
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return counted_allocation_or_null(size);
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete[](void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace rtstdb::gpu::test {
namespace {

/// Without the validation layer, which allocates as it likes.
TEST(Allocation, NoneInTheRealTimePath) {
  auto opened = Device::open(test_device_options(false));
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  Device& device = *opened.value();
  auto words = device.create_buffer(
      {.name = "words", .size_bytes = 256, .memory = Memory::readback, .indirect = true});
  auto add = device.create_pipeline(test_shader_info(TestShader::add));
  ASSERT_TRUE(words.ok() && add.ok());
  const Buffer* const buffers[] = {&words.value()};
  auto bindings = device.create_bindings(add.value(), buffers);
  auto recorder = device.create_recorder();
  auto timeline = device.create_timeline();
  ASSERT_TRUE(bindings.ok() && recorder.ok() && timeline.ok());
  const shared::AddArgs args{.first = 4, .count = 60, .amount = 1};
  const auto tick = [&] {
    Recorder& r = recorder.value();
    r.begin();
    r.timestamp(0);
    r.fill(words.value(), 0, 16, 1);
    r.barrier();
    r.dispatch(add.value(), bindings.value(), args, 1);
    r.barrier();
    r.dispatch_indirect(add.value(), bindings.value(), args, words.value(), 0);
    r.barrier();
    r.copy(words.value(), 32, words.value(), 16, 8);
    r.timestamp(1);
    r.end();
    const std::uint64_t number = timeline.value().submit(r);
    const WaitResult result = timeline.value().wait(number, test_timeout_ns);
    return result == WaitResult::done ? timeline.value().elapsed_ns(r, 0, 1) : -1;
  };
  ASSERT_GE(tick(), 0);  // warm-up
  std::int64_t worst = 0;
  counting = true;
  for (int i = 0; i < 100; ++i)
    worst = std::min(worst, tick());
  counting = false;
  EXPECT_EQ(worst, 0);
  EXPECT_EQ(allocations, 0u);

  counting = true;
  { const auto proof = std::make_unique<int>(1); }
  counting = false;
  EXPECT_EQ(allocations, 1u) << "the counter counts";
}

}  // namespace
}  // namespace rtstdb::gpu::test
