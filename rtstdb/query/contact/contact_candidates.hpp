#pragma once
// The candidates of a batch of contact searches: pairs of bodies whose bounds overlap, and the pairs of their
// convex parts. The device searches the neighbours of bodies; what it finds becomes pairs in the order of the
// answers.
//
// Threads: the engine thread. Only reserve allocates.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "rtstdb/query/contact/surface_pairs.hpp"
#include "rtstdb/query/gpu_query.hpp"
#include "shaders/shared/query.h"

namespace rtstdb::query {

/// Of the first list of each body. A body that finds more is searched again with a list as long as needed.
inline constexpr std::uint32_t ids_per_body = 16;

class ContactCandidates {
 public:
  /// An entity whose neighbours are searched.
  struct Body {
    std::uint32_t search = 0;
    std::uint32_t entity = 0;  ///< index
    std::uint32_t mask = 0;    ///< of its neighbours
    bool above = false;        ///< neighbours with a higher index alone
    std::uint32_t found = 0;
    std::uint32_t begin = 0;  ///< of its list of ids
    bool incomplete = false;
  };
  /// A pair of bodies; its pairs of parts are part_pairs()[first_pair, end_pair).
  struct Candidate {
    std::uint32_t search = 0;
    EntityId first, second;
    std::uint32_t first_pair = 0, end_pair = 0;
    bool is_convex = false;  ///< both bodies consist of convex parts
    /// Unless is_convex: its number in SurfacePairs; nullopt: it did not fit there.
    std::optional<std::uint32_t> surfaces{};
  };
  struct PartPair {
    std::uint32_t candidate = 0;
    std::uint16_t first_part = 0, second_part = 0;
  };
  struct SearchState {
    std::uint32_t bodies_end = 0;
    std::uint32_t candidates = 0;
    bool overflow = false, incomplete = false;
  };

  ContactCandidates(std::uint32_t max_searches, std::uint32_t max_bodies, std::uint32_t max_candidates)
      : max_searches_(max_searches), max_bodies_(max_bodies), max_candidates_(max_candidates) {}
  void reserve();

  /// Begins a batch: lists the bodies of all its searches. The span has to stay valid during the batch.
  void list_bodies(std::span<const ContactSearch> searches, const BatchWorld& world) noexcept;
  /// Takes over what the first search has counted for each body, and lists the bodies that need longer lists.
  void list_wide_bodies(std::span<const shared::RegionCount> counts) noexcept;
  /// Lists candidates and pairs of parts, and adds the other pairs to `surfaces`. `counts`: of the wide
  /// bodies, by their place; `ids`: all lists, which are sorted.
  void list_pairs(std::span<const shared::RegionCount> counts, std::span<std::uint32_t> ids,
                  const BatchWorld& world, SurfacePairs& surfaces) noexcept;

  std::span<const Body> bodies() const noexcept { return bodies_; }
  /// Numbers of bodies, ascending.
  std::span<const std::uint32_t> wide_bodies() const noexcept { return wide_bodies_; }
  /// By search, then as in the answers.
  std::span<const Candidate> candidates() const noexcept { return candidates_; }
  std::span<const PartPair> part_pairs() const noexcept { return part_pairs_; }
  const SearchState& state(std::uint32_t search) const noexcept { return states_[search]; }

 private:
  void list_bodies_of(std::uint32_t search, const BatchWorld& world) noexcept;
  bool add_body(const Body& body) noexcept;
  /// After the first candidates that do not fit, none does, so that those tested are the first ones.
  bool has_space_for(std::uint32_t search, std::uint32_t count) noexcept;
  void add_candidates_of(const Body& body, std::span<std::uint32_t> ids, const BatchWorld& world,
                         SurfacePairs& surfaces) noexcept;
  void add_candidate(Candidate candidate, const BatchWorld& world, SurfacePairs& surfaces) noexcept;
  /// The pairs of parts that may touch; of a named pair all. False: they do not fit.
  bool add_part_pairs(const Candidate& candidate, const BatchWorld& world) noexcept;

  const std::uint32_t max_searches_, max_bodies_, max_candidates_;
  std::span<const ContactSearch> searches_;
  std::vector<SearchState> states_;  // of each search
  std::vector<Body> bodies_;
  std::vector<std::uint32_t> wide_bodies_;
  std::vector<Candidate> candidates_;
  std::vector<PartPair> part_pairs_;
  bool is_full_ = false;  // candidates did not fit
};

}  // namespace rtstdb::query
