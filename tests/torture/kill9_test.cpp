// Processes that commit and are killed by SIGKILL, one after the other on one log: what was acknowledged as durable is there, nothing
// is there in part, and what async mode lost fits into what it says it may lose.
//
// Transaction n writes n into four entities out of 64 and makes version n, so that what every version was can be told without asking.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <random>
#include <string>
#include <vector>

#include "rtstdb/log/posix_disk.hpp"
#include "rtstdb/transaction/engine.hpp"

namespace hil::torture {
namespace {

using namespace rtstdb;

#ifdef HIL_TORTURE_LONG
constexpr int cycles = 1000;
#else
constexpr int cycles = 30;
#endif
constexpr std::uint32_t entities = 64;
constexpr std::size_t ring_bytes = std::size_t{256} << 10;
/// A commit takes no less than that in the ring.
constexpr std::size_t least_record_bytes = 400;

class NoQueries final : public query::Executor {
 public:
  query::RunReport run(const query::RowSource&, std::span<const query::Request>, const query::TimeSpan&,
                       query::Meanwhile*) noexcept override {
    return {};
  }
};

/// By entity, the number of the transaction that wrote it last.
using Written = std::vector<std::uint32_t>;

/// The first transaction creates all; each other one writes four.
std::vector<std::uint32_t> written_by(Version n) {
  std::vector<std::uint32_t> written;
  if (n == 1) {
    for (std::uint32_t k = 0; k < entities; ++k)
      written.push_back(k);
    return written;
  }
  std::mt19937_64 random(n);
  for (int k = 0; k < 4; ++k)
    written.push_back(static_cast<std::uint32_t>(random() % entities));
  return written;
}

/// One process's database.
class Opened {
 public:
  Opened(const std::filesystem::path& directory, DurabilityMode mode) {
    transaction::CommitLogOptions options;
    options.durability.mode = mode;
    options.durability.ring_bytes = ring_bytes;
    options.durability.segment_bytes = std::uint64_t{256} << 10;
    options.durability.checkpoint_every_bytes = std::uint64_t{1} << 20;
    options.durability.flush_interval = Nanoseconds(2'000'000);
    options.max_entities = entities;
    auto disk = log::open_directory(directory);
    if (!disk) throw std::runtime_error(disk.error().in_words());
    auto opened = transaction::CommitLog::open(std::move(disk.value()), options);
    if (!opened) throw std::runtime_error(opened.error().message);
    transaction::EngineOptions engine_options;
    engine_options.store.max_entities = entities;
    engine_options.store.geometry_known = [](GeometryId id) { return !id.valid(); };
    engine =
        std::make_unique<transaction::Engine>(engine_options, executor, clock, std::move(opened).value());
    transaction_ = engine->make_transaction({.max_writes = entities});
  }

  const Outcome& commit(Version n) {
    transaction_->begin({});
    EntityRow row;
    row.material = static_cast<std::uint32_t>(n);
    for (const std::uint32_t index : written_by(n)) {
      if (n == 1) {
        transaction_->create(row);
      } else {
        transaction_->update({index, 1}, row);
      }
    }
    engine->submit(*transaction_);
    return engine->wait(*transaction_);
  }

  NoQueries executor;
  transaction::MonotonicClock clock;
  std::unique_ptr<transaction::Engine> engine;

 private:
  std::unique_ptr<Transaction> transaction_;
};

/// What the process told before it was killed.
struct Told {
  Version done = 0;     ///< acknowledged
  Version durable = 0;  ///< acknowledged as durable
  std::uint64_t in_gaps = 0;
};

/// Commits until it is killed. Ends by itself only where something is wrong.
[[noreturn]] void commit_for_ever(const std::filesystem::path& directory, DurabilityMode mode, int tell) {
  try {
    Opened opened(directory, mode);
    for (Version n = opened.engine->latest().version + 1;; ++n) {
      const Outcome& outcome = opened.commit(n);
      if (!outcome.done() || outcome.version != n) {
        std::cerr << "transaction " << n << ": " << describe(outcome) << "\n";
        _exit(3);
      }
      if (outcome.durable != (mode != DurabilityMode::async)) _exit(4);
      const Told told{n, opened.engine->log()->durable(), opened.engine->log()->state().commits_in_gaps};
      if (write(tell, &told, sizeof told) != sizeof told) _exit(5);
    }
  } catch (const std::exception& failure) {
    std::cerr << failure.what() << "\n";
  }
  _exit(6);
}

Told last_told(int from) {
  Told told;
  for (Told next; read(from, &next, sizeof next) == sizeof next;)
    told = next;
  return told;
}

class Kill9 : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "hil_kill9_XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    directory_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }

