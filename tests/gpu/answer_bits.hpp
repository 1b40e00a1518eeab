#pragma once
// Answers as 32-bit words, to compare the answers of two runs bit for bit.

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

/// Stands for an incomplete hit or list of neighbors.
inline const Words incomplete_words{0xFFFFFFFFu};

inline std::vector<Words> words_of(std::span<const RayHit> hits) {
  std::vector<Words> of_hits;
  for (const RayHit& hit : hits) {
    Words& words = of_hits.emplace_back();
    if (hit.status == HitStatus::incomplete) {
      words = incomplete_words;
      continue;
    }
    words.insert(words.end(), {static_cast<std::uint32_t>(hit.status), hit.mask, hit.material.index,
                               hit.triangle, hit.front_face ? 1u : 0u});
    for (const float value : {hit.lambda, hit.u, hit.v})
      add(words, value);
    add(words, hit.entity);
    add(words, hit.n_world);
    add(words, hit.v_relative_mps);
  }
  return of_hits;
}

/// An incomplete region has no words: what its search found depends on the tree, which differs from slot to
/// slot. Near the limit of rounds, the tree also decides whether the search is complete.
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

inline std::vector<Words> words_of(std::span<const NearestAnswer> answers) {
  std::vector<Words> of_points;
  for (const NearestAnswer& answer : answers) {
    Words& words = of_points.emplace_back();
    words.push_back(static_cast<std::uint32_t>(answer.neighbors.size()));
    if (answer.incomplete) words = incomplete_words;
    for (const Neighbor& one : answer.neighbors) {
      words.insert(words.end(), {one.mask, one.material.index, one.triangle, one.has_sign ? 1u : 0u});
      for (const float value : {one.distance_m, one.u, one.v})
        add(words, value);
      add(words, one.entity);
      add(words, one.p_world_m);
      add(words, one.v_relative_mps);
    }
  }
  return of_points;
}

inline std::vector<Words> words_of(std::span<const ConeReturn> returns) {
  std::vector<Words> of_returns;
  for (const ConeReturn& one : returns) {
    Words& words = of_returns.emplace_back();
    if (one.status == HitStatus::incomplete) {
      words = incomplete_words;
      continue;
    }
    words.insert(words.end(), {static_cast<std::uint32_t>(one.status), one.mask, one.material.index,
                               one.triangle, one.front_face ? 1u : 0u, one.overflow ? 1u : 0u});
    for (const float value : {one.lambda, one.u, one.v, one.fraction})
      add(words, value);
    add(words, one.entity);
    add(words, one.n_world);
    add(words, one.v_relative_mps);
  }
  return of_returns;
}

inline std::vector<Words> words_of(std::span<const ContactAnswer> answers) {
  std::vector<Words> of_searches;
  for (const ContactAnswer& answer : answers) {
    Words& words = of_searches.emplace_back();
    if (answer.incomplete) continue;
    words.insert(words.end(), {answer.found, answer.candidates, answer.overflow ? 1u : 0u});
    for (const ContactPair& pair : answer.pairs) {
      add(words, pair.first);
      add(words, pair.second);
      words.insert(words.end(),
                   {static_cast<std::uint32_t>(pair.status), pair.point_count, pair.has_depth ? 1u : 0u});
      for (const float value : {pair.distance_m, pair.min_distance_m, pair.max_distance_m})
        add(words, value);
      add(words, pair.n_world);
      for (const ContactPoint& point : pair.contacts()) {
        add(words, point.p_first_m);
        add(words, point.n_world);
        add(words, point.depth_m);
        add(words, point.v_relative_mps);
        words.insert(words.end(), {point.first_triangle, point.second_triangle});
      }
    }
  }
  return of_searches;
}

inline std::vector<Words> words_of(std::span<const ImpactAnswer> answers) {
  std::vector<Words> of_searches;
  for (const ImpactAnswer& answer : answers) {
    Words& words = of_searches.emplace_back();
    if (answer.incomplete) continue;
    words.insert(words.end(),
                 {static_cast<std::uint32_t>(answer.status), static_cast<std::uint32_t>(answer.reason),
                  answer.candidates, answer.overflow ? 1u : 0u});
    add(words, answer.second);
    const auto after_ns = static_cast<std::uint64_t>(answer.after.count());
    words.insert(words.end(),
                 {static_cast<std::uint32_t>(after_ns), static_cast<std::uint32_t>(after_ns >> 32)});
    add(words, answer.distance_m);
    add(words, answer.p_first_m);
    add(words, answer.n_world);
    add(words, answer.v_relative_mps);
  }
  return of_searches;
}

inline std::vector<Words> words_of(std::span<const Image> images) {
  std::vector<Words> of_images;
  for (const Image& image : images) {
    Words& words = of_images.emplace_back();
    if (!image.missing_tiles.empty() || image.incomplete_pixels > 0) {
      words = incomplete_words;
      continue;
    }
    for (const HalfColor& color : image.color)
      words.insert(words.end(), color.begin(), color.end());
    for (const SrgbColor& color : image.srgb)
      words.insert(words.end(), color.begin(), color.end());
    for (const float depth_m : image.depth_m)
      add(words, depth_m);
    for (const EntityId entity : image.entities)
      add(words, entity);
    words.insert(words.end(), image.triangles.begin(), image.triangles.end());
    for (const MaterialId material : image.materials)
      words.push_back(material.index);
    for (const glm::vec3& normal : image.normals)
      add(words, normal);
    for (const glm::vec2& motion : image.motion_px_s)
      add(words, glm::vec3(motion, 0.0f));
  }
  return of_images;
}

inline bool is_incomplete(const Words& words) {
  return words.empty() || words == incomplete_words;
}

/// All pairs of complete answers are equal, and at most 2 % of the answers are incomplete.
inline bool have_equal_answers(const std::vector<Words>& a, const std::vector<Words>& b) {
  std::size_t incomplete = 0;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    const bool one_is_incomplete = is_incomplete(a[i]) || is_incomplete(b[i]);
    if (!one_is_incomplete && a[i] != b[i]) return false;
    incomplete += one_is_incomplete ? 1 : 0;
  }
  return a.size() == b.size() && incomplete <= a.size() / 50;
}

}  // namespace rtstdb::test
