#pragma once
// Clients that append to the lists of list_history.hpp in a database and read them.
//
// A value is an entity at the place of its list. The order of a list is that of the versions that created its
// values. Each list has a head: an entity that every append writes too, so that a precondition on it fails
// after an append by another client.

#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include <rtstdb/database.hpp>

#include "tests/long/list_history.hpp"

namespace hil::long_test {

constexpr Key list_count = 6;
constexpr std::uint32_t head_mask = 1, value_mask = 2;
/// Number of materials that values have; the database has to know them.
constexpr std::uint32_t materials = 3;

constexpr double list_x_m(Key key) {
  return 100.0 * key;
}

/// Reads lists of one transaction after the other.
class ListReader {
 public:
  virtual ~ListReader() = default;
  virtual void add_to(rtstdb::Transaction& transaction, const std::vector<Key>& keys) = 0;
  /// The values of the list keys[k], in any order.
  virtual std::vector<rtstdb::EntityId> entities(std::size_t k) const = 0;
};

/// The lists of a database: an rtstdb::Database or a transaction::Engine.
template <class Database>
class ListClients {
 public:
  struct Options {
    std::function<std::unique_ptr<ListReader>()> make_reader;
    rtstdb::GeometryId geometry;          ///< of the values
    rtstdb::Nanoseconds max_deadline{0};  ///< relative to now
  };

  ListClients(Database& database, Options options) : database_(database), options_(std::move(options)) {
    const auto transaction = database_.make_transaction({.max_writes = list_count});
    transaction->begin({});
    for (Key key = 0; key < list_count; ++key)
      transaction->create(head());
    database_.submit(*transaction);
    database_.wait(*transaction);
    for (Key key = 0; key < list_count; ++key)
      heads_.push_back(transaction->created(key));
  }

  /// Each client runs its transactions in a thread; then all lists are read and cleared. One seed gives the
  /// same transactions, not the same interleaving.
  std::vector<RecordedTransaction> run(std::uint32_t seed, int client_count, int transactions_each) {
    empty_version_ = database_.latest().version;
    std::vector<std::unique_ptr<Client>> clients;
    for (std::uint32_t number = 1; number <= static_cast<std::uint32_t>(client_count); ++number)
      clients.push_back(std::make_unique<Client>(*this, seed * 64 + number, number << 24));
    std::vector<std::thread> threads;
    for (const auto& client : clients)
      threads.emplace_back([&client, transactions_each] { client->run(transactions_each); });
    for (std::thread& thread : threads)
      thread.join();
    clients.front()->read_all();
    CreatedValues created;
    for (const auto& client : clients)
      created.insert(client->created.begin(), client->created.end());
    std::vector<RecordedTransaction> history;
    for (const auto& client : clients)
      client->record(created, history);
    clear();
    return history;
  }

 private:
  struct CreatedValue {
    rtstdb::Version version = 0;
    Value value = 0;
    auto operator<=>(const CreatedValue&) const = default;
  };
  using CreatedValues = std::map<rtstdb::EntityId, CreatedValue>;

  static rtstdb::EntityRow head() {
    rtstdb::EntityRow row;
    row.mask = head_mask;
    return row;
  }

  static std::int64_t now_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

  void clear() {
    const auto states = database_.snapshot(rtstdb::ReadAt::latest());
    const auto transaction = database_.make_transaction({.max_writes = 4096});
    transaction->begin({});
    for (const rtstdb::EntityState& state : states.value())
      if (state.row.mask == value_mask) transaction->remove(state.id);
    database_.submit(*transaction);
    database_.wait(*transaction);
  }

  class Client {
   public:
    Client(ListClients& lists, std::uint32_t seed, Value first_value)
        : lists_(lists),
          database_(lists.database_),
          random_(seed),
          next_value_(first_value),
          transaction_(database_.make_transaction(
              {.max_writes = 16, .max_preconditions = 4, .max_queries = 1, .max_reads = 4})),
          reader_(lists.options_.make_reader()) {}

