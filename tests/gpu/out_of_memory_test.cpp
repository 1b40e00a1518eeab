// Allocations fail while a database opens, takes in geometry and prepares queries: one of them, or all from
// one on; in the long form each in turn, in the short one some. Each time there is an error to read, the
// database that is there goes on, and nothing is left behind (the address sanitizer looks).

#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <iostream>

#include <rtstdb/database.hpp>

#include "tests/gpu/failing_allocation.hpp"
#include "tests/gpu/kind_cases.hpp"
#include "tests/support/rounds.hpp"

namespace rtstdb::test {
namespace {

using Then = FailingAllocation::Then;

/// How far it is to the next that fails.
std::uint64_t stride(std::uint64_t in_the_short_form) {
  if (hil::tests::is_long()) return 1;
#if defined(__SANITIZE_ADDRESS__)
  return 3 * in_the_short_form;
#else
  return in_the_short_form;
#endif
}

DatabaseOptions small() {
  DatabaseOptions options;
  if (const char* select = std::getenv("HIL_TEST_GPU")) options.gpu = select;
  options.max_entities = 16;
  options.max_geometries = 4096;
  options.retained_changes = 64;
  options.queue_capacity = 4;
  options.validation = Validation::off;
  return options;
}

/// Calls `step`, which gives its error, until there are not so many allocations, with every so manieth one
/// failing (in the short form); by turns that one alone, or all from it on. How many there are, about.
std::uint64_t fail_in(std::uint64_t every, const std::function<Result<void>()>& step) {
  std::uint64_t number = 1;
  Then then = Then::goes_on;
  for (bool enough = true; enough && !testing::Test::HasFatalFailure(); number += stride(every)) {
    SCOPED_TRACE(testing::Message() << "allocation " << number
                                    << (then == Then::runs_out ? " and all after it" : ""));
    Result<void> done;
    {
      const FailingAllocation failing(number, then);
      done = step();
      enough = failing.happened();
    }
    then = then == Then::goes_on ? Then::runs_out : Then::goes_on;
    if (done) continue;
    EXPECT_TRUE(enough) << done.error().message;
    EXPECT_EQ(done.error().code, ErrorCode::out_of_memory) << done.error().message;
    EXPECT_FALSE(done.error().message.empty());
  }
  std::cout << "about " << number << " allocations\n";
  return number;
}

template <class T>
Result<void> error_of(const Result<T>& result) {
  if (result) return {};
  return result.error();
}

TEST(OutOfMemory, WhileADatabaseOpens) {
  bool opened_at_last = false;
  const std::uint64_t allocations = fail_in(401, [&] {
    auto opened = Database::open(small());
    opened_at_last = opened.ok();
    return error_of(opened);
  });
  EXPECT_TRUE(opened_at_last);
  EXPECT_GT(allocations, 100u) << "what is counted is not what is allocated";
}

class OutOfMemoryLater : public testing::Test {
 protected:
  void SetUp() override {
    auto opened = Database::open(small());
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    database_ = std::move(opened).value();
  }
  /// The database is whole: it takes in a geometry, and a ray hits it.
  void expect_whole() {
    const auto box = database_->add_geometry(make_box({2.0, 2.0, 2.0}), "box");
    ASSERT_TRUE(box.ok()) << box.error().message;
    const auto made = database_->prepare(RayQueryOptions{.name = "beam", .capacity = 1});
    ASSERT_TRUE(made.ok()) << made.error().message;
    const auto transaction = database_->make_transaction({.max_writes = 2, .max_queries = 1});
    EntityRow row;
    row.geometry = box.value();
    made.value()->rays()[0].origin_m = {-6.0f, 0.0f, 0.0f};
    transaction->begin({});
    if (entity_.valid()) transaction->remove(entity_);
    const auto ordinal = transaction->create(row);
    transaction->add_query(*made.value(), 1);
    const Outcome& outcome = database_->execute(*transaction);
    ASSERT_EQ(outcome.status, Status::committed) << describe(outcome);
    entity_ = transaction->created(ordinal);
    EXPECT_EQ(made.value()->hits()[0].entity, entity_);
    const auto mesh = database_->geometry(box.value());
    ASSERT_TRUE(mesh.has_value());
    EXPECT_EQ(mesh->triangles.size(), 12u) << "ids and meshes are not in step";
  }

  std::unique_ptr<Database> database_;
  EntityId entity_;
};

TEST_F(OutOfMemoryLater, WhileGeometryIsAdded) {
  for (const bool deforms : {false, true}) {
    const TriangleMesh mesh = make_sphere(1.0, 2);
    fail_in(19, [&] {
      return error_of(
          database_->add_geometry(mesh, "a name too long to lie in the string", {.deforms = deforms}));
    });
    expect_whole();
  }
}

TEST_F(OutOfMemoryLater, WhileVersionsAreLookedInto) {
  const auto bag = database_->add_geometry(make_sphere(1.0, 2), "bag", {.deforms = true});
  ASSERT_TRUE(bag.ok()) << bag.error().message;
  fail_in(1, [&] { return error_of(database_->snapshot(ReadAt::latest())); });
  fail_in(1, [&] { return error_of(database_->geometry(bag.value(), ReadAt::latest())); });
  expect_whole();
}

TEST_F(OutOfMemoryLater, WhileQueriesArePrepared) {
  const std::string name = "a name too long to lie in the string";
  const auto fail_to_prepare = [&](const auto& options) {
    fail_in(307, [&] { return error_of(database_->prepare(options)); });
  };
  for (const AnyQueryOptions& options : options_of_every_kind()) {
    SCOPED_TRACE(kind_name(options));
    std::visit(
        [&](auto of_kind) {
          of_kind.name = name;
          fail_to_prepare(of_kind);
        },
        with(options, 100));
  }
  expect_whole();
}

}  // namespace
}  // namespace rtstdb::test
