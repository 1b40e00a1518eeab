#pragma once
// The engine with a simulated clock, device and disk. All events follow from a seed: transactions of every
// class with writes, reads, queries, preconditions and cancellations; a slow or lost device; clock jumps;
// disk faults; killed processes and power failures, after which a new engine recovers from the disk. A model
// checks every outcome and every recovered world.

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <rtstdb/database.hpp>

#include "rtstdb/transaction/engine.hpp"
#include "tests/long/simulated_storage.hpp"
#include "tests/long/world_model.hpp"
#include "tests/support/simulation/device.hpp"

namespace hil::long_test {

/// Events of one or more seeds.
struct SimulationCounts {
  std::uint64_t steps = 0;
  std::array<std::uint64_t, 16> ended{};  ///< by rtstdb::Status
  std::uint64_t nested_runs = 0;
  std::uint64_t losses = 0, losses_in_nested_runs = 0;
  std::uint64_t lost_while_waiting = 0;       ///< device_lost without a run
  std::uint64_t commits_by_write_helper = 0;  ///< while another transaction waits for the device
  std::uint64_t full_queues = 0;
  std::uint64_t observations = 0;
  std::array<std::uint64_t, 8> refused{};      ///< by rtstdb::RefusedBy
  std::uint64_t durable = 0, not_durable = 0;  ///< commits in the modes group and sync
  std::uint64_t in_doubt = 0, recovered_doubts = 0;
  std::uint64_t recovered = 0, closed = 0;
  std::uint64_t processes_with_losses = 0, gaps = 0;
  SimulatedStorage::Counts storage;
  std::uint64_t event_hash = 0;  ///< of all outcomes and their times
  bool operator==(const SimulationCounts&) const = default;
  void add(const SimulationCounts& other);
};

struct DeclaredTransaction {
  struct Expected {
    rtstdb::EntityId id;
    rtstdb::Version written_by = 0;
  };
  rtstdb::Terms terms;
  std::vector<ModelWrite> writes;  ///< the ids of creations are set when it is done
  std::vector<Expected> expected;
  std::vector<rtstdb::EntityId> reads;
  std::uint32_t elements = 0;
  rtstdb::Version newest_before = 0;  ///< the latest version when it was submitted
  rtstdb::ClockTime submitted{};
  bool cancelled = false;
};

/// A transaction with its outcome, and the worlds that its queries read.
struct EndedTransaction {
  struct Observation {
    rtstdb::Version version = 0;
    std::uint64_t digest = 0;
  };
  DeclaredTransaction declared;
  rtstdb::Outcome outcome;
  std::vector<std::optional<rtstdb::EntityState>> reads;
  std::vector<Observation> observed;
  std::optional<rtstdb::query::RunStatus> run;
  rtstdb::ClockTime last_chunk{};
};

class EngineSimulation final : private DeviceEvents {
 public:
  explicit EngineSimulation(std::uint64_t seed);
  ~EngineSimulation() override;

  /// Runs that many steps, or up to the first fault, and closes the engine. Returns the fault with its step;
  /// empty: none.
  std::string run(std::uint64_t steps);
  const SimulationCounts& counts() const { return counts_; }

 private:
  class Query;
  struct Client;

  void run_begins(std::span<const rtstdb::query::Request> requests) override;
  bool chunk_done(const rtstdb::store::RowSource& rows, const rtstdb::query::PreparedQuery& query,
                  bool last) override;
  void run_ends(rtstdb::query::RunStatus status) override;
  bool may_run_write_helper() override;
  void run_write_helper() override;

  // One process with an engine after the other.
  void begin_process();
  void end_process();
  void check_recovery(rtstdb::Version found);
  void finish_log_work();

  // On the engine thread.
  void run_round();
  void submit_some(std::uint32_t max_count);
  Client* idle_client();
  void declare(Client& client);
  void declare_writes(Client& client);
  rtstdb::Terms random_terms();
  void submit(Client& client);
  void submit_probe();
  rtstdb::EntityId random_entity();
  void cancel_one();
  void collect(Client& client);

  // Checks against the model, while no transaction runs.
  void check();
  void check_one(const EndedTransaction& ended);
  void check_done(const EndedTransaction& ended);
  void check_reads(const EndedTransaction& ended);
  void check_not_done(const EndedTransaction& ended);
  void check_conflict(const EndedTransaction& ended);
  void check_bad_input(const EndedTransaction& ended);
  void check_refusal(const EndedTransaction& ended);
  void check_durability(const EndedTransaction& ended);
  void check_counts();
  static std::string describe(const EndedTransaction& ended);
  void fail(const std::string& what);

  void wait_until_idle();
  bool is_idle() const;
  std::uint32_t held() const;
  void check_snapshot();

  const std::uint64_t seed_;
  Chance chance_;
  SimulatedClock clock_;
  SimulatedDevice device_{chance_, clock_, *this};
  SimulatedStorage storage_;
  std::vector<std::unique_ptr<Client>> clients_;
  /// Only writes, with the lowest priority: when it is done, the write helper has no other work.
  Client* probe_ = nullptr;
  std::vector<std::vector<Client*>> running_;  ///< the clients of each run, the innermost run last
  std::vector<EndedTransaction> ended_;
  WorldModel model_;
  std::vector<rtstdb::EntityId> known_;             ///< entities that exist
  std::vector<rtstdb::Version> committed_;          ///< the latest versions
  std::array<std::uint64_t, 16> outcome_counts_{};  ///< outcomes by status
  std::uint32_t next_mask_ = 1;
  bool checks_snapshot_ = false;   ///< after this round
  bool process_ends_ = false;      ///< after this round
  bool must_recover_all_ = false;  ///< the log was closed, or every commit waited for it
  std::atomic<std::uint64_t> submissions_{0};
  std::string fault_;
  SimulationCounts counts_;
  std::unique_ptr<rtstdb::transaction::Engine> engine_;
};

}  // namespace hil::long_test
