#pragma once
// A declared transaction: its terms, preconditions, writes, reads and queries, in memory that it allocates
// once.
//
// Threads: the owner's while it declares. Between mark_pending and finish everything belongs to the engine,
// except status, wait and request_cancel, which are safe in any thread.

#include <cstdint>
#include <span>
#include <vector>

#include <rtstdb/database.hpp>
#include <rtstdb/transaction.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/scheduler/scheduled_transaction.hpp"
#include "rtstdb/store/write_set.hpp"
#include "rtstdb/threads/futex.hpp"

namespace rtstdb::transaction {

class Engine;

struct Precondition {
  EntityId entity;
  bool any_version = true;  ///< the entity exists, in whichever version
  Version written_by = 0;   ///< otherwise: the version that wrote it last
};

class TransactionImpl final : public Transaction, public scheduler::ScheduledTransaction {
 public:
  TransactionImpl(const TransactionOptions& options, const Engine& engine);
  /// Misuse while it is pending.
  ~TransactionImpl() override;

  void begin(const Terms& terms) noexcept override;
  void expect_exists(EntityId entity) noexcept override;
  void expect_written_by(EntityId entity, Version version) noexcept override;
  std::uint32_t create(const EntityRow& row) noexcept override;
  void update(EntityId entity, const EntityRow& row) noexcept override;
  void update_motion(EntityId entity, const Motion& motion) noexcept override;
  void remove(EntityId entity) noexcept override;
  void update_geometry(GeometryId geometry, std::span<const glm::vec3> positions_m) noexcept override;
  std::uint32_t read(EntityId entity) noexcept override;
  void add_query(Query& query, std::uint32_t count) noexcept override;
  EntityId created(std::uint32_t ordinal) const noexcept override;
  const EntityState* state(std::uint32_t ordinal) const noexcept override;
  Status status() const noexcept override { return static_cast<Status>(status_.get()); }
  const Outcome& outcome() const noexcept override;

  // ---- any thread
  /// False: it is not pending.
  bool request_cancel() noexcept;
  /// Waits until it is no longer pending.
  void wait() noexcept { status_.wait_while(static_cast<std::uint32_t>(Status::pending)); }

  // ---- for the engine
  const Engine& engine() const noexcept { return engine_; }
  std::span<const Precondition> preconditions() const noexcept { return preconditions_; }
  std::size_t read_count() const noexcept { return reads_.size(); }
  /// The element counts of the requests as they were declared.
  std::span<const std::uint32_t> declared_counts() const noexcept { return declared_counts_; }
  /// Sets each request's count to part / parts of what was declared.
  void scale_requests(std::uint32_t part, std::uint32_t parts) noexcept;
  /// Fills its reads from the rows of one version.
  void answer_reads(const store::RowSource& rows) noexcept;
  /// Misuse of `call`, a public function, where begin was never called.
  void require_begun(const char* call) const noexcept;
  /// The transaction is submitted. Misuse where nothing was declared since its last outcome.
  void mark_pending() noexcept;
  /// Gives the transaction back to its owner, who may destroy it at once.
  void finish(Status status) noexcept;

  VersionInfo queried_version;  ///< the version that its queries read

 private:
  // `call`: the public function that a misuse message names.
  void declare(const char* call, const Precondition& precondition) noexcept;
  /// The row of the new write, to be filled.
  EntityRow& declare(const char* call, store::WriteKind kind, EntityId entity) noexcept;
  void declare(query::PreparedQuery* query, std::uint32_t count) noexcept;
  void require_declaring(const char* call) const noexcept;
  void require_outcome(const char* call) const noexcept;

  const TransactionOptions options_;
  const Engine& engine_;
  std::vector<Precondition> preconditions_;
  std::vector<glm::vec3> positions_m_;  ///< of the write set's shapes; reserved once, so that it never moves
  std::vector<std::uint32_t> creates_;  ///< by ordinal of create: index in the write set
  std::vector<std::uint32_t> declared_counts_;  ///< by request
  std::vector<EntityState> reads_;              ///< once answered, an invalid id is an absent entity
  bool begun_ = false;
  threads::FutexCell status_{static_cast<std::uint32_t>(Status::idle)};
};

}  // namespace rtstdb::transaction
