#pragma once
// The entry of a plug-in: a shared library with module types, which a scenario names under `plugins`.
//
//     #include <hil/plugin.hpp>
//     HIL_PLUGIN("pumps", "1.2.0", pumps::pump_type(), pumps::valve_type())
//
// stands in one of its sources. It defines the function that hil calls, and an ELF note that hil reads from
// the file before it loads it: the name, the version, and the ABI that the plug-in was compiled for. hil
// refuses a plug-in of another ABI, and loads one at most once. It never unloads one.

#include <cstddef>
#include <cstdint>
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

/// The note of a plug-in, in the section .note.hil. `text` has the lines "abi=...", "name=..." and
/// "version=...".
template <std::size_t size>
struct Note {
  std::uint32_t name_bytes = 4, text_bytes = size, type = 1;
  char name[4] = {'h', 'i', 'l', '\0'};
  char text[(size + 3) / 4 * 4] = {};

  constexpr explicit Note(const char (&given)[size]) noexcept {
    for (std::size_t i = 0; i < size; ++i)
      text[i] = given[i];
  }
};

/// The name of the function that returns the module types.
inline constexpr const char* entry_name = "hil_plugin_types";
using Entry = const std::vector<modules::ModuleType>& (*)();

}  // namespace hil::plugins

#define HIL_PLUGIN(NAME, VERSION, ...)                                                                    \
  __attribute__((section(".note.hil"), used, aligned(4))) static constexpr ::hil::plugins::Note hil_note{ \
      "abi=" HIL_ABI "\nname=" NAME "\nversion=" VERSION "\n"};                                           \
  extern "C" __attribute__((visibility("default"))) const std::vector<::hil::modules::ModuleType>&        \
  hil_plugin_types() {                                                                                    \
    static const std::vector<::hil::modules::ModuleType> types{__VA_ARGS__};                              \
    return types;                                                                                         \
  }
