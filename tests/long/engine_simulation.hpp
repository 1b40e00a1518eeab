#pragma once
// The engine on a simulated machine, driven through a course of events that follows from a seed: transactions
// of every class that write, read, ask, expect and are cancelled; a device that is slow, is lost and does not
// always come back; a machine that stands still at a bad moment; a log on a disk that refuses, and processes
// that are killed and machines that lose their power, after which the next engine goes on from the disk. What
// it says of each transaction, and what is there after each end, is held against a model.

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

namespace hil::stress {

/// What a course of events has to have met, over many seeds.
struct SimulationCounts {
  std::uint64_t steps = 0;
  std::array<std::uint64_t, 16> ended{};  ///< by rtstdb::Status
  std::uint64_t in_gaps = 0;              ///< runs inside of another's
  std::uint64_t losses = 0, losses_in_gaps = 0;
  std::uint64_t given_back_waiting = 0;      ///< device_lost without having run
  std::uint64_t passed_by_write_helper = 0;  ///< commits while another waits for the device
  std::uint64_t full_queues = 0;
  std::uint64_t observations = 0;
  std::array<std::uint64_t, 8> refused{};      ///< by rtstdb::RefusedBy
  std::uint64_t durable = 0, not_durable = 0;  ///< writers that were told so, in modes that tell
  std::uint64_t in_doubt = 0, doubts_that_stood = 0;
  std::uint64_t recovered = 0, closed = 0;
  std::uint64_t losing_lives = 0, gaps = 0;
  SimulatedStorage::Counts storage;
  std::uint64_t course = 0;  ///< follows from all that was said and when
  bool operator==(const SimulationCounts&) const = default;
  void add(const SimulationCounts& other);
};

struct DeclaredTransaction {
  struct Expected {
    rtstdb::EntityId id;
    rtstdb::Version written_by = 0;
  };
  rtstdb::Terms terms;
  std::vector<ModelWrite> writes;  ///< ids of creates are known when it is done
  std::vector<Expected> expected;
  std::vector<rtstdb::EntityId> reads;
  std::uint32_t asked = 0;
  rtstdb::Version newest_before = 0;  ///< that was known to be committed when it was submitted
  rtstdb::ClockTime submitted{};
  bool cancelled = false;
};

/// One that came to its end, as it was told, and what the device saw of it.
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

  /// So many steps, or until something is wrong: the step and what, in words; else empty. At its end the
  /// engine is closed.
  std::string run(std::uint64_t steps);
  const SimulationCounts& counts() const { return counts_; }

 private:
  class Query;
  struct Client;

  void run_begins(std::span<const rtstdb::query::Request> requests) override;
  bool chunk_done(const rtstdb::store::RowSource& rows, const rtstdb::query::PreparedQuery& query,
                  bool last) override;
  void run_ends(rtstdb::query::RunStatus status) override;
  bool may_pause() override;
  void pauses() override;

  // The engine, one life after the other.
  void begin_life();
  void end_life();
  void judge_recovery(rtstdb::Version found);
  void let_the_log_finish();

  // On the engine thread.
  void play_round();
  void submit_some(std::uint32_t most);
  Client* free_client();
  void declare(Client& client);
  void declare_writes(Client& client);
  rtstdb::Terms any_terms();
  void submit(Client& client);
  void submit_probe();
  rtstdb::EntityId any_known();
  void cancel_one();
  void take_ended(Client& client);

  // What was said, against the model. Nothing is under way.
  void judge();
  void judge_one(const EndedTransaction& ended);
  void judge_done(const EndedTransaction& ended);
  void judge_reads(const EndedTransaction& ended);
  void judge_not_done(const EndedTransaction& ended);
  void judge_conflict(const EndedTransaction& ended);
  void judge_bad_input(const EndedTransaction& ended);
  void judge_refusal(const EndedTransaction& ended);
  void judge_durability(const EndedTransaction& ended);
  void judge_counts();
  static std::string describe(const EndedTransaction& ended);
  void fail(const std::string& what);

  void wait_until_idle();
  bool is_idle() const;
  std::uint32_t held() const;
  void look_at_snapshot();

  const std::uint64_t seed_;
  Chance chance_;
  SimulatedClock clock_;
  SimulatedDevice device_{chance_, clock_, *this};
  SimulatedStorage storage_;
  std::vector<std::unique_ptr<Client>> clients_;
  Client* probe_ =
      nullptr;  ///< only writes, and is the last of all: when it is done, all others are that can be
  std::vector<std::vector<Client*>> running_;  ///< by run, the innermost last: those that share it
  std::vector<EndedTransaction> ended_;
  WorldModel model_;
  std::vector<rtstdb::EntityId> known_;     ///< alive when nothing was under way last
  std::vector<rtstdb::Version> committed_;  ///< the last ones
  std::array<std::uint64_t, 16> told_{};    ///< outcomes by status
  std::uint32_t next_material_ = 1;
  bool looks_at_snapshot_ = false;  ///< after this round
  bool life_ends_ = false;          ///< after this round
  bool must_find_all_ = false;      ///< the log was closed, or was never behind
  std::atomic<std::uint64_t> submissions_{0};
  std::string fault_;
  SimulationCounts counts_;
  std::unique_ptr<rtstdb::transaction::Engine> engine_;
};

}  // namespace hil::stress
