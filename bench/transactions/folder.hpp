#pragma once
// A temporary folder under TMPDIR, or in /tmp, on the disk that is measured.

#include <filesystem>

namespace hil::bench {

class Folder {
 public:
  /// Throws std::runtime_error when it can not be created.
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace hil::bench
