#include "rtstdb/gpu/shader_reflection.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

namespace rtstdb::gpu {
namespace {

// The numbers of the SPIR-V specification (unified1) that reflection needs.
constexpr std::uint32_t magic = 0x07230203;
constexpr std::size_t header_words = 5;

enum Op : std::uint32_t {
  op_member_name = 6,
  op_entry_point = 15,
  op_execution_mode = 16,
  op_capability = 17,
  op_type_int = 21,
  op_type_float = 22,
  op_type_vector = 23,
  op_type_image = 25,
  op_type_sampled_image = 27,
  op_type_struct = 30,
  op_type_pointer = 32,
  op_constant = 43,
  op_variable = 59,
  op_decorate = 71,
  op_member_decorate = 72,
  op_execution_mode_id = 331,
};
enum ExecutionMode : std::uint32_t { mode_local_size = 17, mode_local_size_id = 38 };
enum StorageClass : std::uint32_t {
  class_uniform_constant = 0,
  class_uniform = 2,
  class_push_constant = 9,
  class_storage_buffer = 12,
};
enum Decoration : std::uint32_t { decoration_binding = 33, decoration_set = 34, decoration_offset = 35 };
constexpr std::uint32_t execution_model_vertex = 0, execution_model_fragment = 4, execution_model_compute = 5;
constexpr std::uint32_t dimension_buffer = 5;
constexpr std::uint32_t image_is_sampled = 1;
constexpr std::uint32_t image_is_stored = 2;

using Words = std::span<const std::uint32_t>;

struct Member {
  std::string name;
  std::uint32_t offset = 0;
};

std::string read_string(Words words) {
  std::string text;
  for (const std::uint32_t word : words) {
    for (unsigned shift = 0; shift < 32; shift += 8) {
      const char c = static_cast<char>(word >> shift & 0xffu);
      if (c == '\0') return text;
      text.push_back(c);
    }
  }
  return text;
}

std::optional<ShaderStage> stage_of(std::uint32_t execution_model) {
  switch (execution_model) {
    case execution_model_compute:
      return ShaderStage::compute;
    case execution_model_vertex:
      return ShaderStage::vertex;
    case execution_model_fragment:
      return ShaderStage::fragment;
    default:
      return std::nullopt;
  }
}

/// Collects a module's declarations, from which reflection() derives the result.
class Module {
 public:
  bool read(Words spirv);
  std::optional<ShaderReflection> reflection() const;

 private:
  bool read_instruction(std::uint32_t op, Words operands);
  bool declare_type(std::uint32_t op, Words operands);
  const Words* type(std::uint32_t id, Op op) const;
  std::string field_type(std::uint32_t type_id) const;
  char letter(std::uint32_t storage_class, std::uint32_t type_id) const;
  void flatten(std::uint32_t type_id, std::size_t base, std::vector<ReflectedField>& fields) const;

