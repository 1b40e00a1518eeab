#pragma once
// Decides which batches are traced as packets (shaders/query/simd8/packet.glsl): coherent ones, as those of a
// camera or a scanner, whose neighbouring rays have one origin and nearly one direction. Answers do not
// depend on it.

#include <cstddef>
#include <span>

#include <rtstdb/query.hpp>

namespace rtstdb::query {

inline constexpr std::size_t rays_per_packet = 8;

/// Whether most groups of eight neighbours are coherent: one carrier, origins within a centimetre, directions
/// within 0.04 rad of the first ray's. Samples up to 64 groups, evenly over the batch. False for fewer than
/// eight rays. Any thread; does not allocate.
bool are_coherent(std::span<const Ray> rays) noexcept;

}  // namespace rtstdb::query
