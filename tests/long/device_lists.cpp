#include "tests/long/device_lists.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <map>
#include <random>
#include <thread>
#include <utility>

namespace hil::stress {

using namespace rtstdb;

namespace {

constexpr std::uint32_t max_values = 512;  // of one list
constexpr std::uint32_t head_mask = 1;
constexpr std::uint32_t value_mask = 2;

std::int64_t now_ns() {
  return std::chrono::steady_clock::now().time_since_epoch().count();
}

EntityRow head_row() {
  EntityRow row;
  row.mask = head_mask;
  return row;
}

EntityRow value_row(GeometryId body, Key key, Value value) {
  EntityRow row;
  row.geometry = body;
  row.mask = value_mask;
  row.material = value;
  row.motion.p_world_m.x = 100.0 * key;
  return row;
}

/// A value that was made: where it comes in its list.
struct Made {
  Version version = 0;
  Value value = 0;
  auto place() const { return std::pair(version, value); }
};
using MadeBy = std::map<EntityId, Made>;

/// A list as it was read, before it is known who its bodies are.
struct RawRead {
  Key key = 0;
  std::vector<EntityId> bodies;
};

std::vector<Value> values_of(const RawRead& read, const MadeBy& made_by) {
  std::vector<Made> values;
  values.reserve(read.bodies.size());
  for (const EntityId body : read.bodies) {
    const auto found = made_by.find(body);
    // A body that nobody was told to have made: no value has this number.
    values.push_back(found != made_by.end() ? found->second : Made{0, 0xFFFFFFFFu});
  }
  std::ranges::sort(values, {}, &Made::place);
  std::vector<Value> words;
  words.reserve(values.size());
  for (const Made& made : values)
    words.push_back(made.value);
  return words;
}

}  // namespace

/// One thread that appends and reads.
class DeviceLists::Client {
 public:
  Client(DeviceLists& world, std::uint32_t seed, Value first_value)
      : world_(world),
        random_(seed),
        next_value_(first_value),
        transaction_(world.database_->make_transaction(
            {.max_writes = 16, .max_preconditions = 4, .max_queries = 1, .max_reads = 4})) {
    auto regions = world.database_->prepare(
        RegionQueryOptions{.name = "lists", .capacity = lists, .ids_per_region = max_values});
    if (!regions) std::abort();
    regions_ = std::move(regions).value();
  }

  void run(int transactions) {
    while (transactions-- > 0) {
      switch (random_() % 8) {
        case 0:
        case 1:
          read(ReadAt::latest());
          break;
        case 2: {
          const Version latest = world_.database_->latest().version;
          const Version versions = std::min<Version>(latest - world_.empty_since_ + 1, 40);
          read(ReadAt::pinned(latest - random_() % versions), true);
          break;
        }
        case 3:
        case 4:
          append_by_what_was_read();
          break;
        default:
          append_and_read();
      }
    }
  }

  /// Every list, after all others have ended.
  void read_all() {
    std::vector<Key> keys;
    for (Key key = 0; key < lists; ++key)
      keys.push_back(key);
    Attempt last;
    do {
      transaction_->begin({});
      ask(keys);
    } while (!execute(last));  // it may be cancelled, as any
    take_reads(last);
    attempts_.push_back(std::move(last));
  }

  void tell(MadeBy& made_by) const { made_by.insert(made_.begin(), made_.end()); }
  void put_into_words(const MadeBy& made_by, std::vector<Recorded>& history) {
    for (Attempt& attempt : attempts_) {
      for (const RawRead& raw : attempt.raw)
        attempt.recorded.reads.push_back({raw.key, values_of(raw, made_by)});
      history.push_back(std::move(attempt.recorded));
    }
  }

 private:
  struct Attempt {
    Recorded recorded;
    std::vector<RawRead> raw;
    std::vector<std::pair<std::uint32_t, Value>> creates;  ///< ordinal, value
  };

  std::vector<Key> some_lists() {
    std::vector<Key> keys(1 + random_() % 3);
    for (Key& key : keys)
      key = static_cast<Key>(random_() % lists);
    std::ranges::sort(keys);
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    return keys;
  }

  Terms terms() {
    Terms made;
    made.importance = static_cast<std::uint8_t>(random_() % 3);
    made.deadline_class = static_cast<DeadlineClass>(random_() % 4);
    made.deadline = clock_time_ns(now_ns()) + Nanoseconds(random_() % 20'000'000);
    return made;
  }

  void ask(const std::vector<Key>& keys) {
    asked_ = keys;
    for (std::size_t k = 0; k < keys.size(); ++k) {
      Region& region = regions_->regions()[k];
      region = {};
      region.center_m.x = 100.0f * static_cast<float>(keys[k]);
      region.half_extent_m = {10.0f, 10.0f, 10.0f};
      region.mask = value_mask;
    }
    transaction_->add_query(*regions_, static_cast<std::uint32_t>(keys.size()));
  }

  void append(const std::vector<Key>& keys, Attempt& attempt) {
    for (const Key key : keys) {
      for (auto count = 1 + random_() % 2; count > 0; --count) {
        attempt.creates.emplace_back(transaction_->create(value_row(world_.body_, key, next_value_)),
                                     next_value_);
        attempt.recorded.appends.push_back({key, next_value_++});
      }
      transaction_->update(world_.heads_[key], head_row());
    }
  }

