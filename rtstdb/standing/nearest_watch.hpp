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
  NearestWatch(const Question& question, const StandingOptions& options, const Mirror& mirror,
               threads::Bell& follower, Work& work);

  /// The order involves all candidates: invalidates all certificates.
  void forget(std::span<const std::uint32_t> indices) noexcept override;

 private:
  void due(const Certificate& certificate) override;
  bool is_current(const Certificate& certificate) const noexcept override;
  void changed_rows(std::span<const std::uint32_t> indices, std::int64_t now_ns, EventCause cause) override;
  void changed_question(std::int64_t now_ns, EventCause cause) override;

  SquaredDistance distance(const EntityState& state) const noexcept;
  /// Updates whether the query considers the entity at the index. Returns its state; null: not considered.
  const EntityState* look_at(std::uint32_t index);
  void set_candidate(std::uint32_t index, bool candidate);
  void watch_guard(std::uint32_t index, const EntityState& state, std::int64_t from_ns);
  void choose_guard(std::int64_t now_ns);
  bool needs_another_guard() const noexcept;
  /// Determines the members, and the next instant at which their order changes.
  void rank(std::int64_t now_ns, EventCause cause);
  void watch_order(std::int64_t from_ns);

  static constexpr std::uint32_t order_index = std::numeric_limits<std::uint32_t>::max();
  Question guarded_;  ///< the query with the guard radius as its radius
  std::size_t wanted_, max_candidates_;
  std::size_t seen_count_ = 0;
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
