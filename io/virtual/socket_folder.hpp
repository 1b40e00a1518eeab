#pragma once
// A folder of its own for a bus's socket: /tmp/hil-bus-XXXXXX, removed at the end. One whose owner was killed is
// removed by the next that is made: the owner holds a lock on its folder, which the kernel drops with it.
//
// Threads: one.

#include <string>

#include "io/virtual/descriptor.hpp"

namespace hil::io::virtual_bus {

class SocketFolder {
 public:
  /// None.
  SocketFolder() = default;
  /// Under $TMPDIR, or /tmp. Throws DeviceError.
  static SocketFolder make();
  ~SocketFolder();
  SocketFolder(SocketFolder&& other) noexcept = default;
  SocketFolder& operator=(SocketFolder&& other) noexcept = default;

  const std::string& path() const noexcept { return path_; }

 private:
  std::string path_;  ///< without a lock: given away
  process::Descriptor lock_;
};

}  // namespace hil::io::virtual_bus