  std::uint32_t entries_ = 0;
  std::uint32_t execution_model_ = 0;  ///< of the entry
  std::optional<std::array<std::uint32_t, 3>> group_size_;
  std::optional<std::array<std::uint32_t, 3>> group_size_ids_;
  std::vector<std::uint32_t> capabilities_;
  std::map<std::uint32_t, std::pair<std::uint32_t, Words>> types_;  ///< id -> opcode, operands after the id
  std::set<std::uint32_t> referenced_types_;
  std::map<std::uint32_t, std::uint32_t> constants_;
  /// Id -> pointer type, storage class
  std::map<std::uint32_t, std::pair<std::uint32_t, std::uint32_t>> variables_;
  std::map<std::uint32_t, std::uint32_t> sets_, bindings_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, Member> members_;  ///< key: struct type, member index
};

/// The number of operands that read_instruction needs at least.
std::size_t operands_needed(std::uint32_t op) {
  switch (op) {
    case op_capability:
    case op_entry_point:
    case op_type_float:
    case op_type_struct:
      return 1;
    case op_execution_mode:
    case op_execution_mode_id:
    case op_type_int:
    case op_type_sampled_image:
    case op_decorate:
      return 2;
    case op_member_name:
    case op_type_vector:
    case op_type_pointer:
    case op_constant:
    case op_variable:
    case op_member_decorate:
      return 3;
    case op_type_image:
      return 8;
    default:
      return 0;
  }
}

bool Module::read(Words spirv) {
  if (spirv.size() < header_words || spirv[0] != magic) return false;
  for (std::size_t at = header_words; at < spirv.size();) {
    const std::uint32_t length = spirv[at] >> 16;
    const std::uint32_t op = spirv[at] & 0xffffu;
    if (length == 0 || length > spirv.size() - at || length - 1 < operands_needed(op)) return false;
    if (!read_instruction(op, spirv.subspan(at + 1, length - 1))) return false;
    at += length;
  }
  return entries_ == 1 && stage_of(execution_model_).has_value();
}

bool Module::read_instruction(std::uint32_t op, Words operands) {
  const auto group_size = [&]() -> std::array<std::uint32_t, 3> {
    return {operands[2], operands[3], operands[4]};
  };
  switch (op) {
    case op_capability:
      capabilities_.push_back(operands[0]);
      break;
    case op_entry_point:
      ++entries_;
      execution_model_ = operands[0];
      break;
    case op_execution_mode:
    case op_execution_mode_id: {
      if (operands[1] != mode_local_size && operands[1] != mode_local_size_id) break;
      if (operands.size() < 5) return false;
      (operands[1] == mode_local_size ? group_size_ : group_size_ids_) = group_size();
      break;
    }
    case op_member_name:
      members_[{operands[0], operands[1]}].name = read_string(operands.subspan(2));
      break;
    case op_member_decorate:
      if (operands[2] != decoration_offset) break;
      if (operands.size() < 4) return false;
      members_[{operands[0], operands[1]}].offset = operands[3];
      break;
    case op_decorate:
      if (operands[1] != decoration_set && operands[1] != decoration_binding) break;
      if (operands.size() < 3) return false;
      (operands[1] == decoration_set ? sets_ : bindings_)[operands[0]] = operands[2];
      break;
    case op_constant:
      constants_[operands[1]] = operands[2];
      break;
    case op_variable:
      variables_[operands[1]] = {operands[0], operands[2]};
      break;
    case op_type_int:
    case op_type_float:
    case op_type_vector:
    case op_type_image:
    case op_type_sampled_image:
    case op_type_struct:
    case op_type_pointer:
      return declare_type(op, operands);
    default:
      break;
  }
  return true;
}

/// Records a type. Rejects a second declaration of an id and a reference to a later type, so that no type
/// contains itself.
bool Module::declare_type(std::uint32_t op, Words operands) {
  const std::uint32_t id = operands[0];
  const Words rest = operands.subspan(1);
  if (referenced_types_.contains(id) || !types_.emplace(id, std::pair(op, rest)).second) return false;
  switch (op) {
    case op_type_struct:
      referenced_types_.insert(rest.begin(), rest.end());
      break;
    case op_type_pointer:
      referenced_types_.insert(rest[1]);
      break;
    case op_type_vector:
    case op_type_image:
    case op_type_sampled_image:
      referenced_types_.insert(rest[0]);
      break;
    default:
      break;
  }
  return !referenced_types_.contains(id);
}

/// The operands behind the type's id; null when the type is of another kind.
const Words* Module::type(std::uint32_t id, Op op) const {
  const auto found = types_.find(id);
  return found != types_.end() && found->second.first == op ? &found->second.second : nullptr;
}

/// The GLSL name of a scalar or vector of 32-bit components; empty for anything else.
std::string Module::field_type(std::uint32_t type_id) const {
  if (const Words* of_float = type(type_id, op_type_float)) return (*of_float)[0] == 32 ? "float" : "";
  if (const Words* of_int = type(type_id, op_type_int)) {
    if ((*of_int)[0] != 32) return "";
    return of_int->size() > 1 && (*of_int)[1] != 0 ? "int" : "uint";
  }
  const Words* vector = type(type_id, op_type_vector);
  if (vector == nullptr) return "";
  const std::string component = field_type((*vector)[0]);
  if (component.empty()) return "";
  const std::string prefix = component == "float" ? "" : component == "int" ? "i" : "u";
  return prefix + "vec" + std::to_string((*vector)[1]);
}

char Module::letter(std::uint32_t storage_class, std::uint32_t type_id) const {
  if (storage_class == class_storage_buffer) return type(type_id, op_type_struct) != nullptr ? 'S' : '?';
  if (storage_class != class_uniform_constant) return '?';
  if (const Words* sampled_image = type(type_id, op_type_sampled_image)) type_id = (*sampled_image)[0];
  const Words* image = type(type_id, op_type_image);
  if (image == nullptr || (*image)[1] != dimension_buffer) return '?';
  const std::string texel = field_type((*image)[0]);
  if ((*image)[5] == image_is_stored) return texel == "uint" ? 'I' : '?';
  if ((*image)[5] != image_is_sampled) return '?';
  return texel == "uint" ? 'T' : texel == "float" ? 'F' : '?';
}

void Module::flatten(std::uint32_t type_id, std::size_t base, std::vector<ReflectedField>& fields) const {
  const Words* members = type(type_id, op_type_struct);
  if (members == nullptr) return;
  for (std::uint32_t i = 0; i < members->size(); ++i) {
    const auto found = members_.find({type_id, i});
    const Member member = found != members_.end() ? found->second : Member{};
    const std::uint32_t member_type = (*members)[i];
    if (type(member_type, op_type_struct) != nullptr) {
      flatten(member_type, base + member.offset, fields);
    } else {
      fields.push_back({field_type(member_type), member.name, base + member.offset});
    }
  }
}

std::optional<ShaderReflection> Module::reflection() const {
  ShaderReflection result;
  result.stage = *stage_of(execution_model_);
  if (result.stage != ShaderStage::compute) {
    result.group_size = {0, 1, 1};
  } else if (group_size_) {
    result.group_size = *group_size_;
  } else if (group_size_ids_) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto constant = constants_.find((*group_size_ids_)[axis]);
      if (constant == constants_.end()) return std::nullopt;  // not fixed before pipeline creation
      result.group_size[axis] = constant->second;
    }
  } else {
    return std::nullopt;
  }
  for (const auto& [id, variable] : variables_) {
    const auto& [pointer_id, storage_class] = variable;
    const Words* pointer = type(pointer_id, op_type_pointer);
    if (pointer == nullptr) return std::nullopt;
    if (storage_class == class_push_constant) flatten((*pointer)[1], 0, result.push_constants);
    if (storage_class != class_uniform_constant && storage_class != class_uniform &&
        storage_class != class_storage_buffer) {
      continue;
    }
    const auto set = sets_.find(id);
    const auto binding = bindings_.find(id);
    if (set == sets_.end() || binding == bindings_.end()) return std::nullopt;
    result.bindings.push_back({set->second, binding->second, letter(storage_class, (*pointer)[1])});
  }
  std::sort(result.bindings.begin(), result.bindings.end(), [](const auto& a, const auto& b) {
    return std::tie(a.set, a.binding) < std::tie(b.set, b.binding);
  });
  result.capabilities = capabilities_;
  return result;
}

}  // namespace

std::optional<ShaderReflection> reflect_shader(std::span<const std::uint32_t> spirv) {
  Module module;
  if (!module.read(spirv)) return std::nullopt;
  return module.reflection();
}

}  // namespace rtstdb::gpu
