#include "tests/long/list_world.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <memory>
#include <thread>
#include <utility>

namespace hil::stress {

using rtstdb::EntityRow;
using rtstdb::EntityState;
using rtstdb::ReadAt;
using rtstdb::Status;
using rtstdb::Terms;
using rtstdb::Transaction;

namespace {

constexpr std::uint32_t head_bit = 0x80000000u;

std::int64_t now_ns() {
  return std::chrono::steady_clock::now().time_since_epoch().count();
}

EntityRow row_of(Key key, Value value) {
  EntityRow row;
  row.mask = key;
  row.material = value;
  return row;
}

std::vector<Value> list_in(const rtstdb::store::RowSource& rows, Key key) {
  std::vector<const EntityState*> states;
  for (std::uint32_t index = 0; index < rows.index_limit(); ++index) {
    const EntityState* state = rows.row(index);
    if (state != nullptr && state->row.mask == key) states.push_back(state);
  }
  // Values that one transaction appends to one list are ascending.
  std::ranges::sort(
      states, {}, [](const EntityState* state) { return std::pair(state->written_by, state->row.material); });
  std::vector<Value> values;
  std::ranges::transform(states, std::back_inserter(values),
                         [](const EntityState* state) { return state->row.material; });
  return values;
}

Ending ending_of(Status status) {
  return status == Status::committed || status == Status::late || status == Status::truncated
             ? Ending::committed
             : Ending::nothing_done;
}

}  // namespace

std::optional<rtstdb::BadInput> ListQuery::check(std::uint32_t, const rtstdb::store::RowSource& rows,
                                                 rtstdb::store::TimeSpan& times) const noexcept {
  times.first = std::min(times.first, rows.time());
  times.last = std::max(times.last, rows.time());
  return std::nullopt;
}

rtstdb::query::RunReport ListExecutor::run(const rtstdb::store::RowSource& rows,
                                           std::span<const rtstdb::query::Request> requests,
                                           const rtstdb::store::TimeSpan&,
                                           rtstdb::query::ExecutorCallbacks* callbacks) noexcept {
  for (const bool second_half : {false, true}) {
    for (const rtstdb::query::Request& request : requests) {
      auto& lists = static_cast<ListQuery*>(request.query)->lists;
      for (std::size_t k = 0; k < lists.size(); ++k) {
        if ((k >= lists.size() / 2) == second_half) lists[k].values = list_in(rows, lists[k].key);
      }
    }
    if (second_half || callbacks == nullptr) continue;
    callbacks->begin_wait();
    if (random_() % 4 == 0) std::this_thread::sleep_for(std::chrono::microseconds(20));
    callbacks->end_wait();
  }
  rtstdb::query::RunReport report;
  if (random_() % 64 == 0) report.status = rtstdb::query::RunStatus::device_lost;
  return report;
}

/// One thread that appends and reads.
class ListClient {
 public:
  ListClient(ListWorld& world, std::uint32_t seed, Value first_value)
      : world_(world),
        random_(seed),
        next_value_(first_value),
        transaction_(world.engine_.make_transaction(
            {.max_writes = 16, .max_preconditions = 4, .max_queries = 1, .max_reads = 4})) {}

  void run(int transactions) {
    while (transactions-- > 0) {
      switch (random_() % 8) {
        case 0:
        case 1:
          read(ReadAt::latest());
          break;
        case 2:
          read_the_past();
          break;
        case 3:
        case 4:
          append_by_what_was_read();
          break;
        default:
          append_and_read();
      }
    }
  }

  std::vector<Recorded> take() { return std::move(recorded_); }

  /// Every list, after all others have ended.
  void read_all() {
    query_.lists.clear();
    for (Key key = 0; key < ListWorld::lists; ++key)
      query_.lists.push_back({key, {}});
    Recorded last;
    Status status = Status::device_lost;
    while (status == Status::device_lost) {
      last = Recorded{};
      transaction_->begin({});
      transaction_->add_query(query_, 1);
      status = execute(last);
    }
    ASSERT_EQ(status, Status::committed) << describe(transaction_->outcome().bad_input);
    last.reads = query_.lists;
    recorded_.push_back(std::move(last));
  }

 private:
  std::vector<Key> some_lists() {
    std::vector<Key> keys(1 + random_() % 3);
    for (Key& key : keys)
      key = static_cast<Key>(random_() % ListWorld::lists);
    std::ranges::sort(keys);
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());  // clang 14 can not read ranges::unique
    return keys;
  }

