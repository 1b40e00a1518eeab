#pragma once
// Which batches are traced as packets (shaders/query/simd8/packet.glsl): those of a camera or a scanner, whose neighbouring rays look
// from one place into nearly one direction. Answers do not depend on it, only what they take.

#include <cstddef>
#include <span>

#include <rtstdb/query.hpp>

namespace rtstdb::query {

inline constexpr std::size_t rays_per_packet = 8;

/// Whether most groups of eight neighbours run side by side: with one carrier, from origins within a centimetre, in directions
/// within 0.04 rad of the first one's. Looks at up to 64 groups, which stand as far apart as they can. Fewer than eight rays
/// do not.
/// Thread rule: any thread. Does not allocate.
bool are_coherent(std::span<const Ray> rays) noexcept;

}  // namespace rtstdb::query
