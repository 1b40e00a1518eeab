#pragma once
// A temporary folder for a bus's socket, /tmp/hil-bus-XXXXXX, removed at the end. The owner holds a lock on
// its folder, which the kernel releases when the owner is killed; the next owner removes folders without a
// lock.
//
// Threads: one.

#include <string>

#include "io/virtual/descriptor.hpp"

namespace hil::io::virtual_bus {

class SocketFolder {
 public:
  /// Owns no folder.
  SocketFolder() = default;
  /// Creates one under $TMPDIR or /tmp. Throws DeviceError.
  static SocketFolder make();
  ~SocketFolder();
  SocketFolder(SocketFolder&& other) noexcept = default;
  SocketFolder& operator=(SocketFolder&& other) noexcept = default;

  const std::string& path() const noexcept { return path_; }

 private:
  std::string path_;  ///< without a lock: moved from
  process::Descriptor lock_;
};

}  // namespace hil::io::virtual_bus
