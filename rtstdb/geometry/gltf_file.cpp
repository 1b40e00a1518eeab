#include "rtstdb/geometry/gltf_file.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/corner_attributes.hpp"
#include "rtstdb/geometry/gltf_accessors.hpp"
#include "rtstdb/geometry/gltf_corners.hpp"
#include "rtstdb/geometry/gltf_json.hpp"
#include "rtstdb/geometry/gltf_transform.hpp"

namespace rtstdb {
namespace gltf {
namespace {

/// Prefixes of extensions that do not change geometry: materials, textures, lights, metadata.
constexpr std::array harmless_extensions{
    "KHR_materials_", "KHR_texture_", "EXT_texture_",   "MSFT_texture_",    "KHR_lights_",  "EXT_lights_",
    "KHR_xmp",        "MSFT_lod",     "KHR_animation_", "ADOBE_materials_", "MSFT_packing_"};

enum class Mode : std::uint8_t { triangles = 4, strip = 5, fan = 6 };

/// Triangles of a mesh; checked.
struct Primitive {
  Mode mode = Mode::triangles;
  Accessor positions;
  CornerAccessors attributes;
  std::optional<Accessor> indices;

  std::uint64_t corners() const { return indices ? indices->count : positions.count; }
  std::uint32_t corner(std::uint64_t k) const {
    std::uint32_t index = static_cast<std::uint32_t>(k);
    if (!indices) return index;
    index = 0;  // little-endian, as this machine is
    std::memcpy(&index, indices->bytes.data() + k * indices->stride, component_bytes(indices->component));
    return index;
  }
  glm::dvec3 position(std::uint64_t k) const {
    std::array<float, 3> values{};
    std::memcpy(values.data(), positions.bytes.data() + k * positions.stride, sizeof values);
    return {values[0], values[1], values[2]};
  }
};

Error too_large() {
  const std::string limit = std::to_string(max_triangles_total);
  return {ErrorCode::capacity, "holds more than " + limit + " triangles"};
}

class Reader {
 public:
  Reader(const Json& root, std::string_view binary, const std::filesystem::path& folder, double scale)
      : root_(root), accessors_(root, binary, folder), scale_(scale) {}

  Result<TriangleMesh> read() {
    check_version();
    check_extensions();
    report.textures_ignored = !items(member(root_, "textures")).empty();
    read_meshes();
    enter_scene();
    while (!pending_.empty()) {
      const Pending next = pending_.back();
      pending_.pop_back();
      if (Result<void> done = read_node(next); !done) return done.error();
    }
    complete_corner_attributes(mesh_);
    return std::move(mesh_);
  }

  MeshFileReport report;

 private:
  struct Pending {
    std::uint64_t node = 0;
    Affine parent_to_root;
  };

  void check_version() const {
    const Json* asset = member(root_, "asset");
    const Json* version = asset != nullptr ? member(*asset, "version") : nullptr;
    if (version == nullptr) refuse("it has no asset.version; glTF 2.0 is read");
    // Some files write 2.0 without quotation marks.
    const std::string text = version->is_string() ? text_of(version) : version->dump();
    if (text != "2" && !text.starts_with("2."))
      refuse("its asset.version is '" + text + "'; glTF 2.0 is read");
  }

  void check_extensions() const {
    for (const Json& extension : items(member(root_, "extensionsRequired"))) {
      const std::string name = text_of(&extension);
      const bool harmless = std::ranges::any_of(harmless_extensions,
                                                [&](const char* prefix) { return name.starts_with(prefix); });
      if (!harmless)
        refuse("it requires the extension '" + name +
               "', which is not implemented; export it without that extension");
    }
  }

  /// Reads all meshes, used or not, so that faults in any of them are refused.
  void read_meshes() {
    const Json::array_t& meshes = items(member(root_, "meshes"));
    meshes_.resize(meshes.size());
    for (std::size_t mesh = 0; mesh < meshes.size(); ++mesh) {
      const Json::array_t& primitives = items(member(meshes[mesh], "primitives"));
      for (std::size_t k = 0; k < primitives.size(); ++k)
        read_primitive(meshes_[mesh], primitives[k], "mesh " + number(mesh) + ", primitive " + number(k));
    }
  }

  void read_primitive(std::vector<Primitive>& mesh, const Json& json, const std::string& place) {
    constexpr std::uint64_t triangles = 4, fan = 6;
    const std::uint64_t mode = whole_or(json, "mode", triangles, place);
    if (mode < triangles) return;  // points and lines
    if (mode > fan) refuse(place + ": its mode is " + number(mode) + "; 0 to 6 are allowed");
    const Json* attributes = member(json, "attributes");
    if (attributes == nullptr || member(*attributes, "POSITION") == nullptr)
      refuse(place + " has no attribute POSITION, and its triangles need one");
    Primitive primitive;
    primitive.mode = static_cast<Mode>(mode);
    primitive.positions = accessors_.at(whole(*attributes, "POSITION", place), place + ": its POSITION");
    const Accessor& positions = primitive.positions;
    if (!positions.has(Component::float32) || positions.type != "VEC3")
      refuse(place + ": its positions (" + positions.name + ") are " + positions.type +
             " of component type " + number(positions.component) +
             "; VEC3 of component type 5126 (float) is allowed");
    primitive.attributes = CornerAccessors(accessors_, *attributes, positions, place);
    report.materials_ignored |= member(json, "material") != nullptr;
    if (member(json, "indices") != nullptr) {
      primitive.indices = accessors_.at(whole(json, "indices", place), place + ": its indices");
      check_indices(primitive, place);
    }
    if (primitive.mode == Mode::triangles && primitive.corners() % 3 != 0)
      refuse(place + ": the count of its corners is " + number(primitive.corners()) +
             ", which is not a multiple of 3");
    mesh.push_back(std::move(primitive));
  }

