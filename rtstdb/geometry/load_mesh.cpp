#include <assimp/Importer.hpp>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <exception>
#include <fstream>
#include <iterator>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <rtstdb/geometry.hpp>
#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/bounded_reading.hpp"
#include "rtstdb/geometry/gltf_check.hpp"
#include "rtstdb/geometry/gltf_content.hpp"
#include "rtstdb/geometry/obj_file.hpp"
#include "rtstdb/geometry/ply_file.hpp"
#include "rtstdb/geometry/stl_file.hpp"

namespace rtstdb {
namespace {

constexpr std::array extensions{".obj", ".stl", ".ply", ".gltf", ".glb"};
/// glTF itself needs less than ten levels; extensions and extras some more.
constexpr std::size_t deepest_json = 100;

/// A node's transform to the file's root, summed up in double precision.
struct Affine {
  std::array<std::array<double, 4>, 3> rows;
};

Affine from_assimp(const aiMatrix4x4& m) {
  return {{{{m.a1, m.a2, m.a3, m.a4}, {m.b1, m.b2, m.b3, m.b4}, {m.c1, m.c2, m.c3, m.c4}}}};
}

Affine operator*(const Affine& parent, const Affine& child) {
  Affine product{};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 4; ++c) {
      for (std::size_t k = 0; k < 3; ++k)
        product.rows[r][c] += parent.rows[r][k] * child.rows[k][c];
    }
    product.rows[r][3] += parent.rows[r][3];
  }
  return product;
}

glm::dvec3 transformed(const Affine& m, const aiVector3D& p) {
  const auto row = [&](std::size_t r) {
    return m.rows[r][0] * static_cast<double>(p.x) + m.rows[r][1] * static_cast<double>(p.y) +
           m.rows[r][2] * static_cast<double>(p.z) + m.rows[r][3];
  };
  return {row(0), row(1), row(2)};
}

/// A mirrored node turns the corners' sense of rotation around.
bool mirrors(const Affine& m) {
  const auto& [a, b, c] = m.rows;
  return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
             a[2] * (b[0] * c[1] - b[1] * c[0]) <
         0.0;
}

std::string quoted(const std::filesystem::path& path) {
  return "mesh file '" + path.string() + "'";
}

Error file_error(const std::filesystem::path& path, const std::string& fault) {
  return {ErrorCode::file, quoted(path) + " " + fault};
}

std::string extension_of(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

/// What can be said of the file before it is opened.
Result<void> check_file(const std::filesystem::path& path) {
  std::error_code failed;
  const auto status = std::filesystem::status(path, failed);
  if (!std::filesystem::exists(status)) return file_error(path, "does not exist");
  if (std::filesystem::is_directory(status)) return file_error(path, "is a directory");
  if (!std::filesystem::is_regular_file(status)) return file_error(path, "is not a regular file");
  const auto size = std::filesystem::file_size(path, failed);
  if (failed) return file_error(path, "can not be read: " + failed.message());
  if (size == 0) return file_error(path, "is empty");
  const std::string extension = extension_of(path);
  if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end())
    return file_error(
        path, "has the extension '" + extension + "', and only .obj, .stl, .ply, .gltf and .glb can be read");
  return {};
}

Error too_large() {
  const std::string most = std::to_string(max_triangles_total);
  return {ErrorCode::capacity, "holds more than " + most + " triangles"};
}

/// Appends one mesh of the file without its points and lines; glTF has no polygons.
Result<void> append(TriangleMesh& all, const aiMesh& part, const Affine& to_root, double scale) {
  if (part.mNumVertices > std::size_t{3} * max_triangles_total - all.positions_m.size()) return too_large();
  const auto base = static_cast<std::uint32_t>(all.positions_m.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i)
    all.positions_m.emplace_back(transformed(to_root, part.mVertices[i]) * scale);
  const bool turn_around = mirrors(to_root);
  std::vector<std::uint32_t> corners;
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    const aiFace& face = part.mFaces[i];
    corners.clear();
    for (unsigned k = 0; k < face.mNumIndices; ++k) {
      if (face.mIndices[k] >= part.mNumVertices)
        return Error{ErrorCode::file, "has a face with corner index " + std::to_string(face.mIndices[k]) +
                                          " and only " + std::to_string(part.mNumVertices) + " positions"};
      corners.push_back(base + face.mIndices[k]);
    }
    if (turn_around) std::reverse(corners.begin(), corners.end());
    if (all.triangles.size() + corners.size() > std::size_t{max_triangles_total} + 2) return too_large();
    if (corners.size() == 3) all.triangles.emplace_back(corners[0], corners[1], corners[2]);
  }
  return {};
}