    void run(int transactions) {
      while (transactions-- > 0) {
        const auto kind = random_() % 8;
        if (kind < 2)
          read(rtstdb::ReadAt::latest());
        else if (kind == 2)
          read_old_version();
        else if (kind < 5)
          append_if_unchanged();
        else
          append_and_read();
      }
    }

    /// Every list, after all other clients have ended.
    void read_all() {
      std::vector<Key> keys;
      for (Key key = 0; key < list_count; ++key)
        keys.push_back(key);
      Attempt last;
      do {
        transaction_->begin({});
        add_read(keys);
      } while (!execute(last));  // it may be cancelled, or lose its device
      take_reads(last);
      attempts_.push_back(std::move(last));
    }

    /// Entities become values when the versions that created them are known.
    void record(const CreatedValues& all, std::vector<RecordedTransaction>& history) {
      for (Attempt& attempt : attempts_) {
        for (const auto& [key, entities] : attempt.reads) {
          std::vector<CreatedValue> values;
          for (const rtstdb::EntityId entity : entities) {
            const auto found = all.find(entity);
            values.push_back(found != all.end() ? found->second
                                                : CreatedValue{0, 0xFFFFFFFFu});  // not appended
          }
          std::ranges::sort(values);
          ListRead& read = attempt.recorded.reads.emplace_back(ListRead{key, {}});
          for (const CreatedValue& value : values)
            read.values.push_back(value.value);
        }
        history.push_back(std::move(attempt.recorded));
      }
    }

    CreatedValues created;

   private:
    struct Attempt {
      RecordedTransaction recorded;
      std::vector<std::pair<Key, std::vector<rtstdb::EntityId>>> reads;
      std::vector<std::pair<std::uint32_t, Value>> creates;  ///< ordinal, value
    };

    std::vector<Key> some_lists() {
      std::vector<Key> keys(1 + random_() % 3);
      for (Key& key : keys)
        key = static_cast<Key>(random_() % list_count);
      std::ranges::sort(keys);
      keys.erase(std::unique(keys.begin(), keys.end()), keys.end());  // clang 14 can not read ranges::unique
      return keys;
    }

    rtstdb::Terms terms() {
      rtstdb::Terms made;
      made.importance = static_cast<std::uint8_t>(random_() % 3);
      made.deadline_class = static_cast<rtstdb::DeadlineClass>(random_() % 4);
      const auto range = static_cast<std::uint64_t>(lists_.options_.max_deadline.count());
      made.deadline = rtstdb::clock_time_ns(now_ns()) + rtstdb::Nanoseconds(random_() % range);
      return made;
    }

    void add_read(const std::vector<Key>& keys) {
      keys_ = keys;
      reader_->add_to(*transaction_, keys);
    }

    void append(const std::vector<Key>& keys, Attempt& attempt) {
      for (const Key key : keys) {
        for (auto count = 1 + random_() % 2; count > 0; --count) {
          rtstdb::EntityRow row;
          row.geometry = lists_.options_.geometry;
          row.mask = value_mask;
          row.material = {static_cast<std::uint32_t>(next_value_ % materials)};
          row.motion.p_world_m.x = list_x_m(key);
          attempt.creates.emplace_back(transaction_->create(row), next_value_);
          attempt.recorded.appends.push_back({key, next_value_++});
        }
        transaction_->update(lists_.heads_[key], head());
      }
    }

    /// Whether the transaction has committed.
    bool execute(Attempt& attempt) {
      RecordedTransaction& recorded = attempt.recorded;
      if (recorded.begun_ns == 0) recorded.begun_ns = now_ns();
      database_.submit(*transaction_);
      if (random_() % 16 == 0) database_.cancel(*transaction_);
      const rtstdb::Outcome& outcome = database_.wait(*transaction_);
      recorded.ended_ns = now_ns();
      recorded.committed = outcome.done();
      for (const auto& [ordinal, value] : attempt.creates)
        if (outcome.done())
          created.emplace(transaction_->created(ordinal), CreatedValue{outcome.version, value});
      return outcome.done();
    }

