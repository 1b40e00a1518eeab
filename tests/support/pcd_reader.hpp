#pragma once
// Reads binary PCD files as the format's description says, and knows nothing of the program that wrote them:
// https://pointclouds.org/documentation/tutorials/pcd_file_format.html

#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace hil::tests {

struct PcdCloud {
  std::map<std::string, std::vector<double>> fields;  ///< by name: the value of each point
  std::array<double, 7> viewpoint{};                  ///< x, y, z, then the quaternion w, x, y, z
  std::size_t points = 0;
  const std::vector<double>& operator[](const std::string& name) const { return fields.at(name); }
};

namespace pcd_detail {

struct Field {
  std::string name;
  std::size_t size = 0;
  char type = 0;
};

template <class Number>
double read_as(const char* bytes) {
  Number number;
  std::memcpy(&number, bytes, sizeof number);
  return static_cast<double>(number);
}

inline double value_of(const Field& field, const char* bytes) {
  if (field.type == 'F' && field.size == 4) return read_as<float>(bytes);
  if (field.type == 'F' && field.size == 8) return read_as<double>(bytes);
  if (field.type == 'U' && field.size == 1) return read_as<std::uint8_t>(bytes);
  if (field.type == 'U' && field.size == 2) return read_as<std::uint16_t>(bytes);
  if (field.type == 'U' && field.size == 4) return read_as<std::uint32_t>(bytes);
  if (field.type == 'I' && field.size == 4) return read_as<std::int32_t>(bytes);
  throw std::runtime_error("a field of type " + std::string(1, field.type) + std::to_string(field.size));
}

template <class Value>
std::vector<Value> rest_of(std::istringstream& line) {
  std::vector<Value> values;
  for (Value value; line >> value;)
    values.push_back(value);
  return values;
}

}  // namespace pcd_detail

/// Throws runtime_error for a file that the description does not permit.
inline PcdCloud read_pcd(const std::string& file) {
  using namespace pcd_detail;
  // The entries of a header, in the only permitted order.
  std::map<std::string, std::istringstream> entries;
  std::size_t at = 0;
  for (const char* key :
       {"VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA"}) {
    std::string line;
    do {
      const std::size_t end = file.find('\n', at);
      if (end == std::string::npos) throw std::runtime_error("the header ends before " + std::string(key));
      line = file.substr(at, end - at);
      at = end + 1;
    } while (line.starts_with("#"));
    std::istringstream words(line);
    std::string found;
    words >> found;
    if (found != key) throw std::runtime_error(found + " instead of " + key);
    entries[key] = std::move(words);
  }
  const auto names = rest_of<std::string>(entries["FIELDS"]);
  const auto sizes = rest_of<std::size_t>(entries["SIZE"]);
  const auto types = rest_of<char>(entries["TYPE"]);
  const auto counts = rest_of<std::size_t>(entries["COUNT"]);
  const auto viewpoint = rest_of<double>(entries["VIEWPOINT"]);
  const auto number = [&](const char* key) { return rest_of<std::size_t>(entries[key]).at(0); };
  if (names.empty() || sizes.size() != names.size() || types.size() != names.size() ||
      counts != std::vector<std::size_t>(names.size(), 1) || viewpoint.size() != 7)
    throw std::runtime_error("entries of different lengths");
  if (rest_of<std::string>(entries["DATA"]) != std::vector<std::string>{"binary"})
    throw std::runtime_error("not binary");
  PcdCloud cloud;
  cloud.points = number("POINTS");
  if (number("WIDTH") * number("HEIGHT") != cloud.points)
    throw std::runtime_error("WIDTH * HEIGHT != POINTS");
  std::copy(viewpoint.begin(), viewpoint.end(), cloud.viewpoint.begin());
  std::size_t stride = 0;
  for (const std::size_t size : sizes)
    stride += size;
  if (file.size() - at != cloud.points * stride) throw std::runtime_error("another length of the data");
  for (std::size_t point = 0; point < cloud.points; ++point) {
    for (std::size_t k = 0; k < names.size(); ++k) {
      cloud.fields[names[k]].push_back(value_of({names[k], sizes[k], types[k]}, file.data() + at));
      at += sizes[k];
    }
  }
  return cloud;
}

}  // namespace hil::tests
