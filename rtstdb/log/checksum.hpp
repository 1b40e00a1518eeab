#pragma once
// The checksum of everything that the log writes: XXH3 of 64 bits. The seed is the database's id, so that what another
// database wrote is not taken for whole.

#include <cstddef>
#include <cstdint>
#include <span>

namespace rtstdb::log {

std::uint64_t checksum(std::span<const std::byte> bytes, std::uint64_t seed) noexcept;

}  // namespace rtstdb::log
