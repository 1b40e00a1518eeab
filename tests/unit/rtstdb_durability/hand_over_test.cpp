// In async mode, the engine hands collected commits to the log thread when it is idle and before it waits.

#include <atomic>
#include <thread>

#include "logged_engine.hpp"
#include "tests/support/eventually.hpp"

namespace rtstdb::transaction::test {
namespace {

class LogHandOver : public testing::Test {
 protected:
  void SetUp() override {
    writer_->begin({});
    writer_->create(body(1));
    ASSERT_TRUE(db_.execute(*writer_).done());
    id_ = writer_->created(0);
  }
  /// A write by another thread while the engine is blocked.
  Version write(std::uint32_t mask) {
    writer_->begin({});
    writer_->update(id_, body(mask));
    const Outcome& outcome = db_.execute(*writer_);
    EXPECT_TRUE(outcome.done());
    return outcome.version;
  }
  bool becomes_durable(Version version) { return db_.log().wait_until_durable(version, event_limit); }

  SimulatedDisk disk_{1};
  LoggedEngine db_{disk_, {}};
  SimulatedQuery query_{1};
  std::unique_ptr<Transaction> writer_ = db_.make();
  std::unique_ptr<Transaction> reader_ = db_.make();
  EntityId id_;
};

TEST_F(LogHandOver, OccursWhenTheEngineIsIdle) {
  EXPECT_TRUE(becomes_durable(write(2)));
}

TEST_F(LogHandOver, OccursAtAPreemptionPoint) {
  // The write has a query: the write helper thread would execute it during the chunk without one.
  SimulatedQuery large(3 * unmeasured_chunk, 0);
  bool durable = false;
  db_.executor.chunk = [&](const auto&, const query::Request& request, std::uint32_t first, std::uint32_t) {
    if (request.count == 1) return;
    if (first == 0) {
      writer_->begin(soft_terms(max_importance));
      writer_->update(id_, body(2));
      writer_->add_query(query_, 1);
      db_.engine.submit(*writer_);
    } else if (first == unmeasured_chunk) {
      durable = writer_->status() == Status::committed && becomes_durable(writer_->outcome().version);
    }
  };
  EXPECT_EQ(db_.execute(begin_query(*reader_, large, {}, 3 * unmeasured_chunk)).status, Status::committed);
  EXPECT_TRUE(durable) << "not before the query ended";
}

TEST_F(LogHandOver, OccursBeforeALongQuery) {
  Gate gate;
  db_.executor.work = [&](const auto&, const auto&, const auto&) {
    gate.pass();
    return query::RunReport{};
  };
  // Both are queued before the engine runs, so it is not idle in between.
  writer_->begin(soft_terms(max_importance));
  writer_->update(id_, body(2));
  begin_query(*reader_, query_, {});
  db_.engine.call([&] {
    db_.engine.submit(*writer_);
    db_.engine.submit(*reader_);
  });
  gate.wait_until_held();
  EXPECT_TRUE(becomes_durable(db_.engine.wait(*writer_).version));
  gate.open();
  EXPECT_EQ(db_.engine.wait(*reader_).status, Status::committed);
}

TEST_F(LogHandOver, OccursBeforeAJob) {
  // A commit and a job are queued while the engine is blocked. If the job is queued later, the engine is idle
  // in between and hands over too.
  Gate before;
  Gate job;
  std::thread first([&] { db_.engine.call([&] { before.pass(); }); });
  before.wait_until_held();
  writer_->begin({});
  writer_->update(id_, body(2));
  db_.engine.submit(*writer_);
  std::atomic<bool> calls{false};
  std::thread second([&] {
    calls = true;
    calls.notify_all();
    db_.engine.call([&] { job.pass(); });
  });
  calls.wait(false);
  before.open();
  job.wait_until_held();
  EXPECT_TRUE(becomes_durable(db_.engine.wait(*writer_).version));
  job.open();
  first.join();
  second.join();
}

TEST_F(LogHandOver, OccursAfterATransactionWithoutARecord) {
  // The next commit is queued, so the engine is not idle.
  class Listener final : public CommitListener {
   public:
    void committed(const store::WriteSet& set) noexcept override {
      if (!set.writes.empty() && set.writes.front().state.row.mask == 4) gate.pass();
    }
    Gate gate;
  };
  Listener listener;
  db_.engine.listen(&listener);
  const auto conflict = db_.make();
  const auto next = db_.make();
  writer_->begin({});
  writer_->update(id_, body(2));
  conflict->begin({});
  conflict->expect_written_by(id_, 1'000'000);
  conflict->update(id_, body(3));
  next->begin({});
  next->update(id_, body(4));
  db_.engine.call([&] {
    for (Transaction* transaction : {writer_.get(), conflict.get(), next.get()})
      db_.engine.submit(*transaction);
  });
  listener.gate.wait_until_held();
  EXPECT_EQ(db_.engine.wait(*conflict).status, Status::conflict);
  EXPECT_TRUE(becomes_durable(db_.engine.wait(*writer_).version));
  listener.gate.open();
  EXPECT_TRUE(db_.engine.wait(*next).done());
  db_.engine.listen(nullptr);
}

TEST_F(LogHandOver, OccursWhileAQueryWaits) {
  bool durable = false;
  db_.executor.while_waiting = [&] { durable = becomes_durable(write(2)); };
  db_.executor.work = [](const auto&, const auto&, const auto&) { return query::RunReport{}; };
  EXPECT_EQ(db_.execute(begin_query(*reader_, query_, {})).status, Status::committed);
  EXPECT_TRUE(durable) << "not before the query ended";
}

TEST_F(LogHandOver, OccursBetweenManyQueuedTransactions) {
  // The engine is never idle in between.
  std::vector<std::unique_ptr<Transaction>> many;
  for (std::uint32_t k = 0; k < 60; ++k) {
    many.push_back(db_.make());
    many.back()->begin({});
    many.back()->update(id_, body(k));
  }
  db_.engine.call([&] {
    for (const auto& transaction : many)
      db_.engine.submit(*transaction);
  });
  for (const auto& transaction : many)
    ASSERT_TRUE(db_.engine.wait(*transaction).done());
  EXPECT_TRUE(becomes_durable(many.back()->outcome().version));
  EXPECT_EQ(db_.log().state().commits_in_gaps, 0u);
}

TEST_F(LogHandOver, OccursBeforeClose) {
  // The engine is closed during a run, so it is not idle afterwards.
  std::atomic<bool> running{false};
  db_.executor.work = [&](const auto&, const auto&, const auto&) {
    running = true;
    running.notify_all();
    EXPECT_TRUE(hil::tests::eventually([&] { return db_.engine.is_closing(); }, event_limit));
    return query::RunReport{};
  };
  writer_->begin({});
  writer_->update(id_, body(2));
  writer_->add_query(query_, 1);
  db_.engine.submit(*writer_);
  running.wait(false);
  db_.engine.close();
  const Outcome& outcome = db_.engine.wait(*writer_);
  ASSERT_TRUE(outcome.done()) << describe(outcome);
  EXPECT_EQ(db_.log().durable(), outcome.version);
}

}  // namespace
}  // namespace rtstdb::transaction::test
