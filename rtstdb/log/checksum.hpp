#pragma once
// The checksum of all files of the log: 64-bit XXH3. The seed is the database's id, so that data of another
// database has a wrong checksum.

#include <cstddef>
#include <cstdint>
#include <span>

namespace rtstdb::log {

std::uint64_t checksum(std::span<const std::byte> bytes, std::uint64_t seed) noexcept;

}  // namespace rtstdb::log
