// In async mode, the engine passes collected commits to the log thread when it has nothing else to do, and
// before it waits for anything.

#include <atomic>
#include <chrono>
#include <thread>

#include "life.hpp"

namespace rtstdb::transaction::test {
namespace {

/// Blocks the engine thread.
class Gate {
 public:
  void pass() {
    stands_.store(true);
    stands_.notify_all();
    open_.wait(false);
  }
  void wait_until_somebody_stands_there() { stands_.wait(false); }
  void open() {
    open_.store(true);
    open_.notify_all();
  }

 private:
  std::atomic<bool> stands_{false}, open_{false};
};

class HandingOver : public testing::Test {
 protected:
  void SetUp() override {
    writer_->begin({});
    writer_->create(body(1));
    ASSERT_TRUE(life_.execute(*writer_).done());
    id_ = writer_->created(0);
  }
  /// A write by another thread while the engine is blocked.
  Version write(std::uint32_t material) {
    writer_->begin({});
    writer_->update(id_, body(material));
    const Outcome& outcome = life_.execute(*writer_);
    EXPECT_TRUE(outcome.done());
    return outcome.version;
  }
  bool becomes_durable(Version version) {
    return life_.log().wait_until_durable(version, Nanoseconds(10'000'000'000));
  }
  void ask() {
    reader_->begin({});
    reader_->add_query(query_, 1);
  }

  SimulatedDisk disk_{1};
  Life life_{disk_, {}};
  SimulatedQuery query_{1};
  std::unique_ptr<Transaction> writer_ = life_.make();
  std::unique_ptr<Transaction> reader_ = life_.make();
  EntityId id_;
};

TEST_F(HandingOver, WhenTheEngineIsIdle) {
  EXPECT_TRUE(becomes_durable(write(2)));
}

TEST_F(HandingOver, AtAPreemptionPoint) {
  // Not a write without queries: that is executed during the chunk.
  constexpr std::uint32_t chunk = 4096;  // elements of a first chunk of an unknown kind
  SimulatedQuery large(3 * chunk, 0);
  bool durable = false;
  life_.executor.chunk = [&](const auto&, const query::Request& request, std::uint32_t first, std::uint32_t) {
    if (request.count == 1) return;
    if (first == 0) {
      writer_->begin(terms(DeadlineClass::soft, ClockTime::max(), max_importance));
      writer_->update(id_, body(2));
      writer_->add_query(query_, 1);
      life_.engine.submit(*writer_);
    } else if (first == chunk) {
      durable = writer_->status() == Status::committed && becomes_durable(writer_->outcome().version);
    }
  };
  reader_->begin({});
  reader_->add_query(large, 3 * chunk);
  EXPECT_EQ(life_.execute(*reader_).status, Status::committed);
  EXPECT_TRUE(durable) << "it waited for the query";
}

TEST_F(HandingOver, BeforeALongQuery) {
  Gate gate;
  life_.executor.work = [&](const auto&, const auto&, const auto&) {
    gate.pass();
    return query::RunReport{};
  };
  // Both are queued before the engine runs, so it is not idle in between.
  writer_->begin(terms(DeadlineClass::soft, ClockTime::max(), max_importance));
  writer_->update(id_, body(2));
  ask();
  life_.engine.call([&] {
    life_.engine.submit(*writer_);
    life_.engine.submit(*reader_);
  });
  gate.wait_until_somebody_stands_there();
  EXPECT_TRUE(becomes_durable(life_.engine.wait(*writer_).version));
  gate.open();
  EXPECT_EQ(life_.engine.wait(*reader_).status, Status::committed);
}

TEST_F(HandingOver, BeforeAJob) {
  // Both are queued while the engine is blocked: a commit and a long job.
  Gate before;
  Gate job;
  std::thread first([&] { life_.engine.call([&] { before.pass(); }); });
  before.wait_until_somebody_stands_there();
  writer_->begin({});
  writer_->update(id_, body(2));
  life_.engine.submit(*writer_);
  std::thread second([&] { life_.engine.call([&] { job.pass(); }); });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  before.open();
  job.wait_until_somebody_stands_there();
  EXPECT_TRUE(becomes_durable(life_.engine.wait(*writer_).version));
  job.open();
  first.join();
  second.join();
}

TEST_F(HandingOver, AfterATransactionWithoutARecord) {
  // There may be any number of these. The next commit is queued, so the engine is not idle.
  class Listener final : public CommitListener {
   public:
    void committed(const store::WriteSet& set) noexcept override {
      if (!set.writes.empty() && set.writes.front().state.row.material == 4) gate.pass();
    }
    Gate gate;
  };
  Listener listener;
  life_.engine.listen(&listener);
  const auto conflict = life_.make();
  const auto next = life_.make();
  writer_->begin({});
  writer_->update(id_, body(2));
  conflict->begin({});
  conflict->expect_written_by(id_, 1'000'000);
  conflict->update(id_, body(3));
  next->begin({});
  next->update(id_, body(4));
  life_.engine.call([&] {
    for (Transaction* transaction : {writer_.get(), conflict.get(), next.get()})
      life_.engine.submit(*transaction);
  });
  listener.gate.wait_until_somebody_stands_there();
  EXPECT_EQ(life_.engine.wait(*conflict).status, Status::conflict);
  EXPECT_TRUE(becomes_durable(life_.engine.wait(*writer_).version));
  listener.gate.open();
  EXPECT_TRUE(life_.engine.wait(*next).done());
  life_.engine.listen(nullptr);
}

TEST_F(HandingOver, WritesDuringAWaitingQuery) {
  bool durable = false;
  life_.executor.while_waiting = [&] { durable = becomes_durable(write(2)); };
  life_.executor.work = [](const auto&, const auto&, const auto&) { return query::RunReport{}; };
  ask();
  EXPECT_EQ(life_.execute(*reader_).status, Status::committed);
  EXPECT_TRUE(durable) << "it waited for the query";
}

TEST_F(HandingOver, WhenMoreAreQueuedThanFit) {
  // The engine is never idle in between.
  std::vector<std::unique_ptr<Transaction>> many;
  for (std::uint32_t k = 0; k < 60; ++k) {
    many.push_back(life_.make());
    many.back()->begin({});
    many.back()->update(id_, body(k));
  }
  life_.engine.call([&] {
    for (const auto& transaction : many)
      life_.engine.submit(*transaction);
  });
  for (const auto& transaction : many)
    ASSERT_TRUE(life_.engine.wait(*transaction).done());
  EXPECT_TRUE(becomes_durable(many.back()->outcome().version));
  EXPECT_EQ(life_.log().state().commits_in_gaps, 0u);
}

TEST_F(HandingOver, BeforeClose) {
  // The engine is closed while it works, and is not idle any more.
  std::atomic<bool> at_work{false};
  life_.executor.work = [&](const auto&, const auto&, const auto&) {
    at_work.store(true);
    at_work.notify_all();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    return query::RunReport{};
  };
  writer_->begin({});
  writer_->update(id_, body(2));
  writer_->add_query(query_, 1);
  life_.engine.submit(*writer_);
  at_work.wait(false);
  life_.engine.close();
  const Outcome& outcome = life_.engine.wait(*writer_);
  ASSERT_TRUE(outcome.done()) << describe(outcome);
  EXPECT_EQ(life_.log().durable(), outcome.version);
}

}  // namespace
}  // namespace rtstdb::transaction::test