Result<TriangleMesh> flatten(const aiScene& scene, double scale) {
  TriangleMesh all;
  std::vector<std::pair<const aiNode*, Affine>> pending{
      {scene.mRootNode, from_assimp(scene.mRootNode->mTransformation)}};
  while (!pending.empty()) {
    const auto [node, to_root] = pending.back();
    pending.pop_back();
    for (unsigned i = 0; i < node->mNumMeshes; ++i) {
      if (Result<void> done = append(all, *scene.mMeshes[node->mMeshes[i]], to_root, scale); !done)
        return done.error();
    }
    // Last child first onto the stack: meshes come in the file's order.
    for (unsigned i = node->mNumChildren; i-- > 0;)
      pending.emplace_back(node->mChildren[i], to_root * from_assimp(node->mChildren[i]->mTransformation));
  }
  return all;
}

std::string whole_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (!file) throw std::runtime_error("the file can not be opened");
  return bytes;
}

/// What can be said of a glTF file before assimp reads it.
Result<void> check_gltf(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  if (extension != ".gltf" && extension != ".glb") return {};
  const std::string file = whole_file(path);
  const std::size_t depth = json_depth(extension == ".glb" ? glb_json(file) : std::string_view(file));
  if (depth > deepest_json)
    return file_error(path, "nests its JSON " + std::to_string(depth) + " levels deep; " +
                                std::to_string(deepest_json) + " are read");
  const bool is_glb = extension == ".glb";
  if (is_glb) {
    if (const auto fault = glb_fault(file)) return file_error(path, "can not be read: it " + *fault);
  }
  check_gltf_content(is_glb ? glb_json(file) : std::string_view(file),
                     is_glb ? glb_binary(file) : std::string_view(), path.parent_path());
  return {};
}

Result<TriangleMesh> read_by_assimp(const std::filesystem::path& path, double scale) {
  if (Result<void> checked = check_gltf(path); !checked) return checked.error();
  Assimp::Importer importer;
  importer.SetIOHandler(std::make_unique<BoundedReading>().release());  // the importer deletes it
  const aiScene* scene = importer.ReadFile(path.string(), 0);
  if (scene == nullptr) {
    std::string words = importer.GetErrorString();
    return file_error(path, "can not be read: " + (words.empty() ? "the reader gives no reason" : words));
  }
  if (scene->mRootNode == nullptr) return file_error(path, "holds no geometry");
  Result<TriangleMesh> mesh = flatten(*scene, scale);
  if (!mesh) return Error{mesh.error().code, quoted(path) + " " + mesh.error().message};
  return mesh;
}

}  // namespace

Result<TriangleMesh> load_mesh(const std::filesystem::path& path, double scale) {
  if (!std::isfinite(scale) || scale <= 0.0)
    return Error{ErrorCode::bad_input,
                 quoted(path) + ": its scale is " + std::to_string(scale) + ", which is not positive"};
  if (Result<void> checked = check_file(path); !checked) return checked.error();
  try {
    const std::string extension = extension_of(path);
    Result<TriangleMesh> mesh = extension == ".ply"   ? read_ply(whole_file(path), scale)
                                : extension == ".obj" ? read_obj(whole_file(path), scale)
                                : extension == ".stl" ? read_stl(whole_file(path), scale)
                                                      : read_by_assimp(path, scale);
    if (!mesh) return mesh;
    if (Result<void> checked = validate(mesh.value()); !checked)
      return Error{checked.error().code, quoted(path) + ": " + checked.error().message};
    return mesh;
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::out_of_memory, quoted(path) + " does not fit into memory"};
  } catch (const std::exception& failure) {
    return file_error(path, std::string("can not be read: ") + failure.what());
  }
}

}  // namespace rtstdb
