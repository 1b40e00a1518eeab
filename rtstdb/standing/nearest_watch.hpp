#pragma once
// Who is among the k nearest to a point. A guard distance divides the world: those beyond it are watched one by one for coming nearer,
// and those within, the candidates, which are some more than k, pair by pair for changing their order. When too few or too many are
// left within, another guard distance is chosen, for which all are looked at.

#include <limits>

#include "rtstdb/standing/distance.hpp"
#include "rtstdb/standing/watch.hpp"

namespace rtstdb::standing {

class NearestWatch final : public Watch {
 public:
  NearestWatch(const Question& question, const StandingOptions& options, const Mirror& mirror,
               threads::Bell& follower, Work& work);

  /// The order is every candidate's: nothing is known any more.
  void forget(std::span<const std::uint32_t> indices) noexcept override;

 private:
  void due(const Certificate& certificate) override;
  bool is_current(const Certificate& certificate) const noexcept override;
  void changed_rows(std::span<const std::uint32_t> indices, std::int64_t now_ns, EventCause cause) override;
  void changed_question(std::int64_t now_ns, EventCause cause) override;

  SquaredDistance distance(const EntityState& state) const noexcept;
  /// Takes note of who is seen at the index now. Its state; null: nobody.
  const EntityState* look_at(std::uint32_t index);
  void set_candidate(std::uint32_t index, bool candidate);
  void watch_guard(std::uint32_t index, const EntityState& state, std::int64_t from_ns);
  void choose_guard(std::int64_t now_ns);
  bool needs_another_guard() const noexcept;
  /// Finds out who the members are, and when their order changes next.
  void rank(std::int64_t now_ns, EventCause cause);
  void watch_order(std::int64_t from_ns);

  static constexpr std::uint32_t order_index = std::numeric_limits<std::uint32_t>::max();
  Question guarded_;  ///< the question, with the guard distance as its radius
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