    void take_reads(Attempt& attempt) {
      for (std::size_t k = 0; k < keys_.size(); ++k)
        attempt.reads.emplace_back(keys_[k], reader_->entities(k));
    }

    void read(rtstdb::ReadAt read_at) {
      Attempt attempt;
      attempt.recorded.reads_old_version = read_at.kind != rtstdb::ReadAt::Kind::latest;
      rtstdb::Terms given = terms();
      given.read_at = read_at;
      transaction_->begin(given);
      add_read(some_lists());
      if (execute(attempt)) take_reads(attempt);
      attempts_.push_back(std::move(attempt));
    }

    void read_old_version() {
      const rtstdb::Version latest = database_.latest().version;
      const rtstdb::Version versions = std::min<rtstdb::Version>(latest - lists_.empty_version_ + 1, 40);
      read(rtstdb::ReadAt::pinned(latest - random_() % versions));
    }

    void append_and_read() {
      Attempt attempt;
      transaction_->begin(terms());
      append(some_lists(), attempt);
      const bool reads = random_() % 2 == 0;
      if (reads) add_read(some_lists());
      if (execute(attempt) && reads) take_reads(attempt);
      attempts_.push_back(std::move(attempt));
    }

    /// Two transactions with the effect of one: the second is on condition that no append followed the reads
    /// of the first.
    void append_if_unchanged() {
      const std::vector<Key> keys = some_lists();
      Attempt attempt;
      attempt.recorded.reads_before_appends = true;
      transaction_->begin({});
      add_read(keys);
      for (const Key key : keys)
        transaction_->read(lists_.heads_[key]);
      if (!execute(attempt)) return;
      take_reads(attempt);
      std::vector<rtstdb::Version> written_by;
      for (std::uint32_t k = 0; k < keys.size(); ++k)
        written_by.push_back(transaction_->state(k)->written_by);
      transaction_->begin(terms());
      for (std::size_t k = 0; k < keys.size(); ++k)
        transaction_->expect_written_by(lists_.heads_[keys[k]], written_by[k]);
      append({keys[random_() % keys.size()]}, attempt);
      if (!execute(attempt)) attempt.reads.clear();
      attempts_.push_back(std::move(attempt));
    }

    ListClients& lists_;
    Database& database_;
    std::minstd_rand random_;
    Value next_value_;
    std::unique_ptr<rtstdb::Transaction> transaction_;
    std::unique_ptr<ListReader> reader_;
    std::vector<Key> keys_;  ///< of the last read
    std::vector<Attempt> attempts_;
  };

  Database& database_;
  const Options options_;
  std::vector<rtstdb::EntityId> heads_;  ///< by key
  rtstdb::Version empty_version_ = 0;    ///< before the clients begin
};

struct HistorySummary {
  std::string anomaly;  ///< the first; empty: none
  std::size_t transactions = 0, committed = 0, reads = 0;
};

/// Runs and checks rounds up to the first anomaly.
template <class Database>
HistorySummary check_rounds(ListClients<Database>& lists, std::uint32_t rounds, int clients,
                            int transactions_each) {
  HistorySummary summary;
  for (std::uint32_t round = 0; round < rounds && summary.anomaly.empty(); ++round) {
    const std::vector<RecordedTransaction> history = lists.run(round, clients, transactions_each);
    for (const RecordedTransaction& one : history) {
      ++summary.transactions;
      summary.committed += one.committed ? 1 : 0;
      summary.reads += one.reads.size();
    }
    if (const auto found = find_anomaly(history))
      summary.anomaly = "round " + std::to_string(round) + ": " + found->text;
  }
  return summary;
}

}  // namespace hil::long_test