  Terms terms() {
    Terms made;
    made.importance = static_cast<std::uint8_t>(random_() % 3);
    made.deadline_class = static_cast<rtstdb::DeadlineClass>(random_() % 4);
    made.deadline = world_.clock_.now() + rtstdb::Nanoseconds(random_() % 400'000);
    return made;
  }

  Status execute(Recorded& recorded) {
    recorded.begun_ns = recorded.begun_ns == 0 ? now_ns() : recorded.begun_ns;
    world_.engine_.submit(*transaction_);
    const Status status = world_.engine_.wait(*transaction_).status;
    recorded.ended_ns = now_ns();
    recorded.ending = ending_of(status);
    return status;
  }

  void ask(const std::vector<Key>& keys) {
    query_.lists.clear();
    for (const Key key : keys)
      query_.lists.push_back({key, {}});
    transaction_->add_query(query_, 1);
  }

  void append(const std::vector<Key>& keys, Recorded& recorded) {
    for (const Key key : keys) {
      for (auto count = 1 + random_() % 2; count > 0; --count) {
        transaction_->create(row_of(key, next_value_));
        recorded.appends.push_back({key, next_value_++});
      }
      transaction_->update(world_.heads_[key], row_of(key | head_bit, 0));
    }
  }

  void read(ReadAt read_at, bool past = false) {
    Recorded recorded;
    recorded.reads_the_past = past;
    Terms given = terms();
    given.read_at = read_at;
    transaction_->begin(given);
    ask(some_lists());
    execute(recorded);
    if (recorded.ending == Ending::committed) recorded.reads = query_.lists;
    recorded_.push_back(std::move(recorded));
  }

  void read_the_past() {
    const rtstdb::Version latest = world_.engine_.latest().version;
    const rtstdb::Version versions = std::min<rtstdb::Version>(latest - world_.empty_since_ + 1, 40);
    read(ReadAt::pinned(latest - random_() % versions), true);
  }

  void append_and_read() {
    Recorded recorded;
    transaction_->begin(terms());
    append(some_lists(), recorded);
    const bool asks = random_() % 2 == 0;
    if (asks) ask(some_lists());
    execute(recorded);
    if (asks && recorded.ending == Ending::committed) recorded.reads = query_.lists;
    recorded_.push_back(std::move(recorded));
  }

  /// Two transactions that together are one: the second is made on condition that nobody appended to what the
  /// first had read.
  void append_by_what_was_read() {
    const std::vector<Key> keys = some_lists();
    Recorded recorded;
    recorded.reads_come_first = true;
    transaction_->begin({});
    ask(keys);
    for (const Key key : keys)
      transaction_->read(world_.heads_[key]);
    if (ending_of(execute(recorded)) != Ending::committed) return;
    recorded.reads = query_.lists;
    std::vector<rtstdb::Version> written_by;
    for (std::uint32_t k = 0; k < keys.size(); ++k)
      written_by.push_back(transaction_->state(k)->written_by);

    transaction_->begin(terms());
    for (std::size_t k = 0; k < keys.size(); ++k)
      transaction_->expect_written_by(world_.heads_[keys[k]], written_by[k]);
    append({keys[random_() % keys.size()]}, recorded);
    if (ending_of(execute(recorded)) != Ending::committed) recorded.reads.clear();
    recorded_.push_back(std::move(recorded));
  }

  ListWorld& world_;
  std::minstd_rand random_;
  Value next_value_;
  std::unique_ptr<Transaction> transaction_;
  ListQuery query_;
  std::vector<Recorded> recorded_;
};

ListWorld::ListWorld()
    : engine_({.store = {.max_entities = 4096,
                         .retained_changes = 1u << 14,
                         .geometry_known = [](rtstdb::GeometryId id) { return !id.valid(); }},
               .queue_capacity = 64},
              executor_, clock_) {
  make_heads();
}

void ListWorld::make_heads() {
  const auto transaction = engine_.make_transaction({.max_writes = lists});
  transaction->begin({});
  for (Key key = 0; key < lists; ++key)
    transaction->create(row_of(key | head_bit, 0));
  engine_.submit(*transaction);
  engine_.wait(*transaction);
  for (Key key = 0; key < lists; ++key)
    heads_.push_back(transaction->created(key));
}

void ListWorld::clear() {
  const auto states = engine_.snapshot(ReadAt::latest());
  const auto transaction = engine_.make_transaction({.max_writes = 4096});
  transaction->begin({});
  for (const EntityState& state : states.value())
    if ((state.row.mask & head_bit) == 0) transaction->remove(state.id);
  engine_.submit(*transaction);
  engine_.wait(*transaction);
}

std::vector<Recorded> ListWorld::run(std::uint32_t seed, int clients, int transactions_each) {
  empty_since_ = engine_.latest().version;
  std::vector<Recorded> history;
  std::vector<ListClient> made;
  std::vector<std::thread> threads;
  made.reserve(static_cast<std::size_t>(clients));
  for (int k = 0; k < clients; ++k) {
    const auto number = static_cast<std::uint32_t>(k + 1);
    made.emplace_back(*this, seed * 64 + number, number << 24);
    threads.emplace_back([&client = made.back(), transactions_each] { client.run(transactions_each); });
  }
  for (std::thread& thread : threads)
    thread.join();
  made.front().read_all();
  for (ListClient& client : made)
    std::ranges::move(client.take(), std::back_inserter(history));
  clear();
  return history;
}

}  // namespace hil::stress