  static void check_indices(const Primitive& primitive, const std::string& place) {
    const Accessor& indices = *primitive.indices;
    const Accessor& positions = primitive.positions;
    const bool is_index =
        indices.has(Component::byte) || indices.has(Component::int16) || indices.has(Component::int32);
    if (!is_index || indices.type != "SCALAR")
      refuse(place + ": its indices (" + indices.name + ") are " + indices.type + " of component type " +
             number(indices.component) + "; SCALAR of component type 5121, 5123 or 5125 is allowed");
    for (std::uint64_t k = 0; k < indices.count; ++k) {
      const std::uint32_t index = primitive.corner(k);
      if (index >= positions.count)
        refuse(place + ": index " + number(k) + " (" + indices.name + ") is " + number(index) +
               ", and the count of positions (" + positions.name + ") is " + number(positions.count));
    }
  }

  void enter_scene() {
    named_by_.resize(items(member(root_, "nodes")).size());
    if (items(member(root_, "scenes")).empty())
      refuse("it has no scene, which names the nodes that are read");
    const std::uint64_t index = whole_or(root_, "scene", 0, "the file");
    enter_nodes(entry(root_, "scenes", index, "the file's scene"), "nodes", "scene " + number(index), {});
  }

  /// Queues the nodes in `list` of `parent` as the next ones, in its order.
  void enter_nodes(const Json& parent, std::string_view list, const std::string& place,
                   const Affine& parent_to_root) {
    const Json::array_t& nodes = items(member(parent, list));
    const std::size_t first = pending_.size();
    for (const Json& node : nodes) {
      const std::uint64_t index = whole_number(node, "list of " + std::string(list), place);
      entry(root_, "nodes", index, place);
      if (!named_by_[index].empty())
        refuse(place + " names node " + number(index) + ", which " + named_by_[index] +
               " has named; a node has one parent");
      named_by_[index] = place;
      pending_.push_back({index, parent_to_root});
    }
    std::reverse(pending_.begin() + static_cast<std::ptrdiff_t>(first), pending_.end());
  }

  Result<void> read_node(const Pending& next) {
    const Json& node = root_["nodes"][next.node];
    const std::string place = "node " + number(next.node);
    const Affine to_root = next.parent_to_root * node_to_parent(node, place);
    if (member(node, "mesh") != nullptr) {
      const std::uint64_t mesh = whole(node, "mesh", place);
      entry(root_, "meshes", mesh, place);
      for (const Primitive& primitive : meshes_[mesh]) {
        if (Result<void> done = append(primitive, to_root); !done) return done;
      }
    }
    enter_nodes(node, "children", place, to_root);
    return {};
  }

  Result<void> append(const Primitive& primitive, const Affine& to_root) {
    const std::uint64_t corners = primitive.corners();
    const std::uint64_t triangles = primitive.mode == Mode::triangles ? corners / 3
                                    : corners >= 3                    ? corners - 2
                                                                      : 0;
    const std::size_t first = mesh_.positions_m.size();
    if (primitive.positions.count > std::size_t{3} * max_triangles_total - first ||
        triangles > max_triangles_total - mesh_.triangles.size())
      return too_large();
    for (std::uint64_t k = 0; k < primitive.positions.count; ++k)
      mesh_.positions_m.emplace_back(to_root.transformed(primitive.position(k)) * scale_);
    const bool turn_around = to_root.mirrors();
    for (std::uint64_t k = 0; k < triangles; ++k) {
      std::array<std::uint64_t, 3> at{3 * k, 3 * k + 1, 3 * k + 2};
      if (primitive.mode == Mode::strip) at = {k % 2 == 0 ? k : k + 1, k % 2 == 0 ? k + 1 : k, k + 2};
      if (primitive.mode == Mode::fan) at = {0, k + 1, k + 2};
      if (turn_around) std::swap(at[0], at[2]);
      const auto base = static_cast<std::uint32_t>(first);
      const std::array indices{primitive.corner(at[0]), primitive.corner(at[1]), primitive.corner(at[2])};
      mesh_.triangles.emplace_back(base + indices[0], base + indices[1], base + indices[2]);
      append_attributes(primitive.attributes, indices, to_root);
    }
    return {};
  }

  void append_attributes(const CornerAccessors& attributes, const std::array<std::uint32_t, 3>& indices,
                         const Affine& to_root) {
    CornerValues normals{}, colors{};
    for (std::size_t i = 0; i < indices.size(); ++i) {
      if (attributes.has_normals())
        normals[i] = glm::vec3(unit_or_zero(to_root.transformed_normal(attributes.normal(indices[i]))));
      if (attributes.has_colors()) colors[i] = glm::vec3(attributes.color(indices[i]));
    }
    if (attributes.has_normals()) set_last_normals(mesh_, normals);
    if (attributes.has_colors()) set_last_colors(mesh_, colors);
  }

  const Json& root_;
  Accessors accessors_;
  double scale_;
  std::vector<std::vector<Primitive>> meshes_;
  std::vector<std::string> named_by_;  ///< by node; empty: no scene or node has named it
  std::vector<Pending> pending_;       ///< a stack
  TriangleMesh mesh_;
};

}  // namespace
}  // namespace gltf

Result<TriangleMesh> read_gltf(std::string_view json, std::string_view binary,
                               const std::filesystem::path& folder, double scale, MeshFileReport* report) {
  const gltf::Json root = gltf::Json::parse(json);
  gltf::Reader reader(root, binary, folder, scale);
  Result<TriangleMesh> mesh = reader.read();
  if (report != nullptr) *report = reader.report;
  return mesh;
}

}  // namespace rtstdb
