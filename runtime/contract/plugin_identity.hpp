#pragma once
// Which plug-in it is, for records. Threads: plain data.

#include <string>

namespace hil::plugins {

struct PluginIdentity {
  std::string name, version;  ///< as it says itself
  std::string path;           ///< absolute
  std::string hash;           ///< of the file: 16 hexadecimal digits (XXH64)
};

}  // namespace hil::plugins
