#include "rtstdb/log/stored_row.hpp"

#include <bit>
#include <cmath>
#include <cstring>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/row_check.hpp"
#include "rtstdb/log/stored_definition.hpp"
#include "rtstdb/store/motion_words.hpp"

namespace rtstdb::log {
namespace {

using store::MotionWords;

/// Whether the quaternion is normalised, up to a few last bits.
bool is_unit(const glm::dquat& q) noexcept {
  return std::abs(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z - 1.0) < 1e-12;
}

glm::dvec3 vector(const double (&v)[3]) noexcept {
  return {v[0], v[1], v[2]};
}

/// The words that the record holds.
std::uint32_t stored_words(std::uint32_t omitted_words) noexcept {
  if ((omitted_words & valid_from_is_world_time) != 0) omitted_words |= valid_from_word;
  return unchanged_words & ~omitted_words;
}

template <class Visit>
void for_each_word(std::uint32_t words, Visit visit) noexcept {
  for (; words != 0; words &= words - 1)
    visit(static_cast<std::size_t>(std::countr_zero(words)));
}

}  // namespace

void put_motion(ByteWriter& writer, const Motion& motion) noexcept {
  // Member by member: copying a StoredMotion that was just built would use wide loads, which wait for the
  // narrow stores before them (store forwarding).
  const auto& [p, q, v, w, valid_from] = motion;
  writer.put(p, q.w, q.x, q.y, q.z, v, w, std::int64_t{valid_from.time_since_epoch().count()});
}

void put_partial_motion(ByteWriter& writer, const Motion& motion, std::uint16_t omitted_words) noexcept {
  const MotionWords words = store::words_of(motion);
  std::byte* at = writer.next(partial_motion_bytes(omitted_words));
  for_each_word(stored_words(omitted_words), [&](std::size_t k) {
    std::memcpy(at, &words[k], word_bytes);
    at += word_bytes;
  });
}

void put_row(ByteWriter& writer, const EntityRow& row) noexcept {
  const std::uint32_t light = row.light.valid() ? row.light.index + 1 : 0;
  writer.put(StoredAppearance{{row.scale.x, row.scale.y, row.scale.z},
                              row.mask,
                              static_cast<std::uint16_t>(row.material.index),
                              static_cast<std::uint16_t>(light)});
  put_motion(writer, row.motion);
}

const char* get_motion(ByteReader& reader, Motion& motion) noexcept {
  if (const char* fault = get_partial_motion(reader, 0, {}, motion)) return fault;
  return check_stored(motion);
}

const char* get_partial_motion(ByteReader& reader, std::uint16_t omitted_words, WorldTime world_time,
                               Motion& motion) noexcept {
  if ((omitted_words & ~(unchanged_words | valid_from_is_world_time)) != 0)
    return "a motion omits unknown words";
  if ((omitted_words & valid_from_is_world_time) != 0 && (omitted_words & valid_from_word) != 0)
    return "a motion omits valid_from for two reasons";
  if (reader.left() < partial_motion_bytes(omitted_words)) return "a motion is cut short";
  MotionWords words{};
  for_each_word(stored_words(omitted_words), [&](std::size_t k) { static_cast<void>(reader.get(words[k])); });
  motion = store::motion_of(words);
  if ((omitted_words & valid_from_is_world_time) != 0) motion.valid_from = world_time;
  return nullptr;
}

void complete(Motion& motion, const Motion& before, std::uint16_t unchanged) noexcept {
  MotionWords words = store::words_of(before);
  const MotionWords changed = store::words_of(motion);
  for_each_word(stored_words(unchanged), [&](std::size_t k) { words[k] = changed[k]; });
  motion = store::motion_of(words);
}

const char* check_stored(const Motion& motion) noexcept {
  if (check_motion(motion) || !is_unit(motion.q_world)) return "a motion has invalid values";
  return check_time(motion.valid_from.time_since_epoch().count());
}

const char* get_row(ByteReader& reader, EntityRow& row) noexcept {
  StoredAppearance stored;
  if (!reader.get(stored)) return "a row is cut short";
  row.scale = vector(stored.scale);
  row.mask = stored.mask;
  row.material = {stored.material};
  row.light = stored.light == 0 ? LightId{} : LightId{stored.light - 1u};
  if (const char* fault = get_motion(reader, row.motion)) return fault;
  if (check_row(row)) return "a row has invalid values";
  if (const char* fault = check_light_index(row.light.index)) return fault;
  return check_material_index(row.material.index);
}

const char* check_geometry_index(std::uint32_t index) noexcept {
  const bool possible = index < max_geometries || !GeometryId{index}.valid();
  return possible ? nullptr : "a geometry's index is beyond the limit";
}

const char* check_time(std::int64_t time_ns) noexcept {
  const bool possible = time_ns >= -max_world_time_ns && time_ns <= max_world_time_ns;
  return possible ? nullptr : "a world time is beyond the limit";
}

}  // namespace rtstdb::log
