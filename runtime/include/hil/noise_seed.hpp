#pragma once
// The seed of a module's random numbers. Pure function; any thread.

#include <cstdint>
#include <string_view>

#include <hil/splitmix64.hpp>

namespace hil::modules {

/// From the seed of the run: other modules have other seeds. Not negative.
inline std::int64_t noise_seed(std::uint64_t run_seed, std::string_view module) noexcept {
  std::uint64_t state = 0xCBF29CE484222325ull;  // FNV-1a
  for (const char letter : module)
    state = (state ^ static_cast<unsigned char>(letter)) * 0x100000001B3ull;
  return static_cast<std::int64_t>(splitmix64_finalizer(state ^ splitmix64_finalizer(run_seed)) >> 1);
}

}  // namespace hil::modules
