#include "bench/transactions/recovery.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include <rtstdb/database.hpp>

#include "bench/spatial/side_by_side.hpp"
#include "bench/transactions/folder.hpp"

namespace hil::bench {
namespace {

constexpr std::uint32_t moved_per_tick = 100;

struct Size {
  std::uint32_t entities, ticks;
};

rtstdb::DatabaseOptions database_options(const Size& size, const std::filesystem::path& directory) {
  rtstdb::DatabaseOptions options;
  options.max_entities = size.entities;
  options.durability.directory = directory;
  options.durability.ring_bytes = std::size_t{64} << 20;
  options.durability.checkpoint_every_bytes = 0;  // recovery has to read the whole log
  return options;
}

/// Executes the ticks of a loop without pacing.
class LoggedLife {
 public:
  LoggedLife(const Size& size, rtstdb::Database& database)
      : size_(size), database_(database), transaction_(database.make_transaction({.max_writes = 1000})) {}

  void live() {
    for (std::uint32_t made = 0; made < size_.entities;) {
      transaction_->begin({});
      for (const std::uint32_t end = std::min(made + 1000, size_.entities); made < end; ++made)
        transaction_->create({});
      commit();
    }
    rtstdb::Motion motion;
    for (std::uint32_t tick = 1; tick <= size_.ticks; ++tick) {
      transaction_->begin({});
      motion.p_world_m.x = tick;
      for (std::uint32_t k = 0; k < moved_per_tick; ++k)
        transaction_->update_motion({(tick * moved_per_tick + k) % size_.entities, 1}, motion);
      commit();
    }
    must(database_.close());
    if (database_.durability().commits_in_gaps != 0)
      throw std::runtime_error("recovery: commits were not recorded");
  }

 private:
  void commit() {
    const rtstdb::Outcome& outcome = database_.execute(*transaction_);
    if (!outcome.done()) throw std::runtime_error(rtstdb::describe(outcome));
    // The ring never fills.
    if (outcome.version % 100 == 0)
      database_.wait_until_durable(outcome.version, rtstdb::Nanoseconds(60'000'000'000));
  }

  Size size_;
  rtstdb::Database& database_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
};

/// Throws unless the last tick was recovered.
void demand_last_tick(const Size& size, rtstdb::Database& opened, rtstdb::Version version) {
  const auto states = must(opened.snapshot(rtstdb::ReadAt::latest()));
  if (opened.latest().version != version || states.size() != size.entities)
    throw std::runtime_error("recovery: not all has come back");
  for (std::uint32_t k = 0; k < moved_per_tick; ++k)
    if (states[(size.ticks * moved_per_tick + k) % size.entities].row.motion.p_world_m.x != size.ticks)
      throw std::runtime_error("recovery: not all has come back as it was");
}

}  // namespace

std::vector<Figure> measure_recovery(const SuiteOptions& options) {
  const Size size = options.tiny ? Size{1000, 100} : Size{100'000, 10'000};
  const int rounds = options.tiny ? 1 : 5;
  const Folder folder;
  const rtstdb::DatabaseOptions opened_with = database_options(size, folder.path());
  rtstdb::Version version = 0;
  {
    const auto database = must(rtstdb::Database::open(opened_with));
    LoggedLife(size, *database).live();
    version = database->latest().version;
  }
  std::vector<double> opens_ms, reads_ms;
  for (int round = 0; round < rounds; ++round) {
    std::unique_ptr<rtstdb::Database> database;
    opens_ms.push_back(1e3 * seconds_of([&] { database = must(rtstdb::Database::open(opened_with)); }));
    reads_ms.push_back(1e-6 * static_cast<double>(database->recovery().duration.count()));
    demand_last_tick(size, *database, version);
  }
  const auto samples = static_cast<std::uint64_t>(rounds);
  return {{"recovery", median(opens_ms), "ms", "", std::nullopt, Better::lower, samples},
          {"recovery_of_the_log_alone", median(reads_ms), "ms", "", std::nullopt, Better::lower, samples}};
}

}  // namespace hil::bench
