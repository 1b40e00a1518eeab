#pragma once
// Answers as words, so that two runs can be held against each other bit for bit.

#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include <rtstdb/database.hpp>

namespace rtstdb::test {

using Words = std::vector<std::uint32_t>;

inline void add(Words& words, float value) {
  words.push_back(std::bit_cast<std::uint32_t>(value));
}

inline void add(Words& words, const glm::vec3& v) {
  for (const float value : {v.x, v.y, v.z})
    add(words, value);
}

inline void add(Words& words, EntityId id) {
  words.insert(words.end(), {id.index, id.generation});
}

/// Instead of what was found before a search was cut short.
inline const Words cut_short{0xFFFFFFFFu};

/// By hit.
inline std::vector<Words> words_of(std::span<const RayHit> hits) {
  std::vector<Words> of_hits;
  for (const RayHit& hit : hits) {
    Words& words = of_hits.emplace_back();
    if (hit.status == HitStatus::incomplete) {
      words = cut_short;
      continue;
    }
    words.insert(words.end(), {static_cast<std::uint32_t>(hit.status), hit.mask, hit.material, hit.triangle,
                               hit.front_face ? 1u : 0u});
    for (const float value : {hit.lambda, hit.u, hit.v})
      add(words, value);
    add(words, hit.entity);
    add(words, hit.n_world);
    add(words, hit.v_relative_mps);
  }
  return of_hits;
}

/// By region. What was found before a search was cut short depends on the tree, which is another one where a
/// slot was made anew; so does, at the edge of the limit, whether it was: nothing is said of such a region.
inline std::vector<Words> words_of(std::span<const RegionAnswer> answers) {
  std::vector<Words> of_regions;
  for (const RegionAnswer& answer : answers) {
    Words& words = of_regions.emplace_back();
    if (answer.incomplete) continue;
    words.insert(words.end(), {answer.found, answer.overflow ? 1u : 0u});
    for (const EntityId id : answer.entities)
      add(words, id);
    for (const EntityTriangle& one : answer.triangles) {
      add(words, one.entity);
      words.push_back(one.triangle);
    }
  }
  return of_regions;
}

/// By point.
inline std::vector<Words> words_of(std::span<const NearestAnswer> answers) {
  std::vector<Words> of_points;
  for (const NearestAnswer& answer : answers) {
    Words& words = of_points.emplace_back();
    words.push_back(static_cast<std::uint32_t>(answer.neighbors.size()));
    if (answer.incomplete) words = cut_short;
    for (const Neighbor& one : answer.neighbors) {
      words.insert(words.end(), {one.mask, one.material, one.triangle, one.has_sign ? 1u : 0u});
      for (const float value : {one.distance_m, one.u, one.v})
        add(words, value);
      add(words, one.entity);
      add(words, one.p_world_m);
      add(words, one.v_relative_mps);
    }
  }
  return of_points;
}

/// By return.
inline std::vector<Words> words_of(std::span<const ConeReturn> returns) {
  std::vector<Words> of_returns;
  for (const ConeReturn& one : returns) {
    Words& words = of_returns.emplace_back();
    if (one.status == HitStatus::incomplete) {
      words = cut_short;
      continue;
    }
    words.insert(words.end(), {static_cast<std::uint32_t>(one.status), one.mask, one.material, one.triangle,
                               one.front_face ? 1u : 0u, one.overflow ? 1u : 0u});
    for (const float value : {one.lambda, one.u, one.v, one.fraction})
      add(words, value);
    add(words, one.entity);
    add(words, one.n_world);
    add(words, one.v_relative_mps);
  }
  return of_returns;
}

/// Where both say something it is the same, and hardly any says nothing.
inline bool same(const std::vector<Words>& a, const std::vector<Words>& b) {
  std::size_t silent = 0;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    const bool nothing_said = a[i].empty() || b[i].empty();
    if (!nothing_said && a[i] != b[i]) return false;
    silent += nothing_said ? 1 : 0;
  }
  return a.size() == b.size() && silent <= a.size() / 50;
}

}  // namespace rtstdb::test
