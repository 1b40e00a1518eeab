#include "mesh_files.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <sstream>

#include <rtstdb/srgb.hpp>

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

/// Of a mesh with attributes, whose vertices are the corners of its triangles.
const glm::vec3& normal_of_vertex(const TriangleMesh& mesh, std::size_t vertex) {
  return mesh.corner_normals[vertex / 3][vertex % 3];
}
const glm::vec3& color_of_vertex(const TriangleMesh& mesh, std::size_t vertex) {
  return mesh.corner_colors[vertex / 3][vertex % 3];
}
int byte_of(float linear) {
  return static_cast<int>(std::lround(255.0 * srgb_from_linear(static_cast<double>(linear))));
}

std::string header_of_ply(const TriangleMesh& mesh, std::string_view format) {
  std::ostringstream text;
  text << "ply\nformat " << format << " 1.0\nelement vertex " << mesh.positions_m.size()
       << "\nproperty float x\nproperty float y\nproperty float z\n";
  if (!mesh.corner_normals.empty())
    text << "property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\n"
            "property uchar green\nproperty uchar blue\n";
  text << "element face " << mesh.triangles.size()
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
  for (const auto& values : {&mesh.corner_normals, &mesh.corner_colors}) {
    for (const CornerValues& corners : *values)
      for (const glm::vec3& value : corners)
        put_position(bytes, value);
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
  const bool has_attributes = !mesh.corner_normals.empty();
  const std::size_t normals_at = positions_bytes + indices_bytes;
  const std::size_t colors_at = normals_at + (has_attributes ? positions_bytes : 0);
  const std::size_t end = colors_at + (has_attributes ? positions_bytes : 0);
  const auto vectors = [&](int view) {
    return R"({"bufferView":)" + std::to_string(view) + R"(,"componentType":5126,"count":)" +
           std::to_string(mesh.positions_m.size()) + R"(,"type":"VEC3"})";
  };
  std::ostringstream text;
  text
      << R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":)" << nodes
      << R"(,"meshes":[{"primitives":[{"attributes":{"POSITION":0)"
      << (has_attributes ? R"(,"NORMAL":2,"COLOR_0":3)" : "") << R"(},"indices":1,"material":0}]}],)"
      << R"("materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"textures":[{"source":0}],)"
      << R"("images":[{"uri":"data:image/png;base64,iVBORw0KGgo="}],)"
      << R"("buffers":[{)" << buffer_uri << R"("byteLength":)" << end << "}],"
      << R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" << positions_bytes
      << R"(},{"buffer":0,"byteOffset":)" << positions_bytes << R"(,"byteLength":)" << indices_bytes;
  if (has_attributes)
    text << R"(},{"buffer":0,"byteOffset":)" << normals_at << R"(,"byteLength":)" << positions_bytes
         << R"(},{"buffer":0,"byteOffset":)" << colors_at << R"(,"byteLength":)" << positions_bytes;
  text << R"(}],"accessors":[{"bufferView":0,"componentType":5126,"count":)" << mesh.positions_m.size()
       << R"(,"type":"VEC3","min":[)" << bounds.minimum_m.x << "," << bounds.minimum_m.y << ","
       << bounds.minimum_m.z << R"(],"max":[)" << bounds.maximum_m.x << "," << bounds.maximum_m.y << ","
       << bounds.maximum_m.z << R"(]},{"bufferView":1,"componentType":5125,"count":)"
       << mesh.triangles.size() * 3 << R"(,"type":"SCALAR"})";
  if (has_attributes) text << "," << vectors(2) << "," << vectors(3);
  text << "]}";
  return text.str();
}

}  // namespace

TriangleMesh with_attributes(const TriangleMesh& mesh) {
  TriangleMesh made;
  for (const glm::uvec3& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(made.positions_m.size());
    made.triangles.emplace_back(first, first + 1, first + 2);
    CornerValues& normals = made.corner_normals.emplace_back();
    CornerValues& colors = made.corner_colors.emplace_back();
    for (std::uint32_t i = 0; i < 3; ++i) {
      const glm::vec3& p = mesh.positions_m[t[static_cast<int>(i)]];
      made.positions_m.push_back(p);
      normals[i] = glm::normalize(p + glm::vec3(0.25f, 0.5f, 0.125f * static_cast<float>(i)));
      for (int k = 0; k < 3; ++k)
        colors[i][k] = static_cast<float>(linear_from_srgb(
            static_cast<int>(17 * first + 5 * i + 40 * static_cast<std::uint32_t>(k)) % 256 / 255.0));
    }
  }
  return made;
}

std::string obj(const TriangleMesh& mesh) {
  std::ostringstream text;
  text.precision(9);
  text << "# by hand\no body\n";
  const bool has_attributes = !mesh.corner_normals.empty();
  for (std::size_t v = 0; v < mesh.positions_m.size(); ++v) {
    const glm::vec3& p = mesh.positions_m[v];
    text << "v " << p.x << " " << p.y << " " << p.z;
    for (int i = 0; has_attributes && i < 3; ++i)
      text << " " << byte_of(color_of_vertex(mesh, v)[i]) / 255.0;
    text << "\n";
    if (!has_attributes) continue;
    const glm::vec3& n = normal_of_vertex(mesh, v);
    text << "vn " << n.x << " " << n.y << " " << n.z << "\n";
  }
  const auto corner = [&](std::uint32_t vertex) {
    const std::string number = std::to_string(vertex + 1);
    return has_attributes ? number + "//" + number : number;
  };
  for (const glm::uvec3& t : mesh.triangles)
    text << "f " << corner(t.x) << " " << corner(t.y) << " " << corner(t.z) << "\n";
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
  text.precision(9);
  text << header_of_ply(mesh, "ascii");
  for (std::size_t v = 0; v < mesh.positions_m.size(); ++v) {
    const glm::vec3& p = mesh.positions_m[v];
    text << p.x << " " << p.y << " " << p.z;
    if (!mesh.corner_normals.empty()) {
      const glm::vec3& n = normal_of_vertex(mesh, v);
      const glm::vec3& c = color_of_vertex(mesh, v);
      text << " " << n.x << " " << n.y << " " << n.z << " " << byte_of(c.x) << " " << byte_of(c.y) << " "
           << byte_of(c.z);
    }
    text << "\n";
  }
  for (const glm::uvec3& t : mesh.triangles)
    text << "3 " << t.x << " " << t.y << " " << t.z << "\n";
  return text.str();
}

std::string binary_ply(const TriangleMesh& mesh) {
  std::string bytes = header_of_ply(mesh, "binary_little_endian");
  for (std::size_t v = 0; v < mesh.positions_m.size(); ++v) {
    put_position(bytes, mesh.positions_m[v]);
    if (mesh.corner_normals.empty()) continue;
    put_position(bytes, normal_of_vertex(mesh, v));
    for (int i = 0; i < 3; ++i)
      put(bytes, static_cast<std::uint8_t>(byte_of(color_of_vertex(mesh, v)[i])));
  }
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
