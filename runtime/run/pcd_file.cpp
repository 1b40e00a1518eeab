#include "runtime/run/pcd_file.hpp"

#include <bit>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>

namespace hil::run {
namespace {

static_assert(std::endian::native == std::endian::little, "binary PCD files are little endian");

/// The shortest text that reads back as the same double.
std::string shortest(double value) {
  char digits[32];
  return {digits, std::to_chars(digits, digits + sizeof digits, value).ptr};
}

}  // namespace

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

std::string write_pcd(const std::filesystem::path& file, std::span<const modules::CloudPoint> points,
                      const rtstdb::Pose& sensor) {
  errno = 0;
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  const std::string header = pcd_header(points.size(), sensor);
  out.write(header.data(), static_cast<std::streamsize>(header.size()));
  out.write(reinterpret_cast<const char*>(points.data()), static_cast<std::streamsize>(points.size_bytes()));
  out.close();
  if (out) return {};
  return file.string() +
         " can not be written: " + (errno != 0 ? std::strerror(errno) : "the system gives no reason");
}

}  // namespace hil::run