  /// A process from its begin to its end by a signal, some time after its first commit.
  Told live(DurabilityMode mode) {
    int ends[2];
    EXPECT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) {
      close(ends[0]);
      commit_for_ever(directory_, mode, ends[1]);
    }
    close(ends[1]);
    Told first;
    EXPECT_EQ(read(ends[0], &first, sizeof first), static_cast<ssize_t>(sizeof first));
    // The pipe is emptied meanwhile, or the child would wait for it.
    const auto micros = static_cast<useconds_t>(random_() % 30'000);
    const pid_t killer = fork();
    if (killer == 0) {
      usleep(micros);
      kill(child, SIGKILL);
      _exit(0);
    }
    Told told = last_told(ends[0]);
    if (told.done == 0) told = first;
    close(ends[0]);
    waitpid(killer, nullptr, 0);
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) << "it ended by itself: " << status;
    return told;
  }

  /// Holds what the log tells of against what was told.
  void look(DurabilityMode mode, const Told& told) {
    auto disk = log::open_existing_directory(directory_);
    ASSERT_TRUE(disk);
    const auto recovered = log::recover(*disk.value());
    ASSERT_TRUE(recovered.ok()) << recovered.error().message;
    const log::World& world = recovered.value().world;
    const std::string found = recovered.value().report.in_words();
    const Version version = world.latest.version;
    ASSERT_GE(version, told.durable) << found;
    ASSERT_GE(version, at_) << found;
    // One more may have been done than was told of.
    ASSERT_LE(version, told.done + 1 + (mode == DurabilityMode::group ? 1 : 0)) << found;
    while (at_ < version)
      for (const std::uint32_t index : written_by(++at_))
        written_[index] = static_cast<std::uint32_t>(at_);
    ASSERT_EQ(world.rows.size(), entities);
    for (std::uint32_t index = 0; index < entities; ++index)
      ASSERT_EQ(world.rows[index].row.material, written_[index])
          << "entity " << index << " of version " << version << "; " << found;
    const Version lost = told.done > version ? told.done - version : 0;
    if (mode != DurabilityMode::async) {
      ASSERT_EQ(lost, 0u) << found;
    } else if (told.in_gaps == 0) {
      // The ring, and the group that was being written.
      ASSERT_LE(lost, 2 * ring_bytes / least_record_bytes) << found;
      most_lost_ = std::max(most_lost_, lost);
    } else {
      ++with_gaps_;
    }
  }

  std::filesystem::path directory_;
  std::mt19937_64 random_{9};
  Version at_ = 0;
  Written written_ = Written(entities, 0);
  Version most_lost_ = 0;
  int with_gaps_ = 0;
};

TEST_F(Kill9, LosesNothingThatWasPromised) {
  constexpr DurabilityMode modes[] = {DurabilityMode::async, DurabilityMode::group, DurabilityMode::sync};
  for (int cycle = 0; cycle < cycles && !HasFailure(); ++cycle) {
    const DurabilityMode mode = modes[cycle % 3];
    SCOPED_TRACE(std::string("cycle ") + std::to_string(cycle) + ", " + to_string(mode));
    const Told told = live(mode);
    look(mode, told);
  }
  EXPECT_GT(at_, static_cast<Version>(cycles));
  std::cout << cycles << " processes killed, " << at_ << " versions; async lost " << most_lost_
            << " commits at most; " << with_gaps_ << " had a full ring\n";
}

}  // namespace
}  // namespace hil::torture
