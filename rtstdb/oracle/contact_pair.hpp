#pragma once
// Two entities at the time of a search, with their hulls. Internal to the oracle.

#include <span>

#include "rtstdb/oracle/convex_body.hpp"
#include "rtstdb/oracle/oracle.hpp"
#include "rtstdb/oracle/posed_ray.hpp"

namespace rtstdb::oracle {

struct PosedPair {
  PosedEntity first, second;
  ConvexBody first_body, second_body;  ///< relative to the origin of the first entity
};

/// Misuse: an entity that does not exist or has no geometry, and geometry that is not convex.
PosedPair posed_pair(const World& world, EntityId first, EntityId second, WorldTime t);

PairTruth pair_truth(const PosedPair& pair);

/// The pair of two parts of the entities.
PosedPair posed_parts(const World& world, EntityId first, std::uint32_t first_part, EntityId second,
                      std::uint32_t second_part, WorldTime t);

/// Judge a property of an answered pair. judge_contact judges one contact point, whose normal has to be that
/// of `answer`. judge_direction: the gap along n is not below `at_least_m`. judge_status: too_close where the
/// distance is within its precision of the border between two statuses.
Judgement judge_status(const PairTruth& truth, const ContactSearch& search, const ContactPair& answer);
Judgement judge_undecided(const PairTruth& truth, const ContactPair& answer);
Judgement judge_distance(const PairTruth& truth, const ContactPair& answer);
Judgement judge_direction(const PosedPair& pair, const glm::dvec3& n, double at_least_m);
Judgement judge_contact(const PosedPair& pair, const PairTruth& truth, const ContactPair& answer,
                        const ContactPoint& point);
Judgement judge_velocity(const PosedEntity& first, const PosedEntity& second, const ContactPoint& point,
                         double precision_m);

/// Two parts of a pair of entities.
struct JudgedParts {
  PosedPair pair;
  PairTruth truth;
  std::span<const std::uint32_t> first_triangles, second_triangles;  ///< of the parts, in the whole meshes
};

/// The answer about entities of several parts. Status and distance are those of the nearest or deepest parts,
/// the normal is right for these or for others that are as near, and each contact point is right for some
/// parts.
Judgement judge_parts(std::span<const JudgedParts> parts, const ContactSearch& search,
                      const ContactPair& answer);

/// compare of one pair (oracle.hpp).
Judgement judge_pair(const PosedPair& pair, const PairTruth& truth, const ContactSearch& search,
                     const ContactPair& answer);

}  // namespace rtstdb::oracle
