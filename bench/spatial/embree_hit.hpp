#pragma once
// Embree's result for a ray.

#include <cstdint>
#include <string>

namespace hil::bench {

struct PeerHit {
  float lambda = -1.0f;  ///< negative: a miss
  std::uint32_t triangle = 0;
  std::uint32_t instance = 0;
};

std::string embree_version();

}  // namespace hil::bench