  /// Whether it is done.
  bool execute(Attempt& attempt) {
    Recorded& recorded = attempt.recorded;
    recorded.begun_ns = recorded.begun_ns == 0 ? now_ns() : recorded.begun_ns;
    world_.database_->submit(*transaction_);
    if (random_() % 16 == 0) world_.database_->cancel(*transaction_);
    const Outcome& outcome = world_.database_->wait(*transaction_);
    recorded.ended_ns = now_ns();
    recorded.ending = outcome.done() ? Ending::committed : Ending::nothing_done;
    for (const auto& [ordinal, value] : attempt.creates)
      if (outcome.done()) made_.emplace(transaction_->created(ordinal), Made{outcome.version, value});
    return outcome.done();
  }

  void take_reads(Attempt& attempt) {
    for (std::size_t k = 0; k < asked_.size(); ++k) {
      const RegionAnswer& answer = regions_->answers()[k];
      if (answer.overflow || answer.incomplete) std::abort();  // the lists are too long for this test
      attempt.raw.push_back({asked_[k], {answer.entities.begin(), answer.entities.end()}});
    }
  }

  void read(ReadAt read_at, bool past = false) {
    Attempt attempt;
    attempt.recorded.reads_the_past = past;
    Terms given = terms();
    given.read_at = read_at;
    transaction_->begin(given);
    ask(some_lists());
    if (execute(attempt)) take_reads(attempt);
    attempts_.push_back(std::move(attempt));
  }

  void append_and_read() {
    Attempt attempt;
    transaction_->begin(terms());
    append(some_lists(), attempt);
    const bool asks = random_() % 2 == 0;
    if (asks) ask(some_lists());
    if (execute(attempt) && asks) take_reads(attempt);
    attempts_.push_back(std::move(attempt));
  }

  /// Two transactions that together are one: the second is made on condition that nobody appended to what the
  /// first had read.
  void append_by_what_was_read() {
    const std::vector<Key> keys = some_lists();
    Attempt attempt;
    attempt.recorded.reads_come_first = true;
    transaction_->begin({});
    ask(keys);
    for (const Key key : keys)
      transaction_->read(world_.heads_[key]);
    if (!execute(attempt)) return;
    take_reads(attempt);
    std::vector<Version> written_by;
    for (std::uint32_t k = 0; k < keys.size(); ++k)
      written_by.push_back(transaction_->state(k)->written_by);
    transaction_->begin(terms());
    for (std::size_t k = 0; k < keys.size(); ++k)
      transaction_->expect_written_by(world_.heads_[keys[k]], written_by[k]);
    append({keys[random_() % keys.size()]}, attempt);
    if (!execute(attempt)) attempt.raw.clear();
    attempts_.push_back(std::move(attempt));
  }

  DeviceLists& world_;
  std::minstd_rand random_;
  Value next_value_;
  std::unique_ptr<Transaction> transaction_;
  std::unique_ptr<RegionQuery> regions_;
  std::vector<Key> asked_;
  std::vector<Attempt> attempts_;
  MadeBy made_;
};

std::string DeviceLists::open() {
  DatabaseOptions options;
  if (const char* select = std::getenv("HIL_TEST_GPU"); select != nullptr) options.gpu = select;
  options.validation = Validation::off;
  options.max_entities = 4096;
  options.retained_changes = 1u << 14;
  auto opened = Database::open(options);
  if (!opened) return opened.error().message;
  database_ = std::move(opened).value();
  const auto body = database_->add_geometry(make_box({1.0, 1.0, 1.0}), "value");
  if (!body) return body.error().message;
  body_ = body.value();
  const auto transaction = database_->make_transaction({.max_writes = lists});
  transaction->begin({});
  for (Key key = 0; key < lists; ++key)
    transaction->create(head_row());
  const Outcome& outcome = database_->execute(*transaction);
  if (!outcome.done()) return describe(outcome);
  for (Key key = 0; key < lists; ++key)
    heads_.push_back(transaction->created(key));
  return {};
}

void DeviceLists::clear() {
  const auto states = database_->snapshot(ReadAt::latest());
  const auto transaction = database_->make_transaction({.max_writes = 4096});
  transaction->begin({});
  for (const EntityState& state : states.value())
    if (state.row.mask == value_mask) transaction->remove(state.id);
  database_->execute(*transaction);
}

std::vector<Recorded> DeviceLists::run(std::uint32_t seed, int clients, int transactions_each) {
  empty_since_ = database_->latest().version;
  std::vector<std::unique_ptr<Client>> made;
  std::vector<std::thread> threads;
  made.reserve(static_cast<std::size_t>(clients));
  threads.reserve(static_cast<std::size_t>(clients));
  for (int k = 0; k < clients; ++k) {
    const auto number = static_cast<std::uint32_t>(k + 1);
    made.push_back(std::make_unique<Client>(*this, seed * 64 + number, number << 24));
  }
  for (const auto& client : made)
    threads.emplace_back([&client, transactions_each] { client->run(transactions_each); });
  for (std::thread& thread : threads)
    thread.join();
  made.front()->read_all();
  MadeBy made_by;
  for (const auto& client : made)
    client->tell(made_by);
  std::vector<Recorded> history;
  for (const auto& client : made)
    client->put_into_words(made_by, history);
  clear();
  return history;
}

}  // namespace hil::stress
