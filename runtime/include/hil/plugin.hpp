#pragma once
// The entry of a plug-in: a shared library with module types, which a scenario names under `plugins`.
//
//     #include <hil/plugin.hpp>
//     HIL_PLUGIN("pumps", "1.2.0", pumps::pump_type(), pumps::valve_type())
//
// stands in one of its sources. It defines the function that hil calls, and an ELF note that hil reads from
// the file before it loads it: the name, the version, and the ABI that the plug-in was compiled for. hil
// refuses a plug-in of another ABI, and loads one at most once. It never unloads one.

#include <vector>

#include <hil/module.hpp>

#define HIL_TEXT_OF(value) #value
#define HIL_TEXT(value) HIL_TEXT_OF(value)

#ifdef _GLIBCXX_DEBUG
#define HIL_DEBUG_MODE "on"
#else
#define HIL_DEBUG_MODE "off"
#endif

/// What both sides have to agree on: the minor version of hil, the ABI of C++ and of the standard library's
/// strings, and the debug mode of its containers.
#define HIL_ABI                                                          \
  "hil 0.1, C++ ABI " HIL_TEXT(__GXX_ABI_VERSION) ", strings " HIL_TEXT( \
      _GLIBCXX_USE_CXX11_ABI) ", debug mode " HIL_DEBUG_MODE

namespace hil::plugins {

inline constexpr const char* abi = HIL_ABI;

/// The name of the function that returns the module types.
inline constexpr const char* entry_name = "hil_plugin_types";
using Entry = const std::vector<modules::ModuleType>& (*)();

}  // namespace hil::plugins

/// The ELF note alone: the lines "abi=...", "name=..." and "version=..." in the section .note.hil.
#define HIL_PLUGIN_NOTE(NAME, VERSION)                                 \
  __asm__(                                                             \
      ".pushsection .note.hil,\"a\",%note\n"                           \
      ".balign 4\n.long 4\n.long 2f-1f\n.long 1\n.asciz \"hil\"\n"     \
      "1: .ascii \"abi=" HIL_ABI "\\nname=" NAME "\\nversion=" VERSION \
      "\\n\"\n2:\n"                                                    \
      ".balign 4\n.popsection")

#define HIL_PLUGIN(NAME, VERSION, ...)                                                             \
  HIL_PLUGIN_NOTE(NAME, VERSION);                                                                  \
  extern "C" __attribute__((visibility("default"))) const std::vector<::hil::modules::ModuleType>& \
  hil_plugin_types() {                                                                             \
    static const std::vector<::hil::modules::ModuleType> types{__VA_ARGS__};                       \
    return types;                                                                                  \
  }
