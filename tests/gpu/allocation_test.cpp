// The real-time path of rtstdb allocates no memory: recording, submitting, waiting, reading timestamps, and
// transactions with queries.

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <memory>
#include <new>
#include <thread>
#include <vector>

#include <rtstdb/database.hpp>

#include "tests/gpu/gpu_fixture.hpp"

namespace {

/// Allocations by operator new on the counting thread; the driver is written in C.
thread_local bool counting = false;
thread_local std::size_t allocations = 0;
/// Of all threads, with those of the database and the C++ parts of the driver.
std::atomic<bool> counting_everywhere = false;
std::atomic<std::size_t> allocations_everywhere = 0;

void* counted_allocation_or_null(std::size_t size) noexcept {
  if (counting) ++allocations;
  if (counting_everywhere) ++allocations_everywhere;
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

/// Without the validation layer, which allocates.
TEST(Allocation, NoneByRecordersAndTimelines) {
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
  { const auto counted = std::make_unique<int>(1); }
  counting = false;
  EXPECT_EQ(allocations, 1u) << "the allocation is not counted";
}

/// A database without the validation layer, with twenty spheres that move in each tick.
class TransactionAllocation : public testing::Test {
 protected:
  void SetUp() override {
    auto opened = Database::open({.gpu = test_device_options(false).select, .validation = Validation::off});
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    database_ = std::move(opened).value();
    const auto sphere = database_->add_geometry(make_sphere(1.0, 2), "sphere");
    ASSERT_TRUE(sphere.ok());
    sphere_ = sphere.value();
    transaction_ = database_->make_transaction({.max_writes = 20, .max_queries = 1});
    ids_.reserve(20);
  }
  Database& database() { return *database_; }

  /// `fill(element, k, now)` fills the k-th element.
  template <class Query, class Elements, class Fill>
  void expect_none(Query& query, Elements elements, Fill fill) {
    const auto tick = [&] {
      now_ms_ += 10;
      const WorldTime now = world_time_ns(now_ms_ * 1'000'000);
      move_all(now);
      for (std::uint32_t k = 0; k < elements.size(); ++k)
        fill(elements[k], k, now);
      transaction_->add_query(query, static_cast<std::uint32_t>(elements.size()));
      const Status status = database_->execute(*transaction_).status;
      if (ids_.empty()) {
        for (std::uint32_t i = 0; i < 20; ++i)
          ids_.push_back(transaction_->created(i));
      }
      return status;
    };
    for (int i = 0; i < 11; ++i)  // uses each slot, and the driver compiles kernels
      ASSERT_EQ(tick(), Status::committed);
    std::size_t committed = 0;
    counting_everywhere = true;
    for (int i = 0; i < 50; ++i)
      committed += tick() == Status::committed ? 1 : 0;
    counting_everywhere = false;
    EXPECT_EQ(committed, 50u);
    EXPECT_EQ(allocations_everywhere, 0u);
  }

 private:
  void move_all(WorldTime now) {
    Terms terms;
    terms.world_time = now;
    transaction_->begin(terms);
    for (std::uint32_t i = 0; i < 20; ++i) {
      EntityRow row;
      row.geometry = sphere_;
      row.motion.p_world_m = {3.0 * i, 0.001 * static_cast<double>(now_ms_), 0.0};
      row.motion.valid_from = now;
      if (ids_.empty()) {
        transaction_->create(row);
      } else {
        transaction_->update(ids_[i], row);
      }
    }
  }

  std::unique_ptr<Database> database_;
  GeometryId sphere_;
  std::unique_ptr<Transaction> transaction_;
  std::vector<EntityId> ids_;
  std::int64_t now_ms_ = 0;
};

TEST_F(TransactionAllocation, NoneByRegions) {
  for (const RegionLevel level : {RegionLevel::bounds, RegionLevel::surface, RegionLevel::triangle}) {
    auto query = database().prepare(
        RegionQueryOptions{.name = "regions", .capacity = 100, .level = level, .ids_per_region = 400});
    ASSERT_TRUE(query.ok());
    expect_none(*query.value(), query.value()->regions(), [](Region& region, std::uint32_t k, WorldTime now) {
      region.shape = static_cast<RegionShape>(k % 3);
      region.center_m = {0.6f * static_cast<float>(k), 0.5f, 0.1f};
      region.half_extent_m = glm::vec3(1.0f);
      region.t = now;
    });
    EXPECT_GT(query.value()->answers()[0].found, 0u);
  }
}

TEST_F(TransactionAllocation, NoneByNearest) {
  auto query = database().prepare(NearestQueryOptions{
      .name = "nearest", .capacity = 100, .target = NearestTarget::surface, .k = 3, .is_signed = true});
  ASSERT_TRUE(query.ok());
  expect_none(*query.value(), query.value()->points(), [](Nearest& point, std::uint32_t k, WorldTime now) {
    point.point_m = {0.6f * static_cast<float>(k), 0.5f, 0.1f};
    point.t = now;
  });
  EXPECT_EQ(query.value()->answers()[0].neighbors.size(), 3u);

  std::thread other([] {
    counting_everywhere = true;
    const auto counted = std::make_unique<int>(1);
    counting_everywhere = false;
  });
  other.join();
  EXPECT_GT(allocations_everywhere, 0u) << "the allocation is not counted";
}

/// By refits and rebuilds of a deforming geometry.
TEST(Allocation, NoneByGeometryUpdates) {
  auto opened = Database::open({.gpu = test_device_options(false).select, .validation = Validation::off});
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  Database& database = *opened.value();
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < 900; ++i) {
    const glm::vec3 corner(glm::uvec3(i % 30, i / 30, 0));
    mesh.positions_m.insert(mesh.positions_m.end(),
                            {corner, corner + glm::vec3(1, 0, 0), corner + glm::vec3(0, 1, 0)});
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  const auto geometry = database.add_geometry(mesh, "sheet", {.deforms = true});
  // A large build must not use up the memory that is reserved for ticks.
  const auto large = database.add_geometry(make_sphere(1.0, 7), "large");
  auto query = database.prepare(RayQueryOptions{.name = "rays", .capacity = 10});
  ASSERT_TRUE(geometry.ok() && large.ok() && query.ok());
  const auto transaction = database.make_transaction(
      {.max_writes = 1, .max_queries = 1, .max_geometry_updates = 1, .max_positions = 2700});
  std::vector<glm::vec3> positions = mesh.positions_m;
  bool has_body = false;
  std::uint32_t tick_number = 0;
  const auto tick = [&] {
    // A permutation of the triangles that keeps no neighbours together.
    constexpr std::uint32_t factors[] = {1, 7, 227, 467};
    const std::uint32_t factor = factors[++tick_number / 2 % 4];
    for (std::uint32_t i = 0; i < 900; ++i) {
      for (std::uint32_t corner = 0; corner < 3; ++corner)
        positions[3 * i + corner] = mesh.positions_m[3 * (i * factor % 900) + corner];
    }
    transaction->begin({});
    EntityRow row;
    row.geometry = geometry.value();
    if (!has_body) transaction->create(row);
    has_body = true;
    transaction->update_geometry(geometry.value(), positions);
    for (Ray& ray : query.value()->rays()) {
      ray.origin_m = {10.2f, 10.2f, 5.0f};
      ray.direction = {0.0f, 0.0f, -1.0f};
    }
    transaction->add_query(*query.value(), 10);
    const Status status = database.execute(*transaction).status;
    return status == Status::committed && query.value()->hits()[9].status == HitStatus::hit;
  };
  for (int i = 0; i < 10; ++i)
    ASSERT_TRUE(tick());
  const ShapeCounts before = database.shape_counts();
  std::size_t correct = 0;
  allocations_everywhere = 0;
  counting_everywhere = true;
  for (int i = 0; i < 50; ++i)
    correct += tick() ? 1 : 0;
  counting_everywhere = false;
  EXPECT_EQ(correct, 50u);
  EXPECT_EQ(allocations_everywhere, 0u);
  EXPECT_EQ(database.shape_counts().refits, before.refits + 50);
  EXPECT_GT(database.shape_counts().rebuilds, before.rebuilds + 10);
}

}  // namespace
}  // namespace rtstdb::gpu::test
