#include "mesh_files.hpp"

#include <glm/common.hpp>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <sstream>

namespace rtstdb::mesh_files {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the formats below are written as memory holds them");

template <class T>
void put(std::string& bytes, const T& value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

void put_position(std::string& bytes, const glm::vec3& p) {
  put(bytes, p.x);
  put(bytes, p.y);
  put(bytes, p.z);
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k > bytes.size() ? '=' : digits[bits >> (18 - 6 * k) & 63u];
  }
  return text;
}

std::string header_of_ply(const TriangleMesh& mesh, std::string_view format) {
  std::ostringstream text;
  text << "ply\nformat " << format << " 1.0\nelement vertex " << mesh.positions_m.size()
       << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << mesh.triangles.size()
       << "\nproperty list uchar int vertex_indices\nend_header\n";
  return text.str();
}

std::string gltf_buffer(const TriangleMesh& mesh) {
  std::string bytes;
  for (const glm::vec3& p : mesh.positions_m)
    put_position(bytes, p);
  for (const glm::uvec3& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i)
      put(bytes, t[i]);
  }
  return bytes;
}

/// For a glTF accessor, also of a mesh with indices beyond its positions.
Bounds bounds_of_positions(const TriangleMesh& mesh) {
  Bounds bounds{mesh.positions_m.at(0), mesh.positions_m.at(0)};
  for (const glm::vec3& position : mesh.positions_m) {
    bounds.minimum_m = glm::min(bounds.minimum_m, position);
    bounds.maximum_m = glm::max(bounds.maximum_m, position);
  }
  return bounds;
}

/// Also has an embedded image, which the reader ignores.
std::string gltf_json(const TriangleMesh& mesh, const std::string& nodes, const std::string& buffer_uri) {
  const Bounds bounds = bounds_of_positions(mesh);
  const std::size_t positions_bytes = mesh.positions_m.size() * 12;
  const std::size_t indices_bytes = mesh.triangles.size() * 12;
  std::ostringstream text;
  text
      << R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":)" << nodes
      << R"(,"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],)"
      << R"("materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"textures":[{"source":0}],)"
      << R"("images":[{"uri":"data:image/png;base64,iVBORw0KGgo="}],)"
      << R"("buffers":[{)" << buffer_uri << R"("byteLength":)" << positions_bytes + indices_bytes << "}],"
      << R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" << positions_bytes
      << R"(},{"buffer":0,"byteOffset":)" << positions_bytes << R"(,"byteLength":)" << indices_bytes
      << R"(}],"accessors":[{"bufferView":0,"componentType":5126,"count":)" << mesh.positions_m.size()
      << R"(,"type":"VEC3","min":[)" << bounds.minimum_m.x << "," << bounds.minimum_m.y << ","
      << bounds.minimum_m.z << R"(],"max":[)" << bounds.maximum_m.x << "," << bounds.maximum_m.y << ","
      << bounds.maximum_m.z << R"(]},{"bufferView":1,"componentType":5125,"count":)"
      << mesh.triangles.size() * 3 << R"(,"type":"SCALAR"}]})";
  return text.str();
}

}  // namespace

std::string obj(const TriangleMesh& mesh) {
  std::ostringstream text;
  text << "# by hand\no body\n";
  for (const glm::vec3& p : mesh.positions_m)
    text << "v " << p.x << " " << p.y << " " << p.z << "\n";
  for (const glm::uvec3& t : mesh.triangles)
    text << "f " << t.x + 1 << " " << t.y + 1 << " " << t.z + 1 << "\n";
  return text.str();
}

std::string ascii_stl(const TriangleMesh& mesh) {
  std::ostringstream text;
  text << "solid body\n";
  for (const glm::uvec3& t : mesh.triangles) {
    text << "facet normal 0 0 0\n outer loop\n";
    for (int i = 0; i < 3; ++i) {
      const glm::vec3& p = mesh.positions_m[t[i]];
      text << "  vertex " << p.x << " " << p.y << " " << p.z << "\n";
    }
    text << " endloop\nendfacet\n";
  }
  text << "endsolid body\n";
  return text.str();
}

std::string binary_stl(const TriangleMesh& mesh) {
  std::string bytes(80, '\0');
  put(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const glm::uvec3& t : mesh.triangles) {
    put_position(bytes, glm::vec3(0.0f));
    for (int i = 0; i < 3; ++i)
      put_position(bytes, mesh.positions_m[t[i]]);
    put(bytes, std::uint16_t{0});
  }
  return bytes;
}

std::string ascii_ply(const TriangleMesh& mesh) {
  std::ostringstream text;
  text << header_of_ply(mesh, "ascii");
  for (const glm::vec3& p : mesh.positions_m)
    text << p.x << " " << p.y << " " << p.z << "\n";
  for (const glm::uvec3& t : mesh.triangles)
    text << "3 " << t.x << " " << t.y << " " << t.z << "\n";
  return text.str();
}

std::string binary_ply(const TriangleMesh& mesh) {
  std::string bytes = header_of_ply(mesh, "binary_little_endian");
  for (const glm::vec3& p : mesh.positions_m)
    put_position(bytes, p);
  for (const glm::uvec3& t : mesh.triangles) {
    put(bytes, std::uint8_t{3});
    for (int i = 0; i < 3; ++i)
      put(bytes, static_cast<std::int32_t>(t[i]));
  }
  return bytes;
}

std::string gltf(const TriangleMesh& mesh, const std::string& nodes) {
  return gltf_json(mesh, nodes,
                   R"("uri":"data:application/octet-stream;base64,)" + base64(gltf_buffer(mesh)) + R"(",)");
}

std::string glb(const TriangleMesh& mesh, const std::string& nodes) {
  std::string json = gltf_json(mesh, nodes, "");
  json.append((4 - json.size() % 4) % 4, ' ');
  const std::string buffer = gltf_buffer(mesh);  // its size is a multiple of 4
  std::string bytes = "glTF";
  put(bytes, std::uint32_t{2});
  put(bytes, static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + buffer.size()));
  put(bytes, static_cast<std::uint32_t>(json.size()));
  bytes += "JSON" + json;
  put(bytes, static_cast<std::uint32_t>(buffer.size()));
  bytes += std::string("BIN\0", 4) + buffer;
  return bytes;
}

std::vector<std::array<float, 9>> soup(const TriangleMesh& mesh) {
  std::vector<std::array<float, 9>> triangles;
  for (const glm::uvec3& t : mesh.triangles) {
    std::array<std::array<float, 3>, 3> corners{};
    for (int i = 0; i < 3; ++i) {
      const glm::vec3 p = mesh.positions_m[t[i]] + 0.0f;  // -0 becomes 0
      corners[static_cast<std::size_t>(i)] = {p.x, p.y, p.z};
    }
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    std::array<float, 9> flat{};
    for (std::size_t i = 0; i < 9; ++i)
      flat[i] = corners[i / 3][i % 3];
    triangles.push_back(flat);
  }
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

}  // namespace rtstdb::mesh_files
