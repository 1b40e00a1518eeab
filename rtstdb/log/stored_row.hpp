#pragma once
// Encodes and decodes the row of an entity in records and checkpoints. Decoded rows must satisfy the rules
// that every write satisfies, so that bytes which no database wrote are refused.

#include <cstdint>

#include <rtstdb/entity.hpp>

#include "rtstdb/log/bytes.hpp"
#include "rtstdb/store/motion_words.hpp"

namespace rtstdb::log {

static_assert(sizeof(StoredMotion) == sizeof(store::MotionWords), "its words, in their order");
static_assert(unchanged_words == store::all_motion_words);
inline constexpr std::size_t word_bytes = sizeof(store::MotionWords::value_type);
inline constexpr std::size_t row_bytes = sizeof(StoredAppearance) + sizeof(StoredMotion);

void put_motion(ByteWriter& writer, const Motion& motion) noexcept;
/// Writes the words that are not omitted (`unchanged_words`, `valid_from_is_world_time`).
void put_partial_motion(ByteWriter& writer, const Motion& motion, std::uint16_t omitted_words) noexcept;
constexpr std::size_t partial_motion_bytes(std::uint16_t omitted_words) noexcept {
  return sizeof(StoredMotion) - word_bytes * store::count_of_words(omitted_words);
}
/// Writes the row without its geometry.
void put_row(ByteWriter& writer, const EntityRow& row) noexcept;

/// The decoders and checks return a description of the fault, or null.
[[nodiscard]] const char* get_motion(ByteReader& reader, Motion& motion) noexcept;
/// Omitted unchanged words become zero; complete() fills them in, then check_stored() checks the motion.
[[nodiscard]] const char* get_partial_motion(ByteReader& reader, std::uint16_t omitted_words,
                                             WorldTime world_time, Motion& motion) noexcept;
void complete(Motion& motion, const Motion& before, std::uint16_t unchanged) noexcept;
[[nodiscard]] const char* check_stored(const Motion& motion) noexcept;
/// Reads all members except the geometry, which must be set before.
[[nodiscard]] const char* get_row(ByteReader& reader, EntityRow& row) noexcept;
/// Accepts the index of no geometry too.
[[nodiscard]] const char* check_geometry_index(std::uint32_t index) noexcept;
[[nodiscard]] const char* check_time(std::int64_t time_ns) noexcept;

}  // namespace rtstdb::log
