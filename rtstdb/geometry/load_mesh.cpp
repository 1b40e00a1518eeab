#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <exception>
#include <fstream>
#include <iterator>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

#include <rtstdb/geometry.hpp>
#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/gltf_check.hpp"
#include "rtstdb/geometry/gltf_file.hpp"
#include "rtstdb/geometry/obj_file.hpp"
#include "rtstdb/geometry/ply_file.hpp"
#include "rtstdb/geometry/stl_file.hpp"

namespace rtstdb {
namespace {

constexpr std::array extensions{".obj", ".stl", ".ply", ".gltf", ".glb"};
/// glTF needs fewer than ten levels; extensions and extras need a few more.
constexpr std::size_t deepest_json = 100;

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

/// Faults of the file that are known before it is opened.
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

std::string whole_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (!file) throw std::runtime_error("the file can not be opened");
  return bytes;
}

Result<TriangleMesh> read_gltf_file(const std::filesystem::path& path, double scale, MeshFileReport& report) {
  const std::string file = whole_file(path);
  const bool is_glb = extension_of(path) == ".glb";
  const std::string_view json = is_glb ? glb_json(file) : std::string_view(file);
  const std::size_t depth = json_depth(json);
  if (depth > deepest_json)
    return file_error(path, "nests its JSON " + std::to_string(depth) + " levels deep; " +
                                std::to_string(deepest_json) + " are read");
  if (is_glb) {
    if (const auto fault = glb_fault(file)) return file_error(path, "can not be read: it " + *fault);
  }
  Result<TriangleMesh> mesh =
      read_gltf(json, is_glb ? glb_binary(file) : std::string_view(), path.parent_path(), scale, &report);
  if (!mesh) return Error{mesh.error().code, quoted(path) + " " + mesh.error().message};
  return mesh;
}

}  // namespace

Result<TriangleMesh> load_mesh(const std::filesystem::path& path, double scale, MeshFileReport* report) {
  if (!std::isfinite(scale) || scale <= 0.0)
    return Error{ErrorCode::bad_input,
                 quoted(path) + ": its scale is " + std::to_string(scale) + ", which is not positive"};
  if (Result<void> checked = check_file(path); !checked) return checked.error();
  try {
    const std::string extension = extension_of(path);
    MeshFileReport found;
    Result<TriangleMesh> mesh = extension == ".ply"   ? read_ply(whole_file(path), scale, &found)
                                : extension == ".obj" ? read_obj(whole_file(path), scale, &found)
                                : extension == ".stl" ? read_stl(whole_file(path), scale)
                                                      : read_gltf_file(path, scale, found);
    if (!mesh) return mesh;
    if (Result<void> checked = validate(mesh.value()); !checked)
      return Error{checked.error().code, quoted(path) + ": " + checked.error().message};
    if (report != nullptr) *report = found;
    return mesh;
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::out_of_memory, quoted(path) + " does not fit into memory"};
  } catch (const std::exception& failure) {
    return file_error(path, std::string("can not be read: ") + failure.what());
  }
}

}  // namespace rtstdb
