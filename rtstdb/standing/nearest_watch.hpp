#pragma once
// A standing query for the k nearest entities. A guard radius divides the entities: each one outside is
// examined for entering the guard; those inside, the candidates, which are a few more than k, are compared in
// pairs for a change of order. If too few or too many candidates are left, another guard radius is chosen,
// which examines all entities.

#include <limits>

#include "rtstdb/standing/distance.hpp"
#include "rtstdb/standing/watch.hpp"

namespace rtstdb::standing {

class NearestWatch final : public Watch {
 public:
  NearestWatch(const QuerySpec& spec, const StandingOptions& options, const Mirror& mirror,
               threads::EventCount& follower_wake_up, WorkCounts& work);

  /// The order involves all candidates: invalidates all certificates.
  void invalidate(std::span<const std::uint32_t> indices) noexcept override;

 private:
  void on_due(const Certificate& certificate) override;
  bool is_current(const Certificate& certificate) const noexcept override;
  void reevaluate(std::span<const std::uint32_t> indices, std::int64_t now_ns, EventCause cause) override;
  void reevaluate_all(std::int64_t now_ns, EventCause cause) override;

  SquaredDistance distance(const EntityState& state) const noexcept;
  /// Updates whether the query considers the entity at the index. Returns its state; null: not considered.
  const EntityState* update_considered(std::uint32_t index);
  void set_candidate(std::uint32_t index, bool candidate);
  void schedule_guard(std::uint32_t index, const EntityState& state, std::int64_t from_ns);
  void choose_guard(std::int64_t now_ns);
  bool needs_another_guard() const noexcept;
  /// Determines the members, and the next instant at which their order changes.
  void rank(std::int64_t now_ns, EventCause cause);
  void schedule_order(std::int64_t from_ns);

  static constexpr std::uint32_t order_index = std::numeric_limits<std::uint32_t>::max();
  QuerySpec guard_spec_;  ///< the query with the guard radius as its radius
  std::size_t guard_size_, max_candidates_;
  std::size_t considered_count_ = 0;
  std::vector<std::uint32_t> candidates_;
  std::vector<std::uint32_t> members_;  ///< ascending
  std::uint32_t order_stamp_ = 0;
  std::uint8_t order_doublings_ = 0;

  struct Ranked {
    double key_m = 0.0;
    std::uint32_t index = 0;
  };
  std::vector<Ranked> ranking_;
  std::vector<std::uint32_t> new_members_;
};

}  // namespace rtstdb::standing
