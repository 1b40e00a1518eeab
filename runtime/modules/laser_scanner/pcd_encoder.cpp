#include "runtime/modules/laser_scanner/pcd_encoder.hpp"

#include <bit>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <vector>

namespace hil::modules {
namespace {

static_assert(std::endian::native == std::endian::little, "binary PCD files are little endian");

/// The shortest text that reads back as the same double.
std::string shortest(double value) {
  char digits[32];
  return {digits, std::to_chars(digits, digits + sizeof digits, value).ptr};
}

std::string pcd_header(std::size_t points, const rtstdb::Pose& sensor) {
  const std::string count = std::to_string(points);
  std::string viewpoint;
  for (const double value : {sensor.p_world_m.x, sensor.p_world_m.y, sensor.p_world_m.z, sensor.q_world.w,
                             sensor.q_world.x, sensor.q_world.y, sensor.q_world.z})
    viewpoint += ' ' + shortest(value);
  return "# .PCD v0.7 - Point Cloud Data file format\n"
         "VERSION 0.7\n"
         "FIELDS x y z intensity fraction column row return entity material time\n"
         "SIZE 4 4 4 4 4 4 4 4 4 4 8\n"
         "TYPE F F F F F U U U U U F\n"
         "COUNT 1 1 1 1 1 1 1 1 1 1 1\n"
         "WIDTH " +
         count + "\nHEIGHT 1\nVIEWPOINT" + viewpoint + "\nPOINTS " + count + "\nDATA binary\n";
}

}  // namespace

void PcdEncoder::encode(std::span<std::byte> buffer, std::int64_t /*time_ns*/, FileOutput& files) {
  CloudHead head;
  std::memcpy(&head, buffer.data(), sizeof head);
  const std::span<CloudPoint> points = points_in(buffer);
  const std::string text = pcd_header(points.size(), head.sensor);
  std::vector<std::byte> content(text.size() + points.size_bytes());
  std::memcpy(content.data(), text.data(), text.size());
  if (!points.empty()) std::memcpy(content.data() + text.size(), points.data(), points.size_bytes());
  char number[32];
  std::snprintf(number, sizeof number, "-%06llu.pcd", static_cast<unsigned long long>(head.number));
  files.write(name_ + number, content);
}

}  // namespace hil::modules
