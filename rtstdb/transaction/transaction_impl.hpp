#pragma once
// A declared transaction: its terms, preconditions, writes and requests in memory of its own, allocated once.
//
// Threads: the owner declares; between mark_pending and finish everything but status() and wait() is the
// engine's.

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include <rtstdb/database.hpp>
#include <rtstdb/transaction.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/store/write_set.hpp"
#include "rtstdb/threads/futex.hpp"
#include "rtstdb/transaction/hand_over.hpp"

namespace rtstdb::transaction {

class Engine;
class ReservationImpl;

struct Precondition {
  EntityId entity;
  bool any_version = true;  ///< existence is enough
  Version written_by = 0;
};

class TransactionImpl final : public Transaction, public HandOverLink {
 public:
  TransactionImpl(const TransactionOptions& options, const Engine& engine);
  ~TransactionImpl() override;
  TransactionImpl(const TransactionImpl&) = delete;
  TransactionImpl& operator=(const TransactionImpl&) = delete;

  void begin(const Terms& terms) noexcept override;
  void expect_exists(EntityId entity) noexcept override;
  void expect_written_by(EntityId entity, Version version) noexcept override;
  std::uint32_t create(const EntityRow& row) noexcept override;
  void update(EntityId entity, const EntityRow& row) noexcept override;
  void update_motion(EntityId entity, const Motion& motion) noexcept override;
  void remove(EntityId entity) noexcept override;
  void update_geometry(GeometryId geometry, std::span<const glm::vec3> positions_m) noexcept override;
  std::uint32_t read(EntityId entity) noexcept override;
  void add_query(RayQuery& query, std::uint32_t count) noexcept override;
  void add_query(RegionQuery& query, std::uint32_t count) noexcept override;
  void add_query(NearestQuery& query, std::uint32_t count) noexcept override;
  void add_query(OverlapQuery& query, std::uint32_t count) noexcept override;
  EntityId created(std::uint32_t ordinal) const noexcept override;
  const EntityState* state(std::uint32_t ordinal) const noexcept override;
  Status status() const noexcept override { return static_cast<Status>(status_.get()); }
  const Outcome& outcome() const noexcept override { return outcome_; }

  // ---- for the engine
  const Engine& engine() const noexcept { return engine_; }
  const Terms& terms() const noexcept { return terms_; }
  bool is(DeadlineClass deadline_class) const noexcept { return terms_.deadline_class == deadline_class; }
  ReservationImpl* reservation() const noexcept;
  void set_deadline_if_none(ClockTime deadline) noexcept {
    if (terms_.deadline == ClockTime::max()) terms_.deadline = deadline;
  }
  std::span<const Precondition> preconditions() const noexcept { return preconditions_; }
  store::WriteSet& write_set() noexcept { return write_set_; }
  const store::WriteSet& write_set() const noexcept { return write_set_; }
  /// Misuse of `call`, a public function, where begin was never called.
  void require_begun(const char* call) const noexcept;
  std::size_t read_count() const noexcept { return reads_.size(); }
  std::span<const query::Request> requests() const noexcept { return requests_; }
  std::span<query::Request> requests() noexcept { return requests_; }
  std::span<const std::uint32_t> asked_counts() const noexcept { return asked_; }
  /// Asks as large a share of each batch as this of what was declared.
  void ask_parts(std::uint32_t share, std::uint32_t of) noexcept;
  Outcome& draft() noexcept { return outcome_; }
  /// Its deadline had passed by then; the least there is has passed by the longest time there is.
  void note_late(ClockTime now) noexcept;
  void answer_reads(const store::RowSource& rows) noexcept;
  void mark_pending() noexcept;
  /// Gives the transaction back to its owner, who may destroy it at once.
  void finish(Status status) noexcept;
  /// Any thread. False: it is not pending.
  bool ask_to_cancel() noexcept;
  bool is_to_be_cancelled() const noexcept { return to_be_cancelled_.load(std::memory_order_acquire); }
  void wait() noexcept { status_.wait_while(static_cast<std::uint32_t>(Status::pending)); }

  bool cost_known = false;
  Nanoseconds promised_cost{0};  ///< zero: not known
  Nanoseconds needed_cost{0};    ///< of that, what it takes to be done in time: answers may be partial
  bool promised = false;         ///< firm, and admitted by its cost
  Nanoseconds slack{0};          ///< promised: what may still come before it
  std::uint64_t arrival = 0;     ///< the engine's count of admitted transactions, for order among equals
  VersionInfo asked;             ///< the version that its queries are about
  bool reserved = false;         ///< it goes before all that are not, and is
  ClockTime due{};               ///< by then

 private:
  // `call`: the public function that messages about misuse name.
  void declare(const char* call, const Precondition& precondition) noexcept;
  /// The write's row, to be filled.
  EntityRow& declare(const char* call, store::WriteKind kind, EntityId entity) noexcept;
  void declare(query::PreparedQuery* query, std::uint32_t count) noexcept;
  void require_declaring(const char* call) const noexcept;
  void require_outcome(const char* call) const noexcept;

  const TransactionOptions options_;
  const Engine& engine_;
  Terms terms_;
  std::vector<Precondition> preconditions_;
  store::WriteSet write_set_;
  std::vector<glm::vec3> positions_m_;  ///< of the write set's shapes; stays where it is
  std::vector<std::uint32_t> creates_;  ///< ordinal of create -> index in the write set
  std::vector<query::Request> requests_;
  std::vector<std::uint32_t> asked_;  ///< the counts of the requests as declared
  std::vector<EntityState> reads_;    ///< asked for by id; once answered, an invalid id is an absent entity
  bool begun_ = false;
  Outcome outcome_;
  std::atomic<bool> to_be_cancelled_{false};
  threads::FutexCell status_{static_cast<std::uint32_t>(Status::idle)};
};

}  // namespace rtstdb::transaction
