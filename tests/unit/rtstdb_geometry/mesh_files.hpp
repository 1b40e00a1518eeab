#pragma once
// Writes small mesh files by hand, byte for byte, for the loader's tests.

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <rtstdb/geometry.hpp>

namespace rtstdb::mesh_files {

/// A folder of its own that is gone with the object.
class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path write(const std::string& name, std::string_view bytes) const;

 private:
  std::filesystem::path path_;
};

std::string obj(const TriangleMesh& mesh);
std::string ascii_stl(const TriangleMesh& mesh);
std::string binary_stl(const TriangleMesh& mesh);
std::string ascii_ply(const TriangleMesh& mesh);
std::string binary_ply(const TriangleMesh& mesh);
/// `nodes`: the JSON of the nodes array; node 0 is the scene's only root, mesh 0 the only mesh.
std::string gltf(const TriangleMesh& mesh, const std::string& nodes);
std::string glb(const TriangleMesh& mesh, const std::string& nodes);

/// The triangles as corner coordinates, each beginning with its least corner (the sense of rotation is kept),
/// sorted: equal for meshes that differ in the order and sharing of corners only.
std::vector<std::array<float, 9>> soup(const TriangleMesh& mesh);

}  // namespace rtstdb::mesh_files
