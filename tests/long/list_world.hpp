#pragma once
// Lists that can only be appended to, kept in a database whose queries are answered by reading rows: what the
// judge of list_history.hpp needs of it.
//
// An entity is a value (its material) of a list (its mask); a list's values stand in the order of the
// versions that wrote them. Each list has a head, an entity that every append writes too, so that an append
// can be made on condition that nobody appended since.

#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include <rtstdb/database.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/transaction/engine.hpp"
#include "rtstdb/transaction/monotonic_clock.hpp"
#include "tests/long/list_history.hpp"

namespace hil::stress {

/// Asks for whole lists.
class ListQuery final : public rtstdb::RayQuery, public rtstdb::query::PreparedQuery {
 public:
  std::span<rtstdb::Ray> rays() noexcept override { return {}; }
  std::span<const rtstdb::RayHit> hits() const noexcept override { return {}; }
  rtstdb::query::CostClass cost_class() const noexcept override {
    return rtstdb::query::CostClass::ray_closest;
  }
  std::uint32_t capacity() const noexcept override { return 64; }
  std::optional<rtstdb::BadInput> check(std::uint32_t count, const rtstdb::store::RowSource& rows,
                                        rtstdb::store::TimeSpan& times) const noexcept override;

  std::uint32_t answered() const noexcept override { return capacity(); }
  std::uint32_t incomplete(std::uint32_t) const noexcept override { return 0; }
  bool truncated() const noexcept override { return false; }
  void publish_answers(std::uint32_t, std::uint32_t) noexcept override {}
  void discard_answers() noexcept override {}
  const rtstdb::AnswerInfo& answer_info() const noexcept override { return info; }

  std::vector<ListRead> lists;  ///< by key; values are the answer
};

/// Answers half of the lists before it waits for its device, and half after, as a device does that reads
/// while others commit. Now and then the device is lost.
class ListExecutor final : public rtstdb::query::Executor {
 public:
  rtstdb::query::RunReport run(const rtstdb::store::RowSource& rows,
                               std::span<const rtstdb::query::Request> requests,
                               const rtstdb::store::TimeSpan& times,
                               rtstdb::query::ExecutorCallbacks* callbacks) noexcept override;

 private:
  std::minstd_rand random_{1};
};

class ListWorld {
 public:
  static constexpr Key lists = 6;

  ListWorld();

  /// Clients append and read at once, until each has made so many transactions; then every list is read, and
  /// all is cleared. The same seed gives the same intentions, not the same interleaving.
  std::vector<Recorded> run(std::uint32_t seed, int clients, int transactions_each);
  rtstdb::TransactionCounts counts() const { return engine_.counts(); }

 private:
  friend class ListClient;
  void make_heads();
  void clear();

  rtstdb::transaction::MonotonicClock clock_;
  ListExecutor executor_;
  rtstdb::transaction::Engine engine_;
  std::vector<rtstdb::EntityId> heads_;  ///< by key
  rtstdb::Version empty_since_ = 0;      ///< the version before the clients began
};

}  // namespace hil::stress
