#pragma once
// What a plug-in says of itself in its file (hil/plugin.hpp), read without loading it: none of its code runs.
//
// Threads: any; reads files and allocates.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "runtime/contract/plugin_identity.hpp"

namespace hil::plugins {

struct PluginNote {
  std::string abi, name, version;
};

/// The largest size of a file that is read.
inline constexpr std::size_t max_plugin_bytes = std::size_t{1} << 30;

/// The note in the bytes of an ELF file; empty: it is not one for this processor, or has no such note, in
/// which case `fault` says so in a clause.
std::optional<PluginNote> read_note(std::string_view elf, std::string& fault);

/// Empty with a sentence in `fault`: the file can not be read, is no plug-in, or was compiled for another
/// ABI.
std::optional<PluginIdentity> read_plugin(const std::filesystem::path& path, std::string& fault);

}  // namespace hil::plugins
