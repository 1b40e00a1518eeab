#pragma once
// Reads members of a glTF file's JSON and refuses members of a wrong type. Internal to the glTF reader.

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>
#include <string_view>

namespace rtstdb::gltf {

using Json = nlohmann::json;

/// Throws std::runtime_error.
[[noreturn]] void refuse(const std::string& fault);

std::string number(std::uint64_t value);

/// Null: `json` is not an object or has no such member.
const Json* member(const Json& json, std::string_view name);

/// The items of `list`; empty if it is null or not an array.
const Json::array_t& items(const Json* list);

/// Empty if it is null or not a string.
std::string text_of(const Json* json);

/// A whole number. `name` and `place` are for error texts.
std::uint64_t whole_number(const Json& value, std::string_view name, const std::string& place);

/// The member `name` of `object`, a whole number; `otherwise` if it is absent.
std::uint64_t whole_or(const Json& object, std::string_view name, std::uint64_t otherwise,
                       const std::string& place);

/// The required member `name` of `object`, a whole number.
std::uint64_t whole(const Json& object, std::string_view name, const std::string& place);

}  // namespace rtstdb::gltf
