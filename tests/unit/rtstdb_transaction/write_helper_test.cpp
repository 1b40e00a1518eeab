// The write helper thread commits writes while the engine thread waits for the device.

#include <gtest/gtest.h>

#include <array>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

class WriteHelper : public testing::Test {
 protected:
  /// Writes `mask` to the first entity and waits for the outcome.
  Status write(std::uint32_t mask) {
    writer_->begin({});
    writer_->update(first_, row_of(mask));
    return world_.execute(*writer_).status;
  }
  Status read() {
    reader_->begin({});
    reader_->add_query(query_, 1);
    return world_.execute(*reader_).status;
  }

  World world_;
  EntityId first_ = world_.create(1);
  SimulatedQuery query_{1};
  std::unique_ptr<Transaction> writer_ = world_.make();
  std::unique_ptr<Transaction> reader_ = world_.make();
};

TEST_F(WriteHelper, CommitsAWriteAndKeepsTheReadersVersion) {
  Status written = Status::idle;
  std::uint32_t seen = 0;
  world_.executor.while_waiting = [&] { written = write(2); };
  world_.executor.work = [&](const store::RowSource& rows, const auto&, const auto&) {
    seen = rows.find(first_)->row.mask;
    return query::RunReport{};
  };
  EXPECT_EQ(read(), Status::committed);
  EXPECT_EQ(written, Status::committed) << "during the wait for the device";
  EXPECT_EQ(seen, 1u);
  EXPECT_EQ(world_.mask(first_), 2);
  EXPECT_LT(reader_->outcome().version, writer_->outcome().version);
}

TEST_F(WriteHelper, CommitsManyWritesDuringOneWait) {
  int committed = 0;
  world_.executor.while_waiting = [&] {
    for (std::uint32_t k = 0; k < 100; ++k)
      committed += write(k) == Status::committed ? 1 : 0;
  };
  EXPECT_EQ(read(), Status::committed);
  EXPECT_EQ(committed, 100);
}

TEST_F(WriteHelper, CommitsAWriteThatWasSubmittedBeforeTheWait) {
  const auto early = world_.make();
  early->begin({});
  early->update(first_, row_of(7));
  Status written = Status::idle;
  world_.executor.while_waiting = [&] { written = world_.engine.wait(*early).status; };
  world_.executor.work = [&](const auto&, const auto&, const auto&) { return query::RunReport{}; };
  reader_->begin(terms(DeadlineClass::soft, ClockTime::max(), max_importance));
  reader_->add_query(query_, 1);
  // The engine receives both at once and starts the reader because of its importance.
  world_.engine.call([&] {
    world_.engine.submit(*reader_);
    world_.engine.submit(*early);
  });
  EXPECT_EQ(world_.engine.wait(*reader_).status, Status::committed);
  EXPECT_EQ(written, Status::committed);
}

TEST(WriteHelperWithShortHistory, DelaysAWriteThatWouldDropTheReadersVersion) {
  World world(engine_options(64, 64, 1));
  const EntityId first = world.create(1);
  const auto writer = world.make();
  const auto reader = world.make();
  SimulatedQuery query(1);
  std::uint32_t seen = 0;
  world.executor.while_waiting = [&] {
    writer->begin({});
    writer->update(first, row_of(2));
    writer->create(row_of(3));  // two changes; the history holds one
    world.engine.submit(*writer);
  };
  world.executor.work = [&](const store::RowSource& rows, const auto&, const auto&) {
    seen = rows.find(first)->row.mask;
    return query::RunReport{};
  };
  reader->begin({});
  reader->add_query(query, 1);
  EXPECT_EQ(world.execute(*reader).status, Status::committed);
  EXPECT_EQ(seen, 1u);
  EXPECT_EQ(world.engine.wait(*writer).status, Status::committed);
  EXPECT_GE(writer->outcome().started, reader->outcome().computed);
}

/// The history keeps two shapes: a third one has to wait while the older one is read.
TEST(WriteHelperWithShapes, DelaysAnUpdateThatWouldDropTheReadersShape) {
  World world;
  world.engine.call([&] {
    world.engine.keep_shapes(GeometryId{0}, store::ShapeHistory::make(std::vector<glm::vec3>(3), 2));
  });
  const auto update = [&](Transaction& writer, float x) {
    writer.begin({});
    writer.update_geometry(GeometryId{0}, std::vector<glm::vec3>(3, glm::vec3(x)));
    world.engine.submit(writer);
  };
  std::array<std::unique_ptr<Transaction>, 2> writers;
  for (auto& writer : writers)
    writer = world.engine.make_transaction({.max_geometry_updates = 1, .max_positions = 3});
  const auto reader = world.make();
  SimulatedQuery query(1);
  float seen = -1.0f;
  world.executor.while_waiting = [&] {
    update(*writers[0], 1.0f);
    EXPECT_EQ(world.engine.wait(*writers[0]).status, Status::committed) << "during the wait for the device";
    update(*writers[1], 2.0f);
  };
  world.executor.work = [&](const store::RowSource& rows, const auto&, const auto&) {
    seen = rows.shape(GeometryId{0}).positions_m[2].x;
    return query::RunReport{};
  };
  reader->begin({});
  reader->add_query(query, 1);
  EXPECT_EQ(world.execute(*reader).status, Status::committed);
  EXPECT_EQ(seen, 0.0f);
  EXPECT_EQ(world.engine.wait(*writers[1]).status, Status::committed);
  EXPECT_GE(writers[1]->outcome().started, reader->outcome().computed);
  EXPECT_EQ(world.engine.shape(GeometryId{0}, 3, ReadAt::latest()).value()[0].x, 2.0f);
  EXPECT_EQ(world.engine.shape(GeometryId{0}, 3, ReadAt::pinned(1)).value()[0].x, 1.0f);
  EXPECT_FALSE(world.engine.shape(GeometryId{0}, 3, ReadAt::pinned(0)).ok());
}

TEST_F(WriteHelper, DoesNotStartTransactionsWithQueries) {
  const auto mixed = world_.make();
  SimulatedQuery other(1);
  bool first_run = true;
  Status during = Status::idle;
  world_.executor.while_waiting = [&] {
    if (!std::exchange(first_run, false)) return;
    mixed->begin({});
    mixed->update(first_, row_of(9));
    mixed->add_query(other, 1);
    world_.engine.submit(*mixed);
    EXPECT_EQ(write(4), Status::committed);
    during = mixed->status();
  };
  EXPECT_EQ(read(), Status::committed);
  EXPECT_EQ(during, Status::pending);
  EXPECT_EQ(world_.engine.wait(*mixed).status, Status::committed);
  EXPECT_EQ(world_.mask(first_), 9);
}

}  // namespace
}  // namespace rtstdb::transaction::test
