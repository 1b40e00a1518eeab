#pragma once
// The contact query of the rigid_bodies module: one search a step, its contact points, and counts and events
// of answers that are not complete.
//
// Threads: creation while configuring; take in the tick, without allocation.

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <hil/world/world_module.hpp>

#include "runtime/modules/rigid_bodies/body_set.hpp"
#include "runtime/modules/rigid_bodies/frozen_contacts.hpp"
#include "runtime/modules/rigid_bodies/placed_bodies.hpp"
#include "runtime/modules/rigid_bodies/touch_log.hpp"

namespace hil::modules {

class ContactWatch {
 public:
  struct Counts {
    std::uint64_t undecided = 0;  ///< pairs, once a step
    std::uint64_t overflows = 0;  ///< steps without a whole answer
    std::uint64_t late = 0;       ///< pairs that touched and were not near in the answer before
    std::uint32_t pressing = 0;   ///< points with depth in the last answer
    double depth_m = 0.0;         ///< of the deepest of them
  };

  /// `placed`: the entities. Throws SetupError if the query can not be prepared, and if two bodies overlap at
  /// run time 0 by more than the larger of 2 % of the smaller one's diagonal and twice the depth at which
  /// they rest.
  ContactWatch(World& world, EventLog& events, const std::string& caller, const RigidBodiesOptions& options,
               std::vector<rtstdb::EntityId> entities, std::span<const PlacedBody> placed);

  /// Queries the contacts at the step's time in the version, or in the release's if that is newer, reads the
  /// rows of the fixed bodies, and freezes the points. Without an answer the earlier points stay.
  void take(WorldStep& context, BodySet& bodies, rtstdb::Version version) noexcept;

  FrozenContacts& contacts() noexcept { return contacts_; }
  const FrozenContacts& contacts() const noexcept { return contacts_; }
  TouchLog& touches() noexcept { return touches_; }
  const TouchLog& touches() const noexcept { return touches_; }
  const Counts& counts() const noexcept { return counts_; }
  /// By body: whether it has a contact, or one within the margin, in the last answer.
  std::span<const char> is_near() const noexcept { return is_near_; }

 private:
  static constexpr std::uint32_t unlisted = std::numeric_limits<std::uint32_t>::max();
  void check_first_overlaps(const std::string& caller, const RigidBodiesOptions& options,
                            std::span<const PlacedBody> placed);
  void freeze(WorldStep& context, BodySet& bodies) noexcept;
  /// The index of a body; of an entity that is none, unlisted.
  std::uint32_t body_of(rtstdb::EntityId entity) const noexcept;

  rtstdb::Database& database_;
  const std::vector<rtstdb::EntityId> entities_;
  const float margin_m_;
  std::vector<std::uint32_t> body_of_entity_;  ///< by entity index
  std::uint32_t moving_mask_ = 0, all_mask_ = 0;
  std::vector<std::uint32_t> fixed_;  ///< the bodies without mass, in the order of the reads
  std::unique_ptr<rtstdb::ContactQuery> query_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
  FrozenContacts contacts_;
  TouchLog touches_;
  Counts counts_;
  std::vector<char> is_near_;
  std::vector<bool> moves_;
  bool is_first_ = true, was_whole_ = true, was_decided_ = true;
  EventLog::Kind overflow_, no_answer_, undecided_, late_;
};

}  // namespace hil::modules
