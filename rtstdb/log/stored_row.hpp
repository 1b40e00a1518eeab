#pragma once
// An entity's row as it lies in records and checkpoints. What is read back is held to the rules that every write passes, so
// that bytes which no database wrote are refused.

#include <cstdint>

#include <rtstdb/entity.hpp>

#include "rtstdb/log/bytes.hpp"
#include "rtstdb/store/motion_words.hpp"

namespace rtstdb::log {

static_assert(sizeof(StoredMotion) == sizeof(store::MotionWords), "its words, in their order");
static_assert(unchanged_words == store::all_motion_words);
inline constexpr std::size_t word_bytes = sizeof(store::MotionWords::value_type);
inline constexpr std::size_t row_bytes = sizeof(StoredLook) + sizeof(StoredMotion);

void put_motion(ByteWriter& writer, const Motion& motion) noexcept;
/// But for what is left out: `unchanged_words`, `holds_from_world_time`.
void put_told(ByteWriter& writer, const Motion& motion, std::uint16_t left_out) noexcept;
constexpr std::size_t told_bytes(std::uint16_t left_out) noexcept {
  return sizeof(StoredMotion) - word_bytes * store::count_of_words(left_out);
}
/// All but the geometry.
void put_row(ByteWriter& writer, const EntityRow& row) noexcept;

/// What is wrong, or null.
[[nodiscard]] const char* get_motion(ByteReader& reader, Motion& motion) noexcept;
/// The words that are unchanged are zero in the motion, which is to be completed and then checked.
[[nodiscard]] const char* get_told(ByteReader& reader, std::uint16_t left_out, WorldTime world_time,
                                   Motion& motion) noexcept;
void complete(Motion& motion, const Motion& before, std::uint16_t unchanged) noexcept;
[[nodiscard]] const char* check_stored(const Motion& motion) noexcept;
/// The row's geometry is taken as it is.
[[nodiscard]] const char* get_row(ByteReader& reader, EntityRow& row) noexcept;
/// Of an index that says whether there is a geometry at all.
[[nodiscard]] const char* check_geometry_index(std::uint32_t index) noexcept;
[[nodiscard]] const char* check_time(std::int64_t time_ns) noexcept;

}  // namespace rtstdb::log
