#include "rtstdb/log/stored_row.hpp"

#include <cmath>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/row_check.hpp"

namespace rtstdb::log {
namespace {

/// What normalising leaves: a few last bits away from one.
bool is_unit(const glm::dquat& q) noexcept {
  return std::abs(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z - 1.0) < 1e-12;
}

glm::dvec3 vector(const double (&v)[3]) noexcept {
  return {v[0], v[1], v[2]};
}

}  // namespace

void put_motion(ByteWriter& writer, const Motion& motion) noexcept {
  // A StoredMotion, part by part: one made first would be copied by wide loads, which wait for the narrow stores that made it.
  const auto& [p, q, v, w, valid_from] = motion;
  writer.put(p);
  for (const double number : {q.w, q.x, q.y, q.z})
    writer.put(number);
  writer.put(v);
  writer.put(w);
  writer.put(std::int64_t{valid_from.time_since_epoch().count()});
}

void put_row(ByteWriter& writer, const EntityRow& row) noexcept {
  writer.put(StoredLook{{row.scale.x, row.scale.y, row.scale.z}, row.mask, row.material});
  put_motion(writer, row.motion);
}

const char* get_motion(ByteReader& reader, Motion& motion) noexcept {
  StoredMotion stored;
  if (!reader.get(stored)) return "a motion is cut short";
  const double* q = stored.q_world;
  motion = {vector(stored.p_world_m),
            {q[0], q[1], q[2], q[3]},
            vector(stored.v_world_mps),
            vector(stored.w_world_radps),
            world_time_ns(stored.valid_from_ns)};
  if (check_motion(motion) || !is_unit(motion.q_world)) return "a motion is none that can be written";
  return check_time(stored.valid_from_ns);
}

const char* get_row(ByteReader& reader, EntityRow& row) noexcept {
  StoredLook stored;
  if (!reader.get(stored)) return "a row is cut short";
  row.scale = vector(stored.scale);
  row.mask = stored.mask;
  row.material = stored.material;
  if (const char* fault = get_motion(reader, row.motion)) return fault;
  return check_row(row) ? "a row is none that can be written" : nullptr;
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
